"""Level regions and their boundaries on the planes of the standard."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from levelone.handling.levels import Chart, DampingLimits
from levelone.report import style

FloatArray = NDArray[np.float64]

CONFIRMED: dict[str, Any] = {"color": style.BLACK, "linewidth": 0.9, "linestyle": "-", "zorder": 2.2}
UNVERIFIED: dict[str, Any] = {**CONFIRMED, "linestyle": (0, (6, 1.5, 1, 1.5))}
EXTENDED: dict[str, Any] = {"color": style.GREY, "linewidth": 0.7, "linestyle": (0, (3, 2)), "zorder": 2.1}


def boundary_style(confirmed: bool) -> dict[str, Any]:
    """Solid where confirmed, dash-dot where not."""
    return CONFIRMED if confirmed else UNVERIFIED


def shade_chart(panel: Axes, chart: Chart, scale: float, *, sideways: bool) -> None:
    """Fill the Levels over the range of the requirement and draw its boundaries.

    ``scale`` converts the abscissa for display; ``sideways`` puts the abscissa of the file on the vertical axis. The
    limits of the axes must be final.
    """
    along, across = (panel.get_ylim(), panel.get_xlim()) if sideways else (panel.get_xlim(), panel.get_ylim())
    low, high = max(scale * chart.low, along[0]), min(scale * chart.high, along[1])
    known = np.concatenate([scale * chart.level_1_2[:, 0], scale * chart.level_2_3[:, 0]])
    at = np.unique(np.concatenate([np.clip(known, low, high), [low, high]]))
    first, second = (np.clip(limit, *across) for limit in chart.limits(at / scale))
    fill = panel.fill_betweenx if sideways else panel.fill_between
    edges = (np.full_like(at, across[1]), first, second, np.full_like(at, across[0]))
    for upper, lower, colour in zip(edges[:-1], edges[1:], style.LEVEL_COLOURS, strict=True):
        fill(at, lower, upper, color=colour, linewidth=0.0, zorder=0.5)
    for name in ("level_1_2", "level_2_3"):
        _chart_line(panel, chart, name, scale, along, sideways)


def _chart_line(panel: Axes, chart: Chart, name: str, scale: float, along: tuple[float, float], sideways: bool) -> None:
    points = getattr(chart, name)
    index = 0 if name == "level_1_2" else 1
    x, y = scale * points[:, 0], points[:, 1]
    _line(panel, x, y, sideways, **boundary_style(chart.verified), label=f"_{name}")
    for end, edge in ((x[0], along[0]), (x[-1], along[1])):
        if (edge - end) * (1.0 if edge is along[1] else -1.0) > 0.0:
            ends = np.array([end, edge])
            _line(panel, ends, chart.limits(ends / scale)[index], sideways, **EXTENDED, label=f"_{name} extended")


def _line(panel: Axes, x: FloatArray, y: FloatArray, sideways: bool, **look: Any) -> None:
    panel.plot(*((y, x) if sideways else (x, y)), **look, scalex=False, scaley=False)


def damping_curves(limits: DampingLimits, omega_max: float) -> tuple[FloatArray, FloatArray]:
    """Limits of Level 1 and Level 2 as curves ``[point, 2]`` of the pole: real part, imaginary part (rad/s).

    From the origin outwards; at the corner the limit of Level 1 changes, and the curve follows the circle between.
    """
    inner, outer = limits.zeta_below_corner, limits.zeta_1
    arc = pole(np.full(40, limits.corner), np.linspace(inner, outer, 40))
    first = np.vstack([[0.0, 0.0], arc, pole(np.array([omega_max]), np.array([outer]))])
    height = math.sqrt(max(omega_max**2 - limits.growth**2, 0.0))
    return first, np.array([[limits.growth, 0.0], [limits.growth, height]])


def pole(omega_n: FloatArray, zeta: FloatArray) -> FloatArray:
    """The pole ``[n, 2]`` of each pair: ``-zeta omega_n`` and ``omega_n sqrt(1 - zeta^2)``, NaN beyond |zeta| = 1."""
    with np.errstate(invalid="ignore"):
        return np.column_stack([-zeta * omega_n, omega_n * np.sqrt(1.0 - zeta**2)])


def shade_damping(panel: Axes, limits: DampingLimits) -> None:
    """Fill the Levels of the pole's plane and draw the limits; the limits of the axes must be final."""
    (left, right), (_, top) = panel.get_xlim(), panel.get_ylim()
    first, second = damping_curves(limits, 4.0 * math.hypot(max(-left, right), top))
    far = first[-1]
    level_1 = [*first, (10.0 * left - 1.0, far[1]), (10.0 * left - 1.0, 0.0)]
    level_2 = [*first, second[1], second[0]]
    level_3 = [second[0], second[1], (10.0 * right + 1.0, second[1][1]), (10.0 * right + 1.0, 0.0)]
    for corners, colour, order in ((level_3, 2, 0.4), (level_2, 1, 0.5), (level_1, 0, 0.6)):
        panel.fill(*np.array(corners).T, color=style.LEVEL_COLOURS[colour], linewidth=0.0, zorder=order)
    look: dict[str, Any] = {"scalex": False, "scaley": False}
    unsure = boundary_style(limits.verified)
    panel.plot(*first[:-1].T, **unsure, **look, label="_level_1_2 corner")
    panel.plot(*first[-2:].T, **boundary_style(limits.confidence_zeta_1 == "high"), **look, label="_level_1_2")
    panel.plot(*second.T, **unsure, **look, label="_level_2_3")


def name_level(
    panel: Axes, level: int, places: Sequence[tuple[float, float]], clouds: Iterable[FloatArray], **options: Any
) -> None:
    """Write "Level n" at the place (fractions of the axes) that lies farthest from the data ``[n, 2]``."""
    points = np.vstack([cloud[np.isfinite(cloud).all(axis=1)] for cloud in clouds])
    drawn = panel.transAxes.inverted().transform(panel.transData.transform(points)) if len(points) else np.full((1, 2), 9.0)
    room = [float(np.hypot(*(drawn - place).T).min()) for place in places]
    x, y = places[int(np.argmax(room))]
    look = {"ha": "center", "va": "center", "fontsize": 8, "color": "#404040", "zorder": 2.5, **options}
    panel.text(x, y, f"Level {level}", transform=panel.transAxes, **look)
