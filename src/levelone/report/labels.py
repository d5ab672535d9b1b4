"""Labels beside points so that they cover neither each other nor the points."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Annotation
from numpy.typing import NDArray

from levelone.report.style import GREY, renderer

FloatArray = NDArray[np.float64]
Pairs = dict[int, dict[int, FloatArray]]

_RINGS = (0.0, 4.0, 9.0, 15.0, 22.0, 30.0, 40.0, 52.0)
_DIRECTIONS = 24
_TOGETHER, _CLUSTER = 3.5, 3
_STARTS = 24
_SWEEPS = 12
_STAND_OFF = 2.6
_MARKER = 3.6
_LEADER_FROM = 5.0
# What a label pays, in points of distance: leaving the frame (per point), covering a label or a point (per square
# point), its leader crossing another, running under a label or over a point, and standing on a thin line.
_OUT, _ON_LABEL, _ON_POINT, _CROSSING, _UNDER, _OVER, _ON_LINE = 1e4, 300.0, 200.0, 90.0, 150.0, 20.0, 25.0


def label_points(
    axes: Axes, x: FloatArray, y: FloatArray, texts: Sequence[str], *, lines: FloatArray | None = None, size: float = 8.0
) -> list[Annotation]:
    """Write ``texts`` beside the points (data coordinates), with thin leaders where the way is long.

    Points that print on top of each other share one block of labels and one leader. Labels keep off ``lines``
    ``[n, 4]`` (x0, y0, x1, y1) where they can. Call it last, with the limits of the axes final. The same input gives
    the same places.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    drawing, scale = renderer(figure), figure.dpi / 72.0
    notes = [
        axes.annotate(text, (px, py), xytext=(0, 0), textcoords="offset points", fontsize=size, ha="center", va="center",
                      annotation_clip=False)
        for text, px, py in zip(texts, x, y, strict=True)
    ]  # fmt: skip
    boxes = [item.get_window_extent(drawing) for item in notes]
    sizes = np.array([(box.width, box.height) for box in boxes]).reshape(-1, 2) / scale + 1.5
    points = axes.transData.transform(np.column_stack([x, y])) / scale
    ends = np.zeros((0, 4)) if lines is None else lines
    segments = axes.transData.transform(ends.reshape(-1, 2)).reshape(-1, 4) / scale
    groups = group(points)
    cells = [_cells(sizes[members]) for members in groups]
    middles = np.array([points[members].mean(axis=0) for members in groups]).reshape(-1, 2)
    blocks = np.array([block for _, block in cells]).reshape(-1, 2)
    frame = np.array([axes.bbox.x0, axes.bbox.y0, axes.bbox.x1, axes.bbox.y1]) / scale
    centres = place(middles, blocks, frame, segments)
    for members, (offsets, block), middle, centre in zip(groups, cells, middles, centres, strict=True):
        for i, offset in zip(members, offsets, strict=True):
            notes[i].set_position(tuple(centre + offset - points[i]))
        _lead(axes, notes[members[0]].xy, middle - points[members[0]], centre - middle, block)
    return notes


def group(points: FloatArray) -> list[list[int]]:
    """Indices of points that cannot be told apart in print, gathered around the first of them; alone unless they are many."""
    groups: list[list[int]] = []
    for i, point in enumerate(points):
        near = (members for members in groups if np.hypot(*(points[members[0]] - point)) < _TOGETHER)
        found = next(near, None)
        if found is None:
            groups.append([i])
        else:
            found.append(i)
    return [part for members in groups for part in ([members] if len(members) >= _CLUSTER else [[i] for i in members])]


def _cells(sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Offsets ``[n, 2]`` of the labels of one block from its centre, row by row from the top, and the block's size."""
    columns = math.ceil(math.sqrt(len(sizes)))
    rows = math.ceil(len(sizes) / columns)
    width, height = sizes.max(axis=0)
    width += 2.0 if columns > 1 else 0.0
    row, column = np.divmod(np.arange(len(sizes)), columns)
    offsets = np.column_stack([(column - 0.5 * (columns - 1)) * width, (0.5 * (rows - 1) - row) * height])
    return offsets, np.array([columns * width, rows * height])


def place(points: FloatArray, sizes: FloatArray, bounds: FloatArray, lines: FloatArray) -> FloatArray:
    """Centres ``[n, 2]`` of labels of given sizes ``[n, 2]`` beside points ``[n, 2]``, inside ``bounds`` (x0, y0, x1, y1).

    Each label in turn takes the cheapest of a fixed set of places around its point, until none moves; of several
    starts, in different orders, the cheapest result counts. All lengths in points of print.
    """
    n = len(points)
    spots = [_candidates(point, extent) for point, extent in zip(points, sizes, strict=True)]
    alone = [_cost_alone(spots[i], sizes[i], i, points, bounds, lines) for i in range(n)]
    pairs: Pairs = {i: {} for i in range(n)}
    for i in range(n):
        for j in range(i):
            cost = _cost_of_pair(spots[i], sizes[i], points[i], spots[j], sizes[j], points[j])
            if cost.any():
                pairs[i][j], pairs[j][i] = cost, cost.T
    rng = np.random.default_rng(0)
    results = [_descend(alone, pairs, rng.permutation(n)) for _ in range(_STARTS)]
    best = min(results, key=lambda result: result[1])[0]
    return np.array([spots[i][choice] for i, choice in best.items()]).reshape(-1, 2)


def _descend(alone: list[FloatArray], pairs: Pairs, order: NDArray[np.int64]) -> tuple[dict[int, int], float]:
    """Place of each label after moving one at a time, and the cost of all."""
    chosen: dict[int, int] = {}
    for _ in range(_SWEEPS):
        before = dict(chosen)
        for i in order.tolist():
            cost = alone[i].copy()
            for j, table in pairs[i].items():
                if j in chosen:
                    cost += table[:, chosen[j]]
            chosen[i] = int(np.argmin(cost))
        if chosen == before:
            break
    mutual = sum(float(table[chosen[i], chosen[j]]) for i, row in pairs.items() for j, table in row.items())
    places = dict(sorted(chosen.items()))
    return places, sum(float(alone[i][place]) for i, place in places.items()) + 0.5 * mutual


def _candidates(point: FloatArray, size: FloatArray) -> FloatArray:
    """Centres around a point: the label's edge stands off by each ring's distance."""
    angle = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    way = np.column_stack([np.cos(angle), np.sin(angle)])
    reach = 0.5 / np.max(np.abs(way) / size, axis=1)
    return np.concatenate([point + way * (reach + _STAND_OFF + ring)[:, None] for ring in _RINGS])


def _cost_alone(
    spots: FloatArray, size: FloatArray, i: int, points: FloatArray, bounds: FloatArray, lines: FloatArray
) -> FloatArray:
    """What each place of label i costs, wherever the others stand."""
    low, high = spots - 0.5 * size, spots + 0.5 * size
    outside = np.clip(bounds[:2] + 1.0 - low, 0.0, None) + np.clip(high - bounds[2:] + 1.0, 0.0, None)
    marker = np.full((len(points), 2), _MARKER)
    on_line = _through(lines[:, :2], lines[:, 2:], spots, np.broadcast_to(size, spots.shape)).sum(axis=0)
    over = np.delete(_through(np.broadcast_to(points[i], spots.shape), spots, points, marker), i, axis=1).sum(axis=1)
    cost = np.repeat(np.array(_RINGS), _DIRECTIONS) + _ON_LINE * on_line + _OVER * over
    return cost + _OUT * outside.sum(axis=1) + _ON_POINT * _overlap(spots, size, points, marker).sum(axis=1)


def _cost_of_pair(
    spots: FloatArray, size: FloatArray, point: FloatArray, others: FloatArray, other_size: FloatArray, other_point: FloatArray
) -> FloatArray:
    """What two labels cost each other: ``[place of one, place of the other]``."""
    mine, theirs = np.broadcast_to(point, spots.shape), np.broadcast_to(other_point, others.shape)
    sizes, other_sizes = np.broadcast_to(size, spots.shape), np.broadcast_to(other_size, others.shape)
    under = 1.0 * _through(mine, spots, others, other_sizes) + _through(theirs, others, spots, sizes).T
    crossed = _crossings(point, spots, other_point, others)
    return _ON_LABEL * _overlap(spots, size, others, other_sizes) + _UNDER * under + _CROSSING * crossed


def _overlap(centre: FloatArray, size: FloatArray, centres: FloatArray, sizes: FloatArray) -> FloatArray:
    """Common area of boxes ``[c, n]``."""
    across, up = (np.clip(0.5 * (size[k] + sizes[:, k]) - np.abs(centre[:, k, None] - centres[:, k]), 0.0, None) for k in (0, 1))
    return across * up


def _crossings(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> NDArray[np.bool_]:
    """Whether a leader from ``a`` ``[2]`` to ``b`` ``[m, 2]`` crosses one from ``c`` to ``d`` ``[n, 2]``: ``[m, n]``."""
    mine, theirs, between = (b - a).T, (d - c).T, c - a
    from_mine = mine[0] * between[1] - mine[1] * between[0]
    from_theirs = theirs[1] * between[0] - theirs[0] * between[1]
    turn = np.outer(mine[0], theirs[1]) - np.outer(mine[1], theirs[0])
    beyond, back = from_mine[:, None] * (from_mine[:, None] + turn), from_theirs * (from_theirs - turn)
    return (beyond < 0.0) & (back < 0.0)


def _through(a: FloatArray, b: FloatArray, centres: FloatArray, sizes: FloatArray) -> NDArray[np.bool_]:
    """Whether segment a-b ``[m, 2]`` runs through a box ``[n]``: ``[m, n]``; by clipping against its sides."""
    spans = []
    for k in (0, 1):
        way = (b - a)[:, k, None]
        way = np.where(np.abs(way) < 1e-9, 1e-9, way)
        middle, half = (centres[:, k] - a[:, k, None]) / way, 0.5 * sizes[:, k] / np.abs(way)
        spans.append((middle - half, middle + half))
    enter, leave = np.maximum(spans[0][0], spans[1][0]), np.minimum(spans[0][1], spans[1][1])
    return (enter < leave) & (enter < 1.0) & (leave > 0.0)


def _lead(axes: Axes, xy: tuple[float, float], start: FloatArray, way: FloatArray, size: FloatArray) -> None:
    """A thin line from a point, ``start`` beside ``xy``, to the edge of the label ``way`` off, where that is not obvious."""
    inside = 0.5 / max(np.max(np.abs(way) / size), 1e-9)
    if np.hypot(*way) * (1.0 - inside) < _LEADER_FROM:
        return
    axes.annotate(
        "", xy, xytext=tuple(start + way * (1.0 - inside)), textcoords="offset points", annotation_clip=False,
        arrowprops={"arrowstyle": "-", "linewidth": 0.4, "color": GREY, "shrinkA": 0.0, "shrinkB": 0.0},
    )  # fmt: skip
