"""Factors of a study file: their distribution in the unit of what they set in the vehicle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from typing import Any

import numpy as np

from levelone.config.study_schema import FactorTable, in_words
from levelone.config.units import to_si
from levelone.errors import InputError, unknown_name
from levelone.handling.history import FloatArray
from levelone.handling.manoeuvres import Manoeuvre
from levelone.uncertainty import DISTRIBUTIONS, Distribution, Factor, FactorSpace, uniform_around
from levelone.uncertainty.distributions import Interval
from levelone.vehicle import TARGET_UNITS, TARGETS, Vehicle, nominal_value, vary

#: distributions that a file gives as a range about the nominal value
AS_RANGE = ("uniform", "interval")
#: relative difference at which a study's value no longer counts as that of its vehicle
SAME_VALUE = 1e-9


@dataclass(frozen=True, eq=False)
class Inputs:
    """Factors, the targets that they set, and their nominal values in the vehicle (read-only)."""

    space: FactorSpace
    targets: tuple[str, ...]
    nominal: FloatArray


def inputs_of(tables: Sequence[tuple[str, FactorTable]], vehicle: Vehicle, airspeed: float) -> Inputs:
    """The factors of a study.

    Parameters
    ----------
    tables
        Path of each entry in the file, for errors, and the entry.
    vehicle, airspeed
        As for :func:`factor_of`.

    Raises
    ------
    InputError
        As for :func:`factor_of`; a target that two factors set, a name given twice, a distribution without ends.
    """
    factors, targets, nominal = zip(*(factor_of(table, vehicle, airspeed, path) for path, table in tables), strict=True)
    check_targets([path for path, _ in tables], factors)
    space = FactorSpace(factors)
    space.require_bounded("a Morris design")
    values = np.array(nominal)
    values.setflags(write=False)
    return Inputs(space, targets, values)


def check_targets(paths: Sequence[str], factors: Sequence[Factor]) -> None:
    """InputError under its path for a factor whose target another one sets before it."""
    first: dict[str | None, Factor] = {}
    for path, factor in zip(paths, factors, strict=True):
        other = first.setdefault(factor.target, factor)
        if other is not factor:
            raise InputError(path, f"sets {factor.target} as the factor {other.name} does; each target may be set once")


def check_corners(inputs: Inputs, paths: Sequence[str], vehicle: Vehicle, manoeuvres: tuple[Manoeuvre, ...]) -> None:
    """Refuse a box whose lowest or highest corner is no vehicle, or leaves what every run needs.

    Parameters
    ----------
    inputs
        The factors.
    paths
        Path of each factor's entry in the file, in their order.
    vehicle
        The nominal vehicle.
    manoeuvres
        What it is to fly, all from one trim.
    """
    from levelone.dynamics.simulate import check_before_flight

    corners = inputs.space.transform(np.array([[0.0], [1.0]]) * np.ones(len(inputs.space)))
    try:
        batch = vary(vehicle, inputs.targets, corners, manoeuvres[0].trim_speed)
    except InputError as error:
        where = dict(zip(inputs.targets, paths, strict=True))
        raise InputError(f"{where[error.field]}.range" if error.field in where else error.field, error.problem) from None
    for flown in manoeuvres:
        check_before_flight(batch, flown)


def factor_of(table: FactorTable, vehicle: Vehicle, airspeed: float, path: str | None = None) -> tuple[Factor, str, float]:
    """The factor, its target, and its nominal value in the vehicle.

    Parameters
    ----------
    table
        Entry of the study file.
    vehicle
        The nominal vehicle, whose value must be the one that the entry gives.
    airspeed
        m/s: where a coefficient is read.
    path
        Of the entry in the file; "factor.NAME" by default.

    Raises
    ------
    InputError
        Unknown target or distribution, wrong unit, a range that is reversed or has no width, a value that is not the vehicle's.
    """
    path = path if path is not None else f"factor.{table.name}"
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
    factor = Factor(table.name, distribution_of(table, value, scale, path), target=target, unit=unit, source=in_words(table))
    return factor, target, nominal


def distribution_of(table: FactorTable, value: float, scale: float, path: str) -> Distribution:
    """Distribution of an entry in the unit of its target, for which ``value`` is given and ``scale`` converts the other numbers.

    Raises
    ------
    InputError
        Unknown distribution, parameters that are missing, of another distribution or out of range.
    """
    if table.distribution not in DISTRIBUTIONS:
        raise unknown_name(f"{path}.distribution", table.distribution, DISTRIBUTIONS)
    made = DISTRIBUTIONS[table.distribution]
    _check_keys(table, path)
    if table.range is not None and table.kind is not None:
        low, high = table.range if table.kind == "relative" else (scale * end for end in table.range)
        around = uniform_around(value, low, high, table.kind, field=f"{path}.range")
        return Interval(around.low, around.high) if table.distribution == "interval" else around
    try:
        return made(**{name: _converted(name, given, scale) for name, given in table.parameters.items()})
    except InputError as error:
        raise InputError(f"{path}.{error.field.rpartition('.')[2]}", error.problem) from None


def _check_keys(table: FactorTable, path: str) -> None:
    """Refuse a parameter that is missing or belongs to another distribution."""
    if table.distribution in AS_RANGE:
        required, optional = ["range", "kind"], []
    else:
        items = fields(DISTRIBUTIONS[table.distribution])
        required, optional = [f.name for f in items if f.default is MISSING], [f.name for f in items if f.default is not MISSING]
    article = "an" if table.distribution[0] in "aei" else "a"
    takes = f"{article} {table.distribution} distribution takes {', '.join(required + optional)}"
    for name in table.parameters:
        if name not in required + optional:
            raise InputError(f"{path}.{name}", f"has no place here: {takes}")
    for name in required:
        if name not in table.parameters:
            raise InputError(f"{path}.{name}", f"missing: {takes}")


def _converted(name: str, given: Any, scale: float) -> Any:
    """A parameter in the unit of the target; ``mu`` is a mean of logarithms, ``sigma``, ``weights`` and ``masses`` have no unit."""
    if name == "mu":
        return given + math.log(scale)
    if name == "intervals":
        return tuple((scale * low, scale * high) for low, high in given)
    if name in ("sigma", "weights", "masses"):
        return tuple(given) if isinstance(given, list) else given
    return tuple(scale * each for each in given) if isinstance(given, list) else scale * given
