"""Which extrema a criterion read, so that a changed choice is seen and not mistaken for a changed aircraft."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Protocol, TypeVar

import numpy as np

from levelone.errors import InputError
from levelone.handling.history import FloatArray
from levelone.status import Status


@dataclass(frozen=True, eq=False)
class Picks:
    """Extrema that a criterion read, in the order in which it names them.

    Parameters
    ----------
    start
        ``[run]``, s: from where the record was searched.
    time
        ``[run, pick]``, s; NaN where there is none.
    value
        ``[run, pick]``: change from trim, with its sign, SI.
    half_cycle
        ``[run]``, s: time between the first two extrema of the rate; from the start to the first, where there is
        one only.
    """

    start: FloatArray
    time: FloatArray
    value: FloatArray
    half_cycle: FloatArray


class Picked(Protocol):
    """A criterion's result that says what it picked; ``reads`` names, for each status, the picks behind it."""

    reads: ClassVar[dict[str, tuple[int, ...]]]

    @property
    def picks(self) -> Picks: ...


Result = TypeVar("Result", bound=Picked)


def flag_changed_choice(result: Result, reference: Result, run: int = 0) -> Result:
    """The result with ``PEAK_CHOICE_CHANGED`` where a value was read from another extremum than in the reference.

    Parameters
    ----------
    result
        Quickness or damping of a batch.
    reference
        The same criterion on the nominal vehicle, and which of its runs.

    Raises
    ------
    InputError
        The reference holds no such run.

    Notes
    -----
    The choice counts as changed where a pick has the other sign, or lies further from the reference's time than 0.1 of
    the reference's half-cycle plus 0.3 of the time since the search began: an oscillation whose frequency differs by a
    quarter keeps its picks within that, the next extremum of the same sign lies two half-cycles away. Only values
    that stand are flagged.
    """
    if not 0 <= run < reference.picks.time.shape[0]:
        raise InputError("run", f"{run} is not among the {reference.picks.time.shape[0]} runs of the reference")
    changed = _changed(result.picks, reference.picks, run)
    flagged = {}
    for name, picks in result.reads.items():
        status = getattr(result, name)
        hit = changed[:, list(picks)].any(axis=1) & (status == Status.OK)
        flagged[name] = np.where(hit, np.int64(Status.PEAK_CHOICE_CHANGED), status)
    return replace(result, **flagged)  # type: ignore[type-var]  # every Picked is a dataclass


def _changed(picks: Picks, reference: Picks, run: int) -> np.ndarray:
    since = picks.time - picks.start[:, None]
    since_reference = reference.time[run] - reference.start[run]
    allowed = 0.1 * reference.half_cycle[run] + 0.3 * since_reference
    other_sign = np.sign(picks.value) * np.sign(reference.value[run]) < 0.0
    return other_sign | (np.abs(since - since_reference) > allowed)
