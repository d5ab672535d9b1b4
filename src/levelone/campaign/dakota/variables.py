"""Factors as Dakota's uncertain variables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from levelone.errors import InputError
from levelone.uncertainty import Discrete, Factor, FactorSpace, LogNormal, Normal, Triangular, TruncatedNormal, Uniform

Reader = Callable[[Any], tuple[float, ...]]
# Dakota keeps variables by type, in this order, whatever order its input file has; of each: keyword, parameters, how to read them
KINDS: tuple[tuple[type, str, tuple[str, ...], Reader], ...] = (
    (
        TruncatedNormal,
        "normal_uncertain",
        ("means", "std_deviations", "lower_bounds", "upper_bounds"),
        lambda d: (d.centre, d.std, d.low, d.high),
    ),
    (Normal, "normal_uncertain", ("means", "std_deviations"), lambda d: (d.mean, d.std)),
    (LogNormal, "lognormal_uncertain", ("lambdas", "zetas"), lambda d: (d.mu, d.sigma)),
    (Uniform, "uniform_uncertain", ("lower_bounds", "upper_bounds"), lambda d: (d.low, d.high)),
    (Triangular, "triangular_uncertain", ("modes", "lower_bounds", "upper_bounds"), lambda d: (d.mode, d.low, d.high)),
)


def check_expressible(space: FactorSpace) -> None:
    """Refuse what Dakota has no variable for.

    Raises
    ------
    InputError
        A distribution that Dakota does not have; truncated and plain normal factors together, which share one block of Dakota's; a
        name with white space or quotes; correlated discrete factors, which Dakota does not correlate.
    """
    made: dict[type, str] = {}
    for factor in space.factors:
        kind = type(factor.distribution)
        if not isinstance(factor.distribution, (Discrete, *(row[0] for row in KINDS))):
            allowed = ", ".join([row[0].__name__ for row in KINDS] + [Discrete.__name__])
            raise InputError(f"factor {factor.name}", f"Dakota has no variable for {kind.__name__}; allowed: {allowed}")
        check_label(factor.name, f"factor {factor.name}")
        made.setdefault(kind, factor.name)
        if kind is Discrete and space.correlated:
            raise InputError(
                f"factor {factor.name}", "Dakota does not correlate discrete variables: leave it out, or the correlations"
            )
    if Normal in made and TruncatedNormal in made:
        raise InputError(
            f"factor {made[Normal]}",
            f"is normal and {made[TruncatedNormal]} is truncated: Dakota bounds all normal variables or none; truncate it, for "
            "instance at six standard deviations",
        )


def check_label(name: str, field: str) -> None:
    """Refuse a name that Dakota's files would split."""
    if not name or any(letter.isspace() or letter in "'\"#,{}" for letter in name):
        raise InputError(field, f"{name!r} cannot be a name in Dakota's files: no white space, quotes, commas, braces or #")


def ordered(space: FactorSpace) -> tuple[Factor, ...]:
    """The factors in the order of Dakota's own files: by type, and in each type as they are."""
    continuous = [factor for kind, *_ in KINDS for factor in space.factors if isinstance(factor.distribution, kind)]
    return (*continuous, *(factor for factor in space.factors if isinstance(factor.distribution, Discrete)))


def variables_block(space: FactorSpace) -> str:
    """The ``variables`` section of an input file; numbers to the last bit.

    An interval is treated as uniform, as everywhere outside a probability box. Rank correlations become
    ``uncertain_correlation_matrix``: Dakota's Latin hypercube pairs its strata so that the sample has them.

    Raises
    ------
    InputError
        As :func:`check_expressible`.
    """
    check_expressible(space)
    lines = ["variables"]
    for kind, keyword, parameters, read in KINDS:
        chosen = [factor for factor in space.factors if isinstance(factor.distribution, kind)]
        if chosen:
            rows = [read(factor.distribution) for factor in chosen]
            lines.append(f"  {keyword} = {len(chosen)}")
            lines += [f"    {name} {_numbers(column)}" for name, column in zip(parameters, zip(*rows, strict=True), strict=True)]
            lines.append(f"    descriptors {quoted(factor.name for factor in chosen)}")
    lines += _discrete([factor for factor in space.factors if isinstance(factor.distribution, Discrete)])
    if space.correlation is not None:
        at = [space.index(factor.name) for factor in ordered(space)]
        lines.append("  uncertain_correlation_matrix")
        lines += [f"    {_numbers(space.correlation[i][j] for j in at)}" for i in at]
    return "\n".join(lines)


def _discrete(chosen: Sequence[Factor]) -> list[str]:
    if not chosen:
        return []
    sets = [factor.distribution for factor in chosen if isinstance(factor.distribution, Discrete)]
    return [
        "  discrete_uncertain_set",
        f"    real = {len(sets)}",
        f"      elements_per_variable {' '.join(str(len(each.values)) for each in sets)}",
        f"      elements {_numbers(value for each in sets for value in each.values)}",
        f"      set_probabilities {_numbers(weight for each in sets for weight in each.weights or ())}",
        f"      descriptors {quoted(factor.name for factor in chosen)}",
    ]


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def quoted(names: Iterable[str]) -> str:
    """Names as Dakota reads them."""
    return " ".join(f"'{name}'" for name in names)
