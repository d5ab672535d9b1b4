"""Sobol indices of an orthonormal expansion, and intervals that hold what the expansion does not.

The variance of the expansion is the sum of its squared coefficients; that of a set of inputs is the part of the terms
in which exactly these inputs have a degree (Sudret, Reliability Engineering and System Safety 93, 2008, 964-979).

Two errors remain. What the runs at hand decide, terms and coefficients, is estimated by the delete-a-group jackknife:
each of g folds is left out in turn, the terms are chosen anew, and the variance of an index is (g - 1) / g times the
sum of the squared deviations. What no expansion on these runs holds is a share u = 1 - q2 of the variance that may
belong to any set of inputs: an index S of the expansion is then one between (1 - u) S and (1 - u) S + u of the
response. The interval goes from the lower of the two less t times the standard error to the higher plus as much, with t
the 97.5 % point of Student's distribution with g - 1 degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from levelone.uncertainty.bootstrap import CONFIDENCE
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.polynomials import Terms


@dataclass(frozen=True, eq=False)
class ChaosIndices:
    """S1, ST [k] and S2 [k, k] (NaN on and below the diagonal) of an expansion, and its variance."""

    S1: FloatArray
    ST: FloatArray
    S2: FloatArray
    variance: float


@dataclass(frozen=True, eq=False)
class ChaosIntervals:
    """95 % intervals of the same: S1, ST [k, 2], S2 [k, k, 2]."""

    S1: FloatArray
    ST: FloatArray
    S2: FloatArray


def chaos_indices(terms: Terms, coefficients: FloatArray) -> ChaosIndices:
    """Sobol indices from terms [p, k], the constant left out, and their coefficients [p], not all of them zero."""
    k = terms.shape[1]
    squares, active = coefficients**2, (terms > 0).astype(np.float64)
    order = active.sum(axis=1)
    variance = float(squares.sum())
    pairs = active.T @ ((squares * (order == 2.0))[:, None] * active) / variance
    pairs[np.tril_indices(k)] = np.nan
    return ChaosIndices((squares * (order == 1.0)) @ active / variance, squares @ active / variance, pairs, variance)


def jackknife_intervals(indices: ChaosIndices, refits: Sequence[ChaosIndices], unexplained: float) -> ChaosIntervals:
    """Intervals round the indices.

    Parameters
    ----------
    indices
        From all runs.
    refits
        From the runs without each group.
    unexplained
        Share u of the variance that the expansion does not hold, 0 to 1.
    """
    groups = len(refits)
    quantile = float(student.ppf(0.5 + 0.5 * CONFIDENCE, groups - 1))

    def interval(whole: FloatArray, without: list[FloatArray]) -> FloatArray:
        values = np.array(without)
        error = np.sqrt((groups - 1) / groups * np.sum((values - values.mean(axis=0)) ** 2, axis=0))
        low = (1.0 - unexplained) * whole
        return np.stack([low - quantile * error, low + unexplained + quantile * error], axis=-1)

    return ChaosIntervals(
        interval(indices.S1, [refit.S1 for refit in refits]),
        interval(indices.ST, [refit.ST for refit in refits]),
        interval(indices.S2, [refit.S2 for refit in refits]),
    )
