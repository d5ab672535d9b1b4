"""Probability boxes: what is left of a distribution when some of its inputs are only known as intervals.

For a fixed point e of the epistemic box the aleatory inputs give a response a distribution, and every number read from it, such
as P(response <= z | e) or the share of runs at a Level, is a statistic s(e). Over the box it has a lower and an upper bound,
min s and max s; over several boxes of Dempster-Shafer structures the bounds are the sums of mass times the bound in each box.
Without aleatory inputs s is 0 or 1, and the sums are belief and plausibility.

A search finds bounds that some point really takes: inner bounds, which the true ones may exceed. It visits corners, a Latin
hypercube and the neighbours of what it found.

Sources: Ferson et al., SAND2002-4015, 2003, sections 1 and 2; Helton, Johnson, Oberkampf, Reliability Engineering and System Safety
85 (2004) 39-71; Dakota 6.24 theory manual, chapter "Epistemic Methods".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import qmc

from levelone.errors import InputError
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.evidence import FocalBoxes
from levelone.uncertainty.seeds import check_seed, stage_seed

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Statistics = Callable[[FloatArray], FloatArray]
"""Maps epistemic points [n, e], in the units of the inputs, to statistics [n, t]; NaN where one is undefined."""

#: steps of the neighbours that are tried, as parts of the width of a box: the first leads to its faces
STEPS = (1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)
#: rounds with one step: first along the coordinates, then in random directions as long as something improves
ROUNDS = 4
#: points of a box, those that are extreme in the most statistics, whose neighbours are tried in a round
CENTRES = 8


class Origin(IntEnum):
    """How the search came to a point."""

    CORNER = 0
    LATIN_HYPERCUBE = 1
    REFINEMENT = 2


@dataclass(frozen=True, eq=False)
class BoxSearch:
    """Every epistemic point that a search visited, and the bounds found.

    Attributes
    ----------
    boxes
        The b boxes.
    points
        [n, e] points, in the units of the inputs.
    box, origin
        [n] box of each point, and how the search came to it (codes of :class:`Origin`).
    values
        [n, t] statistics.
    lowest, highest
        [b, t] index of the point with the smallest and with the largest value in each box; -1 where a statistic is undefined at
        every point.
    """

    boxes: FocalBoxes
    points: FloatArray
    box: IntArray
    origin: IntArray
    values: FloatArray
    lowest: IntArray
    highest: IntArray

    @classmethod
    def of(cls, boxes: FocalBoxes, points: FloatArray, box: IntArray, origin: IntArray, values: FloatArray) -> BoxSearch:
        """The extremes among given points."""
        lowest, highest = _extremes(values, box, len(boxes))
        return cls(boxes, points, box, origin, values, lowest, highest)

    @property
    def ends(self) -> FloatArray:
        """[2, b, t] smallest and largest value in each box, NaN where a statistic is undefined."""
        index = np.stack([self.lowest, self.highest])
        return np.where(index >= 0, self.values[index, np.arange(self.values.shape[1])], np.nan)

    @property
    def lower(self) -> FloatArray:
        """[t] lower bounds: belief where a statistic is the share of an event."""
        return self.boxes.mass @ self.ends[0]

    @property
    def upper(self) -> FloatArray:
        """[t] upper bounds: plausibility where a statistic is the share of an event."""
        return self.boxes.mass @ self.ends[1]

    @property
    def plain(self) -> FloatArray:
        """[t] means over the Latin hypercube of each box: every input uniform on each of its intervals."""
        drawn = self.origin == Origin.LATIN_HYPERCUBE
        means = [self.values[drawn & (self.box == b)].mean(axis=0) for b in range(len(self.boxes))]
        return self.boxes.mass @ np.array(means)


@dataclass(frozen=True, eq=False)
class ProbabilityBox:
    """Bounds on a distribution function.

    Attributes
    ----------
    thresholds
        [z] increasing values of the response.
    lower, upper
        [z] smallest and largest share of runs at or below each; between thresholds the box reaches from the last ``lower`` to the
        next ``upper``.
    plain
        [z] share under the plain treatment.
    """

    thresholds: FloatArray
    lower: FloatArray
    upper: FloatArray
    plain: FloatArray

    def quantile(self, share: float) -> tuple[float, float]:
        """Interval that holds the quantile of every distribution in the box, as wide as the thresholds make it.

        An end is NaN where the thresholds do not reach it.
        """
        if not 0.0 < share < 1.0:
            raise InputError("share", f"is {share!r}, must lie between 0 and 1")
        first = int(np.searchsorted(self.upper, share))  # the quantile lies above the threshold before this one
        last = int(np.searchsorted(self.lower, share))
        low = self.thresholds[first - 1] if first else np.nan
        high = self.thresholds[last] if last < len(self.thresholds) else np.nan
        return float(low), float(high)


def cumulative_shares(values: ArrayLike, thresholds: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest share of runs at or below each threshold, [n, z] each, when failed runs may have any value.

    Parameters
    ----------
    values
        [n, m] response of m runs at n points, NaN where a run failed.
    thresholds
        [z] increasing.
    """
    values, thresholds = np.asarray(values, dtype=np.float64), np.asarray(thresholds, dtype=np.float64)
    ordered, failed = np.sort(values, axis=1), np.isnan(values).sum(axis=1)
    below = np.array(
        [np.searchsorted(row[: row.size - lost], thresholds, side="right") for row, lost in zip(ordered, failed, strict=True)]
    )
    below = below.reshape(len(values), len(thresholds))
    return below / values.shape[1], (below + failed[:, None]) / values.shape[1]


def starting_points(boxes: FocalBoxes, outer: int, seed: int, corners: int) -> FloatArray:
    """The first points [n, e] of :func:`search_boxes`, which takes the same arguments: to see what range a response has."""
    return _start(boxes, outer, seed, corners).physical()


def search_boxes(
    statistics: Statistics, boxes: FocalBoxes, outer: int, seed: int, *, corners: int, targets: Sequence[int] | None = None
) -> BoxSearch:
    """Bounds of statistics over each box.

    Parameters
    ----------
    statistics
        Called with all points of a round at once.
    boxes
        Of the epistemic inputs.
    outer
        Points of the Latin hypercube of each box, at least 2.
    seed
        Seed; box b draws from a stage of its own.
    corners
        All corners of a box are visited where there are at most so many; else those that the refinement comes to.
    targets
        Columns of the statistics whose extremes are refined, all by default.

    Raises
    ------
    InputError
        ``outer`` too small.
    """
    pool = _start(boxes, outer, seed, corners)
    pool.evaluate(statistics)
    chosen = np.arange(pool.values.shape[1]) if targets is None else np.asarray(targets, dtype=np.int64)
    rng = np.random.default_rng(stage_seed(seed, "neighbours"))
    extremes = _extremes(pool.values[:, chosen], pool.box, len(boxes))
    for step in STEPS:
        for turn in range(ROUNDS):
            pool.add_neighbours(extremes, step, rng if turn else None)
            pool.evaluate(statistics)
            before, extremes = extremes, _extremes(pool.values[:, chosen], pool.box, len(boxes))
            if turn and np.array_equal(extremes, before):
                break
    return BoxSearch.of(boxes, pool.physical(), pool.box, pool.origin, pool.values)


@dataclass(eq=False)
class _Pool:
    """Points of the unit cube laid over their boxes, with what is known at the first of them."""

    boxes: FocalBoxes
    unit: FloatArray
    box: IntArray
    origin: IntArray
    values: FloatArray

    def physical(self, first: int = 0) -> FloatArray:
        """Values of the points from ``first`` on."""
        unit, box = self.unit[first:], self.box[first:]
        return self.boxes.low[box] * (1.0 - unit) + self.boxes.high[box] * unit

    def evaluate(self, statistics: Statistics) -> None:
        """Ask for the points that nothing is known of, if any."""
        known = len(self.values)
        if known == len(self.unit):
            return
        found = np.asarray(statistics(self.physical(known)), dtype=np.float64)
        self.values = np.vstack([self.values, found]) if known else found

    def add_neighbours(self, extremes: IntArray, step: float, rng: np.random.Generator | None) -> None:
        """Add what is new around the extremes [2, b, t]: a step along each coordinate, or within a step in random directions."""
        for b in range(len(self.boxes)):
            index, served = np.unique(extremes[:, b][extremes[:, b] >= 0], return_counts=True)
            centres = self.unit[index[np.argsort(-served, kind="stable")][:CENTRES]]
            free = np.flatnonzero(self.boxes.high[b] > self.boxes.low[b])
            tried = np.repeat(centres, 2 * len(free) if rng is None else len(free), axis=0)
            if rng is None:
                column = np.tile(np.repeat(free, 2), len(centres))
                tried[np.arange(len(tried)), column] += np.tile([step, -step], len(tried) // 2)
            else:
                tried[:, free] += rng.uniform(-step, step, (len(tried), len(free)))
            known = {row.tobytes() for row in self.unit[self.box == b]}
            fresh = [row for row in np.unique(np.clip(tried, 0.0, 1.0) + 0.0, axis=0) if row.tobytes() not in known]
            self._append(np.array(fresh).reshape(-1, self.unit.shape[1]), b)

    def _append(self, unit: FloatArray, box: int) -> None:
        self.unit = np.vstack([self.unit, unit])
        self.box = np.append(self.box, np.full(len(unit), box))
        self.origin = np.append(self.origin, np.full(len(unit), int(Origin.REFINEMENT)))


def _start(boxes: FocalBoxes, outer: int, seed: int, corners: int) -> _Pool:
    """Corners, where they are few enough, and a Latin hypercube of each box."""
    if isinstance(outer, bool) or not isinstance(outer, int | np.integer) or outer < 2:
        raise InputError("outer", f"{outer!r}; a whole number of at least 2 is needed")
    check_seed(seed)
    unit, box, origin = [], [], []
    for b in range(len(boxes)):
        ends = [(0.0, 1.0) if high > low else (0.0,) for low, high in zip(boxes.low[b], boxes.high[b], strict=True)]
        count = int(np.prod([len(each) for each in ends], dtype=np.float64))
        ends_of = np.array(list(product(*ends))) if count <= corners else np.empty((0, len(ends)))
        rng = np.random.default_rng(stage_seed(seed, f"box {b}"))
        drawn = qmc.LatinHypercube(len(ends), rng=rng).random(outer)
        unit += [ends_of, drawn]
        box.append(np.full(len(ends_of) + outer, b))
        origin.append(np.repeat([int(Origin.CORNER), int(Origin.LATIN_HYPERCUBE)], [len(ends_of), outer]))
    return _Pool(boxes, np.vstack(unit), np.concatenate(box), np.concatenate(origin), np.empty((0, 0)))


def _extremes(values: FloatArray, box: IntArray, boxes: int) -> IntArray:
    """Index of the points with the smallest and with the largest value, [2, b, t]: the first of several; -1 for none."""
    out = np.full((2, boxes, values.shape[1]), -1, dtype=np.int64)
    for b in range(boxes):
        rows = np.flatnonzero(box == b)
        known = ~np.isnan(values[rows]).all(axis=0)
        if known.any():
            out[0, b, known] = rows[np.nanargmin(values[rows][:, known], axis=0)]
            out[1, b, known] = rows[np.nanargmax(values[rows][:, known], axis=0)]
    return out


def fewest_points(near: BoolArray) -> IntArray:
    """Few points that serve every target: the one that serves the most of those left, again and again.

    Parameters
    ----------
    near
        [targets, points] whether a point is good enough for a target; a target that no point serves is left out.

    Returns
    -------
    [m] indices of points, in the order in which they were chosen.
    """
    left, chosen = np.array(near, dtype=bool), []
    while left.any():
        best = int(left.sum(axis=0).argmax())
        chosen.append(best)
        left[left[:, best]] = False
    return np.array(chosen, dtype=np.int64)
