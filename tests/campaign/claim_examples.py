"""Evidence for claims, written by hand: a study of the 14 inputs in which every number can be set."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign.claims import Evidence
from levelone.campaign.claims.evidence import EXTENDED

# name, nominal, low, high: the study, Table 2
INPUTS = (
    ("M", 7.0, 6.5, 7.5), ("I_y", 0.7237, 0.65133, 0.79607), ("K_T", 6.96e-8, 5.916e-8, 8.004e-8), ("T_u", 1.0, 0.95, 1.05),
    ("tau_d", 0.0, 0.0, 0.03), ("C_L0", 0.7745, 0.6196, 0.9294), ("C_D0", 0.0183, 0.01464, 0.02196),
    ("C_m0", -0.0240, -0.0288, -0.0192), ("C_Lalpha", 5.127, 4.1016, 6.1524), ("C_Dalpha", 0.2558, 0.20464, 0.30696),
    ("C_malpha", -0.5402, -0.64824, -0.43216), ("C_Lq", 7.6136, 6.09088, 9.13632), ("C_Dq", 0.7179, 0.57432, 0.86148),
    ("C_mq", -16.169, -19.4028, -12.9352),
)  # fmt: skip
NAMES = tuple(entry[0] for entry in INPUTS)
RESPONSES = (
    "quickness", "delta_theta_min", "delta_theta_pk", "zeta", "omega_n", "omega_bw", "tau_p", "omega_bw_attitude", "tau_p_attitude",
)  # fmt: skip
RUNS = 400
TABLES = {
    "attitude_quickness": ("study, Table 3", 5, ("quickness", "delta_theta_min")),
    "dynamic_stability": ("study, Table 4", 4, ("zeta", "omega_n")),
    "bandwidth": ("study, Table 5", 5, ("omega_bw", "tau_p")),
}


def ranked(order: str, rest: float = 0.01) -> dict[str, float]:
    """Indices 1, 0.9, 0.8 ... for the inputs named in this order; ``rest`` for all others."""
    names = order.split()
    return {name: 1.0 - 0.1 * names.index(name) if name in names else rest for name in NAMES}


def ramp(low: float, high: float) -> np.ndarray:
    """[run] equally spaced values."""
    return np.linspace(low, high, RUNS)


def study(omega_min: float = 0.5, omega_max: float = 12.0) -> dict[str, Any]:
    """The section ``study`` of results.json, as far as claims read it."""
    return {
        "trim_speed": 5.0,
        "factors": [
            {"name": name, "nominal": nominal, "low": low, "high": high, "distribution": "uniform"}
            for name, nominal, low, high in INPUTS
        ],
        "method": {"trajectories": 20},
        "manoeuvres": {"bandwidth": {"omega_min": omega_min, "omega_max": omega_max}},
    }  # fmt: skip


def response(change: Mapping[str, Any]) -> dict[str, Any]:
    """A block of ``responses``; ``mu_star``, ``sigma``, ``S1`` and ``ST`` are given by input."""
    flat = dict.fromkeys(NAMES, 0.5)
    index = {key: change.get(key, flat) for key in ("mu_star", "sigma", "S1", "ST")}
    return {
        "nominal": change.get("nominal", 1.0), "status": change.get("status", "ok"),
        "morris_failed": change.get("morris_failed", 0),
        "morris": {name: {"mu_star": index["mu_star"][name], "sigma": index["sigma"][name]} for name in NAMES},
        "sobol": {name: {"S1": index["S1"][name], "ST": index["ST"][name]} for name in NAMES},
        "surrogate": {"status": "ok"},
    }  # fmt: skip


def cases(criterion: str, **values: Sequence[float]) -> dict[str, Any]:
    """The section ``cases`` with the values of one table."""
    source, count, names = TABLES[criterion]
    found = {name: list(values.get(name, [1.0] * count)) for name in names}
    status = {name: ["ok" if np.isfinite(value) else "the run diverged" for value in column] for name, column in found.items()}
    return {criterion: {"name": "x", "source": source, "rows": [[0.0]] * count, "values": found, "status": status}}


def swept(amplitude: float, phase: float, coherence: float) -> dict[str, Any]:
    """The section ``sweep``, or an entry of ``amplitudes``."""
    return {
        "amplitude": amplitude, "max_phase_difference_deg": phase, "coherence_min": coherence, "status": "ok", "omega_max": 15.0,
    }  # fmt: skip


def without_delay(tau_p: tuple[float, float], omega_bw: tuple[float, float], failed: int = 0) -> dict[str, Any]:
    """The section ``without_delay`` from (mean, standard deviation)."""
    entries = {"tau_p": tau_p, "omega_bw": omega_bw}
    return {"n": RUNS, "responses": {name: {"n": RUNS, "failed": failed, "mean": m, "std": s} for name, (m, s) in entries.items()}}


def coupling(level_1: float, part: float, outside: float = 0.0) -> dict[str, Any]:
    """The section ``coupling``: share at Level 1, and the roll factor's part of the largest mu_star on zeta."""
    pitch = ("quickness", "delta_theta_min", "zeta", "omega_n", "omega_bw", "tau_p")
    mu_star = {name: {"M": 2.0, "C_lp": 2.0 * part if name == "zeta" else 0.0} for name in pitch}
    shares = {"level_1": level_1, "level_2": 1.0 - level_1 - outside, "level_3": 0.0, "outside": outside, "failed": 0.0}
    return {"added": ["C_lp"], "n": 250, "mu_star": mu_star, "level_shares": shares}


def evidence(
    *,
    values: Mapping[str, Any] | None = None,
    points: Mapping[str, Any] | None = None,
    levels: Mapping[str, Any] | None = None,
    responses: Mapping[str, Mapping[str, Any]] | None = None,
    sections: Mapping[str, Any] | None = None,
) -> Evidence:
    """A study in which nothing was set but this: values 1 to 2, inputs nominal, Levels 1, all indices equal."""
    columns = {name: ramp(1.0, 2.0) for name in RESPONSES} | dict(values or {})
    box = {name: np.full(RUNS, nominal) for name, nominal, *_ in INPUTS} | dict(points or {})
    codes = {key: np.ones(RUNS, dtype=np.int64) for key in ("attitude_quickness", "dynamic_stability", "bandwidth", EXTENDED)}
    changed = responses or {}
    summary = {
        "study": study(),
        "responses": {name: response(changed.get(name, {})) for name in RESPONSES},
        "sweep": swept(0.1, 2.0, 0.9),
    } | dict(sections or {})
    return Evidence(
        copy.deepcopy(summary),
        NAMES,
        np.column_stack([box[name] for name in NAMES]),
        RESPONSES,
        np.column_stack([columns[name] for name in RESPONSES]),
        codes | dict(levels or {}),
    )


def provenance() -> dict[str, Any]:
    """The section ``provenance``, as far as the record of experiments is held against it."""
    return {"study_sha256": "a" * 64, "vehicle_sha256": "b" * 64, "seed": 5}


def write_folder(folder: Path, given: Evidence, findings: str) -> Path:
    """A results folder that holds this evidence and these findings, as far as claims read it."""
    folder.mkdir(parents=True, exist_ok=True)
    criteria = [name for name in given.levels if name != EXTENDED]
    data = xr.Dataset(
        {
            "points": (("run", "factor"), given.points),
            "values": (("run", "response"), given.values),
            "level": (("run", "criterion"), np.column_stack([given.levels[name] for name in criteria])),
            "extrapolated_level": ("run", given.levels[EXTENDED]),
        },
        coords={"factor": list(given.factors), "response": list(given.responses), "criterion": criteria},
    )
    data.to_netcdf(folder / "monte_carlo.nc", engine="h5netcdf")
    summary = {**given.summary, "findings": "findings.toml", "provenance": provenance()}
    (folder / "results.json").write_text(json.dumps(summary), encoding="utf-8")
    (folder / "findings.toml").write_text(findings, encoding="utf-8")
    return folder
