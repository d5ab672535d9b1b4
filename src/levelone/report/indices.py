"""Sobol indices: what each factor explains alone, and with all its interactions."""

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

_FIRST: dict[str, Any] = {"color": style.BLUE, "linewidth": 0.0}
_TOTAL: dict[str, Any] = {"facecolor": "white", "edgecolor": style.BLUE, "linewidth": 0.7}
_WHISKER: dict[str, Any] = {"fmt": "none", "elinewidth": 0.7, "capsize": 1.4, "capthick": 0.6}
_LETTER = 0.062
"""in: width of a letter of a factor that has no symbol."""
_VISIBLE = 0.02
"""Part of the largest ST from which a bounding value is drawn: below it, marks would only hide the bar."""
_BOUND: dict[str, Any] = {"linestyle": "none", "marker": "|", "markersize": 6.0, "markeredgewidth": 1.0, "color": style.VERMILLION}


def draw_indices(entries: Mapping[str, Any]) -> Figure:
    """Bars of S1 (filled) and ST (outlined) with their intervals, one panel for each response, largest ST on top."""
    count = len(entries)
    columns = 3 if count == 3 else min(count, 2)
    rows = -(-count // columns)
    factors = max(len(entry["sobol"]) for entry in entries.values())
    width = style.COLUMN if count == 1 else style.PAGE
    height = 0.55 + rows * (0.25 + 0.155 * factors) + 0.25 * (rows - 1)
    figure, axes = style.sheet(width, height, rows, columns, margins=_margins(entries))
    bounded = False
    for panel, (name, entry) in zip(axes.flat, entries.items(), strict=False):
        bounded |= _bars(panel, name, entry)
    for panel in axes.flat[count:]:
        panel.set_axis_off()
    for panel in axes[-1]:
        panel.set_xlabel("share of the variance")
    handles: list[Any] = [Patch(**_FIRST, label="$S_1$, alone"), Patch(**_TOTAL, label="$S_T$, with all interactions")]
    if bounded:
        handles.append(Line2D([], [], **_BOUND, label="$S_T$ with undefined runs at the smallest / largest value"))
    style.key(figure, handles, columns=len(handles))
    return figure


def _margins(entries: Mapping[str, Any]) -> style.Margins:
    """Room for the names of the factors beside their bars."""
    names = {factor for entry in entries.values() for factor in entry["sobol"]}
    longest = max((len(name) for name in names if symbols.mathtext(name) == name), default=0)
    room = min(_LETTER * longest, 1.2) + 0.06
    return style.Margins(left=max(0.36, room), top=0.46, between=0.45, beside=max(0.42, room + 0.06))


def _bars(panel: Axes, name: str, entry: Mapping[str, Any]) -> bool:
    """One response; True where indices with undefined runs at bounding values are drawn too."""
    panel.set_title(symbols.axis_label(name, "1"), y=1.0)
    sobol = entry["sobol"]
    factors = sorted(sobol, key=lambda factor: (not np.isfinite(sobol[factor]["ST"]), -sobol[factor]["ST"]))
    first, total = (np.array([sobol[factor][key] for factor in factors], dtype=np.float64) for key in ("S1", "ST"))
    if not np.isfinite(total).any():
        panel.text(0.5, 0.5, f"undefined:\n{entry['surrogate']['status']}", transform=panel.transAxes, ha="center", va="center")
        panel.set(xticks=[], yticks=[])
        return False
    place = np.arange(len(factors), dtype=np.float64)
    panel.barh(place, total, height=0.74, **_TOTAL)
    panel.barh(place, first, height=0.74, **_FIRST, zorder=2)
    _whiskers(panel, place - 0.17, first, [sobol[factor]["S1_ci"] for factor in factors], style.BLACK)
    _whiskers(panel, place + 0.17, total, [sobol[factor]["ST_ci"] for factor in factors], style.GREY)
    bounds = entry.get("sobol_bounded") or {}
    if bounds:
        ends = np.array([[end[factor]["ST"] for factor in factors] for end in bounds.values()], dtype=np.float64)
        shown = np.nanmax(np.vstack([ends, total]), axis=0) > _VISIBLE * np.nanmax(total)
        for end in ends:
            panel.plot(end[shown], place[shown], **_BOUND, zorder=4)
    panel.set_yticks(place, [symbols.mathtext(factor) for factor in factors])
    panel.set_ylim(len(factors) - 0.4, -0.6)
    panel.tick_params(axis="y", length=0.0)
    lowest = np.nanmin([first, total, *np.array([[sobol[factor][key][0] for factor in factors] for key in ("S1_ci", "ST_ci")])])
    panel.set_xlim(min(0.0, 1.1 * float(lowest)), None)
    style.grid(panel, "x")
    return bool(bounds)


def _whiskers(panel: Axes, place: NDArray[Any], value: NDArray[Any], ends: list[Any], colour: str) -> None:
    low, high = np.array(ends, dtype=np.float64).T
    reach = np.clip(np.nan_to_num([value - low, high - value]), 0.0, None)
    panel.errorbar(value, place, xerr=reach, ecolor=colour, zorder=3, **_WHISKER)
