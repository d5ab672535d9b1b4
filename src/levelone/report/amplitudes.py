"""Sweeps of the nonlinear model at several amplitudes against the linearisation: where does it stop holding?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from levelone.campaign.sweep import COMPARED, GAIN_DB, PHASE_DEG
from levelone.handling.bandwidth import COHERENCE_MIN
from levelone.report import style, symbols
from levelone.report.bode import phase_beside, phase_deg
from levelone.report.formatting import number, percent
from levelone.report.pictures import Picture
from levelone.report.results import Results, read_group

FloatArray = NDArray[np.float64]

_TITLE = "$q/V_{\\mathrm{lon}}$"
_COLOURS = LinearSegmentedColormap.from_list("amplitude", ["#f2c14e", style.VERMILLION, "#5a189a"])
_POINTS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 1.8, "markeredgewidth": 0.0, "zorder": 2}
_RANGE: dict[str, Any] = {"color": "#eef2f5", "linewidth": 0.0, "zorder": 0}


def context(results: Results) -> dict[str, Any] | None:
    """The table of amplitudes and the largest that agrees; None where the study swept with one amplitude only."""
    given = results.summary.get("amplitudes")
    if not given:
        return None
    readings = [symbols.html(name) + f", {unit}" for name, unit in (("omega_bw", "rad/s"), ("tau_p", "s"))]
    return {"rows": [_row(entry) for entry in given], "holds": _in_words(given), "readings": readings}


def pictures(results: Results) -> list[Picture]:
    """The responses over each other, and how far each lies from the linear one."""
    given = results.summary.get("amplitudes")
    if not given:
        return []
    caption = (
        "The same sweep with several amplitudes (points) against the linearisation (line): response of q / V_lon with its "
        "coherence, and what separates the two. Grey: the range and the differences within which they count as agreeing."
    )
    return [Picture("amplitudes", "amplitudes", caption, True, partial(draw_amplitudes, results))]


def agrees(entry: Mapping[str, Any]) -> bool:
    """Whether a sweep stays within the differences that count as agreement at every frequency compared."""
    return bool(entry["max_gain_difference_db"] <= GAIN_DB and entry["max_phase_difference_deg"] <= PHASE_DEG)


def largest_that_agrees(entries: Sequence[Mapping[str, Any]]) -> float:
    """Largest amplitude (m/s) that agrees together with all smaller ones; NaN where the smallest does not."""
    largest = math.nan
    for entry in sorted(entries, key=lambda each: float(each["amplitude"])):
        if not agrees(entry):
            break
        largest = float(entry["amplitude"])
    return largest


def _in_words(entries: Sequence[Mapping[str, Any]]) -> str:
    """Where the linearisation holds, with what decides it."""
    limit = f"{GAIN_DB:g} dB and {PHASE_DEG:g} deg from {COMPARED[0]:g} to {COMPARED[1]:g} rad/s"
    top = max(float(entry["amplitude"]) for entry in entries)
    largest = largest_that_agrees(entries)
    if math.isnan(largest):
        return f"The linearisation does not hold at any of these amplitudes: not even the smallest stays within {limit}."
    if largest == top:
        return f"The linearisation holds up to the largest amplitude flown, {top:g} m/s: every sweep stays within {limit}."
    beyond = next(entry for entry in sorted(entries, key=lambda each: float(each["amplitude"])) if entry["amplitude"] > largest)
    return (
        f"The linearisation holds up to {largest:g} m/s within {limit}; at {beyond['amplitude']:g} m/s the differences reach "
        f"{number(beyond['max_gain_difference_db'], 3)} dB and {number(beyond['max_phase_difference_deg'], 3)} deg."
    )


def _row(entry: Mapping[str, Any]) -> dict[str, Any]:
    def reading(name: str, status: str) -> str:
        text = number(entry[name])
        return text if entry[status] == "ok" else f"{text}: {entry[status]}"

    return {
        "amplitude": number(entry["amplitude"]), "theta": number(entry["theta_pk_deg"], 3),
        "gain": number(entry["max_gain_difference_db"], 3), "phase": number(entry["max_phase_difference_deg"], 3),
        "within": percent(entry["within"]), "coherence": number(entry["coherence_min"], 3),
        "omega_bw": reading("omega_bw", "status"), "tau_p": reading("tau_p", "tau_p_status"),
        "verdict": "agrees" if agrees(entry) else "differs",
    }  # fmt: skip


def draw_amplitudes(results: Results) -> Figure:
    """Gain, phase and coherence of each amplitude beside the linear response, and the differences from it."""
    swept, linear = read_group(results.directory / "frequency.nc", "amplitudes"), results.linear
    omega, line = linear["omega"].values, linear["q_re"].values + 1j * linear["q_im"].values
    figure, axes = style.sheet(style.PAGE, 4.0, 3, 2, sharex=True, height_ratios=(1.0, 1.0, 0.6), margins=style.Margins(top=0.24))
    gain, phase = 20.0 * np.log10(np.abs(line)), phase_deg(line)
    axes[0, 0].semilogx(omega, gain, color=style.BLACK, zorder=3)
    axes[1, 0].semilogx(omega, phase, color=style.BLACK, zorder=3)
    amplitudes = swept["amplitude"].values.tolist()
    colours = [_COLOURS(k / max(len(amplitudes) - 1, 1)) for k in range(len(amplitudes))]
    for k, colour in enumerate(colours):
        _add(axes, swept.isel(amplitude=k), (omega, gain, phase), colour)
    _frame(axes, swept["omega"].values, omega, gain, phase)
    handles = [Line2D([], [], color=style.BLACK, label="linearisation")]
    handles += [
        Line2D([], [], **{**_POINTS, "markersize": 4.0, "color": colour}, label=f"{amplitude:g} m/s")
        for amplitude, colour in zip(amplitudes, colours, strict=True)
    ]
    axes[2, 1].legend(handles=handles, loc="lower center", ncols=3)
    return figure


def _add(axes: NDArray[Any], swept: xr.Dataset, linear: tuple[FloatArray, FloatArray, FloatArray], colour: Any) -> None:
    """One amplitude in all panels; the linear response is interpolated over the logarithm of frequency."""
    omega, value = swept["omega"].values, swept["q_re"].values + 1j * swept["q_im"].values
    gain_line, phase_line = (np.interp(np.log(omega), np.log(linear[0]), part) for part in linear[1:])
    gain, phase = 20.0 * np.log10(np.abs(value)), phase_beside(omega, value, linear[0], linear[2])
    look = {**_POINTS, "color": colour}
    axes[0, 0].semilogx(omega, gain, **look)
    axes[1, 0].semilogx(omega, phase, **look)
    axes[2, 0].semilogx(omega, swept["coherence"].values, color=colour)
    axes[0, 1].semilogx(omega, gain - gain_line, color=colour)
    axes[1, 1].semilogx(omega, phase - phase_line, color=colour)


def _frame(axes: NDArray[Any], swept: FloatArray, omega: FloatArray, gain: FloatArray, phase: FloatArray) -> None:
    """Titles, limits, and the bands of agreement."""
    titles = (("Gain, dB", "Phase, deg", "Coherence"), ("Gain difference, dB", "Phase difference, deg", ""))
    for column, texts in zip(axes.T, titles, strict=True):
        for panel, text in zip(column, texts, strict=True):
            panel.set_ylabel(text)
            style.grid(panel)
    axes[0, 0].set_xlim(0.9 * swept[0], 1.1 * swept[-1])
    shown = (omega >= swept[0]) & (omega <= swept[-1])
    for panel, line in ((axes[0, 0], gain[shown]), (axes[1, 0], phase[shown])):
        pad = 0.1 * max(float(np.ptp(line)), 1.0)
        panel.set_ylim(line.min() - pad, line.max() + pad)
    for panel, limit in ((axes[0, 1], GAIN_DB), (axes[1, 1], PHASE_DEG)):
        panel.axvspan(*COMPARED, **_RANGE)
        panel.axhspan(-limit, limit, color="#dfe7ec", linewidth=0.0, zorder=0.1)
        panel.set_ylim(-2.0 * limit, 2.0 * limit)
    axes[2, 0].axhline(COHERENCE_MIN, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 2)))
    axes[2, 0].set(ylim=(0.0, 1.05), yticks=[0.0, 0.5, 1.0])
    for panel in (axes[2, 0], axes[1, 1]):
        _frequency_axis(panel)
    axes[1, 1].xaxis.set_label_coords(0.5, -0.14)
    axes[2, 1].set_axis_off()
    axes[0, 0].set_title(_TITLE, y=1.0)
    axes[0, 1].set_title("Sweep against linearisation", y=1.0)


def _frequency_axis(panel: Axes) -> None:
    panel.set_xlabel(r"$\omega$, rad/s")
    panel.tick_params(labelbottom=True)
    panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.xaxis.set_major_formatter("{x:g}")
    panel.xaxis.set_minor_locator(NullLocator())
