"""Sets of coefficients flown one by one: their table, and where they lie on the planes of ADS-33."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from levelone.handling.levels import Chart, DampingLimits, Level
from levelone.report import regions, style, symbols
from levelone.report.charts import Charts, charts_of
from levelone.report.formatting import number
from levelone.report.labels import label_points
from levelone.report.level_names import name_layers, name_sectors
from levelone.report.pictures import Picture
from levelone.report.planes import CAVEAT
from levelone.report.results import CRITERIA, Results
from levelone.report.tables import LEVEL_WORDS

FloatArray = NDArray[np.float64]

DEG = 180.0 / math.pi
_MARGINS = style.Margins(left=0.58, bottom=0.66, top=0.46, beside=0.62)
_FLOWN: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.0, "markeredgewidth": 0.0, "color": style.BLUE,
                          "zorder": 5}  # fmt: skip
_SWEPT: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4.0, "markerfacecolor": "white",
                          "markeredgecolor": style.BLUE, "markeredgewidth": 0.8, "zorder": 4}  # fmt: skip
_NOMINAL: dict[str, Any] = {"linestyle": "none", "marker": "D", "markersize": 4.6, "markerfacecolor": style.ORANGE,
                            "markeredgecolor": style.BLACK, "markeredgewidth": 0.7, "zorder": 6}  # fmt: skip


@dataclass(frozen=True)
class Plane:
    """Where a criterion's points lie ``[n, 2]``, how the Levels are shaded and named, and what the whole plane must show."""

    place: Callable[[Mapping[str, Any], str], FloatArray]
    shade: Callable[[Axes], None]
    labels: tuple[str, str]
    least: FloatArray
    name: Callable[[Axes, list[FloatArray]], None]
    confirmed: tuple[bool, ...]


def context(results: Results) -> dict[str, Any] | None:
    """Tables of the cases; None where the study has none."""
    given = results.summary.get("cases")
    if not given:
        return None
    return {"blocks": [_block(results, key, given[key]) for key in CRITERIA if key in given]}


def pictures(results: Results) -> list[Picture]:
    """One plane for each criterion that has cases."""
    given, charts = results.summary.get("cases") or {}, charts_of(results.summary["study"])
    return [
        Picture(f"cases_{key}", "cases",
                f"{given[key]['name']}: the cases as numbered points on the plane of the requirement (left), and closer (right).",
                True, partial(draw_cases, results, given[key], _plane(key, charts)))
        for key in CRITERIA if key in given
    ]  # fmt: skip


def _block(results: Results, criterion: str, block: Mapping[str, Any]) -> dict[str, Any]:
    names = list(block["values"])
    units = [symbols.field_unit(results.responses[name.removesuffix("_swept")]["unit"]) for name in names]
    rows = []
    for i, row in enumerate(block["rows"]):
        before = block["rows"][i - 1] if i else row
        rows.append({
            "number": i + 1,
            "coefficients": [{"text": number(a), "changed": a != b} for a, b in zip(row, before, strict=True)],
            "values": [_value(block, name, i, scale) for name, (scale, _) in zip(names, units, strict=True)],
            "level": LEVEL_WORDS[Level(block["level"][i])],
        })  # fmt: skip
    return {
        "criterion": criterion, "title": symbols.CRITERION_TITLES[criterion], "name": block["name"], "source": block["source"],
        "columns": [symbols.html(name) for name in block["columns"]], "rows": rows, "amplitude": block.get("amplitude"),
        "responses": [{"title": symbols.title(name), "head": symbols.html(name) + _reading(name), "unit": unit or "1"}
                      for name, (_, unit) in zip(names, units, strict=True)],
    }  # fmt: skip


def _reading(name: str) -> str:
    """Which of several readings of one symbol a column holds."""
    if not name.startswith(("omega_bw", "tau_p")):
        return ""
    return {"attitude": " (attitude)", "swept": " (rate, swept)"}.get(name.rpartition("_")[2], " (rate)")


def _value(block: Mapping[str, Any], name: str, i: int, scale: float) -> str:
    """A value with its change from the first case; where it is undefined or doubted, why."""
    values, status = block["values"][name], block["status"][name][i]
    text = number(scale * values[i])
    if i and values[0] and math.isfinite(values[i]) and math.isfinite(values[0]):
        text += f" ({100.0 * (values[i] / values[0] - 1.0):+.1f} %)".replace("-", "−")
    return text if status == "ok" else f"{text}: {status}"


def draw_cases(results: Results, block: Mapping[str, Any], plane: Plane) -> Figure:
    """The whole plane with its Levels, and the part of it in which the cases lie, each point with the number of its case."""
    figure, axes = style.sheet(style.PAGE, 3.3, 1, 2, margins=_MARGINS)
    nominal = {name: np.array([entry["nominal"]]) for name, entry in results.responses.items()}
    clouds = [plane.place(block["values"], ""), plane.place(nominal, "")]
    if any(name.endswith("_swept") for name in block["values"]):
        clouds.append(plane.place(block["values"], "_swept"))
    known = np.vstack([cloud[np.isfinite(cloud).all(axis=1)] for cloud in clouds])
    shown = np.vstack([known, plane.least])
    _limit(axes[0, 0], shown, 0.08)
    axes[0, 0].set(ylim=(0.0, None), **({"xlim": (0.0, None)} if shown[:, 0].min() >= 0.0 else {}))
    _limit(axes[0, 1], known if len(known) else plane.least, 0.22)
    for panel, title in zip(axes[0], ("whole plane", "closer"), strict=True):
        panel.set_title(title, y=1.0)
        panel.set_xlabel(plane.labels[0])
        plane.shade(panel)
        for look, cloud in zip((_FLOWN, _NOMINAL, _SWEPT), clouds, strict=False):
            panel.plot(*cloud.T, **look, scalex=False, scaley=False)
    axes[0, 0].set_ylabel(plane.labels[1])
    axes[0, 0].yaxis.set_label_coords(-0.12, 0.5)  # the tall root sign of a pole's label would leave the sheet
    plane.name(axes[0, 0], clouds)
    _number(axes[0, 1], clouds)
    _legend(figure, block, plane, clouds)
    return figure


def _plane(criterion: str, charts: Charts) -> Plane:
    """The plane of one criterion in the units of the field, as the Monte Carlo runs are drawn."""
    if criterion == "attitude_quickness":
        return _quickness_plane(charts.attitude_quickness)
    return _stability_plane(charts.dynamic_stability) if criterion == "dynamic_stability" else _bandwidth_plane(charts.bandwidth)


def _quickness_plane(chart: Chart) -> Plane:
    return Plane(
        lambda values, suffix: np.column_stack([DEG * np.array(values["delta_theta_min"]), values["quickness"]]),
        lambda panel: regions.shade_chart(panel, chart, DEG, sideways=False),
        (symbols.axis_label("delta_theta_min", "rad"), symbols.axis_label("quickness", "1/s")),
        np.array([[0.0, 0.0], [DEG * chart.high, 1.6 * chart.level_1_2[:, 1].max()]]),
        lambda panel, clouds: name_layers(panel, chart, clouds),
        (chart.verified,),
    )


def _stability_plane(limits: DampingLimits) -> Plane:
    return Plane(
        lambda values, suffix: regions.pole(np.array(values["omega_n"]), np.array(values["zeta"])),
        lambda panel: regions.shade_damping(panel, limits),
        (r"$-\zeta\,\omega_n$, rad/s", r"damped frequency $\omega_d$, rad/s"),
        np.array([[-1.0, 0.0], [1.0, 1.0]]),
        lambda panel, clouds: name_sectors(panel, limits, clouds),
        (limits.confidence_zeta_1 == "high", limits.verified),
    )


def _bandwidth_plane(chart: Chart) -> Plane:
    return Plane(
        lambda values, suffix: np.column_stack([values["omega_bw" + suffix], values["tau_p" + suffix]]),
        lambda panel: regions.shade_chart(panel, chart, 1.0, sideways=True),
        (symbols.axis_label("omega_bw", "rad/s"), symbols.axis_label("tau_p", "s")),
        np.array([[0.0, 0.0], [2.0 * chart.level_1_2[:, 1].max(), chart.high]]),
        lambda panel, clouds: regions.name_level(panel, 1, [(0.85, 0.1), (0.5, 0.1), (0.5, 0.9)], clouds),
        (chart.verified,),
    )


def _limit(panel: Axes, points: FloatArray, room: float) -> None:
    """Limits around points, with room in parts of their extent."""
    low, high = points.min(axis=0), points.max(axis=0)
    extent = np.maximum(high - low, 1e-3 * np.maximum(np.abs(high), 1e-9))
    (x0, y0), (x1, y1) = low - room * extent, high + room * extent
    panel.set(xlim=(x0, x1), ylim=(y0, y1))


def _number(panel: Axes, clouds: list[FloatArray]) -> None:
    """Numbers beside the cases; a line to the swept reading of the same case."""
    flown = clouds[0]
    known = np.isfinite(flown).all(axis=1)
    lines = np.zeros((0, 4))
    if len(clouds) > 2:
        both = known & np.isfinite(clouds[2]).all(axis=1)
        lines = np.column_stack([flown[both], clouds[2][both]])
        for x0, y0, x1, y1 in lines:
            panel.plot([x0, x1], [y0, y1], color=style.BLUE, linewidth=0.5, zorder=3, scalex=False, scaley=False)
    texts = [str(i + 1) for i in np.flatnonzero(known)]
    label_points(panel, flown[known, 0], flown[known, 1], texts, lines=lines, size=9.0)


def _legend(figure: Figure, block: Mapping[str, Any], plane: Plane, clouds: list[FloatArray]) -> None:
    swept = len(clouds) > 2
    handles = [Line2D([], [], **_FLOWN, label="case, linear response" if swept else "case")]
    if swept:
        handles.append(Line2D([], [], **_SWEPT, label=f"case, swept with {block['amplitude']:g} m/s"))
    handles.append(Line2D([], [], **_NOMINAL, label="nominal vehicle of the study"))
    for sure in sorted(set(plane.confirmed), reverse=True):
        text = "boundary, confirmed" if sure else "boundary, unverified"
        handles.append(Line2D([], [], **regions.boundary_style(sure), label=text))
    style.key(figure, handles, columns=4)
    lost = [str(i + 1) for i, point in enumerate(clouds[0]) if not np.isfinite(point).all()]
    missing = [f"Undefined and not drawn: case {', '.join(lost)}."] if lost else []
    rate = ["The Levels are those of the reading on attitude, shown behind this one for comparison only."] if swept else []
    style.note(figure, [*missing, *rate, " ".join(CAVEAT)])
