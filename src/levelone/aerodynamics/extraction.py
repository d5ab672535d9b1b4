"""Derivatives from the history of a coefficient under a sinusoidal motion: harmonic fit, and the single-point method.

The motion is A sin(omega t), so that the part of a coefficient in phase with it goes with sin and the part ahead of it by a quarter
of a period with cos. The out-of-phase part divided by A k, k = omega c / (2 V), is C_jq + C_jalphadot for pitch, C_jalphadot for
heave and C_jq for a pure pitch rate.

A failed extraction is NaN with an :class:`~levelone.aerodynamics.outcome.Outcome`; nothing is raised for what a record holds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from levelone.aerodynamics.outcome import Outcome
from levelone.errors import InputError

FloatArray = npt.NDArray[np.float64]

#: harmonics that are fitted together: the higher ones would leak into the first where samples do not tile the period
HARMONICS = 3
#: samples that a period must hold; the fit has seven unknowns
SAMPLES_PER_PERIOD = 16
#: times closer than this share of a period count as equal
ROUNDING = 1e-6
#: change from one period to the next, in parts of the oscillation, that a record may show: a thin aerofoil that starts from rest
#: (0.05 < k < 1) shows less in its second period, whose first harmonic is then right to 0.4 %
TOLERANCE = 0.05
#: what the first harmonic may leave of a motion (root mean square, in parts of the amplitude) for it to count as a sine
SINE = 1e-3


@dataclass(frozen=True)
class Harmonic:
    """First harmonic of a record over its last whole periods; NaN where ``outcome.failed``.

    Parameters
    ----------
    mean
        Mean of the fit.
    in_phase, quadrature
        Factors of sin(omega t) and cos(omega t).
    residual
        Root mean square of what mean and first harmonic leave, divided by the amplitude; NaN for a zero amplitude.
    higher
        The same for the second and third harmonic alone: how far the response is from linear.
    drift
        Change of the first harmonic against the stretch before, divided by the size of the oscillation; NaN where the record is
        shorter than two stretches (``outcome`` UNCHECKED).
    outcome
        What happened.
    """

    mean: float
    in_phase: float
    quadrature: float
    residual: float
    higher: float
    drift: float
    outcome: Outcome


@dataclass(frozen=True)
class Derivative:
    """Parts of a coefficient per rad of motion: in phase (C_jalpha), and out of phase divided by k; NaN where it failed."""

    in_phase: float
    quadrature: float
    outcome: Outcome


def harmonic(time: npt.ArrayLike, values: npt.ArrayLike, omega: float, periods: int = 1, tolerance: float = TOLERANCE) -> Harmonic:
    """Least-squares fit of mean and harmonics over the last whole periods of a record.

    Parameters
    ----------
    time, values
        Times (s), increasing, and the coefficient; both [t]. The motion is A sin(omega t) on this time scale.
    omega
        Angular frequency of the motion (rad/s).
    periods
        Whole periods that are fitted, counted back from the end.
    tolerance
        Largest ``drift``; beyond it the record is not periodic.

    Raises
    ------
    InputError
        Arrays that do not fit together, less than one period, a tolerance that is not positive.
    """
    t, y = _record(time, values)
    if periods < 1:
        raise InputError("periods", f"must be at least 1, got {periods}")
    if not tolerance > 0.0:
        raise InputError("tolerance", f"must be positive, got {tolerance}")
    outcome = _fault(t, y, omega, periods)
    if outcome is not Outcome.OK:
        return _failed(outcome)
    stretch = periods * 2.0 * math.pi / omega
    fit = _fit(t, y, omega, t[-1], stretch)
    drift = math.nan
    outcome = Outcome.UNCHECKED
    if t[-1] - t[0] >= 2.0 * stretch * (1.0 - ROUNDING):
        before = _fit(t, y, omega, t[-1] - stretch, stretch)
        drift = _ratio(math.hypot(fit.in_phase - before.in_phase, fit.quadrature - before.quadrature), fit.scale)
        outcome = Outcome.NOT_PERIODIC if drift > tolerance else Outcome.OK
    if outcome.failed:
        return _failed(outcome, drift)
    amplitude = math.hypot(fit.in_phase, fit.quadrature)
    residual, higher = (_ratio(part, amplitude, undefined=math.nan) for part in (fit.residual, fit.higher))
    return Harmonic(fit.mean, fit.in_phase, fit.quadrature, residual, higher, drift, outcome)


def derivative(fit: Harmonic, amplitude: float, k: float) -> Derivative:
    """A first harmonic per rad of the motion's amplitude (rad); the out-of-phase part also divided by the reduced frequency."""
    outcome = fit.outcome
    if not outcome.failed and not (0.0 < amplitude < math.inf and 0.0 < k < math.inf):
        outcome = Outcome.NO_AMPLITUDE
    if outcome.failed:
        return Derivative(math.nan, math.nan, outcome)
    return Derivative(float(fit.in_phase / amplitude), float(fit.quadrature / (amplitude * k)), outcome)


def single_point(
    time: npt.ArrayLike, values: npt.ArrayLike, alpha: npt.ArrayLike, omega: float, k: float, tolerance: float = TOLERANCE
) -> Derivative:
    """Derivatives read where the incidence passes its mean: half the thickness of the hysteresis loop there / (A k).

    The single-point method of the study (its equation 2) divides by A k as well, but speaks of the thickness; for a linear
    response the loop at the mean incidence is 2 A k (C_jq + C_jalphadot) thick, so half of it is the derivative. The in-phase
    part is read the same way at the largest and smallest incidence. Between samples the records are cubic splines; only the
    last crossings upwards and downwards count.

    Parameters
    ----------
    time, values, alpha
        Times (s), coefficient and incidence (rad; or pitch angle, for a pure rate), all [t]. Any phase and mean of alpha.
    omega, k
        Angular frequency (rad/s) and reduced frequency.
    tolerance
        Largest change of the first harmonic of ``values`` against the period before, as in :func:`harmonic`.

    Raises
    ------
    InputError
        Arrays that do not fit together.
    """
    t, y = _record(time, values)
    _, motion = _record(time, alpha)
    checked = harmonic(t, y, omega, tolerance=tolerance)
    for outcome in (checked.outcome, _fault(t, motion, omega, 1), Outcome.OK if 0.0 < k < math.inf else Outcome.NO_AMPLITUDE):
        if outcome.failed:
            return Derivative(math.nan, math.nan, outcome)
    return _read(t, y, motion, omega, k, checked.outcome)


@dataclass(frozen=True)
class _Fit:
    mean: float
    in_phase: float
    quadrature: float
    residual: float
    higher: float
    scale: float


def _fit(t: FloatArray, y: FloatArray, omega: float, end: float, stretch: float) -> _Fit:
    """Fit over (end - stretch, end]: half open, so that samples which tile the period weigh alike."""
    slack = ROUNDING * 2.0 * math.pi / omega
    part = (t > end - stretch + slack) & (t <= end + slack)
    phase = omega * t[part]
    columns = [wave(order * phase) for order in range(1, HARMONICS + 1) for wave in (np.sin, np.cos)]
    matrix = np.column_stack([np.ones(phase.size), *columns])
    factors = np.linalg.lstsq(matrix, y[part], rcond=None)[0]
    first = matrix[:, :3] @ factors[:3]
    oscillation = y[part] - factors[0]
    # a record that is constant but for rounding has no scale of its own
    scale = max(math.sqrt(2.0) * _rms(oscillation), 1e-12 * float(np.abs(y).max()))
    residual, higher = _rms(y[part] - first), math.sqrt(0.5 * float(factors[3:] @ factors[3:]))
    return _Fit(float(factors[0]), float(factors[1]), float(factors[2]), residual, higher, scale)


def _read(t: FloatArray, y: FloatArray, motion: FloatArray, omega: float, k: float, outcome: Outcome) -> Derivative:
    """The two thicknesses of a loop: along C at mean incidence, and between the ends of the incidence."""
    fit = _fit(t, motion, omega, t[-1], 2.0 * math.pi / omega)
    amplitude = math.hypot(fit.in_phase, fit.quadrature)
    if not amplitude > 0.0:
        return Derivative(math.nan, math.nan, Outcome.NO_AMPLITUDE)
    if fit.residual > SINE * amplitude:
        return Derivative(math.nan, math.nan, Outcome.NOT_SINUSOIDAL)
    incidence, coefficient = CubicSpline(t, motion - fit.mean), CubicSpline(t, y)
    crossings = _last_two(incidence, t, omega)
    extremes = _last_two(incidence.derivative(), t, omega)
    if crossings is None or extremes is None:
        return Derivative(math.nan, math.nan, Outcome.NO_CROSSING)
    upwards, downwards = crossings
    # the slope of the incidence rises through zero at its smallest value
    smallest, largest = extremes
    thickness = float(coefficient(upwards) - coefficient(downwards))
    height = float(coefficient(largest) - coefficient(smallest))
    return Derivative(0.5 * height / amplitude, 0.5 * thickness / (amplitude * k), outcome)


def _last_two(curve: CubicSpline, t: FloatArray, omega: float) -> tuple[float, float] | None:
    """Last times at which a curve passes zero upwards and downwards, within a period (and some slack) of the end."""
    period = 2.0 * math.pi / omega
    roots = np.asarray(curve.roots(extrapolate=False), dtype=float)
    roots = roots[(roots >= t[-1] - 1.05 * period) & np.isfinite(roots)]
    slopes = curve(roots, 1)
    rising, falling = roots[slopes > 0.0], roots[slopes < 0.0]
    if not rising.size or not falling.size:
        return None
    return float(rising[-1]), float(falling[-1])


def _record(time: npt.ArrayLike, values: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    t, y = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    if t.ndim != 1 or t.shape != y.shape:
        raise InputError("values", f"must be one number for each time, got shapes {y.shape} and {t.shape}")
    return t, y


def _fault(t: FloatArray, y: FloatArray, omega: float, periods: int) -> Outcome:
    """What keeps a record from being read at all."""
    if not 0.0 < omega < math.inf:
        return Outcome.NO_FREQUENCY
    if not (np.isfinite(t).all() and np.isfinite(y).all()):
        return Outcome.NOT_FINITE
    if t.size < 2:
        return Outcome.RECORD_TOO_SHORT
    if not np.all(np.diff(t) > 0.0):
        return Outcome.TIME_NOT_INCREASING
    period = 2.0 * math.pi / omega
    if t[-1] - t[0] < periods * period * (1.0 - ROUNDING):
        return Outcome.RECORD_TOO_SHORT
    gaps = np.diff(t)[t[1:] > t[-1] - 2.0 * periods * period]
    if gaps.max() > period / SAMPLES_PER_PERIOD * (1.0 + ROUNDING):
        return Outcome.TOO_FEW_SAMPLES
    return Outcome.OK


def _failed(outcome: Outcome, drift: float = math.nan) -> Harmonic:
    return Harmonic(math.nan, math.nan, math.nan, math.nan, math.nan, drift, outcome)


def _ratio(part: float, whole: float, undefined: float = 0.0) -> float:
    return part / whole if whole > 0.0 else undefined


def _rms(values: FloatArray) -> float:
    return math.sqrt(float(np.mean(values**2)))
