"""Factors of a study file: their distribution in the unit of what they set in the vehicle."""

from __future__ import annotations

import math
from dataclasses import MISSING, fields
from typing import Any

from levelone.config.study_schema import FactorTable
from levelone.config.units import to_si
from levelone.errors import InputError, unknown_name
from levelone.uncertainty import DISTRIBUTIONS, Distribution, Factor, uniform_around
from levelone.vehicle import TARGET_UNITS, TARGETS, Vehicle, nominal_value

#: relative difference at which a study's value no longer counts as that of its vehicle
SAME_VALUE = 1e-9


def factor_of(table: FactorTable, vehicle: Vehicle, airspeed: float) -> tuple[Factor, str, float]:
    """The factor, its target, and its nominal value in the vehicle.

    Parameters
    ----------
    table
        Entry of the study file.
    vehicle
        The nominal vehicle, whose value must be the one that the entry gives.
    airspeed
        m/s: where a coefficient is read.

    Raises
    ------
    InputError
        Unknown target or distribution, wrong unit, a range that is reversed or has no width, a value that is not the vehicle's.
    """
    path = f"factor.{table.name}"
    table.require(path)
    target = table.target if table.target is not None else table.name
    if target not in TARGETS:
        raise unknown_name(f"{path}.{'name' if table.target is None else 'target'}", target, TARGETS)
    unit = TARGET_UNITS[target]
    scale = to_si(1.0, table.unit, unit, f"{path}.unit")
    value = scale * table.value
    nominal = nominal_value(vehicle, target, airspeed)
    if abs(value - nominal) > SAME_VALUE * abs(nominal):
        raise InputError(
            f"{path}.value",
            f"is {value:.10g} {unit}, and the vehicle {vehicle.name!r} has {nominal:.10g} {unit}: change one of them",
        )
    source = table.source if table.source is not None else f"assumed: {table.assumed}"
    factor = Factor(table.name, _distribution(table, value, scale), target=target, unit=unit, source=source)
    return factor, target, nominal


def _distribution(table: FactorTable, value: float, scale: float) -> Distribution:
    path = f"factor.{table.name}"
    if table.distribution not in DISTRIBUTIONS:
        raise unknown_name(f"{path}.distribution", table.distribution, DISTRIBUTIONS)
    made = DISTRIBUTIONS[table.distribution]
    _check_keys(table)
    if table.range is not None and table.kind is not None:
        low, high = table.range if table.kind == "relative" else (scale * end for end in table.range)
        return uniform_around(value, low, high, table.kind, field=f"{path}.range")
    try:
        return made(**{name: _converted(name, given, scale) for name, given in table.parameters.items()})
    except InputError as error:
        raise InputError(f"{path}.{error.field.rpartition('.')[2]}", error.problem) from None


def _check_keys(table: FactorTable) -> None:
    """Refuse a parameter that is missing or belongs to another distribution."""
    if table.distribution == "uniform":
        required, optional = ["range", "kind"], []
    else:
        items = fields(DISTRIBUTIONS[table.distribution])
        required, optional = [f.name for f in items if f.default is MISSING], [f.name for f in items if f.default is not MISSING]
    takes = f"a {table.distribution} distribution takes {', '.join(required + optional)}"
    for name in table.parameters:
        if name not in required + optional:
            raise InputError(f"factor.{table.name}.{name}", f"has no place here: {takes}")
    for name in required:
        if name not in table.parameters:
            raise InputError(f"factor.{table.name}.{name}", f"missing: {takes}")


def _converted(name: str, given: Any, scale: float) -> Any:
    """A parameter in the unit of the target; ``mu`` is a mean of logarithms, ``sigma`` and ``weights`` have no unit."""
    if name == "mu":
        return given + math.log(scale)
    if name in ("sigma", "weights"):
        return tuple(given) if isinstance(given, list) else given
    return tuple(scale * each for each in given) if isinstance(given, list) else scale * given
