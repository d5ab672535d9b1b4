"""What results.json says of the study itself."""

from __future__ import annotations

import math
from typing import Any

from levelone.config.model_study import ModelStudy
from levelone.config.study_file import Study
from levelone.config.vehicle_file import vehicle_hash
from levelone.handling.manoeuvres import Manoeuvre


def describe_study(study: Study, seed: int) -> dict[str, Any]:
    """Factors, methods and manoeuvres of a study, as written into its results."""
    return {
        **describe_statements(study, seed),
        "vehicle": study.vehicle.name,
        "trim_speed": study.quickness.trim_speed,
        "flight_mode": study.quickness.flight_mode,
        "manoeuvres": {
            "attitude_quickness": describe_manoeuvre(study.quickness),
            "dynamic_stability": describe_manoeuvre(study.stability),
            "bandwidth": describe_manoeuvre(study.sweep),
        },
    }


def describe_statements(study: Study | ModelStudy, seed: int) -> dict[str, Any]:
    """What studies of every model say: purpose, policy, boundaries, factors and sizes."""
    m = study.method
    return {
        "name": study.name,
        "title": study.title,
        "intended_use": study.intended_use,
        "policy": study.policy,
        "boundaries": study.boundaries_source,
        "task": study.task,
        "notes": list(study.notes),
        "seed": seed,
        "factors": [_factor(study, j) for j in range(len(study.space.factors))],
        "correlations": [
            {"factors": [first, second], "rank": rank, "source": why} for first, second, rank, why in study.correlations
        ],
        "method": {
            "trajectories": m.trajectories, "levels": m.levels, "samples": m.samples, "base_points": m.base_points,
            "kernel": m.kernel, "trend": m.trend, "bootstrap": m.bootstrap,
        },
    }  # fmt: skip


def _factor(study: Study | ModelStudy, j: int) -> dict[str, Any]:
    """One factor as results.json names it."""
    factor = study.space.factors[j]
    low, high = factor.distribution.support
    return {
        "name": factor.name, "target": factor.target or factor.name, "unit": factor.unit, "nominal": float(study.nominal[j]),
        "low": low, "high": high, "distribution": type(factor.distribution).__name__.lower(), "source": factor.source,
    }  # fmt: skip


def describe_manoeuvre(m: Manoeuvre) -> dict[str, Any]:
    """One manoeuvre as results.json names it."""
    out: dict[str, Any] = {
        "axis": m.axis,
        "shape": m.shape,
        "amplitude": m.amplitude,
        "on": m.on,
        "duration": m.duration,
        "dt": m.dt,
    }
    if math.isfinite(m.off):
        out |= {"off": m.off, "length": m.off - m.on}
    if m.shape == "sweep":
        out |= {"omega_min": m.omega_min, "omega_max": m.omega_max}
    return out


def provenance_hashes(study: Study) -> dict[str, str]:
    """sha256 of the study file and of the vehicle file with its tables."""
    return {"study_sha256": study.hash, "vehicle_sha256": vehicle_hash(study.vehicle_path)}
