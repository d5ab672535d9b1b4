"""A study by Dakota's route and by our own: the same screening, sample and decomposition, with what each of them costs."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from levelone.campaign import analysis
from levelone.campaign.dakota.execute import find_dakota, run_dakota
from levelone.campaign.dakota.export import Plan, export_plan, plan_of
from levelone.campaign.dakota.importing import import_results
from levelone.campaign.sampling import Clock, Progress, Sampled, sample_study
from levelone.campaign.store import write_json
from levelone.campaign.study import build_model
from levelone.config.study_file import Study
from levelone.errors import InputError
from levelone.uncertainty import rank_agreement

#: input file -> the stage of ours that does the same
STAGES = {"morris": "morris", "lhs": "monte_carlo", "surrogate": "decomposition"}
#: of a table of indices, after response and factor; of each, ours, the ends of its interval, and Dakota's
INDICES = ("mu_star", "S1", "ST")
COMPARISON = "dakota-comparison.json"


@dataclass
class ProcessorClock(Clock):
    """Processor time of each stage as well, s."""

    processor: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time one stage."""
        start = time.process_time()
        with super().stage(name):
            yield
        self.processor[name] = round(time.process_time() - start, 3)


def compare_routes(
    study: Study, folder: Path, *, responses: Sequence[str] = (), seed: int | None = None, threads: int | None = None,
    progress: Progress = lambda stage, done, total: None,
) -> dict[str, Any]:  # fmt: skip
    """Screen, sample, fit and decompose a study here and in Dakota, and set the results side by side.

    Parameters
    ----------
    study
        Its method gives the sizes of both.
    folder
        An existing folder for Dakota's files and the comparison, ``dakota-comparison.json``.
    responses
        Those to decompose, all by default.
    seed
        In place of the study's.
    threads
        Of our own work; Dakota's fits and decompositions use one.
    progress
        Called with a stage's name, how much is done, and of how much.

    Returns
    -------
    What the file holds: by stage wall and processor time in s of both; by response and factor the indices of both, ours with their
    95 % intervals (Dakota gives none), NaN where a route has none.

    Raises
    ------
    InputError
        Dakota is not installed or fails; factors that cannot be decomposed.
    """
    find_dakota()
    plan = plan_of(study, responses=responses, seed=seed)
    written = export_plan(plan, folder)
    left_out = dict(written.left_out)
    if "surrogate.in" in left_out:
        raise InputError("dakota", left_out["surrogate.in"])
    sampled, clock = _own(study, plan, threads, progress)
    stages, printed = _dakota(study, plan, folder, left_out, clock, progress)
    content = {
        "study": study.name, "seed": plan.seed, "samples": plan.samples, "trajectories": plan.trajectories,
        "base_points": plan.surrogate_points, "stages": stages,
        "left_out": [{"file": name, "why": why} for name, why in left_out.items()],
        "responses": {name: _response(study, sampled, j, name, printed) for j, name in enumerate(plan.responses)},
    }  # fmt: skip
    write_json(folder / COMPARISON, content)
    return content


def _own(study: Study, plan: Plan, threads: int | None, progress: Progress) -> tuple[Sampled, ProcessorClock]:
    model, clock = build_model(study, threads), ProcessorClock()
    # the nominal flight compiles the kernels, or loads them, so that neither is counted
    nominal = model.nominal()
    return sample_study(study, model, nominal, plan.seed, threads, progress, clock, plan.responses), clock


def _dakota(
    study: Study, plan: Plan, folder: Path, left_out: dict[str, str], clock: ProcessorClock, progress: Progress
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Run what was exported; costs of each stage beside ours, and what each file gave by response."""
    stages, printed = [], {}
    for i, (name, stage) in enumerate(STAGES.items()):
        progress("Dakota", i, len(STAGES))
        row: dict[str, Any] = {"stage": stage, "wall": clock.seconds[stage], "cpu": clock.processor[stage]}
        if f"{name}.in" in left_out:
            stages.append(row | {"wall_dakota": np.nan, "cpu_dakota": np.nan})
            continue
        done = run_dakota(folder / f"{name}.in")
        stages.append(row | {"wall_dakota": round(done.wall, 3), "cpu_dakota": round(done.cpu, 3)})
        source = folder / (f"{name}.h5" if name == "surrogate" else f"{name}.dat")
        read = import_results(source, plan.space, study.policy, plan.seed, study.method.bootstrap)
        printed[name] = read.results["responses"]
    progress("Dakota", len(STAGES), len(STAGES))
    return stages, printed


def _response(study: Study, s: Sampled, j: int, name: str, printed: dict[str, Any]) -> dict[str, Any]:
    """Indices of one response by factor, ours and Dakota's, and how far they agree."""
    space, method = study.space, study.method
    screened = analysis.screen_one(s.screening, s.screened.responses.column(name), study.policy, method.bootstrap)
    screening = analysis.morris_json(space, screened)
    shares = analysis.sobol_json(space, s.found.indices[j])
    failed_here = int(s.read.responses.failed(name).sum())
    if study.policy == "refuse" and failed_here:
        shares = {factor: {"S1": np.nan, "ST": np.nan, "S1_ci": [np.nan] * 2, "ST_ci": [np.nan] * 2} for factor in space.names}
    moat, surfpack = (printed.get(route, {}).get(name, {}).get("dakota", {}) for route in ("morris", "surrogate"))
    factors = {}
    for factor in space.names:
        row = {"mu_star": screening[factor]["mu_star"], "mu_star_ci": screening[factor]["mu_star_ci"], **shares[factor]}
        row["mu_star_dakota"] = moat.get(factor, {}).get("mu_star", np.nan)
        row |= {f"{index}_dakota": surfpack.get(factor, {}).get(index, np.nan) for index in ("S1", "ST")}
        factors[factor] = row
    columns = {
        key: np.array([factors[factor][key] for factor in space.names]) for key in (*INDICES, *(f"{i}_dakota" for i in INDICES))
    }
    agreement = {index: rank_agreement(columns[index], columns[f"{index}_dakota"]) for index in ("mu_star", "ST")}
    apart = {index: float(np.max(np.abs(columns[index] - columns[f"{index}_dakota"]))) for index in ("S1", "ST")}
    failed = {route: rows[name]["failed"] for route, rows in printed.items() if "failed" in rows.get(name, {})}
    return {
        "q2": s.found.surrogates[j].q2, "failed": failed_here, "failed_dakota": failed.get("lhs", 0),
        "rank_agreement": agreement, "largest_difference": apart, "factors": factors,
    }  # fmt: skip
