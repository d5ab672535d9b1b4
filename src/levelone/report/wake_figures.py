"""Surfaces, their load and their wake seen in space: orthographic views from behind, drawn from plain arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap, FuncNorm, LinearSegmentedColormap, Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from levelone.aerodynamics.history import FinalWake
from levelone.aerodynamics.particles import Particles, with_images
from levelone.report import style

FloatArray = NDArray[np.float64]
#: the eye: turned from straight behind to the right, and above the horizon, rad
AZIMUTH, ELEVATION = math.radians(35.0), math.radians(28.0)
_SEQUENTIAL = LinearSegmentedColormap.from_list("load", ["#f3f6f8", "#9cc9e3", "#2f7fb8", "#083a66", "#04182c"])
_DIVERGING = LinearSegmentedColormap.from_list("signs", ["#0b4f86", "#7fb6da", "#f4f4f4", "#eba46c", "#a8480a"])
_ARROW = {"arrowstyle": "-|>", "linewidth": 0.7, "color": style.GREY, "shrinkA": 0.0, "shrinkB": 0.0}
_LENGTHS = tuple(part * 10.0**power for power in range(-4, 5) for part in (1.0, 2.0, 5.0))
#: room under a view for its colour bar, in
_UNDER = 0.62
#: particles closer to the plane of symmetry than this share of their core lie in it
_ON_PLANE = 1e-6
_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class WakeArrays:
    """A wake for drawing, in the wind-tunnel frame: ``body`` [b, 4, 3] and ``panels`` [n, 4, 3] (m) with circulation [n] (m^2/s),
    particles at position [p, 3] (m) with strength [p, 3] (m^3/s) and core [p] (m)."""

    body: FloatArray
    panels: FloatArray
    circulation: FloatArray
    position: FloatArray
    strength: FloatArray
    core: FloatArray


def wake_arrays(wake: FinalWake) -> WakeArrays:
    """Both halves of a wake, the mirrored one behind the other."""
    rows, left = wake.panels.rows, wake.panels.edges.left
    ahead, behind = wake.panels.nodes[:-1], wake.panels.nodes[1:]
    quads = np.stack([ahead[:, left], ahead[:, left + 1], behind[:, left + 1], behind[:, left]], axis=2)
    panels = quads.reshape(rows * len(left), 4, 3)
    circulation, body, particles = wake.panels.circulation.ravel(), wake.body, wake.particles
    if wake.mirrored:
        panels, body = (np.concatenate([each, (each * _MIRROR)[:, [1, 0, 3, 2]]]) for each in (panels, body))
        circulation, particles = np.tile(circulation, 2), with_images(_off_plane(particles))
    return WakeArrays(body, panels, circulation, particles.position, particles.strength, particles.core)


def _off_plane(particles: Particles) -> Particles:
    """Particles without the parts along x and z of those in the plane of symmetry, which their images cancel at the same place."""
    inside = np.abs(particles.position[:, 1]) < _ON_PLANE * particles.core
    return replace(particles, strength=np.where(inside[:, None], particles.strength * [0.0, 1.0, 0.0], particles.strength))


def draw_loaded(quads: FloatArray, loads: Sequence[tuple[str, FloatArray]]) -> Figure:
    """Panels [n, 4, 3] (m) coloured by a value [n], one view for each of the values with its label, two in a row."""
    margins = style.Margins(left=0.05, right=0.05, bottom=_UNDER, top=0.05, beside=0.25, between=_UNDER + 0.1)
    rows, columns = -(-len(loads) // 2), min(len(loads), 2)
    tall = (style.PAGE - 0.1 - 0.25 * (columns - 1)) / columns * _shape(quads)
    figure, axes = style.sheet(style.PAGE, rows * (_UNDER + tall + 0.1), rows, columns, margins=margins)
    for panel, (text, values) in zip(axes.flat, loads, strict=False):
        colours, norm = _scale(values)
        _surfaces(panel, quads, facecolors=colours(norm(values)), edgecolors=style.BLACK, linewidths=0.2)
        _frame(panel, quads.reshape(-1, 3))
        _bar(figure, panel, ScalarMappable(norm, colours), text)
    for panel in axes.flat[len(loads) :]:
        panel.set_axis_off()
    return figure


def draw_wake(wake: WakeArrays) -> Figure:
    """Body, panels of the wake by circulation and particles by strength."""
    everything = np.concatenate([wake.body.reshape(-1, 3), wake.panels.reshape(-1, 3), wake.position])
    height = 0.7 + (style.PAGE - 0.1) * _shape(everything)
    figure, axes = style.sheet(style.PAGE, height, margins=style.Margins(left=0.05, right=0.05, bottom=0.65, top=0.05))
    panel: Axes = axes[0, 0]
    bars = []
    if len(wake.position):
        size = np.linalg.norm(wake.strength, axis=1)
        order = np.argsort(_seen(wake.position)[:, 2], kind="stable")
        norm = PowerNorm(0.5, 0.0, float(size.max()) or 1.0)
        at, colours = _seen(wake.position[order]), _upper(_SEQUENTIAL)
        panel.scatter(at[:, 0], at[:, 1], s=1.6, c=colours(norm(size[order])), linewidths=0.0, rasterized=True, zorder=2)
        bars.append((ScalarMappable(norm, colours), r"strength of the particles $|\Gamma l|$, m$^3$/s"))
    if len(wake.panels):
        colours, norm = _scale(wake.circulation)
        _surfaces(panel, wake.panels, facecolors=colours(norm(wake.circulation)), edgecolors=style.GREY, linewidths=0.1, zorder=3)
        bars.append((ScalarMappable(norm, colours), r"circulation of the panels $\Gamma$, m$^2$/s"))
    _surfaces(panel, wake.body, facecolors="#e8e8e8", edgecolors=style.BLACK, linewidths=0.3, zorder=4)
    _frame(panel, everything)
    for index, (mappable, text) in enumerate(bars):
        _bar(figure, panel, mappable, text, index, len(bars))
    return figure


def _seen(points: FloatArray) -> FloatArray:
    """Points [..., 3] as the eye sees them: to the right, up, and towards the eye."""
    x, y, z = np.moveaxis(points, -1, 0)
    right = y * math.cos(AZIMUTH) - x * math.sin(AZIMUTH)
    towards = x * math.cos(AZIMUTH) + y * math.sin(AZIMUTH)
    up = z * math.cos(ELEVATION) - towards * math.sin(ELEVATION)
    return np.stack([right, up, towards * math.cos(ELEVATION) + z * math.sin(ELEVATION)], axis=-1)


def _surfaces(panel: Axes, quads: FloatArray, **look: Any) -> None:
    """Quadrilaterals from the farthest to the nearest."""
    at = _seen(quads)
    order = np.argsort(at[..., 2].mean(axis=1), kind="stable")
    if isinstance(look["facecolors"], np.ndarray):
        look["facecolors"] = look["facecolors"][order]
    panel.add_collection(PolyCollection(at[order, :, :2], **look))


def _shape(points: FloatArray) -> float:
    """Height over width of what is seen, within what a page can take."""
    at = _seen(points).reshape(-1, 3)
    width, height, _ = np.ptp(at, axis=0)
    return float(np.clip(height / width, 0.25, 0.9))


def _frame(panel: Axes, points: FloatArray) -> None:
    """Equal scales, no box, and the axes of the frame with a length in the corner that is empty."""
    at = _seen(points)
    low, high = at[:, :2].min(axis=0), at[:, :2].max(axis=0)
    pad = 0.03 * float(np.max(high - low))
    panel.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad), aspect="equal")
    panel.set_axis_off()
    extent = float(np.max(high - low))
    length = max(part for part in _LENGTHS if part <= 0.09 * extent or part == _LENGTHS[0])
    origin = _corner(at[:, :2], low, high, length)
    for axis, name in enumerate("xyz"):
        tip = origin + _seen(length * np.eye(3)[axis])[:2]
        panel.annotate("", tip, origin, arrowprops=_ARROW)
        panel.text(*(origin + 1.25 * (tip - origin)), f"${name}$", ha="center", va="center", fontsize=8, color=style.GREY)
    panel.text(origin[0], origin[1] - 0.85 * length, f"arrows: {length:g} m", ha="center", va="top", fontsize=7, color=style.GREY)


def _corner(at: FloatArray, low: FloatArray, high: FloatArray, length: float) -> FloatArray:
    """Where arrows of a length hide least of what is seen: near the corner with the fewest points, the upper right first."""
    room = np.array([1.4, 1.2]) * length
    places = [np.where(right, high - room, low + room) for right in ([1, 1], [0, 0], [1, 0], [0, 1])]
    hidden = [np.count_nonzero(np.all(np.abs(at - place) < 1.6 * length, axis=1)) for place in places]
    return places[int(np.argmin(hidden))]


def _scale(values: FloatArray) -> tuple[Colormap, Normalize]:
    """Colours by the square root of the value, from zero up or alike on both sides: not only the leading edge is to be seen."""
    largest = float(np.abs(values).max()) or 1.0
    if values.min() >= -1e-9 * largest:
        return _SEQUENTIAL, PowerNorm(0.5, 0.0, largest)
    return _DIVERGING, FuncNorm((_root, _square), -largest, largest)


def _root(values: FloatArray) -> FloatArray:
    return np.sign(values) * np.sqrt(np.abs(values))


def _square(values: FloatArray) -> FloatArray:
    return np.sign(values) * np.square(values)


def _upper(colours: Colormap) -> Colormap:
    """The darker three quarters: points that are pale cannot be seen."""
    return LinearSegmentedColormap.from_list("upper", colours(np.linspace(0.25, 1.0, 64)))


def _bar(figure: Figure, panel: Axes, mappable: ScalarMappable, text: str, index: int = 0, count: int = 1) -> None:
    """A colour bar under a view."""
    spec = panel.get_subplotspec()
    box = panel.get_position() if spec is None else spec.get_position(figure)
    height, share = figure.get_figheight(), box.width / count
    place = figure.add_axes((box.x0 + (index + 0.16) * share, box.y0 - 0.22 / height, 0.68 * share, 0.08 / height))
    bar = figure.colorbar(mappable, cax=place, orientation="horizontal", ticks=MaxNLocator(4))
    bar.outline.set_linewidth(0.4)  # type: ignore[operator]
    bar.set_label(text)
