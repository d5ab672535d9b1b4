"""Where a curve over frequency falls through a level, between the frequencies at which it is known.

Between its points a curve is a cubic in the logarithm of frequency through the four nearest: with a few hundred
points over three decades its error is far below what the curve itself is worth, and what is read moves smoothly
with the model.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from levelone.compiled import kernel
from levelone.handling.history import FloatArray
from levelone.status import Status

BoolArray = npt.NDArray[np.bool_]

OK = int(Status.OK)
LOW_COHERENCE = int(Status.LOW_COHERENCE)


@kernel
def crossing(
    x: FloatArray,
    y: FloatArray,
    level: float,
    w: FloatArray,
    omega: FloatArray,
    distrusted: BoolArray,
    end: float,
    absent: int,
) -> tuple[float, int]:
    """Frequency below ``end`` at which y first falls through a level, and a code: ``absent`` where there is none."""
    for k in range(x.size - 1):
        if w[k] >= end:
            break
        if not (y[k] > level >= y[k + 1]):
            continue
        if any_between(omega, distrusted, w[k], w[k + 1]):
            return math.nan, LOW_COHERENCE
        low, high = x[k], x[k + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            if cubic(x, y, middle) > level:
                low = middle
            else:
                high = middle
        return math.exp(0.5 * (low + high)), OK
    # what was looked for may lie among frequencies that are not trusted, above the last one that is
    last = w[x.size - 1] if x.size > 0 else 0.0
    return math.nan, (LOW_COHERENCE if any_between(omega, distrusted, last, end) else absent)


@kernel
def any_between(omega: FloatArray, distrusted: BoolArray, low: float, high: float) -> bool:
    """Whether a frequency that is not trusted lies between two others."""
    count = 0
    for k in range(omega.size):
        if distrusted[k] and low < omega[k] < high:
            count += 1
    return count > 0


@kernel
def bracket(x: FloatArray, at: float) -> int:
    """Index k with x[k] <= at < x[k + 1], kept inside the array."""
    low, high = 0, x.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if x[middle] <= at:
            low = middle
        else:
            high = middle
    return low


@kernel
def cubic(x: FloatArray, y: FloatArray, at: float) -> float:
    """Lagrange's cubic through the four nearest points (fewer where there are fewer)."""
    count = min(4, x.size)
    first = min(max(bracket(x, at) - 1, 0), x.size - count)
    total = 0.0
    for j in range(first, first + count):
        term = y[j]
        for m in range(first, first + count):
            if m != j:
                term *= (at - x[m]) / (x[j] - x[m])
        total += term
    return total
