"""The response of the ground speed to its step: the criterion that fits a velocity-command aircraft."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from levelone.handling.froude import froude_scaled
from levelone.handling.levels import DEFAULT, Boundaries, load_boundaries
from levelone.handling.limits import increasing_pair
from levelone.handling.translation import RISE
from levelone.report import regions, style, symbols, tables
from levelone.report.formatting import number, percent, percent_interval
from levelone.report.pictures import Picture, sensitivity
from levelone.report.results import Results, attribute

CRITERION = "translational_rate"
_GUIDE: dict[str, Any] = {"color": style.GREY, "linewidth": 0.5, "linestyle": (0, (1.5, 1.5)), "zorder": 1}
_ARROW: dict[str, Any] = {"arrowstyle": "<->", "linewidth": 0.7, "color": style.VERMILLION, "shrinkA": 0, "shrinkB": 0,
                          "mutation_scale": 6}  # fmt: skip
_RUNS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 2.2, "markeredgewidth": 0.0, "color": style.BLUE,
                         "alpha": 0.55, "zorder": 3}  # fmt: skip
_NOMINAL: dict[str, Any] = {"linestyle": "none", "marker": "D", "markersize": 4.6, "markerfacecolor": style.ORANGE,
                            "markeredgecolor": style.BLACK, "markeredgewidth": 0.7, "zorder": 6}  # fmt: skip
_SCALED: dict[str, Any] = {"color": style.BLACK, "linewidth": 0.9, "linestyle": ":", "zorder": 2.2}


def context(results: Results) -> dict[str, Any] | None:
    """Limits, share of Level 1 and indices; None where the results hold no such responses."""
    entries = results.of(CRITERION)
    if not entries:
        return None
    boundaries = _boundaries(results)
    low, high = _limits(boundaries)
    limits, shares = boundaries.limits[CRITERION], results.summary["levels"].get(CRITERION)
    return {
        "low": number(low), "high": number(high), "source": limits.get("source", ""), "note": limits.get("note", ""),
        "confidence": limits.get("confidence", "not stated"), "rise": percent(RISE),
        "nominal": nominal_level(results), "level_1": percent(shares["level_1"]) if shares else "",
        "interval": percent_interval(shares["level_1_ci"]) if shares else "",
        "indices": [(symbols.title(name), symbols.html(name), symbols.field_unit(entry["unit"])[1], tables.index_rows(entry))
                    for name, entry in entries.items()],
    }  # fmt: skip


def nominal_levels(results: Results) -> dict[str, str]:
    """Level of the nominal vehicle by the criterion's name; empty for results without it."""
    return {CRITERION: nominal_level(results)} if results.of(CRITERION) else {}


def nominal_level(results: Results) -> str:
    """Level of the nominal vehicle, in words."""
    rise_time = float(results.responses["rise_time"]["nominal"])
    low, high = _limits(_boundaries(results))
    if math.isnan(rise_time):
        return "undefined"
    return "Level 1" if low <= rise_time <= high else "Level 2 at best"


def pictures(results: Results) -> list[Picture]:
    """History, Monte Carlo runs against the limits, and what moves them."""
    if not results.of(CRITERION):
        return []
    return [
        Picture(f"history_{CRITERION}", CRITERION, "Step in longitudinal speed: equivalent rise time and overshoot of the speed.",
                False, partial(draw_history, results)),
        Picture(f"plane_{CRITERION}", CRITERION,
                "Monte Carlo runs in overshoot and rise time. Only the rise time has limits; outside them no better than Level 2.",
                False, partial(draw_plane, results)),
        *sensitivity(results, CRITERION),
    ]  # fmt: skip


def draw_history(results: Results) -> Figure:
    """The nominal speed with what was read of it, Monte Carlo runs faint behind."""
    data = results.histories["attitude_quickness"]
    figure, axes = style.sheet(style.COLUMN, 2.5, margins=style.Margins(top=0.3))
    panel, time, on = axes[0, 0], data["time"].values, attribute(data, "input_on")
    speed, command = data["V_lon"].values, data["V_lon_ref"].values[0]
    for trace in speed[1:]:
        panel.plot(time, trace, color=style.FAINT, linewidth=0.35, alpha=0.7, zorder=1.5)
    panel.plot(time, speed[0], color=style.BLUE, zorder=3, label="nominal")
    panel.plot(time, command, color=style.BLACK, linewidth=0.8, linestyle=(0, (4, 1.5)), zorder=2, label="command")
    panel.set(xlim=(max(float(time[0]), on - 0.5), float(time[-1])), xlabel=r"$t$, s", ylabel=r"$V_{\mathrm{lon}}$, m/s")
    panel.margins(y=0.12)
    style.grid(panel)
    _readings(panel, results, on, float(command[0]), float(command[-1] - command[0]))
    style.key(figure, panel.get_legend_handles_labels()[0], columns=2)
    return figure


def _readings(panel: Axes, results: Results, on: float, trim: float, change: float) -> None:
    """Rise time as a dimension line, and the height of the overshoot; nothing where the criterion found none."""
    rise, over = (float(results.responses[name]["nominal"]) for name in ("rise_time", "overshoot"))
    if math.isfinite(rise):
        level = trim + RISE * change
        panel.axhline(level, **_GUIDE)
        panel.annotate("", (on, level), xytext=(on + rise, level), arrowprops=_ARROW)
        text = f"{symbols.mathtext('rise_time')} = {rise:.3g} s"
        panel.annotate(text, (on + rise, level), xytext=(5, -3), textcoords="offset points", va="top")
    if over > 0.0:
        peak = trim + (1.0 + over) * change
        panel.axhline(peak, **_GUIDE)
        beside: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points"}
        panel.annotate(f"overshoot {percent(over)}", (1.0, peak), xytext=(-4, 2), ha="right", va="bottom", **beside)


def draw_plane(results: Results) -> Figure:
    """Overshoot over rise time, with the range of Level 1; dotted the one scaled to the vehicle's size, where lengths are given."""
    cloud = np.column_stack([results.sample("rise_time"), 100.0 * results.sample("overshoot")])
    nominal = {name: float(entry["nominal"]) for name, entry in results.of(CRITERION).items()}
    boundaries, given = _boundaries(results), results.summary.get("levels_froude")
    low, high = _limits(boundaries)
    figure, axes = style.sheet(style.COLUMN, 3.0, margins=style.Margins(bottom=0.62, top=0.46, left=0.45))
    panel = axes[0, 0]
    top = float(np.nanmax([*cloud[:, 1], 100.0 * nominal["overshoot"], 5.0]))
    panel.set(xlim=(0.0, 1.25 * float(np.nanmax([*cloud[:, 0], nominal["rise_time"], high]))), ylim=(0.0, 1.25 * top))
    panel.set_xlabel(symbols.axis_label("rise_time", "s"))
    panel.set_ylabel(f"{symbols.mathtext('overshoot')}, %")
    panel.axvspan(*panel.get_xlim(), color=style.LEVEL_COLOURS[1], linewidth=0.0, zorder=0.4)
    panel.axvspan(low, high, color=style.LEVEL_COLOURS[0], linewidth=0.0, zorder=0.5)
    confirmed = boundaries.limits[CRITERION].get("confidence") == "high"
    look = regions.boundary_style(confirmed)
    handles = [Line2D([], [], **_RUNS, label="Monte Carlo runs"), Line2D([], [], **_NOMINAL, label="nominal")]
    handles.append(Line2D([], [], **look, label="limit, confirmed" if confirmed else "limit, unverified"))
    _verticals(panel, (low, high), look)
    if given:
        _verticals(panel, _limits(froude_scaled(boundaries, given["length"], given["reference_length"])), _SCALED)
        handles.append(Line2D([], [], **_SCALED, label="limit scaled to this size"))
    panel.plot(*cloud.T, **_RUNS, scalex=False, scaley=False, label="_runs")
    panel.plot(nominal["rise_time"], 100.0 * nominal["overshoot"], **_NOMINAL, scalex=False, scaley=False, label="_nominal")
    regions.name_level(panel, 1, [(0.5 * (low + high) / panel.get_xlim()[1], 0.93)], (cloud,))
    style.key(figure, handles, columns=2)
    style.note(figure, [_count(cloud), "Limits are those of full-scale piloted helicopters in hover and low speed."])
    return figure


def _verticals(panel: Axes, places: tuple[float, float], look: dict[str, Any]) -> None:
    for place in places:
        panel.axvline(place, **look)


def _count(cloud: np.ndarray) -> str:
    missing = int((~np.isfinite(cloud).all(axis=1)).sum())
    return (
        f"{missing} of {len(cloud)} Monte Carlo runs are undefined and not drawn." if missing else f"{len(cloud)} Monte Carlo runs."
    )


def _boundaries(results: Results) -> Boundaries:
    return load_boundaries(results.summary["study"].get("boundaries", DEFAULT))


def _limits(boundaries: Boundaries) -> tuple[float, float]:
    return increasing_pair(boundaries, CRITERION, ("rise_time_level_1",))
