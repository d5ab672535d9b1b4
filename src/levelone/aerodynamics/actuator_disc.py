"""Actuator discs: uniformly loaded discs that shed their slipstream as vortex rings.

Geometry frame (x aft, y right, z up), SI. A disc of thrust T and area A lifts the pressure by T/A from its upper to its lower side.
Circulation therefore leaves its rim at the rate T/(rho A), whatever the wind: along a material circuit around the rim and
through the disc the pressure jump over the density is the rate of change of circulation. In a time step dt this is one ring of
circulation T dt/(rho A), whose impulse is T dt/rho. Derivation: own; discs in general: van Kuik, The Fluid Dynamic Basis for
Actuator Disc and Rotor Theories, 2018.

There are no blades in it: no tip vortices one by one, no swirl, no hub, no tip loss, no change of loading along radius or azimuth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from levelone.aerodynamics.particle_kernels import FloatArray
from levelone.aerodynamics.particles import Particles
from levelone.errors import InputError

#: particles of a ring below which its core would have to be as wide as the disc
FEWEST = 8
#: stations of a disc along the radius and around
RADIAL, AROUND = 6, 16
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Disc:
    """A uniformly loaded disc.

    Parameters
    ----------
    centre
        m.
    radius
        m.
    thrust
        N, along ``axis``: the air is driven against it.
    axis
        Unit vector square to the disc.

    Raises
    ------
    InputError
        A radius that is not positive, a thrust that is negative, an axis that is not of unit length, values that are not finite.
    """

    centre: Vector
    radius: float
    thrust: float
    axis: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        if not all(math.isfinite(each) for each in self.centre):
            raise InputError("disc.centre", f"{self.centre}; allowed: three finite numbers, m")
        if not (math.isfinite(self.radius) and self.radius > 0.0):
            raise InputError("disc.radius", f"{self.radius:g} m; allowed: above 0, finite")
        if not (math.isfinite(self.thrust) and self.thrust >= 0.0):
            raise InputError(
                "disc.thrust", f"{self.thrust:g} N; allowed: 0 or more, finite: turn the axis for a thrust the other way"
            )
        if not abs(math.hypot(*self.axis) - 1.0) < 1e-9:
            raise InputError("disc.axis", f"length {math.hypot(*self.axis):g}; allowed: a unit vector")

    @property
    def area(self) -> float:
        """m^2."""
        return math.pi * self.radius**2


def rate(disc: Disc, density: float) -> float:
    """Circulation that leaves the rim per unit time, T/(rho A), m^2/s^2."""
    return disc.thrust / (density * disc.area)


def shed(discs: Sequence[Disc], density: float, dt: float, points: int, core: float) -> Particles:
    """One ring of each disc: what its rim sheds in ``dt`` (s), as ``points`` particles on the rim with the core ``core`` (m).

    The rings follow each other in the order of the discs. Strengths are those of arcs, not of chords: the impulse of a ring is
    T dt/rho against the axis, exactly.

    Raises
    ------
    InputError
        Fewer than ``FEWEST`` points.
    """
    if points < FEWEST:
        raise InputError("disc.points", f"{points} particles on a rim; allowed: {FEWEST} or more")
    angle = 2.0 * np.pi * (np.arange(points) + 0.5) / points
    position, strength = [], []
    for disc in discs:
        first, second = plane(disc)
        outward = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
        along = np.cos(angle)[:, None] * second - np.sin(angle)[:, None] * first
        position.append(np.asarray(disc.centre) + disc.radius * outward)
        # clockwise about the axis: the ring drives the air against the thrust
        strength.append(-rate(disc, density) * dt * (2.0 * np.pi * disc.radius / points) * along)
    return Particles(np.concatenate(position), np.concatenate(strength), np.full(points * len(discs), core))


def stations(disc: Disc, radial: int = RADIAL, around: int = AROUND) -> tuple[FloatArray, FloatArray]:
    """Points [s, 3] of a disc (m) and weights [s] of sum one: Gauss-Legendre in the square of the radius, even around."""
    node, weight = np.polynomial.legendre.leggauss(radial)
    r = disc.radius * np.sqrt(0.5 * (node + 1.0))
    angle = 2.0 * np.pi * np.arange(around) / around
    first, second = plane(disc)
    outward = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    points = np.asarray(disc.centre) + (r[:, None, None] * outward).reshape(-1, 3)
    return points, np.repeat(0.5 * weight / around, around)


def plane(disc: Disc) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors [3] in the disc that make a right-handed frame with its axis; the first one as far aft as possible."""
    axis = np.asarray(disc.axis)
    aft = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    first = aft - (aft @ axis) * axis
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)
