"""Lifting surfaces and the quantities that their coefficients are made with.

Frame: x aft, y to the right (starboard), z up, SI metres, radians. A surface is a sheet without thickness between a root and a tip
section; its quarter-chord line is straight. A mirrored surface exists a second time at y -> -y.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import Akima1DInterpolator

from levelone.errors import InputError, unknown_name

FloatArray = NDArray[np.float64]
Point = tuple[float, float, float]
SPACINGS = ("uniform", "cosine")
"""How panels share a chord or a span: all alike, or denser towards both ends."""

STEEP = math.radians(60.0)
"""Dihedral from which on sections lie in planes z = constant instead of y = constant."""

_SWEEP_LIMIT = math.radians(75.0)
_ANGLE_LIMIT = math.radians(45.0)  # of incidence and twist: attached flow ends far below
_UPRIGHT = math.radians(85.0)  # from here on a surface on the plane of symmetry is its own mirror image
_GAP = 0.01  # least distance between the halves of a mirrored surface and the plane of symmetry, in root chords


@dataclass(frozen=True)
class Surface:
    """A lifting surface; with ``mirrored``, its starboard half.

    Parameters
    ----------
    name
        Name in tables and errors.
    position
        Quarter-chord point of the root section, m.
    span
        Length from root to tip along the surface, seen in the direction of x, m: one side of a mirrored surface. Neither sweep
        nor dihedral shortens it.
    root_chord, tip_chord
        Chord at both ends, square to the span axis, m; linear in between.
    sweep
        Of the quarter-chord line against the span axis (0, cos dihedral, sin dihedral), aft positive, rad.
    dihedral
        Tip up positive, rad; pi/2 is a fin or end plate that rises from its root.
    twist
        Tip against root, nose up positive, linear in span, rad.
    incidence
        Of the whole surface: each section is turned about its quarter-chord point and the span axis, rad. Positive turns the nose
        to the side that (0, -sin dihedral, cos dihedral) points to: up, and to the left for an upright fin.
    camber
        Mean line as (x/c, z/c) from (0, 0) to (1, 0), x increasing; z on the side that the nose goes to with positive incidence.
        Empty: flat. A smooth curve (Akima) joins the points.
    mirrored
        A mirror image at y -> -y exists as well.
    chordwise, strips
        Panels along the chord, strips from root to tip (one side).
    chord_spacing, span_spacing
        ``"uniform"`` or ``"cosine"``.

    Raises
    ------
    InputError
        A chord, span or count that is not positive, an angle out of range, a camber line with other ends, an unknown spacing, or a
        mirrored surface that reaches or nearly reaches across the plane of symmetry.
    """

    name: str
    position: Point
    span: float
    root_chord: float
    tip_chord: float
    sweep: float = 0.0
    dihedral: float = 0.0
    twist: float = 0.0
    incidence: float = 0.0
    camber: tuple[tuple[float, float], ...] = ()
    mirrored: bool = True
    chordwise: int = 8
    strips: int = 10
    chord_spacing: str = "uniform"
    span_spacing: str = "cosine"

    def __post_init__(self) -> None:
        _finite("position", self.position)
        for name in ("span", "root_chord", "tip_chord"):
            _positive(name, getattr(self, name))
        limits = {"sweep": _SWEEP_LIMIT, "dihedral": math.pi / 2, "twist": _ANGLE_LIMIT, "incidence": _ANGLE_LIMIT}
        for name, limit in limits.items():
            _within(name, getattr(self, name), limit)
        for name in ("chordwise", "strips"):
            if not getattr(self, name) >= 1:
                raise InputError(name, f"must be 1 or more, got {getattr(self, name)}")
        for name in ("chord_spacing", "span_spacing"):
            if getattr(self, name) not in SPACINGS:
                raise unknown_name(name, getattr(self, name), SPACINGS)
        _check_camber(self.camber)
        if self.mirrored:
            _check_half(self)


@dataclass(frozen=True)
class Geometry:
    """Surfaces, and what makes forces and moments dimensionless.

    Parameters
    ----------
    name, description
        Name in tables and titles; free text.
    surfaces
        One or more, with names of their own.
    area, chord, span
        Reference area (m^2), length of the pitching moment and of the pitch rate (m), length of roll and yaw (m).
    reference_point
        Point that the moments are about, m.
    assumed
        (field, why) of everything that no source gives.

    Raises
    ------
    InputError
        No surface, a name twice, a reference value that is not positive.
    """

    name: str
    description: str
    surfaces: tuple[Surface, ...]
    area: float
    chord: float
    span: float
    reference_point: Point
    assumed: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        if not self.surfaces:
            raise InputError("surface", "a geometry needs at least one")
        twice = [name for name, count in Counter(surface.name for surface in self.surfaces).items() if count > 1]
        if twice:
            raise InputError("surface", f"two surfaces are called {twice[0]!r}; each needs a name of its own")
        for name in ("area", "chord", "span"):
            _positive(name, getattr(self, name))
        _finite("reference_point", self.reference_point)


def refined(geometry: Geometry, chordwise: float, strips: float) -> Geometry:
    """The same geometry with all panel counts along the chord and along the span multiplied, rounded, at least 1."""
    for name, factor in (("chordwise", chordwise), ("strips", strips)):
        _positive(name, factor)

    def scaled(count: int, factor: float) -> int:
        return max(1, math.floor(count * factor + 0.5))  # half a panel counts up: 5 x 0.5 and 7 x 0.5 are 3 and 4

    surfaces = tuple(
        replace(surface, chordwise=scaled(surface.chordwise, chordwise), strips=scaled(surface.strips, strips))
        for surface in geometry.surfaces
    )
    return replace(geometry, surfaces=surfaces)


def points(surface: Surface, eta: ArrayLike, xi: ArrayLike) -> FloatArray:
    """Points of the mean surface (of the starboard half of a mirrored one), m.

    Parameters
    ----------
    surface
        The surface.
    eta
        [...] station from root 0 to tip 1.
    xi
        [...] from the leading edge 0 to the trailing edge 1; broadcast against ``eta``.

    Returns
    -------
    array
        [..., 3].

    Notes
    -----
    A section turned about the span axis would not stay in its plane where there is dihedral: the halves of a wing would overlap at
    the plane of symmetry on one side of the quarter chord and leave a gap on the other. Each point is therefore slid along the span
    axis until the section lies in a plane y = constant again (z = constant for a surface steeper than ``STEEP``). An unswept,
    untapered, untwisted surface is unchanged by this but for the cut of its ends.
    """
    eta, xi = np.broadcast_arrays(np.asarray(eta, dtype=np.float64), np.asarray(xi, dtype=np.float64))
    chord = surface.root_chord + eta * (surface.tip_chord - surface.root_chord)
    angle = surface.incidence + eta * surface.twist
    along, height = (xi - 0.25) * chord, mean_line(surface, xi) * chord
    aft = along * np.cos(angle) + height * np.sin(angle)
    offset = _in_section(surface, aft, height * np.cos(angle) - along * np.sin(angle))
    axis = math.tan(surface.sweep), math.cos(surface.dihedral), math.sin(surface.dihedral)
    length = eta * surface.span
    return np.stack([start + length * way + off for start, way, off in zip(surface.position, axis, offset, strict=True)], axis=-1)


def _in_section(surface: Surface, aft: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """x, y, z of a vector aft and square to chord and span axis, slid along the span axis into the plane of the section."""
    level = np.zeros_like(up)
    if abs(surface.dihedral) > STEEP:
        return aft, -up / math.sin(surface.dihedral), level
    return aft, level, up / math.cos(surface.dihedral)


def tangents(surface: Surface, eta: ArrayLike, xi: ArrayLike) -> FloatArray:
    """Unit vectors [..., 3] along the mean line, aft, at :func:`points` of the same arguments."""
    eta, xi = np.broadcast_arrays(np.asarray(eta, dtype=np.float64), np.asarray(xi, dtype=np.float64))
    angle, slope = surface.incidence + eta * surface.twist, mean_slope(surface, xi)
    aft, y, z = _in_section(surface, np.cos(angle) + slope * np.sin(angle), slope * np.cos(angle) - np.sin(angle))
    along = np.stack([aft, y, z], axis=-1)
    return np.asarray(along / np.linalg.norm(along, axis=-1, keepdims=True))


def mirror(points: FloatArray) -> FloatArray:
    """Points [..., 3] of the mirror image at y -> -y."""
    return points * np.array([1.0, -1.0, 1.0])


def mean_line(surface: Surface, xi: ArrayLike) -> FloatArray:
    """Height z/c of the camber line at x/c = xi, of the shape of ``xi``."""
    return _camber(surface, np.asarray(xi, dtype=np.float64), 0)


def mean_slope(surface: Surface, xi: ArrayLike) -> FloatArray:
    """Slope dz/dx of the camber line at x/c = xi, of the shape of ``xi``."""
    return _camber(surface, np.asarray(xi, dtype=np.float64), 1)


def _camber(surface: Surface, xi: FloatArray, order: int) -> FloatArray:
    if len(surface.camber) < 3:
        return np.zeros_like(xi)
    x, z = np.array(surface.camber).T
    return np.asarray(Akima1DInterpolator(x, z)(xi, nu=order), dtype=np.float64)


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(name, f"must be positive, got {value:g}")


def _finite(name: str, values: Iterable[float]) -> None:
    given = tuple(values)
    if len(given) != 3 or not all(math.isfinite(value) for value in given):
        raise InputError(name, f"must be three finite numbers x, y, z, got {given}")


def _within(name: str, angle: float, limit: float) -> None:
    if not abs(angle) <= limit * (1.0 + 1e-12):
        raise InputError(
            name, f"{angle:g} rad ({math.degrees(angle):g} deg) is outside -{math.degrees(limit):g} to {math.degrees(limit):g} deg"
        )


def _check_camber(camber: tuple[tuple[float, float], ...]) -> None:
    if not camber:
        return
    if camber[0] != (0.0, 0.0) or camber[-1] != (1.0, 0.0):
        raise InputError("camber", f"must run from (0, 0) to (1, 0) in chords, got {camber[0]} to {camber[-1]}")
    for (before, _), (after, height) in pairwise(camber):
        if not after > before:
            raise InputError("camber", f"x/c must increase from point to point, got {after:g} after {before:g}")
        if not abs(height) < 0.5:
            raise InputError("camber", f"z/c = {height:g} at x/c = {after:g}; must lie between -0.5 and 0.5")


def _check_half(surface: Surface) -> None:
    """What a starboard half must keep to so that it and its mirror image do not overlap."""
    y, chord = surface.position[1], surface.root_chord
    if y < 0.0:
        raise InputError("position", f"y = {y:g} m: a mirrored surface is described by its starboard half, with its root at y >= 0")
    if 0.0 < y < _GAP * chord:
        raise InputError(
            "position",
            f"y = {y:g} m is off the plane of symmetry by less than {_GAP:.0%} of the root chord; y = 0 joins the halves",
        )
    if y == 0.0 and abs(surface.dihedral) > _UPRIGHT:
        raise InputError("mirrored", "an upright surface on the plane of symmetry is its own mirror image; mirrored = false")
    reached = float(points(surface, [[0.0], [1.0]], np.linspace(0.0, 1.0, 21))[..., 1].min())
    if reached < -1e-9 * chord:
        raise InputError("position", f"the surface crosses the plane of symmetry (to y = {reached:g} m) into its mirror image")
