"""A results folder as a finished study leaves it, from closed forms in place of an aircraft: nothing here is a reference.

Responses are smooth functions of the factors with one corner (low mass, long delay) in which runs fail, so that NaN,
statuses, failures and Levels outside the requirement's range all occur.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from levelone.status import Status

FACTORS = (
    ("M", "kg", 7.0, 6.5, 7.5), ("I_y", "kg m^2", 0.7237, 0.651, 0.796), ("K_T", "N/rpm^2", 6.96e-8, 5.92e-8, 8.0e-8),
    ("T_u", "1", 1.0, 0.95, 1.05), ("tau_d", "s", 0.0, 0.0, 0.03), ("C_L0", "1", 0.7745, 0.62, 0.93),
    ("C_D0", "1", 0.0183, 0.0146, 0.022), ("C_m0", "1", -0.024, -0.0288, -0.0192), ("C_Lalpha", "1/rad", 5.127, 4.1, 6.15),
    ("C_Dalpha", "1/rad", 0.2558, 0.205, 0.307), ("C_malpha", "1/rad", -0.5402, -0.648, -0.432),
    ("C_Lq", "1/rad", 7.6136, 6.09, 9.14), ("C_Dq", "1/rad", 0.7179, 0.574, 0.861), ("C_mq", "1/rad", -16.169, -19.4, -12.94),
)  # fmt: skip
NAMES = tuple(factor[0] for factor in FACTORS)

# name: (unit, criterion, centre, linear effects of the factors over half their range, effect of light mass with delay)
RESPONSES: dict[str, tuple[str, str, float, tuple[float, ...], float]] = {
    "quickness": ("1/s", "attitude_quickness", 2.88,
        (-0.10, -0.13, 0.12, 0.012, 0.09, 0.07, 0.001, 0.004, 0.02, 0.002, 0.011, 0.003, 0.002, 0.006), 0.12),
    "delta_theta_min": ("rad", "attitude_quickness", 0.069,
        (0.0008, 0.0021, -0.0024, 0.0002, 0.0006, -0.0017, 0.0007, 0.0002, -0.0014, 0.0006, 0.0006, 0.0003, 0.0001, 0.0012),
        0.0025),
    "delta_theta_pk": ("rad", "attitude_quickness", 0.188,
        (0.001, 0.005, -0.004, 0.0003, 0.002, -0.003, 0.0005, 0.0003, -0.002, 0.0006, 0.0009, 0.0003, 0.0001, 0.0014), 0.004),
    "zeta": ("1", "dynamic_stability", 0.362,
        (-0.004, 0.006, 0.003, 0.0006, -0.008, 0.018, 0.0004, 0.0003, 0.003, 0.0011, 0.0028, 0.0021, 0.0002, 0.014), -0.03),
    "omega_n": ("rad/s", "dynamic_stability", 5.61,
        (-0.12, -0.31, 0.33, 0.02, -0.17, 0.06, 0.003, 0.002, 0.02, 0.03, 0.04, 0.05, 0.002, -0.08), 0.10),
    "omega_bw": ("rad/s", "bandwidth", 4.45,
        (-0.09, -0.16, 0.18, 0.01, -0.05, 0.06, 0.002, 0.001, 0.03, 0.01, 0.02, 0.004, 0.001, 0.05), 0.02),
    "tau_p": ("s", "bandwidth", 0.034,
        (0.0002, 0.0006, -0.0005, 0.00004, 0.0052, 0.0001, 0.0, 0.0, 0.00012, 0.00003, 0.00004, 0.00003, 0.0, 0.0002), 0.0002),
    "omega_bw_attitude": ("rad/s", "bandwidth", 8.2,
        (-0.2, -0.3, 0.36, 0.02, -0.5, 0.11, 0.003, 0.002, 0.05, 0.01, 0.03, 0.01, 0.002, 0.09), -0.06),
    "tau_p_attitude": ("s", "bandwidth", 0.029,
        (0.0002, 0.0005, -0.0004, 0.00003, 0.0058, 0.0001, 0.0, 0.0, 0.0001, 0.00002, 0.00003, 0.00003, 0.0, 0.00017), 0.0001),
}  # fmt: skip
CRITERIA = ("attitude_quickness", "dynamic_stability", "bandwidth")
ON, PULSE_OFF = 1.0, 1.5


def write(directory: Path, *, runs: int = 500, seed: int = 7, fail: bool = True) -> Path:
    """Write the whole folder and return it."""
    directory.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    unit, values, status = sample(rng, runs, fail)
    screening = sample(rng, 300, False)
    _designs(directory, "monte_carlo", unit, values, status)
    _designs(directory, "morris", *screening)
    _histories(directory / "histories.nc", rng)
    _frequency(directory / "frequency.nc")
    document = summary(unit, values, status, rng)
    (directory / "results.json").write_text(json.dumps(document, indent=1), encoding="utf-8")
    return directory


def rewrite(directory: Path, change: Any) -> Path:
    """Read results.json, let ``change`` edit it in place, write it back."""
    path = directory / "results.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    path.write_text(json.dumps(document), encoding="utf-8")
    return directory


def sample(rng: np.random.Generator, runs: int, fail: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit coordinates [run, factor], values and status codes [run, response]."""
    unit = rng.random((runs, len(FACTORS)))
    centred = 2.0 * unit - 1.0
    corner = np.maximum(0.0, 0.4 - unit[:, 0]) * np.maximum(0.0, unit[:, 4] - 0.5) * 20.0
    values = np.empty((runs, len(RESPONSES)))
    for j, (_, _, centre, effects, strength) in enumerate(RESPONSES.values()):
        curved = centred + 0.15 * centred**2
        values[:, j] = centre + curved @ np.array(effects) + strength * corner
    status = np.zeros(values.shape, dtype=np.int64)
    if fail:
        lost = corner > 2.0
        status[lost] = Status.DIVERGED
        status[(unit[:, 13] > 0.97) & ~lost, list(RESPONSES).index("omega_n")] = Status.NO_SECOND_PEAK
        caution = (unit[:, 4] > 0.9) & ~lost
        status[caution, list(RESPONSES).index("omega_bw_attitude")] = Status.PIO_CAUTION
        values[lost] = math.nan
        values[status == Status.NO_SECOND_PEAK] = math.nan
    return unit, values, status


def _designs(directory: Path, name: str, unit: np.ndarray, values: np.ndarray, status: np.ndarray) -> None:
    low, high = np.array([factor[3] for factor in FACTORS]), np.array([factor[4] for factor in FACTORS])
    level = np.where(np.isnan(values[:, [0, 3, 7]]), -1, [0, 1, 1])
    data = xr.Dataset(
        {
            "points": (("run", "factor"), low + unit * (high - low)),
            "values": (("run", "response"), values),
            "status": (("run", "response"), status),
            "level": (("run", "criterion"), level),
            "extrapolated_level": ("run", np.where(level[:, 0] < 0, -1, 1)),
        },
        coords={
            "factor": list(NAMES),
            "factor_unit": ("factor", [factor[1] for factor in FACTORS]),
            "response": list(RESPONSES),
            "response_unit": ("response", [entry[0] for entry in RESPONSES.values()]),
            "criterion": list(CRITERIA),
        },
    )
    data.to_netcdf(directory / f"{name}.nc", engine="h5netcdf")


def pitch(time: np.ndarray, omega_n: float, zeta: float, amplitude: float, off: float = math.inf) -> tuple[np.ndarray, ...]:
    """Pitch rate, attitude and speed after a step or pulse: a damped oscillation and its integrals (analytic)."""

    def step(since: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        s = np.maximum(since, 0.0)
        wd = omega_n * math.sqrt(1.0 - zeta**2)
        theta = -0.19 * amplitude * (np.exp(-1.1 * s) - np.exp(-zeta * omega_n * s) * np.cos(wd * s))
        speed = amplitude * (1.0 - np.exp(-1.1 * s) * (1.0 + 1.1 * s))
        return np.gradient(theta, time), theta, speed

    parts = step(time - ON)
    if math.isfinite(off):
        parts = tuple(a - b for a, b in zip(parts, step(time - off), strict=True))
    rate, theta, speed = parts
    return rate, np.radians(4.0) + theta, 5.0 + speed


def _histories(path: Path, rng: np.random.Generator) -> None:
    time = np.arange(0.0, 8.0 + 1e-9, 0.004)
    for k, (criterion, amplitude, off) in enumerate((("attitude_quickness", 1.0, math.inf), ("dynamic_stability", 0.7, PULSE_OFF))):
        runs = [pitch(time, 5.61, 0.36, amplitude, off)]
        runs += [pitch(time, 5.61 + 0.4 * a, 0.36 + 0.03 * b, amplitude, off) for a, b in rng.standard_normal((20, 2))]
        reference = 5.0 + amplitude * ((time >= ON) & (time < off))
        data = _records(time, runs, np.broadcast_to(reference, (len(runs), time.size)))
        data.attrs.update({"input_on": ON, "input_off": off, **(_picks(data, k == 0))})
        data.to_netcdf(path, group=criterion, mode="w" if k == 0 else "a", engine="h5netcdf")
    time = np.arange(0.0, 96.0 + 1e-9, 0.004)
    since = np.clip(time - ON, 0.0, 90.0)
    swept = np.where((time >= ON) & (time < 91.0), 0.5 * np.sin(0.3 * since + 0.5 * 15.0 * since**2 / 90.0), 0.0)
    omega = 0.3 + 15.0 * since / 90.0
    gain = 0.10 * omega / np.sqrt((1.0 - (omega / 5.6) ** 2) ** 2 + (0.72 * omega / 5.6) ** 2)
    run = (swept * gain * 0.4, np.radians(4.0) + swept * gain * 0.4 / np.maximum(omega, 0.3), 5.0 + swept / (1.0 + omega))
    data = _records(time, [run], 5.0 + swept[None])
    data.attrs.update({"input_on": ON, "input_off": 91.0})
    data.to_netcdf(path, group="bandwidth", mode="a", engine="h5netcdf")


def _records(time: np.ndarray, runs: list[tuple[np.ndarray, ...]], reference: np.ndarray) -> xr.Dataset:
    channels = {name: (("run", "time"), np.array([run[j] for run in runs])) for j, name in enumerate(("q", "theta", "V_lon"))}
    return xr.Dataset({**channels, "V_lon_ref": (("run", "time"), reference)}, coords={"time": time})


def _turns(q: np.ndarray, first: int, count: int) -> list[int]:
    rate = np.diff(q[first:])
    return [first + 1 + int(i) for i in np.flatnonzero(rate[1:] * rate[:-1] < 0.0)[:count]]


def _picks(data: xr.Dataset, quickness: bool) -> dict[str, float]:
    time, q, theta = data.time.values, data.q.values[0], data.theta.values[0]
    if quickness:
        peak, second = _turns(q, int(ON / 0.004) + 5, 2)
        top = int(np.argmax(np.abs(theta - theta[0])))
        return {
            "t_q_pk": time[peak], "q_pk": q[peak], "t_theta_pk": time[top], "theta_pk": theta[top],
            "t_second": time[second], "theta_second": theta[second],
        }  # fmt: skip
    places = _turns(q, int((PULSE_OFF + 0.03) / 0.004), 3)
    marks = {f"t_{j + 1}": time[place] for j, place in enumerate(places)}
    return {"t_free": PULSE_OFF + 0.03, **marks, **{f"q_{j + 1}": q[place] for j, place in enumerate(places)}}


def response_of(omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """q / V_lon and -theta / V_lon of a delayed oscillator under a speed loop."""
    s = 1j * omega
    attitude = 0.19 * s / (s + 0.9) * 31.5 / (s**2 + 4.04 * s + 31.5) * np.exp(-0.035 * s) * 1.6
    return -s * attitude, attitude


def _frequency(path: Path) -> None:
    omega = np.geomspace(0.1, 60.0, 400)
    rate, attitude = response_of(omega)
    readings = {
        "omega_bw": 4.45, "omega_180": 5.9, "tau_p": 0.034,
        "omega_bw_attitude": 8.2, "omega_180_attitude": 11.7, "tau_p_attitude": 0.029,
    }  # fmt: skip
    linear = xr.Dataset(_complex(omega, rate, attitude), attrs=readings)
    linear.to_netcdf(path, group="linear", mode="w", engine="h5netcdf")
    swept = np.arange(0.28, 15.0, 0.14)
    rng = np.random.default_rng(3)
    noise = 1.0 + 0.01 * rng.standard_normal((2, swept.size)) * (1.0 + 4.0 * np.exp(-swept / 0.3))
    rate, attitude = (value * change for value, change in zip(response_of(swept), noise, strict=True))
    data = xr.Dataset(_complex(swept, rate, attitude), attrs={"window_s": 45.0, "amplitude": 0.5})
    data["coherence"] = ("omega", 1.0 - 0.35 * np.exp(-swept / 0.4) - 0.03 * (swept / 15.0) ** 2)
    data["theta_coherence"] = ("omega", 1.0 - 0.30 * np.exp(-swept / 0.4) - 0.05 * (swept / 15.0) ** 2)
    data.to_netcdf(path, group="swept", mode="a", engine="h5netcdf")


def _complex(omega: np.ndarray, rate: np.ndarray, attitude: np.ndarray) -> dict[str, Any]:
    parts = {"q_re": rate.real, "q_im": rate.imag, "theta_re": attitude.real, "theta_im": attitude.imag}
    return {"omega": ("omega", omega), **{name: ("omega", part) for name, part in parts.items()}}


def summary(unit: np.ndarray, values: np.ndarray, status: np.ndarray, rng: np.random.Generator) -> dict[str, Any]:
    """results.json as a dictionary."""
    return {
        "schema": 1,
        "study": _study(),
        "responses": {name: _response(j, name, unit, values, status, rng) for j, name in enumerate(RESPONSES)},
        "levels": _levels(values),
        "nominal": {
            "dominant_pole": {"real": -2.02, "imag": 5.23, "omega_n": 5.607, "zeta": 0.360},
            "trim": {"theta": 0.0698, "throttle": [0.61, 0.61, 0.6, 0.6, 0.6, 0.6, 0.59, 0.59]},
            "omega_bw_gain_attitude": 7.1,
        },
        "numerics": {
            name: {"half_step": 2e-5 * entry[2], "window": 0.004 * entry[2] if entry[1] == "bandwidth" else math.nan,
                   "window_status": "" if entry[1] == "bandwidth" else "does not use spectra", "finer_table": -3e-4 * entry[2]}
            for name, entry in RESPONSES.items()
        },
        "sweep": {
            "max_gain_difference_db": 0.83, "max_phase_difference_deg": 3.2, "within": 0.964, "coherence_min": 0.86,
            "omega_bw": 4.41, "tau_p": math.nan, "status": Status.RANGE_TOO_SHORT.text,
        },
        "validity": _validity(),
        "assumed": [
            {"field": "airframe.rotors.tau_d", "why": "the study inserts 0.02 s by hand; its table prints 0"},
            {"field": "C_L0", "why": "constant in airspeed; wing incidence included"},
            {"field": "airframe.mass.I_xx", "why": "not printed; scaled from the span"},
            {"field": "controller", "why": "gains of the published study are not printed"},
        ],
        "not_validated": ["No flight test of this aircraft was used.", "Propeller-airframe interaction is not modelled."],
        "validity_domain": ["Incidence between -10 and 14 deg (no stall model).", "Ground speed 0 to 10 m/s, calm air."],
        "provenance": {
            "levelone": "0.1.0", "python": "3.11.7", "numpy": "2.2", "scipy": "1.15", "numba": "0.61", "platform": "Linux x86_64",
            "seed": 20, "study_sha256": "ab" * 32, "vehicle_sha256": "cd" * 32, "table_sha256": "ef" * 32,
            "wall_s": {"nominal": 0.4, "morris": 6.1, "monte_carlo": 8.4, "surrogate": 31.0, "sobol": 12.2},
            "finished": "2025-01-02T03:04:05+00:00",
        },
    }  # fmt: skip


def _study() -> dict[str, Any]:
    step = {"axis": "V_lon", "amplitude": 1.0, "on": ON, "duration": 8.0}
    return {
        "name": "reference",
        "title": "Handling qualities of the reference eVTOL at 5 m/s",
        "intended_use": "Rank the uncertain inputs of the flight simulation model before flight test.",
        "vehicle": "reference-evtol", "trim_speed": 5.0, "flight_mode": "velocity", "policy": "bound",
        "factors": [
            {"name": name, "target": f"airframe.{name}", "unit": unit, "nominal": nominal, "low": low, "high": high,
             "distribution": "uniform", "source": "Table 2 of the reference study"}
            for name, unit, nominal, low, high in FACTORS
        ],
        "method": {"trajectories": 20, "levels": 4, "samples": 500, "base_points": 16384, "kernel": "matern52",
                   "trend": "linear", "bootstrap": 1000},
        "manoeuvres": {
            "attitude_quickness": step,
            "dynamic_stability": {**step, "amplitude": 0.7, "off": PULSE_OFF},
            "bandwidth": {**step, "amplitude": 0.5, "omega_min": 0.3, "omega_max": 15.3, "length": 90.0},
        },
    }  # fmt: skip


def _response(
    j: int, name: str, unit: np.ndarray, values: np.ndarray, status: np.ndarray, rng: np.random.Generator
) -> dict[str, Any]:
    si, criterion, centre, effects, strength = RESPONSES[name]
    column = values[:, j]
    finite = column[np.isfinite(column)]
    codes = {Status(code): int((status[:, j] == code).sum()) for code in np.unique(status[:, j])}
    failed = int(np.isnan(column).sum())
    variance = np.array(effects) ** 2 / 3.0
    interaction = np.zeros(len(NAMES))
    interaction[[0, 4]] = strength**2 * 0.15
    total = variance.sum() + interaction[0]
    p = np.quantile(finite, (0.05, 0.5, 0.95))
    return {
        "unit": si, "criterion": criterion, "nominal": centre, "status": Status.OK.text,
        "morris": {
            factor: _morris(2.0 * effect, 0.25 * abs(effect) + (1.1 * abs(strength) if k in (0, 4) else 0.0), rng)
            for k, (factor, effect) in enumerate(zip(NAMES, effects, strict=True))
        },
        "morris_failed": 0, "morris_unit": f"{si} per full factor range",
        "monte_carlo": {"n": len(column), "failed": failed, "mean": finite.mean(), "std": finite.std(ddof=1),
                        "min": finite.min(), "max": finite.max(), "p05": p[0], "p50": p[1], "p95": p[2]},
        "failures": {code.text: count for code, count in codes.items() if code.failed},
        "cautions": {code.text: count for code, count in codes.items() if code and not code.failed},
        "failure_corner": [
            {"factor": factor, "mean_failed": float(unit[np.isnan(column), k].mean()), "mean_all": float(unit[:, k].mean()),
             "p_value": 1e-6 if factor in ("M", "tau_d") else 0.4}
            for k, factor in enumerate(NAMES)
        ] if failed else [],
        "surrogate": {"q2": 0.991, "kernel": "matern52", "trend": "linear", "nugget": 0.0,
                      "length_scales": dict.fromkeys(NAMES, 2.0), "status": "ok"},
        "sobol": {
            factor: {"S1": variance[k] / total, "S1_ci": [max(0.0, variance[k] / total - 0.015), variance[k] / total + 0.015],
                     "ST": (variance[k] + interaction[k]) / total,
                     "ST_ci": [(variance[k] + interaction[k]) / total * 0.93, (variance[k] + interaction[k]) / total * 1.07]}
            for k, factor in enumerate(NAMES)
        },
        "sobol_bounded": {
            end: {factor: {"S1": 0.9 * variance[k] / total, "ST": shift * (variance[k] + interaction[k]) / total}
                  for k, factor in enumerate(NAMES)}
            for end, shift in (("low", 0.85), ("high", 1.2))
        } if failed else {},
        "rank_agreement": 0.956,
    }  # fmt: skip


def _morris(mu: float, sigma: float, rng: np.random.Generator) -> dict[str, Any]:
    mu_star, sigma = abs(mu) * (1.0 + 0.05 * rng.random()), sigma * (1.0 + 0.2 * rng.random())
    return {
        "mu": mu, "mu_star": mu_star, "sigma": sigma, "distance": math.hypot(mu_star, sigma),
        "mu_star_ci": [mu_star - 0.4 * sigma, mu_star + 0.4 * sigma], "sigma_ci": [0.75 * sigma, 1.2 * sigma],
    }  # fmt: skip


def _levels(values: np.ndarray) -> dict[str, Any]:
    failed = float(np.isnan(values[:, 0]).mean())
    zeta = values[:, 3]
    first = float((zeta >= 0.35).mean())
    whole = {"n": len(values), "failed": failed, "level_3": 0.0, "outside": 0.0}
    damped = {**whole, "level_1": first, "level_2": 1.0 - failed - first, "level_1_ci": [first - 0.04, first + 0.04]}
    return {
        "attitude_quickness": {
            "n": len(values), "level_1": 0.0, "level_2": 0.0, "level_3": 0.0, "outside": 1.0 - failed, "failed": failed,
            "level_1_ci": [0.0, 0.0073], "extrapolated": {"level_1": 1.0 - failed, "level_2": 0.0, "level_3": 0.0},
        },
        "dynamic_stability": damped,
        "bandwidth": {**whole, "level_1": 1.0 - failed, "level_2": 0.0, "level_1_ci": [0.95, 0.99]},
        "worst": damped,
        "confidence": {
            "attitude_quickness": "medium: digitised from a secondary source",
            "dynamic_stability": "medium; the line zeta = 0.35 is high",
            "bandwidth": "medium",
        },
    }  # fmt: skip


def _validity() -> dict[str, Any]:
    entry = {
        "alpha_min_deg": -4.2, "alpha_max_deg": 11.8, "C_D_min": 0.004, "negative_drag_runs": 0, "alpha_outside_runs": 3,
        "beta_outside_runs": 0, "saturated_runs": 12, "n": 500,
    }  # fmt: skip
    return {**entry, "attitude_quickness": entry, "dynamic_stability": {**entry, "alpha_outside_runs": 0}}
