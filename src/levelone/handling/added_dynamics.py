"""Envelopes of maximum unnoticeable added dynamics: how far a simulation may depart from flight before a pilot notices.

Pilots rated aircraft to which small dynamics had been added; the envelopes hold what they did not notice in the ratio of
the two responses (Wood and Hodgkinson, Definition of Acceptable Levels of Mismatch for Equivalent Systems of Augmented
CTOL Aircraft, MDC A6792, 1980; taken up in MIL-STD-1797A for equivalent systems and by Tischler and Remple, 2nd ed.
2012, chapter 11 and 14, for simulation models). Each bound is the gain or the phase of one transfer function:

    gain above    (3.16 s^2 + 31.61 s + 22.79) / (s^2 + 27.14 s + 1.84)
    gain below    (0.0955 s^2 + 9.92 s + 2.15) / (s^2 + 11.60 s + 4.95)
    phase above   (68.89 s^2 + 1100.12 s - 275.22) / (s^2 + 39.94 s + 9.99) exp(0.0059 s)
    phase below   (475.32 s^2 + 184100 s + 29456.1) / (s^2 + 11.66 s + 0.0389) exp(-0.0072 s)

The coefficients are recalled and confirmed by no text at hand: the envelopes must be drawn as unverified. They stem from
fighters in up-and-away flight; for a hovering aircraft no envelopes of its own are known here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from levelone.errors import InputError
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import FloatArray
from levelone.handling.levels import Confidence
from levelone.handling.mismatch import COHERENCE_MIN, ResponseError, response_error
from levelone.status import Status

OMEGA = (0.5, 10.0)
"""rad/s: range in which responses are compared, that in which a pilot closes loops on attitude."""
POINTS = 40
"""Frequencies at which responses are compared, even in the logarithm."""
CONFIDENCE: Confidence = "low"
SOURCE = "MIL-STD-1797A and MDC A6792 (recalled)"

_GAIN_ABOVE = ((3.16, 31.61, 22.79), (1.0, 27.14, 1.84))
_GAIN_BELOW = ((0.0955, 9.92, 2.15), (1.0, 11.60, 4.95))
_PHASE_ABOVE = ((68.89, 1100.12, -275.22), (1.0, 39.94, 9.99), 0.0059)
_PHASE_BELOW = ((475.32, 184100.0, 29456.1), (1.0, 11.66, 0.0389), -0.0072)


@dataclass(frozen=True, eq=False)
class Envelopes:
    """Bounds of the ratio of two responses, ``[point]`` each: gain in dB, phase in rad."""

    omega: FloatArray
    gain_below: FloatArray
    gain_above: FloatArray
    phase_below: FloatArray
    phase_above: FloatArray


@dataclass(frozen=True, eq=False)
class AddedDynamics:
    """Errors of a simulated response against the envelopes.

    Parameters
    ----------
    error
        Gain and phase of simulation over flight.
    envelopes
        Bounds at the same frequencies.
    inside_gain, inside_phase
        ``[point]``: whether the error lies within its bounds; false where it cannot be read.
    share
        Fraction of the frequencies that could be read at which both lie inside; NaN where none could.
    status
        Of the share.
    """

    error: ResponseError
    envelopes: Envelopes
    inside_gain: npt.NDArray[np.bool_]
    inside_phase: npt.NDArray[np.bool_]
    share: float
    status: Status

    @property
    def verdict(self) -> str:
        """The share in words: ``"inside"`` only where every frequency that could be read is."""
        if self.status is not Status.OK:
            return self.status.text
        return "inside" if self.share == 1.0 else "outside"


def envelopes(omega: npt.ArrayLike) -> Envelopes:
    """Envelopes at the given frequencies, rad/s.

    Raises
    ------
    InputError
        A frequency that is not finite and positive.
    """
    at = np.asarray(omega, dtype=np.float64)
    if not (np.isfinite(at).all() and (at > 0.0).all()):
        raise InputError("omega", "must be finite and positive")
    return Envelopes(
        omega=at,
        gain_below=_gain(at, *_GAIN_BELOW),
        gain_above=_gain(at, *_GAIN_ABOVE),
        phase_below=_phase(at, *_PHASE_BELOW),
        phase_above=_phase(at, *_PHASE_ABOVE),
    )


def added_dynamics(
    simulation: FrequencyResponse,
    flight: FrequencyResponse,
    *,
    omega_min: float = OMEGA[0],
    omega_max: float = OMEGA[1],
    points: int = POINTS,
    coherence_min: float = COHERENCE_MIN,
) -> AddedDynamics:
    """Whether a pilot would notice what sets a simulated response apart from a flown one.

    Parameters
    ----------
    simulation, flight, omega_min, omega_max, points, coherence_min
        As for :func:`~levelone.handling.mismatch.response_error`; the range is cut to what both responses hold.

    Raises
    ------
    InputError
        As :func:`~levelone.handling.mismatch.response_error`.
    """
    error = response_error(simulation, flight, omega_min=omega_min, omega_max=omega_max, points=points, coherence_min=coherence_min)
    bounds = envelopes(error.omega)
    with np.errstate(invalid="ignore"):
        inside_gain = (error.gain >= bounds.gain_below) & (error.gain <= bounds.gain_above)
        inside_phase = (error.phase >= bounds.phase_below) & (error.phase <= bounds.phase_above)
    share = float((inside_gain & inside_phase).sum() / error.used) if error.used else float("nan")
    return AddedDynamics(error, bounds, inside_gain, inside_phase, share, error.status)


def _gain(omega: FloatArray, numerator: tuple[float, ...], denominator: tuple[float, ...]) -> FloatArray:
    s = 1j * omega
    return np.asarray(20.0 * np.log10(np.abs(np.polyval(numerator, s) / np.polyval(denominator, s))), dtype=np.float64)


def _phase(omega: FloatArray, numerator: tuple[float, ...], denominator: tuple[float, ...], lead: float) -> FloatArray:
    """Phase, rad. Numerator and denominator each stay in the upper half plane, so that their angles need no unwrapping."""
    s = 1j * omega
    angle = np.angle(np.polyval(numerator, s)) - np.angle(np.polyval(denominator, s)) + lead * omega
    return np.asarray(angle, dtype=np.float64)
