"""Mismatch of two frequency responses of one aircraft, simulated and flown: their errors and the cost J.

With the error of the gain in dB and of the phase in deg at n frequencies, even in the logarithm,

    J = (20 / n) sum of W_gamma (W_g dG^2 + W_p dP^2),    W_g = 1,   W_p = 0.01745,   W_gamma = (1.58 (1 - exp(-gamma^2)))^2

(Tischler and Remple, Aircraft and Rotorcraft System Identification, 2nd ed. 2012, chapters 11 and 14): 7.57 deg count as
much as 1 dB, and a frequency with a coherence of 0.6 half as much as one with 1. A single response is matched well up to
J = 100 and is nearly indistinguishable from the flown one up to 50; the mean over several responses is asked to stay
below 100, while one of them may reach 150 to 200. Weights and limits are recalled from that book and confirmed here by
no second text.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from levelone.errors import InputError
from levelone.handling.frequency import ComplexArray, FrequencyResponse
from levelone.handling.history import FloatArray
from levelone.handling.levels import Confidence
from levelone.status import Status

COHERENCE_MIN = 0.6
"""Least coherence at which a response is compared."""
POINTS = 20
"""Frequencies at which responses are compared, even in the logarithm."""
GOOD, INDISTINGUISHABLE = 100.0, 50.0
"""Largest cost of a good match, and of one that can hardly be told from the flown response."""
CONFIDENCE: Confidence = "low"
SOURCE = "Tischler and Remple, Aircraft and Rotorcraft System Identification, 2nd ed. 2012, chapter 11 (recalled)"

_PHASE_WEIGHT = 0.01745
_COHERENCE_WEIGHT = 1.58


@dataclass(frozen=True, eq=False)
class ResponseError:
    """Simulation against flight on one grid of frequencies; NaN where either cannot be read.

    Parameters
    ----------
    omega
        ``[point]``, rad/s, even in the logarithm.
    gain
        ``[point]``, dB: simulation above flight.
    phase
        ``[point]``, rad: simulation ahead of flight, continuous over frequency, in (-pi, pi] at the first point that can be read.
    coherence
        ``[point]``: the smaller of both, 1 for an exact response.
    status
        Why no point can be read; otherwise ``OK``.
    """

    omega: FloatArray
    gain: FloatArray
    phase: FloatArray
    coherence: FloatArray
    status: Status

    @property
    def used(self) -> int:
        """Number of points that can be read."""
        return int(np.isfinite(self.gain).sum())


@dataclass(frozen=True, eq=False)
class Mismatch:
    """Cost of one pair of responses.

    Parameters
    ----------
    cost
        J; NaN where it has no value.
    gain_part, phase_part
        What the errors of gain and of phase add to it.
    used
        Number of frequencies that it rests on.
    status
        Of all.
    """

    cost: float
    gain_part: float
    phase_part: float
    used: int
    status: Status

    @property
    def verdict(self) -> str:
        """The cost in words."""
        return verdict(self.cost) if self.status is Status.OK else self.status.text


def verdict(cost: float) -> str:
    """A cost, or the mean of several, in words."""
    if math.isnan(cost):
        return "undefined"
    if cost <= INDISTINGUISHABLE:
        return "nearly indistinguishable"
    return "good" if cost <= GOOD else "not good"


def response_error(
    simulation: FrequencyResponse,
    flight: FrequencyResponse,
    *,
    omega_min: float | None = None,
    omega_max: float | None = None,
    points: int = POINTS,
    coherence_min: float = COHERENCE_MIN,
) -> ResponseError:
    """Errors of a simulated response against a flown one, at frequencies that both hold.

    Parameters
    ----------
    simulation, flight
        Single responses of the same output to the same input, in the same units and with the same sign.
    omega_min, omega_max
        rad/s: range of the comparison; by default the widest that both hold with enough coherence.
    points
        Number of frequencies.
    coherence_min
        Least coherence of either response at a frequency that is compared.

    Raises
    ------
    InputError
        A batch, no range in common, fewer than two points, a minimum coherence outside 0 to 1.

    Notes
    -----
    Between frequencies, gain (dB) and phase go straight over the logarithm of frequency; a frequency beside a value that is
    undefined or has too little coherence is not read. Both phases may be counted on branches that differ by whole turns:
    the error is therefore formed from the ratio of both, begins within half a turn, and is continuous from there.
    """
    _check(simulation, flight, points, coherence_min)
    one, other = (_readable(response, coherence_min) for response in (simulation, flight))
    omega = np.geomspace(*_range(simulation, one, flight, other, omega_min, omega_max), points)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = _interpolated(simulation.omega, one, omega) / _interpolated(flight.omega, other, omega)
    read = np.isfinite(ratio) & (ratio != 0.0)
    gain, phase = np.full(points, np.nan), np.full(points, np.nan)
    gain[read] = 20.0 * np.log10(np.abs(ratio[read]))
    phase[read] = np.unwrap(np.angle(ratio[read]))
    coherence = np.minimum(_coherence(simulation, omega), _coherence(flight, omega))
    status = Status.OK if read.any() else _why_not(simulation, flight)
    return ResponseError(omega, gain, phase, np.where(read, coherence, np.nan), status)


def mismatch_cost(error: ResponseError) -> Mismatch:
    """Cost J of one pair of responses from their errors.

    Examples
    --------
    >>> omega = np.geomspace(0.3, 12.0, 50)
    >>> flight = FrequencyResponse(omega, 1.0 / (1j * omega + 1.0))
    >>> print(f"{mismatch_cost(response_error(flight.scaled(10.0 ** 0.1), flight)).cost:.2f}")
    79.80
    """
    if error.status is not Status.OK:
        return Mismatch(math.nan, math.nan, math.nan, 0, error.status)
    read = np.isfinite(error.gain)
    weight = (_COHERENCE_WEIGHT * (1.0 - np.exp(-error.coherence[read]))) ** 2 * 20.0 / read.sum()
    gain_part = float(np.sum(weight * error.gain[read] ** 2))
    phase_part = float(np.sum(weight * _PHASE_WEIGHT * np.degrees(error.phase[read]) ** 2))
    return Mismatch(gain_part + phase_part, gain_part, phase_part, error.used, Status.OK)


def mean_cost(mismatches: Sequence[Mismatch]) -> float:
    """Mean cost of several responses; NaN where one of them has none, or none is given."""
    costs = [mismatch.cost for mismatch in mismatches]
    return float(np.mean(costs)) if costs else math.nan


def _check(simulation: FrequencyResponse, flight: FrequencyResponse, points: int, coherence_min: float) -> None:
    for name, response in (("simulation", simulation), ("flight", flight)):
        if response.value.ndim != 1:
            raise InputError(name, f"holds {response.n_runs} runs: select one")
    if points < 2:
        raise InputError("points", f"is {points}, must be 2 or more")
    if not 0.0 <= coherence_min <= 1.0:
        raise InputError("coherence_min", f"is {coherence_min}, must lie between 0 and 1")


def _readable(response: FrequencyResponse, coherence_min: float) -> ComplexArray:
    if response.coherence is None:
        return response.value
    return np.where(response.coherence >= coherence_min, response.value, np.nan)


def _range(
    simulation: FrequencyResponse,
    one: ComplexArray,
    flight: FrequencyResponse,
    other: ComplexArray,
    omega_min: float | None,
    omega_max: float | None,
) -> tuple[float, float]:
    """Lowest and highest frequency of the comparison, rad/s."""
    held = [_held(response.omega, value) for response, value in ((simulation, one), (flight, other))]
    low, high = max(ends[0] for ends in held), min(ends[1] for ends in held)
    low, high = max(low, omega_min or 0.0), min(high, omega_max or math.inf)
    if not 0.0 < low < high:
        raise InputError(
            "omega_min",
            f"no range in common: simulation {held[0][0]:.4g} to {held[0][1]:.4g} rad/s, flight {held[1][0]:.4g} to "
            f"{held[1][1]:.4g} rad/s, asked for {omega_min} to {omega_max} rad/s",
        )
    return low, high


def _held(omega: FloatArray, value: ComplexArray) -> tuple[float, float]:
    """Ends of the range that can be read; of the whole response where nothing can be, so that the status says why."""
    fine = np.flatnonzero(np.isfinite(value))
    return (float(omega[fine[0]]), float(omega[fine[-1]])) if fine.size else (float(omega[0]), float(omega[-1]))


def _interpolated(omega: FloatArray, value: ComplexArray, at: FloatArray) -> ComplexArray:
    """Gain in dB and phase straight over log frequency; the phase between neighbours takes the shorter way round."""
    k = np.clip(np.searchsorted(omega, at, side="right") - 1, 0, omega.size - 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.log(at / omega[k]) / np.log(omega[k + 1] / omega[k])
        # the ends of a range are frequencies of the response itself, but for rounding: they need no neighbour
        part = np.where(np.abs(part) < 1e-9, 0.0, np.where(np.abs(part - 1.0) < 1e-9, 1.0, part))
        between = value[k] * (value[k + 1] / value[k]) ** part
    inside = (part >= 0.0) & (part <= 1.0)
    return np.where(part == 0.0, value[k], np.where(part == 1.0, value[k + 1], np.where(inside, between, np.nan)))


def _coherence(response: FrequencyResponse, at: FloatArray) -> FloatArray:
    if response.coherence is None:
        return np.ones(at.size)
    return np.interp(np.log(at), np.log(response.omega), response.coherence)


def _why_not(simulation: FrequencyResponse, flight: FrequencyResponse) -> Status:
    """Why no frequency can be read: too little coherence, or no value at all."""
    held = all(np.isfinite(response.value).any() for response in (simulation, flight))
    return Status.LOW_COHERENCE if held else Status.MODEL_FAILED
