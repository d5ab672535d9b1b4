"""Sets of coefficients flown one by one: their table, and where they lie on the planes of ADS-33."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
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
_BESIDE: dict[str, Any] = {"linestyle": "none", "marker": "s", "markersize": 3.8, "markeredgewidth": 0.0, "color": style.VERMILLION,
                           "zorder": 5}  # fmt: skip
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
    blocks = [_block(results, key, given[key]) for key in CRITERIA if key in given]
    return {"blocks": blocks, "beside": sorted({block["beside"]["name"] for block in blocks if block["beside"]})}


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
    names, beside = list(block["values"]), block.get("beside")
    units = [symbols.field_unit(results.responses[name.removesuffix("_swept")]["unit"]) for name in names]
    scales = {name: scale for name, (scale, _) in zip(names, units, strict=True)}
    rows = []
    for i, row in enumerate(block["rows"]):
        rows.append(_row(f"{i + 1}", block, i, block["rows"][i - 1] if i else row, block, 0, scales))
        if beside is not None:
            rows.append(_row(f"{i + 1}, {beside['name']}", beside, i, row, block, i, scales))
    return {
        "beside": beside and {"name": beside["name"], "source": beside["source"]},
        "criterion": criterion, "title": symbols.CRITERION_TITLES[criterion], "name": block["name"], "source": block["source"],
        "columns": [symbols.html(name) for name in block["columns"]], "rows": rows, "amplitude": block.get("amplitude"),
        "responses": [{"title": symbols.title(name), "head": symbols.html(name) + _reading(name), "unit": unit or "1"}
                      for name, (_, unit) in zip(names, units, strict=True)],
    }  # fmt: skip


def _row(
    label: str,
    block: Mapping[str, Any],
    i: int,
    before: Sequence[float],
    base: Mapping[str, Any],
    j: int,
    scales: Mapping[str, float],
) -> dict[str, Any]:
    """One case: coefficients that differ from ``before`` are marked; changes of the values are against case ``j`` of ``base``."""
    return {
        "number": label,
        "coefficients": [{"text": number(a), "changed": a != b} for a, b in zip(block["rows"][i], before, strict=True)],
        "values": [
            _value(block, name, i, scale, math.nan if block is base and i == j else base["values"][name][j])
            for name, scale in scales.items()
        ],
        "level": LEVEL_WORDS[Level(block["level"][i])],
    }


def _reading(name: str) -> str:
    """Which of several readings of one symbol a column holds."""
    if not name.startswith(("omega_bw", "tau_p")):
        return ""
    return {"attitude": " (attitude)", "swept": " (rate, swept)"}.get(name.rpartition("_")[2], " (rate)")


def _value(block: Mapping[str, Any], name: str, i: int, scale: float, base: float) -> str:
    """A value with its change from ``base`` (NaN: none is given); where it is undefined or doubted, why."""
    value, status = block["values"][name][i], block["status"][name][i]
    text = number(scale * value)
    if base and math.isfinite(value) and math.isfinite(base):
        text += f" ({100.0 * (value / base - 1.0):+.1f} %)".replace("-", "−")
    return text if status == "ok" else f"{text}: {status}"


def draw_cases(results: Results, block: Mapping[str, Any], plane: Plane) -> Figure:
    """The whole plane with its Levels, and the part of it in which the cases lie, each point with the number of its case."""
    figure, axes = style.sheet(style.PAGE, 3.3, 1, 2, margins=_MARGINS)
    nominal = {name: np.array([entry["nominal"]]) for name, entry in results.responses.items()}
    clouds = [plane.place(block["values"], ""), plane.place(nominal, "")]
    swept = any(name.endswith("_swept") for name in block["values"])
    if swept:
        clouds.append(plane.place(block["values"], "_swept"))
    looks = [_FLOWN, _NOMINAL, _SWEPT][: len(clouds)]
    beside = block.get("beside")
    if beside is not None:
        clouds, looks = [*clouds, plane.place(beside["values"], "")], [*looks, _BESIDE]
    known = np.vstack([cloud[np.isfinite(cloud).all(axis=1)] for cloud in clouds])
    shown = np.vstack([known, plane.least])
    _limit(axes[0, 0], shown, 0.08)
    axes[0, 0].set(ylim=(0.0, None), **({"xlim": (0.0, None)} if shown[:, 0].min() >= 0.0 else {}))
    _limit(axes[0, 1], known if len(known) else plane.least, 0.22)
    for panel, title in zip(axes[0], ("whole plane", "closer"), strict=True):
        panel.set_title(title, y=1.0)
        panel.set_xlabel(plane.labels[0])
        plane.shade(panel)
        for look, cloud in zip(looks, clouds, strict=True):
            panel.plot(*cloud.T, **look, scalex=False, scaley=False)
    axes[0, 0].set_ylabel(plane.labels[1])
    axes[0, 0].yaxis.set_label_coords(-0.12, 0.5)  # the tall root sign of a pole's label would leave the sheet
    plane.name(axes[0, 0], clouds)
    _number(axes[0, 1], clouds[0], clouds[2] if swept else None, clouds[-1] if beside is not None else None)
    _legend(figure, block, plane, clouds[0], swept)
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


def _number(panel: Axes, flown: FloatArray, swept: FloatArray | None, beside: FloatArray | None) -> None:
    """Numbers beside the cases; a line to the swept reading of the same case."""
    known = np.isfinite(flown).all(axis=1)
    lines = np.zeros((0, 4))
    if swept is not None:
        both = known & np.isfinite(swept).all(axis=1)
        lines = np.column_stack([flown[both], swept[both]])
        for x0, y0, x1, y1 in lines:
            panel.plot([x0, x1], [y0, y1], color=style.BLUE, linewidth=0.5, zorder=3, scalex=False, scaley=False)
    points = [flown] if beside is None else [flown, beside]
    texts = [str(i + 1) for cloud in points for i in np.flatnonzero(np.isfinite(cloud).all(axis=1))]
    shown = np.vstack([cloud[np.isfinite(cloud).all(axis=1)] for cloud in points])
    label_points(panel, shown[:, 0], shown[:, 1], texts, lines=lines, size=9.0)


def _legend(figure: Figure, block: Mapping[str, Any], plane: Plane, flown: FloatArray, swept: bool) -> None:
    handles = [Line2D([], [], **_FLOWN, label="case, linear response" if swept else "case")]
    if swept:
        handles.append(Line2D([], [], **_SWEPT, label=f"case, swept with {block['amplitude']:g} m/s"))
    if "beside" in block:
        handles.append(Line2D([], [], **_BESIDE, label=f"case, {block['beside']['name']}"))
    handles.append(Line2D([], [], **_NOMINAL, label="nominal vehicle of the study"))
    for sure in sorted(set(plane.confirmed), reverse=True):
        text = "boundary, confirmed" if sure else "boundary, unverified"
        handles.append(Line2D([], [], **regions.boundary_style(sure), label=text))
    style.key(figure, handles, columns=4)
    lost = [str(i + 1) for i, point in enumerate(flown) if not np.isfinite(point).all()]
    if "beside" in block:
        placed = plane.place(block["beside"]["values"], "")
        lost += [f"{i + 1} ({block['beside']['name']})" for i, point in enumerate(placed) if not np.isfinite(point).all()]
    missing = [f"Undefined and not drawn: case {', '.join(lost)}."] if lost else []
    rate = ["The Levels are those of the reading on attitude, shown behind this one for comparison only."] if swept else []
    style.note(figure, [*missing, *rate, " ".join(CAVEAT)])
