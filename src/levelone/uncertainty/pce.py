"""Sparse polynomial chaos: a response as a short sum of orthonormal polynomials, and its Sobol indices in closed form."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import qr, solve_triangular

from levelone.errors import InputError
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.chaos_indices import ChaosIndices, chaos_indices, jackknife_intervals
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import EstimateStatus, is_constant
from levelone.uncertainty.polynomials import Terms, evaluate, hyperbolic_terms, neighbours
from levelone.uncertainty.seeds import check_seed, stage_seed
from levelone.uncertainty.sparse_regression import select

# Truncations that compete: total degree lets inputs interact, low q lets single inputs have high degrees.
_NORMS = (0.5, 0.75, 1.0)
_MOST_DEGREE = 14
_MOST_CANDIDATES = 1500
_MOST_EXPANSIONS = 8
_FOLDS = 20
_LEAST_RUNS = 10
# Least part of a term that those before it must leave.
_ALIKE = 1e-12
# Points evaluated at once: terms x rows of 8 bytes stay within some MiB.
_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class PolynomialChaos:
    """A polynomial chaos expansion of one response of k inputs of the unit cube, independent of one another.

    Attributes
    ----------
    terms
        [p, k], degree of each term in each input, without the constant.
    coefficients
        [p], in the unit of the response.
    mean, variance
        Of the expansion: its constant, and the sum of the squared coefficients.
    q2
        1 - (mean squared error of held-out runs) / (variance of the response), the terms chosen anew without them:
        what to trust the expansion by.
    q2_loo
        The same from leave-one-out residuals of the terms as chosen with all runs; too high where many candidates
        were tried on few runs.
    loo_residual
        [n] leave-one-out residuals, the terms held.
    S1, ST
        [k] first-order and total Sobol indices of the expansion.
    S2
        [k, k] second-order indices above the diagonal, NaN elsewhere.
    S1_ci, ST_ci, S2_ci
        [k, 2], [k, 2], [k, k, 2]: 95 % intervals; see :mod:`levelone.uncertainty.chaos_indices`.
    status
        ``CONSTANT_RESPONSE``: predicts the constant, indices and ``q2`` are NaN. ``TOO_FEW_RUNS``, fewer
        than 10, or runs that bear out no term at all: predicts NaN.
    """

    terms: Terms
    coefficients: FloatArray
    mean: float
    variance: float
    q2: float
    q2_loo: float
    loo_residual: FloatArray
    S1: FloatArray
    ST: FloatArray
    S2: FloatArray
    S1_ci: FloatArray
    ST_ci: FloatArray
    S2_ci: FloatArray
    status: EstimateStatus

    @classmethod
    def fit(cls, x_unit: ArrayLike, y: ArrayLike, seed: int) -> PolynomialChaos:
        """Choose the terms, and estimate their coefficients by least squares.

        Truncation and degree are those whose choice has the least information criterion; candidates one and two
        degrees beyond the terms chosen are then offered until the criterion falls no further.

        Parameters
        ----------
        x_unit
            [n, k] points of the unit cube.
        y
            [n] response; every run finite.
        seed
            Seed of the folds of ``q2`` and of the intervals; terms and coefficients do not depend on it.

        Raises
        ------
        InputError
            Shapes that disagree, values that are not finite, points outside the unit cube, an input that never varies.
        """
        x, response = _check_data(x_unit, y)
        check_seed(seed)
        status = _status(response)
        if status is not EstimateStatus.OK:
            return cls._degenerate(x, response, status)
        with OneBlasThread():
            candidates, chosen = _search(x, response)
            if not chosen.size:
                return cls._degenerate(x, response, EstimateStatus.TOO_FEW_RUNS)
            return cls._assemble(x, response, candidates, chosen, seed)

    @classmethod
    def condition(cls, x_unit: ArrayLike, y: ArrayLike, terms: ArrayLike, seed: int) -> PolynomialChaos:
        """Estimate the coefficients of given terms [p, k], without a search; ``q2`` holds them too."""
        x, response = _check_data(x_unit, y)
        check_seed(seed)
        given = np.array(terms, dtype=np.int64)
        if given.ndim != 2 or given.shape[1] != x.shape[1] or (given < 0).any() or not given.any(axis=1).all():
            raise InputError("terms", f"shape {given.shape}; [p, {x.shape[1]}] degrees, none negative, without the constant")
        if len(np.unique(given, axis=0)) != len(given):
            raise InputError("terms", "a term is given twice")
        most = len(response) - -(-len(response) // _FOLDS) - 2
        if not 1 <= len(given) <= most:
            raise InputError("terms", f"{len(given)} terms; {len(response)} runs less a fold leave 1 to {most}")
        status = _status(response)
        if status is not EstimateStatus.OK:
            return cls._degenerate(x, response, status)
        with OneBlasThread():
            return cls._assemble(x, response, given, None, seed)

    @classmethod
    def _assemble(
        cls, x: FloatArray, y: FloatArray, candidates: Terms, chosen: NDArray[np.intp] | None, seed: int
    ) -> PolynomialChaos:
        """The expansion on the chosen candidates (all of them where None), with what the folds say about it."""
        values = evaluate(candidates, x)
        terms = candidates if chosen is None else candidates[chosen]
        coefficients, residual = _least_squares(values if chosen is None else values[chosen], y)
        q2, refits = _folds(values, y, candidates, seed, choose=chosen is not None)
        indices = chaos_indices(terms, coefficients[1:])
        intervals = jackknife_intervals(indices, refits, max(0.0, min(1.0, 1.0 - q2)))
        q2_loo = 1.0 - float(np.mean(residual**2) / y.var())
        moments = (float(coefficients[0]), indices.variance, q2, q2_loo)
        shares = (indices.S1, indices.ST, indices.S2, intervals.S1, intervals.ST, intervals.S2)
        return cls(terms, coefficients[1:], *moments, residual, *shares, EstimateStatus.OK)

    @classmethod
    def _degenerate(cls, x: FloatArray, y: FloatArray, status: EstimateStatus) -> PolynomialChaos:
        """One number everywhere: the constant, or NaN where there are too few runs."""
        k = x.shape[1]
        constant = float(y.mean()) if status is EstimateStatus.CONSTANT_RESPONSE else np.nan
        unknown, pairs = np.full(k, np.nan), np.full((k, k), np.nan)
        ci, pairs_ci = np.full((k, 2), np.nan), np.full((k, k, 2), np.nan)
        nothing = (np.empty((0, k), dtype=np.int64), np.empty(0), constant, 0.0 * constant, np.nan, np.nan)
        return cls(*nothing, np.full(len(y), np.nan), unknown, unknown, pairs, ci, ci, pairs_ci, status)

    def predict_mean(self, x_unit: ArrayLike) -> FloatArray:
        """Value of the expansion at points [n, k] of the unit cube, shape [n]; memory does not grow with n beyond the result."""
        points = np.asarray(x_unit, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != self.terms.shape[1]:
            raise InputError("x_unit", f"shape {points.shape}; [n, {self.terms.shape[1]}] is needed")
        _check_unit(points)
        value = np.empty(len(points))
        with OneBlasThread():
            for start in range(0, len(points), _CHUNK):
                rows = slice(start, start + _CHUNK)
                value[rows] = self.mean + self.coefficients @ evaluate(self.terms, points[rows])
        return value


def _check_data(x: ArrayLike, y: ArrayLike) -> tuple[FloatArray, FloatArray]:
    points, response = np.array(x, dtype=np.float64), np.array(y, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] < 1 or response.shape != (len(points),):
        raise InputError("x_unit, y", f"shapes {points.shape} and {response.shape}; [n, k] and [n] are needed")
    if not np.isfinite(response).all():
        raise InputError("y", "a value is not finite; leave failed runs out, and count them")
    _check_unit(points)
    still = np.flatnonzero(np.ptp(points, axis=0) == 0.0) if len(points) > 1 else np.empty(0)
    if still.size:
        raise InputError("x_unit", f"column {still[0]} never varies; the runs say nothing about that input")
    return points, response


def _check_unit(points: FloatArray) -> None:
    if not ((points >= 0.0) & (points <= 1.0)).all():
        raise InputError("x_unit", "a coordinate of the unit cube lies outside 0 to 1 or is NaN")


def _status(y: FloatArray) -> EstimateStatus:
    if len(y) < _LEAST_RUNS:
        return EstimateStatus.TOO_FEW_RUNS
    return EstimateStatus.CONSTANT_RESPONSE if is_constant(y) else EstimateStatus.OK


def _search(x: FloatArray, y: FloatArray) -> tuple[Terms, NDArray[np.intp]]:
    """The candidates offered last, and which of them were chosen."""
    best: tuple[float, Terms, NDArray[np.intp]] | None = None
    for terms in _truncations(x.shape[1]):
        chosen, criterion = select(evaluate(terms, x), y)
        if best is None or criterion < best[0]:
            best = (criterion, terms, chosen)
    assert best is not None
    criterion, terms, chosen = best
    truncation = terms
    for _ in range(_MOST_EXPANSIONS):
        wider = neighbours(truncation, terms[chosen])
        taken, lower = select(evaluate(wider, x), y)
        if lower >= criterion:
            break
        criterion, terms, chosen = lower, wider, taken
    return terms, chosen


def _truncations(k: int) -> Iterator[Terms]:
    for norm in _NORMS:
        terms, norms = hyperbolic_terms(k, _MOST_DEGREE, norm, _MOST_CANDIDATES)
        for degree in range(1, int(np.ceil(norms[-1] - 1e-6)) + 1):
            yield terms[norms <= degree * (1.0 + 1e-6)]


def _least_squares(values: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients [p + 1], the constant first, and leave-one-out residuals [n], from values of the terms [p, n]."""
    matrix = np.column_stack([np.ones(len(y)), values.T])
    q, r = qr(matrix, mode="economic", check_finite=False)
    size = np.abs(r.diagonal())
    if size.min() <= _ALIKE * size.max():
        raise InputError("terms", "two or more of them are the same at the runs, which therefore cannot tell them apart")
    coefficients = solve_triangular(r, q.T @ y)
    free = np.maximum(1.0 - np.einsum("ij,ij->i", q, q), np.finfo(np.float64).eps)
    return coefficients, (y - matrix @ coefficients) / free


def _folds(values: FloatArray, y: FloatArray, candidates: Terms, seed: int, *, choose: bool) -> tuple[float, list[ChaosIndices]]:
    """Q2 of held-out runs, and the indices without each fold (of the folds without which the response still varies)."""
    n = len(y)
    count = min(_FOLDS, n)
    fold = np.random.default_rng(stage_seed(seed, "folds of polynomial chaos")).permutation(n) % count
    error, refits = np.empty(n), []
    for held in range(count):
        kept = fold != held
        if is_constant(y[kept]):  # all that varies is in this fold: without it there is nothing to share out
            error[~kept] = y[~kept] - y[kept].mean()
            continue
        trained = np.ascontiguousarray(values[:, kept])
        chosen = select(trained, y[kept])[0] if choose else np.arange(len(values))
        coefficients, _ = _least_squares(trained[chosen], y[kept])
        error[~kept] = y[~kept] - coefficients[0] - coefficients[1:] @ values[np.ix_(chosen, ~kept)]
        if chosen.size:
            refits.append(chaos_indices(candidates[chosen], coefficients[1:]))
    return 1.0 - float(np.mean(error**2) / y.var()), refits
