"""Rows of the report's tables: text, in the units of the field; the template only lays them out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from levelone.handling.levels import Level
from levelone.report import symbols
from levelone.report.charts import Charts
from levelone.report.formatting import interval, number, percent, percent_interval
from levelone.report.results import CRITERIA, Results

LEVEL_WORDS = {
    Level.UNDEFINED: "undefined",
    Level.OUTSIDE: "outside the requirement's range",
    Level.LEVEL_1: "Level 1",
    Level.LEVEL_2: "Level 2",
    Level.LEVEL_3: "Level 3",
}
NO_LEVEL = ("omega_bw", "tau_p", "delta_theta_pk", "overshoot")
"""Responses beside those that the requirement reads."""

_VALIDITY = (
    ("alpha_min_deg", "smallest incidence, deg"),
    ("alpha_max_deg", "largest incidence, deg"),
    ("C_D_min", "smallest drag coefficient"),
    ("negative_drag_runs", "runs with negative drag"),
    ("alpha_outside_runs", "runs with incidence outside the stated validity"),
    ("beta_outside_runs", "runs with sideslip outside the stated validity"),
    ("saturated_runs", "runs with a saturated rotor"),
    ("n", "runs"),
)


def nominal_levels(results: Results, charts: Charts) -> dict[str, str]:
    """Level of the nominal vehicle in each criterion, in words."""
    nominal = {name: float(entry["nominal"]) for name, entry in results.responses.items()}
    quickness, extended = charts.attitude_quickness.levels(nominal["delta_theta_min"], nominal["quickness"])
    bandwidth, beyond = charts.bandwidth.levels(nominal["tau_p_attitude"], nominal["omega_bw_attitude"])
    damping = charts.dynamic_stability.levels(nominal["omega_n"], nominal["zeta"])
    return {
        "attitude_quickness": _in_words(int(quickness), int(extended)),
        "dynamic_stability": _in_words(int(damping), int(damping)),
        "bandwidth": _in_words(int(bandwidth), int(beyond)),
    }


def _in_words(level: int, extended: int) -> str:
    text = LEVEL_WORDS[Level(level)]
    return f"{text} ({LEVEL_WORDS[Level(extended)]} by the extended boundary)" if level == Level.OUTSIDE else text


def summary_rows(results: Results, levels: Mapping[str, str]) -> list[dict[str, Any]]:
    """One row for each response: nominal value, Level, spread, failures, quality of the surrogate."""
    rows = []
    for name, entry in results.responses.items():
        scale, unit = symbols.field_unit(entry["unit"])
        sample = entry["monte_carlo"]
        rows.append({
            "title": symbols.title(name), "symbol": symbols.html(name), "unit": unit or "1",
            "nominal": number(scale * entry["nominal"]), "status": entry["status"],
            "level": "no Level: not what the requirement reads" if name in NO_LEVEL else levels.get(entry["criterion"], ""),
            "mean": number(scale * sample["mean"]), "std": number(scale * sample["std"], 3),
            "range": interval([scale * sample["p05"], scale * sample["p95"]], 4),
            "failed": f"{sample['failed']} of {sample['n']}", "cautions": sum(entry["cautions"].values()),
            "q2": _quality(entry["surrogate"]["q2"]), "surrogate": entry["surrogate"]["status"],
            "agreement": number(entry["rank_agreement"], 3),
        })  # fmt: skip
    return rows


def _quality(q2: float) -> str:
    """Q2 near one by what it lacks."""
    return f"1 − {number(1.0 - q2, 2)}" if 0.9995 < q2 < 1.0 else number(q2)


def level_rows(levels: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Shares of Levels for each criterion and for the worst of them."""
    rows = []
    further = ["translational_rate"] if "translational_rate" in levels else []
    for criterion in (*CRITERIA, "worst", *further):
        entry = levels[criterion]
        extended = entry.get("extrapolated")
        rows.append({
            "title": symbols.CRITERION_TITLES[criterion], "n": entry["n"],
            "shares": [percent(entry[key]) for key in ("level_1", "level_2", "level_3", "outside", "failed")],
            "interval": percent_interval(entry["level_1_ci"]),
            "extended": [percent(extended[f"level_{k}"]) for k in (1, 2, 3)] if extended else [],
            "confidence": levels["confidence"].get(criterion, ""),
        })  # fmt: skip
    return rows


def index_rows(entry: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Screening and Sobol indices of one response, largest total index first."""
    scale, _ = symbols.field_unit(entry["unit"])
    bounded = entry.get("sobol_bounded") or {}
    rows = []
    for factor in sorted(entry["sobol"], key=lambda name: _descending(entry["sobol"][name]["ST"])):
        effect, index = entry["morris"][factor], entry["sobol"][factor]
        rows.append({
            "symbol": symbols.html(factor), "mu": number(scale * effect["mu"], 3), "mu_star": number(scale * effect["mu_star"], 3),
            "mu_star_ci": interval([scale * end for end in effect["mu_star_ci"]], 2), "sigma": number(scale * effect["sigma"], 3),
            "S1": number(index["S1"], 3), "S1_ci": interval(index["S1_ci"], 2), "ST": number(index["ST"], 3),
            "ST_ci": interval(index["ST_ci"], 2),
            "bounds": interval([bounded["low"][factor]["ST"], bounded["high"][factor]["ST"]], 3) if bounded else "",
        })  # fmt: skip
    return rows


def _descending(value: float) -> float:
    return math.inf if math.isnan(value) else -value


def failure_rows(results: Results) -> list[dict[str, Any]]:
    """What failed, why, and where in the factor box; cautions beside."""
    rows = []
    for name, entry in results.responses.items():
        known = [item for item in entry["failure_corner"] if not math.isnan(item["p_value"])]
        corner = sorted(known, key=lambda item: item["p_value"])[:3]
        rows.append({
            "title": symbols.title(name), "symbol": symbols.html(name),
            "failed": f"{entry['monte_carlo']['failed']} of {entry['monte_carlo']['n']}", "screening": entry["morris_failed"],
            "failures": list(entry["failures"].items()), "cautions": list(entry["cautions"].items()),
            "corner": [
                {"symbol": symbols.html(item["factor"]), "failed": number(item["mean_failed"], 2),
                 "all": number(item["mean_all"], 2), "p": number(item["p_value"], 2)}
                for item in corner
            ],
        })  # fmt: skip
    return rows


def validity_rows(validity: Mapping[str, Any]) -> tuple[list[str], list[tuple[str, list[str]]]]:
    """Extremes of the runs: titles of the columns, and for each quantity its values."""
    columns = {"All runs": validity}
    columns |= {symbols.CRITERION_TITLES[name]: validity[name] for name in CRITERIA if name in validity}
    rows = [(text, [number(entry[key]) if key in entry else "" for entry in columns.values()]) for key, text in _VALIDITY]
    return list(columns), rows


def numerics_rows(results: Results) -> list[dict[str, Any]]:
    """Change of each nominal value with the numerics, in its unit and as a part of the value."""
    rows = []
    for name, entry in results.summary["numerics"].items():
        response = results.responses[name]
        scale, unit = symbols.field_unit(response["unit"])
        nominal = float(response["nominal"])

        def change(key: str, entry: Mapping[str, Any] = entry, scale: float = scale, nominal: float = nominal) -> str:
            value = float(entry[key])
            if math.isnan(value):
                return entry.get(f"{key}_status") or number(value)
            part = f" ({number(100.0 * value / nominal, 2)} %)" if nominal and not math.isnan(nominal) else ""
            return number(scale * value, 2) + part

        rows.append({
            "title": symbols.title(name), "symbol": symbols.html(name), "unit": unit or "1", "half_step": change("half_step"),
            "window": change("window"), "finer_table": change("finer_table"),
        })  # fmt: skip
    return rows


def nominal_rows(nominal: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Further figures of the nominal vehicle: dominant pole, trim, and what else the study left."""
    pole, trim = nominal["dominant_pole"], nominal["trim"]
    sign = "+" if pole["imag"] >= 0.0 else "−"
    rows = [
        ("dominant pole, rad/s", f"{number(pole['real'])} {sign} {number(abs(pole['imag']))} i"),
        ("its natural frequency and damping ratio", f"{number(pole['omega_n'])} rad/s, {number(pole['zeta'])}"),
        ("pitch attitude in trim, deg", number(math.degrees(trim["theta"]))),
        ("throttle of the rotors in trim", ", ".join(number(value, 3) for value in trim["throttle"])),
    ]
    rest = {key: value for key, value in nominal.items() if isinstance(value, float | int)}
    return rows + [(f"{key} (SI)", number(float(value))) for key, value in rest.items()]
