"""Dynamic stability (ADS-33E-PRF 3.3.2.3): damping ratio and natural frequency from a free response.

A pulse is given and released; once every delay has passed, the response is free. Its first peak and the valley
after it, both from trim, are half a cycle apart, so that for a second-order oscillation their ratio x is exp(-pi
zeta / sqrt(1 - zeta^2)):

    zeta = -ln x / sqrt(pi^2 + ln^2 x),    omega_n = (2 pi / T) / sqrt(1 - zeta^2)

with T from the first to the second peak (logarithmic decrement over half a cycle; Meirovitch, Fundamentals of
Vibrations, 2001, chapter 2, gives it over whole cycles). A growing oscillation has x above 1 and a negative zeta.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from levelone.errors import InputError
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
from levelone.handling.peaks import Extrema, extrema
from levelone.handling.picks import Picks
from levelone.status import Status

PROMINENCE = 0.005
"""How far the rate must turn back for an extremum to count, as a fraction of the first peak: a second peak is that
small at a damping ratio of 0.65, a valley at 0.86."""


@dataclass(frozen=True, eq=False)
class DynamicStability:
    """Damping of each run.

    Parameters
    ----------
    zeta
        ``[run]``: damping ratio.
    omega_n
        ``[run]``, rad/s: undamped natural frequency.
    peak_ratio
        ``[run]``: magnitude of the first valley over that of the first peak.
    damped_period
        ``[run]``, s: from the first to the second peak.
    times, values
        ``[run, 3]``, s and rad/s: first peak, first valley and second peak of the rate's change from trim.
    level
        ``[run]``, :class:`~levelone.handling.levels.Level`.
    status
        ``[run]``, of ``zeta``.
    status_omega
        ``[run]``, of ``omega_n``, which needs one peak more.
    picks
        What was read.
    """

    zeta: FloatArray
    omega_n: FloatArray
    peak_ratio: FloatArray
    damped_period: FloatArray
    level: IntArray
    status: IntArray
    status_omega: IntArray
    picks: Picks

    reads: ClassVar[dict[str, tuple[int, ...]]] = {"status": (0, 1), "status_omega": (0, 1, 2)}

    @property
    def times(self) -> FloatArray:
        """``[run, 3]``, s."""
        return self.picks.time

    @property
    def values(self) -> FloatArray:
        """``[run, 3]``, rad/s."""
        return self.picks.value


def dynamic_stability(
    history: TimeHistory,
    axis: RotationAxis = "pitch",
    *,
    prominence: float = PROMINENCE,
    boundaries: Boundaries | None = None,
) -> DynamicStability:
    """Damping ratio and natural frequency of every run, from the rate after ``input_off + delay``.

    Parameters
    ----------
    history
        Response to a pulse; needs the rate and attitude of the axis, and the time at which the input ends.
    axis
        ``"pitch"`` (q), ``"roll"`` (p) or ``"yaw"`` (r).
    prominence
        Fraction of the first peak by which the rate must turn back for an extremum to count.
    boundaries
        Level boundaries; those that ship by default.

    Raises
    ------
    InputError
        Unknown axis, a missing channel, an input that never ends, or a prominence outside 0 to 1.

    Notes
    -----
    The first peak is the first extremum of either sign in the free response.
    """
    if np.isnan(history.input_off):
        raise InputError("input_off", "is NaN: a free response needs an input that ends, such as a pulse")
    check_prominence(prominence)
    rate, _ = rotation(history, axis)
    free = history.input_off + history.delay
    before = int(first_sample(history, history.input_on))
    q = extrema(rate, before, first_sample(history, free), prominence, 3)
    status, status_omega = _statuses(history, q)
    times = history.time[0] + history.dt * q.place
    ratio = np.where(status == Status.OK, np.abs(q.value[:, 1]) / np.abs(q.value[:, 0]), np.nan)
    zeta = damping_from_ratio(ratio)
    period = np.where(status_omega == Status.OK, times[:, 2] - times[:, 0], np.nan)
    omega_n = 2.0 * np.pi / period / np.sqrt(1.0 - zeta**2)
    half_cycle = np.where(np.isnan(times[:, 1]), times[:, 0] - free, times[:, 1] - times[:, 0])
    return DynamicStability(
        zeta=zeta,
        omega_n=omega_n,
        peak_ratio=ratio,
        damped_period=period,
        level=(boundaries or load_boundaries()).dynamic_stability.levels(omega_n, zeta),
        status=status,
        status_omega=status_omega,
        picks=Picks(free, times, q.value, half_cycle),
    )


def damping_from_ratio(peak_ratio: FloatArray) -> FloatArray:
    """Damping ratio from the ratio of an extremum to the one half a cycle before; above 1 it is negative."""
    log = np.log(peak_ratio)
    return -log / np.sqrt(np.pi**2 + log**2)


def _statuses(history: TimeHistory, q: Extrema) -> tuple[IntArray, IntArray]:
    """Status of zeta and of omega_n, ``[run]``; the first reason that applies."""
    failures = run_failures(history)
    first, valley, second = q.value.T
    # An extremum on the same side of trim as the one before is a turn of a well damped response, not half a cycle.
    no_valley = (q.count >= 2) & (first * valley >= 0.0)
    no_second = (q.count >= 3) & (first * second <= 0.0)
    conditions = [
        failures != Status.OK,
        q.count < 0,
        (q.count == 0) & q.at_rest,
        q.count == 0,
        q.offset > STEADY * np.abs(first),
        no_valley | ((q.count < 2) & q.at_rest),
        q.count < 2,
    ]
    codes: list[IntArray | Status] = [
        failures,
        Status.RECORD_TOO_SHORT,
        Status.NO_FIRST_PEAK,
        Status.RECORD_TOO_SHORT,
        Status.NOT_AT_TRIM,
        Status.NO_VALLEY,
        Status.RECORD_TOO_SHORT,
    ]
    status = np.select(conditions, codes, Status.OK)
    status_omega = np.select(
        [*conditions, no_second | ((q.count < 3) & q.at_rest), q.count < 3],
        [*codes, Status.NO_SECOND_PEAK, Status.RECORD_TOO_SHORT],
        Status.OK,
    )
    return status, status_omega
