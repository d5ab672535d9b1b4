"""Dynamic derivatives against reduced frequency, hysteresis loops with their thickness, span loads, thin-aerofoil theory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from levelone.aerodynamics import theory
from levelone.aerodynamics.derivatives import Derivatives
from levelone.report import derivatives_labels as labels
from levelone.report import style, symbols
from levelone.report.formatting import number

FloatArray = NDArray[np.float64]
DEG = 180.0 / math.pi

_MOTIONS: Any = ((style.BLUE, "-", "o"), (style.VERMILLION, "--", "s"), (style.GREEN, "-.", "^"), (style.PURPLE, ":", "v"))
_ORDINARY: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 5.5, "markerfacecolor": "none",
                             "markeredgewidth": 0.6, "markeredgecolor": style.GREY, "zorder": 2}  # fmt: skip
_PRINTED: dict[str, Any] = {"color": style.BLACK, "linewidth": 0.9, "linestyle": (0, (4, 1.5)), "marker": "D", "markersize": 4.0,
                            "markerfacecolor": style.ORANGE, "markeredgewidth": 0.6, "zorder": 5}  # fmt: skip
_EARLIER: dict[str, Any] = {"color": style.BLACK, "linewidth": 0.8, "linestyle": (0, (1, 1.2)), "zorder": 1.8}
_GUIDE: dict[str, Any] = {"color": style.GREY, "linewidth": 0.5, "linestyle": (0, (1.5, 1.5)), "zorder": 1.5}


@dataclass(frozen=True)
class Printed:
    """Pitch derivatives that a publication prints at the ends of a range of k; ``earlier``: of older work, at no stated k."""

    k: tuple[float, float]
    quadrature: dict[str, tuple[float, float]]
    earlier: dict[str, float]


@dataclass(frozen=True)
class Loop:
    """Coefficient [t] against pitch attitude [t] (rad) over one period, and how the loop was found."""

    label: str
    theta: FloatArray
    coefficients: dict[str, FloatArray]


def draw_theodorsen(k: FloatArray) -> Figure:
    """Derivatives of a thin aerofoil against k, for pitch about the quarter chord and for heave; moments about that point."""
    motions = {"pitch": theory.pitch(k), "heave": theory.heave(k)}
    figure, axes = style.sheet(style.PAGE, 2.2, 1, 2, margins=style.Margins(top=0.3, beside=0.62))
    for panel, name in zip(axes[0], ("C_L", "C_m"), strict=True):
        for (motion, found), (colour, line, _) in zip(motions.items(), _MOTIONS, strict=False):
            values = found.lift_quadrature if name == "C_L" else found.moment_quadrature
            panel.plot(k, values, color=colour, linestyle=line, label=labels.WORDS[motion])
        panel.axhline(0.0, **_GUIDE)
        panel.set(xlabel="$k$", xlim=(0.0, float(k.max())))
        panel.set_ylabel(f"derivatives of {symbols.mathtext(name)}, 1/rad")
        style.grid(panel)
    style.key(figure, axes[0, 0].get_legend_handles_labels()[0], columns=2)
    return figure


def draw_dynamic(derivatives: Derivatives, motions: Sequence[str], coefficients: Sequence[str], printed: Printed | None) -> Figure:
    """Out-of-phase derivatives of some motions against k, with error bars, what the ordinary grid gives, and printed values."""
    columns = len(coefficients)
    margins = style.Margins(left=0.5, top=0.5, beside=0.62)
    figure, axes = style.sheet(style.PAGE, 2.7, 1, columns, margins=margins)
    for panel, coefficient in zip(axes[0], coefficients, strict=True):
        for motion, (colour, line, marker) in zip(motions, _MOTIONS, strict=False):
            _against_k(panel, derivatives, motion, coefficient, {"color": colour, "linestyle": line, "marker": marker})
        if printed is not None:
            _publication(panel, printed, coefficient)
        panel.axhline(0.0, **_GUIDE)
        panel.set(xlabel="$k$", xlim=(0.0, 1.04 * float(derivatives.k.max())))
        panel.set_ylabel(f"derivatives of {symbols.mathtext(coefficient)}, 1/rad")
        style.grid(panel)
    style.key(figure, _handles(motions, printed), columns=3)
    return figure


def _against_k(panel: Axes, derivatives: Derivatives, motion: str, coefficient: str, look: dict[str, Any]) -> None:
    value, error = derivatives.at(motion, coefficient)
    row, column = derivatives.motions.index(motion), derivatives.coefficients.index(coefficient)
    panel.errorbar(
        derivatives.k,
        value,
        error,
        **look,
        markersize=2.8,
        markeredgewidth=0.0,
        elinewidth=0.8,
        capsize=1.5,
        capthick=0.8,
        zorder=4,
    )
    panel.plot(derivatives.k, derivatives.ordinary_quadrature[row, :, column], **_ORDINARY)


def _publication(panel: Axes, printed: Printed, coefficient: str) -> None:
    if coefficient in printed.quadrature:
        panel.plot(printed.k, printed.quadrature[coefficient], **_PRINTED)
    if coefficient in printed.earlier:
        panel.axhline(printed.earlier[coefficient], **_EARLIER)


def _handles(motions: Sequence[str], printed: Printed | None) -> list[Any]:
    found = [
        Line2D([], [], color=colour, linestyle=line, marker=marker, markersize=2.8, label=labels.WORDS[motion])
        for motion, (colour, line, marker) in zip(motions, _MOTIONS, strict=False)
    ]
    found.append(Line2D([], [], **_ORDINARY, label="the geometry's own grid"))
    if printed is not None:
        found.append(Line2D([], [], **_PRINTED, label="study, pitch oscillation"))
        if printed.earlier:
            found.append(Line2D([], [], **_EARLIER, label="earlier work, no $k$ stated"))
    return found


def harmonic_loop(derivatives: Derivatives, index: int, amplitude: float, mean: dict[str, float], points: int = 181) -> Loop:
    """The loop that a pitch oscillation of an amplitude (rad) at ``derivatives.k[index]`` describes: its first harmonic.

    C = C_mean + amplitude (C_in_phase sin(omega t) + k C_quadrature cos(omega t)), theta = amplitude sin(omega t).
    """
    phase = np.linspace(0.0, 2.0 * math.pi, points)
    k, row = float(derivatives.k[index]), derivatives.motions.index("pitch")
    found = {}
    for name, offset in mean.items():
        column = derivatives.coefficients.index(name)
        inside, ahead = derivatives.in_phase[row, index, column], derivatives.quadrature[row, index, column]
        found[name] = offset + amplitude * (inside * np.sin(phase) + k * ahead * np.cos(phase))
    return Loop(f"frequency domain, $k$ = {k:.3g}", amplitude * np.sin(phase), found)


def draw_loops(loops: Sequence[Loop], coefficients: Sequence[str]) -> Figure:
    """Coefficients against attitude; the thickness of the first loop at mean attitude is 2 A k times the derivative."""
    figure, axes = style.sheet(style.PAGE, 2.7, 1, len(coefficients), margins=style.Margins(left=0.55, top=0.3, beside=0.55))
    for panel, name in zip(axes[0], coefficients, strict=True):
        for loop, (colour, line, _) in zip(loops, _MOTIONS, strict=False):
            panel.plot(DEG * loop.theta, loop.coefficients[name], color=colour, linestyle=line, label=loop.label, zorder=3)
        _thickness(panel, loops[0], name)
        panel.set_xlabel(r"$\theta$, deg")
        panel.set_ylabel(symbols.mathtext(name))
        panel.margins(y=0.18)
        style.grid(panel)
    style.key(figure, axes[0, 0].get_legend_handles_labels()[0], columns=2)
    return figure


def _thickness(panel: Axes, loop: Loop, name: str) -> None:
    """Arrow between the two passes of the mean attitude, its length in words, and arrow heads in the sense of time."""
    values, theta = loop.coefficients[name], DEG * loop.theta
    up, down = float(values[0]), float(values[len(values) // 2])
    text = r"thickness $2 A k\,($" + labels.quadrature("pitch", name) + f"$)$ = {number(up - down, 3)}"
    rising = bool(values[len(values) // 4] > values[3 * len(values) // 4])
    panel.text(0.03, 0.96 if rising else 0.04, text, transform=panel.transAxes, ha="left", va="top" if rising else "bottom",
               fontsize=8, zorder=6)  # fmt: skip
    if not np.isfinite(values).all():
        return
    panel.annotate("", (0.0, up), (0.0, down), arrowprops={"arrowstyle": "<->", "linewidth": 0.8, "shrinkA": 0.0, "shrinkB": 0.0})
    for start in (len(values) // 8, 5 * len(values) // 8):
        panel.annotate("", (theta[start + 1], values[start + 1]), (theta[start], values[start]), zorder=4,
                       arrowprops={"arrowstyle": "-|>", "color": style.BLUE, "linewidth": 0.8})  # fmt: skip


def draw_span_loads(loads: Sequence[tuple[str, dict[str, list[tuple[FloatArray, FloatArray]]]]]) -> Figure:
    """Load along the span: for each motion its axis label and, by surface, the halves as (y, load); two motions in a row."""
    rows, columns = -(-len(loads) // 2), min(len(loads), 2)
    margins = style.Margins(left=0.55, top=0.3, beside=0.6, between=0.42)
    figure, axes = style.sheet(style.PAGE, 0.26 + 1.94 * rows, rows, columns, margins=margins)
    for panel, (text, surfaces) in zip(axes.flat, loads, strict=False):
        for (name, halves), (colour, line, marker) in zip(surfaces.items(), _MOTIONS * len(surfaces), strict=False):
            for index, (y, load) in enumerate(halves):
                panel.plot(y, load, color=colour, linestyle=line, marker=marker, markersize=2.4, markeredgewidth=0.0,
                           label=_plain(name) if index == 0 else None)  # fmt: skip
        panel.axhline(0.0, **_GUIDE)
        panel.set_ylabel(text)
        style.grid(panel)
    for panel in axes.flat[len(loads) :]:
        panel.set_axis_off()
    for panel in axes[-1]:
        panel.set_xlabel("$y$, m")
    style.key(figure, axes[0, 0].get_legend_handles_labels()[0], columns=6)
    return figure


def _plain(name: str) -> str:
    """A name of the user's in a legend: no formula, and not hidden, as matplotlib hides what begins with an underscore."""
    return (" " if name.startswith("_") else "") + name.replace("$", r"\$")
