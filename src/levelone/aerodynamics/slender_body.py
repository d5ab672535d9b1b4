"""Derivatives of a fuselage: a body of revolution by slender-body theory, with the inertia factors of a spheroid.

A slice of area A(x) whose cross-flow is w has the lift rho (d/dt + V d/dx)(A w) per length (M. M. Munk, The Aerodynamic Forces
on Airship Hulls, NACA Report 184, 1924; J. N. Nielsen, Missile Aerodynamics, 1960, chapters 3 and 10). A body that is not thin
carries less: the spheroid of the same fineness has the inertia factors k_1 along and k_2 across its axis (H. Lamb, Hydrodynamics,
6th ed. 1932, sections 114 and 115), and Kirchhoff's equations (Lamb, section 124) say where they stand. For a closed body with
volume Q whose centroid lies xi aft of the reference point, with area S and chord c,

    C_malpha = 2 (k_2 - k_1) Q/(S c),            C_Lalphadot = 4 k_2 Q/(S c),
    C_mq = -C_malphadot = 4 k_2 Q xi/(S c^2),    C_Lq = -4 k_1 Q/(S c).

A pitch oscillation of a closed body is therefore not damped at all: C_mq + C_malphadot = 0. A cut-off tail of area A_b at xi_b
adds the lift of its trailing vortices, A_b w_b, without factors. Potential flow: the cross-flow separates on real bodies and leaves
some lift on the rear, which lessens C_malpha and adds damping (Nielsen, chapter 4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import elliprd

from levelone.aerodynamics.geometry import Geometry, Point
from levelone.errors import InputError


@dataclass(frozen=True)
class Body:
    """A body of revolution along the x axis.

    Parameters
    ----------
    nose
        Foremost point, m; x aft.
    length
        m.
    widths
        (x/length, width in m) from (0, ...) to (1, ...), x increasing; straight lines join them. The width is the diameter, or of a
        section that is not round, what the cross-flow meets.

    Raises
    ------
    InputError
        A length that is not positive, widths that are negative, all zero, out of order, or do not run from 0 to 1.
    """

    nose: Point
    length: float
    widths: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if not (math.isfinite(self.length) and self.length > 0.0):
            raise InputError("length", f"must be positive, got {self.length:g}")
        if len(self.nose) != 3 or not all(math.isfinite(value) for value in self.nose):
            raise InputError("nose", f"must be three finite numbers x, y, z, got {self.nose}")
        if len(self.widths) < 2 or self.widths[0][0] != 0.0 or self.widths[-1][0] != 1.0:
            raise InputError("widths", "must run from x/length = 0 to 1")
        for (before, _), (after, _) in pairwise(self.widths):
            if not after > before:
                raise InputError("widths", f"x/length must increase from point to point, got {after:g} after {before:g}")
        bad = [width for _, width in self.widths if not (math.isfinite(width) and width >= 0.0)]
        if bad or not any(width > 0.0 for _, width in self.widths):
            raise InputError("widths", f"{bad[0]:g} m is no width" if bad else "at least one must be positive")


@dataclass(frozen=True)
class BodyDerivatives:
    """Contributions of a body, 1/rad; rates as qc/(2V) and alphadot c/(2V), moments about the reference point, nose up."""

    C_Lalpha: float
    C_malpha: float
    C_Lq: float
    C_mq: float
    C_Lalphadot: float
    C_malphadot: float


def spheroid(nose: Point, length: float, width: float, points: int = 201) -> Body:
    """A spheroid as a :class:`Body`; ``points`` on its outline, dense at the ends."""
    x = 0.5 - 0.5 * np.cos(np.pi * np.arange(points) / (points - 1))
    x[0], x[-1] = 0.0, 1.0
    widths = 2.0 * width * np.sqrt(np.clip(x * (1.0 - x), 0.0, None))
    return Body(nose, length, tuple(zip(x.tolist(), widths.tolist(), strict=True)))


def inertia_factors(fineness: float) -> tuple[float, float]:
    """k_1 and k_2, virtual mass over displaced mass along and across the axis, of a prolate spheroid (Lamb, sections 114 and 115).

    Parameters
    ----------
    fineness
        Length over width, 1 (a sphere: both 1/2) or more.

    Raises
    ------
    InputError
        A fineness below 1.
    """
    if not fineness >= 1.0:
        raise InputError("fineness", f"{fineness:g}: the formula is for bodies at least as long as wide (1 or more)")
    # Lamb's integrals are Carlson's R_D, here for semi-axes fineness, 1, 1
    along = 2.0 / 3.0 * fineness * float(elliprd(1.0, 1.0, fineness**2))
    across = 2.0 / 3.0 * fineness * float(elliprd(1.0, fineness**2, 1.0))
    return along / (2.0 - along), across / (2.0 - across)


def contributions(body: Body, geometry: Geometry) -> BodyDerivatives:
    """What a body adds to the longitudinal derivatives of a geometry (its area, chord and reference point); see the module.

    Interference is left out: the upwash ahead of the wing and the downwash behind it, and the lift that the body carries over from
    the wing.

    Raises
    ------
    InputError
        A body that is wider than long.
    """
    volume, moment, base = _volume(body, geometry.reference_point[0])
    along, across = inertia_factors(body.length / max(width for _, width in body.widths))
    by_area, by_chord = 2.0 / geometry.area, 1.0 / geometry.chord
    end = body.nose[0] + body.length - geometry.reference_point[0]
    damping = 2.0 * by_area * across * moment * by_chord**2
    return BodyDerivatives(
        C_Lalpha=by_area * base,
        C_malpha=by_area * by_chord * ((across - along) * volume - end * base),
        C_Lq=2.0 * by_area * by_chord * (end * base - along * volume),
        C_mq=damping - 2.0 * by_area * by_chord**2 * end**2 * base,
        C_Lalphadot=2.0 * by_area * by_chord * across * volume,
        C_malphadot=-damping,
    )


def _volume(body: Body, reference: float) -> tuple[float, float, float]:
    """Volume (m^3), its moment about x = reference (m^4, aft positive), and the area of the cut-off tail (m^2)."""
    x, width = np.array(body.widths).T
    node, weight = np.polynomial.legendre.leggauss(2)  # exact: areas are quadratic, their moments cubic between the points
    step = np.diff(x)[:, None]
    share = 0.5 * (1.0 + node)
    area = 0.25 * np.pi * (width[:-1, None] + np.diff(width)[:, None] * share) ** 2
    part = 0.5 * step * weight * area * body.length
    arm = body.nose[0] + (x[:-1, None] + step * share) * body.length - reference
    return float(part.sum()), float((part * arm).sum()), float(0.25 * np.pi * width[-1] ** 2)
