"""Blade-element momentum theory of a small rotor in axial and edgewise flow, averaged over a revolution.

Everything is scaled by the speed s = sqrt((Omega R)^2 + V^2): a point of operation is then a direction,
(Omega R, V_x, V_z) / s, which stays finite for a stopped rotor, and

    T = rho A s^2 F_T,    Q = rho A R s^2 F_Q .

Signs: `V_z` is the axial part of the air-relative velocity, positive in climb (the air meets the disc from its thrust
side); `V_x` >= 0 the edgewise part; the induced velocity `v` is positive when it adds to a climb; thrust is positive
along the climb, torque positive when the air resists positive rotation. docs/theory/rotor-table.md holds equations and
sources. Blade angles and section angles in radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import elementwise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Section:
    """Blade section at low Reynolds number over the full circle of incidence.

    The normal force follows the lift line and saturates without collapsing, as on a rotating blade whose boundary
    layer is thrown outward (Himmelskamp's effect). Attached flow has full leading-edge suction and a parabolic drag
    polar; beyond `stall` the suction fades and the section is a plate: c_l = c_n cos, c_d = drag_min + c_n sin.
    """

    lift_slope: float = 5.5  # 1/rad; assumed: thin cambered section at Reynolds number 1e5, below 2 pi
    zero_lift: float = np.radians(-3.5)  # assumed: 4 % camber
    normal_max: float = 1.5  # assumed: maximum lift 1.2 to 1.3 at 12 deg; a plate across the flow has 1.2 to 2
    stall: float = np.radians(13.0)  # assumed
    stall_fade: float = np.radians(3.0)  # assumed: thin sections at low Reynolds number stall gently
    drag_min: float = 0.028  # assumed: Reynolds number 1e5
    drag_rise: float = 0.030  # assumed: c_d = drag_min + drag_rise (c_l - lift_best)^2
    lift_best: float = 0.5  # assumed

    def coefficients(self, alpha: Array) -> tuple[Array, Array]:
        """Lift and drag coefficients at the incidence `alpha`, any angle."""
        line = self.lift_slope * np.sin(alpha - self.zero_lift)
        normal = line / (1.0 + (line / self.normal_max) ** 4) ** 0.25
        sin, cos = np.sin(alpha), np.cos(alpha)
        # a fade in cos(alpha) is smooth all round the circle
        attached = 1.0 / (1.0 + np.exp((np.cos(self.stall) - cos) / (np.sin(self.stall) * self.stall_fade)))
        drag = attached * self.drag_rise * (normal - self.lift_best) ** 2 + (1.0 - attached) * normal * sin
        return normal * (attached + (1.0 - attached) * cos), self.drag_min + drag


@dataclass(frozen=True)
class Blade:
    """Geometry of the propeller: three blades of constant geometric pitch with a rounded plan form."""

    blades: int = 3
    radius: float = 0.089  # m; the study's 0.178 m
    pitch: float = 4.5 * 0.0254  # m; assumed: a 7 x 4.5 inch propeller, whose C_T comes out near the anchor
    root: float = 0.15  # r/R where the blade begins; assumed: hub
    stations: tuple[float, ...] = (0.15, 0.30, 0.45, 0.60, 0.75, 0.90, 1.00)
    chord: tuple[float, ...] = (0.17, 0.23, 0.26, 0.25, 0.21, 0.15, 0.08)  # c/R; assumed: wide blade


@dataclass(frozen=True)
class Elements:
    """Radial elements of one blade: Gauss-Legendre points `x` = r/R with weights, chord c/R, blade angle, tip loss."""

    blades: int
    x: Array
    weight: Array
    chord: Array
    angle: Array
    loss: Array


# Constants of `mass_flow` in descent: least squares on Leishman's quartic for the measured induced velocity over
# -2 < V_z / v_h < -0.4, under the condition that v U rises everywhere.
RELIEF, RELIEF_AT = 0.72, 1.23
FLOOR, FLOOR_AT = 0.335, 0.78


def _window(q: Array, peak: float, power: int) -> Array:
    """Bump of height 1 at q = `peak`, zero for q <= 0, decaying exponentially for large q."""
    z = np.clip(q / peak, 1e-30, 60.0)
    return np.exp(power * (np.log(z) + 1.0 - z))


def mass_flow(v: Array, v_x: Array, v_z: Array) -> Array:
    """Speed U of the stream through the disc in T = 2 rho A v U.

    Glauert's resultant velocity, whose axial part is bent around v = -V_z so that v U rises with v everywhere: the
    induced velocity is then single-valued through the vortex-ring state. With q = -v / V_z

        U^2 = V_x^2 + (V_z + v)^2 (1 - RELIEF w(q)) + (FLOOR V_z)^2 w'(q);

    the windows w vanish in climb and hover, where momentum theory is left as it is. A thrust of the other sign (a
    windmill in climb) is the mirror image.
    """
    level = np.abs(v_z) <= 1e-12 * np.abs(v)  # the windows have long vanished
    q = np.where(level, -1.0, -v / np.where(level, 1.0, v_z))
    relief = 1.0 - RELIEF * _window(q, RELIEF_AT, 2)
    floor = (FLOOR * v_z) ** 2 * _window(q, FLOOR_AT, 3)
    return np.sqrt(v_x**2 + (v_z + v) ** 2 * relief + floor)


def make_elements(blade: Blade, number: int = 24, hover_inflow: float = 0.115) -> Elements:
    """Divide a blade; Prandtl's tip loss is frozen at the `hover_inflow` ratio v / (Omega R).

    Frozen because a loss that follows the local inflow has a kink where the flow through the disc reverses.
    """
    node, weight = np.polynomial.legendre.leggauss(number)
    x = blade.root + (1.0 - blade.root) * (node + 1.0) / 2.0
    chord = np.interp(x, blade.stations, blade.chord)
    angle = np.arctan2(blade.pitch, 2.0 * np.pi * x * blade.radius)
    loss = 2.0 / np.pi * np.arccos(np.exp(-blade.blades / 2.0 * (1.0 - x) / hover_inflow))
    return Elements(blade.blades, x, weight * (1.0 - blade.root) / 2.0, chord, angle, loss)


def blade_loads(
    elements: Elements, section: Section, index: NDArray[np.intp], tip: Array, v_x: Array, w: Array, azimuths: int = 24
) -> tuple[Array, Array]:
    """Thrust and torque of element `index`, each as its density in x over rho A s^2 (times R), mean of a revolution.

    `tip` is Omega R / s, `w` the whole axial flow (V_z + v) / s; all arguments of one shape. The integrand depends on
    the azimuth through its sine alone, so half a revolution is enough; equal steps converge faster than any power.
    """
    sine = np.sin((np.arange(azimuths) + 0.5) / azimuths * np.pi - np.pi / 2.0)
    x = elements.x[index]
    tangential = (tip * x)[..., None] + v_x[..., None] * sine
    axial = w[..., None]
    speed = np.hypot(tangential, axial)
    lift, drag = section.coefficients(_wrap(elements.angle[index][..., None] - np.arctan2(axial, tangential)))
    scale = elements.blades * elements.chord[index] / (2.0 * np.pi)
    normal = np.mean(speed * (lift * tangential - drag * axial), axis=-1)
    in_plane = np.mean(speed * (lift * axial + drag * tangential), axis=-1)
    return scale * normal, scale * in_plane * x


def _wrap(angle: Array) -> Array:
    """The same angle between -pi and pi."""
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))


def induced_velocity(elements: Elements, section: Section, tip: Array, v_x: Array, v_z: Array) -> Array:
    """Induced velocity over s of every element [..., elements]: momentum of the annulus against loads of its blades."""
    shape = (*tip.shape, elements.x.size)
    index = np.broadcast_to(np.arange(elements.x.size), shape).ravel()
    state = [np.broadcast_to(a[..., None], shape).ravel() for a in (tip, v_x, v_z)]
    outcome = elementwise.find_root(
        lambda v, i, tip, v_x, v_z: (
            4.0 * elements.x[i] * elements.loss[i] * v * mass_flow(v, v_x, v_z)
            - blade_loads(elements, section, i, tip, v_x, v_z + v)[0]
        ),
        (np.full(index.size, -2.0), np.full(index.size, 2.0)),
        args=(index, *state),
        tolerances={"xatol": 1e-14, "xrtol": 1e-14, "fatol": 0.0, "frtol": 0.0},
        maxiter=200,
    )
    if not np.all(outcome.success):
        raise ArithmeticError(f"{np.sum(~outcome.success)} annuli without an induced velocity")
    return outcome.x.reshape(shape)


def loads(elements: Elements, section: Section, tip: Array, v_x: Array, v_z: Array) -> tuple[Array, Array]:
    """F_T and F_Q of the rotor at the scaled speeds `tip` = Omega R / s, `v_x`, `v_z` (any shape)."""
    v = induced_velocity(elements, section, tip, v_x, v_z)
    index = np.broadcast_to(np.arange(elements.x.size), v.shape)
    spread = [np.broadcast_to(a[..., None], v.shape) for a in (tip, v_x)]
    thrust, torque = blade_loads(elements, section, index, spread[0], spread[1], v_z[..., None] + v)
    return thrust @ elements.weight, torque @ elements.weight
