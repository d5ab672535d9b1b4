"""The lattice of bound vortices that stands for a geometry.

Geometry frame: x aft, y right, z up; SI units. A panel carries its bound vortex on its quarter line and meets the boundary
condition on its three-quarter line (Katz and Plotkin, section 12.3). Circulation is positive from the left to the right end of
the bound vortex: a free stream along +x then gives lift along the panel's normal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from levelone.aerodynamics.alignment import cuts
from levelone.aerodynamics.geometry import Geometry, Surface, points, tangents
from levelone.aerodynamics.intersect import check_intersections
from levelone.aerodynamics.spacing import chordwise, spanwise
from levelone.aerodynamics.wake_start import wake_start

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Lattice:
    """Panels [n] in strips [m]; the panels of a strip follow each other from the leading to the trailing edge.

    If ``mirrored``, strips [m/2:] are the images of strips [:m/2] in y = 0, in the same order, and so are their panels.
    """

    bound: FloatArray  # [n, 2, 3] left and right end of the bound vortex, m
    collocation: FloatArray  # [n, 3] m
    normal: FloatArray  # [n, 3] unit
    midpoint: FloatArray  # [n, 3] where the bound vortex is loaded, m
    strip: IntArray  # [n] strip of each panel
    first: IntArray  # [m] first panel of each strip
    count: IntArray  # [m] panels of each strip
    edge: FloatArray  # [m, 2, 3] left and right end of the trailing edge, m
    tangent: FloatArray  # [m, 3] unit, aft along the chord at the trailing edge
    last: FloatArray  # [m] chordwise length of the last panel, m
    surface: IntArray  # [m] index into names
    width: FloatArray  # [m] m
    chord_at: FloatArray  # [m] m
    names: tuple[str, ...]
    mirrored: bool
    area: float
    chord: float
    span: float
    reference_point: FloatArray  # [3] m

    @property
    def trailing(self) -> IntArray:
        """Last panel of each strip [m]."""
        return self.first + self.count - 1


def build(geometry: Geometry, halves: int | None = None) -> Lattice:
    """The lattice of a geometry.

    Parameters
    ----------
    halves
        Panels along every chord and span as multiples of half the geometry's own, rounded up; None for its own. Grids of 1, 2 and 3
        halves are similar to each other to the last panel, which extrapolation needs.

    Raises
    ------
    InputError
        If surfaces intersect.
    """
    check_intersections(geometry)
    strips = []
    symmetric = all(surface.mirrored for surface in geometry.surfaces)
    for index, (surface, (breaks, counts)) in enumerate(zip(geometry.surfaces, cuts(geometry.surfaces), strict=True)):
        along, across = _scaled(surface.chordwise, halves), tuple(_scaled(count, halves) for count in counts)
        found = _strips(replace(surface, chordwise=along), breaks, across)
        strips += [(index, strip) for strip in found]
        if surface.mirrored and not symmetric:
            strips += [(index, _image(strip)) for strip in found]
    if symmetric:
        strips += [(index, _image(strip)) for index, strip in strips]
    return _assemble(geometry, [strip for _, strip in strips], np.array([index for index, _ in strips]), symmetric)


def _scaled(count: int, halves: int | None) -> int:
    return count if halves is None else halves * -(-count // 2)


@dataclass(frozen=True)
class _Strip:
    bound: FloatArray
    collocation: FloatArray
    normal: FloatArray
    midpoint: FloatArray
    edge: FloatArray
    tangent: FloatArray
    last: float
    width: float
    chord: float


def _strips(surface: Surface, breaks: FloatArray, counts: tuple[int, ...]) -> list[_Strip]:
    on_plane = surface.mirrored and abs(surface.position[1]) < 1e-9 * surface.span
    edges, stations = spanwise(breaks, counts, surface.span_spacing, on_plane)
    ends, vortex, control = chordwise(surface.chordwise, surface.chord_spacing)
    found = []
    for a, s, b in zip(edges[:-1], stations, edges[1:], strict=True):
        left, right = points(surface, a, vortex), points(surface, b, vortex)
        normal = np.cross(tangents(surface, s, control), right - left)
        chord = surface.root_chord + s * (surface.tip_chord - surface.root_chord)
        found.append(
            _Strip(
                np.stack([left, right], axis=1), points(surface, s, control), normal / np.linalg.norm(normal, axis=1)[:, None],
                left + (s - a) / (b - a) * (right - left), points(surface, np.array([a, b]), 1.0), tangents(surface, s, 1.0),
                float(ends[-1] - ends[-2]) * chord, float((b - a) * surface.span), chord,
            )
        )  # fmt: skip
    return found


def _image(strip: _Strip) -> _Strip:
    flip = np.array([1.0, -1.0, 1.0])
    return _Strip(
        (strip.bound * flip)[:, ::-1], strip.collocation * flip, strip.normal * flip, strip.midpoint * flip, (strip.edge *
        flip)[::-1], strip.tangent * flip, strip.last, strip.width, strip.chord,
    )  # fmt: skip


def _assemble(geometry: Geometry, strips: list[_Strip], surface: IntArray, mirrored: bool) -> Lattice:
    count = np.array([len(strip.collocation) for strip in strips])

    def panels(name: str) -> FloatArray:
        return np.ascontiguousarray(np.concatenate([getattr(strip, name) for strip in strips]))

    def each(name: str) -> FloatArray:
        return np.ascontiguousarray(np.stack([getattr(strip, name) for strip in strips]))

    return Lattice(
        panels("bound"), panels("collocation"), panels("normal"), panels("midpoint"), np.repeat(np.arange(len(strips)), count),
        np.concatenate([[0], np.cumsum(count)[:-1]]), count, each("edge"), each("tangent"), each("last"), surface, each("width"),
        each("chord"), tuple(each.name for each in geometry.surfaces), mirrored, geometry.area, geometry.chord, geometry.span,
        np.array(geometry.reference_point, dtype=float),
    )  # fmt: skip


def spacing_of(lattice: Lattice, step: float) -> FloatArray:
    """Distance of wake vortices [m] in lengths of each strip's last panel, for a wake that moves by ``step`` metres a time step."""
    return np.asarray(step / lattice.last)


def starts(h: FloatArray) -> FloatArray:
    """:func:`wake_start` of each strip [m]."""
    return np.array([wake_start(float(each)) for each in np.round(h, 12)])


def rings(lattice: Lattice, h: FloatArray) -> FloatArray:
    """Corners [n, 4, 3] of the bound rings: left front, right front, right aft, left aft.

    The aft side of a ring is the next bound vortex of its strip; for the last panel it is the shed line, where the first wake
    vortex lies. ``h`` [m] is the distance of wake vortices in lengths of the last panel, 0 for a continuous wake.
    """
    aft = np.empty_like(lattice.bound)
    aft[:-1] = lattice.bound[1:]
    aft[lattice.trailing] = shed_line(lattice, starts(h) + 0.5 * h)
    return np.ascontiguousarray(np.concatenate([lattice.bound, aft[:, ::-1]], axis=1))


def shed_line(lattice: Lattice, behind: FloatArray) -> FloatArray:
    """Ends [m, 2, 3] of a line ``behind`` [m] last panels aft of each strip's trailing edge, along the chord there."""
    return np.asarray(lattice.edge + (behind * lattice.last)[:, None, None] * lattice.tangent[:, None, :])
