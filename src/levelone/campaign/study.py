"""A study from its file to its results folder: nominal flight, screening, Monte Carlo, surrogates, decomposition, numerics."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from levelone.campaign import analysis
from levelone.campaign.checks import confidences, numerics, provenance, validity
from levelone.campaign.compare import take_along
from levelone.campaign.describe import describe_study
from levelone.campaign.models import RESPONSES, Assessment, BuiltinModel
from levelone.campaign.pictures import frequency_groups, history_groups
from levelone.campaign.sections import run_sections
from levelone.campaign.store import prepare_folder, write_groups, write_json, write_sample
from levelone.campaign.sweep import SweepCheck, sweep_check
from levelone.config.study_file import Study
from levelone.dynamics import trim
from levelone.status import Status
from levelone.uncertainty import Design, latin_hypercube, morris_design, sobol_design, stage_seed

SCHEMA = 1
Progress = Callable[[str, int, int], None]


@dataclass
class Clock:
    """Wall time of each stage, s."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time one stage."""
        start = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - start, 3)


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
    """Run a study and write its results folder.

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
    with clock.stage("morris"):
        screening = morris_design(study.space, study.method.trajectories, study.method.levels, stage_seed(seed, "morris"))
        screened = _assess(model, screening, "screening (Morris)", progress)
    with clock.stage("monte_carlo"):
        sample = latin_hypercube(study.space, study.method.samples, stage_seed(seed, "monte carlo"))
        assessed = _assess(model, sample, "Monte Carlo", progress)
    with clock.stage("decomposition"):
        base = sobol_design(study.space, study.method.base_points, stage_seed(seed, "sobol"))
        options = {"correlation": study.method.kernel, "trend": study.method.trend}
        found = analysis.decompose(
            sample, assessed, base, study.policy, stage_seed(seed, "surrogates"), study.method.bootstrap, options, threads, progress
        )
    with clock.stage("sections"):
        sections = run_sections(study, model, sample, assessed, seed, progress)
    with clock.stage("numerics"):
        progress("numerics", 0, 1)
        checks = numerics(study, model, nominal, swept)
        progress("numerics", 1, 1)
    with clock.stage("files"):
        write_sample(folder, "morris", screening, screened)
        write_sample(folder, "monte_carlo", sample, assessed)
        write_groups(folder / "histories.nc", history_groups(model, sample, swept))
        write_groups(folder / "frequency.nc", frequency_groups(swept) | dict(sections.frequency))
        for name, groups in sections.files.items():
            write_groups(folder / name, groups)
    results: dict[str, Any] = {
        "schema": SCHEMA,
        "study": describe_study(study, seed),
        "responses": response_results(study, nominal, screening, screened, sample, assessed, found),
        "levels": analysis.level_shares(assessed) | {"confidence": confidences(study)},
        "nominal": nominal_results(model, swept),
        "numerics": checks,
        "sweep": swept.summary(),
        "validity": validity(study.vehicle, assessed),
        **sections.results,
        **take_along(study, folder),
        "assumed": [{"field": name, "why": why} for name, why in (*study.vehicle.assumed, *study.assumed)],
        "not_validated": list(study.not_validated),
        "validity_domain": list(study.validity_domain),
        "provenance": provenance(study, seed, clock.seconds),
    }
    write_json(folder / "results.json", results)
    return folder / "results.json"


def _assess(model: BuiltinModel, design: Design, stage: str, progress: Progress) -> Assessment:
    progress(stage, 0, design.runs)
    return model.assess(design.points, lambda done: progress(stage, min(done, design.runs), design.runs))


def response_results(
    study: Study,
    nominal: Assessment,
    screening: Design,
    screened: Assessment,
    sample: Design,
    assessed: Assessment,
    found: analysis.Decomposition,
) -> dict[str, Any]:
    """The block of each response in results.json, for those that were decomposed."""
    effects = analysis.screen(screening, screened, study.policy, study.method.bootstrap)
    out: dict[str, Any] = {}
    for j, name in enumerate(assessed.responses.names):
        unit, criterion = RESPONSES[name]
        failures, cautions = analysis.outcomes(assessed, name)
        block: dict[str, Any] = {
            "unit": unit,
            "criterion": criterion,
            "nominal": float(nominal.responses.column(name)[0]),
            "status": Status(int(nominal.responses.codes(name)[0])).text,
            "morris": analysis.morris_json(study.space, effects[name]),
            "morris_failed": int(screened.responses.failed(name).sum()),
            "morris_unit": f"{unit} per full factor range",
            "monte_carlo": analysis.statistics(assessed.responses.column(name)),
            "failures": failures,
            "cautions": cautions,
            "failure_corner": analysis.corner(sample, assessed, name),
            "surrogate": analysis.surrogate_json(study.space, found.surrogates[j]),
            "sobol": analysis.sobol_json(study.space, found.indices[j]),
            "rank_agreement": analysis.agreement(effects[name], found.indices[j]),
        }
        if study.policy == "refuse" and failures:
            nan = {"S1": np.nan, "ST": np.nan, "S1_ci": [np.nan, np.nan], "ST_ci": [np.nan, np.nan]}
            block["sobol"] = {factor: dict(nan) for factor in study.space.names}
            block["surrogate"]["status"] = f"refused: {sum(failures.values())} runs failed and the study's policy is 'refuse'"
        if name in found.bounded:
            low, high = (analysis.sobol_json(study.space, s, intervals=False) for s in found.bounded[name])
            block["sobol_bounded"] = {"low": low, "high": high}
        out[name] = block
    return out


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
