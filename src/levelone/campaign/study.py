"""A study from its file to its results folder: nominal flight, screening, Monte Carlo, surrogates, decomposition, numerics."""

from __future__ import annotations

import datetime
import platform
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numba
import numpy as np
import scipy
from numpy.typing import NDArray

from levelone._version import __version__
from levelone.campaign import analysis
from levelone.campaign.describe import describe_study, provenance_hashes
from levelone.campaign.models import RESPONSES, Assessment, BuiltinModel
from levelone.campaign.pictures import frequency_groups, history_groups
from levelone.campaign.store import prepare_folder, write_groups, write_json, write_sample
from levelone.campaign.sweep import SweepCheck, sweep_check
from levelone.config.study_file import Study
from levelone.config.vehicle_file import load_fine_table, with_table
from levelone.dynamics import trim
from levelone.status import Status
from levelone.uncertainty import Design, latin_hypercube, morris_design, sobol_design, stage_seed
from levelone.vehicle import Vehicle
from levelone.vehicle.tables import FloatArray

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
    with clock.stage("numerics"):
        progress("numerics", 0, 1)
        checks = numerics(study, model, nominal, swept)
        progress("numerics", 1, 1)
    with clock.stage("files"):
        write_sample(folder, "morris", screening, screened)
        write_sample(folder, "monte_carlo", sample, assessed)
        write_groups(folder / "histories.nc", history_groups(model, sample, swept))
        write_groups(folder / "frequency.nc", frequency_groups(swept))
    results: dict[str, Any] = {
        "schema": SCHEMA,
        "study": describe_study(study, seed),
        "responses": response_results(study, nominal, screening, screened, sample, assessed, found),
        "levels": analysis.level_shares(assessed) | {"confidence": confidences(study)},
        "nominal": nominal_results(model, swept),
        "numerics": checks,
        "sweep": swept.summary(),
        "validity": validity(study.vehicle, assessed),
        "assumed": [{"field": name, "why": why} for name, why in study.vehicle.assumed],
        "not_validated": list(study.not_validated),
        "validity_domain": list(study.validity_domain),
        "provenance": provenance(study, seed, clock),
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
    """The block of each response in results.json."""
    effects = analysis.screen(screening, screened, study.policy, study.method.bootstrap)
    out: dict[str, Any] = {}
    for j, (name, (unit, criterion)) in enumerate(RESPONSES.items()):
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


def numerics(study: Study, model: BuiltinModel, nominal: Assessment, swept: SweepCheck) -> dict[str, Any]:
    """Change of each nominal value at half the step, with another spectral window, and with the finer rotor table."""
    half = model.at_half_step().nominal().responses
    other = tuple(0.7 * w for w in study.windows)
    window = sweep_check(model, study.sweep, other).swept_reading
    fine_table = load_fine_table(study.vehicle_path)
    fine = None
    if fine_table is not None:
        fine = replace(model, vehicle=with_table(study.vehicle, fine_table)).nominal().responses
    spectral = {
        "omega_bw": float(window.omega_bw) - float(swept.swept_reading.omega_bw),
        "tau_p": float(window.tau_p) - float(swept.swept_reading.tau_p),
    }
    out: dict[str, Any] = {}
    for name in RESPONSES:
        here = float(nominal.responses.column(name)[0])
        out[name] = {
            "half_step": float(half.column(name)[0]) - here,
            "window": spectral.get(name, np.nan),
            "window_status": "change of the swept reading" if name in spectral else "uses no spectra",
            "finer_table": np.nan if fine is None else float(fine.column(name)[0]) - here,
            "finer_table_status": "the vehicle has no finer table" if fine is None else "ok",
        }
    return out


def validity(vehicle: Vehicle, assessed: Assessment) -> dict[str, Any]:
    """How many runs left the stated validity of the aerodynamics, and how far: in either manoeuvre, and in each."""
    marks = {name: _marks(vehicle, extremes) for name, extremes in assessed.extremes.items()}
    either = {key: np.any([m[key] for m in marks.values()], axis=0) for key in next(iter(marks.values()))}
    everything = {
        key: np.concatenate([x[key] for x in assessed.extremes.values()]) for key in ("alpha_min", "alpha_max", "C_D_min")
    }
    return _reach(everything) | _counts(either) | {name: _reach(assessed.extremes[name]) | _counts(m) for name, m in marks.items()}


def _marks(vehicle: Vehicle, x: Mapping[str, FloatArray]) -> dict[str, NDArray[np.bool_]]:
    v = vehicle.validity
    with np.errstate(invalid="ignore"):
        return {
            "negative_drag_runs": x["C_D_min"] < 0,
            "alpha_outside_runs": (x["alpha_min"] < v.alpha[0]) | (x["alpha_max"] > v.alpha[1]),
            "beta_outside_runs": (x["beta_min"] < v.beta[0]) | (x["beta_max"] > v.beta[1]),
            "saturated_runs": x["saturated"] > 0,
        }


def _counts(marks: Mapping[str, NDArray[np.bool_]]) -> dict[str, int]:
    return {key: int(mark.sum()) for key, mark in marks.items()} | {"n": len(next(iter(marks.values())))}


def _reach(x: Mapping[str, FloatArray]) -> dict[str, float]:
    """Extremes over the runs that flew; NaN where none did."""

    def of(pick: Callable[..., Any], values: FloatArray) -> float:
        flown = values[np.isfinite(values)]
        return float(pick(flown)) if flown.size else float("nan")

    return {
        "alpha_min_deg": float(np.degrees(of(np.min, x["alpha_min"]))),
        "alpha_max_deg": float(np.degrees(of(np.max, x["alpha_max"]))),
        "C_D_min": of(np.min, x["C_D_min"]),
    }


def confidences(study: Study) -> dict[str, str]:
    """Confidence of the boundary that each criterion is judged by."""
    b = study.boundaries
    return {
        "attitude_quickness": b.chart("attitude_quickness", "pitch").confidence,
        "dynamic_stability": f"zeta line {b.dynamic_stability.confidence_zeta_1}, other limits {b.dynamic_stability.confidence}",
        "bandwidth": b.chart("bandwidth", study.task).confidence,
    }


def provenance(study: Study, seed: int, clock: Clock) -> dict[str, Any]:
    """Versions, seed, hashes and wall times."""
    return {
        "levelone": __version__, "python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__,
        "numba": numba.__version__, "platform": platform.platform(), "seed": seed, **provenance_hashes(study),
        "wall_s": clock.seconds, "finished": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }  # fmt: skip
