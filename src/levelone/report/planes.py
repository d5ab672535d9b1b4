"""Monte Carlo runs on the planes of ADS-33, with their Level regions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from levelone.handling.levels import Chart, DampingLimits
from levelone.report import regions, style, symbols
from levelone.report.results import Results

FloatArray = NDArray[np.float64]

DEG = 180.0 / math.pi
CAVEAT = (
    "An attitude criterion re-read for a velocity-command aircraft;",
    "limits are those of full-scale helicopters.",
)
_MARGINS = style.Margins(bottom=0.74, top=0.46, left=0.42)
_WIDE = style.Margins(bottom=0.62, top=0.48, beside=0.2)
_ZOOMED = (0.02, 0.98)
"""Quantiles of the runs between which the closer view reaches."""
_RUNS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 2.2, "markeredgewidth": 0.0, "color": style.BLUE,
                         "alpha": 0.55, "zorder": 3}  # fmt: skip
_NOMINAL: dict[str, Any] = {"linestyle": "none", "marker": "D", "markersize": 4.6, "markerfacecolor": style.ORANGE,
                            "markeredgecolor": style.BLACK, "markeredgewidth": 0.7, "zorder": 6}  # fmt: skip


def draw_quickness_plane(results: Results, chart: Chart) -> Figure:
    """Attitude quickness over the minimum attitude change; boundaries below the requirement's range dashed."""
    cloud = np.column_stack([DEG * results.sample("delta_theta_min"), results.sample("quickness")])
    point = np.array([[DEG * _nominal(results, "delta_theta_min"), _nominal(results, "quickness")]])
    figure, axes = style.sheet(style.COLUMN, 3.5, margins=_MARGINS)
    panel = axes[0, 0]
    high = np.nanmax(np.vstack([cloud, point, [[DEG * chart.high, 1.6 * chart.level_1_2[:, 1].max()]]]), axis=0)
    panel.set(xlim=(0.0, float(max(DEG * chart.high, 1.08 * high[0]))), ylim=(0.0, 1.25 * float(high[1])))
    panel.set_xlabel(symbols.axis_label("delta_theta_min", "rad"))
    panel.set_ylabel(symbols.axis_label("quickness", "1/s"))
    regions.shade_chart(panel, chart, DEG, sideways=False)
    _cloud(panel, cloud, point)
    _outside_range(panel, chart)
    _zoom(panel, cloud, point, lambda inset: regions.shade_chart(inset, chart, DEG, sideways=False))
    first, second = (float(limit) / panel.get_ylim()[1] for limit in chart.limits(0.8 * chart.high))
    clouds = (cloud, point)
    regions.name_level(panel, 1, [(0.9, first + 0.07)], clouds)
    regions.name_level(panel, 2, [(0.9, 0.5 * (first + second))], clouds)
    regions.name_level(panel, 3, [(0.9, 0.5 * second)], clouds)
    _legend(figure, point, [chart.verified], extended=True)
    style.note(figure, [_count(cloud), *CAVEAT])
    return figure


def draw_stability_plane(results: Results, limits: DampingLimits) -> Figure:
    """The mode's pole: damping grows to the left, frequency upwards."""
    cloud = regions.pole(results.sample("omega_n"), results.sample("zeta"))
    point = regions.pole(np.array([_nominal(results, "omega_n")]), np.array([_nominal(results, "zeta")]))
    figure, axes = style.sheet(style.COLUMN, 3.5, margins=_MARGINS)
    panel = axes[0, 0]
    both = np.vstack([cloud, point, [[-1.0, 1.0], [1.0, 1.0]]])
    left, right = float(np.nanmin(both[:, 0])), float(np.nanmax(both[:, 0]))
    panel.set(xlim=(1.35 * left, 1.35 * right), ylim=(0.0, 1.3 * float(np.nanmax(both[:, 1]))))
    panel.set_xlabel(r"$-\zeta\,\omega_n$, rad/s")
    panel.set_ylabel(r"damped frequency $\omega_d$, rad/s")
    regions.shade_damping(panel, limits)
    _cloud(panel, cloud, point)
    span = panel.get_xlim()[1] - panel.get_xlim()[0]
    axis, height = -panel.get_xlim()[0] / span, panel.get_ylim()[1]
    ray = limits.zeta_1 / math.sqrt(1.0 - limits.zeta_1**2) * 0.93 * height / span
    clouds = (cloud, point)
    regions.name_level(panel, 1, [(0.5 * (axis - ray), 0.93), (0.12, 0.2)], clouds)
    regions.name_level(panel, 2, [(axis - 0.42 * ray, 0.93)], clouds)
    regions.name_level(panel, 3, [(0.5 * (axis + 1.0), y) for y in (0.93, 0.1)], clouds)
    y = 0.2 * height
    panel.annotate(
        rf"$\zeta$ = {limits.zeta_1:g}", (-y * limits.zeta_1 / math.sqrt(1.0 - limits.zeta_1**2), y), xytext=(-8, 0),
        textcoords="offset points", ha="right", va="center", fontsize=8,
    )  # fmt: skip
    _legend(figure, point, [limits.confidence_zeta_1 == "high", limits.verified])
    style.note(figure, [_count(cloud), *CAVEAT])
    return figure


def draw_bandwidth_plane(results: Results, chart: Chart) -> Figure:
    """Phase delay over bandwidth, one panel for each reading; only the one on attitude has a Level."""
    readings = {
        "_attitude": r"$-\theta/V_{\mathrm{lon}}$: sets the Level",
        "": r"$q/V_{\mathrm{lon}}$: not the standard's reading",
    }
    clouds = {
        suffix: np.column_stack([results.sample("omega_bw" + suffix), results.sample("tau_p" + suffix)]) for suffix in readings
    }
    points = {
        suffix: np.array([[_nominal(results, "omega_bw" + suffix), _nominal(results, "tau_p" + suffix)]]) for suffix in readings
    }
    figure, axes = style.sheet(style.PAGE, 3.1, 1, 2, sharex=True, sharey=True, margins=_WIDE)
    high = np.nanmax(np.vstack([*clouds.values(), *points.values(), [[2.0 * chart.level_1_2[:, 1].max(), chart.high]]]), axis=0)
    for panel, (suffix, title) in zip(axes[0], readings.items(), strict=True):
        panel.set(xlim=(0.0, 1.1 * float(high[0])), ylim=(0.0, 1.3 * float(high[1])))
        panel.set_title(title, y=1.0)
        panel.set_xlabel(r"$\omega_{\mathrm{BW}}$, rad/s")
        regions.shade_chart(panel, chart, 1.0, sideways=True)
        _cloud(panel, clouds[suffix], points[suffix])
        _name_bands(panel, chart, (clouds[suffix], points[suffix]))
        panel.text(
            0.97, 0.97, f"chart unknown above {chart.high:g} s", transform=panel.transAxes, ha="right", va="top", fontsize=7.5,
            color=style.GREY,
        )  # fmt: skip
    axes[0, 0].set_ylabel(r"$\tau_p$, s")
    _legend(figure, np.hstack(list(points.values())), [chart.verified], extended=True)
    left, right = (_count(cloud) for cloud in clouds.values())
    style.note(figure, [left if left == right else f"Left: {left} Right: {right}", " ".join(CAVEAT)])
    return figure


def _nominal(results: Results, response: str) -> float:
    return float(results.responses[response]["nominal"])


def _cloud(panel: Axes, cloud: FloatArray, point: FloatArray) -> None:
    panel.plot(*cloud.T, **_RUNS, scalex=False, scaley=False, label="_runs")
    panel.plot(*point.T, **_NOMINAL, scalex=False, scaley=False, label="_nominal")


def _outside_range(panel: Axes, chart: Chart) -> None:
    """Say where the requirement begins."""
    low = DEG * chart.low
    panel.axvline(low, color=style.GREY, linewidth=0.6, zorder=2)
    panel.annotate(
        rf"$\leftarrow$ no requirement below {low:g} deg", (low, 0.985), xycoords=("data", "axes fraction"), xytext=(3, 0),
        textcoords="offset points", ha="left", va="top", fontsize=7.5, color=style.GREY,
    )  # fmt: skip


def _name_bands(panel: Axes, chart: Chart, clouds: tuple[FloatArray, ...]) -> None:
    """Names of Levels that lie side by side along the horizontal axis."""
    width = panel.get_xlim()[1]
    first, second = (float(limit) / width for limit in chart.limits(0.5 * chart.high))
    middle = 0.5 * chart.high / panel.get_ylim()[1]
    regions.name_level(panel, 1, [(x, y * middle) for x in (0.85, 0.5, 0.3) for y in (1.7, 0.3)], clouds)
    regions.name_level(panel, 2, [(0.5 * (first + second), middle)], clouds, rotation=90, fontsize=7)
    regions.name_level(panel, 3, [(0.5 * second, middle)], clouds, rotation=90, fontsize=7)


def _zoom(panel: Axes, cloud: FloatArray, point: FloatArray, shade: Any) -> None:
    """A closer view of all but a few outliers where they fill a small part of the plane; never over a run."""
    known = np.vstack([cloud[np.isfinite(cloud).all(axis=1)], point[np.isfinite(point).all(axis=1)]])
    if len(known) < 2:
        return
    x, y, width, height = place = (0.38, 0.52, 0.51, 0.40)
    frame = np.array([panel.get_xlim()[1], panel.get_ylim()[1]])
    low, high = np.quantile(known, _ZOOMED, axis=0)
    covered = ((known / frame > (x, y - 0.07)) & (known / frame < (x + width + 0.08, y + height))).all(axis=1)
    if high[0] / frame[0] > 0.3 or covered.any():
        return
    pad = 0.06 * np.maximum(high - low, 1e-3 * frame)
    inset = panel.inset_axes(place)
    inset.set(xlim=(low[0] - pad[0], high[0] + pad[0]), ylim=(low[1] - pad[1], high[1] + pad[1]))
    shade(inset)
    _cloud(inset, cloud, point)
    inset.tick_params(labelsize=7)
    inset.yaxis.tick_right()
    panel.indicate_inset_zoom(inset, edgecolor=style.GREY, linewidth=0.5, alpha=1.0)


def _count(cloud: FloatArray) -> str:
    """How many runs the picture shows, and how many it cannot."""
    missing = int((~np.isfinite(cloud).all(axis=1)).sum())
    if missing:
        return f"{missing} of {len(cloud)} Monte Carlo runs are undefined and not drawn."
    return f"{len(cloud)} Monte Carlo runs."


def _legend(figure: Figure, point: FloatArray, confirmed: list[bool], extended: bool = False) -> None:
    handles = [Line2D([], [], **_RUNS, label="Monte Carlo runs")]
    shown = "nominal" if np.isfinite(point).all() else "nominal: undefined"
    handles.append(Line2D([], [], **_NOMINAL, label=shown))
    for sure in sorted(set(confirmed), reverse=True):
        text = "boundary, confirmed" if sure else "boundary, unverified"
        handles.append(Line2D([], [], **regions.boundary_style(sure), label=text))
    if extended:
        handles.append(Line2D([], [], **regions.EXTENDED, label="boundary, extended"))
    style.key(figure, handles, columns=4 if figure.get_figwidth() > style.COLUMN else 2)
