"""Variables of an FMU against what the study says of them: names, causality, types and units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from levelone.campaign.models.fmu_archive import library
from levelone.campaign.models.mapping import ratio_of_units
from levelone.errors import InputError, closest, unknown_name

if TYPE_CHECKING:
    from levelone.config.model_table import Channel, FmuTable

REALS = ("Real", "Float64", "Float32")
WHOLE = ("Integer", "Enumeration", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
#: exponents of metre, second and radian in the units that commands and channels are kept in
DIMENSIONS = {"1": (0, 0, 0), "m": (1, 0, 0), "m/s": (1, -1, 0), "rad": (0, 0, 1), "rad/s": (0, -1, 1)}


def check_variables(table: FmuTable, targets: Sequence[str], description: Any) -> None:
    """Everything that can be known to be wrong without running the FMU.

    Raises
    ------
    InputError
        A name that the FMU does not have, or whose role, type or declared unit does not fit.
    """
    variables = {variable.name: variable for variable in description.modelVariables}
    for name, value in table.fixed:
        _check_start(f"model.fixed.{name}", name, variables)
        if variables[name].type not in REALS and not _whole(variables[name].type, value):
            raise InputError(f"model.fixed.{name}", f"is {value:g}, but {name!r} is of type {variables[name].type}")
    for target in targets:
        _check_start("factor.target", target, variables)
        if variables[target].type not in REALS:
            raise InputError("factor.target", f"{target!r} is of type {variables[target].type}: only a real number can be a factor")
        if target in dict(table.fixed):
            raise InputError(f"model.fixed.{target}", "is a factor too: which value holds would be hidden")
    inputs = {name: v for name, v in variables.items() if v.causality == "input"}
    for channel in table.inputs:
        field = f"model.inputs.{channel.levelone}"
        if channel.name in variables and channel.name not in inputs:
            raise InputError(f"{field}.name", f"{channel.name!r} is no input of the FMU; {closest(channel.name, inputs)}")
        _check_channel(field, channel, variables, description)
    for channel in table.outputs:
        _check_channel(f"model.outputs.{channel.levelone}", channel, variables, description)


def references(channels: Iterable[Channel], description: Any) -> dict[str, tuple[int, str]]:
    """Value reference and type of the variable of each channel, by its name in the FMU."""
    wanted = {channel.name for channel in channels}
    return {v.name: (v.valueReference, v.type) for v in description.modelVariables if v.name in wanted}


def _check_start(field: str, name: str, variables: dict[str, Any]) -> None:
    simulation = library().simulation

    def can_be_set(variable: Any) -> bool:
        return simulation.settable_in_instantiated(variable) or simulation.settable_in_initialization_mode(variable)

    if name not in variables:
        raise unknown_name(field, name, [v.name for v in variables.values() if can_be_set(v)])
    variable = variables[name]
    if not can_be_set(variable):
        able = [v.name for v in variables.values() if can_be_set(v)]
        raise InputError(field, f"{name!r} ({variable.causality}) has no start value that can be set; {closest(name, able)}")
    if variable.dimensions or variable.type not in (*REALS, *WHOLE, "Boolean"):
        raise InputError(field, f"{name!r} is no single number ({variable.type})")


def _whole(kind: str, value: float) -> bool:
    return value in (0.0, 1.0) if kind == "Boolean" else float(value).is_integer()


def _check_channel(field: str, channel: Channel, variables: dict[str, Any], description: Any) -> None:
    if channel.name not in variables:
        raise unknown_name(f"{field}.name", channel.name, variables)
    variable = variables[channel.name]
    if variable.type not in REALS or variable.dimensions:
        raise InputError(f"{field}.name", f"{channel.name!r} is no single real number ({variable.type})")
    unit = _declared(variable)
    if unit and unit != channel.unit:
        _check_unit(f"{field}.unit", channel, unit, description)


def _declared(variable: Any) -> str | None:
    return variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)


def _base_unit(declared: str, description: Any) -> Any:
    return next((each.baseUnit for each in description.unitDefinitions if each.name == declared), None)


def _check_unit(field: str, channel: Channel, declared: str, description: Any) -> None:
    """The FMU's own unit against that of the study, by its base units where it states them, else by its name."""
    from levelone.handling.manoeuvres import UNITS
    from levelone.handling.records import CHANNEL_UNITS

    base = _base_unit(declared, description)
    si = UNITS.get(channel.levelone) or CHANNEL_UNITS.get(channel.levelone)
    if base is None:
        fits = _same(ratio_of_units(channel.unit, declared))
    elif si in DIMENSIONS:
        alike = (base.m, base.s) == DIMENSIONS[si][:2] and base.rad in (0, DIMENSIONS[si][2])
        fits = alike and not _others(base) and math.isclose(base.factor, channel.scale, rel_tol=1e-6)
    else:
        fits = True
    if not fits:
        raise InputError(field, f"is {channel.unit!r}, but the FMU declares {declared!r} for {channel.name!r}")


def _others(base: Any) -> bool:
    return any((base.kg, base.A, base.K, base.mol, base.cd))


def _same(ratio: float | None) -> bool:
    """Whether two units are one; a name that only its own tool knows cannot contradict the study's word."""
    return ratio is None or math.isclose(ratio, 1.0, rel_tol=1e-6)


def check_start_units(targets: Sequence[str], units: Sequence[str], description: Any) -> None:
    """InputError where the unit of a factor contradicts the one that the FMU declares for the start value which it sets.

    Targets are those of a source that was accepted, or names that there are not, which are passed over here.
    """
    variables = {variable.name: variable for variable in description.modelVariables}
    for target, unit in zip(targets, units, strict=True):
        declared = _declared(variables[target]) if target in variables else None
        if declared and declared != unit and not _start_fits(unit, declared, _base_unit(declared, description)):
            raise InputError("factor.unit", f"is {unit!r}, but the FMU declares {declared!r} for {target!r}")


def _start_fits(unit: str, declared: str, base: Any) -> bool:
    """By base units, where radians may be left out as SI allows; by name where there are none, or ones that are unknown here."""
    if base is None or any((base.A, base.K, base.mol, base.cd, base.offset)):
        return _same(ratio_of_units(unit, declared))
    own = f"kg**{base.kg} * m**{base.m} * s**{base.s}"
    ratios = [ratio_of_units(unit, f"{own} * rad**{power}") for power in ((base.rad,) if base.rad else (0, 1, -1, 2, -2))]
    return any(ratio is None or math.isclose(ratio, base.factor, rel_tol=1e-6) for ratio in ratios)
