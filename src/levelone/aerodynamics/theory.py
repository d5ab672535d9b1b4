"""Closed forms of unsteady thin-aerofoil theory, and the lift slope of the elliptic wing: what the numerical models are held to.

Two-dimensional, incompressible, inviscid, small disturbances, flat wake. Lengths in semichords b = c/2, time as the distance
s = V t / b travelled, reduced frequency k = omega c / (2 V). ``axis`` is the place of the pitch axis and moment point in semichords
aft of mid-chord (leading edge -1, quarter chord -1/2, trailing edge 1). Lift by q c, positive up; moment by q c^2 about the axis,
positive nose up; pitch rate as q c / (2 V).

Sources: Theodorsen, NACA Report 496 (1935); Bisplinghoff, Ashley and Halfman, *Aeroelasticity* (1955), sections 5-6 and 5-7.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy import special

from levelone.errors import InputError

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complexfloating]
Real = float | npt.ArrayLike

QUARTER_CHORD, MID_CHORD = -0.5, 0.0
#: reduced frequencies at which the Bessel functions are good to rounding
LOWEST, HIGHEST = 1e-12, 1e6
#: nodes of the quadrature in u = ln x: the trapezoidal rule converges exponentially there (a step of 0.2 gives the same 14 digits),
#: and what lies below exp(-45) and above exp(40) is less than 1e-8 (Kussner at s = 0) or 1e-18 (Wagner)
STEP = 0.1
NODES = np.arange(-45.0, 40.0, STEP)
#: distances treated together, so that a long record needs little memory
CHUNK = 1024


@dataclass(frozen=True)
class Response:
    """Lift and moment of a harmonic motion for unit amplitude, exp(i omega t) left out.

    Parameters
    ----------
    k
        Reduced frequency, any shape.
    lift, moment
        Complex C_l and C_m per rad of incidence (pitch, heave) or of pitch angle (pure rate), of the same shape.
    """

    k: FloatArray
    lift: ComplexArray
    moment: ComplexArray

    @property
    def lift_quadrature(self) -> FloatArray:
        """Out-of-phase lift divided by k: C_Lq + C_Lalphadot (pitch), C_Lalphadot (heave) or C_Lq (pure rate)."""
        return self.lift.imag / self.k

    @property
    def moment_quadrature(self) -> FloatArray:
        """Out-of-phase moment divided by k, as for the lift."""
        return self.moment.imag / self.k


def theodorsen(k: Real) -> ComplexArray:
    """Theodorsen's function C(k) = F + i G, any shape (Bisplinghoff et al., equation 5-311).

    Raises
    ------
    InputError
        k that is not positive (the limit k -> 0 is :func:`quasi_steady`) or beyond 1e6, where the Bessel functions fail.
    """
    k = _frequency(k)
    h0, h1 = special.hankel2(0, k), special.hankel2(1, k)
    return np.asarray(h1 / (h1 + 1j * h0))


def pitch(k: Real, axis: float = QUARTER_CHORD) -> Response:
    """Pitch alpha = theta = exp(i omega t), nose up about the axis; lift and moment per rad."""
    k = _frequency(k)
    arm = 0.5 - _checked_axis(axis)
    circulation = theodorsen(k) * (1.0 + 1j * k * arm)
    lift = math.pi * (1j * k + axis * k**2) + 2.0 * math.pi * circulation
    moment = 0.5 * math.pi * (-1j * k * arm + (0.125 + axis**2) * k**2) + math.pi * (axis + 0.5) * circulation
    return Response(k, lift, moment)


def heave(k: Real, axis: float = QUARTER_CHORD) -> Response:
    """Heave that makes the incidence exp(i omega t), downwards motion giving positive incidence; lift and moment per rad."""
    k = _frequency(k)
    _checked_axis(axis)
    circulation = theodorsen(k)
    lift = 1j * math.pi * k + 2.0 * math.pi * circulation
    moment = 0.5j * math.pi * axis * k + math.pi * (axis + 0.5) * circulation
    return Response(k, lift, moment)


def pitch_rate(k: Real, axis: float = QUARTER_CHORD) -> Response:
    """Pure pitch rate: theta = exp(i omega t) on a path that keeps the incidence at the axis zero; per rad."""
    rotation, translation = pitch(k, axis), heave(k, axis)
    return Response(rotation.k, rotation.lift - translation.lift, rotation.moment - translation.moment)


@dataclass(frozen=True)
class QuasiSteady:
    """Derivatives of the thin aerofoil at k -> 0, per rad; those in alphadot have no limit (C_Lalphadot goes to minus infinity)."""

    C_Lalpha: float
    C_malpha: float
    C_Lq: float
    C_mq: float


def quasi_steady(axis: float = QUARTER_CHORD) -> QuasiSteady:
    """Limit of incidence and pure pitch rate at k -> 0 for an axis."""
    _checked_axis(axis)
    return QuasiSteady(2.0 * math.pi, math.pi * (axis + 0.5), 2.0 * math.pi * (0.5 - axis), -math.pi * axis**2)


@dataclass(frozen=True)
class LiftCurve:
    """Out-of-phase lift derivative against reduced frequency: pitch about an axis, and heave; all of one shape."""

    k: FloatArray
    pitch: FloatArray
    heave: FloatArray


def lift_curve(k: Real, axis: float = QUARTER_CHORD) -> LiftCurve:
    """C_Lq + C_Lalphadot in pitch about the axis and C_Lalphadot in heave, against k."""
    rotation = pitch(k, axis)
    return LiftCurve(rotation.k, rotation.lift_quadrature, heave(k, axis).lift_quadrature)


def wagner(s: Real) -> FloatArray:
    """Wagner's function phi(s), any shape: growth of circulatory lift after a step of incidence; phi(0) = 1/2, accurate to 1e-9.

    phi(s) = 1 - int_0^inf exp(-x s) / (x^2 N(x)) dx with N = (K0 - K1)^2 + pi^2 (I0 + I1)^2, the integral along the branch
    cut of the inverse Laplace transform of C(p) / p (Sears, J. Franklin Inst. 230 (1940), p. 95).

    Raises
    ------
    InputError
        A distance that is negative or not finite.
    """
    return _indicial(s, _wagner_weights, 0.5)


def kussner(s: Real) -> FloatArray:
    """Kussner's function psi(s), any shape: growth of lift in a sharp-edged gust that the leading edge meets at s = 0.

    psi(s) = 1 - int_0^inf exp(-x (s - 1)) (I0 + I1) / (x^2 N(x)) dx, from exp(-p) / (p^2 (K0(p) + K1(p))) as for
    :func:`wagner`; psi(0) = 0, accurate to 1e-8.

    Raises
    ------
    InputError
        A distance that is negative or not finite.
    """
    return _indicial(s, _kussner_weights, 0.0)


def impulsive_start(s: Real, incidence: float) -> FloatArray:
    """Lift coefficient after a step of incidence (rad); the added-mass impulse at s = 0 itself is left out."""
    return 2.0 * math.pi * incidence * wagner(s)


def sharp_edged_gust(s: Real, gust_angle: float) -> FloatArray:
    """Lift coefficient in an upward gust of w / V = gust_angle (rad); it acts at the quarter chord."""
    return 2.0 * math.pi * gust_angle * kussner(s)


def elliptic_lift_slope(aspect_ratio: float) -> float:
    """Lift slope (1/rad) of an elliptic wing after Prandtl's lifting line, 2 pi A / (A + 2); good for A above about 4.

    Raises
    ------
    InputError
        An aspect ratio that is not positive (infinity is allowed and gives 2 pi).
    """
    if not aspect_ratio > 0.0:
        raise InputError("aspect_ratio", f"must be positive, got {aspect_ratio}")
    return 2.0 * math.pi / (1.0 + 2.0 / aspect_ratio)


def _frequency(k: Real) -> FloatArray:
    values = np.asarray(k, dtype=float)
    inside = (values >= LOWEST) & (values <= HIGHEST)
    if not np.all(inside):
        raise InputError("k", f"a reduced frequency must lie between {LOWEST:g} and {HIGHEST:g}, got {values[~inside].flat[0]}")
    return values


def _checked_axis(axis: float) -> float:
    if not math.isfinite(axis):
        raise InputError("axis", f"must be a finite number of semichords aft of mid-chord, got {axis}")
    return axis


def _indicial(s: Real, weights: Callable[[], FloatArray], start: float) -> FloatArray:
    distance = np.asarray(s, dtype=float)
    inside = (distance >= 0.0) & np.isfinite(distance)
    if not np.all(inside):
        raise InputError("s", f"a distance travelled must be finite and not negative, got {distance[~inside].flat[0]}")
    flat, x, w = distance.ravel(), np.exp(NODES), weights()
    value = np.empty(flat.size)
    for first in range(0, flat.size, CHUNK):
        part = flat[first : first + CHUNK]
        value[first : first + CHUNK] = 1.0 - np.exp(-np.outer(part, x)) @ w
    return np.where(flat == 0.0, start, value).reshape(distance.shape)


@cache
def _wagner_weights() -> FloatArray:
    """Weights of exp(-x s) at the nodes; Bessel functions scaled by exp(+-x), so that nothing overflows."""
    x = np.exp(NODES)
    difference = np.exp(-2.0 * x) * (special.k0e(x) - special.k1e(x))
    total = math.pi * (special.i0e(x) + special.i1e(x))
    return np.asarray(STEP * np.exp(-2.0 * x) / (x * (difference**2 + total**2)))


@cache
def _kussner_weights() -> FloatArray:
    """Weights of exp(-x s) at the nodes; they fall off like x^(-1/2) only, and exp(-x s) ends the integral."""
    x = np.exp(NODES)
    difference = np.exp(-2.0 * x) * (special.k0e(x) - special.k1e(x))
    total = special.i0e(x) + special.i1e(x)
    return np.asarray(STEP * total / (x * (difference**2 + (math.pi * total) ** 2)))
