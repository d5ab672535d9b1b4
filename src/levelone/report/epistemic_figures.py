"""Probability boxes of the responses, and shares of Levels with their bounds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from levelone.report import style, symbols

FloatArray = NDArray[np.float64]

COLUMNS = 3
LEVELS = ("level_1", "level_2", "level_3", "outside", "failed")
TITLES = {"level_1": "Level 1", "level_2": "Level 2", "level_3": "Level 3", "outside": "outside the range", "failed": "undefined"}
_BOX: dict[str, Any] = {"facecolor": "#d6e6f2", "linewidth": 0.0, "zorder": 1}
_EDGE: dict[str, Any] = {"color": style.BLUE, "linewidth": 0.9, "zorder": 3}
_FLOWN: dict[str, Any] = {"color": style.VERMILLION, "linewidth": 0.8, "linestyle": (0, (3, 1.5)), "zorder": 3.5}
_PLAIN: dict[str, Any] = {"color": style.BLACK, "linewidth": 0.9, "zorder": 4}
_NOMINAL: dict[str, Any] = {"color": style.GREY, "linewidth": 0.7, "linestyle": (0, (1, 1.5)), "zorder": 2}
_COLOURS = {**dict(zip(LEVELS, ("#a9d6c3", "#f0d98a", "#ecb394"), strict=False)), "outside": "#cfcfcf", "failed": "#cfcfcf"}
_TICK: dict[str, Any] = {"color": style.VERMILLION, "linestyle": "none", "marker": "|", "markersize": 9, "markeredgewidth": 1.1,
                         "zorder": 4}  # fmt: skip
_DOT: dict[str, Any] = {"color": style.BLACK, "linestyle": "none", "marker": "o", "markersize": 3.2, "zorder": 5}


def draw_boxes(entries: Mapping[str, Mapping[str, Any]], nominal: Mapping[str, float]) -> Figure:
    """The box of every response as two step curves, the plain distribution between them, and the nominal value.

    Parameters
    ----------
    entries
        ``responses`` of the section.
    nominal
        Value of the nominal vehicle by response, in the unit of the response.
    """
    rows = -(-len(entries) // COLUMNS)
    margins = style.Margins(left=0.5, bottom=0.22, top=0.5, between=0.46, beside=0.3)
    figure, axes = style.sheet(style.PAGE, 0.72 + 1.4 * rows + 0.46 * (rows - 1), rows, COLUMNS, margins=margins)
    for panel, (name, entry) in zip(axes.flat, entries.items(), strict=False):
        _box(panel, name, entry, nominal.get(name, np.nan))
    for panel in axes.flat[len(entries) :]:
        panel.set_axis_off()
    for panel in axes[:, 0]:
        panel.set_ylabel("share of runs below")
    handles = [
        Patch(**_BOX, label="box, on the surrogates"),
        Line2D([], [], **_FLOWN, label="its ends where flown"),
        Line2D([], [], **_PLAIN, label="plain: uniform, Monte Carlo"),
        Line2D([], [], **_NOMINAL, label="nominal vehicle"),
    ]
    style.key(figure, handles, columns=len(handles))
    return figure


def _box(panel: Axes, name: str, entry: Mapping[str, Any], nominal: float) -> None:
    scale, _ = symbols.field_unit(entry["unit"])
    z = scale * np.asarray(entry["thresholds"], dtype=np.float64)
    lower, upper, low_flown, high_flown, plain = (
        np.asarray(entry[key], dtype=np.float64) for key in ("lower", "upper", "lower_flown", "upper_flown", "sample")
    )
    # between two thresholds the box is as wide as they leave it: the lower curve keeps its last value, the upper has its next
    panel.fill_between(np.repeat(z, 2)[1:-1], np.repeat(lower, 2)[:-2], np.repeat(upper, 2)[2:], **_BOX)
    panel.plot(z, lower, drawstyle="steps-post", **_EDGE)
    panel.plot(z, upper, drawstyle="steps-pre", **_EDGE)
    panel.plot(z, low_flown, drawstyle="steps-post", **_FLOWN)
    panel.plot(z, high_flown, drawstyle="steps-pre", **_FLOWN)
    panel.plot(z, plain, **_PLAIN)
    if np.isfinite(nominal):
        panel.axvline(scale * nominal, **_NOMINAL)
    if entry["status"] != "ok":
        panel.text(0.5, 0.5, "no surrogate to be trusted", transform=panel.transAxes, ha="center", va="center", fontsize=7)
    panel.set(xlim=_limits(z, lower, upper, scale * nominal), ylim=(-0.03, 1.03))
    panel.set_title(symbols.axis_label(name, entry["unit"]), y=1.0)
    style.grid(panel)


def _limits(z: FloatArray, lower: FloatArray, upper: FloatArray, nominal: float) -> tuple[float, float]:
    """Where the box has not closed yet, with the nominal value."""
    inside = np.flatnonzero((upper > 0.0) & (lower < 1.0))
    first, last = (max(inside[0] - 1, 0), min(inside[-1] + 1, len(z) - 1)) if len(inside) else (0, len(z) - 1)
    ends = [float(z[first]), float(z[last]), *([nominal] if np.isfinite(nominal) else [])]
    margin = 0.02 * (max(ends) - min(ends))
    return min(ends) - margin, max(ends) + margin


def draw_levels(levels: Mapping[str, Mapping[str, Mapping[str, float]]]) -> Figure:
    """Share of each Level and criterion from its lower to its upper bound, with the bounds flown and the plain share.

    Parameters
    ----------
    levels
        ``levels`` of the section; Levels that no run of any criterion can have are left out.
    """
    shown = [
        key for key in LEVELS if any(block[key]["upper"] > 0.0 or block[key]["upper_flown"] > 0.0 for block in levels.values())
    ]
    margins = style.Margins(left=1.5, bottom=0.38, top=0.5, beside=0.14)
    figure, axes = style.sheet(style.PAGE, 0.88 + 0.24 * len(levels), 1, max(len(shown), 1), margins=margins, sharey=True)
    place = np.arange(len(levels), dtype=np.float64)
    for panel, key in zip(axes[0], shown, strict=False):
        blocks = [block[key] for block in levels.values()]
        lower, upper, plain = (100.0 * np.array([block[end] for block in blocks]) for end in ("lower", "upper", "sample"))
        # a bound without width is still seen: half a percent of the axis
        panel.barh(place, np.maximum(upper - lower, 1.0), left=np.minimum(lower, 99.0), height=0.5, color=_COLOURS[key], zorder=2)
        for end in ("lower_flown", "upper_flown"):
            panel.plot([100.0 * block[end] for block in blocks], place, **_TICK)
        panel.plot(plain, place, **_DOT)
        panel.set(xlim=(-4.0, 104.0), ylim=(len(levels) - 0.5, -0.5), xticks=[0, 25, 50, 75, 100])
        panel.set_title(TITLES[key])
        panel.set_xlabel("share of runs, %")
        panel.tick_params(axis="y", length=0.0)
        style.grid(panel, "x")
    axes[0, 0].set_yticks(place, [symbols.CRITERION_TITLES[name] for name in levels])
    handles: list[Any] = [
        Patch(facecolor="#cfcfcf", label="between lower and upper share, on the surrogates"),
        Line2D([], [], **_TICK, label="the same, flown"),
        Line2D([], [], **_DOT, label="plain: uniform, Monte Carlo"),
    ]
    style.key(figure, handles, columns=len(handles))
    return figure
