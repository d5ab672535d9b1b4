"""From physical values back to the unit cube."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import lognorm, norm, triang, truncnorm

from levelone.errors import InputError
from levelone.uncertainty import (
    Discrete,
    Distribution,
    Factor,
    FactorSpace,
    LogNormal,
    Normal,
    Triangular,
    TruncatedNormal,
    Uniform,
)
from levelone.uncertainty.distributions import FloatArray

#: how far a value may lie outside its support, relative to the width: Dakota's files have 16 digits
ROUNDING = 1e-9


def unit_points(space: FactorSpace, points: ArrayLike) -> FloatArray:
    """Unit coordinates of physical values, each by the distribution function of its own factor (a correlation plays no part).

    Parameters
    ----------
    points
        [n, k] physical values.

    Returns
    -------
    [n, k] in [0, 1]. Of a discrete factor the middle of its value's share of the probability.

    Raises
    ------
    InputError
        A value outside the support of its factor, or none of the values of a discrete one.
    """
    points = np.asarray(points, dtype=np.float64)
    columns = [_column(factor, points[:, j]) for j, factor in enumerate(space.factors)]
    return np.stack(columns, axis=1)


def _column(factor: Factor, x: FloatArray) -> FloatArray:
    low, high = factor.distribution.support
    width = high - low if factor.bounded else 1.0
    outside = ~((x >= low - ROUNDING * width) & (x <= high + ROUNDING * width))
    if outside.any():
        row = int(np.flatnonzero(outside)[0])
        raise InputError(f"factor {factor.name}", f"run {row + 1} has {x[row]:.10g}, outside the study's {low:.10g} to {high:.10g}")
    if isinstance(factor.distribution, Discrete):
        return _middles(factor, factor.distribution, x, ROUNDING * width)
    return np.clip(_probability(factor.name, factor.distribution, np.clip(x, low, high)), 0.0, 1.0)


def _middles(factor: Factor, given: Discrete, x: FloatArray, rounding: float) -> FloatArray:
    values, weights = np.array(given.values), np.array(given.weights)
    at = np.abs(x[:, None] - values).argmin(axis=1)
    wrong = np.abs(x - values[at]) > rounding
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        allowed = ", ".join(f"{value:g}" for value in given.values)
        raise InputError(f"factor {factor.name}", f"run {row + 1} has {x[row]:.10g}; allowed: {allowed}")
    return (np.cumsum(weights) - 0.5 * weights)[at]


def _probability(name: str, given: Distribution, x: FloatArray) -> FloatArray:
    """The distribution function, from the same parameters as ``ppf``."""
    if isinstance(given, Uniform):
        return (x - given.low) / (given.high - given.low)
    if isinstance(given, Normal):
        return norm.cdf(x, given.mean, given.std)
    if isinstance(given, TruncatedNormal):
        ends = (given.low - given.centre) / given.std, (given.high - given.centre) / given.std
        return truncnorm.cdf(x, *ends, loc=given.centre, scale=given.std)
    if isinstance(given, Triangular):
        width = given.high - given.low
        return triang.cdf(x, (given.mode - given.low) / width, loc=given.low, scale=width)
    if isinstance(given, LogNormal):
        return lognorm.cdf(x, given.sigma, scale=np.exp(given.mu))
    raise InputError(f"factor {name}", f"{type(given).__name__} has no distribution function here")
