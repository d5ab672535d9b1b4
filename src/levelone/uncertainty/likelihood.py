"""Restricted likelihood of a Kriging model, its gradient, and the solves that the fitted model keeps.

Model: y = F beta + z, z of covariance s2 (R(l) + g I), with l a length scale for each input and g the nugget ratio.
beta and s2 are concentrated out: beta by generalised least squares, s2 = y' Q y / (n - p), where Q = K^-1 - K^-1 F
(F' K^-1 F)^-1 F' K^-1 and K = R + g I. Restricted (residual) rather than plain likelihood: with a linear trend p is
not small beside n, and the plain one then underestimates s2 and the length scales (Santner, Williams and Notz, The
Design and Analysis of Computer Experiments, 2003, 3.3.2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from levelone.errors import LeveloneError
from levelone.uncertainty import lapack
from levelone.uncertainty.correlation import Correlation, correlate, squared_distances
from levelone.uncertainty.distributions import FloatArray

# Rate of the exponential prior on 1 / l: one unit of log likelihood for a length scale of the whole range of an
# input. It is what makes an inert input let go (its likelihood is flat) and keeps a start with every length short
# from being a stationary point.
PRIOR_RATE = 1.0

# A response that the trend explains exactly leaves y'Qy to rounding.
_LEAST_QUADRATIC = 1e-24

_JITTERS = (0.0, 1e-12, 1e-10, 1e-8, 1e-6)


class NotPositiveDefinite(LeveloneError):
    """No jitter up to 1e-6 makes the correlation matrix positive definite: the inputs are not finite."""


@dataclass(frozen=True, eq=False)
class Solves:
    """Generalised least squares at given hyperparameters, for p trend functions.

    ``factor`` is the lower Cholesky factor of K (upper triangle undefined); ``trend_solve`` = K^-1 F [n, p];
    ``trend_factor`` the lower Cholesky factor of F' K^-1 F; ``beta`` [p]; ``alpha`` = Q y [n]; ``quadratic`` = y' Q
    y; ``log_det`` = log |K| + log |F' K^-1 F|; ``jitter`` what had to be added to the diagonal beyond the nugget.
    """

    factor: FloatArray
    trend_solve: FloatArray
    trend_factor: FloatArray
    beta: FloatArray
    alpha: FloatArray
    quadratic: float
    log_det: float
    jitter: float


class RestrictedLikelihood:
    """Penalised negative log restricted likelihood of one response as a function of log l (and log g).

    Holds working arrays, so that an object belongs to one thread.

    Parameters
    ----------
    x
        [n, k] inputs in the unit cube.
    y
        [n] response, standardised.
    trend
        [n, p] trend functions F.
    kind
        Correlation.
    nugget
        Whether g is a hyperparameter of the likelihood; without it g = 0 there.
    """

    def __init__(self, x: FloatArray, y: FloatArray, trend: FloatArray, kind: Correlation, nugget: bool = False) -> None:
        self.x, self.y, self.trend, self.kind, self.nugget = x, y, trend, kind, nugget
        n = len(y)
        self._k, self._weight, self._scratch = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))

    def solves(self, lengths: FloatArray, nugget: float) -> Solves:
        """Factors and solves at length scales l [k] and nugget g, in arrays of their own."""
        self._correlate(self.x / lengths, with_weight=False)
        solves = self._solve(nugget)
        return replace(solves, factor=solves.factor.copy(order="F"))

    def __call__(self, parameters: FloatArray) -> tuple[float, FloatArray]:
        """Value and gradient by log l [k], followed by log g where there is a nugget."""
        k = self.x.shape[1]
        lengths, nugget = np.exp(parameters[:k]), float(np.exp(parameters[k])) if self.nugget else 0.0
        z = self.x / lengths
        self._correlate(z, with_weight=True)
        solves = self._solve(nugget)
        freedom = len(self.y) - self.trend.shape[1]
        value = 0.5 * (freedom * np.log(solves.quadratic / freedom) + solves.log_det) + PRIOR_RATE * (1.0 / lengths).sum()
        by_length, by_nugget = self._gradient(z, solves, freedom)
        gradient = by_length - PRIOR_RATE / lengths
        return float(value), np.append(gradient, nugget * by_nugget) if self.nugget else gradient

    def _correlate(self, z: FloatArray, with_weight: bool) -> None:
        r2 = squared_distances(z, z, out=self._scratch)
        np.fill_diagonal(r2, 0.0)
        correlate(self.kind, r2, self._k, self._weight if with_weight else None)

    def _solve(self, nugget: float) -> Solves:
        factor, jitter = self._factor(nugget)
        solved = lapack.solve(factor, np.column_stack([self.trend, self.y]))
        g = solved[:, :-1]
        trend_factor = np.asarray(np.linalg.cholesky(self.trend.T @ g), dtype=np.float64)
        half = solve_triangular(trend_factor, g.T @ self.y, lower=True)
        beta = solve_triangular(trend_factor, half, lower=True, trans=1)
        alpha = solved[:, -1] - g @ beta
        log_det = 2.0 * (np.log(factor.diagonal()).sum() + np.log(trend_factor.diagonal()).sum())
        quadratic = max(float(self.y @ alpha), _LEAST_QUADRATIC * len(self.y))
        return Solves(factor, g, trend_factor, beta, alpha, quadratic, float(log_det), jitter)

    def _factor(self, nugget: float) -> tuple[FloatArray, float]:
        """Lower Cholesky factor of K in the working array, adding the smallest jitter that lets it succeed."""
        for jitter in _JITTERS:
            np.copyto(self._scratch, self._k)
            np.fill_diagonal(self._scratch, 1.0 + nugget + jitter)
            # The transpose of a C-ordered symmetric matrix is the Fortran-ordered one that LAPACK overwrites without
            # a copy.
            factor = self._scratch.T
            if lapack.factorise(factor):
                return factor, jitter
        raise NotPositiveDefinite("the correlation matrix cannot be factorised")

    def _gradient(self, z: FloatArray, solves: Solves, freedom: int) -> tuple[FloatArray, float]:
        """Derivatives of the negative log restricted likelihood by log l [k] and by g.

        With M = Q / 2 - freedom / (2 y'Qy) alpha alpha', d/d(log l_j) = sum_ab M_ab W_ab (z_aj - z_bj)^2
        = 2 (sum_a r_a z_aj^2 - z_j' P z_j), P = M o W and r = P 1: two small products instead of k large ones.
        """
        m = solves.factor
        lapack.invert(m)
        trend = solve_triangular(solves.trend_factor, solves.trend_solve.T, lower=True)
        low_rank = np.vstack([trend, np.sqrt(freedom / solves.quadratic) * solves.alpha])
        m *= 0.5
        m -= np.matmul(low_rank.T, 0.5 * low_rank, out=self._k).T
        trace = float(m.trace())
        m *= self._weight.T
        product = lapack.symmetric_product(m, np.column_stack([z, np.ones(len(z))]))
        return 2.0 * (product[:, -1] @ z**2 - np.einsum("aj,aj->j", z, product[:, :-1])), trace
