"""Geometries that tests of the lattice share."""

from __future__ import annotations

from levelone.aerodynamics.geometry import Geometry, Surface

ORIGIN = (0.0, 0.0, 0.0)


def geometry(*surfaces: Surface, area: float = 0.78, chord: float = 0.26, span: float = 3.0) -> Geometry:
    return Geometry("test", "", surfaces, area, chord, span, ORIGIN)


def section(chordwise: int, **changes: object) -> Geometry:
    """One strip of a wing so wide that its middle sees two-dimensional flow; unit chord."""
    width = 1e5
    surface = Surface("wing", (0.0, -0.5 * width, 0.0), width, 1.0, 1.0, mirrored=False, chordwise=chordwise, strips=1, **changes)  # type: ignore[arg-type]
    return geometry(surface, area=width, chord=1.0, span=width)


def wing(chordwise: int = 4, strips: int = 6, **changes: object) -> Surface:
    """The reference wing."""
    return Surface("wing", ORIGIN, 1.5, 0.26, 0.26, chordwise=chordwise, strips=strips, **changes)  # type: ignore[arg-type]


def tail(chordwise: int = 2, strips: int = 3, **changes: object) -> Surface:
    """The reference tail."""
    return Surface("tail", (1.08, 0.0, 0.0), 0.3605, 0.13, 0.13, chordwise=chordwise, strips=strips, **changes)  # type: ignore[arg-type]
