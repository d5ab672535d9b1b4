"""What further runs would do to the variance of a Kriging model, before their values are known.

At given length scales and nugget the posterior covariance of a Gaussian process depends on where the model was run and
not on what came out, so that the variance left after a run can be computed before it. All covariances here are in units
of the variance of the process.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from levelone.uncertainty.correlation import correlate, squared_distances
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.kriging import Kriging, trend_functions
from levelone.uncertainty.likelihood import RestrictedLikelihood, Solves


@dataclass(frozen=True, eq=False)
class Functionals:
    """Linear functionals of the process, f of them, before conditioning.

    ``with_runs`` [f, n] and ``with_candidates`` [f, m] are their prior covariances with the process at the runs and at
    the candidates, ``trend`` [f, p] their values on the trend functions.
    """

    with_runs: FloatArray
    with_candidates: FloatArray
    trend: FloatArray


class Candidates:
    """A Gaussian process conditioned on runs, seen from candidate points; a run added changes it in place.

    Parameters
    ----------
    model
        Fitted Kriging model; gives correlation, lengths, nugget and trend.
    x
        [n, k] runs whose variance is known to be gone: those of the model, and any further ones.
    points
        [m, k] candidates.
    """

    def __init__(self, model: Kriging, x: FloatArray, points: FloatArray) -> None:
        self._model, self._low, self._width = model, x.min(axis=0), np.ptp(x, axis=0)
        self._x, self._points = x, points
        runs = self._scaled(x)
        likelihood = RestrictedLikelihood(runs, np.zeros(len(x)), trend_functions(runs, model.trend), model.correlation)
        self._solves: Solves = likelihood.solves(model.lengths, model.nugget)
        self.noise = model.nugget + self._solves.jitter + np.finfo(np.float64).eps
        prior = Functionals(self.prior(points, x), np.empty((len(points), 0)), self.trend(points))
        self._half, self._gap = self._explained(prior)
        self._added = np.empty((0, len(points)))
        self.variance = 1.0 - np.einsum("ij,ij->j", self._half, self._half) + np.einsum("ij,ij->j", self._gap, self._gap)

    def _scaled(self, points: FloatArray) -> FloatArray:
        return np.asarray((points - self._low) / self._width, dtype=np.float64)

    def prior(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """Prior covariances [n, m] between points a [n, k] and b [m, k]."""
        r2 = squared_distances(self._scaled(a) / self._model.lengths, self._scaled(b) / self._model.lengths)
        return correlate(self._model.correlation, r2, np.empty_like(r2))

    def trend(self, points: FloatArray) -> FloatArray:
        """Trend functions [n, p] at points."""
        return trend_functions(self._scaled(points), self._model.trend)

    def weighted(self, points: FloatArray, weights: FloatArray) -> Functionals:
        """The functionals sum_i w_fi y(points_i), from weights [f, n]."""
        with_runs, with_candidates = weights @ self.prior(points, self._x), weights @ self.prior(points, self._points)
        return Functionals(with_runs, with_candidates, weights @ self.trend(points))

    def covariance(self, functionals: Functionals) -> FloatArray:
        """Posterior covariances [f, m] of functionals with the process at the candidates, before any run was added."""
        half, gap = self._explained(functionals)
        return np.asarray(functionals.with_candidates - half.T @ self._half + gap.T @ self._gap, dtype=np.float64)

    def _explained(self, functionals: Functionals) -> tuple[FloatArray, FloatArray]:
        solves = self._solves
        half = solve_triangular(solves.factor, functionals.with_runs.T, lower=True, check_finite=False)
        free = functionals.trend.T - solves.trend_solve.T @ functionals.with_runs.T
        return half, solve_triangular(solves.trend_factor, free, lower=True)

    def add(self, chosen: int) -> FloatArray:
        """Run at a candidate: [m] covariances of the others with it over its standard deviation, noise included.

        A covariance c with any functional turns into c - b a, where a is the answer and b the covariance of the
        functional with the chosen candidate over the same standard deviation.
        """
        prior = self.prior(self._points[chosen : chosen + 1], self._points)[0]
        now = prior - self._half[:, chosen] @ self._half + self._gap[:, chosen] @ self._gap
        now -= self._added[:, chosen] @ self._added
        along = now / np.sqrt(max(now[chosen], 0.0) + self.noise)
        self._added = np.vstack([self._added, along])
        self.variance = np.maximum(self.variance - along**2, 0.0)
        return np.asarray(along, dtype=np.float64)
