"""What a study says of its own reliability: numerical errors, validity of the aerodynamics, boundaries, and provenance."""

from __future__ import annotations

import datetime
import platform
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import scipy
from numpy.typing import NDArray

from levelone._version import __version__
from levelone.campaign.describe import provenance_hashes
from levelone.campaign.models.builtin import RESPONSES, Assessment, BuiltinModel
from levelone.campaign.sweep import SweepCheck, sweep_check
from levelone.config.study_file import Study
from levelone.config.vehicle_file import load_fine_table, with_table
from levelone.vehicle import Vehicle
from levelone.vehicle.tables import FloatArray


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
    return reach(everything) | _counts(either) | {name: reach(assessed.extremes[name]) | _counts(m) for name, m in marks.items()}


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


def reach(x: Mapping[str, FloatArray]) -> dict[str, float]:
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
        "translational_rate": str(b.limits["translational_rate"].get("confidence", "not stated")),
    }


def provenance(study: Study, seed: int, seconds: Mapping[str, float]) -> dict[str, Any]:
    """Versions, seed, hashes and wall times."""
    return {
        "levelone": __version__, "python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__,
        "numba": numba.__version__, "platform": platform.platform(), "seed": seed, **provenance_hashes(study),
        "wall_s": dict(seconds), "finished": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }  # fmt: skip
