"""Height response (ADS-33E-PRF 3.3.10.1): how the climb rate follows a step of the vertical control.

In hover and at low speed the climb rate shall look like a first order with a delay for at least 5 s after a step:

    h_dot / delta = K exp(-tau s) / (T s + 1)

K, T and tau are those that fit the recorded climb rate best in the sense of least squares. How well they do is said by

    r^2 = sum of (fitted - mean of recorded)^2 / sum of (recorded - mean of recorded)^2

over the same 5 s. It must lie between 0.97 and 1.03 (it is no correlation and may exceed 1); elsewhere the response is
none of a first order, and no Level is given. Level 1 asks for T up to 5 s and tau up to 0.20 s, Level 2 for tau up to 0.30 s
with any T.

The fit follows the control as it was recorded, held between samples, from the first sample of the record on: a step that
the pilot takes his time to make does not count as delay, provided that the trim is that of before its first movement. Held
between samples, a ramp is followed half a sampling interval late: tau then comes out smaller by that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from levelone.errors import InputError
from levelone.handling.axes import STEADY, first_sample, run_failures
from levelone.handling.history import FloatArray, IntArray, TimeHistory
from levelone.handling.levels import Boundaries, Level, load_boundaries
from levelone.handling.limits import single_limits
from levelone.status import Status

WINDOW = 5.0
"""Time after the input over which the response is fitted, s."""

DETERMINATION = (0.97, 1.03)
"""Range of r^2 in which the response counts as one of a first order."""

RESOLVED = 10.0
"""Largest time constant that the window tells from an integrator, in window lengths: a first order that slow departs from
a ramp by 5 % at its end. Beyond it T has no number, and Level 1 is missed all the same."""

_SHORTEST = 0.02
_STAYS = 0.5


@dataclass(frozen=True, eq=False)
class HeightResponse:
    """First order with delay that fits the climb rate of each run.

    Parameters
    ----------
    gain
        ``[run]``: K, m/s of climb for a unit of the input.
    time_constant
        ``[run]``, s: T.
    delay
        ``[run]``, s: tau, from the input as recorded, all delays included.
    determination
        ``[run]``: r^2.
    level
        ``[run]``, :class:`~levelone.handling.levels.Level`; ``OUTSIDE`` where r^2 leaves its range.
    status
        ``[run]``, of all but T: ``OUTSIDE_REQUIREMENT`` (the numbers stand) where r^2 leaves its range.
    status_time_constant
        ``[run]``, of T and of K: ``RECORD_TOO_SHORT`` where the climb rate grows as by an integrator throughout the window.
    """

    gain: FloatArray
    time_constant: FloatArray
    delay: FloatArray
    determination: FloatArray
    level: IntArray
    status: IntArray
    status_time_constant: IntArray


def height_response(
    history: TimeHistory,
    channel: str = "V_vert",
    *,
    input_name: str | None = None,
    window: float = WINDOW,
    boundaries: Boundaries | None = None,
) -> HeightResponse:
    """First-order fit of the climb rate of every run of a record.

    Parameters
    ----------
    history
        Response to a step of collective (``delta_col``) or of commanded climb (``V_vert_ref``) that stays.
    channel
        Climb rate, m/s, positive up.
    input_name
        Channel of the input; the record's own by default.
    window
        s after the input that are fitted.
    boundaries
        Level boundaries; those that ship by default.

    Raises
    ------
    InputError
        A missing channel, a window that is not positive, or boundaries without ``limits.height_response``.

    Notes
    -----
    Least squares: K follows from T and tau in closed form; T and tau are searched from the best point of a coarse grid.
    """
    if not (math.isfinite(window) and window > 0.0):
        raise InputError("window", f"is {window} s, must be positive")
    limits = _limits(boundaries or load_boundaries())
    climb, source = history.change(channel), history.change(input_name or history.input_name)
    start = int(first_sample(history, history.input_on))
    end = int(first_sample(history, history.input_on + window)) + 1
    status = _statuses(history, climb, source, start, end)
    fits = np.full((history.n_runs, 4), np.nan)
    for run in np.flatnonzero(status == Status.OK):
        fits[run] = _fit(climb[run, start:end], source[run, :end], history.dt, window)
    gain, time_constant, delay, determination = np.ascontiguousarray(fits.T)
    low, high = DETERMINATION
    outside = (status == Status.OK) & ~((determination >= low) & (determination <= high))
    status = np.where(outside, Status.OUTSIDE_REQUIREMENT, status)
    slow = time_constant >= RESOLVED * window
    return HeightResponse(
        gain=np.where(slow, np.nan, gain),
        time_constant=np.where(slow, np.nan, time_constant),
        delay=delay,
        determination=determination,
        level=np.where(outside, Level.OUTSIDE, height_levels(time_constant, delay, *limits)),
        status=status,
        status_time_constant=np.where(slow, Status.RECORD_TOO_SHORT, status),
    )


def height_levels(
    time_constant: FloatArray, delay: FloatArray, level_1_time_constant: float, level_1_delay: float, level_2_delay: float
) -> IntArray:
    """Level of each pair of T and tau, s; undefined where either is NaN."""
    first = (time_constant <= level_1_time_constant) & (delay <= level_1_delay)
    level = np.where(first, Level.LEVEL_1, np.where(delay <= level_2_delay, Level.LEVEL_2, Level.LEVEL_3))
    return np.where(np.isnan(time_constant) | np.isnan(delay), Level.UNDEFINED, level)


def first_order(source: FloatArray, time_constant: float, delay: float, dt: float) -> FloatArray:
    """Answer of exp(-tau s) / (T s + 1) to an input held between samples, ``[time]``, from rest; exact at every sample."""
    shift = math.floor(delay / dt)
    rest = (shift + 1) * dt - delay  # from the sample before the delayed time to that time
    decay = math.exp(-dt / time_constant)
    from scipy.signal import lfilter  # here and not above: it takes a second that other criteria need not wait for

    at_samples = np.concatenate([[0.0], lfilter([1.0 - decay], [1.0, -decay], source)[:-1]])
    between = source + (at_samples - source) * math.exp(-rest / time_constant)
    answer = np.zeros(source.size)
    answer[shift + 1 :] = between[: max(source.size - shift - 1, 0)]
    return answer


def _limits(boundaries: Boundaries) -> tuple[float, float, float]:
    values = single_limits(boundaries, "height_response", "level_1_T", "level_1_tau", "level_2_tau")
    if any(value.ndim for value in values):
        raise InputError(f"{boundaries.name}: limits.height_response", "holds a list where a number is needed")
    return float(values[0]), float(values[1]), float(values[2])


def _statuses(history: TimeHistory, climb: FloatArray, source: FloatArray, start: int, end: int) -> IntArray:
    """Status of each run ahead of the fit; the first reason that applies."""
    failures = run_failures(history)
    if end > history.time.size:
        return np.where(failures != Status.OK, failures, Status.RECORD_TOO_SHORT)
    inside, given = climb[:, start:end], source[:, start:end]
    with np.errstate(invalid="ignore"):
        largest, moved = np.abs(given).max(axis=1), np.abs(inside).max(axis=1)
        stays = (np.abs(given[:, -1]) >= _STAYS * largest) & (largest > 0.0)
        before = np.abs(climb[:, :start]).max(axis=1, initial=0.0)
        early = np.abs(source[:, :start]).max(axis=1, initial=0.0)
        unsteady = ~(before <= STEADY * moved) | ~(early <= STEADY * largest)
    gone = ~(np.isfinite(inside).all(axis=1) & np.isfinite(source[:, :end]).all(axis=1))
    return np.select(
        [failures != Status.OK, gone, ~stays, unsteady, ~(moved > 0.0)],
        [failures, Status.RECORD_TOO_SHORT, Status.NO_STEADY_COMMAND, Status.NOT_AT_TRIM, Status.MODEL_FAILED],
        Status.OK,
    )


def _fit(climb: FloatArray, source: FloatArray, dt: float, window: float) -> tuple[float, float, float, float]:
    """K, T, tau and r^2 of one run; the input is that of the whole record up to the end of the window."""
    size = float(np.linalg.norm(climb))
    first = source.size - climb.size

    def gain_and_shape(parameters: FloatArray) -> tuple[float, FloatArray]:
        shape = first_order(source, math.exp(parameters[0]), float(parameters[1]), dt)[first:]
        power = float(shape @ shape)
        return (float(shape @ climb) / power if power > 0.0 else 0.0), shape

    def remainder(parameters: FloatArray) -> FloatArray:
        gain, shape = gain_and_shape(parameters)
        return (gain * shape - climb) / size

    low, high = (math.log(_SHORTEST), 0.0), (math.log(100.0 * RESOLVED * window), 0.5 * window)
    grid = [np.array([x, y]) for x in np.linspace(low[0], high[0], 17) for y in np.linspace(0.0, 0.2 * window, 9)]
    start = min(grid, key=lambda point: float(np.sum(remainder(point) ** 2)))
    inner = np.clip(start, np.array(low) + 1e-6, np.array(high) - 1e-6)
    from scipy.optimize import least_squares

    found = least_squares(remainder, inner, bounds=(low, high), x_scale=(1.0, 0.1), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    gain, shape = gain_and_shape(found.x)
    spread = float(np.sum((climb - climb.mean()) ** 2))
    r2 = float(np.sum((gain * shape - climb.mean()) ** 2)) / spread if spread > 0.0 else math.nan
    return gain, math.exp(found.x[0]), float(found.x[1]), r2
