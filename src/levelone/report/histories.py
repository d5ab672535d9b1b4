"""Time histories of the manoeuvres, with what the criteria picked from them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from levelone.report import style
from levelone.report.results import attribute

FloatArray = NDArray[np.float64]

DEG = 180.0 / math.pi
_DRAWN = 700
"""Points of a trace: more than a printed column resolves."""
_BESIDE = 0.1
"""s: where a trace is looked at to tell a peak from a valley."""
_MARK: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 4.2,
    "markerfacecolor": "white",
    "markeredgecolor": style.VERMILLION,
    "markeredgewidth": 1.1,
    "zorder": 5,
}
_ARROW: dict[str, Any] = {
    "arrowstyle": "<->",
    "linewidth": 0.7,
    "color": style.VERMILLION,
    "shrinkA": 0,
    "shrinkB": 0,
    "mutation_scale": 6,
}
_GUIDE: dict[str, Any] = {"color": style.GREY, "linewidth": 0.5, "linestyle": (0, (1.5, 1.5)), "zorder": 1}


def draw_quickness(data: xr.Dataset) -> Figure:
    """Step in speed: first peak of the rate, peak of the attitude, second stationary point of the rate."""
    figure, (top, rate, attitude) = _records(data)
    t_q, t_theta, t_second = (attribute(data, name) for name in ("t_q_pk", "t_theta_pk", "t_second"))
    trim = DEG * float(data["theta"].values[0, 0])
    _mark(rate, data, t_q, r"$q_{\mathrm{pk}}$")
    _mark(rate, data, t_second, "second stationary point")
    _span(attitude, data, t_theta, r"$\Delta\theta_{\mathrm{pk}}$", -1)
    _span(attitude, data, t_second, r"$\Delta\theta_{\mathrm{min}}$", 1)
    if math.isfinite(t_second):
        for axes in (rate, attitude):
            axes.axvline(t_second, **_GUIDE)
    attitude.axhline(trim, **_GUIDE)
    _window(top, data, max(_finite(t_second, t_theta), attribute(data, "input_on")) + 3.0)
    return figure


def draw_stability(data: xr.Dataset) -> Figure:
    """Pulse in speed: first peak, first valley and second peak of the free rate."""
    figure, (top, rate, attitude) = _records(data)
    free = attribute(data, "t_free")
    for j, text in enumerate(("first peak", "first valley", "second peak")):
        _mark(rate, data, attribute(data, f"t_{j + 1}"), text)
    rate.axhline(0.0, **_GUIDE)
    attitude.axhline(DEG * float(data["theta"].values[0, 0]), **_GUIDE)
    for axes in (top, rate, attitude):
        axes.axvspan(attribute(data, "input_on"), free, color="#eeeeee", linewidth=0.0, zorder=0)
    top.text(free, 0.92, "  free response", transform=top.get_xaxis_transform(), va="top", color=style.GREY, fontsize=7.5)
    _window(top, data, _finite(attribute(data, "t_3"), free) + 2.0)
    return figure


def draw_sweep(data: xr.Dataset) -> Figure:
    """Frequency sweep of the nonlinear model, from which the swept response is estimated."""
    figure, (top, _, attitude) = _records(data, sweep=True)
    attitude.axhline(DEG * float(data["theta"].values[0, 0]), **_GUIDE)
    top.set_xlim(float(data["time"].values[0]), float(data["time"].values[-1]))
    return figure


def _records(data: xr.Dataset, *, sweep: bool = False) -> tuple[Figure, list[Axes]]:
    """Speed, pitch rate and attitude below each other; Monte Carlo runs faint behind the nominal one."""
    width = style.PAGE if sweep else style.COLUMN
    figure, axes = style.sheet(width, 3.6, 3, 1, sharex=True, height_ratios=(0.8, 1.0, 1.0), margins=style.Margins(top=0.3))
    top, rate, attitude = axes[:, 0]
    keep = slice(None, None, max(1, data.sizes["time"] // (4 * _DRAWN if sweep else _DRAWN)))
    time = data["time"].values[keep]
    for panel, name, scale in ((top, "V_lon", 1.0), (rate, "q", DEG), (attitude, "theta", DEG)):
        traces = scale * data[name].values[:, keep]
        for trace in traces[1:]:
            panel.plot(time, trace, color=style.FAINT, linewidth=0.35, alpha=0.7, zorder=1.5)
        panel.plot(time, traces[0], color=style.BLUE, linewidth=0.7 if sweep else 1.0, zorder=3, label="nominal")
        panel.margins(y=0.1 if panel is top else 0.22)
        style.grid(panel)
    command = {"color": style.ORANGE} if sweep else {"color": style.BLACK, "linestyle": (0, (4, 1.5))}
    top.plot(time, data["V_lon_ref"].values[0, keep], **command, linewidth=0.8, zorder=2, label="command")
    top.set_ylabel(r"$V_{\mathrm{lon}}$, m/s")
    rate.set_ylabel(r"$q$, deg/s")
    attitude.set_ylabel(r"$\theta$, deg")
    attitude.set_xlabel(r"$t$, s")
    _legend(figure, top, data.sizes["run"] - 1)
    return figure, [top, rate, attitude]


def _legend(figure: Figure, top: Axes, others: int) -> None:
    if others > 0:
        top.plot([], [], color=style.FAINT, linewidth=0.8, label=f"{others} Monte Carlo runs")
    style.key(figure, top.get_legend_handles_labels()[0], columns=3)


def _mark(axes: Axes, data: xr.Dataset, time: float, text: str) -> None:
    """A picked point of the rate and its name, on the outer side; nothing where the criterion found none."""
    if not math.isfinite(time):
        return
    value = DEG * _at(data, "q", time)
    axes.plot([time], [value], **_MARK)
    around = DEG * np.array([_at(data, "q", time - _BESIDE), _at(data, "q", time + _BESIDE)])
    up = value > np.mean(around)
    axes.annotate(
        text, (time, value), xytext=(0, 5 if up else -5), textcoords="offset points", ha="center", va="bottom" if up else "top",
        fontsize=8,
    )  # fmt: skip


def _span(axes: Axes, data: xr.Dataset, time: float, text: str, side: int) -> None:
    """A change of attitude as a dimension line from trim to the picked point."""
    if not math.isfinite(time):
        return
    trim, value = DEG * float(data["theta"].values[0, 0]), DEG * _at(data, "theta", time)
    axes.annotate("", (time, value), xytext=(time, trim), arrowprops=_ARROW)
    axes.plot([time], [value], **_MARK)
    above = value < trim
    axes.annotate(
        text, (time, trim), xytext=(side, 2 if above else -2), textcoords="offset points", va="bottom" if above else "top",
        ha="left" if side > 0 else "right", fontsize=8,
    )  # fmt: skip


def _at(data: xr.Dataset, name: str, time: float) -> float:
    """The nominal record at a time, straight between samples: where a mark goes, which thus lies on its trace."""
    return float(np.interp(time, data["time"].values, data[name].values[0]))


def _finite(*times: float) -> float:
    known = [time for time in times if math.isfinite(time)]
    return max(known) if known else 0.0


def _window(axes: Axes, data: xr.Dataset, end: float) -> None:
    """Show from shortly before the input to ``end``, so that the picked points fill the width."""
    time = data["time"].values
    axes.set_xlim(max(time[0], attribute(data, "input_on") - 0.5), min(time[-1], end))
