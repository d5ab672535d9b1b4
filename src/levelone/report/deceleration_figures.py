"""Decelerations to hover as time histories and in the plane of distance to go and ground speed, with the tolerances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from levelone.report import style
from levelone.report.results import attribute

FloatArray = NDArray[np.float64]
Tolerances = Mapping[str, Mapping[str, float]]

DEG = 180.0 / math.pi
DESIRED, ADEQUATE = style.LEVEL_COLOURS[:2]
_SEVERAL = 2.2
"""Adequate tolerances that the panels near the hover point reach to."""
_FASTEST = 15.0
"""Hover speeds that they show at most."""
_LOOKS: dict[str, dict[str, Any]] = {
    "nominal": {"color": style.BLUE, "linewidth": 1.1, "zorder": 4},
    "worst": {"color": style.VERMILLION, "linewidth": 0.9, "zorder": 3},
    "5 %": {"color": style.GREY, "linewidth": 0.7, "linestyle": (0, (1, 1)), "zorder": 2},
    "median": {"color": style.GREY, "linewidth": 0.7, "zorder": 2},
    "95 %": {"color": style.GREY, "linewidth": 0.7, "linestyle": (0, (5, 2)), "zorder": 2},
}
_COMMAND: dict[str, Any] = {"color": style.BLACK, "linewidth": 0.8, "linestyle": (0, (4, 1.5)), "zorder": 3.5}
_GUIDE: dict[str, Any] = {"color": style.GREY, "linewidth": 0.5, "linestyle": (0, (1.5, 1.5)), "zorder": 1.5}
_LIMIT: dict[str, Any] = {"color": style.GREY, "linewidth": 0.6, "linestyle": (0, (4, 2)), "zorder": 1.5}


def draw_histories(data: xr.Dataset, tolerances: Tolerances) -> Figure:
    """Ground speed with the pilot's command, attitude, height, and distance to go near the hover point, with their tolerances."""
    figure, axes = style.sheet(
        style.COLUMN, 5.2, 4, 1, sharex=True, height_ratios=(1.0, 1.0, 1.0, 1.3), margins=style.Margins(top=0.48)
    )
    top, attitude, height, near = axes[:, 0]
    time = data["time"].values
    trim = DEG * float(data["theta"].values[0, 0])
    handles = _traces(top, data, time, data["V_lon"].values)
    handles += top.plot(time, data["V_lon_ref"].values[0], **_COMMAND, label="command (nominal)")
    _traces(attitude, data, time, DEG * data["theta"].values)
    _traces(height, data, time, _change(data, "altitude"))
    _traces(near, data, time, to_go(data))
    for panel in (top, attitude, height):
        panel.margins(y=0.12)
    _band(attitude, tolerances, "theta", DEG, trim)
    _band(height, tolerances, "height")
    _band(near, tolerances, "position")
    _near(near.set_ylim, tolerances)
    for panel, text in zip(axes[:, 0], (r"$V_{\mathrm{lon}}$, m/s", r"$\theta$, deg", "height, m", "to go, m"), strict=True):
        panel.set_ylabel(text)
        style.grid(panel)
        for mark in ("start", "captured"):
            panel.axvline(float(data[mark].values[0]), **_GUIDE)
    _overshoot(near.axhline, near, tolerances)
    _names(top, data)
    near.set_xlabel(r"$t$, s")
    near.set_xlim(float(time[0]), float(time[-1]))
    style.key(figure, [*handles, *_patches()], columns=3)
    return figure


def draw_plane(data: xr.Dataset, tolerances: Tolerances, hover_speed: float) -> Figure:
    """Ground speed against distance to go, from left to right: the whole deceleration, and the neighbourhood of the hover point."""
    figure, axes = style.sheet(style.PAGE, 2.6, 1, 2, margins=style.Margins(top=0.48, beside=0.5))
    whole, near = axes[0]
    distance = to_go(data)
    for panel in (whole, near):
        handles = _traces(panel, data, distance, data["V_lon"].values)
        for standard, colour in (("adequate", ADEQUATE), ("desired", DESIRED)):
            half = tolerances[standard]["position"]
            box = Rectangle((-half, -hover_speed), 2.0 * half, 2.0 * hover_speed, facecolor=colour, edgecolor=style.GREY,
                            linewidth=0.4, zorder=1)  # fmt: skip
            panel.add_patch(box)
        panel.plot([0.0], [0.0], "+", color=style.BLACK, markersize=6, markeredgewidth=0.9, zorder=5)
        panel.axhline(0.0, **_GUIDE)
        panel.set_xlabel("distance to go, m")
        style.grid(panel)
    whole.set_ylabel(r"$V_{\mathrm{lon}}$, m/s")
    reach = float(attribute(data, "distance"))
    passed = np.append(distance[np.isfinite(distance)], -2.0 * tolerances["adequate"]["overshoot"]).min()
    whole.set_xlim(reach, float(passed) - 0.03 * reach)
    _near(near.set_xlim, tolerances, backwards=True)
    near.set_ylim(*_speeds_near(data, distance, tolerances, hover_speed))
    _overshoot(near.axvline, near, tolerances)
    style.key(figure, [*handles, *_patches()], columns=len(handles) + 2)
    return figure


def to_go(data: xr.Dataset) -> FloatArray:
    """Distance to go of every run, m, negative past the hover point."""
    return attribute(data, "distance") - _change(data, "x_north")


def _change(data: xr.Dataset, name: str) -> FloatArray:
    values = np.asarray(data[name].values, dtype=np.float64)
    return values - values[:, :1]


def _traces(panel: Axes, data: xr.Dataset, x: FloatArray, y: FloatArray) -> list[Any]:
    """All runs in one panel; ``x`` is [time] or [run, time]."""
    handles = []
    labels = [str(label) for label in data["label"].values]
    for run, label in enumerate(labels):
        text = label if label in ("nominal", "worst") else f"{label} in severity"
        handles += panel.plot(x if x.ndim == 1 else x[run], y[run], **_LOOKS[label], label=text)
    return handles


def _band(panel: Axes, tolerances: Tolerances, name: str, scale: float = 1.0, middle: float = 0.0) -> None:
    """Tolerances as bands behind the traces; the panel keeps the limits that the traces give it."""
    limits = panel.get_ylim()
    for standard, colour in (("adequate", ADEQUATE), ("desired", DESIRED)):
        half = scale * tolerances[standard][name]
        panel.axhspan(middle - half, middle + half, facecolor=colour, linewidth=0.0, zorder=0)
    panel.set_ylim(limits)


def _near(limit: Any, tolerances: Tolerances, backwards: bool = False) -> None:
    """Limits around the hover point in units of the tolerances there."""
    reach = _SEVERAL * max(tolerances["adequate"]["position"], tolerances["adequate"]["overshoot"])
    limit(*((reach, -reach) if backwards else (-reach, reach)))


def _speeds_near(data: xr.Dataset, distance: FloatArray, tolerances: Tolerances, hover_speed: float) -> tuple[float, float]:
    """Range of the speeds flown where the panel near the hover point looks; faster passes leave it, so that the boxes show."""
    reach = _SEVERAL * max(tolerances["adequate"]["position"], tolerances["adequate"]["overshoot"])
    flown = np.append(data["V_lon"].values[np.abs(distance) <= reach], [-hover_speed, 2.0 * hover_speed])
    low, high = np.clip([flown.min(), flown.max()], -_FASTEST * hover_speed, _FASTEST * hover_speed)
    return float(low - 0.08 * (high - low)), float(high + 0.08 * (high - low))


def _overshoot(line: Any, panel: Axes, tolerances: Tolerances) -> None:
    """Limits of overshoot as lines past the hover point."""
    for standard in ("desired", "adequate"):
        place = -tolerances[standard]["overshoot"]
        line(place, **_LIMIT)
        text = f"overshoot, {standard}"
        if line == panel.axvline:
            panel.annotate(text, (place, 0.97), xycoords=("data", "axes fraction"), xytext=(1.5, 0), textcoords="offset points",
                           rotation=90, ha="left", va="top", fontsize=7, color=style.GREY)  # fmt: skip
        else:
            panel.annotate(text, (0.985, place), xycoords=("axes fraction", "data"), xytext=(0, 1), textcoords="offset points",
                           ha="right", va="bottom", fontsize=7, color=style.GREY)  # fmt: skip


def _names(panel: Axes, data: xr.Dataset) -> None:
    """What the upright lines of the nominal flight stand for."""
    for mark, text, place, side in (("start", "first command", 0.04, "bottom"), ("captured", "captured", 0.95, "top")):
        moment = float(data[mark].values[0])
        if math.isfinite(moment):
            panel.annotate(text, (moment, place), xycoords=("data", "axes fraction"), xytext=(2, 0), textcoords="offset points",
                           ha="left", va=side, fontsize=7, color=style.GREY)  # fmt: skip


def _patches() -> list[Patch]:
    return [Patch(facecolor=colour, edgecolor=style.GREY, linewidth=0.4, label=text)
            for colour, text in ((DESIRED, "desired"), (ADEQUATE, "adequate"))]  # fmt: skip
