"""Figures of a nominal case: the record of each test with what was picked from it, and the frequency response that was read."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MultipleLocator, NullLocator
from numpy.typing import NDArray

from levelone.campaign.models.readings import Result, Spectral, channels_of
from levelone.config.model_table import Test
from levelone.handling.damping import DynamicStability
from levelone.handling.history import TimeHistory
from levelone.handling.quickness import Quickness
from levelone.handling.translation import TranslationalRate
from levelone.report import style, symbols
from levelone.status import Status

FloatArray = NDArray[np.float64]
DEG = 180.0 / math.pi
_SHOWN = {"rad": (DEG, "deg"), "rad/s": (DEG, "deg/s")}
_DRAWN = 4000
"""Points of a trace: more than a page resolves."""
_MARK: dict[str, Any] = {
    "linestyle": "none", "marker": "o", "markersize": 4.2, "markerfacecolor": "white", "markeredgecolor": style.VERMILLION,
    "markeredgewidth": 1.1, "zorder": 5,
}  # fmt: skip
_GUIDE: dict[str, Any] = {"color": style.GREY, "linewidth": 0.5, "linestyle": (0, (1.5, 1.5)), "zorder": 1}
_QUICKNESS = ((0, "first peak"), (1, "peak"), (0, "second stationary point"))
"""Channel (rate, attitude) and name of each pick, in the order of the criterion."""
_STABILITY = ((0, "first peak"), (0, "first valley"), (0, "second peak"))


def draw_record(test: Test, history: TimeHistory, result: Result | None) -> Figure:
    """Command and channels below each other, from the first sample to the last, with the picked points."""
    names = channels_of(test)
    rows = 1 + len(names)
    figure, axes = style.sheet(
        style.PAGE,
        0.7 + 1.15 * rows,
        rows,
        1,
        sharex=True,
        height_ratios=(0.7, *(1.0,) * len(names)),
        margins=style.Margins(left=0.62),
    )
    command, panels = axes[0, 0], [axes[j, 0] for j in range(1, rows)]
    _trace(command, history, history.input_name, style.BLACK if test.manoeuvre.shape != "sweep" else style.ORANGE)
    for panel, name in zip(panels, names, strict=True):
        _trace(panel, history, name, style.BLUE)
        scale = _SHOWN.get(history.units[name], (1.0, ""))[0]
        panel.axhline(scale * float(history.trim[name][0]), **_GUIDE)
    for panel in axes[:, 0]:
        panel.axvline(history.input_on, **_GUIDE)
        panel.margins(y=0.3)
    if isinstance(result, Quickness):
        _marks(panels, history, names, result.picks.time[0], _QUICKNESS)
    if isinstance(result, DynamicStability):
        free = history.input_off + float(history.delay[0]) + test.delay + test.delay
        for panel in axes[:, 0]:
            panel.axvspan(history.input_on, free, color="#eeeeee", linewidth=0.0, zorder=0)
        _marks(panels, history, names, result.picks.time[0], _STABILITY)
    if isinstance(result, TranslationalRate):
        _rise(panels[0], history, names[0], result)
    axes[-1, 0].set_xlabel("$t$, s")
    axes[-1, 0].set_xlim(float(history.time[0]), float(history.time[-1]))
    return figure


def draw_response(test: Test, result: Spectral) -> Figure:
    """Gain, phase and, of a sweep, coherence against frequency, with what was read."""
    response = result.response
    rows = 2 if response.coherence is None else 3
    ratios = (1.0, 1.15, 0.5)[:rows]
    figure, axes = style.sheet(style.COLUMN, 3.0 + 0.6 * (rows - 2), rows, 1, sharex=True, height_ratios=ratios)
    gain, phase = axes[0, 0], axes[1, 0]
    look: dict[str, Any] = {"color": style.BLUE, "linewidth": 0.9}
    gain.semilogx(response.omega, np.where(np.isfinite(response.gain_db), response.gain_db, np.nan), **look)
    phase.semilogx(response.omega, DEG * response.unwrapped_phase(test.phase_reference), **look)
    phase.yaxis.set_major_locator(MultipleLocator(_phase_step(phase)))
    gain.set_ylabel("Gain, dB")
    phase.set_ylabel("Phase, deg")
    if response.coherence is not None:
        _coherence(axes[2, 0], test, response.omega, response.coherence)
    for panel in axes[:, 0]:
        style.grid(panel)
    _readings(axes[:, 0], result)
    last = axes[-1, 0]
    last.set_xlabel(r"$\omega$, rad/s")
    last.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    last.xaxis.set_major_formatter("{x:g}")
    last.xaxis.set_minor_locator(NullLocator())
    last.set_xlim(float(response.omega[0]), float(response.omega[-1]))
    return figure


def _trace(panel: Axes, history: TimeHistory, name: str, colour: str) -> None:
    scale, unit = _SHOWN.get(history.units[name], (1.0, history.units[name]))
    keep = _kept(history.channels[name][0])
    panel.plot(history.time[keep], scale * history.channels[name][0, keep], color=colour, linewidth=0.8, zorder=3)
    label = symbols.mathtext(name.removesuffix("_ref"))
    command = " command" if name == history.input_name else ""
    panel.set_ylabel(f"{label}{command}" + ("" if unit == "1" else f", {unit}"))
    style.grid(panel)


def _kept(values: FloatArray) -> NDArray[np.int64]:
    """Samples to draw: the least and the largest of each of so many stretches, since every so many alone would show false beats."""
    width = 2 * values.size // _DRAWN
    if width < 2:
        return np.arange(values.size)
    stretches = values[: values.size // width * width].reshape(-1, width)
    first = width * np.arange(len(stretches))
    return np.unique(np.concatenate([[0], first + stretches.argmin(axis=1), first + stretches.argmax(axis=1), [values.size - 1]]))


def _marks(
    panels: list[Axes], history: TimeHistory, names: tuple[str, ...], times: FloatArray, picks: tuple[tuple[int, str], ...]
) -> None:
    """Picked points on their traces, with their names on the outer side; nothing where the criterion found none."""
    for time, (place, text) in zip(times.tolist(), picks, strict=True):
        if not math.isfinite(time):
            continue
        name, panel = names[place], panels[place]
        scale = _SHOWN.get(history.units[name], (1.0, ""))[0]
        value = scale * float(np.interp(time, history.time, history.channels[name][0]))
        middle = scale * float(np.mean(history.channels[name][0]))
        up = value > middle
        panel.plot([time], [value], **_MARK)
        panel.annotate(
            text, (time, value), xytext=(4, 5 if up else -5), textcoords="offset points", ha="left", va="bottom" if up else "top",
            fontsize=8,
        )  # fmt: skip


def _rise(panel: Axes, history: TimeHistory, name: str, result: TranslationalRate) -> None:
    """Commanded speed, and where the rise time was read."""
    trim = float(history.trim[name][0])
    commanded = float(result.commanded[0])
    if math.isfinite(commanded):
        panel.axhline(trim + commanded, **_GUIDE)
    time = history.input_on + float(result.rise_time[0])
    if math.isfinite(time):
        panel.plot([time], [float(np.interp(time, history.time, history.channels[name][0]))], **_MARK)
        panel.annotate(
            "rise time", (time, trim + 0.63 * commanded), xytext=(6, -2), textcoords="offset points", va="top", fontsize=8
        )


def _phase_step(phase: Axes) -> float:
    low, high = phase.get_ylim()
    return next((step for step in (45.0, 90.0, 180.0) if (high - low) / step <= 9.0), 360.0)


def _coherence(panel: Axes, test: Test, omega: FloatArray, coherence: FloatArray) -> None:
    panel.semilogx(omega, coherence, color=style.ORANGE)
    panel.axhline(test.coherence_min, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 2)))
    panel.annotate(
        f"least accepted, {test.coherence_min:g}", (0.015, test.coherence_min), xycoords=("axes fraction", "data"), xytext=(0, -2),
        textcoords="offset points", ha="left", va="top", fontsize=7, color=style.GREY,
    )  # fmt: skip
    panel.set_ylim(0.0, 1.05)
    panel.set_yticks([0.0, 0.5, 1.0])
    panel.set_ylabel("Coherence")


def _readings(column: NDArray[Any], result: Spectral) -> None:
    """Where bandwidths and omega_180 were read, and the phase delay."""
    reading, gain, phase = result.reading, column[0], column[1]
    for name, status, level, text, side in (
        ("omega_bw_phase", "status_phase", -135.0, r"$\omega_{\mathrm{BW,phase}}$", "right"),
        ("omega_bw_gain", "status_gain", None, r"$\omega_{\mathrm{BW,gain}}$", "right"),
        ("omega_180", "status_180", -180.0, r"$\omega_{180}$", "left"),
    ):
        if level is not None:
            phase.axhline(level, color=style.GREY, linewidth=0.5, linestyle=(0, (4, 2)), zorder=1)
        omega = float(getattr(reading, name))
        if not math.isfinite(omega) or Status(int(getattr(reading, status))).failed:
            continue
        for panel in column:
            panel.axvline(omega, color=style.VERMILLION, linewidth=0.6, zorder=1)
        if level is not None:
            phase.plot([omega], [level], **_MARK)
        foot, across = (1.0, -4) if level is None else (0.0, 4)  # the gain's bandwidth lies close to another: at the other end
        gain.annotate(
            text, (omega, foot), xycoords=("data", "axes fraction"), xytext=(-2 if side == "right" else 2, across),
            textcoords="offset points", ha=side, va="top" if level is None else "bottom", color=style.VERMILLION, fontsize=7.5,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4}, zorder=6,
        )  # fmt: skip
    if math.isfinite(float(reading.tau_p)):
        phase.text(0.03, 0.06, rf"$\tau_p$ = {float(reading.tau_p):.3g} s", transform=phase.transAxes)
