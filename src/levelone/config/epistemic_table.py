"""The section of a study file on factors that have one value, which is only known to lie in an interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from levelone.config.study_schema import EpistemicTable, in_words
from levelone.errors import InputError, unknown_name
from levelone.uncertainty import FactorSpace
from levelone.uncertainty.distributions import Interval, Uniform
from levelone.uncertainty.evidence import Evidence, focal_boxes


@dataclass(frozen=True)
class Epistemic:
    """Factors that have one value, which is only known to lie in an interval, apart from those that vary.

    Parameters
    ----------
    factors
        Names, in the order of the study's factors.
    outer
        Points of the Latin hypercube over each box of focal intervals.
    inner
        Aleatory sample at each of them; 1 where every factor is epistemic.
    basis
        Why these, in words.
    """

    factors: tuple[str, ...]
    outer: int
    inner: int
    basis: str


def epistemic_of(table: EpistemicTable | None, space: FactorSpace) -> Epistemic | None:
    """Which factors are epistemic, and how their box is searched; None where the study has no such section.

    Factors whose distribution is an interval or evidence always are; the table may name uniform ones as well.

    Raises
    ------
    InputError
        An unknown name or one of a distribution that varies, no epistemic factor at all, one that is correlated with another
        factor, too many boxes, no size of the aleatory sample where one is needed or one where none is, neither source nor assumed.
    """
    if table is None:
        return None
    table.require("epistemic")
    named = _named(table.factors or (), space)
    factors = tuple(each.name for each in space.factors if isinstance(each.distribution, Interval | Evidence) or each.name in named)
    if not factors:
        raise InputError(
            "epistemic",
            "no factor is epistemic: give one the distribution interval or evidence, or name uniform ones in factors; "
            f"the study has {', '.join(space.names)}",
        )
    _require_independent(space, factors)
    focal_boxes([space[name].distribution for name in factors])
    varying = len(space) - len(factors)
    if varying and table.inner is None:
        raise InputError("epistemic.inner", f"missing: {varying} factors vary, and need the size of their sample")
    if not varying and table.inner is not None:
        raise InputError("epistemic.inner", "has no place here: every factor is epistemic, and nothing is left to vary")
    return Epistemic(factors, table.outer, table.inner if table.inner is not None else 1, in_words(table))


def _require_independent(space: FactorSpace, factors: Sequence[str]) -> None:
    """Refuse a correlation with a factor that has one fixed value: it would say how a number varies that does not."""
    for name in factors:
        row = () if space.correlation is None else space.correlation[space.index(name)]
        for other, rank in zip(space.names, row, strict=False):
            if other != name and rank != 0.0:
                what = f"{name} is one unknown value and cannot be correlated with {other}; leave one of them out"
                raise InputError("epistemic", what)


def _named(names: Sequence[str], space: FactorSpace) -> Sequence[str]:
    """The names of a list, each of a factor that is an interval or may count as one."""
    for i, name in enumerate(names, 1):
        if name not in space.names:
            raise unknown_name(f"epistemic.factors.{i}", name, space.names)
        kind = type(space[name].distribution)
        if kind not in (Uniform, Interval, Evidence):
            raise InputError(
                f"epistemic.factors.{i}",
                f"{name!r} has the distribution {kind.__name__.lower()}, by which it varies; allowed: uniform, interval, evidence",
            )
    return names
