"""Figures of a calibration: what each target sees of each parameter, where other starts end, and what cannot be had together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from levelone.report import style, symbols

FloatArray = NDArray[np.float64]
Json = Mapping[str, Any]

_SYMBOLS = {"Kp": "$K_p$", "Ki": "$K_i$", "Kd": "$K_d$", "tau_f": r"$\tau_f$"}
_DIVERGING = LinearSegmentedColormap.from_list("signs", ["#2f7fb8", "#ffffff", "#d9782f"])
_ACCEPTED = style.LEVEL_COLOURS[0]
_CALIBRATED: dict[str, Any] = {"linestyle": "none", "marker": "D", "markersize": 4.6, "markerfacecolor": style.ORANGE,
                               "markeredgecolor": style.BLACK, "markeredgewidth": 0.7, "zorder": 6}  # fmt: skip
_OTHERS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.4, "markeredgewidth": 0.0, "color": style.BLUE,
                           "zorder": 4}  # fmt: skip
_STARTS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.2, "markerfacecolor": "white",
                           "markeredgecolor": style.GREY, "markeredgewidth": 0.6, "zorder": 3}  # fmt: skip
_TARGET: dict[str, Any] = {"linestyle": "none", "marker": "+", "markersize": 7.0, "markeredgewidth": 1.0, "color": style.BLACK,
                           "zorder": 5}  # fmt: skip
_CURVES: Any = ((style.BLUE, "-", "o"), (style.VERMILLION, "--", "s"), (style.GREEN, "-.", "^"), (style.PURPLE, ":", "v"))


def label(path: str) -> str:
    """A path of the vehicle's file as a short label: ``controller.pitch_rate.Kp`` becomes "pitch rate K_p"."""
    parts = path.split(".")
    parts = parts[1:] if parts[0] in ("controller", "rotors") and len(parts) > 1 else parts
    parts = ["rotor", *parts] if path.startswith("rotors.position.") else parts
    words = [_SYMBOLS.get(part, part.replace("_", " ").replace("$", r"\$")) for part in parts]
    return " ".join(words)


def draw_sensitivities(content: Json) -> Figure:
    """Heat map of d ln target / d ln parameter, beside the two witnesses of what is identified."""
    found, parameters = content["identifiability"], content["calibration"]["parameters"]
    paths = [each["path"] for each in parameters]
    names = [target["response"] for target in content["calibration"]["targets"]]
    values = np.array([[found["sensitivity"][path][name] for name in names] for path in paths])
    height = 1.1 + 0.23 * len(paths)
    margins = style.Margins(left=1.55, right=0.12, bottom=0.42, top=0.56, beside=0.3)
    figure, axes = style.sheet(style.PAGE, height, 1, 2, margins=margins, sharey=True)
    _heat_map(axes[0, 0], values, [_row_label(each) for each in parameters], names)
    _witnesses(axes[0, 1], found, paths)
    handles = [
        Patch(color=style.BLUE, label="prior variance removed: identified"),
        Patch(color=style.FAINT, label="not identified"),
        Line2D([], [], **_STARTS | {"markeredgecolor": style.BLACK}, label="spread kept over starts"),
    ]
    style.key(figure, handles, columns=3)
    return figure


def _row_label(parameter: Json) -> str:
    text = label(parameter["path"])
    return text if parameter["scale"] == "log" else f"{text}, per {parameter['spread']:g} {parameter['unit']}"


def _heat_map(panel: Axes, values: FloatArray, rows: Sequence[str], names: Sequence[str]) -> None:
    largest = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 1.0
    panel.imshow(values, cmap=_DIVERGING, vmin=-largest, vmax=largest, aspect="auto")
    for (i, j), value in np.ndenumerate(values):
        text = "undefined" if math.isnan(value) else f"{value:.2f}".replace("-", "−") if abs(value) >= 0.005 else "0"
        panel.text(j, i, text, ha="center", va="center", fontsize=7.5, color=style.BLACK if text != "0" else style.FAINT)
    panel.set_xticks(range(len(names)), [symbols.mathtext(name) for name in names])
    panel.set_yticks(range(len(rows)), rows)
    panel.tick_params(length=0, top=False, labeltop=True, labelbottom=False)
    panel.set_xlabel("relative change of target / relative change of parameter")
    panel.xaxis.set_label_coords(0.5, -0.035)


def _witnesses(panel: Axes, found: Json, paths: Sequence[str]) -> None:
    """Share of prior variance removed, and spread kept by the other starts; 0.5 parts known from unknown."""
    rows = np.arange(len(paths))
    removed = [found["parameters"][path]["removed"] for path in paths]
    kept = np.array([found["parameters"][path]["spread_ratio"] for path in paths], dtype=float)
    known = [found["parameters"][path]["identified"] for path in paths]
    panel.barh(rows, removed, height=0.62, color=[style.BLUE if each else style.FAINT for each in known], zorder=2)
    panel.plot(kept, rows, **_STARTS | {"markeredgecolor": style.BLACK, "zorder": 4})
    panel.axvline(found["limits"]["removed"], color=style.GREY, linewidth=0.6, linestyle=(0, (4, 2)), zorder=3)
    panel.set_xlim(0.0, max(1.05, 1.05 * float(np.nanmax(kept)) if np.isfinite(kept).any() else 1.05))
    panel.set_xlabel("share")
    panel.tick_params(axis="y", length=0)
    style.grid(panel, "x")


def draw_starts(content: Json) -> Figure:
    """Targets reached from every start, with their accepted ranges, and where each parameter began and ended."""
    targets, runs = content["calibration"]["targets"], content["starts"]
    margins = style.Margins(left=0.5, top=0.34, beside=0.5)
    figure, axes = style.sheet(style.PAGE, 2.1, 1, len(targets), margins=margins)
    for panel, target in zip(axes[0], targets, strict=True):
        _reached(panel, target, runs)
    handles = [
        Line2D([], [], **_CALIBRATED, label="calibrated (start at the priors)"),
        Line2D([], [], **_OTHERS, label="other starts"),
        Line2D([], [], color=style.BLACK, linewidth=0.8, label="target"),
        Patch(color=_ACCEPTED, label="accepted"),
    ]
    style.key(figure, handles, columns=4)
    return figure


def _reached(panel: Axes, target: Json, runs: Sequence[Json]) -> None:
    scale, _ = symbols.field_unit(target["unit"])
    low, high = (scale * end for end in target["accept"])
    values = scale * np.array([run["reached"][target["response"]] for run in runs], dtype=float)
    panel.axhspan(low, high, color=_ACCEPTED, zorder=0)
    panel.axhline(scale * target["value"], color=style.BLACK, linewidth=0.8, zorder=2)
    panel.plot(np.arange(1, len(runs)), values[1:], **_OTHERS)
    panel.plot([0], values[:1], **_CALIBRATED)
    inside = np.append(values[np.isfinite(values)], [low, high])
    pad = 0.12 * float(np.ptp(inside))
    panel.set(ylim=(inside.min() - pad, inside.max() + pad), xlim=(-0.8, len(runs) - 0.2), xlabel="start")
    panel.set_ylabel(symbols.axis_label(target["response"], target["unit"]))


def draw_parameters(content: Json) -> Figure:
    """Each parameter in sigmas of its prior: where the other starts began, where they ended, and the calibrated vehicle."""
    parameters, runs = content["calibration"]["parameters"], content["starts"]
    height = 0.75 + 0.24 * len(parameters)
    figure, axes = style.sheet(style.PAGE, height, margins=style.Margins(left=1.55, right=0.15, bottom=0.42, top=0.3))
    panel: Axes = axes[0, 0]
    for row, each in enumerate(parameters):
        began, ended = (_in_sigmas(each, [run[key][each["path"]] for run in runs]) for key in ("start", "values"))
        for a, b in zip(began[1:], ended[1:], strict=True):
            panel.plot([a, b], [row - 0.16, row + 0.16], color=style.FAINT, linewidth=0.5, zorder=2)
        panel.plot(began[1:], np.full(len(runs) - 1, row - 0.16), **_STARTS)
        panel.plot(ended[1:], np.full(len(runs) - 1, row + 0.16), **_OTHERS)
        panel.plot(ended[:1], [row], **_CALIBRATED)
    panel.set_yticks(range(len(parameters)), [label(each["path"]) for each in parameters])
    panel.set_ylim(len(parameters) - 0.4, -0.6)
    panel.tick_params(axis="y", length=0)
    panel.axvline(0.0, color=style.GREY, linewidth=0.6, zorder=1)
    panel.set_xlabel("distance from the prior of the file, in sigmas of the prior")
    style.grid(panel, "x")
    handles = [
        Line2D([], [], **_STARTS, label="perturbed start (centre of its prior)"),
        Line2D([], [], **_OTHERS, label="where it ended"),
        Line2D([], [], **_CALIBRATED, label="calibrated"),
    ]
    style.key(figure, handles, columns=3)
    return figure


def _in_sigmas(parameter: Json, values: Sequence[float]) -> FloatArray:
    given = np.asarray(values, dtype=float)
    if parameter["scale"] == "log":
        return np.log(given / parameter["prior"]) / math.log(parameter["spread"])
    return (given - parameter["prior"]) / parameter["spread"]


def draw_tradeoff(content: Json) -> Figure:
    """The other targets against the one that is forced through a range."""
    targets = {target["response"]: target for target in content["calibration"]["targets"]}
    across = targets[content["tradeoff"]["response"]]
    others = [target for target in targets.values() if target is not across]
    margins = style.Margins(left=0.5, top=0.34, beside=0.52)
    figure, axes = style.sheet(style.PAGE, 2.5, 1, len(others), margins=margins)
    for panel, target in zip(axes[0], others, strict=True):
        _tradeoff_panel(panel, across, target, content)
    handles: list[Any] = [
        Line2D([], [], color=colour, linestyle=line, marker=marker, markersize=3.0, label=name)
        for (colour, line, marker), name in zip(_CURVES, content["tradeoff"]["curves"], strict=False)
    ]
    handles += [
        Line2D([], [], **_CALIBRATED, label="calibrated"),
        Line2D([], [], **_TARGET, label="targets"),
        Patch(color=_ACCEPTED, label="both accepted"),
    ]
    style.key(figure, handles, columns=len(handles))
    return figure


def _tradeoff_panel(panel: Axes, across: Json, target: Json, content: Json) -> None:
    (sx, _), (sy, _) = symbols.field_unit(across["unit"]), symbols.field_unit(target["unit"])
    (x0, x1), (y0, y1) = (sx * np.array(across["accept"])), (sy * np.array(target["accept"]))
    panel.fill_between([x0, x1], y0, y1, color=_ACCEPTED, linewidth=0.0, zorder=0)
    for (colour, line, marker), points in zip(_CURVES, content["tradeoff"]["curves"].values(), strict=False):
        x, y = (
            scale * np.array([point["reached"][each["response"]] for point in points], dtype=float)
            for scale, each in ((sx, across), (sy, target))
        )
        panel.plot(x, y, color=colour, linestyle=line, marker=marker, markersize=3.0, markeredgewidth=0.0, zorder=3)
    here = content["starts"][0]["reached"]
    panel.plot([sx * here[across["response"]]], [sy * here[target["response"]]], **_CALIBRATED)
    panel.plot([sx * across["value"]], [sy * target["value"]], **_TARGET)
    panel.set_xlabel(symbols.axis_label(across["response"], across["unit"]))
    panel.set_ylabel(symbols.axis_label(target["response"], target["unit"]))
    panel.margins(x=0.06, y=0.08)
    style.grid(panel)
