"""Calibration files: which assumed numbers of a vehicle may move, and which nominal handling qualities they are fitted to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

from levelone.config.calibration_schema import (
    CalibrationFile,
    ChecksTable,
    FamilyTable,
    LimitTable,
    ParameterTable,
    TargetTable,
    TradeoffTable,
)
from levelone.config.calibration_sections import Checks, Family, Limit, Parameter, Target, Tradeoff
from levelone.config.changes import changed
from levelone.config.files import file_hash, read_toml
from levelone.config.schema import check, in_file, in_section
from levelone.config.study_file import Study, load_study
from levelone.config.units import to_si
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError, unknown_name
from levelone.vehicle import TARGETS

Units = Mapping[str, str]
#: how much larger a limit of the controller is made to see whether it does anything
RAISED = 1.5


@dataclass(frozen=True, eq=False)
class Calibration:
    """A checked calibration.

    Parameters
    ----------
    name, title
        For folder and report.
    path, hash
        The file and its SHA-256.
    study
        Gives vehicle, manoeuvres and condition.
    seed, starts, perturbation
        ``starts`` perturbed starts are drawn from ``seed`` with a standard deviation of ln ``perturbation``.
    digits
        Significant digits of the calibrated numbers.
    targets, parameters, tradeoff, checks
        See there.
    """

    name: str
    title: str
    path: Path
    hash: str
    study: Study
    seed: int
    starts: int
    perturbation: float
    digits: int
    targets: tuple[Target, ...]
    parameters: tuple[Parameter, ...]
    tradeoff: Tradeoff | None
    checks: Checks

    def changes(self, values: Sequence[float]) -> dict[str, float]:
        """Changes for ``load_vehicle`` that give the parameters these values, ties included."""
        pairs = zip(self.parameters, values, strict=True)
        return {path: float(value) for each, value in pairs for path in (each.path, *each.ties)}


def load_calibration(path: str | PathLike[str], units: Units) -> Calibration:
    """Read a calibration file and its study.

    Parameters
    ----------
    path
        TOML file; the format is described in docs/reference/calibration-file.md. The study's path is relative to it.
    units
        SI unit of every nominal response that the model gives.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed: among others for a target that is no nominal
        response, and for a parameter that the study varies or whose number has a source, since published inputs are not fitted.
    """
    path = Path(path)
    content = check(CalibrationFile, read_toml(path), path.name)
    general = content.calibration
    study = load_study(path.parent / general.study)
    vehicle = read_toml(study.vehicle_path)
    with in_file(path.name):
        targets = tuple(_target(table, units) for table in content.target)
        _check_unique([target.response for target in targets], "target")
        parameters = tuple(_parameter(table, study, vehicle) for table in content.parameter)
        _check_unique([path for each in parameters for path in (each.path, *each.ties)], "parameter")
        if not any(each.role == "fit" for each in parameters):
            raise InputError("parameter", "none has the role 'fit': there is nothing to calibrate")
        return Calibration(
            name=general.name,
            title=general.title,
            path=path,
            hash=file_hash(path),
            study=study,
            seed=general.seed,
            starts=general.starts,
            perturbation=general.perturbation,
            digits=general.digits,
            targets=targets,
            parameters=parameters,
            tradeoff=None if content.tradeoff is None else _tradeoff(content.tradeoff, targets, parameters, study),
            checks=_checks(content.checks, vehicle, units),
        )


def _target(table: TargetTable, units: Units) -> Target:
    path = f"target.{table.response}"
    table.require(path)
    if table.response not in units:
        raise unknown_name("target.response", table.response, units)
    unit = units[table.response]
    value, tolerance, low, high = (
        to_si(number, table.unit, unit, f"{path}.unit") for number in (table.value, table.tolerance, *table.accept)
    )
    if not low <= value <= high:
        raise InputError(f"{path}.accept", f"is {table.accept}; the value {table.value:g} must lie in it")
    return Target(table.response, unit, value, tolerance, (low, high), _origin(table))


def _origin(table: TargetTable | LimitTable) -> str:
    return table.source if table.source is not None else f"assumed: {table.assumed}"


def _parameter(table: ParameterTable, study: Study, vehicle: Mapping[str, Any]) -> Parameter:
    path = f"parameter.{table.path}"
    if table.scale == "log" and not (table.low > 0.0 and table.spread > 1.0):
        raise InputError(path, f"on a log scale, low must be positive and spread above 1; got {table.low:g} and {table.spread:g}")
    if not (table.low <= table.prior <= table.high and table.low < table.high):
        raise InputError(f"{path}.prior", f"is {table.prior:g}; needs low <= prior <= high, got {table.low:g} and {table.high:g}")
    for name in (table.path, *table.ties):
        with in_section("parameter"):
            changed(vehicle, {name: table.prior})
        _check_free(name, path, study)
        unit = _unit_and_freedom(vehicle, name, path)
        if unit != table.unit:
            raise InputError(f"{path}.unit", f"is {table.unit!r}, and {study.vehicle_path.name} gives {name} in {unit!r}")
    for end in ("low", "high"):
        _check_flies(f"{path}.{end}", study, dict.fromkeys((table.path, *table.ties), getattr(table, end)))
    return Parameter(**table.model_dump() | {"ties": tuple(table.ties)})


def _check_free(name: str, path: str, study: Study) -> None:
    """Refuse what the study varies."""
    for factor, target in zip(study.space.names, study.targets, strict=True):
        if name.rpartition(".")[2] in (target, TARGETS[target]):
            raise InputError(path, f"{name} is the uncertain input {factor} of the study: published inputs are not fitted")


def _unit_and_freedom(vehicle: Mapping[str, Any], name: str, path: str) -> str:
    """Unit of a number of the vehicle's file, which must not have a source."""
    tables = list(_tables(vehicle, name))
    origin = next((key for table in reversed(tables) for key in ("source", "assumed") if key in table), "assumed")
    if origin == "source":
        raise InputError(path, f"{name} has a source in the vehicle's file: only what is assumed may be fitted")
    entry, last = tables[-1], name.rpartition(".")[2]
    if isinstance(entry.get(last), str):
        raise InputError(path, f"{name} is a text: only numbers can be fitted")
    return str(entry["unit"]) if len(tables) > name.count(".") else "1"  # a factor on coordinates, or an optional exponent


def _tables(vehicle: Mapping[str, Any], name: str) -> Iterator[Mapping[str, Any]]:
    """The tables that a path passes through, the outermost first."""
    table: Any = vehicle
    for key in name.split("."):
        table = table.get(key)
        if not isinstance(table, Mapping):
            return
        yield table


def _check_flies(field: str, study: Study, changes: Mapping[str, float]) -> None:
    """Refuse a value with which there is no vehicle, or none whose controller has a trim to fly about."""
    from levelone.dynamics.trim import law_of

    try:
        law_of(load_vehicle(study.vehicle_path, changes))
    except InputError as error:
        raise InputError(field, str(error)) from None


def _tradeoff(table: TradeoffTable, targets: Sequence[Target], parameters: Sequence[Parameter], study: Study) -> Tradeoff:
    names = [target.response for target in targets]
    if table.response not in names:
        raise unknown_name("tradeoff.response", table.response, names)
    index = names.index(table.response)
    values, tolerance = (
        to_si(given, table.unit, targets[index].unit, "tradeoff.unit") for given in (table.values, table.tolerance)
    )
    families = tuple(_family(each, parameters, study) for each in table.family)
    return Tradeoff(index, tuple(values.tolist()), tolerance, families)


def _family(table: FamilyTable, parameters: Sequence[Parameter], study: Study) -> Family:
    field = f"tradeoff.family.{table.name}"
    fitted = {each.path: each for each in parameters if each.role == "fit"}
    for key, given in (("prior", table.prior), ("high", table.high)):
        for path in given:
            if path not in fitted:
                raise unknown_name(f"{field}.{key}", path, fitted)
    for path, each in fitted.items():
        prior, high = table.prior.get(path, each.prior), table.high.get(path, each.high)
        if not each.low <= prior <= high:
            raise InputError(f"{field}.prior.{path}", f"is {prior:g}; needs {each.low:g} (low) <= prior <= {high:g} (high)")
        _check_flies(f"{field}.high.{path}", study, dict.fromkeys((path, *each.ties), high))
        fitted[path] = replace(each, prior=prior, high=high)
    return Family(table.name, tuple(fitted.get(each.path, each) for each in parameters))


def _checks(table: ChecksTable, vehicle: Mapping[str, Any], units: Units) -> Checks:
    limits = []
    for each in table.limit:
        each.require(f"checks.limit.{each.response}")
        if each.response not in units:
            raise unknown_name("checks.limit.response", each.response, units)
        high = to_si(each.high, each.unit, units[each.response], f"checks.limit.{each.response}.unit")
        limits.append(Limit(each.response, units[each.response], high, _origin(each)))
    inactive = tuple((name, RAISED * _number(vehicle, name, "checks.inactive")) for name in table.inactive)
    return Checks(tuple(table.speeds), inactive, tuple(limits))


def _number(vehicle: Mapping[str, Any], name: str, field: str) -> float:
    """A number of the vehicle's file."""
    tables = list(_tables(vehicle, name))
    value = tables[-1].get("value") if len(tables) == name.count(".") + 1 else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(field, f"{name} is no single number of the vehicle's file")
    return float(value)


def _check_unique(names: Sequence[str], field: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{field}.{name}", "is given more than once")
