"""Epistemic factors in the report: probability boxes, and Level shares as intervals beside those of the plain treatment."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from levelone.report import symbols
from levelone.report.epistemic_figures import LEVELS, TITLES, draw_boxes, draw_levels
from levelone.report.formatting import interval, number, percent, percent_interval
from levelone.report.pictures import Picture
from levelone.report.results import Results

_VISITED = {"corner": "corners", "latin hypercube": "points of Latin hypercubes", "refinement": "neighbours of what was found"}


def context(results: Results) -> dict[str, Any] | None:
    """Tables of the section; None where the study has no epistemic factors to be treated as such."""
    given = results.summary.get("epistemic")
    if not given:
        return None
    boxes = given["boxes"]
    return {
        "factors": [symbols.html(name) for name in given["factors"]],
        "aleatory": [symbols.html(name) for name in given["aleatory"]],
        "basis": given["basis"], "outer": given["outer"], "inner": given["inner"], "flown_runs": given["flown_runs"],
        "error": percent(0.5 / given["inner"] ** 0.5), "points": sum(given["points"].values()),
        "visited": [(count, _VISITED[text], percent(given["extremes_by"][text])) for text, count in given["points"].items()],
        "boxes": [_box(box, boxes) for box in boxes] if len(boxes) > 1 else [],
        "levels": [row for name, block in given["levels"].items() for row in _levels(name, block)],
        "rows": [_row(name, entry) for name, entry in given["responses"].items()],
        "flown": [_flown(given, point) for point in given["flown"]],
    }  # fmt: skip


def pictures(results: Results) -> list[Picture]:
    """Shares of Levels, and the boxes of all responses."""
    given = results.summary.get("epistemic")
    if not given:
        return []
    nominal = {name: entry["nominal"] for name, entry in results.responses.items()}
    return [
        Picture("epistemic_levels", "epistemic",
                "Share of each Level: bars from the lower to the upper share over the epistemic factors, on the surrogates; marks, "
                "the bounds among the points that were flown; dots, the one share that comes out when they are taken as uniform.",
                True, partial(draw_levels, given["levels"])),
        Picture("epistemic_boxes", "epistemic",
                "Probability boxes: the distribution functions found over the epistemic factors lie between the two step curves. "
                "The box of the points flown (dashed) rests on fewer of them. The line is the distribution of the plain treatment.",
                True, partial(draw_boxes, given["responses"], nominal)),
    ]  # fmt: skip


def _box(box: Mapping[str, Any], boxes: list[Mapping[str, Any]]) -> dict[str, Any]:
    """Mass of a combination of focal intervals, and the intervals in which it differs from others."""
    differs = [name for name in box["low"] if len({(each["low"][name], each["high"][name]) for each in boxes}) > 1]
    parts = [(symbols.html(name), interval([box["low"][name], box["high"][name]], 4)) for name in differs]
    return {"mass": number(box["mass"], 3), "parts": parts}


def _levels(name: str, block: Mapping[str, Mapping[str, float]]) -> list[dict[str, Any]]:
    """The Levels of one criterion that some run has or could have."""
    rows: list[dict[str, Any]] = []
    for key in LEVELS:
        share = block[key]
        if max(share["upper"], share["upper_flown"], share["sample"]) > 0.0:
            rows.append({
                "title": symbols.CRITERION_TITLES[name] if not rows else "", "level": TITLES[key],
                "plain": percent(share["sample"]), "on_surrogates": percent(share["plain"]),
                "bounds": percent_interval([share["lower"], share["upper"]]),
                "flown": percent_interval([share["lower_flown"], share["upper_flown"]]),
            })  # fmt: skip
    return rows


def _row(name: str, entry: Mapping[str, Any]) -> dict[str, Any]:
    scale, unit = symbols.field_unit(entry["unit"])

    def shown(ends: list[float]) -> str:
        return interval([scale * end for end in ends], 4)

    return {
        "title": symbols.title(name), "symbol": symbols.html(name), "unit": unit,
        "plain": number(scale * entry["mean_plain"]), "mean": shown(entry["mean"]), "mean_flown": shown(entry["mean_flown"]),
        "median": shown(entry["quantiles"]["p50"]), "range": shown(entry["range"]),
        "difference": percent(entry["difference"]), "failed": percent(entry["failed_flown"][1]),
        "q2": number(entry["q2"], 4), "status": entry["status"],
    }  # fmt: skip


def _flown(given: Mapping[str, Any], point: Mapping[str, Any]) -> dict[str, Any]:
    """A point that was flown, as places within its box."""
    box = given["boxes"][point["box"]]
    places = []
    for name, value in point["values"].items():
        low, high = box["low"][name], box["high"][name]
        at = (value - low) / (high - low) if high > low else 0.0
        places.append({0.0: "low", 1.0: "high"}.get(round(at, 6), number(at, 2)))
    return {
        "box": point["box"] + 1, "origin": point["origin"], "places": places,
        "difference": percent(point["level_difference"]), "failed": percent(point["failed"]),
    }  # fmt: skip
