"""Sobol indices of the model itself beside those on surrogates: the surrogate's error is a result of its own."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from levelone.campaign.direct import FILE, SCHEMA
from levelone.errors import InputError
from levelone.report import style, symbols
from levelone.report.formatting import interval, number, percent
from levelone.report.pictures import Picture
from levelone.report.results import Results

_DIRECT: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.2, "markeredgewidth": 0.0, "color": style.BLUE}
_SURROGATE: dict[str, Any] = {
    "linestyle": "none", "marker": "s", "markersize": 3.4, "markeredgewidth": 0.8, "markerfacecolor": "white",
    "color": style.VERMILLION,
}  # fmt: skip
_MARGINS = style.Margins(left=0.36, top=0.46, between=0.45, beside=0.42)
_APART = 0.17
"""Rows by which the two marks of a factor stand above and below its line."""
OTHER_STUDY = "this decomposition belongs to another version of the study or of the vehicle: decompose again"


def context(results: Results) -> dict[str, Any] | None:
    """Tables of both kinds of indices; None where the folder holds no direct decomposition."""
    found = direct_results(results)
    if found is None:
        return None
    stale = outdated(results, found)
    checked = found["against_whole_records"]
    return {
        "outdated": stale,
        "base_points": found["base_points"],
        "scramblings": found["scramblings"],
        "runs": found["runs"],
        "widest": number(found["widest"], 3),
        "minutes": number(found["cost"]["wall_s"] / 60.0, 2),
        "memory": number(found["cost"]["peak_memory_gib"], 2),
        "checked": checked["runs"],
        "largest_difference": number(checked["largest_difference"], 2),
        "statuses_differ": checked["statuses_differ"],
        "grouped": bool(found["groups"]),
        "samples": results.summary["study"]["method"]["samples"],
        "rows": [] if stale else [_summary(results, found, name) for name in found["responses"]],
        "tables": [] if stale else [_table(results, found, name) for name in found["responses"]],
    }


def pictures(results: Results) -> list[Picture]:
    """Total indices of both kinds, one panel for each response."""
    found = direct_results(results)
    if found is None or outdated(results, found):
        return []
    caption = (
        "Total Sobol indices with 95 % intervals: of the flight simulation model itself (dots; intervals from independent "
        f"scramblings), and on the surrogates trained with {results.summary['study']['method']['samples']} runs (squares)."
    )
    return [Picture("direct", "direct", caption, True, partial(draw_direct, results, found))]


def direct_results(results: Results) -> dict[str, Any] | None:
    """Content of ``direct.json``; None where there is no such file.

    Raises
    ------
    InputError
        It cannot be read, or was written under another schema.
    """
    path = results.directory / FILE
    if not path.is_file():
        return None
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(str(path), f"cannot be read: {error}") from error
    if not isinstance(found, dict) or found.get("schema") != SCHEMA:
        raise InputError(str(path), f"has another schema than {SCHEMA}: decompose again")
    return found


def outdated(results: Results, found: Mapping[str, Any]) -> str:
    """Why the decomposition is not of this study; empty where it is."""
    keys = ("study_sha256", "vehicle_sha256")
    return "" if all(found[key] == results.summary["provenance"].get(key) for key in keys) else OTHER_STUDY


def draw_direct(results: Results, found: Mapping[str, Any]) -> Figure:
    """Panels of total indices, largest on top."""
    entries = found["responses"]
    columns = min(3, len(entries))
    rows = -(-len(entries) // columns)
    height = 0.71 + rows * (0.25 + 0.165 * len(found["names"])) + 0.25 * (rows - 1)
    figure, axes = style.sheet(style.PAGE, height, rows, columns, margins=_MARGINS)
    for panel, (name, entry) in zip(axes.flat, entries.items(), strict=False):
        _panel(panel, name, entry["sobol"], _surrogate(results, found, name))
    for panel in axes.flat[len(entries) :]:
        panel.set_axis_off()
    for panel in axes[-1]:
        panel.set_xlabel("share of the variance, $S_T$")
    handles = [Line2D([], [], **_DIRECT, label="model itself"), Line2D([], [], **_SURROGATE, label="on the surrogate")]
    style.key(figure, handles, columns=2)
    return figure


def _panel(panel: Axes, name: str, direct: Mapping[str, Any], surrogate: Mapping[str, Any]) -> None:
    panel.set_title(symbols.axis_label(name, "1"), y=1.0)
    factors = sorted(direct, key=lambda factor: (not np.isfinite(direct[factor]["ST"]), -direct[factor]["ST"]))
    place = np.arange(len(factors), dtype=np.float64)
    for rows, shift, look in ((direct, -_APART, _DIRECT), (surrogate, _APART, _SURROGATE)):
        shown = [j for j, factor in enumerate(factors) if factor in rows and math.isfinite(rows[factor]["ST"])]
        value = np.array([rows[factors[j]]["ST"] for j in shown])
        ends = np.array([rows[factors[j]]["ST_ci"] for j in shown]).reshape(-1, 2)
        panel.hlines(place[shown] + shift, ends[:, 0], ends[:, 1], color=look["color"], linewidth=0.8)
        panel.plot(value, place[shown] + shift, **look)
    panel.set_yticks(place, [symbols.mathtext(factor) for factor in factors])
    panel.set_ylim(len(factors) - 0.4, -0.6)
    panel.tick_params(axis="y", length=0.0)
    style.grid(panel, "x")


def _surrogate(results: Results, found: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Indices on the surrogate of a response; none where groups were decomposed."""
    entry = results.responses.get(name)
    return {} if entry is None or found["groups"] else entry["sobol"]


def _summary(results: Results, found: Mapping[str, Any], name: str) -> dict[str, Any]:
    """How far the indices on the surrogate are from those of the model."""
    entry, other = found["responses"][name], _surrogate(results, found, name)
    gaps = {key: _largest_gap(entry["sobol"], other, key) for key in ("S1", "ST")}
    inside = [_meets(row["ST_ci"], other[factor]["ST_ci"]) for factor, row in entry["sobol"].items() if factor in other]
    return {
        "title": symbols.title(name), "symbol": symbols.html(name), "S1": number(gaps["S1"], 2), "ST": number(gaps["ST"], 2),
        "inside": f"{sum(inside)} of {len(inside)}" if inside else "not comparable",
        "failed": f"{entry['failed']} of {found['runs']}", "share": percent(entry["failed"] / found["runs"]),
        "doubt": entry["doubt"] or "none",
    }  # fmt: skip


def _meets(first: list[float], second: list[float]) -> bool:
    """Whether two intervals have a point in common; False where one is undefined."""
    return first[0] <= second[1] and second[0] <= first[1]


def _largest_gap(direct: Mapping[str, Any], other: Mapping[str, Any], key: str) -> float:
    gaps = [abs(row[key] - other[factor][key]) for factor, row in direct.items() if factor in other]
    known = [gap for gap in gaps if math.isfinite(gap)]
    return max(known) if known else math.nan


def _table(results: Results, found: Mapping[str, Any], name: str) -> dict[str, Any]:
    entry, other = found["responses"][name], _surrogate(results, found, name)
    rows = []
    for factor, row in sorted(entry["sobol"].items(), key=lambda item: -np.nan_to_num(item[1]["ST"], nan=-1.0)):
        cells = {f"{key}{ci}": (interval if ci else number)(row[f"{key}{ci}"], 3) for key in ("S1", "ST") for ci in ("", "_ci")}
        beside = other.get(factor)
        cells |= (
            {"surrogate": number(beside["ST"], 3), "surrogate_ci": interval(beside["ST_ci"])}
            if beside
            else {"surrogate": "", "surrogate_ci": ""}
        )
        rows.append({"symbol": symbols.html(factor), **cells})
    pairs = [
        {
            "pair": Markup(" × ").join(map(symbols.html, pair["pair"])),
            "S2": number(pair["S2"], 3),
            "ci": interval(pair["S2_ci"]),
        }
        for pair in entry.get("S2", [])[:5]
    ]
    return {"title": symbols.title(name), "symbol": symbols.html(name), "status": entry["status"], "rows": rows, "pairs": pairs}
