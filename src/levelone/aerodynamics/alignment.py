"""Common strips of surfaces that lie in each other's wake.

A surface in the wake of another one at the same height is crossed by trailing vortices. Where one of them passes a collocation
point closely, the lattice is off by that accident: codes differ by 2.5 % in the pitch damping of a wing with a tail for this
reason alone. Surfaces of nearly the same height therefore share the edges of their strips wherever their spans overlap.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from levelone.aerodynamics.geometry import Surface, points
from levelone.aerodynamics.spacing import FloatArray

#: surfaces steeper than this are not aligned with others
STEEP = math.radians(30.0)
#: of the larger root chord: surfaces closer in height than this share their strips
NEAR = 0.5


def cuts(surfaces: tuple[Surface, ...]) -> list[tuple[FloatArray, tuple[int, ...]]]:
    """Breaks of each surface (shares of its span, ascending from 0 to 1) and the number of strips in each interval."""
    return [_steep(surface, surfaces) if abs(surface.dihedral) >= STEEP else _level(surface, surfaces) for surface in surfaces]


def _level(surface: Surface, surfaces: tuple[Surface, ...]) -> tuple[FloatArray, tuple[int, ...]]:
    partners = [(each, _range(each)) for each in surfaces if each is surface or _aligned(surface, each)]
    low, high = _range(surface)
    inner = {y for _, ends in partners for y in ends if low + _least(surface) < y < high - _least(surface)}
    breaks = np.array([low, *sorted(inner), high])
    counts = tuple(_count(a, b, partners) for a, b in pairwise(breaks))
    return (breaks - low) / (high - low), counts


def _steep(surface: Surface, surfaces: tuple[Surface, ...]) -> tuple[FloatArray, tuple[int, ...]]:
    """A fin or end plate: broken where another surface's root or tip stands on it: trailing vortices run along its edges."""
    axis = np.array([math.cos(surface.dihedral), math.sin(surface.dihedral)])
    inner = set()
    for other in surfaces:
        for share in (0.0, 1.0):
            offset = points(other, share, 0.25)[1:] - np.array(surface.position[1:])
            along = float(offset @ axis)
            on = np.linalg.norm(offset - along * axis) < _least(surface)
            if other is not surface and on and _least(surface) < along < surface.span - _least(surface):
                inner.add(round(along / surface.span, 9))
    breaks = np.array([0.0, *sorted(inner), 1.0])
    return breaks, tuple(math.ceil(surface.strips * share - 1e-9) for share in np.diff(breaks))


def _range(surface: Surface) -> tuple[float, float]:
    y = surface.position[1]
    return y, y + surface.span * math.cos(surface.dihedral)


def _least(surface: Surface) -> float:
    return 1e-6 * surface.span


def _aligned(a: Surface, b: Surface) -> bool:
    """Whether two surfaces share strips: both nearly level, nearly at one height, on the same side, with the same spacing."""
    level = abs(a.dihedral) < STEEP and abs(b.dihedral) < STEEP
    near = abs(a.position[2] - b.position[2]) < NEAR * max(a.root_chord, b.root_chord)
    return level and near and a.mirrored == b.mirrored and a.span_spacing == b.span_spacing


def _count(low: float, high: float, partners: list[tuple[Surface, tuple[float, float]]]) -> int:
    """Strips between two breaks: as many as the most demanding surface that spans the interval would lay there by itself."""
    wanted = [
        math.ceil(surface.strips * (high - low) / (ends[1] - ends[0]) - 1e-9)
        for surface, ends in partners
        if ends[0] <= low + _least(surface) and ends[1] >= high - _least(surface)
    ]
    return max(1, *wanted)
