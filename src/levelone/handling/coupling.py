"""Pitch-roll coupling (ADS-33E-PRF 3.3.9.2): how far the aircraft rolls when it is told to pitch, or pitches when told to roll.

The standard divides the largest off-axis attitude change within 4 s of a step by the on-axis attitude change at 4 s.
Under a velocity command the nose is back near trim by then, so that this ratio divides by nearly nothing; it is
withheld there. The ratio that sets the Level divides by the largest on-axis change within the same time instead. It
is never larger than the standard's own ratio, and so never the harsher reading.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from levelone.errors import InputError, unknown_name
from levelone.handling.axes import RATE_AND_ATTITUDE, STEADY, first_sample, run_failures
from levelone.handling.history import FloatArray, IntArray, TimeHistory
from levelone.handling.levels import Boundaries, load_boundaries
from levelone.handling.limits import increasing_pair, levels_up_to
from levelone.handling.peaks import Extrema, extrema, values_at
from levelone.status import Status

WINDOW = 4.0
"""Time after the input in which the standard reads both axes, s."""

RETURNED = 0.2
"""On-axis change at the end of the window, as a fraction of its peak, below which it cannot be divided by."""

ROUNDING = 1e-9
"""Off-axis peak, as a fraction of the on-axis one, that is the arithmetic's and not the aircraft's: it counts as 0, so
that nothing is screened or ranked by rounding errors of a symmetric model."""

_SAME_SAMPLE = 1e-6
_OFF_AXIS = {"pitch": "roll", "roll": "pitch"}


@dataclass(frozen=True, eq=False)
class Coupling:
    """Pitch-roll coupling of each run.

    Parameters
    ----------
    off_axis_peak, on_axis_peak
        ``[run]``, rad: largest magnitude of the attitude's change from trim within the window after the input.
    on_axis_change
        ``[run]``, rad: magnitude of the on-axis change at the end of the window.
    ratio
        ``[run]``: ``off_axis_peak / on_axis_peak``.
    ratio_literal
        ``[run]``: ``off_axis_peak / on_axis_change``, as the standard words it.
    level
        ``[run]``, :class:`~levelone.handling.levels.Level` of ``ratio``.
    status
        ``[run]``, of all but ``ratio_literal``.
    status_literal
        ``[run]``, of ``ratio_literal``: ``ON_AXIS_RETURNED`` where the on-axis attitude is nearly back at trim.
    """

    off_axis_peak: FloatArray
    on_axis_change: FloatArray
    on_axis_peak: FloatArray
    ratio: FloatArray
    ratio_literal: FloatArray
    level: IntArray
    status: IntArray
    status_literal: IntArray


def coupling(
    history: TimeHistory,
    axis: str = "pitch",
    *,
    window: float = WINDOW,
    returned: float = RETURNED,
    boundaries: Boundaries | None = None,
) -> Coupling:
    """Pitch-roll coupling of every run of a record.

    Parameters
    ----------
    history
        Response to a step on one axis (``V_lon`` for pitch); needs ``theta`` and ``phi``, rad.
    axis
        On-axis: ``"pitch"`` (off-axis roll) or ``"roll"`` (off-axis pitch).
    window
        s after the input in which both axes are read.
    returned
        Fraction of its peak that the on-axis change must still hold at the end of the window for ``ratio_literal``.
    boundaries
        Level boundaries; those that ship by default.

    Raises
    ------
    InputError
        Unknown axis, a missing channel, a window that is not positive, a fraction outside 0 to 1, or boundaries
        without ``limits.pitch_roll_coupling``.

    Notes
    -----
    The window is counted from the input, delays included. A vehicle that does not roll at all, but for
    rounding (:data:`ROUNDING`), has a ratio of exactly 0.
    """
    if axis not in _OFF_AXIS:
        raise unknown_name("axis", axis, _OFF_AXIS)
    if not (math.isfinite(window) and window > 0.0):
        raise InputError("window", f"is {window} s, must be positive")
    if not 0.0 < returned < 1.0:
        raise InputError("returned", f"is {returned}, must lie between 0 and 1")
    limits = increasing_pair(boundaries or load_boundaries(), "pitch_roll_coupling", ("level_1", "level_2"))
    on, on_peak, at_end = _read(history, axis, window)
    off, off_peak, off_at_end = _read(history, _OFF_AXIS[axis], window)
    off_peak = np.where(off_peak <= ROUNDING * on_peak, 0.0, off_peak)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio, literal = off_peak / on_peak, off_peak / at_end
    unseen = (on.count < 0) | (off.count < 0) | np.isnan(at_end) | np.isnan(off_at_end)
    moved = np.maximum(on.offset, off.offset) > STEADY * on_peak
    status = _status(history, unseen, moved, ~(on_peak > on.noise) | ~np.isfinite(ratio))
    fine = status == Status.OK
    held = (at_end >= returned * on_peak) & np.isfinite(literal)
    ratio = np.where(fine, ratio, np.nan)
    return Coupling(
        off_axis_peak=np.where(fine, off_peak, np.nan),
        on_axis_change=np.where(fine, at_end, np.nan),
        on_axis_peak=np.where(fine, on_peak, np.nan),
        ratio=ratio,
        ratio_literal=np.where(fine & held, literal, np.nan),
        level=levels_up_to(ratio, *limits),
        status=status,
        status_literal=np.where(fine & ~held, Status.ON_AXIS_RETURNED, status),
    )


def _read(history: TimeHistory, axis: str, window: float) -> tuple[Extrema, FloatArray, FloatArray]:
    """Extrema of an attitude's change within the window, the largest magnitude there and the one at its end, ``[run]``."""
    attitude = history.change(RATE_AND_ATTITUDE[axis][1])
    start = first_sample(history, np.full(history.n_runs, history.input_on))
    end = (history.input_on + window - history.time[0]) / history.dt
    end = float(round(end)) if abs(end - round(end)) < _SAME_SAMPLE else end
    inside, to_end = (np.ascontiguousarray(attitude[:, : max(k + 1, 0)]) for k in (math.floor(end), math.ceil(end)))
    found = extrema(inside, int(start[0]), start, 0.5, 1)
    at_end = np.abs(values_at(to_end, start, np.full(history.n_runs, end)))
    return found, np.fmax(np.abs(found.largest_value), at_end), at_end


def _status(history: TimeHistory, unseen: np.ndarray, moved: np.ndarray, still: np.ndarray) -> IntArray:
    """Status of each run: the first reason that applies."""
    failures = run_failures(history)
    return np.select(
        [failures != Status.OK, unseen, moved, still],
        [failures, Status.RECORD_TOO_SHORT, Status.NOT_AT_TRIM, Status.NO_ATTITUDE_CHANGE],
        Status.OK,
    )
