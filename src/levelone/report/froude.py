"""Shares of Levels at limits scaled to the vehicle's size, beside those of full-scale aircraft."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from levelone.handling.froude import froude_scaled
from levelone.handling.levels import DEFAULT, Boundaries, load_boundaries
from levelone.report import regions, style, symbols
from levelone.report.formatting import number, percent, percent_interval
from levelone.report.level_names import name_layers, name_sectors
from levelone.report.pictures import Picture
from levelone.report.results import Results

FloatArray = NDArray[np.float64]

DEG = 180.0 / math.pi
_KEYS = ("level_1", "level_2", "level_3", "outside", "failed")
_ROWS = ("attitude_quickness", "dynamic_stability", "bandwidth", "worst", "translational_rate")
_RUNS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 2.2, "markeredgewidth": 0.0, "color": style.BLUE,
                         "alpha": 0.55, "zorder": 3}  # fmt: skip
_FULL: dict[str, Any] = {"color": style.GREY, "linewidth": 0.8, "linestyle": ":", "zorder": 2.3}
_MARGINS = style.Margins(left=0.5, bottom=0.58, top=0.34, beside=0.64)


def context(results: Results) -> dict[str, Any] | None:
    """Both sets of shares, row by row; None where the study gives no lengths."""
    given = results.summary.get("levels_froude")
    if not given:
        return None
    return {
        "length": number(given["length"]), "reference_length": number(given["reference_length"]), "basis": given["basis"],
        "scale": number(given["scale"]),
        "rows": [_row(key, results.summary["levels"], given) for key in _ROWS if key in given and key in results.summary["levels"]],
    }  # fmt: skip


def pictures(results: Results) -> list[Picture]:
    """The Monte Carlo runs on the planes with scaled limits."""
    if not results.summary.get("levels_froude"):
        return []
    caption = (
        "Monte Carlo runs on the planes of the standard with Froude-scaled limits; dotted, the limits of full-scale aircraft. "
        "Damping is limited by a ratio, which scaling leaves as it is."
    )
    return [Picture("froude", "froude", caption, True, partial(draw_froude, results))]


def _row(key: str, full: Mapping[str, Any], scaled: Mapping[str, Any]) -> dict[str, Any]:
    def cells(entry: Mapping[str, Any]) -> dict[str, Any]:
        extended = entry.get("extrapolated")
        return {
            "shares": [percent(entry[name]) for name in _KEYS], "interval": percent_interval(entry["level_1_ci"]),
            "extended": [percent(extended[f"level_{k}"]) for k in (1, 2, 3)] if extended else [],
        }  # fmt: skip

    sets = (("full scale", full), ("scaled", scaled))
    return {
        "title": symbols.CRITERION_TITLES[key], "n": full[key]["n"], "confidence": scaled["confidence"].get(key, ""),
        "sets": [{"text": text, **cells(entry[key])} for text, entry in sets],
    }  # fmt: skip


def draw_froude(results: Results) -> Figure:
    """Quickness, damping and bandwidth (on attitude) with the scaled regions, and dotted the limits they come from."""
    given, study = results.summary["levels_froude"], results.summary["study"]
    full = load_boundaries(study.get("boundaries", DEFAULT))
    scaled = froude_scaled(full, given["length"], given["reference_length"])
    figure, axes = style.sheet(style.PAGE, 2.75, 1, 3, margins=_MARGINS)
    _quickness(axes[0, 0], results, full, scaled)
    _stability(axes[0, 1], results, scaled)
    _bandwidth(axes[0, 2], results, full, scaled, study.get("task", "all_other"))
    handles = [
        Line2D([], [], **_RUNS, label="Monte Carlo runs"),
        Line2D([], [], **regions.UNVERIFIED, label="scaled limit, unverified"),
        Line2D([], [], **_FULL, label="limit of full-scale aircraft"),
    ]
    style.key(figure, handles, columns=3)
    basis = f"Rates times {given['scale']:.3g}, times divided by it: {given['length']:g} m against {given['reference_length']:g} m."
    style.note(figure, [basis])
    return figure


def _quickness(panel: Axes, results: Results, full: Boundaries, scaled: Boundaries) -> None:
    chart, before = (each.chart("attitude_quickness", "pitch") for each in (scaled, full))
    cloud = np.column_stack([DEG * results.sample("delta_theta_min"), results.sample("quickness")])
    top = np.nanmax([*cloud[:, 1], 1.3 * chart.level_1_2[:, 1].max()])
    panel.set(xlim=(0.0, DEG * chart.high), ylim=(0.0, 1.15 * float(top)))
    panel.set_xlabel(symbols.axis_label("delta_theta_min", "rad"))
    panel.set_ylabel(symbols.axis_label("quickness", "1/s"))
    regions.shade_chart(panel, chart, DEG, sideways=False)
    _full_lines(panel, DEG * before.level_1_2[:, 0], before.level_1_2[:, 1], before.level_2_3[:, 1])
    _draw_runs(panel, cloud)
    name_layers(panel, chart, [cloud])


def _stability(panel: Axes, results: Results, scaled: Boundaries) -> None:
    cloud = regions.pole(results.sample("omega_n"), results.sample("zeta"))
    both = np.vstack([cloud, [[-1.0, 1.0], [1.0, 1.0]]])
    panel.set(xlim=(1.3 * float(np.nanmin(both[:, 0])), 1.3 * float(np.nanmax(both[:, 0]))))
    panel.set_ylim(0.0, 1.2 * float(np.nanmax(both[:, 1])))
    panel.set_xlabel(r"$-\zeta\,\omega_n$, rad/s")
    panel.set_ylabel(r"damped frequency $\omega_d$, rad/s")
    regions.shade_damping(panel, scaled.dynamic_stability)
    _draw_runs(panel, cloud)
    name_sectors(panel, scaled.dynamic_stability, [cloud])


def _bandwidth(panel: Axes, results: Results, full: Boundaries, scaled: Boundaries, task: str) -> None:
    chart, before = (each.chart("bandwidth", task) for each in (scaled, full))
    cloud = np.column_stack([results.sample("omega_bw_attitude"), results.sample("tau_p_attitude")])
    right = np.nanmax([*cloud[:, 0], 1.5 * chart.level_1_2[:, 1].max()])
    panel.set(xlim=(0.0, 1.1 * float(right)), ylim=(0.0, 1.2 * float(np.nanmax([*cloud[:, 1], chart.high]))))
    panel.set_xlabel(symbols.axis_label("omega_bw_attitude", "rad/s"))
    panel.set_ylabel(r"$\tau_p$, s")
    regions.shade_chart(panel, chart, 1.0, sideways=True)
    for line in (before.level_1_2, before.level_2_3):
        panel.plot(line[:, 1], line[:, 0], **_FULL, scalex=False, scaley=False)
    _draw_runs(panel, cloud)
    regions.name_level(panel, 1, [(0.8, 0.3), (0.8, 0.7), (0.5, 0.5)], (cloud,))


def _full_lines(panel: Axes, x: FloatArray, *lines: FloatArray) -> None:
    for y in lines:
        panel.plot(x, y, **_FULL, scalex=False, scaley=False)


def _draw_runs(panel: Axes, cloud: FloatArray) -> None:
    panel.plot(*cloud.T, **_RUNS, scalex=False, scaley=False, label="_runs")
