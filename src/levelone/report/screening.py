"""Morris screening: how much a factor moves a response, against how unevenly it does so."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from levelone.report import style, symbols
from levelone.report.labels import label_points

RATIOS = (0.1, 0.5, 1.0)
"""sigma / mu_star up to which a factor counts as almost linear, monotonic, almost monotonic."""

_RAY: dict[str, Any] = {"color": style.FAINT, "linewidth": 0.6, "linestyle": (0, (4, 2)), "zorder": 1}


def draw_screening(response: str, entry: Mapping[str, Any]) -> Figure:
    """mu_star against sigma of every factor of one response, with bootstrap intervals, in the unit of the field."""
    scale, _ = symbols.field_unit(entry["unit"])
    names, mu_star, sigma, spread = _effects(entry["morris"], scale)
    figure, axes = style.sheet(style.COLUMN, 2.8, margins=style.Margins(left=0.62, right=0.3, top=0.2))
    panel: Axes = axes[0, 0]
    unit = symbols.field_unit(entry["unit"])[1]
    panel.set_xlabel(rf"$\mu^*$ of {symbols.axis_label(response, entry['unit'])}")
    panel.set_ylabel(rf"$\sigma$, {unit}" if unit else r"$\sigma$")
    known = np.isfinite(mu_star) & np.isfinite(sigma)
    if not known.any():
        panel.text(0.5, 0.5, f"undefined:\n{entry['status']}", transform=panel.transAxes, ha="center", va="center", wrap=True)
        panel.set(xticks=[], yticks=[])
        return figure
    right, top = _limits(panel, mu_star[known], sigma[known], spread[known])
    panel.errorbar(
        mu_star[known], sigma[known], xerr=spread[known, :2].T, yerr=spread[known, 2:].T, fmt="none", ecolor="#9cc3dd",
        elinewidth=0.6, zorder=2,
    )  # fmt: skip
    panel.plot(mu_star[known], sigma[known], "o", markersize=3.6, markeredgewidth=0.0, color=style.BLUE, zorder=4, label="_factors")
    rays = _rays(panel, right, top)
    lines = np.vstack([rays, _whiskers(mu_star[known], sigma[known], spread[known])])
    label_points(panel, mu_star[known], sigma[known], [symbols.mathtext(name) for name in names[known]], lines=lines)
    return figure


def _effects(morris: Mapping[str, Any], scale: float) -> tuple[NDArray[np.str_], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Names, mu_star, sigma ``[k]`` and how far their intervals reach left, right, down, up ``[k, 4]``."""
    names = np.array(list(morris))
    mu_star = scale * np.array([morris[name]["mu_star"] for name in names], dtype=np.float64)
    sigma = scale * np.array([morris[name]["sigma"] for name in names], dtype=np.float64)
    ends = scale * np.array([[*morris[name]["mu_star_ci"], *morris[name]["sigma_ci"]] for name in names], dtype=np.float64)
    reach = np.column_stack([mu_star - ends[:, 0], ends[:, 1] - mu_star, sigma - ends[:, 2], ends[:, 3] - sigma])
    return names, mu_star, sigma, np.clip(np.nan_to_num(reach), 0.0, None)


def _limits(panel: Axes, mu_star: NDArray[Any], sigma: NDArray[Any], spread: NDArray[Any]) -> tuple[float, float]:
    right = 1.1 * float((mu_star + spread[:, 1]).max())
    top = 1.15 * float((sigma + spread[:, 3]).max())
    right, top = (value if math.isfinite(value) and value > 0.0 else 1.0 for value in (right, top))
    panel.set(xlim=(-0.03 * right, right), ylim=(-0.09 * top, top))
    return right, top


def _rays(panel: Axes, right: float, top: float) -> NDArray[Any]:
    """Lines of equal sigma / mu_star, named where they leave the frame; returns their ends ``[line, 4]``."""
    ends = []
    panel.text(1.015, 1.01, r"$\sigma/\mu^*$", transform=panel.transAxes, fontsize=7, color=style.GREY)
    for ratio in RATIOS:
        x = min(right, top / ratio)
        ends.append((0.0, 0.0, x, ratio * x))
        panel.plot([0.0, x], [0.0, ratio * x], **_RAY, label=f"_ratio {ratio:g}")
        above = ratio * right > top
        panel.annotate(
            f"{ratio:g}", (x, ratio * x),
            xytext=(0, 2) if above else (3, 0), textcoords="offset points", fontsize=7, color=style.GREY,
            ha="center" if above else "left", va="bottom" if above else "center", annotation_clip=False,
        )  # fmt: skip
    return np.array(ends)


def _whiskers(mu_star: NDArray[Any], sigma: NDArray[Any], spread: NDArray[Any]) -> NDArray[Any]:
    """Ends ``[line, 4]`` of the intervals, for labels to keep off."""
    left, right, down, up = spread.T
    along = np.column_stack([mu_star - left, sigma, mu_star + right, sigma])
    return np.vstack([along, np.column_stack([mu_star, sigma - down, mu_star, sigma + up])])
