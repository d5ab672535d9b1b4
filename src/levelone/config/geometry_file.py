"""Geometry files: a TOML file becomes a :class:`levelone.aerodynamics.geometry.Geometry`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from levelone.aerodynamics.geometry import Geometry, Surface
from levelone.aerodynamics.geometry import Point as PointValue
from levelone.aerodynamics.intersect import check_intersections
from levelone.config.files import PathOrName, path_of, read_toml, shipped
from levelone.config.geometry_schema import GeometryFile, Number, Reference, SurfaceEntry
from levelone.config.quantities import origins
from levelone.config.schema import check, in_file, in_section
from levelone.errors import InputError


def geometries() -> dict[str, Path]:
    """Geometries that ship with the package: name and file."""
    return shipped("levelone.aerodynamics")


def geometry_path(path_or_name: PathOrName) -> Path:
    """File of a geometry of the library by its name, or of the user's by its path (which ends in .toml).

    Raises
    ------
    InputError
        Neither a known name nor a path; the closest name is in the text.
    """
    return path_of(path_or_name, geometries(), "geometry")


def load_geometry(path_or_name: PathOrName) -> Geometry:
    """Read a geometry.

    Parameters
    ----------
    path_or_name
        Path of a .toml file, or the name of a geometry of the library (``"reference-wing-tail"``). The format is described in
        docs/reference/geometry-file.md.

    Returns
    -------
    Geometry
        SI and radians; ``assumed`` lists every field that the file marks as assumed and every reference value that it leaves out.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed; surfaces that intersect are named.
    """
    path = geometry_path(path_or_name)
    content = check(GeometryFile, read_toml(path), path.name)
    with in_file(path.name):
        surfaces = tuple(_surface(entry) for entry in content.surface)
        reference, derived = _reference(content.geometry.reference, surfaces[0])
        geometry = Geometry(
            name=content.geometry.name,
            description=content.geometry.description,
            surfaces=surfaces,
            area=reference["area"],
            chord=reference["chord"],
            span=reference["span"],
            reference_point=reference["point"],
            assumed=(*_marked(content), *derived),
        )
        check_intersections(geometry)
        return geometry


def _marked(content: GeometryFile) -> list[tuple[str, str]]:
    """(path, why) of everything that the file marks as assumed."""
    found = list(origins(content.geometry, "geometry"))
    for entry in content.surface:
        found += origins(entry, f"surface.{entry.name}")
    return found


def _surface(given: SurfaceEntry) -> Surface:
    root, tip = _chords(given)
    position = _point(given.position)
    with in_section(f"surface.{given.name}"):
        return Surface(
            name=given.name,
            position=position,
            span=given.span.value / (2.0 if _tip_to_tip(given.mirrored, position) else 1.0),
            root_chord=root,
            tip_chord=tip,
            sweep=_angle(given.sweep),
            dihedral=_angle(given.dihedral),
            twist=_angle(given.twist),
            incidence=_angle(given.incidence),
            camber=() if given.camber is None else given.camber.value,
            mirrored=given.mirrored,
            chordwise=given.panels[0],
            strips=given.panels[1],
            chord_spacing=given.spacing[0],
            span_spacing=given.spacing[1],
        )


def _tip_to_tip(mirrored: bool, position: PointValue) -> bool:
    """Whether the halves of a surface join at the plane of symmetry, so that its span is that of both."""
    return mirrored and position[1] == 0.0


def _chords(given: SurfaceEntry) -> tuple[float, float]:
    names = {name for name in ("chord", "root_chord", "tip_chord") if getattr(given, name) is not None}
    if given.chord is not None and names == {"chord"}:
        return given.chord.value, given.chord.value
    if given.root_chord is not None and given.tip_chord is not None and given.chord is None:
        return given.root_chord.value, given.tip_chord.value
    got = "got " + " and ".join(sorted(names)) if names else "neither is there"
    raise InputError(f"surface.{given.name}.chord", f"either chord, or root_chord and tip_chord; {got}")


def _angle(given: Number | None) -> float:
    return 0.0 if given is None else float(given.value)


def _point(given: Number) -> PointValue:
    x, y, z = given.value.tolist()
    return x, y, z


def _reference(given: Reference, main: Surface) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Area, chord, span and point by name, and which of them were taken from the first surface."""
    joined = _tip_to_tip(main.mirrored, main.position)
    span = main.span * (2.0 if joined else 1.0)
    taper = main.tip_chord / main.root_chord
    defaults: dict[str, tuple[Any, str]] = {
        "area": (span * 0.5 * (main.root_chord + main.tip_chord), "span times mean chord"),
        "chord": (2.0 / 3.0 * main.root_chord * (1.0 + taper + taper**2) / (1.0 + taper), "mean aerodynamic chord"),
        "span": (span, "span"),
        "point": (main.position, "quarter chord of the root"),
    }
    values: dict[str, Any] = {}
    derived = []
    for name, (default, what) in defaults.items():
        path, own = f"geometry.reference.{name}", getattr(given, name)
        if own is not None:
            values[name] = _point(own) if name == "point" else own.value
        elif main.mirrored and not joined:
            raise InputError(path, f"missing: the first surface, {main.name!r}, has two separate halves, so it cannot stand for it")
        else:
            values[name] = default
            derived.append((path, f"not given: {what} of the first surface, {main.name!r}"))
    return values, derived
