"""How the points of a foreign file were laid out: what an index needs is checked on the points themselves, not believed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.dakota.coordinates import unit_points
from levelone.uncertainty import Design, Discrete, FactorSpace
from levelone.uncertainty.distributions import FloatArray

#: of two coordinates in the unit cube: files have 16 digits
SAME = 1e-9
HIGHEST_LEVELS = 100
Layout = Literal["morris", "sobol", "sample", "other"]


@dataclass(frozen=True, eq=False)
class Recognised:
    """What the points are: a design for the analysis, with ``order`` [runs], the row of the file that each run of it comes from.

    ``layout`` is "sample" where every run is a draw of its own, and "other" where coordinates repeat without being one of the
    designs: a design of another kind, or one that was interrupted, whose runs hang together and are no sample.
    """

    layout: Layout
    design: Design
    order: NDArray[np.int64]


def recognise(space: FactorSpace, points: FloatArray, columns: Sequence[str], seed: int) -> Recognised:
    """Recognise trajectories of one factor at a time, and the blocks of Dakota's variance-based decomposition.

    Dakota 6.24 writes a decomposition of N base points as blocks of N rows (measured): a sample M1, a sample M2, and then for each
    variable, in the order of the file, M2 with that variable from M1. With A = M2 and B = M1 that is a pick-freeze design of this
    package's.

    Parameters
    ----------
    points
        [runs, k] physical values, columns in the order of ``space``.
    columns
        The factors in the order of the file.
    seed
        Of the bootstrap.

    Raises
    ------
    InputError
        A value outside its factor's support.
    """
    unit, k = unit_points(space, points), len(space)
    as_they_are = np.arange(len(points))
    if not space.correlated:
        levels = _levels(unit, k)
        if levels:
            base = len(points) // (k + 1)
            return Recognised("morris", Design("morris", space, unit, points.copy(), seed, base, k + 1, levels), as_they_are)
        if _is_pick_freeze(unit, [space.index(name) for name in columns]):
            base = len(points) // (k + 2)
            # rows of base point i: M2, then for each factor its block, then M1
            blocks = [1, *(2 + columns.index(name) for name in space.names), 0]
            order = (np.array(blocks)[None, :] * base + np.arange(base)[:, None]).ravel()
            return Recognised("sobol", Design("sobol", space, unit[order], points[order], seed, base, k + 2), order)
    sample = Design("latin_hypercube", space, unit, points.copy(), seed, len(points), 1)
    return Recognised("other" if _repeats(space, unit) else "sample", sample, as_they_are)


def _repeats(space: FactorSpace, unit: FloatArray) -> bool:
    """Whether a factor that is not discrete has a value twice."""
    columns = [unit[:, j] for j, factor in enumerate(space.factors) if not isinstance(factor.distribution, Discrete)]
    return any(np.unique(column).size < column.size for column in columns)


def _levels(unit: FloatArray, k: int) -> int:
    """Levels of the grid that trajectories move on; 0 where the points are no trajectories."""
    n = unit.shape[0]
    if n == 0 or n % (k + 1):
        return 0
    steps = np.abs(np.diff(unit.reshape(-1, k + 1, k), axis=1))
    moved = steps > SAME
    if not ((moved.sum(axis=2) == 1).all() and (moved.sum(axis=1) == 1).all()):
        return 0
    delta = steps.max()
    if delta <= 0.5 or np.ptp(steps.max(axis=2)) > SAME:
        return 0
    levels = round(2.0 * delta / (2.0 * delta - 1.0))
    exact = levels / (2.0 * (levels - 1.0))
    return levels if levels <= HIGHEST_LEVELS and levels % 2 == 0 and abs(exact - delta) < SAME else 0


def _is_pick_freeze(unit: FloatArray, order: Sequence[int]) -> bool:
    """Whether the rows are the blocks M1, M2, and M2 with column ``order[i]`` from M1; the samples must differ in every row."""
    n, k = unit.shape
    if n < 2 * (k + 2) or n % (k + 2):
        return False
    blocks = unit.reshape(k + 2, -1, k)
    first, second = blocks[0], blocks[1]
    if (np.abs(first - second).max(axis=1) <= SAME).any():
        return False
    for block, column in zip(blocks[2:], order, strict=True):
        expected = second.copy()
        expected[:, column] = first[:, column]
        if not (np.abs(block - expected) <= SAME).all():
            return False
    return True
