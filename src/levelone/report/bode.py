"""Linear against swept frequency response, with the coherence of the sweep."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MultipleLocator, NullLocator
from numpy.typing import NDArray

from levelone.handling.bandwidth import COHERENCE_MIN
from levelone.report import style
from levelone.report.results import attribute

FloatArray = NDArray[np.float64]

DEG = 180.0 / math.pi
_SWEPT: dict[str, Any] = {
    "color": style.ORANGE,
    "linestyle": "none",
    "marker": "o",
    "markersize": 2.0,
    "markeredgewidth": 0.0,
    "zorder": 2,
}
_READINGS = (
    ("q", "", "coherence", r"$q/V_{\mathrm{lon}}$ (rate)"),
    ("theta", "_attitude", "theta_coherence", r"$-\theta/V_{\mathrm{lon}}$ (attitude; sets the Level)"),
)


def draw_bode(linear: xr.Dataset, swept: xr.Dataset) -> Figure:
    """Gain, phase and coherence of both readings, one column each, with omega_bw and omega_180 marked."""
    figure, axes = style.sheet(style.PAGE, 4.3, 3, 2, sharex=True, height_ratios=(1.0, 1.15, 0.5), margins=style.Margins(top=0.48))
    for column, (channel, suffix, coherence, title) in zip(axes.T, _READINGS, strict=True):
        _response(column[0], column[1], linear, swept, channel)
        _coherence(column[2], swept, coherence)
        _readings(column, linear, suffix)
        column[0].set_title(title, y=1.0)
        column[2].set_xlabel(r"$\omega$, rad/s")
        column[2].xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        column[2].xaxis.set_major_formatter("{x:g}")
        column[2].xaxis.set_minor_locator(NullLocator())
    for panel, text in zip(axes[:, 0], ("Gain, dB", "Phase, deg", "Coherence"), strict=True):
        panel.set_ylabel(text)
    axes[0, 0].set_xlim(*_range(linear, swept))
    style.key(figure, axes[0, 0].get_legend_handles_labels()[0], columns=2)
    return figure


def phase_deg(value: NDArray[np.complex128]) -> FloatArray:
    """Continuous phase, deg, on the branch whose first value lies in (-180, 180]; NaN stays where the value is NaN."""
    phase = np.full(value.shape, np.nan)
    known = np.isfinite(value)
    phase[known] = DEG * np.unwrap(np.angle(value[known]))
    return phase


def phase_beside(omega: FloatArray, value: NDArray[np.complex128], omega_line: FloatArray, line: FloatArray) -> FloatArray:
    """Phase of a noisy response, deg, on the branch that lies within half a turn of a smooth one."""
    near = np.interp(omega, omega_line, line)
    return near + (DEG * np.angle(value) - near + 180.0) % 360.0 - 180.0


def _complex(data: xr.Dataset, channel: str) -> NDArray[np.complex128]:
    return data[f"{channel}_re"].values + 1j * data[f"{channel}_im"].values


def _response(gain: Axes, phase: Axes, linear: xr.Dataset, swept: xr.Dataset, channel: str) -> None:
    omega, omega_swept = linear["omega"].values, swept["omega"].values
    value, value_swept = _complex(linear, channel), _complex(swept, channel)
    line = phase_deg(value)
    shown = slice(*np.searchsorted(omega, _range(linear, swept)))
    with np.errstate(divide="ignore"):
        gain.semilogx(omega, 20.0 * np.log10(np.abs(value)), color=style.BLUE, zorder=3, label="linearisation")
        gain.semilogx(omega_swept, 20.0 * np.log10(np.abs(value_swept)), **_SWEPT, label="sweep of the nonlinear model")
        _fit(gain, 20.0 * np.log10(np.abs(value[shown])), 0.08)
    phase.semilogx(omega, line, color=style.BLUE, zorder=3)
    phase.semilogx(omega_swept, phase_beside(omega_swept, value_swept, omega, line), **_SWEPT)
    phase.yaxis.set_major_locator(MultipleLocator(45.0))
    for panel in (gain, phase):
        style.grid(panel)
    _fit(phase, np.append(line[shown], -200.0), 0.05)


def _coherence(panel: Axes, swept: xr.Dataset, name: str) -> None:
    panel.semilogx(swept["omega"].values, swept[name].values, color=style.ORANGE)
    panel.axhline(COHERENCE_MIN, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 2)))
    panel.annotate(
        f"least accepted, {COHERENCE_MIN:g}", (0.015, COHERENCE_MIN), xycoords=("axes fraction", "data"), xytext=(0, -2),
        textcoords="offset points", ha="left", va="top", fontsize=7, color=style.GREY,
    )  # fmt: skip
    panel.set_ylim(0.0, 1.05)
    panel.set_yticks([0.0, 0.5, 1.0])
    style.grid(panel)


def _readings(column: NDArray[Any], linear: xr.Dataset, suffix: str) -> None:
    """Where bandwidth and omega_180 were read on the linear response."""
    gain, phase, _ = column
    for name, level, text in (
        ("omega_bw", -135.0, r"$\omega_{\mathrm{BW}}$"),
        ("omega_180", -180.0, r"$\omega_{180}$"),
    ):
        omega = attribute(linear, name + suffix)
        phase.axhline(level, color=style.GREY, linewidth=0.5, linestyle=(0, (4, 2)), zorder=1)
        if not math.isfinite(omega):
            continue
        for panel in column:
            panel.axvline(omega, color=style.VERMILLION, linewidth=0.6, zorder=1)
        phase.plot([omega], [level], "o", markersize=4, markerfacecolor="white", markeredgecolor=style.VERMILLION, zorder=5)
        left = name == "omega_bw"
        gain.annotate(
            text, (omega, 0.0), xycoords=("data", "axes fraction"), xytext=(-2 if left else 2, 4), textcoords="offset points",
            ha="right" if left else "left", va="bottom", color=style.VERMILLION,
        )  # fmt: skip
    tau_p = attribute(linear, "tau_p" + suffix)
    if math.isfinite(tau_p):
        phase.text(0.03, 0.06, rf"$\tau_p$ = {tau_p:.2g} s", transform=phase.transAxes)


def _range(linear: xr.Dataset, swept: xr.Dataset) -> tuple[float, float]:
    """The swept band, widened until both readings and twice their omega_180 show, within the linear response."""
    omega = linear["omega"].values
    marks = [2.0 * attribute(linear, name) for name in ("omega_180", "omega_180_attitude")]
    high = max([float(swept["omega"].values[-1]), *(mark for mark in marks if math.isfinite(mark))])
    low = float(swept["omega"].values[swept["omega"].values > 0.0][0])
    return max(0.9 * low, float(omega[0])), min(1.1 * high, float(omega[-1]))


def _fit(panel: Axes, values: FloatArray, margin: float) -> None:
    known = values[np.isfinite(values)]
    if known.size:
        low, high = float(known.min()), float(known.max())
        pad = margin * max(high - low, 1.0)
        panel.set_ylim(low - pad, high + pad)
