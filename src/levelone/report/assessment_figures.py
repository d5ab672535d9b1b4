"""Recorded runs with what the criteria picked from them, and the planes of the requirements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from levelone.campaign.assessment_tests import Reading
from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.history import TimeHistory
from levelone.handling.levels import Boundaries, Chart
from levelone.report import level_names, regions, style, symbols

FloatArray = NDArray[np.float64]

DEG = 180.0 / math.pi
_BINS = 350
"""Bins of a trace, each drawn by its smallest and its largest value: more than a column resolves."""
_SAME = 0.05
"""s: points of one channel nearer than this are one."""
_GAP = 0.02
"""Room between two records on the axis of time, as a fraction of both."""
_MARK: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.2, "markerfacecolor": "white",
                         "markeredgecolor": style.VERMILLION, "markeredgewidth": 1.1, "zorder": 5}  # fmt: skip
_POINT: dict[str, Any] = {"linestyle": "none", "marker": "D", "markersize": 4.6, "markeredgecolor": style.BLACK,
                          "markeredgewidth": 0.7, "zorder": 6}  # fmt: skip
_GUIDE: dict[str, Any] = {"color": style.GREY, "linewidth": 0.5, "linestyle": (0, (1.5, 1.5)), "zorder": 1}
_NAMES = {
    "rate_peak": "peak rate", "attitude_peak": "peak change", "second_point": "second stationary point",
    "first_peak": "first peak", "first_valley": "first valley", "second_peak": "second peak", "rise": "63 %", "largest": "largest",
}  # fmt: skip
_MARGINS = style.Margins(bottom=0.45, top=0.42, left=0.42)
_COLOURS = (style.BLUE, style.ORANGE)


def shown_channels(history: TimeHistory, axis: str) -> list[str]:
    """Channels of a figure of records, from top to bottom: the input, and what the axis is judged by."""
    wanted = ("V_vert", "altitude") if axis == "heave" else RATE_AND_ATTITUDE[axis]
    speed = history.input_name.removesuffix("_ref")
    extra = (speed,) if history.input_name in ("V_lon_ref", "V_lat_ref") else ()
    return [history.input_name, *(name for name in (*extra, *wanted) if name in history.channels)]


def draw_sweeps(histories: Sequence[TimeHistory], axis: str) -> Figure:
    """All sweeps, one after the other on one axis of time, with their names."""
    names = shown_channels(histories[0], axis)
    figure, axes = _stack(names, histories[0], style.PAGE)
    begin = 0.0
    for k, history in enumerate(histories):
        length = float(history.time[-1] - history.time[0])
        for panel, name in zip(axes, names, strict=True):
            scale = field_scale(history.units[name])
            time, values = _envelope(history.time - history.time[0] + begin, scale * history.channels[name][0])
            panel.plot(time, values, color=_COLOURS[0] if panel is not axes[0] else style.BLACK, linewidth=0.5)
            if k:
                panel.axvline(begin - 0.5 * _GAP * length, **_GUIDE)
        axes[0].text(begin, 1.02, _plain(history.name), transform=axes[0].get_xaxis_transform(), fontsize=7, color=style.GREY)
        begin += length * (1.0 + _GAP)
    axes[-1].set_xlabel("$t$, s, records one after the other")
    axes[-1].set_xlim(0.0, begin)
    return figure


def draw_run(history: TimeHistory, readings: Sequence[Reading], axis: str, reference: TimeHistory | None = None) -> Figure:
    """One step or pulse, with what was picked; the reference's run beside it, both counted from trim and from the input."""
    names = shown_channels(history, axis)
    figure, axes = _stack(names, history, style.COLUMN)
    for panel, name in zip(axes, names, strict=True):
        scale = field_scale(history.units[name])
        for each, colour in ((history, _COLOURS[0]), (reference, _COLOURS[1])):
            if each is None or name not in each.channels:
                continue
            time, values = _envelope(each.time - each.input_on, scale * each.change(name)[0])
            look = {"color": colour} if panel is not axes[0] or each is reference else {"color": style.BLACK}
            panel.plot(time, values, linewidth=0.9, zorder=3 if each is history else 2, **look)
        panel.axhline(0.0, **_GUIDE)
        panel.margins(y=0.42)
    panels = dict(zip(names, axes, strict=True))
    for (channel, time), words in _picks(history, readings, axis).items():
        _mark(panels[channel], history, channel, time, ", ".join(words))
    for free in {reading.times["free"] for reading in readings if "free" in reading.times}:
        for panel in axes:
            panel.axvspan(0.0, free - history.input_on, color="#eeeeee", linewidth=0.0, zorder=0)
    end = max([4.0 if math.isnan(history.input_off) else history.input_off - history.input_on + 3.0, *_latest(history, readings)])
    axes[-1].set_xlim(-0.5, min(end + 1.5, float(history.time[-1] - history.input_on)))
    axes[-1].set_xlabel("$t$ from the input, s")
    return figure


def _latest(history: TimeHistory, readings: Sequence[Reading]) -> list[float]:
    return [time - history.input_on for reading in readings for time in reading.times.values() if math.isfinite(time)]


def _picks(history: TimeHistory, readings: Sequence[Reading], axis: str) -> dict[tuple[str, float], list[str]]:
    """Channel and time of each picked point, and what the criteria call it: one point may serve several."""
    found: dict[tuple[str, float], list[str]] = {}
    for reading in readings:
        for name, time in reading.times.items():
            if name == "free" or not math.isfinite(time):
                continue
            if name == "rise":
                channel = history.input_name.removesuffix("_ref")
            elif name == "largest":
                channel = reading.title
            else:
                channel = RATE_AND_ATTITUDE[axis][1 if name == "attitude_peak" else 0]
            near = next((key for key in found if key[0] == channel and abs(key[1] - time) < _SAME), (channel, time))
            words = found.setdefault(near, [])
            if name != "largest" or not words:  # what has a name of its own needs not be called the largest as well
                words.append(_NAMES[name])
    return found


def _mark(panel: Axes, history: TimeHistory, channel: str, time: float, text: str) -> None:
    """A picked point and its name, on the outer side of the trace."""
    scale, change = field_scale(history.units[channel]), history.change(channel)[0]
    value, before, after = (scale * float(np.interp(at, history.time, change)) for at in (time, time - 0.1, time + 0.1))
    panel.plot([time - history.input_on], [value], **_MARK)
    up = value > 0.5 * (before + after)
    panel.annotate(
        text, (time - history.input_on, value), xytext=(0, 5 if up else -5), textcoords="offset points", ha="center",
        va="bottom" if up else "top", fontsize=7, linespacing=1.05,
    )  # fmt: skip


def draw_bandwidth_plane(points: Sequence[tuple[str, Sequence[Reading]]], chart: Chart) -> Figure:
    """Phase delay over bandwidth, with bars of 95 %; data in the first colour, reference in the second."""
    figure, panel = _plane()
    drawn = [reading for _, readings in points for reading in readings]
    right = max([2.6, *(1.3 * r.value("omega_bw").value for r in drawn if math.isfinite(r.value("omega_bw").value))])
    top = max([0.25, *(1.3 * r.value("tau_p").value for r in drawn if math.isfinite(r.value("tau_p").value))])
    panel.set(xlim=(0.0, right), ylim=(min(0.0, *(r.value("tau_p").value for r in drawn), 0.0), top))
    panel.set_xlabel(r"$\omega_{\mathrm{BW}}$, rad/s")
    panel.set_ylabel(r"$\tau_p$, s")
    regions.shade_chart(panel, chart, 1.0, sideways=True)
    spots = []
    for (name, readings), colour in zip(points, _COLOURS, strict=False):
        for reading, marker in zip(readings, ("D", "s", "o"), strict=False):
            omega, tau = reading.value("omega_bw"), reading.value("tau_p")
            if math.isfinite(omega.value) and math.isfinite(tau.value):
                errors = (each.half_width if math.isfinite(each.half_width) else 0.0 for each in (omega, tau))
                look = {**_POINT, "marker": marker, "markerfacecolor": colour}
                panel.errorbar([omega.value], [tau.value], *reversed([*errors]), ecolor=style.BLACK, elinewidth=0.7, **look,
                               label=_plain(f"{name}: {reading.title}"))  # fmt: skip
                spots.append((omega.value, tau.value))
    _named(panel, chart, np.array(spots).reshape(-1, 2))
    style.key(figure, panel.get_legend_handles_labels()[0], columns=min(len(points), 2))
    return figure


def _named(panel: Axes, chart: Chart, cloud: FloatArray) -> None:
    """Names of the Levels, side by side as the standard draws bandwidth."""
    right, top = panel.get_xlim()[1], panel.get_ylim()[1]
    height = 0.35 * min(chart.high, top) / top
    first, second = (float(limit) / right for limit in chart.limits(0.5 * chart.high))
    for level, across in ((1, 0.5 * (1.0 + first)), (2, 0.5 * (first + second)), (3, 0.5 * second)):
        regions.name_level(panel, level, [(across, height)], [cloud], rotation=90 if level > 1 else 0)


def draw_quickness_plane(points: Sequence[tuple[str, Sequence[Reading]]], chart: Chart) -> Figure:
    """Quickness over the smallest attitude change, all records."""
    figure, panel = _plane()
    clouds = [_cloud(readings) * [DEG, 1.0] for _, readings in points]
    both = np.vstack(clouds)
    high = np.nanmax(np.vstack([both, [[DEG * chart.high, 1.6 * chart.level_1_2[:, 1].max()]]]), axis=0)
    panel.set(xlim=(0.0, 1.05 * float(high[0])), ylim=(0.0, 1.1 * float(high[1])))
    symbol = points[0][1][0].values[1].name
    panel.set_xlabel(f"{symbols.mathtext(symbol)}, deg")
    panel.set_ylabel("quickness, 1/s")
    regions.shade_chart(panel, chart, DEG, sideways=False)
    _scatter(figure, panel, points, clouds)
    level_names.name_layers(panel, chart, clouds)
    return figure


def draw_stability_plane(points: Sequence[tuple[str, Sequence[Reading]]], boundaries: Boundaries) -> Figure:
    """The pole of each pulse: damping grows to the left, frequency upwards."""
    figure, panel = _plane()
    clouds = [regions.pole(cloud[:, 1], cloud[:, 0]) for cloud in (_cloud(readings) for _, readings in points)]
    both = np.vstack([*clouds, [[-1.0, 1.0], [0.8, 1.0]]])
    panel.set(
        xlim=(1.35 * float(np.nanmin(both[:, 0])), 1.35 * float(np.nanmax(both[:, 0]))),
        ylim=(0.0, 1.3 * float(np.nanmax(both[:, 1]))),
    )
    panel.set_xlabel(r"$-\zeta\,\omega_n$, rad/s")
    panel.set_ylabel(r"damped frequency $\omega_d$, rad/s")
    regions.shade_damping(panel, boundaries.dynamic_stability)
    _scatter(figure, panel, points, clouds)
    level_names.name_sectors(panel, boundaries.dynamic_stability, clouds)
    return figure


def _cloud(readings: Sequence[Reading]) -> FloatArray:
    """First value over second of each reading, ``[reading, 2]`` with the second in front for quickness."""
    swap = readings[0].criterion == "attitude_quickness"
    pairs = [(reading.values[1].value, reading.values[0].value) for reading in readings]
    return np.array(pairs if swap else [pair[::-1] for pair in pairs], dtype=np.float64).reshape(-1, 2)


def _scatter(figure: Figure, panel: Axes, points: Sequence[tuple[str, Sequence[Reading]]], clouds: Sequence[FloatArray]) -> None:
    for (name, _), cloud, colour in zip(points, clouds, _COLOURS, strict=False):
        panel.plot(*cloud.T, **_POINT, markerfacecolor=colour, label=_plain(name))
    if len(points) > 1:
        style.key(figure, panel.get_legend_handles_labels()[0], columns=2)


def _plane() -> tuple[Figure, Axes]:
    figure, axes = style.sheet(style.COLUMN, 3.1, margins=_MARGINS)
    return figure, axes[0, 0]


def _stack(names: Sequence[str], history: TimeHistory, width: float) -> tuple[Figure, list[Axes]]:
    figure, axes = style.sheet(width, 0.7 + 0.95 * len(names), len(names), 1, sharex=True, margins=style.Margins(top=0.2))
    for panel, name in zip(axes[:, 0], names, strict=True):
        unit = history.units[name].replace("rad", "deg")
        panel.set_ylabel(f"{_symbol(name)}{f', {unit}' if unit not in ('', '1') else ''}")
        style.grid(panel)
    return figure, list(axes[:, 0])


def _symbol(name: str) -> str:
    return _plain(name) if name.endswith("_ref") else symbols.mathtext(name)


def field_scale(unit: str) -> float:
    """Factor from SI to what the field reads: angles and rates in deg."""
    return DEG if unit.startswith("rad") else 1.0


def _plain(text: str) -> str:
    return text.replace("$", r"\$")


def _envelope(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A trace for the eye: of a long one, the smallest and the largest value of each bin, so that no peak is lost."""
    size = values.size // _BINS
    if size < 4:
        return time, values
    count = values.size // size
    parts = values[: count * size].reshape(count, size)
    ends = np.stack([parts.min(axis=1), parts.max(axis=1)], axis=1)
    first_is_low = parts.argmin(axis=1) <= parts.argmax(axis=1)
    ends[~first_is_low] = ends[~first_is_low, ::-1]
    at = time[: count * size].reshape(count, size)
    return np.stack([at[:, size // 4], at[:, 3 * size // 4]], axis=1).ravel(), ends.ravel()
