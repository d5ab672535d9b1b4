"""Sections of a geometry file. A number stands for the unit named here, or is a table of value, unit and origin."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from levelone.config.quantities import Origin, Quantity, si
from levelone.config.schema import Strict, Text, shown
from levelone.errors import InputError

CamberLine = tuple[tuple[float, float], ...]
Spacing = Literal["uniform", "cosine"]
Count = Annotated[int, Field(ge=1)]


class Number(Quantity):
    """A number or point; unlike in a vehicle file its origin may be left out."""

    needed = False


def _or_plain(unit: str) -> BeforeValidator:
    return BeforeValidator(lambda given: given if isinstance(given, dict) else {"value": given, "unit": unit})


Length = Annotated[Number, _or_plain("m"), si("m", sign="positive")]
Area = Annotated[Number, _or_plain("m^2"), si("m^2", sign="positive")]
Angle = Annotated[Number, _or_plain("rad"), si("rad")]
Point = Annotated[Number, _or_plain("m"), si("m", (3,))]


class Camber(Origin):
    """A mean line: ``value`` becomes its points, none for a flat one."""

    value: Any


def _mean_line(given: Camber) -> Camber:
    if not isinstance(given.value, str):
        return given.model_copy(update={"value": _points(given.value)})
    if given.value == "flat":
        return given.model_copy(update={"value": ()})
    digits = re.fullmatch(r"(?i:naca)[ -]?([0-9])([0-9])[0-9]{2}", given.value)
    if digits is None or (digits[1] == "0") != (digits[2] == "0"):
        raise InputError("", f'is {shown(given.value)}; must be "flat", a 4-digit section such as "NACA 4412", or a list of points')
    return given.model_copy(update={"value": naca_mean_line(int(digits[1]) / 100.0, int(digits[2]) / 10.0)})


def _points(given: Any) -> CamberLine:
    rows = given if isinstance(given, list) else []
    if not rows or not all(isinstance(row, list) and len(row) == 2 and all(map(_is_number, row)) for row in rows):
        raise InputError("", f"is {shown(given)}; must be a list of rows of 2 numbers, x/c and z/c, or the name of a mean line")
    return tuple((float(x), float(z)) for x, z in rows)


def _is_number(given: Any) -> bool:
    return isinstance(given, int | float) and not isinstance(given, bool) and bool(np.isfinite(given))


def naca_mean_line(height: float, place: float, intervals: int = 20) -> CamberLine:
    """Mean line of a NACA 4-digit section: two parabolas that meet at their greatest height; empty for height 0.

    Parameters
    ----------
    height, place
        Greatest height and where it lies, in chords (NACA 4412: 0.04 and 0.4).
    intervals
        On each parabola, of equal length.

    Notes
    -----
    Abbott and von Doenhoff, Theory of Wing Sections, Dover 1959, section 6.4.
    """
    if height == 0.0:
        return ()
    front = np.linspace(0.0, place, intervals + 1)[1:]
    rear = np.linspace(place, 1.0, intervals + 1)[1:-1]
    z_front = height / place**2 * (2.0 * place * front - front**2)
    z_rear = height / (1.0 - place) ** 2 * (1.0 - 2.0 * place + 2.0 * place * rear - rear**2)
    x, z = np.concatenate([front, rear]).tolist(), np.concatenate([z_front, z_rear]).tolist()
    return ((0.0, 0.0), *zip(x, z, strict=True), (1.0, 0.0))


CamberGiven = Annotated[
    Camber,
    BeforeValidator(lambda given: given if isinstance(given, dict) else {"value": given}),
    AfterValidator(_mean_line),
]


class Reference(Origin):
    """[geometry] reference"""

    area: Area | None = None
    chord: Length | None = None
    span: Length | None = None
    point: Point | None = None


class General(Strict):
    """[geometry]"""

    name: Text
    description: str = ""
    reference: Reference = Reference()


class SurfaceEntry(Origin):
    """[[surface]]"""

    name: Text
    position: Point
    span: Length
    chord: Length | None = None
    root_chord: Length | None = None
    tip_chord: Length | None = None
    sweep: Angle | None = None
    dihedral: Angle | None = None
    twist: Angle | None = None
    incidence: Angle | None = None
    camber: CamberGiven | None = None
    mirrored: bool = True
    panels: Annotated[list[Count], Field(min_length=2, max_length=2, default_factory=lambda: [8, 10])]
    spacing: Annotated[list[Spacing], Field(min_length=2, max_length=2, default_factory=lambda: ["uniform", "cosine"])]


class GeometryFile(Strict):
    """A whole geometry file."""

    geometry: General
    surface: Annotated[list[SurfaceEntry], Field(min_length=1)]
