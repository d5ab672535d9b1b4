"""Deceleration to hover as a flight test manoeuvre: capture of a hover point, and how well it was done.

The measures are those that a mission task element prescribes: how far past the point, how close to it in the hover that
follows, how much height, lateral track and heading were lost, how long it took, and how far the attitude went. Tolerances are
data; those of the certification text are not public.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from levelone.errors import InputError, unknown_name
from levelone.handling.axes import run_failures
from levelone.handling.history import FloatArray, IntArray, TimeHistory
from levelone.handling.levels import worst
from levelone.status import Status

SLOW = 0.1
"""m/s: ground speed below which the aircraft counts as hovering. Assumed: over a hold of 5 s such a drift is half a metre, the size
of the position tolerances of a vehicle of 3 m span."""
LEFT = 0.01
"""m/s: change of the commanded speed at which the deceleration has begun."""

MEASURES = {
    "overshoot": "m", "position": "m", "height": "m", "lateral": "m", "heading": "rad", "time": "s", "theta": "rad",
}  # fmt: skip
"""Unit of each measure."""
CHANNELS = ("x_north", "y_east", "altitude", "V_lon", "V_lat", "theta", "psi", "V_lon_ref")
"""Channels that the measures are read from."""
AT_CAPTURE = ("position", "time")
"""Measures that exist only where the point was captured."""

BoolArray = npt.NDArray[np.bool_]


class Performance(IntEnum):
    """Performance of a run; the numbers order from good to bad."""

    UNDEFINED = -1
    DESIRED = 1
    ADEQUATE = 2
    NOT_ADEQUATE = 3


@dataclass(frozen=True)
class Tolerances:
    """Largest value of each measure that one standard of performance accepts.

    Parameters
    ----------
    overshoot
        m past the hover point.
    position
        m of distance to go during the hold, either way.
    height, lateral
        m of height and of lateral track, either way.
    heading
        rad, either way.
    time
        s from the first command to decelerate to the capture.
    theta
        rad of pitch attitude from trim, either way.

    Raises
    ------
    InputError
        A tolerance is not finite and positive.
    """

    overshoot: float
    position: float
    height: float
    lateral: float
    heading: float
    time: float
    theta: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value) or value <= 0.0:
                raise InputError(f"tolerances.{field.name}", f"is {value} {MEASURES[field.name]}, must be finite and positive")


@dataclass(frozen=True, eq=False)
class Capture:
    """Deceleration to hover of each run; every array is ``[run]``, SI and rad.

    Parameters
    ----------
    start, captured
        s: first command to decelerate, and capture; NaN where there is none.
    overshoot
        Largest distance past the hover point, 0 where it was never passed.
    position
        Largest distance to go during the hold that follows the capture, either way.
    height, lateral, heading, theta
        Largest change from trim, either way.
    time
        From ``start`` to ``captured``.
    status
        Of ``time`` and ``position``.
    status_motion
        Of the other measures.
    performance
        :class:`Performance` of the run: the worst of its measures.
    performances
        The same for each measure.
    """

    start: FloatArray
    captured: FloatArray
    overshoot: FloatArray
    position: FloatArray
    height: FloatArray
    lateral: FloatArray
    heading: FloatArray
    time: FloatArray
    theta: FloatArray
    status: IntArray
    status_motion: IntArray
    performance: IntArray
    performances: Mapping[str, IntArray]

    def status_of(self, measure: str) -> IntArray:
        """Status of one measure, ``[run]``."""
        return self.status if measure in AT_CAPTURE else self.status_motion


def capture(history: TimeHistory, distance: float, hold: float, desired: Tolerances, adequate: Tolerances) -> Capture:
    """Measures and performance of a deceleration to hover.

    Parameters
    ----------
    history
        Needs :data:`CHANNELS`; flown north. ``V_lon_ref`` is the forward ground speed that the pilot commands.
    distance
        m: hover point north of the start of the record.
    hold
        s for which the hover must be held.
    desired, adequate
        Tolerances of the two standards.

    Raises
    ------
    InputError
        A missing channel, a distance or hold that is not positive, an adequate tolerance below the desired one.

    Notes
    -----
    Captured is the first moment from which the distance to go stays within the adequate tolerance and the ground speed below
    :data:`SLOW` for the whole hold; it is interpolated between samples. Overshoot, height, lateral track, heading and attitude
    count from the start of the record to the end of the hold, at the samples.

    A run that was not captured when the adequate time and the hold have passed is ``NOT_CAPTURED``: its time and position are
    undefined and count as not adequate, and its other measures are those of the whole record. Where the record ends earlier
    nothing is decided (``RECORD_TOO_SHORT``), and without any command to decelerate there is nothing to measure
    (``NO_DECELERATION``): all measures and the performance are undefined.
    """
    _check(history, distance, hold, desired, adequate)
    to_go = distance - history.change("x_north")
    speed = np.hypot(history.channels["V_lon"], history.channels["V_lat"])
    start, samples = _first_command(history), _samples(hold, history.dt)
    first = _first_held((np.abs(to_go) <= adequate.position) & (speed <= SLOW), samples + 1)
    captured = _moment(history, first, (np.abs(to_go), speed), (adequate.position, SLOW))
    status, motion = _statuses(history, start, first, adequate.time + hold)
    values = _motion(history, to_go, first, samples) | {"time": captured - start}
    for name, unmasked in values.items():
        values[name] = np.where((status if name in AT_CAPTURE else motion) == Status.OK, unmasked, np.nan)
    verdicts = {name: _verdict(values[name], status, getattr(desired, name), getattr(adequate, name)) for name in MEASURES}
    return Capture(
        start=np.where(motion == Status.OK, start, np.nan),
        captured=np.where(status == Status.OK, captured, np.nan),
        status=status,
        status_motion=motion,
        performance=worst(*verdicts.values()),
        performances=verdicts,
        **values,
    )


def severity(found: Capture, adequate: Tolerances) -> FloatArray:
    """Largest measure of each run as a part of its adequate tolerance, ``[run]``.

    At most 1 where the run is at least adequate; infinite where the point was not captured, NaN where undefined.
    """
    parts = np.stack([getattr(found, name) / getattr(adequate, name) for name in MEASURES])
    missed = np.where(found.status == Status.NOT_CAPTURED, np.inf, np.nan)
    return np.where(found.status == Status.OK, parts.max(axis=0), missed)


def _check(history: TimeHistory, distance: float, hold: float, desired: Tolerances, adequate: Tolerances) -> None:
    for name in CHANNELS:
        if name not in history.channels:
            raise unknown_name("channel", name, history.channels)
    for name, value in (("distance", distance), ("hold", hold)):
        if not math.isfinite(value) or value <= 0.0:
            raise InputError(name, f"is {value}, must be finite and positive")
    for name in MEASURES:
        if getattr(adequate, name) < getattr(desired, name):
            raise InputError(
                f"adequate.{name}", f"is {getattr(adequate, name)}, must be no smaller than desired, {getattr(desired, name)}"
            )


def _samples(seconds: float, dt: float) -> int:
    """Whole intervals that cover a length of time."""
    return math.ceil(seconds / dt - 1e-6)


def _first_command(history: TimeHistory) -> FloatArray:
    """``[run]``, s: where the commanded speed leaves its trim, NaN where it never does."""
    change = np.abs(history.change("V_lon_ref"))
    left = change > LEFT
    first = np.where(left.any(axis=1), left.argmax(axis=1), -1)
    return _moment(history, first, (change,), (LEFT,))


def _first_held(inside: BoolArray, number: int) -> IntArray:
    """``[run]``: first sample from which ``number`` samples in a row are inside; -1 where there is none."""
    runs, samples = inside.shape
    if number > samples:
        return np.full(runs, -1)
    total = np.zeros((runs, samples + 1), dtype=np.int64)
    np.cumsum(inside, axis=1, out=total[:, 1:])
    whole = total[:, number:] - total[:, :-number] == number
    return np.where(whole.any(axis=1), whole.argmax(axis=1), -1)


def _moment(history: TimeHistory, first: IntArray, signals: Sequence[FloatArray], limits: Sequence[float]) -> FloatArray:
    """``[run]``, s: when the last of the signals, ``[run, time]`` each, crossed its limit on the way to sample ``first``.

    Straight between samples; NaN where ``first`` is negative, the first sample itself where nothing comes before it.
    """
    runs, here = np.arange(first.size), np.maximum(first, 1)
    back = np.ones(first.size)
    for signal, limit in zip(signals, limits, strict=True):
        now, before = signal[runs, here] - limit, signal[runs, here - 1] - limit
        crossed = (now > 0.0) != (before > 0.0)
        back = np.where(crossed, np.minimum(back, now / np.where(crossed, now - before, 1.0)), back)
    times = np.where(first > 0, history.time[here] - back * history.dt, history.time[0])
    return np.where(first >= 0, times, np.nan)


def _statuses(history: TimeHistory, start: FloatArray, first: IntArray, needed: float) -> tuple[IntArray, IntArray]:
    """Status of what needs a capture, and of the other measures."""
    missed = first < 0
    with np.errstate(invalid="ignore"):
        undecided = missed & (history.time[-1] < start + needed - 1e-6 * history.dt)
    failures = run_failures(history)
    motion = np.select(
        [failures != Status.OK, np.isnan(start), undecided],
        [failures, Status.NO_DECELERATION, Status.RECORD_TOO_SHORT],
        Status.OK,
    ).astype(np.int64)
    status = np.where((motion == Status.OK) & missed, Status.NOT_CAPTURED, motion).astype(np.int64)
    return status, motion


def _motion(history: TimeHistory, to_go: FloatArray, first: IntArray, samples: int) -> dict[str, FloatArray]:
    """Largest changes from the start of the record to the end of the hold, and the position during the hold."""
    count = np.arange(history.time.size)
    end = np.where(first >= 0, first + samples, count[-1])[:, None]
    during, held = count <= end, (count >= first[:, None]) & (count <= end)
    heading = (history.change("psi") + np.pi) % (2.0 * np.pi) - np.pi
    return {
        "overshoot": _largest(np.maximum(-to_go, 0.0), during),
        "position": _largest(to_go, held),
        "height": _largest(history.change("altitude"), during),
        "lateral": _largest(history.change("y_east"), during),
        "heading": _largest(heading, during),
        "theta": _largest(history.change("theta"), during),
    }


def _largest(values: FloatArray, where: BoolArray) -> FloatArray:
    """``[run]``: largest magnitude at the samples that count; 0 where none does."""
    return np.max(np.abs(values), axis=1, where=where, initial=0.0)


def _verdict(values: FloatArray, status: IntArray, desired: float, adequate: float) -> IntArray:
    """Performance of one measure; not captured is not adequate where the measure needs a capture."""
    found = np.where(values <= desired, Performance.DESIRED, Performance.ADEQUATE)
    found = np.where(values > adequate, Performance.NOT_ADEQUATE, found)
    absent = np.where(status == Status.NOT_CAPTURED, Performance.NOT_ADEQUATE, Performance.UNDEFINED)
    return np.where(np.isnan(values), absent, found).astype(np.int64)
