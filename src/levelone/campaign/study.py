"""A study from its file to its results folder: nominal flight, screening, Monte Carlo, surrogates, decomposition, numerics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from levelone.campaign import analysis
from levelone.campaign.checks import confidences, numerics, provenance, validity
from levelone.campaign.compare import take_along
from levelone.campaign.describe import describe_study
from levelone.campaign.measures import measures_section
from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.pictures import frequency_groups, history_groups
from levelone.campaign.sampling import Clock, Progress, Sampled, planned_points, response_results, sample_study
from levelone.campaign.sections import Sections, run_sections
from levelone.campaign.store import prepare_folder, write_dataset, write_groups, write_json, write_sample
from levelone.campaign.stored_builtin import StoredBuiltin, open_store
from levelone.campaign.surrogate_errors import residual_dataset, surrogate_errors, with_errors
from levelone.campaign.sweep import SweepCheck, sweep_check
from levelone.config.study_file import Study
from levelone.dynamics import trim

SCHEMA = 1


def build_model(study: Study, threads: int | None = None) -> BuiltinModel:
    """The built-in vehicle under the manoeuvres of a study."""
    return BuiltinModel(
        vehicle=study.vehicle,
        targets=study.targets,
        step=study.quickness,
        pulse=study.stability,
        omega=study.omega,
        boundaries=study.boundaries,
        task=study.task,
        start=study.start,
        threads=threads,
    )


def run_study(
    study: Study,
    out: Path,
    *,
    seed: int | None = None,
    threads: int | None = None,
    progress: Progress = lambda stage, done, total: None,
) -> Path:
    """Run a study and write its results folder; runs that the folder's store holds are not flown again.

    Parameters
    ----------
    study
        From :func:`levelone.config.study_file.load_study`.
    out
        Results folder; created if need be.
    seed
        In place of the study file's.
    threads
        Worker threads; no influence on the results.
    progress
        Called with the stage's name, what is done and what there is to do.

    Returns
    -------
    Path
        Of results.json.

    Raises
    ------
    InputError
        For a folder that cannot be written, and for what would fail in every run.
    """
    folder = prepare_folder(Path(out))
    seed = study.seed if seed is None else seed
    model, clock = build_model(study, threads), Clock()
    with clock.stage("nominal"):
        progress("nominal flight", 0, 2)
        nominal = model.nominal()
        progress("nominal flight", 1, 2)
        swept = sweep_check(model, study.sweep, study.windows)
        progress("nominal flight", 2, 2)
    with open_store(folder, study, model) as store:
        store.plan(planned_points(study, seed))
        sampled = sample_study(study, StoredBuiltin(model, store), nominal, seed, threads, progress, clock)
    with clock.stage("errors"):
        errors = surrogate_errors(study, sampled, seed, threads, progress)
    with clock.stage("measures"):
        measures = measures_section(sampled, seed, threads, progress)
    with clock.stage("sections"):
        sections = run_sections(study, model, sampled, seed, progress)
    with clock.stage("numerics"):
        progress("numerics", 0, 1)
        checks = numerics(study, model, nominal, swept)
        progress("numerics", 1, 1)
    with clock.stage("files"):
        _write_files(folder, model, sampled, swept, sections)
    results: dict[str, Any] = {
        "schema": SCHEMA,
        "study": describe_study(study, seed),
        "responses": {name: with_errors(block, errors[name]) for name, block in response_results(study, sampled).items()},
        "measures": measures,
        "levels": analysis.level_shares(sampled.assessed) | {"confidence": confidences(study)},
        "nominal": nominal_results(model, swept),
        "numerics": checks,
        "sweep": swept.summary(),
        "validity": validity(study.vehicle, sampled.assessed),
        **sections.results,
        **take_along(study, folder),
        "assumed": [{"field": name, "why": why} for name, why in (*study.vehicle.assumed, *study.assumed)],
        "not_validated": list(study.not_validated),
        "validity_domain": list(study.validity_domain),
        "provenance": provenance(study, seed, clock.seconds),
    }
    write_json(folder / "results.json", results)
    return folder / "results.json"


def _write_files(folder: Path, model: BuiltinModel, sampled: Sampled, swept: SweepCheck, sections: Sections) -> None:
    if sampled.screening is not None and sampled.screened is not None:
        write_sample(folder, "morris", sampled.screening, sampled.screened)
    write_sample(folder, "monte_carlo", sampled.sample, sampled.assessed)
    write_groups(folder / "histories.nc", history_groups(model, sampled.sample, swept))
    write_dataset(folder / "surrogates.nc", residual_dataset(sampled))
    write_groups(folder / "frequency.nc", frequency_groups(swept) | dict(sections.frequency))
    for name, groups in sections.files.items():
        write_groups(folder / name, groups)


def nominal_results(model: BuiltinModel, swept: SweepCheck) -> dict[str, Any]:
    """Trim, dominant pole and further readings of the nominal vehicle."""
    at = trim(model.vehicle, model.step.trim_speed)
    pole = swept.model.dominant("V_lon", "q")
    attitude = swept.linear_reading["theta"]
    return {
        "dominant_pole": {"real": pole.real, "imag": pole.imag, "omega_n": abs(pole), "zeta": -pole.real / abs(pole)},
        "trim": {
            "theta": float(at.attitude[0, 0]),
            "throttle": at.throttle[0].tolist(),
            "residual": float(np.abs(at.residual).max()),
        },
        "linearisation_error": float(swept.model.difference_error[0]),
        "omega_bw_gain_attitude": float(attitude.omega_bw_gain),
        "omega_180_attitude": float(attitude.omega_180),
        "omega_180": float(swept.linear_reading["q"].omega_180),
    }
