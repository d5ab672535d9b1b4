"""Static and dynamic stability derivatives of a geometry against reduced frequency, converged, with error bars.

Sources: the linear lattice in the frequency domain (:mod:`levelone.aerodynamics.frequency`) on three grids. A motion of unit
angle gives a coefficient C(k) = C_in_phase + i k C_quadrature: for pitch the quadrature is C_q + C_alphadot, for heave
C_alphadot, for the pure rate C_q, with rates as qc/(2V). Lateral motions refer to the span: quadrature per p b/(2V) and r
b/(2V).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.extrapolation import LEVELS, extrapolate
from levelone.aerodynamics.frequency import oscillate, prepare, steady
from levelone.aerodynamics.geometry import Geometry
from levelone.aerodynamics.lattice import Lattice, build
from levelone.aerodynamics.modes import LATERAL, LONGITUDINAL
from levelone.errors import InputError

FloatArray = NDArray[np.float64]
#: least number of panels to a wave of the wake
_PANELS = 10.0


@dataclass(frozen=True)
class Derivatives:
    """Coefficients of oscillations: arrays [motion, k, coefficient], per unit angle; errors are half-widths of the error bars.

    ``quadrature`` is divided by the reduced frequency of the motion: k = omega c/(2V), or omega b/(2V) for lateral motions.
    ``ordinary_...`` is what the geometry's own grid gives.
    """

    motions: tuple[str, ...]
    k: FloatArray
    coefficients: tuple[str, ...]
    in_phase: FloatArray
    quadrature: FloatArray
    in_phase_error: FloatArray
    quadrature_error: FloatArray
    ordinary_in_phase: FloatArray
    ordinary_quadrature: FloatArray
    failures: tuple[str, ...] = ()  # what is undefined (NaN) and why

    def at(self, motion: str, coefficient: str) -> tuple[FloatArray, FloatArray]:
        """Quadrature [k] of a coefficient and its error."""
        i, j = self.motions.index(motion), self.coefficients.index(coefficient)
        return self.quadrature[i, :, j], self.quadrature_error[i, :, j]


@dataclass(frozen=True)
class Static:
    """Steady derivatives: values [5, 6] by alpha, q, beta, p, r (rad; rates as qc/2V, pb/2V, rb/2V) of the six coefficients."""

    motions: tuple[str, ...]
    coefficients: tuple[str, ...]
    value: FloatArray
    error: FloatArray
    ordinary: FloatArray
    rest: FloatArray  # [6] coefficients of the geometry at rest in the stream
    rest_error: FloatArray
    ordinary_rest: FloatArray


STEADY = ("alpha", "q", "beta", "p", "r")


def dynamic(
    geometry: Geometry,
    k: FloatArray,
    motions: tuple[str, ...] = LONGITUDINAL,
    centre: tuple[float, float, float] | None = None,
    threads: int = 2,
) -> Derivatives:
    """Derivatives of oscillations about a point (the reference point if None).

    Raises
    ------
    InputError
        A reduced frequency that is not positive (at k = 0 nothing oscillates, and the quadrature part cannot be divided by it), or
        one whose waves in the wake are too short for the panels.
    """
    k = check_frequencies(geometry, k)
    about = np.array(geometry.reference_point if centre is None else centre)
    found = np.stack([oscillate(prepare(grid), k, motions, about, threads) for grid in grids(geometry)])
    lateral = np.array([motion in LATERAL for motion in motions])
    reduced = k[None, :, None] * np.where(lateral, geometry.span / geometry.chord, 1.0)[:, None, None]
    real, imaginary = (extrapolate(part, kinked(geometry)) for part in (found.real, found.imag / reduced))
    return Derivatives(
        motions, k, NAMES, real.value, imaginary.value, real.error, imaginary.error, real.ordinary, imaginary.ordinary
    )


def check_frequencies(geometry: Geometry, k: FloatArray) -> FloatArray:
    """Reduced frequencies [n] at which the geometry's grid can oscillate; InputError for others.

    The waves of the wake, pi c/k long, need :data:`_PANELS` panels of the ordinary grid.
    """
    k = np.atleast_1d(np.asarray(k, dtype=np.float64))
    bad = [each for each in k if not (np.isfinite(each) and each > 0.0)]
    if bad:
        raise InputError("k", f"{bad[0]:g} is no reduced frequency of an oscillation: it must be positive and finite")
    panel = max(float(surface.root_chord) / surface.chordwise for surface in geometry.surfaces)
    highest = np.pi * geometry.chord / (_PANELS * panel)
    if np.max(k) > highest:
        allowed = f"at most {highest:.3g}, or more chordwise panels"
        raise InputError("k", f"{np.max(k):g} is too high for panels of {panel:.3g} m: {allowed}")
    return k


def static(geometry: Geometry) -> Static:
    """Steady derivatives and the coefficients at rest, by the same lattice at zero frequency."""
    plants = [prepare(grid) for grid in grids(geometry)]
    about = np.array(geometry.reference_point)
    rate = {"q": 2.0 / geometry.chord, "p": 2.0 / geometry.span, "r": 2.0 / geometry.span}
    scale = np.array([rate.get(motion, 1.0) for motion in STEADY])[:, None]
    moving = np.stack([oscillate(plant, np.zeros(1), STEADY, about)[:, 0].real * scale for plant in plants])
    found = extrapolate(moving, kinked(geometry))
    rest = extrapolate(np.stack([np.asarray(steady(plant), dtype=np.float64) for plant in plants]), kinked(geometry))
    return Static(STEADY, NAMES, found.value, found.error, found.ordinary, rest.value, rest.error, rest.ordinary)


def grids(geometry: Geometry) -> list[Lattice]:
    """The geometry on the grids of :data:`levelone.aerodynamics.extrapolation.LEVELS`."""
    return [build(geometry, halves) for halves in LEVELS]


def kinked(geometry: Geometry) -> bool:
    """Whether a surface has a kink, or meets another one at an angle: sweep, taper, dihedral or a fin."""
    return any(surface.sweep or surface.dihedral or surface.root_chord != surface.tip_chord for surface in geometry.surfaces)
