"""Correlation functions of Kriging, and how they change with a length scale."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from levelone.errors import unknown_name
from levelone.uncertainty.distributions import FloatArray

Correlation = Literal["matern52", "squared_exponential"]
CORRELATIONS: tuple[Correlation, ...] = get_args(Correlation)


def squared_distances(a: FloatArray, b: FloatArray, out: FloatArray | None = None) -> FloatArray:
    """Squared Euclidean distances [n, m] between rows of a [n, k] and b [m, k], as one matrix product.

    |a - b|^2 = (-2 a, |a|^2, 1) . (b, 1, |b|^2): the error is rounding of |a|^2, 1e-12 at worst for length scales of
    0.01, which is below the smallest jitter. Rounding may leave a distance below zero; it is set to zero.
    """
    left = np.column_stack([-2.0 * a, np.einsum("ij,ij->i", a, a), np.ones(len(a))])
    right = np.column_stack([b, np.ones(len(b)), np.einsum("ij,ij->i", b, b)])
    out = np.matmul(left, right.T, out=out)
    return np.maximum(out, 0.0, out=out)


def correlate(kind: Correlation, r2: FloatArray, out: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Correlation of points at scaled distance r, in place.

    Matern 5/2 is (1 + t + t^2 / 3) exp(-t) with t = sqrt(5) r, squared exponential exp(-r^2 / 2), with r^2 the sum
    over inputs of ((x_j - x'_j) / l_j)^2 (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006,
    equations 4.9 and 4.17).

    Parameters
    ----------
    kind
        Which function.
    r2
        Squared scaled distances; overwritten as working space.
    out
        Receives the correlation; same shape.
    weight
        Where given, receives W = -2 dk/d(r^2), so that dk/d(log l_j) = W ((x_j - x'_j) / l_j)^2.
    """
    if kind == "squared_exponential":
        np.multiply(r2, -0.5, out=out)
        np.exp(out, out=out)
        if weight is not None:
            weight[...] = out
        return out
    if kind != "matern52":
        raise unknown_name("correlation", kind, CORRELATIONS)
    t = np.multiply(r2, 5.0, out=r2)
    np.sqrt(t, out=t)
    np.negative(t, out=out)
    np.exp(out, out=out)
    if weight is not None:
        np.add(t, 1.0, out=weight)
        weight *= out
        weight *= 5.0 / 3.0
    # 1 + t + t^2 / 3 = ((t + 3/2)^2 + 3/4) / 3
    t += 1.5
    t *= t
    t += 0.75
    t *= 1.0 / 3.0
    out *= t
    return out
