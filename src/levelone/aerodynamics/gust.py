"""The undisturbed wind as a function of place and time: a uniform stream, and gusts that travel with it.

Wind-tunnel frame: x along the stream, y right, z up, SI units.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.errors import InputError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Wind:
    """``velocity(points [p, 3], t) -> [p, 3]`` (m, s, m/s); ``symmetric`` where it is its own mirror image in y = 0."""

    velocity: Callable[[FloatArray, float], FloatArray]
    symmetric: bool


def uniform(velocity: ArrayLike) -> Wind:
    """The same wind [3] (m/s) everywhere and always; zero for a body that flies through air at rest."""
    wind = _vector("velocity", velocity)
    return Wind(lambda points, t: np.broadcast_to(wind, points.shape), bool(wind[1] == 0.0))


def sharp_edged_gust(stream: ArrayLike, gust: ArrayLike, front: float) -> Wind:
    """A wind change [3] (m/s) behind a front that stands at x = ``front`` (m) at t = 0 and travels with the stream [3] (m/s)."""
    return _travelling(stream, gust, front, lambda behind: np.where(behind > 0.0, 1.0, 0.0))


def one_minus_cosine(stream: ArrayLike, gust: ArrayLike, front: float, length: float) -> Wind:
    """Discrete gust of CS-25.341: (1 - cos)/2 over ``length`` (m) behind the front, ``gust`` [3] (m/s) at its peak."""
    if not (math.isfinite(length) and length > 0.0):
        raise InputError("length", f"{length} m is no length of a gust: a positive number is needed")

    def shape(behind: FloatArray) -> FloatArray:
        inside = (behind > 0.0) & (behind < length)
        return np.where(inside, 0.5 - 0.5 * np.cos(2.0 * np.pi / length * behind), 0.0)

    return _travelling(stream, gust, front, shape)


def _travelling(stream: ArrayLike, gust: ArrayLike, front: float, shape: Callable[[FloatArray], FloatArray]) -> Wind:
    wind, change = _vector("stream", stream), _vector("gust", gust)
    if not math.isfinite(front):
        raise InputError("front", f"{front} is not a finite number")

    def velocity(points: FloatArray, t: float) -> FloatArray:
        behind = front + wind[0] * t - points[:, 0]
        return np.asarray(wind + shape(behind)[:, None] * change)

    return Wind(velocity, bool(wind[1] == 0.0 and change[1] == 0.0))


def _vector(field: str, value: ArrayLike) -> FloatArray:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(field, f"{value!r} is no velocity: three finite numbers x, y, z are needed")
    return vector
