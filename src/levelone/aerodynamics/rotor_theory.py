"""Momentum theory of a lifting rotor: induced velocity, slipstream, and the numbers that describe a propeller.

Leishman, Principles of Helicopter Aerodynamics, 2nd ed., chapter 2 (hover, axial climb, and Glauert's hypothesis
for forward flight). A rotor of thrust T and area A in air of density rho induces v_i at its disc and 2 v_i far away:

    T = 2 rho A |U| v_i,    U the velocity through the disc, its own v_i included.

For axial flow this is the law of momentum. For edgewise flow it is an assumption, exact in two limits: hover, and high speed,
where the disc is a wing of circular plan form. SI; velocities positive down through the disc.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from levelone.errors import InputError

#: kinematic viscosity of air at 15 degC, m^2/s (ISO 2533)
VISCOSITY = 1.461e-5


@dataclass(frozen=True)
class Slipstream:
    """Momentum theory of one rotor.

    Parameters
    ----------
    hover
        v_h = sqrt(T/(2 rho A)), m/s.
    climb, edgewise
        Stream square to the disc (down through it) and along it, m/s.
    induced
        v_i at the disc, m/s.
    contraction
        Radius of the slipstream far away over that of the disc, in axial flow; for edgewise flow by continuity along the stream.
    mass_flux
        Through the disc, kg/s.
    skew, far_skew
        Angle between the slipstream and the rotor's axis at the disc and far away, rad.
    """

    hover: float
    climb: float
    edgewise: float
    induced: float
    contraction: float
    mass_flux: float
    skew: float
    far_skew: float


def slipstream(thrust: float, density: float, radius: float, climb: float = 0.0, edgewise: float = 0.0) -> Slipstream:
    """Momentum theory of a rotor of given thrust (N), air density (kg/m^3) and radius (m) in a stream (m/s).

    Raises
    ------
    InputError
        Values that are not positive; a descent, in which there is no slipstream in the sense of the theory.
    """
    for name, value in (("thrust", thrust), ("density", density), ("radius", radius)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(name, f"{value:g}; allowed: above 0, finite")
    if not (math.isfinite(climb) and climb >= 0.0):
        raise InputError("climb", f"{climb:g} m/s; allowed: 0 or more: momentum theory knows no slipstream in a descent")
    if not (math.isfinite(edgewise) and edgewise >= 0.0):
        raise InputError("edgewise", f"{edgewise:g} m/s; allowed: 0 or more, finite")
    area = math.pi * radius**2
    hover = math.sqrt(thrust / (2.0 * density * area))
    induced = _induced(hover, climb, edgewise)
    at_disc, far = math.hypot(edgewise, climb + induced), math.hypot(edgewise, climb + 2.0 * induced)
    return Slipstream(
        hover, climb, edgewise, induced, math.sqrt(at_disc / far), density * area * (climb + induced),
        math.atan2(edgewise, climb + induced), math.atan2(edgewise, climb + 2.0 * induced),
    )  # fmt: skip


def _induced(hover: float, climb: float, edgewise: float) -> float:
    """v_i of v_i^2 (edgewise^2 + (climb + v_i)^2) = hover^4, by Newton's method from above, where it cannot leave the root."""
    v = hover
    for _ in range(60):
        axial = climb + v
        value = v * v * (edgewise**2 + axial**2) - hover**4
        slope = 2.0 * v * (edgewise**2 + axial**2) + 2.0 * v * v * axial
        change = value / slope
        v -= change
        if abs(change) <= 1e-15 * hover:
            break
    return v


@dataclass(frozen=True)
class Propeller:
    """What describes a propeller at one speed of rotation: tip speed (m/s), thrust (N), C_T by rho n^2 D^4, Reynolds number."""

    tip_speed: float
    thrust: float
    thrust_coefficient: float
    reynolds: float


def propeller(radius: float, rpm: float, thrust_per_rpm2: float, chord: float, density: float) -> Propeller:
    """A propeller of given radius (m) and K_T (N/rpm^2); Reynolds number of its ``chord`` (m) at 3/4 of the radius."""
    tip = radius * rpm * 2.0 * math.pi / 60.0
    thrust = thrust_per_rpm2 * rpm**2
    return Propeller(tip, thrust, thrust / (density * (rpm / 60.0) ** 2 * (2.0 * radius) ** 4), 0.75 * tip * chord / VISCOSITY)
