"""``levelone experiments``: the study on changed vehicles, and every claim decided on each, to find what flips a verdict."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from levelone._version import __version__
from levelone.campaign.claims import Evidence
from levelone.campaign.claims.evidence import assessed_evidence
from levelone.campaign.claims.judge import judge
from levelone.campaign.claims.record import FILE, Found, Record, Stamp, Trial, read_record
from levelone.campaign.claims.sections import RANKED
from levelone.campaign.describe import describe_study, provenance_hashes
from levelone.campaign.sampling import Clock, Progress, response_results, sample_study
from levelone.campaign.sections import run_sections
from levelone.campaign.store import write_json
from levelone.campaign.study import build_model
from levelone.campaign.sweep import sweep_check
from levelone.config.experiments_file import Experiment, Experiments, Finding, load_experiments
from levelone.config.files import file_hash
from levelone.config.study_file import Study
from levelone.dynamics import trim
from levelone.dynamics.simulate import check_before_flight
from levelone.errors import InputError
from levelone.vehicle import batch_of

BASELINE = "as it is"
#: resamplings of intervals, which no claim reads
BOOTSTRAP = 2


def _quiet(stage: str, done: int, total: int) -> None:
    """Progress of a study inside an experiment, which nobody sees."""


def run_experiments(
    file: Path, out: Path | None = None, *, seed: int | None = None, threads: int | None = None, progress: Progress = _quiet
) -> Path:
    """Run the study of a file of experiments on every changed vehicle, and record the verdicts.

    Each vehicle goes through the same designs from the same seed. A trial that the record already holds for the same study,
    vehicle, findings, seed, version and changes is not run again, and the record is written after each one: an interrupted
    call goes on where it stopped.

    Parameters
    ----------
    file
        The file of experiments.
    out
        Where the record goes, ``experiments.json`` beside the file if not given: from there, a run of the study takes it along.
    seed
        In place of the study file's.
    threads
        Worker threads; no influence on the results.
    progress
        Called with "experiments", the vehicles done and the vehicles in all.

    Returns
    -------
    Path
        Of the record.

    Raises
    ------
    InputError
        A faulty file; an explanation of a claim that is unknown, or does not differ.
    """
    plan = load_experiments(file)
    out = Path(file).parent / FILE if out is None else out
    seed = plan.study.seed if seed is None else seed
    stamp = _stamp(plan, seed)
    before = read_record(out)
    if before is not None and not before.holds_for(stamp):
        before = None
    _check_vehicles(plan)
    total = 1 + len(plan.experiments)
    progress("experiments", 0, total)
    baseline = before.baseline if before is not None else _trial(plan, None, seed, threads)
    _check_explanations(plan, baseline)
    done = {each.name: each for each in (before.experiments if before is not None else [])}
    kept = {each.name: _kept(done.get(each.name), each) for each in plan.experiments}
    _write(out, plan, stamp, baseline, kept)
    for i, experiment in enumerate(plan.experiments, 1):
        progress("experiments", i, total)
        if kept[experiment.name] is None:
            kept[experiment.name] = _trial(plan, experiment, seed, threads)
            _write(out, plan, stamp, baseline, kept)
    progress("experiments", total, total)
    return out


def evaluate(study: Study, seed: int, threads: int | None = None, progress: Progress = _quiet) -> Evidence:
    """A study as :func:`levelone.campaign.run_study` runs it, as far as claims need it, without files and report.

    Same designs, same seeds and same numbers; intervals of the indices, and surrogates of responses whose indices no claim reads,
    are not found.
    """
    study = replace(study, method=replace(study.method, bootstrap=BOOTSTRAP))
    model = build_model(study, threads)
    sampled = sample_study(study, model, model.nominal(), seed, threads, progress, Clock(), RANKED)
    summary = {"study": describe_study(study, seed), "responses": response_results(study, sampled)}
    amplitudes = (min(study.amplitudes),) if study.amplitudes else ()
    asked = replace(study, amplitudes=amplitudes, froude=None, deceleration=None, epistemic=None)
    sections = run_sections(asked, model, sampled, seed, progress).results
    sections["sweep"] = sweep_check(model, study.sweep, study.windows).summary()
    return assessed_evidence(summary | sections, sampled.sample, sampled.assessed)


def _trial(plan: Experiments, experiment: Experiment | None, seed: int, threads: int | None) -> Trial:
    """The study on one changed vehicle, or on its own."""
    if experiment is None:
        evidence = evaluate(plan.study, seed, threads)
        return _decided(evidence, plan.findings, BASELINE, "the vehicle of the study", "cause", {})
    with _of_experiment(experiment):
        evidence = evaluate(experiment.study, seed, threads)
    return _decided(evidence, plan.findings, experiment.name, experiment.question, experiment.kind, experiment.changes)


def _decided(
    evidence: Evidence, findings: tuple[Finding, ...], name: str, question: str, kind: Any, changes: Mapping[str, Any]
) -> Trial:
    nominal = {response: float(block["nominal"]) for response, block in evidence.summary["responses"].items()}
    verdicts = {finding.id: Found.of(judge(finding, evidence)) for finding in findings}
    return Trial(name=name, question=question, kind=kind, changes=dict(changes), nominal=nominal, verdicts=verdicts)


def _kept(done: Trial | None, experiment: Experiment) -> Trial | None:
    """A finished trial that needs not be run again."""
    if done is None or not done.repeats(experiment.name, experiment.kind, dict(experiment.changes)):
        return None
    return done.model_copy(update={"question": experiment.question})


def _stamp(plan: Experiments, seed: int) -> Stamp:
    return Stamp(levelone=__version__, findings_sha256=file_hash(plan.findings_path), seed=seed, **provenance_hashes(plan.study))


def _check_vehicles(plan: Experiments) -> None:
    """Refuse a vehicle that could not be studied, before any is."""
    for each in plan.experiments:
        with _of_experiment(each):
            check_before_flight(batch_of(each.study.vehicle), plan.study.quickness)
            trim(each.study.vehicle, plan.study.trim_speed)


@contextmanager
def _of_experiment(experiment: Experiment) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(f"experiment.{experiment.name}", f"the changed vehicle cannot be studied: {error}") from None


def _check_explanations(plan: Experiments, baseline: Trial) -> None:
    """An explanation must explain a difference."""
    for each in plan.explanations:
        field = f"{plan.path.name}: explanation.{each.id}"
        if each.id not in baseline.verdicts:
            raise InputError(field, "no finding has this name")
        verdict = baseline.verdicts[each.id].verdict
        if verdict != "differs":
            raise InputError(field, f"there is no difference to explain: the verdict is {verdict!r}")


def _write(out: Path, plan: Experiments, stamp: Stamp, baseline: Trial, kept: Mapping[str, Trial | None]) -> None:
    """Write what has been done; an explanation waits for its experiment."""
    trials = [trial for trial in kept.values() if trial is not None]
    told = [each for each in plan.explanations if kept[each.experiment] is not None]
    targets = [finding.id for finding in plan.findings if finding.calibrated]
    record = Record(**stamp.model_dump(), targets=targets, baseline=baseline, experiments=trials, explanations=told)
    try:
        write_json(out, record.model_dump())
    except OSError as error:
        raise InputError(str(out), f"cannot be written: {error.strerror}") from None
