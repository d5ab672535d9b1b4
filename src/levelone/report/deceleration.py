"""Deceleration to hover in the report: performance and its shares, and predicted handling qualities of the same runs beside it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from levelone.report import symbols
from levelone.report.deceleration_figures import draw_histories, draw_plane
from levelone.report.formatting import interval, number, percent, percent_interval
from levelone.report.pictures import Picture, file_name
from levelone.report.results import Results, read_group

MEASURES = {
    "overshoot": "Overshoot past the hover point",
    "position": "Distance from it during the hold",
    "height": "Height change",
    "lateral": "Lateral track",
    "heading": "Heading change",
    "time": "Time to capture",
    "theta": "Pitch attitude change",
}
SHORT = {
    "overshoot": "Overshoot", "position": "Position", "height": "Height", "lateral": "Track", "heading": "Heading", "time": "Time",
    "theta": "Attitude",
}  # fmt: skip
"""Heads of narrow columns."""
PERFORMANCE = {"desired": "desired", "adequate": "adequate", "not_adequate": "not adequate", "failed": "undefined"}
LEVELS = {
    "level_1": "Level 1", "level_2": "Level 2", "level_3": "Level 3", "outside": "outside the requirement’s range",
    "failed": "undefined",
}  # fmt: skip
STRONG = 0.5
"""Magnitude of a rank correlation that the table prints bold."""
SHOWN = 4
"""Factors named for each measure."""
ROUNDING = 1e-9
"""Part of its adequate tolerance below which a measure is printed as 0: a symmetric aircraft drifts by rounding only."""
_UNITS = {"gain": "1/s", "lead": "s", "delay": "s", "deceleration": "m/s²", "reverse": "m/s"}


def context(results: Results) -> dict[str, Any] | None:
    """Tables of the manoeuvre; None where the study flew none."""
    given = results.summary.get("deceleration")
    if not given:
        return None
    return {
        "pilot": [(name, number(value), _UNITS[name]) for name, value in given["pilot"].items()],
        "hover_speed": given["hover_speed"], "hold": given["hold"], "duration": given["duration"],
        "assumed": [(entry["field"], entry["why"]) for entry in given["assumed"]],
        "runs": [_run(results, given, run) for run in given["runs"]],
        "strong": number(STRONG, 2), "predicted_at": number(results.summary["study"]["trim_speed"]),
    }  # fmt: skip


def pictures(results: Results) -> list[Picture]:
    """Time history of each speed, and then the plane of each."""
    given = results.summary.get("deceleration") or {"runs": []}
    histories, planes = [], []
    for run in given["runs"]:
        data = read_group(results.directory / "deceleration_histories.nc", run["group"])
        name, speed = file_name(run["group"]), number(run["speed"])
        histories.append(
            Picture(f"deceleration_history_{name}", "deceleration",
                    f"Deceleration from {speed} m/s, flown by the pilot model: nominal vehicle, and Monte Carlo runs "
                    "by their severity (largest measure as a part of its adequate tolerance). Bands: tolerances of attitude, "
                    "height and position. Upright lines: first command to decelerate, and capture, of the nominal flight.",
                    False, partial(draw_histories, data, given["tolerances"])))  # fmt: skip
        planes.append(
            Picture(f"deceleration_plane_{name}", "deceleration",
                    f"Decelerations from {speed} m/s as ground speed against distance to go, flown from left to right. "
                    "The right panel shows the hover point (+), with the boxes of position and speed where it counts as held.",
                    True, partial(draw_plane, data, given["tolerances"], given["hover_speed"])))  # fmt: skip
    return histories + planes


def _run(results: Results, given: Mapping[str, Any], run: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "speed": number(run["speed"]), "distance": number(run["distance"]),
        "performance": PERFORMANCE[run["performance"]],
        "shares": _shares(run["shares"]), "n": run["shares"]["n"],
        "measures": [_measure(given["tolerances"], run, name) for name in MEASURES],
        "beside": _beside(results, run, given["tolerances"]["adequate"]),
        "levels": _levels(run["levels"]),
        "factors": [_factors(name, entry) for name, entry in run["responses"].items() if "sobol" in entry],
        "outcomes": _outcomes(run["responses"]),
        "reach": {name: number(value, 3) for name, value in run["reach"].items()},
    }  # fmt: skip


def _shares(shares: Mapping[str, Any]) -> list[dict[str, str]]:
    """Share and interval of each performance."""
    return [{"share": percent(shares[key]["share"]), "ci": percent_interval(shares[key]["ci"])} for key in PERFORMANCE]


def _measure(tolerances: Mapping[str, Mapping[str, float]], run: Mapping[str, Any], name: str) -> dict[str, Any]:
    entry = run["responses"][name]
    scale, unit = symbols.field_unit(entry["unit"])
    nominal, low, high, largest = _shown(entry, tolerances["adequate"][name])
    return {
        "title": MEASURES[name], "unit": unit,
        "desired": number(scale * tolerances["desired"][name], 3), "adequate": number(scale * tolerances["adequate"][name], 3),
        "nominal": number(nominal, 3), "verdict": PERFORMANCE[run["measure_performance"][name]],
        "range": interval([low, high], 3), "largest": number(largest, 3),
        "shares": [percent(run["measure_shares"][name][key]["share"]) for key in PERFORMANCE],
    }  # fmt: skip


def _shown(entry: Mapping[str, Any], adequate: float) -> list[float]:
    """Nominal value, 5 %, 95 % and largest of a measure in the unit of the field; 0 for what is rounding."""
    scale, sample = symbols.field_unit(entry["unit"])[0], entry["monte_carlo"]
    values = (entry["nominal"], sample["p05"], sample["p95"], sample["max"])
    return [0.0 if abs(value) < ROUNDING * adequate else scale * value for value in values]


def _beside(results: Results, run: Mapping[str, Any], adequate: Mapping[str, float]) -> dict[str, Any]:
    """Predicted qualities in rows, measures in columns: nominal values, ranges, and the rank correlation of the same runs."""
    rho = run["rank_correlation"]
    moved = [name for name in MEASURES if not all(math.isnan(value) for value in rho[name].values())]
    rows = []
    for response, entry in results.responses.items():
        scale, unit = symbols.field_unit(entry["unit"])
        sample = entry["monte_carlo"]
        rows.append({
            "title": symbols.title(response), "symbol": symbols.html(response), "unit": unit or "1",
            "nominal": number(scale * entry["nominal"], 3), "range": interval([scale * sample["p05"], scale * sample["p95"]], 3),
            "rho": [{"text": number(rho[name][response], 2), "strong": abs(rho[name][response]) >= STRONG} for name in moved],
        })  # fmt: skip
    heads = [_head(run["responses"][name], name, adequate[name]) for name in moved]
    pairs = [count for name in moved for count in run["rank_pairs"][name].values()]
    return {
        "measures": heads, "rows": rows, "still": [MEASURES[name].lower() for name in MEASURES if name not in moved],
        "chance": number(2.0 / math.sqrt(min(pairs)), 2) if pairs and min(pairs) else "",
    }  # fmt: skip


def _head(entry: Mapping[str, Any], name: str, adequate: float) -> dict[str, str]:
    unit = symbols.field_unit(entry["unit"])[1]
    nominal, low, high, _ = _shown(entry, adequate)
    return {"title": f"{SHORT[name]}, {unit}", "nominal": number(nominal, 3), "range": interval([low, high], 3)}


def _levels(crossed: Mapping[str, Mapping[str, Mapping[str, int]]]) -> list[dict[str, Any]]:
    """Runs by Level of each predicted quality and by performance; Levels that no run has are left out."""
    rows = []
    for criterion, block in crossed.items():
        title = symbols.CRITERION_TITLES.get(criterion, criterion)
        for level, counts in block.items():
            if sum(counts.values()):
                rows.append({"title": title, "level": LEVELS[level], "counts": [counts[key] for key in PERFORMANCE]})
                title = ""
    return rows


def _factors(name: str, entry: Mapping[str, Any]) -> dict[str, Any]:
    """The factors with the largest total indices; what the surrogate says where it has none."""
    known = {factor: index["ST"] for factor, index in entry["sobol"].items() if not math.isnan(index["ST"])}
    first: Sequence[str] = sorted(known, key=lambda factor: -known[factor])[:SHOWN]
    return {
        "title": MEASURES[name], "q2": number(entry["surrogate"]["q2"], 3), "status": entry["surrogate"]["status"],
        "factors": [{"symbol": symbols.html(factor), "ST": number(known[factor], 2),
                     "ci": interval(entry["sobol"][factor]["ST_ci"], 2)} for factor in first],
    }  # fmt: skip


def _outcomes(responses: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Failures and cautions in words, each with the number of runs and the measures that it concerns."""
    found: dict[tuple[str, str, int], list[str]] = {}
    for name, entry in responses.items():
        for kind in ("failures", "cautions"):
            for text, count in entry[kind].items():
                found.setdefault((kind, text, count), []).append(MEASURES[name].lower())
    return [
        {"kind": "undefined" if kind == "failures" else "caution: the value stands", "text": text, "runs": count,
         "measures": "all measures" if len(names) == len(responses) else ", ".join(names)}
        for (kind, text, count), names in found.items()
    ]  # fmt: skip
