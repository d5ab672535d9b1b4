"""Surfaces that pass through each other: no lattice has a meaning for them.

Each surface stands for its chord plane: camber is left out, and a twisted surface is cut into pieces along its span. A piece is the
convex hull of its four corners, so that the distance of two pieces is a linear programme.

Surfaces may touch: along edges of both (the halves of a wing, an outer wing panel, a flap behind a wing), and with the root or tip
line of one anywhere on the other (an end plate on a tail's tip, a tail's root on a fin). The ends of one surface and all edges of
the other are therefore drawn in a little before they are compared; what still meets does pass through, or lies in the other's plane
and overlaps it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from levelone.aerodynamics.geometry import Geometry, Point, Surface, mirror, points
from levelone.errors import InputError

FloatArray = NDArray[np.float64]

_DRAWN_IN = 1e-3
"""How far edges are drawn in, and so how far a touching edge may reach through; unit: shortest chord or span of both surfaces."""

_MEET = 0.1 * _DRAWN_IN
"""Distance below which drawn-in surfaces meet, in the same unit. A tip that touches another surface ends further off, if the two
are inclined to each other by 10 deg or more."""

_PIECES = 8  # of a twisted surface along its span


@dataclass(frozen=True)
class Intersection:
    """Two surfaces that pass through each other or overlap, and where, m.

    ``image``: not the surfaces as described, but one of them and the mirror image of the other (or its own).
    """

    first: str
    second: str
    image: bool
    point: Point


def check_intersections(geometry: Geometry) -> None:
    """InputError that names the first two surfaces that intersect, if any do."""
    found = intersections(geometry)
    if not found:
        return
    first, second, (x, y, z) = found[0].first, found[0].second, found[0].point
    if first == second:
        what = f"{first!r} intersects its own mirror image"
    else:
        what = f"{first!r} and {second!r} intersect" + (", one of them as its mirror image," if found[0].image else "")
    raise InputError(
        "surface",
        f"{what} near x = {x:.4g}, y = {y:.4g}, z = {z:.4g} m; surfaces may touch along edges, or with a root or tip, "
        "and must not pass through or overlap each other",
    )


def intersections(geometry: Geometry) -> tuple[Intersection, ...]:
    """Every pair of surfaces, mirror images included, that intersect: at most one entry for a pair, in their order."""
    found = []
    for i, first in enumerate(geometry.surfaces):
        for second in geometry.surfaces[i:]:
            images = ([False] if second is not first else []) + ([True] if first.mirrored or second.mirrored else [])
            for image in images:
                point = _meeting(first, second, image)
                if point is not None:
                    found.append(Intersection(first.name, second.name, image, point))
                    break
    return tuple(found)


def _meeting(first: Surface, second: Surface, image: bool) -> Point | None:
    """Where a surface and another one (or its mirror image) pass through each other; None if they do not."""
    unit = min(length for each in (first, second) for length in (each.span, each.root_chord, each.tip_chord))
    for first_inner in (False, True):
        one, other = _pieces(first, unit, first_inner), _pieces(second, unit, not first_inner)
        if image and second.mirrored:
            other = mirror(other)
        elif image:
            one = mirror(one)
        for a, b in product(one, other):
            point = _closest(a, b, unit)
            if point is not None:
                return point
    return None


def _pieces(surface: Surface, unit: float, all_round: bool) -> FloatArray:
    """Corners [n, 4, 3] of the pieces of a chord plane whose root and tip, or all four edges, are drawn in."""
    ends = _DRAWN_IN * unit / surface.span
    sides = _DRAWN_IN * unit / min(surface.root_chord, surface.tip_chord) if all_round else 0.0
    eta = np.linspace(ends, 1.0 - ends, (_PIECES if surface.twist else 1) + 1)
    grid = points(replace(surface, camber=()), eta[:, None], np.array([sides, 1.0 - sides]))
    return np.concatenate([grid[:-1], grid[1:]], axis=1)


def _closest(a: FloatArray, b: FloatArray, unit: float) -> Point | None:
    """A point of the convex hull of a [4, 3] where the hull of b meets it; None if they are further apart.

    Distance is the largest difference in x, y or z. Its least value over the points p of a and q of b is a linear programme in the
    weights of the eight corners and the distance itself.
    """
    if np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0)).max() > _MEET * unit:
        return None
    origin = a.mean(axis=0)
    difference = np.hstack([(a - origin).T, -(b - origin).T]) / unit
    distance = -np.ones((3, 1))
    solution = linprog(
        np.r_[np.zeros(8), 1.0],
        A_ub=np.block([[difference, distance], [-difference, distance]]),
        b_ub=np.zeros(6),
        A_eq=np.array([[1.0] * 4 + [0.0] * 5, [0.0] * 4 + [1.0] * 4 + [0.0]]),
        b_eq=np.ones(2),
    )
    if solution.x is None:
        raise InputError("surface", f"no distance between two surfaces can be found: {solution.message}")
    weights = solution.x[:8]
    if np.abs(difference @ weights).max() > _MEET:
        return None
    x, y, z = (weights[:4] @ a).tolist()
    return x, y, z
