"""Units: the only place where a number changes its unit.

Angle is a dimension of its own here, unlike in SI: a derivative per degree or a rate in rpm is converted, and a number without an
angle where one belongs is refused.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.errors import InputError, closest

# A list of our own rather than the library's: the full one takes half a second to read and knows units by names that look like
# slips of the pen. SI prefixes milli to kilo are understood before every unit.
_DEFINITIONS = """
micro- = 1e-6 = µ- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
metre = [length] = m = meter
gram = [mass] = g
second = [time] = s
radian = [angle] = rad
newton = kilogram * metre / second ** 2 = N
hertz = 1 / second = Hz
pascal = newton / metre ** 2 = Pa
degree = 3.141592653589793 / 180 * radian = deg
revolution = 2 * 3.141592653589793 * radian = rev
minute = 60 * second = min
hour = 3600 * second = h
rpm = revolution / minute
knot = 1852 / 3600 * metre / second = kt = kts
inch = 0.0254 * metre = in = inches
foot = 0.3048 * metre = ft = feet
pound = 0.45359237 * kilogram = lb
slug = 14.593902937206365 * kilogram
pound_force = 4.4482216152605 * newton = lbf
percent = 0.01 = %
"""
KNOWN = ("m", "cm", "mm", "g", "kg", "s", "ms", "min", "h", "rad", "deg", "rev", "rpm", "N", "mN", "kN", "Hz", "Pa", "knot", "kt",
         "inch", "ft", "lb", "slug", "lbf", "percent", "1")  # fmt: skip
"""Symbols that an error suggests."""


@cache
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(None)
    for line in _DEFINITIONS.strip().splitlines():
        registry.define(line)
    return registry


def to_si(value: ArrayLike, unit: str, expected: str, field: str) -> Any:
    """A number, or an array of any shape, in the unit that the package works in.

    Parameters
    ----------
    value
        Number or numbers in ``unit``.
    unit
        Unit as the user wrote it: ``"kg"``, ``"kg m^2"``, ``"1/deg"``, ``"g*cm**2"``; ``"1"`` for a pure number.
    expected
        Unit that the field is kept in (``"kg m^2"``, ``"1/rad"``, ``"N/rpm^2"``).
    field
        Path that an error names.

    Returns
    -------
    float or array
        A float for a number; the number itself, to the last bit, where both units are written alike.

    Raises
    ------
    InputError
        Unknown unit, or one of another dimension.
    """
    numbers = np.asarray(value, dtype=np.float64)
    if unit != expected:
        numbers = _factor(unit, expected, field) * numbers
    return numbers if numbers.ndim else float(numbers)


def _factor(unit: str, expected: str, field: str) -> float | NDArray[np.float64]:
    import pint

    registry = _registry()
    if not unit.strip():
        raise InputError(field, f"the unit is missing; expected {expected} or what converts to it")
    try:
        given = registry.parse_units(unit)
    except pint.UndefinedUnitError as error:
        name = error.unit_names if isinstance(error.unit_names, str) else next(iter(error.unit_names))
        where = "" if name == unit else f" in {unit!r}"
        raise InputError(field, f"unknown unit {name!r}{where}, expected {expected}; {closest(name, KNOWN)}") from None
    except Exception:  # the parser of the library raises whatever its tokens run into
        raise InputError(field, f"{unit!r} is not a unit, expected {expected}; write it like 'kg m^2' or 'N/rpm^2'") from None
    try:
        return registry.Quantity(1.0, given).to(registry.parse_units(expected)).magnitude
    except pint.DimensionalityError:
        raise InputError(field, f"unit {unit!r} does not fit, expected {expected} or what converts to it") from None
