"""A Kriging model without some of its runs: what leaving out groups of training points does to it, hyperparameters held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.errors import InputError
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.correlation import correlate, squared_distances
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.kriging import Kriging, check_data, trend_functions
from levelone.uncertainty.likelihood import RestrictedLikelihood

_CHUNK = 256


def random_groups(n: int, groups: int, rng: np.random.Generator) -> tuple[NDArray[np.int64], ...]:
    """Rows 0 to n - 1 in random groups whose sizes differ by one at most; InputError for fewer than 2 or more than n."""
    if not 2 <= groups <= n:
        raise InputError("groups", f"{groups!r}; 2 to {n} groups can be made of {n} runs")
    order = rng.permutation(n)
    return tuple(np.sort(order[i::groups]) for i in range(groups))


@dataclass(frozen=True, eq=False)
class Reduced:
    """G models, each without one group of runs. ``weights`` [n, G] are zero in the group; ``beta`` [p, G]; scaled response."""

    model: Kriging
    u: FloatArray
    scaling: tuple[FloatArray, FloatArray, float, float]
    weights: FloatArray
    beta: FloatArray

    def predict_mean(self, x: ArrayLike) -> FloatArray:
        """Means [m, G] of the models at x [m, k], from one matrix of correlations with all runs."""
        low, width, y_mean, y_std = self.scaling
        points, z = (np.asarray(x, dtype=np.float64) - low) / width, self.u / self.model.lengths
        mean = np.empty((len(points), self.beta.shape[1]))
        with OneBlasThread():
            for start in range(0, len(points), _CHUNK):
                part = points[start : start + _CHUNK]
                r2 = squared_distances(part / self.model.lengths, z)
                k = correlate(self.model.correlation, r2, np.empty_like(r2))
                mean[start : start + len(part)] = k @ self.weights + trend_functions(part, self.model.trend) @ self.beta
        return y_mean + y_std * mean


def without_groups(x: ArrayLike, y: ArrayLike, model: Kriging, groups: Sequence[NDArray[np.int64]]) -> Reduced:
    """Condition ``model`` on its data x [n, k], y [n] without each group of rows in turn; the trend is estimated anew.

    Lengths, nugget and the scaling of inputs and response stay those of all runs.
    """
    x, y = check_data(x, y)
    low, width, y_mean, y_std = x.min(axis=0), np.ptp(x, axis=0), float(y.mean()), float(y.std())
    u, scaled = (x - low) / width, (y - y_mean) / y_std
    basis = trend_functions(u, model.trend)
    weights, beta = np.zeros((len(y), len(groups))), np.empty((basis.shape[1], len(groups)))
    with OneBlasThread():
        for g, group in enumerate(groups):
            kept = np.delete(np.arange(len(y)), group)
            likelihood = RestrictedLikelihood(u[kept], scaled[kept], basis[kept], model.correlation)
            solves = likelihood.solves(model.lengths, model.nugget)
            weights[kept, g], beta[:, g] = solves.alpha, solves.beta
    return Reduced(model, u, (low, width, y_mean, y_std), weights, beta)
