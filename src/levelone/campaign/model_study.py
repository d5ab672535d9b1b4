"""A study of a model of one's own from its file to its results folder: nominal case, screening, Monte Carlo, surrogates, indices.

Every evaluation is kept in the folder's store as soon as it has come back, and what the store holds is not run again: a study that
was interrupted, or is analysed in another way, runs only what is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from levelone.campaign import analysis
from levelone.campaign.evaluate import Tally, evaluate
from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.executors import Executor, executor_of
from levelone.campaign.failure_map import failure_map
from levelone.campaign.history_store import FOLDER_NAME, HistoryStore
from levelone.campaign.measures import measures_section
from levelone.campaign.model_records import write_records
from levelone.campaign.model_results import campaign_json, describe_model, describe_model_study, model_provenance, nominal_json
from levelone.campaign.models.build import build
from levelone.campaign.models.builtin import Assessment
from levelone.campaign.models.programme import HistoryModel
from levelone.campaign.models.protocol import Evaluations, FloatArray, Model
from levelone.campaign.nominal_check import NominalCheck, check_nominal
from levelone.campaign.sampling import Clock, Progress, Sampled, planned_points, response_results, sample_study
from levelone.campaign.store import prepare_folder, write_dataset, write_json, write_sample
from levelone.campaign.store_reader import unanswered
from levelone.campaign.store_schema import FILE_NAME
from levelone.campaign.surrogate_errors import residual_dataset, surrogate_errors, with_errors
from levelone.config.campaign_table import CampaignOptions
from levelone.config.model_study import ModelStudy
from levelone.errors import InputError
from levelone.handling.levels import worst

SCHEMA = 1
#: relative difference up to which two answers at the nominal point are the same
SAME = 1e-9
OnTally = Callable[[Tally], None]


@dataclass(frozen=True)
class StoredModel:
    """A model whose evaluations go through an executor into a store, judged as sampling and analysis want it.

    ``tallies`` gets the last tally of each sample.
    """

    model: Model
    store: EvaluationStore
    executor: Executor
    on_tally: OnTally
    records: HistoryStore | None = None
    retry_failed: bool = False
    tallies: list[Tally] = field(default_factory=list)

    def assess(self, points: FloatArray, progress: Callable[[int], None]) -> Assessment:
        """Responses and Levels at ``points`` [n, factors]; ``progress`` is called with the number of evaluations done."""
        last: list[Tally] = []

        def told(tally: Tally) -> None:
            last[:] = [tally]
            progress(len(points) if tally.done == tally.total else tally.done)  # a point that comes twice is evaluated once
            self.on_tally(tally)

        found = evaluate(self.model, points, self.store, self.executor, told, retry_failed=self.retry_failed, records=self.records)
        self.tallies.extend(last)
        return assessment_of(self.model, found)


def run_model_study(
    study: ModelStudy,
    out: Path,
    *,
    options: CampaignOptions | None = None,
    seed: int | None = None,
    threads: int | None = None,
    retry_failed: bool = False,
    progress: Progress = lambda stage, done, total: None,
    on_tally: OnTally = lambda tally: None,
) -> Path:
    """Run a study of a model of one's own and write its results folder.

    Parameters
    ----------
    study
        From :func:`levelone.config.model_study.load_model_study`.
    out
        Results folder; created if need be. Evaluations that its store holds are not run again.
    options
        Executor, workers, time limit ... in place of the study's.
    seed
        In place of the study file's.
    threads
        Of the analysis; no influence on the results.
    retry_failed
        Run evaluations again that timed out, crashed or came to nothing before.
    progress
        Called with the stage's name, what is done and what there is to do.
    on_tally
        Called with the progress of the evaluations: rate, remaining time, failures so far.

    Returns
    -------
    Path
        Of results.json.

    Raises
    ------
    InputError
        A folder that cannot be written, and what would fail in every evaluation.
    CampaignInterrupted
        Ctrl-C; what came back is kept.
    """
    folder = prepare_folder(Path(out))
    seed = study.seed if seed is None else seed
    options = options if options is not None else study.campaign
    model, clock = build(replace(study, campaign=options), folder), Clock()
    with _open(folder, study, model) as store, closing(executor_of(options)) as executor:
        store.plan(np.vstack([study.nominal, planned_points(study, seed)]))
        records = HistoryStore.for_writing(folder / FOLDER_NAME) if options.histories else None
        with clock.stage("nominal"):
            progress("nominal case", 0, 1)
            check = check_nominal(study)
            _agrees_with(store, study.nominal, _answer(check), model.names)
            progress("nominal case", 1, 1)
        if isinstance(model, HistoryModel):
            model = replace(model, picks=check.results)
        kept = StoredModel(model, store, executor, on_tally, records, retry_failed)
        names = study.read or model.names
        sampled = sample_study(study, kept, assessment_of(model, _answer(check)), seed, threads, progress, clock, names)
        reused = sum(tally.reused for tally in kept.tallies)
        evaluated = sum(tally.done for tally in kept.tallies) - reused
        campaign = campaign_json(store, options, evaluated, reused)
    results = _analysed(study, model, sampled, seed, threads, progress, clock)
    results |= {"nominal": nominal_json(check), "campaign": campaign}
    with clock.stage("files"):
        _write_files(folder, sampled)
        write_records(folder, check)
    results["provenance"] = model_provenance(study, seed, clock.seconds)
    write_json(folder / "results.json", results)
    return folder / "results.json"


def assessment_of(model: Model, found: Evaluations) -> Assessment:
    """Evaluations as sampling and analysis read them, with the worst Level of each where several criteria are judged."""
    levels = {name: found.levels[:, j] for j, name in enumerate(model.judged)}
    together = {"worst": worst(*levels.values())} if len(levels) > 1 else {}
    return Assessment(found.responses(model.names, model.units), levels | together, None, {})


def _open(folder: Path, study: ModelStudy, model: Model) -> EvaluationStore:
    names = study.space.names
    return EvaluationStore.open(
        folder / FILE_NAME, model.key, model.names, model.units, model.judged, names, study.hash, study_title=study.title
    )


def _answer(check: NominalCheck) -> Evaluations:
    """The nominal case as an evaluation."""
    values, status = (np.array([[of(each) for each in check.responses]]) for of in (lambda r: r.value, lambda r: int(r.status)))
    levels = np.array([[int(level) for level in check.levels.values()]], dtype=np.int64).reshape(1, len(check.levels))
    return Evaluations(values, status, levels, np.array([check.seconds]), (check.message,))


def _agrees_with(store: EvaluationStore, nominal: FloatArray, answer: Evaluations, names: Sequence[str]) -> None:
    """Keep the nominal case, or hold it against the one that is kept: a model may read files of which its key knows nothing.

    Raises
    ------
    InputError
        The model answers differently than when the store was written.
    """
    point = np.atleast_2d(nominal)
    found, held = store.lookup(point, retry_failed=True)
    if not found.any():
        store.add(point, answer, replace_failed=True)
        return
    if unanswered(answer.status).any():
        return
    other = ~np.isclose(held.values, answer.values, rtol=SAME, atol=0.0, equal_nan=True) | (held.status != answer.status)
    if other.any():
        j = int(np.flatnonzero(other[0])[0])
        now, then = answer.values[0, j], held.values[0, j]
        raise InputError(
            "model",
            f"answers differently at the nominal point than when {FILE_NAME} was written: {names[j]} is {now:.10g} and was "
            f"{then:.10g}; something that it reads has changed, or it is not deterministic: name another --out, or remove that "
            "file to evaluate all anew",
        )


def _analysed(
    study: ModelStudy,
    model: Model,
    sampled: Sampled,
    seed: int,
    threads: int | None,
    progress: Progress,
    clock: Clock,
) -> dict[str, Any]:
    with clock.stage("errors"):
        errors = surrogate_errors(study, sampled, seed, threads, progress)
    with clock.stage("measures"):
        measures = measures_section(sampled, seed, threads, progress)
    owners = criterion_of(study, model)
    blocks = response_results(study, sampled, owners)
    return {
        "schema": SCHEMA,
        "kind": "model",
        "study": describe_model_study(study, seed),
        "model": describe_model(study, model),
        "responses": {name: with_errors(block, errors[name]) for name, block in blocks.items()},
        "measures": measures,
        "levels": {name: analysis.shares_json(codes) for name, codes in sampled.assessed.levels.items()},
        "failure_map": _failures(sampled, seed),
        "assumed": [{"field": name, "why": why} for name, why in study.assumed],
        "not_validated": list(study.not_validated),
        "validity_domain": list(study.validity_domain),
    }


def _failures(sampled: Sampled, seed: int) -> dict[str, Any]:
    sample, read = sampled.sample, sampled.assessed.responses
    units = [factor.unit for factor in sample.space.factors]
    return failure_map(sample.unit_points, sample.points, read.status, sample.names, units, read.names, seed)


def criterion_of(study: ModelStudy, model: Model) -> dict[str, str]:
    """Name of the test that gives each response; "responses" for a model that answers them itself."""
    from levelone.config.model_table import response_names

    owners = {response: test for response, _, test in response_names(study.tests)}
    return {name: owners.get(name, "responses") for name in model.names}


def _write_files(folder: Path, sampled: Sampled) -> None:
    for name in ("morris.nc", "morris.csv"):
        (folder / name).unlink(missing_ok=True)  # of an earlier run whose factors were not correlated
    if sampled.screening is not None and sampled.screened is not None:
        write_sample(folder, "morris", sampled.screening, sampled.screened)
    write_sample(folder, "monte_carlo", sampled.sample, sampled.assessed)
    write_dataset(folder / "surrogates.nc", residual_dataset(sampled))
