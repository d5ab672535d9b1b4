"""Converged values from three similar grids, with an error bar.

On grids of 1, 2 and 3 halves of the ordinary panel counts (cell sizes 1, 1/2, 1/3) the lattice approaches its limit with the square
of the cell size where every surface is straight and level. A kink (sweep, taper, dihedral, a fin on a tip) adds a part of first
order. The limit is extrapolated accordingly (Richardson 1911; error bars reported as Roache 1994 asks for):

* straight: the second-order limit of the two finer grids. Bar: its distance from the limit with a second- and a fourth-order term
  through all three, doubled, and a tenth of the correction;
* kinked: the middle between that limit and the one with a first- and a second-order term. Bar: three quarters of their distance,
  and a tenth of the correction.

The factors were set on 112 quantities of seven geometries against grids of 6 and 9 halves; the tests repeat the comparison.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: halves of the ordinary panel counts on each grid; the second grid is the ordinary one
LEVELS = (1, 2, 3)
_SIZE = 1.0 / np.array(LEVELS)
#: differences below this share of a value are those of the quadrature
_FLOOR = 2e-5

FloatArray = NDArray[np.float64]


class Converged(NamedTuple):
    """A limit and the half-width of its error bar, arrays of one shape, and what the ordinary grid gives."""

    value: FloatArray
    error: FloatArray
    ordinary: FloatArray


def extrapolate(values: ArrayLike, kinked: bool) -> Converged:
    """Limit of real values [3, ...] on the grids of :data:`LEVELS`; a value that is not finite on one grid gives NaN."""
    f = np.asarray(values, dtype=np.float64)
    second = _limit(f[1:], _SIZE[1:], (2,))
    if kinked:
        first = _limit(f, _SIZE, (1, 2))
        value, distance = 0.5 * (second + first), 0.75 * np.abs(first - second)
    else:
        value, distance = second, 2.0 * np.abs(_limit(f, _SIZE, (2, 4)) - second)
    return Converged(value, distance + 0.1 * np.abs(f[2] - value) + _FLOOR * np.abs(value), f[1])


def _limit(values: FloatArray, size: FloatArray, powers: tuple[int, ...]) -> FloatArray:
    """Constant of the polynomial with these powers of the cell size that passes through the values [n, ...]."""
    matrix = np.stack([np.ones_like(size), *(size**power for power in powers)], axis=1)
    weights = np.linalg.solve(matrix, np.eye(len(size)))[0]
    return np.asarray(np.tensordot(weights, values, axes=1))
