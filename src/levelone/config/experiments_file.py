"""Files of findings (claims with their rules) and of experiments (changed vehicles on which the claims are decided again)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import ConfigDict, Field, model_validator

from levelone.config.changes import Change
from levelone.config.files import read_text, read_toml
from levelone.config.schema import Finite, Strict, Text, check, in_file
from levelone.config.study_file import Study, load_study
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError, unknown_name
from levelone.handling.manoeuvres import Start
from levelone.vehicle import nominal_value

Kind = Literal["cause", "calibration"]
#: the one thing that an experiment may change outside the vehicle: from which trim varied vehicles begin
START = "condition.start"
Name = Annotated[str, Field(min_length=1, max_length=40)]
Changes = dict[Text, Finite | Text]


class Finding(Strict):
    """[[claim]] of a file of findings: name, rule in words, and whether a calibration may aim at it."""

    id: Text
    rule: Text
    calibrated: bool = False


class FindingsFile(Strict):
    """A whole file of findings."""

    claim: Annotated[list[Finding], Field(min_length=1)]


class ExperimentTable(Strict):
    """[[experiment]]: what is set (``changes``) or multiplied (``scale``) in the vehicle's file."""

    name: Name
    question: Text
    changes: Annotated[Changes, Field(default_factory=dict)]
    scale: Annotated[dict[Text, Finite], Field(default_factory=dict)]

    @model_validator(mode="after")
    def _once(self) -> ExperimentTable:
        if not self.changes and not self.scale:
            raise InputError(self.name, "changes nothing; give changes or scale")
        for path in self.scale:
            if path in self.changes:
                raise InputError(self.name, f"{path} is both changed and scaled")
        return self


class ExplanationTable(Strict):
    """[[explanation]]: a cause in words, and the experiment whose numbers show it."""

    id: Text
    text: Text
    experiment: Text


class ExperimentsFile(Strict):
    """A whole file of experiments."""

    study: Text
    calibrations: Text | None = None
    experiment: Annotated[list[ExperimentTable], Field(min_length=1)]
    explanation: Annotated[list[ExplanationTable], Field(default_factory=list)]


class CalibrationEntry(Strict):
    """One vehicle of a list of calibrations; what else its writer notes is left aside."""

    model_config = ConfigDict(extra="ignore", strict=True, frozen=True)

    name: Name
    changes: Annotated[Changes, Field(min_length=1)]


class CalibrationList(Strict):
    """All of them."""

    calibration: Annotated[list[CalibrationEntry], Field(min_length=1)]


@dataclass(frozen=True, eq=False)
class Experiment:
    """A changed vehicle, and the question that it answers.

    Parameters
    ----------
    name, question
        For tables.
    kind
        "cause", or "calibration" for a vehicle that meets the targets as well as the nominal one does.
    changes
        As ``load_vehicle`` takes them, in the units of the vehicle's file; and ``START``.
    study
        The study with the changed vehicle, and from which trim it begins.
    """

    name: str
    question: str
    kind: Kind
    changes: Mapping[str, Change]
    study: Study


@dataclass(frozen=True, eq=False)
class Experiments:
    """A checked file of experiments: its study, the findings of that study and their file, changed vehicles, explanations."""

    path: Path
    study: Study
    findings_path: Path
    findings: tuple[Finding, ...]
    experiments: tuple[Experiment, ...]
    explanations: tuple[ExplanationTable, ...]


def load_findings(path: Path) -> tuple[Finding, ...]:
    """The claims of a file of findings.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed.
    """
    claims = check(FindingsFile, read_toml(path), path.name).claim
    _check_unique([each.id for each in claims], f"{path.name}: claim")
    return tuple(claims)


def load_experiments(path: str | PathLike[str]) -> Experiments:
    """Read a file of experiments with its study, and make every changed vehicle.

    Parameters
    ----------
    path
        TOML file; the format is described in docs/reference/comparison.md. Paths in it are relative to it.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed: among others for a change of a number that an
        uncertain input or a case sets, since its value would no longer be that of the study.
    """
    path = Path(path)
    content = check(ExperimentsFile, read_toml(path), path.name)
    study = load_study(path.parent / content.study)
    with in_file(path.name):
        if study.findings is None:
            raise InputError("study", f"{content.study} names no findings to decide; give it study.findings")
        calibrations = _calibrations(path.parent / content.calibrations) if content.calibrations else []
        names = [each.name for each in content.experiment] + [each.name for each in calibrations]
        _check_unique(names, "experiment")
        made = [_experiment(study, each.name, each.question, "cause", _resolved(study, each)) for each in content.experiment]
        made += [_experiment(study, each.name, "another start", "calibration", each.changes) for each in calibrations]
        for each in content.explanation:
            if each.experiment not in names:
                raise unknown_name(f"explanation.{each.id}.experiment", each.experiment, names)
        _check_unique([each.id for each in content.explanation], "explanation")
    return Experiments(path, study, study.findings, load_findings(study.findings), tuple(made), tuple(content.explanation))


def _calibrations(path: Path) -> list[CalibrationEntry]:
    """A JSON list of objects with ``name`` and ``changes``."""
    try:
        content = json.loads(read_text(path, "calibrations"))
    except ValueError as error:
        raise InputError("calibrations", f"{path.name} is not a JSON file: {error}") from None
    return check(CalibrationList, {"calibration": content}, path.name).calibration


def _experiment(study: Study, name: str, question: str, kind: Kind, changes: Mapping[str, Change]) -> Experiment:
    start = str(changes.get(START, study.start))
    if start not in get_args(Start):
        raise unknown_name(f"experiment.{name}.changes.{START}", start, get_args(Start))
    try:
        vehicle = load_vehicle(study.vehicle_path, {path: value for path, value in changes.items() if path != START})
    except InputError as error:
        raise InputError(f"experiment.{name}.changes", str(error)) from None
    for target in _studied(study):
        here, before = (nominal_value(each, target, study.trim_speed) for each in (vehicle, study.vehicle))
        if here != before:
            raise InputError(
                f"experiment.{name}.changes", f"set {target} to {here:g}; the study varies it from its nominal {before:g} itself"
            )
    return Experiment(name, question, kind, changes, replace(study, vehicle=vehicle, start=start))


def _studied(study: Study) -> list[str]:
    """Targets that the study sets: those of its factors, of the screening of coupling and of the cases."""
    targets = [*study.targets]
    if study.coupling is not None:
        targets += study.coupling.targets
    for cases in study.cases:
        targets += cases.columns
    return sorted(set(targets))


def _resolved(study: Study, table: ExperimentTable) -> dict[str, Change]:
    """Changes of an experiment, with what is scaled as a number of the vehicle's file."""
    content = read_toml(study.vehicle_path) if table.scale else {}
    scaled = {path: factor * _entry(content, path, table.name) for path, factor in table.scale.items()}
    return table.changes | scaled


def _entry(content: Mapping[str, Any], path: str, name: str) -> float:
    found: Any = content
    for key in path.split("."):
        if not isinstance(found, Mapping) or key not in found:
            known = found if isinstance(found, Mapping) else ()
            raise unknown_name(f"experiment.{name}.scale.{path}", key, known)
        found = found[key]
    value = found.get("value") if isinstance(found, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"experiment.{name}.scale.{path}", "is no single number in the vehicle's file: use changes")
    return float(value)


def _check_unique(names: Sequence[str], field: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{field}.{name}", "is given more than once")
