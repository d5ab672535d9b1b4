"""Single limits of criteria without a chart, as a boundary file states them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from levelone.errors import InputError, unknown_name
from levelone.handling.history import FloatArray, IntArray
from levelone.handling.levels import Boundaries, Level


def single_limits(boundaries: Boundaries, criterion: str, *keys: str) -> tuple[FloatArray, ...]:
    """The limits of one criterion under the given keys, SI, each in the shape of the file: a number or a list.

    Raises
    ------
    InputError
        The file has no such criterion or key, or the value is not a finite number or list of them.
    """
    where = f"{boundaries.name}: limits"
    if criterion not in boundaries.limits:
        raise unknown_name(where, criterion, boundaries.limits)
    table = boundaries.limits[criterion]
    for key in keys:
        if key not in table:
            raise unknown_name(f"{where}.{criterion}", key, table)
    return tuple(_numbers(f"{where}.{criterion}.{key}", table[key]) for key in keys)


def increasing_pair(boundaries: Boundaries, criterion: str, keys: tuple[str, ...]) -> tuple[float, float]:
    """Two limits, the first below the second: one key that holds both, or two keys.

    Raises
    ------
    InputError
        As :func:`single_limits`, or the limits are not two that increase.
    """
    pair = np.concatenate([np.atleast_1d(value) for value in single_limits(boundaries, criterion, *keys)])
    if pair.shape != (2,) or not pair[0] < pair[1]:
        where = f"{boundaries.name}: limits.{criterion}.{', '.join(keys)}"
        raise InputError(where, f"is {pair.tolist()}, must be two numbers that increase")
    return float(pair[0]), float(pair[1])


def levels_up_to(value: npt.ArrayLike, level_1: float, level_2: float) -> IntArray:
    """Level of a metric that must stay small: Level 1 up to ``level_1``, Level 2 up to ``level_2``; undefined where NaN."""
    y = np.asarray(value, dtype=np.float64)
    level = np.where(y <= level_1, Level.LEVEL_1, np.where(y <= level_2, Level.LEVEL_2, Level.LEVEL_3))
    return np.where(np.isnan(y), Level.UNDEFINED, level)


def _numbers(field: str, value: object) -> FloatArray:
    try:  # not straight to float: NumPy would take the text "0.25" for a number
        numbers = np.asarray(value)
    except ValueError:
        numbers = np.asarray(None)
    if numbers.dtype.kind not in "if" or not np.isfinite(numbers).all():
        raise InputError(field, f"is {value!r}, must be a finite number or a list of them")
    return numbers.astype(np.float64)
