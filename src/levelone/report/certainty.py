"""How far the surrogates can be trusted, and what other measures of sensitivity say of the same runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from levelone.campaign.analysis import CORRELATED
from levelone.report import style, symbols
from levelone.report.formatting import interval, number, percent
from levelone.report.pictures import Picture
from levelone.report.results import Results, read_group

FILE = "surrogates.nc"
_MARGINS = style.Margins(left=0.42, top=0.46, between=0.5, beside=0.3)
_DOT: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 1.7, "markeredgewidth": 0.0, "color": style.BLUE}
_LINE: dict[str, Any] = {"color": style.VERMILLION, "linewidth": 0.8, "linestyle": "--"}
_REACH = 4.5
"""Standardised residuals beyond this are drawn on the edge."""


def context(results: Results) -> dict[str, Any] | None:
    """Tables of the surrogates' validation and of the other measures; None where the results hold none."""
    measures = results.summary.get("measures")
    if not measures:
        return None
    return {
        "samples": results.summary["study"]["method"]["samples"],
        "refused": CORRELATED.removeprefix("refused: ") if results.summary["study"].get("correlations") else "",
        "correlations": [_pair(each) for each in results.summary["study"].get("correlations", [])],
        "rows": [_validation(results, name) for name in measures],
        "tables": [_measures(results, name) for name in measures],
    }


def pictures(results: Results) -> list[Picture]:
    """Standardised leave-one-out residuals, one panel for each response."""
    if not results.summary.get("measures"):
        return []
    caption = (
        "Standardised leave-one-out residuals of the surrogates against the value left out, in units of its standard deviation: "
        "95 % should lie between the lines, without a trend. Those beyond the frame are drawn on its edge."
    )
    return [Picture("certainty", "certainty", caption, True, partial(draw_residuals, read_group(results.directory / FILE)))]


def draw_residuals(data: xr.Dataset) -> Figure:
    """Panels of residuals, the responses in the order of the file."""
    names = [str(name) for name in data["response"].values]
    columns = min(4, len(names))
    rows = -(-len(names) // columns)
    figure, axes = style.sheet(style.PAGE, 0.86 + 1.25 * rows + 0.5 * (rows - 1), rows, columns, margins=_MARGINS)
    for panel, name in zip(axes.flat, names, strict=False):
        _panel(panel, name, data.sel(response=name))
    for panel in axes.flat[len(names) :]:
        panel.set_axis_off()
    for row in axes:
        row[0].set_ylabel("residual / its std")
    for panel in axes[-1]:
        panel.set_xlabel("value, standardised")
    style.key(figure, [Line2D([], [], **_DOT, label="run left out"), Line2D([], [], **_LINE, label="95 %")], columns=2)
    return figure


def _panel(panel: Axes, name: str, data: xr.Dataset) -> None:
    panel.set_title(symbols.axis_label(name, "1"), y=1.0)
    value, residual, std = (data[key].values for key in ("value", "loo_residual", "loo_std"))
    with np.errstate(invalid="ignore", divide="ignore"):
        across, up = (value - np.nanmean(value)) / np.nanstd(value), residual / std
    seen = np.isfinite(across) & np.isfinite(up)
    if not seen.any():
        panel.text(0.5, 0.5, "no surrogate", transform=panel.transAxes, ha="center", va="center")
    panel.plot(across[seen], np.clip(up[seen], -_REACH, _REACH), **_DOT)
    for end in (-1.96, 1.96):
        panel.axhline(end, **_LINE)
    panel.set_ylim(-1.05 * _REACH, 1.05 * _REACH)
    style.grid(panel)


def _pair(each: Mapping[str, Any]) -> str:
    return f"{' and '.join(each['factors'])} {number(each['rank'], 2)} ({each['source']})"


def _validation(results: Results, name: str) -> dict[str, Any]:
    surrogate, chaos = results.responses[name]["surrogate"], results.summary["measures"][name]["chaos"]
    checked = surrogate["validation"]
    return {
        "title": symbols.title(name), "symbol": symbols.html(name), "q2": number(1.0 - surrogate["q2"], 2),
        "holdout": number(1.0 - checked["q2_holdout"], 2), "coverage": percent(checked["coverage_95"]),
        "verdict": checked["verdict"],
        "chaos": number(1.0 - chaos["q2"], 2), "terms": chaos["terms"], "apart": number(_apart(results, name), 2),
    }  # fmt: skip


def _apart(results: Results, name: str) -> float:
    """Largest difference of ST between both surrogates."""
    other = results.summary["measures"][name]["chaos"]["rows"]
    gaps = [abs(row["ST"] - other[factor]["ST"]) for factor, row in results.responses[name]["sobol"].items()]
    known = [gap for gap in gaps if math.isfinite(gap)]
    return max(known) if known else math.nan


def _measures(results: Results, name: str) -> dict[str, Any]:
    found, sobol = results.summary["measures"][name], results.responses[name]["sobol"]
    order = sorted(sobol, key=lambda factor: -np.nan_to_num(found["shapley"]["rows"][factor]["Sh"], nan=-1.0))
    words = [f"{title}: {found[key]['status']}" for key, title in _TITLES.items() if found[key]["status"] != "ok"]
    return {
        "title": symbols.title(name), "symbol": symbols.html(name), "failed": found["failed"], "words": words,
        "rows": [_row(factor, sobol[factor], found) for factor in order],
    }  # fmt: skip


_TITLES = {"given_data": "S1 from the runs", "dependence": "dependence", "shapley": "Shapley effects", "chaos": "polynomial chaos"}


def _row(factor: str, sobol: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    given, seen, effect = (found[key]["rows"][factor] for key in ("given_data", "dependence", "shapley"))
    return {
        "symbol": symbols.html(factor), "S1": number(sobol["S1"], 3),
        "given": number(given["S1"], 3), "given_ci": interval(given["S1_ci"]),
        "Sh": number(effect["Sh"], 3), "Sh_ci": interval(effect["Sh_ci"]),
        "R2": number(seen["R2"], 3), "p": number(seen["p_value"], 2),
    }  # fmt: skip
