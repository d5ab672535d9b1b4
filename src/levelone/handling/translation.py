"""Translational-rate response (ADS-33E-PRF, translational rate Response-Type): how the ground speed follows a step command.

The standard asks for a response that looks like a first order, with an equivalent rise time neither too short nor too
long, and without a noticeable overshoot. A first order reaches 1 - 1/e of its final change after one time constant;
the same reading of any response is its equivalent rise time. Only the rise time has a number in the requirement, so
that it alone sets the Level; overshoot and settling time stand beside it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from levelone.errors import InputError, unknown_name
from levelone.handling.axes import STEADY, first_sample, run_failures
from levelone.handling.history import FloatArray, IntArray, TimeHistory
from levelone.handling.levels import Boundaries, Level, load_boundaries
from levelone.handling.limits import increasing_pair
from levelone.handling.peaks import HALF_WINDOW, extrema, values_at
from levelone.status import Status

RISE = 1.0 - math.exp(-1.0)
"""Fraction of the final change that a first order reaches after one time constant."""

BAND = 0.1
"""Half-width, as a fraction of the commanded change, of the band in which the speed counts as settled: wide enough for
the slow tail of an integrating speed loop in a record of 10 s."""

AT_REST = 0.01
"""Largest movement over the end of the record, as a fraction of the commanded change, that counts as rest."""

_AXES = ("V_lon", "V_lat")
_BISECTIONS = 50


@dataclass(frozen=True, eq=False)
class TranslationalRate:
    """Response of the ground speed of each run.

    Parameters
    ----------
    rise_time
        ``[run]``, s: from the input until the speed first reaches 1 - 1/e of the commanded change.
    overshoot
        ``[run]``: largest change over the commanded change, minus 1; 0 where the command is never exceeded.
    settling_time
        ``[run]``, s: from the input until the speed stays within the band around the command.
    commanded
        ``[run]``, m/s: change that is commanded at the end of the record, with its sign.
    level
        ``[run]``, :class:`~levelone.handling.levels.Level`, from ``rise_time`` alone.
    status
        ``[run]``, of ``rise_time``, ``overshoot`` and ``settling_time``.
    status_level
        ``[run]``, of ``level``: ``LEVEL_2_AT_BEST`` where Level 1 is missed, as no limit of Level 2 is stated.
    """

    rise_time: FloatArray
    overshoot: FloatArray
    settling_time: FloatArray
    commanded: FloatArray
    level: IntArray
    status: IntArray
    status_level: IntArray


def translational_rate(
    history: TimeHistory,
    axis: str = "V_lon",
    *,
    band: float = BAND,
    boundaries: Boundaries | None = None,
) -> TranslationalRate:
    """Equivalent rise time, overshoot and settling time of every run of a record.

    Parameters
    ----------
    history
        Response to a step of commanded ground speed; needs the speed and its command (``V_lon`` and ``V_lon_ref``), m/s.
    axis
        ``"V_lon"`` or ``"V_lat"``, in the heading frame.
    band
        Half-width of the band around the command, as a fraction of the commanded change, that the speed must keep over
        the last tenth of the record.
    boundaries
        Level boundaries; those that ship by default.

    Raises
    ------
    InputError
        Unknown axis, a missing channel, an input that ends, a band outside 0 to 1/e, or boundaries without
        ``limits.translational_rate``.

    Notes
    -----
    The final change is the commanded one: it is read from the command, not guessed from a record that has not come to
    rest. A speed that settles elsewhere has no value. Times are counted from the input, all delays included.
    """
    if axis not in _AXES:
        raise unknown_name("axis", axis, _AXES)
    if not math.isnan(history.input_off):
        raise InputError("input_off", f"is {history.input_off} s: the rise time needs a step that stays")
    if not 0.0 < band < 1.0 - RISE:
        raise InputError("band", f"is {band}, must lie between 0 and {1.0 - RISE:.3g}")
    boundaries = boundaries or load_boundaries()
    start = first_sample(history, np.full(history.n_runs, history.input_on))
    commanded, steady = _command(history, f"{axis}_ref", int(start[0]))
    with np.errstate(over="ignore"):
        y = np.ascontiguousarray(history.change(axis) / np.where(steady, commanded, np.nan)[:, None])
    status = _statuses(history, y, int(start[0]), steady, band)
    fine = status == Status.OK
    rise_time, overshoot, settling_time = _read(history, y, start, fine, band)
    level = rise_time_levels(rise_time, boundaries)
    return TranslationalRate(
        rise_time=rise_time,
        overshoot=overshoot,
        settling_time=settling_time,
        commanded=np.where(fine, commanded, np.nan),
        level=level,
        status=status,
        status_level=np.where(level == Level.LEVEL_2, Status.LEVEL_2_AT_BEST, status),
    )


def rise_time_levels(rise_time: npt.ArrayLike, boundaries: Boundaries) -> IntArray:
    """Level of each rise time, s: Level 1 between both limits, inclusive; otherwise Level 2, at best; undefined where NaN.

    Raises
    ------
    InputError
        The boundaries hold no ``limits.translational_rate``, or not two limits that increase.
    """
    low, high = increasing_pair(boundaries, "translational_rate", ("rise_time_level_1",))
    time = np.asarray(rise_time, dtype=np.float64)
    level = np.where((time >= low) & (time <= high), Level.LEVEL_1, Level.LEVEL_2)
    return np.where(np.isnan(time), Level.UNDEFINED, level)


def _end(samples: int, start: int) -> int:
    """Number of samples in the last tenth of the record after the input, two at least."""
    return max((samples - start) // 10, 2)


def _command(history: TimeHistory, channel: str, start: int) -> tuple[FloatArray, np.ndarray]:
    """Commanded change at the end of the record, and whether it is there and constant, ``[run]``."""
    end = history.change(channel)[:, -_end(history.time.size, start) :]
    with np.errstate(invalid="ignore", over="ignore"):
        commanded = end.mean(axis=1)
        return commanded, (np.ptp(end, axis=1) <= AT_REST * np.abs(commanded)) & (commanded != 0.0)


def _statuses(history: TimeHistory, y: FloatArray, start: int, steady: np.ndarray, band: float) -> IntArray:
    """Status of each run from its change of speed over the commanded one, ``[run, time]``; the first reason that applies."""
    failures = run_failures(history)
    end = y[:, -_end(y.shape[1], start) :]
    with np.errstate(invalid="ignore"):
        unsteady = (np.abs(y[:, :start]) > STEADY).any(axis=1)
        at_rest = np.ptp(end, axis=1) <= AT_REST
    return np.select(
        [
            failures != Status.OK,
            np.full(history.n_runs, y.shape[1] - start <= 2 * HALF_WINDOW + 1),
            ~steady,
            ~np.isfinite(y[:, start:]).all(axis=1),
            unsteady,
            (np.abs(end - 1.0) <= band).all(axis=1),
            at_rest,
        ],
        [
            failures,
            Status.RECORD_TOO_SHORT,
            Status.NO_STEADY_COMMAND,
            Status.RECORD_TOO_SHORT,
            Status.NOT_AT_TRIM,
            Status.OK,
            Status.OTHER_FINAL_SPEED,
        ],
        Status.NOT_SETTLED,
    )


def _read(
    history: TimeHistory, y: FloatArray, start: IntArray, fine: np.ndarray, band: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rise time, overshoot and settling time of the runs that settle, NaN for the others, ``[run]`` each."""
    times = np.full((2, y.shape[0]), np.nan)
    overshoot = np.full(y.shape[0], np.nan)
    if fine.any():
        settled, begin = y[fine], start[fine]
        seen = np.arange(y.shape[1]) >= begin[:, None]
        reached = np.argmax(seen & (settled >= RISE), axis=1)
        outside = seen & (np.abs(settled - 1.0) > band)
        entered = np.where(outside.any(axis=1), y.shape[1] - np.argmax(outside[:, ::-1], axis=1), begin)
        above = np.where(settled[np.arange(len(begin)), entered - 1] > 1.0, -1.0, 1.0)
        places = (
            _reaches(settled, begin, reached, RISE, np.ones(len(begin))),
            _reaches(settled, begin, entered, 1.0 - above * band, above),
        )
        times[:, fine] = history.time[0] + history.dt * np.array(places) - history.input_on
        peak = extrema(np.maximum(settled, 0.0), int(begin[0]), begin, 0.5, 1).largest_value
        overshoot[fine] = np.maximum(peak - 1.0, 0.0)
    return times[0], overshoot, times[1]


def _reaches(y: FloatArray, start: IntArray, sample: IntArray, level: FloatArray | float, sign: FloatArray) -> FloatArray:
    """Place between ``sample - 1`` and ``sample`` at which each row reaches the level, rising where ``sign`` is positive."""
    low, high = np.maximum(sample - 1.0, start), sample.astype(np.float64)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        below = sign * (values_at(y, start, middle) - level) < 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)
