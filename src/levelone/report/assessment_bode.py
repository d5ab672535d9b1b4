"""Frequency responses of recorded sweeps with their error bands, and the errors of a simulation between its envelopes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, MultipleLocator, NullLocator
from numpy.typing import NDArray

from levelone.campaign.assessment_sweep import Response
from levelone.campaign.assessment_tests import Reading
from levelone.handling.added_dynamics import AddedDynamics
from levelone.handling.bandwidth import COHERENCE_MIN
from levelone.report import style

FloatArray = NDArray[np.float64]

DEG = 180.0 / math.pi
LOOKS: tuple[dict[str, Any], ...] = ({"color": style.BLUE}, {"color": style.ORANGE, "linestyle": (0, (5, 1.5))})
"""Of the data, and of the reference."""
_DRAWN = 160
"""Points of a curve, even in the logarithm of frequency."""
_BRANCH = {"theta": "attitude", "phi": "attitude", "psi": "attitude"}


@dataclass(frozen=True)
class Curve:
    """One response to be drawn: what it is called in the legend, and the reading whose crossings are marked."""

    name: str
    response: Response
    reading: Reading | None
    phase_reference: float = 0.0


def draw_responses(columns: Sequence[Sequence[Curve]]) -> Figure:
    """Gain, phase and coherence; a column for each response, with one curve or, against a reference, two."""
    width = style.PAGE if len(columns) > 1 else 0.62 * style.PAGE
    margins = style.Margins(top=0.48)
    figure, axes = style.sheet(width, 4.3, 3, len(columns), sharex=True, height_ratios=(1.0, 1.15, 0.5), margins=margins)
    for panels, curves in zip(axes.T, columns, strict=True):
        trusted = [_curve(panels, curve, look) for curve, look in zip(curves, LOOKS, strict=False)]
        _lines(panels)
        for panel, values in zip(panels, np.concatenate(trusted, axis=1), strict=False):
            _fit(panel, values)
        panels[0].set_title(_title(curves[0].response.title), y=1.0)
        if curves[0].reading is not None:
            _crossings(panels, curves[0])
    for panel, text in zip(axes[:, 0], ("Gain, dB", "Phase, deg", "Coherence"), strict=True):
        panel.set_ylabel(text)
    bands = [Line2D([], [], **look, label=f"{curve.name}, with 95 % band") for curve, look in zip(columns[0], LOOKS, strict=False)]
    style.key(figure, bands, columns=2)
    return figure


def _fit(panel: Axes, values: FloatArray) -> None:
    """Limits by what can be trusted: phase and gain without coherence may run anywhere."""
    known = values[np.isfinite(values)]
    if known.size:
        pad = 0.12 * max(float(np.ptp(known)), 1.0)
        panel.set_ylim(float(known.min()) - pad, float(known.max()) + pad)


def _curve(panels: Sequence[Axes], curve: Curve, look: dict[str, Any]) -> FloatArray:
    """Draw one response; its gain and phase ``[2, point]`` where coherence lets them be trusted."""
    found = curve.response.identified
    keep = _thinned(found.response.omega)
    omega, half = found.response.omega[keep], found.half_width()[keep]
    coherence = found.response.coherence
    good = np.ones(omega.size, dtype=bool) if coherence is None else coherence[keep] >= COHERENCE_MIN
    gain, phase = found.response.gain_db[keep], DEG * found.response.unwrapped_phase(curve.phase_reference)[keep]
    band = np.where(good, half, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        low, high = (20.0 * np.log10(np.maximum(1.0 + side * band, 1e-3)) for side in (-1.0, 1.0))
    for panel, middle, below, above in (
        (panels[0], gain, gain + low, gain + high),
        (panels[1], phase, phase - DEG * band, phase + DEG * band),
    ):
        panel.fill_between(omega, below, above, color=look["color"], alpha=0.22, linewidth=0.0, zorder=1.5)
        panel.semilogx(omega, np.where(good, middle, np.nan), **look, zorder=3)
        panel.semilogx(omega, middle, color=look["color"], linewidth=0.5, alpha=0.45, zorder=2)
    if coherence is not None:
        panels[2].semilogx(omega, coherence[keep], **look)
    return np.where(good, np.stack([gain, phase]), np.nan)


def _lines(panels: Sequence[Axes]) -> None:
    panels[1].yaxis.set_major_locator(MultipleLocator(45.0))
    panels[2].axhline(COHERENCE_MIN, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 2)))
    panels[2].set_ylim(0.0, 1.05)
    panels[2].set_yticks([0.0, 0.5, 1.0])
    panels[2].set_xlabel(r"$\omega$, rad/s")
    _decades(panels[2])
    for panel in panels:
        style.grid(panel)
    for level in (-135.0, -180.0):
        panels[1].axhline(level, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 2)), zorder=1)


def _crossings(panels: Sequence[Axes], curve: Curve) -> None:
    """Where bandwidth and -180 deg were read, and where phase delay was."""
    if curve.reading is None:
        return
    turn = curve.reading.value("omega_180").value
    marks = ((curve.reading.value("omega_bw_phase").value, -135.0), (turn, -180.0))
    for omega, level in marks:
        if math.isfinite(omega):
            panels[1].plot([omega], [level], "o", markersize=4, markerfacecolor="white", markeredgecolor=style.VERMILLION, zorder=5)
            panels[0].axvline(omega, color=style.VERMILLION, linewidth=0.5, linestyle=(0, (1.5, 1.5)), zorder=1)
    tau = curve.reading.value("tau_p").value
    if math.isfinite(tau):
        panels[1].axvline(2.0 * turn, color=style.VERMILLION, linewidth=0.5, linestyle=(0, (1.5, 1.5)), zorder=1)


def draw_mismatch(found: Sequence[tuple[str, AddedDynamics]]) -> Figure:
    """Simulation over flight, gain and phase, between the envelopes of unnoticeable added dynamics; a column for each response."""
    width = style.PAGE if len(found) > 1 else 0.62 * style.PAGE
    figure, axes = style.sheet(width, 3.4, 2, len(found), sharex=True, margins=style.Margins(top=0.3))
    for panels, (title, each) in zip(axes.T, found, strict=True):
        bounds, error = each.envelopes, each.error
        for panel, below, above, middle, scale in (
            (panels[0], bounds.gain_below, bounds.gain_above, error.gain, 1.0),
            (panels[1], bounds.phase_below, bounds.phase_above, error.phase, DEG),
        ):
            panel.fill_between(bounds.omega, scale * below, scale * above, color=style.LEVEL_COLOURS[0], linewidth=0.0, zorder=0.5)
            for line in (below, above):
                panel.semilogx(bounds.omega, scale * line, color=style.BLACK, linewidth=0.7, linestyle=(0, (6, 1.5, 1, 1.5)))
            panel.semilogx(error.omega, scale * middle, color=style.BLUE, zorder=3)
            panel.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=1)
            panel.yaxis.set_major_locator(MaxNLocator(6))
            style.grid(panel)
        panels[0].set_title(_title(title), y=1.0)
        panels[1].set_xlabel(r"$\omega$, rad/s")
        _decades(panels[1])
    axes[0, 0].set_ylabel("Gain error, dB")
    axes[1, 0].set_ylabel("Phase error, deg")
    return figure


def _decades(panel: Axes) -> None:
    panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_locator(NullLocator())


def _title(text: str) -> str:
    """A title as it stands: names of channels are the user's."""
    return text.replace("$", r"\$").replace("-", "−", 1) if text.startswith("-") else text.replace("$", r"\$")


def _thinned(omega: FloatArray) -> NDArray[np.int64]:
    """Samples that are even in the logarithm, first and last included."""
    wanted = np.geomspace(omega[0], omega[-1], _DRAWN)
    return np.unique(np.clip(np.searchsorted(omega, wanted * (1.0 - 1e-9)), 0, omega.size - 1))
