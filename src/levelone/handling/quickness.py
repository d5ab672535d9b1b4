"""Attitude quickness (ADS-33E-PRF 3.3.3), as re-read for an aircraft whose command is a ground speed.

A step in speed turns the aircraft towards its new speed and back: the peak rate over the peak attitude change is
read as in the standard. The smallest attitude change after the peak does not show in such a record; it is taken
where the rate is stationary for the second time after the input.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from levelone.handling.axes import (
    STEADY,
    RotationAxis,
    check_prominence,
    first_sample,
    rotation,
    run_failures,
)
from levelone.handling.history import FloatArray, IntArray, TimeHistory
from levelone.handling.levels import Boundaries, load_boundaries
from levelone.handling.peaks import Extrema, extrema, values_at
from levelone.handling.picks import Picks
from levelone.status import Status

PROMINENCE = 0.02
"""How far the rate must turn back for a stationary point to count, as a fraction of the first peak."""


@dataclass(frozen=True, eq=False)
class Quickness:
    """Attitude quickness of each run.

    Parameters
    ----------
    quickness
        ``[run]``, 1/s: ``q_pk / delta_theta_pk``.
    q_pk, t_q_pk
        ``[run]``, rad/s and s: magnitude and time of the first peak of the rate after the input.
    delta_theta_pk, t_theta_pk
        ``[run]``, rad and s: magnitude and time of the first peak of the attitude change; where the attitude goes
        to its new value without turning back, its largest change.
    delta_theta_min, t_second
        ``[run]``, rad and s: magnitude of the attitude change where the rate is stationary for the second time.
    level
        ``[run]``, :class:`~levelone.handling.levels.Level`; ``OUTSIDE`` where ``delta_theta_min`` leaves the
        requirement's range.
    level_extrapolated
        ``[run]``: the Level that the boundaries, extended straight, would give.
    status
        ``[run]``, of ``quickness``.
    status_min
        ``[run]``, of ``delta_theta_min``.
    picks
        First peak of the rate, peak of the attitude, second stationary point of the rate.
    """

    quickness: FloatArray
    q_pk: FloatArray
    t_q_pk: FloatArray
    delta_theta_pk: FloatArray
    t_theta_pk: FloatArray
    delta_theta_min: FloatArray
    t_second: FloatArray
    level: IntArray
    level_extrapolated: IntArray
    status: IntArray
    status_min: IntArray
    picks: Picks

    reads: ClassVar[dict[str, tuple[int, ...]]] = {"status": (0, 1), "status_min": (0, 2)}


def attitude_quickness(
    history: TimeHistory,
    axis: RotationAxis = "pitch",
    *,
    prominence: float = PROMINENCE,
    boundaries: Boundaries | None = None,
) -> Quickness:
    """Attitude quickness of every run of a record.

    Parameters
    ----------
    history
        Response to a step; needs the rate and attitude of the axis.
    axis
        ``"pitch"`` (q, theta), ``"roll"`` (p, phi) or ``"yaw"`` (r, psi).
    prominence
        Fraction of the first peak by which the rate must turn back for a stationary point to count.
    boundaries
        Level boundaries; those that ship by default.

    Raises
    ------
    InputError
        Unknown axis, a missing channel, or a prominence outside 0 to 1.

    Notes
    -----
    All changes are magnitudes from trim: a forward step that pitches the nose down gives positive values.
    """
    check_prominence(prominence)
    rate, attitude = rotation(history, axis)
    start = first_sample(history, np.full(history.n_runs, history.input_on))
    q = extrema(rate, int(start[0]), start, prominence, 2)
    theta = extrema(attitude, int(start[0]), start, prominence, 1)
    picks, status, status_min = _read(history, q, theta, values_at(attitude, start, q.place[:, 1]))
    times, magnitude = picks.time, np.abs(picks.value)
    chart = (boundaries or load_boundaries()).chart("attitude_quickness", axis)
    ratio = magnitude[:, 0] / magnitude[:, 1]
    level, extrapolated = chart.levels(magnitude[:, 2], ratio)
    return Quickness(
        quickness=ratio,
        q_pk=magnitude[:, 0],
        t_q_pk=times[:, 0],
        delta_theta_pk=magnitude[:, 1],
        t_theta_pk=times[:, 1],
        delta_theta_min=magnitude[:, 2],
        t_second=times[:, 2],
        level=level,
        level_extrapolated=extrapolated,
        status=status,
        status_min=status_min,
        picks=picks,
    )


def _read(history: TimeHistory, q: Extrema, theta: Extrema, at_second: FloatArray) -> tuple[Picks, IntArray, IntArray]:
    """What is read: the peaks of rate and attitude and the second point, and the statuses of both values."""
    turns = theta.count > 0  # elsewhere the attitude comes to rest without turning back
    peak = np.where(turns, theta.value[:, 0], theta.largest_value)
    peak_place = np.where(turns, theta.place[:, 0], theta.largest_place)
    status, status_min = _statuses(history, q, theta, peak, at_second)
    fine, fine_min = status == Status.OK, status_min == Status.OK
    stands = np.column_stack([fine, fine, fine_min])
    value = np.where(stands, np.column_stack([q.value[:, 0], peak, at_second]), np.nan)
    place = np.where(stands, np.column_stack([q.place[:, 0], peak_place, q.place[:, 1]]), np.nan)
    time = history.time[0] + history.dt * place
    start = np.full(history.n_runs, history.input_on)
    half_cycle = np.where(fine_min, history.dt * (q.place[:, 1] - q.place[:, 0]), time[:, 0] - start)
    return Picks(start, time, value, half_cycle), status, status_min


def _statuses(
    history: TimeHistory, q: Extrema, theta: Extrema, peak: FloatArray, at_second: FloatArray
) -> tuple[IntArray, IntArray]:
    """Status of quickness and of the smallest attitude change, ``[run]``; the first reason that applies."""
    failures = run_failures(history)
    conditions = [
        failures != Status.OK,
        (q.count < 0) | (theta.count < 0),
        (q.count == 0) & q.at_rest,
        q.count == 0,
        q.offset > STEADY * np.abs(q.value[:, 0]),
    ]
    codes: list[IntArray | Status] = [
        failures,
        Status.RECORD_TOO_SHORT,
        Status.NO_FIRST_PEAK,
        Status.RECORD_TOO_SHORT,
        Status.NOT_AT_TRIM,
    ]
    still_moving = (theta.count == 0) & ~q.at_rest
    status = np.select(
        [*conditions, still_moving, ~(np.abs(peak) > theta.noise)],
        [*codes, Status.RECORD_TOO_SHORT, Status.NO_ATTITUDE_CHANGE],
        Status.OK,
    )
    status_min = np.select(
        [*conditions, (q.count < 2) & q.at_rest, (q.count < 2) | np.isnan(at_second)],
        [*codes, Status.NO_SECOND_STATIONARY_POINT, Status.RECORD_TOO_SHORT],
        Status.OK,
    )
    return status, status_min
