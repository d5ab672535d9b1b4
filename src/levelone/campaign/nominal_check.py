"""The nominal case of a study, run once: its responses, and what looks wrong with the model's names, units, signs and records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from levelone.campaign.executors import executor_of
from levelone.campaign.models.build import build
from levelone.campaign.models.programme import HistoryModel
from levelone.campaign.models.protocol import Evaluations, LinearSource, Model, ModelFailure
from levelone.campaign.models.readings import Result, read, read_linear
from levelone.campaign.nominal_reading_rules import reading_findings
from levelone.campaign.nominal_rules import Finding, record_findings
from levelone.config.model_table import BuiltInTable, StateSpaceTable, Test, response_names
from levelone.handling.levels import Level
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_study import ModelStudy
    from levelone.config.study_file import Study
    from levelone.handling.history import TimeHistory

#: kinds that are levelone's own code: they run in this process
OWN = (BuiltInTable, StateSpaceTable)


@dataclass(frozen=True)
class Response:
    """One response of the nominal case; ``value`` is NaN where the status is a failure."""

    name: str
    unit: str
    value: float
    status: Status


@dataclass(frozen=True, eq=False)
class NominalCheck:
    """The nominal case and what was found.

    Parameters
    ----------
    study
        What was checked.
    responses
        All responses, in the order of the model.
    levels
        Level of each criterion that is judged.
    findings
        What looks wrong, and notes.
    histories
        Record of each test that was flown.
    results
        What each test read; those that failed are left out.
    message
        What a failed evaluation had to say, else empty.
    seconds
        Wall time of the evaluation.
    """

    study: ModelStudy
    responses: tuple[Response, ...]
    levels: Mapping[str, Level]
    findings: tuple[Finding, ...]
    histories: Mapping[str, TimeHistory]
    results: Mapping[str, Result]
    message: str
    seconds: float

    @property
    def wrong(self) -> tuple[Finding, ...]:
        """Findings that are more than a note."""
        return tuple(finding for finding in self.findings if finding.wrong)


def check_nominal(study: ModelStudy) -> NominalCheck:
    """Run the nominal case of a study once, and look at it.

    A model that is not levelone's own runs in a process of its own, with the study's time limit, so that a crash or a hang is a
    status and not the end.

    Raises
    ------
    InputError
        What would fail every evaluation.
    """
    study = replace(study, campaign=replace(study.campaign, histories=True))
    model = build(study)
    answer = _evaluated(study, model)
    histories = answer.histories[0] if answer.histories else {}
    results = _results(study, model, histories)
    responses = _responses(model, answer)
    findings = [*_unanswered(study, responses, answer.messages[0])]
    for test in study.tests:
        if test.name in histories:
            findings += record_findings(test, histories[test.name])
        if test.name in results:
            findings += reading_findings(test, results[test.name], histories.get(test.name))
    levels = {name: Level(int(code)) for name, code in zip(model.judged, answer.levels[0], strict=True)}
    seconds = float(answer.seconds[0])
    return NominalCheck(study, responses, levels, _once(findings), histories, results, answer.messages[0], seconds)


def as_model_study(study: Study) -> ModelStudy:
    """A study of a vehicle in the form of a study of a model, with the same manoeuvres and readings."""
    from levelone.config.campaign_table import CampaignOptions
    from levelone.config.model_study import ModelStudy

    table = BuiltInTable(
        "built-in", (), (), (), study.vehicle, study.vehicle_path, study.trim_speed, study.flight_mode, study.start
    )
    reads: dict[str, Any] = {"response_type": "attitude_command", "task": study.task}
    exact: dict[str, Any] = {"method": "linear", "omega": tuple(study.omega.tolist()), **reads}
    tests = (
        Test("attitude_quickness", "attitude_quickness", "pitch", study.quickness),
        Test("dynamic_stability", "dynamic_stability", "pitch", study.stability),
        Test("rate", "bandwidth", "pitch", study.sweep, output="q", **exact),
        Test("attitude", "bandwidth", "pitch", study.sweep, output="theta", sign=-1, **exact),
        Test("sweep", "bandwidth", "pitch", study.sweep, output="q", method="sweep", windows=study.windows, **reads),
        Test("translational_rate", "translational_rate", None, study.quickness),
    )
    same = (
        "name", "title", "intended_use", "path", "hash", "seed", "policy", "space", "targets", "nominal", "correlations", "method",
        "boundaries", "boundaries_source", "task", "not_validated", "validity_domain", "notes", "assumed",
    )  # fmt: skip
    taken = {name: getattr(study, name) for name in same}
    return ModelStudy(**taken, read=(), model=table, tests=tests, campaign=CampaignOptions())


def _evaluated(study: ModelStudy, model: Model) -> Evaluations:
    """The answer at the nominal point, from a process that may crash where the model is not levelone's own."""
    points = np.array(study.nominal, dtype=np.float64)[None]
    if isinstance(study.model, OWN):
        return model.evaluate(points)
    options = replace(study.campaign, executor="processes", workers=1, chunk=1, cluster=None)
    for index, answer in executor_of(options).run(model, points):
        if len(index):
            return answer
    raise AssertionError("an executor answers every point")


def _results(study: ModelStudy, model: Model, histories: Mapping[str, TimeHistory]) -> dict[str, Result]:
    """What each test reads, again and whole: an evaluation keeps the numbers only."""
    found: dict[str, Result] = {}
    for test in study.tests:
        try:
            if test.method == "linear" and isinstance(model, HistoryModel):
                source = cast(LinearSource, model.source)  # only such sources take the method
                found[test.name] = read_linear(test, source, study.nominal, study.boundaries)
            elif test.name in histories:
                found[test.name] = read(test, histories[test.name], study.boundaries)
        except ModelFailure:  # the evaluation has it as a status
            continue
    return found


def _responses(model: Model, answer: Evaluations) -> tuple[Response, ...]:
    columns = zip(model.names, model.units, answer.values[0].tolist(), answer.status[0].tolist(), strict=True)
    return tuple(Response(name, unit, value, Status(code)) for name, unit, value, code in columns)


def _unanswered(study: ModelStudy, responses: tuple[Response, ...], message: str) -> list[Finding]:
    """Responses without a value, and those whose value is qualified; alike ones of one test together."""
    tested = {name: test for name, _, test in response_names(study.tests)}
    groups: dict[tuple[str, Status], list[str]] = {}
    for each in responses:
        if each.status is not Status.OK:
            groups.setdefault((tested.get(each.name, each.name), each.status), []).append(each.name)
    said = message.strip().splitlines()[-1][-300:] if message.strip() else ""
    found = []
    for (where, status), names in groups.items():
        together = ", ".join(names)
        if not status.failed:
            found.append(Finding("qualified", where, f"{together}: the value stands, but {status.text}", wrong=False))
            continue
        # a gain bandwidth need not exist: under attitude command the phase bandwidth stands without it
        minor = status is Status.NO_GAIN_CROSSING and not set(names) & set(study.read)
        extra = f" ({said})" if said and status < Status.NO_FIRST_PEAK else ""
        found.append(Finding("undefined", where, f"{together}: no value, {status.text}{extra}", wrong=not minor))
    return found


def _once(findings: list[Finding]) -> tuple[Finding, ...]:
    """Without repetition: tests that share a record say the same of it."""
    seen: dict[tuple[str, str], Finding] = {}
    for finding in findings:
        seen.setdefault((finding.rule, finding.text), finding)
    return tuple(sorted(seen.values(), key=lambda each: not each.wrong))
