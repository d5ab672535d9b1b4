"""Kriging: a Gaussian process conditioned on the runs of a design, to be asked in place of the model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

from levelone.errors import InputError, unknown_name
from levelone.uncertainty import lapack
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.correlation import CORRELATIONS, Correlation, correlate, squared_distances
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import EstimateStatus, is_constant
from levelone.uncertainty.likelihood import RestrictedLikelihood, Solves
from levelone.uncertainty.multistart import search
from levelone.uncertainty.seeds import check_seed

Trend = Literal["constant", "linear"]

# Rows predicted at once: with 500 training points the two working arrays of 1 MiB stay in a core's cache.
_CHUNK = 256


@dataclass(frozen=True, eq=False)
class Prediction:
    """Mean and standard deviation at n points, [n] each, in the unit of the response."""

    mean: FloatArray
    std: FloatArray


@dataclass(frozen=True, eq=False)
class _Memory:
    """What prediction needs: scaling of input and output, training points in units of the length scales, solves."""

    x_low: FloatArray
    x_width: FloatArray
    y_mean: float
    y_std: float
    z: FloatArray
    solves: Solves


@dataclass(frozen=True, eq=False)
class Kriging:
    """A fitted Kriging model of one response of k inputs.

    Attributes
    ----------
    correlation, trend
        Correlation function and trend.
    lengths
        [k] length scales in units of the range that each input has in the training points; at the upper bound for an
        inert input.
    nugget
        Variance of noise over variance of the process.
    variance
        Variance of the process, in the squared unit of the response.
    q2
        1 - (sum of squared leave-one-out residuals) / (sum of squares about the mean).
    loo_residual, loo_std
        [n] leave-one-out residuals (model minus prediction) and their standard deviations.
    status
        ``CONSTANT_RESPONSE``: predicts the constant, ``q2`` is NaN. ``TOO_FEW_RUNS``: predicts NaN.
    """

    correlation: Correlation
    trend: Trend
    lengths: FloatArray
    nugget: float
    variance: float
    q2: float
    loo_residual: FloatArray
    loo_std: FloatArray
    status: EstimateStatus
    _memory: _Memory | float = field(repr=False)

    @classmethod
    def fit(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        seed: int,
        *,
        correlation: Correlation | Literal["likeliest"] = "likeliest",
        trend: Trend = "constant",
        nugget: bool = True,
        starts: int = 6,
    ) -> Kriging:
        """Estimate length scales and nugget by penalised restricted likelihood, and condition on the data.

        Parameters
        ----------
        x
            [n, k] inputs, in any unit; each must vary.
        y
            [n] response.
        seed
            Seed of the starting points; the result depends on no thread count.
        correlation
            One correlation function, or "likeliest" to let both compete.
        trend
            "constant" or "linear" in the inputs, estimated by generalised least squares.
        nugget
            Whether to estimate a nugget; without it the model interpolates, and a jitter is added only where the
            factorisation needs it.
        starts
            Starts of the search for each correlation.

        Raises
        ------
        InputError
            Shapes that disagree, values that are not finite, an input that never varies, an unknown option.
        """
        x, y = check_data(x, y)
        kinds = CORRELATIONS if correlation == "likeliest" else (_check_correlation(correlation),)
        if starts < 1:
            raise InputError("starts", f"{starts!r}; at least one is needed")
        check_seed(seed)
        status = _status(y, trend_functions(x, trend))
        if status is not EstimateStatus.OK:
            return cls._degenerate(x, y, kinds[0], trend, status)
        u = (x - x.min(axis=0)) / np.ptp(x, axis=0)
        with OneBlasThread():
            found = search(u, (y - y.mean()) / y.std(), trend_functions(u, trend), kinds, nugget, seed, starts)
        k = x.shape[1]
        ratio = float(np.exp(found.parameters[k])) if nugget else 0.0
        return cls.condition(x, y, np.exp(found.parameters[:k]), ratio, correlation=found.kind, trend=trend)

    @classmethod
    def condition(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        lengths: ArrayLike,
        nugget: float = 0.0,
        *,
        correlation: Correlation = "matern52",
        trend: Trend = "constant",
    ) -> Kriging:
        """Condition on the data without a search: at given length scales [k], in units of the range of each input."""
        x, y = check_data(x, y)
        lengths = np.array(lengths, dtype=np.float64)
        if lengths.shape != (x.shape[1],) or not (lengths > 0.0).all() or not nugget >= 0.0:
            raise InputError("lengths", f"{lengths} and nugget {nugget!r}; {x.shape[1]} positive numbers, nugget >= 0")
        status = _status(y, trend_functions(x, trend))
        if status is not EstimateStatus.OK:
            return cls._degenerate(x, y, _check_correlation(correlation), trend, status)
        low, width = x.min(axis=0), np.ptp(x, axis=0)
        u, y_mean, y_std = (x - low) / width, float(y.mean()), float(y.std())
        basis = trend_functions(u, trend)
        likelihood = RestrictedLikelihood(u, (y - y_mean) / y_std, basis, _check_correlation(correlation))
        with OneBlasThread():
            solves = likelihood.solves(lengths, nugget)
            variance = solves.quadratic / (len(y) - basis.shape[1])
            residual, std = _leave_one_out(solves, variance)
        memory = _Memory(low, width, y_mean, y_std, u / lengths, solves)
        q2 = 1.0 - float(np.sum(residual**2)) / len(y)
        loo = (residual * y_std, std * y_std)
        return cls(correlation, trend, lengths, nugget, variance * y_std**2, q2, *loo, EstimateStatus.OK, memory)

    @classmethod
    def _degenerate(cls, x: FloatArray, y: FloatArray, correlation: Correlation, trend: Trend, status: EstimateStatus) -> Kriging:
        """A model that predicts one number everywhere: the constant, or NaN where there are too few runs."""
        constant = float(y.mean()) if status is EstimateStatus.CONSTANT_RESPONSE else np.nan
        unknown = np.full(len(y), np.nan)
        lengths = np.full(x.shape[1], np.nan)
        return cls(correlation, trend, lengths, np.nan, np.nan, np.nan, unknown, unknown, status, constant)

    @property
    def trend_terms(self) -> int:
        """Number of functions that make the trend."""
        return 1 if self.trend == "constant" else 1 + len(self.lengths)

    def require_runs(self, x: ArrayLike, y: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """The runs x [n, k], y [n] as arrays; InputError where they are not those that the model was fitted to."""
        x, y = check_data(x, y)
        same = x.shape == (len(self.loo_residual), len(self.lengths))
        if same and isinstance(self._memory, _Memory):
            same = np.array_equal(x.min(axis=0), self._memory.x_low) and y.mean() == self._memory.y_mean
        if not same:
            raise InputError("x, y", f"{len(y)} runs that are not the {len(self.loo_residual)} runs that the model was fitted to")
        return x, y

    def predict(self, x: ArrayLike) -> Prediction:
        """Mean and standard deviation of the response without its noise at x [n, k].

        The standard deviation includes that of the trend (universal Kriging) and not that of the hyperparameters. It
        costs ten times the mean: use :meth:`predict_mean` where only the mean is wanted.
        """
        points = self._check_points(x)
        mean, std = np.empty(len(points)), np.empty(len(points))
        if not isinstance(self._memory, _Memory):
            return Prediction(np.full(len(points), self._memory), np.full(len(points), 0.0 * self._memory))
        solves = self._memory.solves
        with OneBlasThread():
            for rows, k, basis in self._chunks(points):
                mean[rows] = k @ solves.alpha + basis @ solves.beta
                explained = solve_triangular(solves.factor, k.T, lower=True, check_finite=False)
                gap = solve_triangular(solves.trend_factor, basis.T - solves.trend_solve.T @ k.T, lower=True)
                std[rows] = 1.0 - np.einsum("ij,ij->j", explained, explained) + np.einsum("ij,ij->j", gap, gap)
        return Prediction(self._memory.y_mean + self._memory.y_std * mean, np.sqrt(self.variance * np.maximum(std, 0.0)))

    def predict_mean(self, x: ArrayLike) -> FloatArray:
        """Mean of the response at x [n, k], shape [n]; memory does not grow with n beyond the result."""
        points = self._check_points(x)
        if not isinstance(self._memory, _Memory):
            return np.full(len(points), self._memory)
        mean = np.empty(len(points))
        with OneBlasThread():
            for rows, k, basis in self._chunks(points):
                mean[rows] = k @ self._memory.solves.alpha + basis @ self._memory.solves.beta
        return self._memory.y_mean + self._memory.y_std * mean

    def _check_points(self, x: ArrayLike) -> FloatArray:
        points = np.asarray(x, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != len(self.lengths) or not np.isfinite(points).all():
            raise InputError("x", f"shape {points.shape}; [n, {len(self.lengths)}] of finite numbers is needed")
        return points

    def _chunks(self, points: FloatArray) -> Iterator[tuple[slice, FloatArray, FloatArray]]:
        """Rows, correlation with the training points [rows, n] (valid until the next), trend functions [rows, p]."""
        memory = self._memory
        assert isinstance(memory, _Memory)
        r2, k = np.empty((_CHUNK, len(memory.z))), np.empty((_CHUNK, len(memory.z)))
        for start in range(0, len(points), _CHUNK):
            u = (points[start : start + _CHUNK] - memory.x_low) / memory.x_width
            m = len(u)
            squared_distances(u / self.lengths, memory.z, out=r2[:m])
            yield slice(start, start + m), correlate(self.correlation, r2[:m], k[:m]), trend_functions(u, self.trend)


def _leave_one_out(solves: Solves, variance: float) -> tuple[FloatArray, FloatArray]:
    """Residuals and standard deviations of leaving out each point in turn, hyperparameters held.

    Residual i is (Q y)_i / Q_ii, its variance s2 / Q_ii (Dubrule, Mathematical Geology 15, 1983, 687-699), Q as in
    :mod:`levelone.uncertainty.likelihood`: the trend is estimated anew without the point.
    """
    inverse = solves.factor.copy(order="F")
    lapack.invert(inverse)
    trend = solve_triangular(solves.trend_factor, solves.trend_solve.T, lower=True)
    q = inverse.diagonal() - np.einsum("pi,pi->i", trend, trend)
    return solves.alpha / q, np.sqrt(variance / q)


def trend_functions(u: FloatArray, trend: Trend) -> FloatArray:
    """Trend functions [n, p] at points of the unit cube."""
    ones = np.ones((len(u), 1))
    if trend == "constant":
        return ones
    if trend != "linear":
        raise unknown_name("trend", trend, get_args(Trend))
    return np.hstack([ones, u - 0.5])


def _status(y: FloatArray, basis: FloatArray) -> EstimateStatus:
    if len(y) < basis.shape[1] + 2:
        return EstimateStatus.TOO_FEW_RUNS
    return EstimateStatus.CONSTANT_RESPONSE if is_constant(y) else EstimateStatus.OK


def _check_correlation(correlation: str) -> Correlation:
    for kind in CORRELATIONS:
        if kind == correlation:
            return kind
    raise unknown_name("correlation", correlation, (*CORRELATIONS, "likeliest"))


def check_data(x: ArrayLike, y: ArrayLike) -> tuple[FloatArray, FloatArray]:
    x, y = np.array(x, dtype=np.float64), np.array(y, dtype=np.float64)
    if x.ndim != 2 or y.shape != x.shape[:1]:
        raise InputError("x, y", f"shapes {x.shape} and {y.shape}; [n, k] and [n] are needed")
    if not np.isfinite(x).all():
        raise InputError("x", "an input is not finite")
    failed = np.flatnonzero(~np.isfinite(y))
    if failed.size:
        raise InputError("y", f"{failed.size} of {y.size} values are not finite (first at row {failed[0]}); drop these rows")
    if len(y) > 1 and (still := np.flatnonzero(np.ptp(x, axis=0) == 0.0)).size:
        raise InputError(f"x[:, {still[0]}]", "this input never varies; leave it out")
    return x, y
