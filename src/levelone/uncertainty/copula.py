"""Gaussian copula: correlated factors whose margins stay what they are.

The dependence is given as Spearman rank correlations, which no change of a margin touches. A point of the unit cube with
independent coordinates u becomes one with dependent coordinates v:

    w = Phi^-1(u),  z = L w,  v = Phi(z),  L L' = R,  R_ij = 2 sin(pi rho_ij / 6),

L lower triangular: the Rosenblatt transformation in the order of the factors. R holds the product-moment correlations of
the normal scores z (Pearson 1907; Fang, Fang and Kotz, Journal of Multivariate Analysis 82, 2002, 1-16; for sensitivity
analysis Kucherenko, Tarantola and Annoni, Computer Physics Communications 183, 2012, 937-946).
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri

from levelone.errors import InputError
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.distributions import FloatArray

UNIT_MARGIN = 2.0**-31
"""Distance that unbounded or correlated coordinates keep from 0 and 1, where they would be infinite as normal scores; half
the spacing of a 30-bit Sobol sequence, 6.1 standard deviations out."""

# Least eigenvalue of R that counts as positive definite: below it a factor is a function of the others to five digits.
_LEAST_EIGENVALUE = 1e-9


def normal_scores(u: FloatArray) -> FloatArray:
    """Phi^-1(u), with u kept :data:`UNIT_MARGIN` away from 0 and 1."""
    return ndtri(np.clip(u, UNIT_MARGIN, 1.0 - UNIT_MARGIN))


def score_correlation(rank_correlation: ArrayLike, names: tuple[str, ...]) -> FloatArray:
    """Correlation matrix R of the normal scores, [k, k].

    Parameters
    ----------
    rank_correlation
        [k, k], Spearman rank correlations: symmetric, ones on the diagonal, every other entry between -1 and 1.
    names
        Names of the k factors, for errors.

    Raises
    ------
    InputError
        Another shape, an entry that is not allowed, or rank correlations that no Gaussian copula has (R not positive
        definite): the error names the pair to change, and the range that the other pairs leave it.
    """
    rank = np.array(rank_correlation, dtype=np.float64)
    k = len(names)
    if rank.shape != (k, k):
        raise InputError("correlation", f"shape {rank.shape}; [{k}, {k}] is needed, one row and one column for each factor")
    if not np.isfinite(rank).all():
        raise InputError("correlation", "an entry is not a finite number")
    for i in range(k):
        if rank[i, i] != 1.0:
            raise InputError(f"correlation of {names[i]} with itself", f"{rank[i, i]:g}; it is 1")
    for i, j in combinations(range(k), 2):
        pair = f"correlation of {names[i]} and {names[j]}"
        if abs(rank[i, j] - rank[j, i]) > 1e-12:
            raise InputError(pair, f"{rank[i, j]:g} above and {rank[j, i]:g} below the diagonal; the matrix must be symmetric")
        if not abs(rank[i, j]) < 1.0:
            raise InputError(pair, f"{rank[i, j]:g}; a number between -1 and 1 is needed (at an end one factor sets the other)")
    scores = 2.0 * np.sin(np.pi / 6.0 * 0.5 * (rank + rank.T))
    np.fill_diagonal(scores, 1.0)
    if np.linalg.eigvalsh(scores)[0] < _LEAST_EIGENVALUE:
        raise _not_definite(scores, rank, names)
    return scores


def _not_definite(scores: FloatArray, rank: FloatArray, names: tuple[str, ...]) -> InputError:
    """The error for contradictory correlations: the pair whose smallest change, all others held, makes them possible."""
    best: tuple[float, int, int, float, float] | None = None
    for i, j in combinations(range(len(names)), 2):
        span = _allowed_range(scores, i, j)
        if span is not None:
            change = max(span[0] - rank[i, j], rank[i, j] - span[1])
            if best is None or change < best[0]:
                best = (change, i, j, *span)
    if best is not None:
        _, i, j, low, high = best
        allowed = f"with the other correlations as they are, it must lie between {low:.3f} and {high:.3f}"
    else:
        # No single pair will do: name the one that moves the most negative eigenvalue fastest.
        vector = np.abs(np.linalg.eigh(scores)[1][:, 0])
        i, j = max(combinations(range(len(names)), 2), key=lambda pair: vector[pair[0]] * vector[pair[1]])
        allowed = "more than one pair contradicts the others; begin with this one, nearer to zero"
    return InputError(
        f"correlation of {names[i]} and {names[j]}",
        f"{rank[i, j]:g} contradicts the other correlations (the matrix is not positive definite); {allowed}",
    )


def _allowed_range(scores: FloatArray, i: int, j: int) -> tuple[float, float] | None:
    """Rank correlations of i and j that keep R positive definite with all other pairs held; None where none does.

    The determinant is quadratic in the entry: its roots are c_i' K^-1 c_j -+ sqrt((1 - c_i' K^-1 c_i)(1 - c_j' K^-1 c_j)),
    K the matrix of the other factors and c_i, c_j their correlations with i and j.
    """
    others = [m for m in range(scores.shape[0]) if m not in (i, j)]
    inner, sides = scores[np.ix_(others, others)], scores[np.ix_(others, (i, j))]
    if others and np.linalg.eigvalsh(inner)[0] < _LEAST_EIGENVALUE:
        return None
    gram = sides.T @ np.linalg.solve(inner, sides)
    free_i, free_j = 1.0 - gram[0, 0], 1.0 - gram[1, 1]
    if free_i < _LEAST_EIGENVALUE or free_j < _LEAST_EIGENVALUE:
        return None
    half = np.sqrt(free_i * free_j)
    ends = np.clip([gram[0, 1] - half, gram[0, 1] + half], -1.0, 1.0)
    low, high = 6.0 / np.pi * np.arcsin(0.5 * ends)
    return float(low), float(high)


def dependent(u: FloatArray, scores: FloatArray) -> FloatArray:
    """Dependent coordinates v [n, k] of independent ones u [n, k], both in the unit cube.

    A factor that is correlated with none before it in the order keeps its coordinate bit for bit.
    """
    factor = np.asarray(np.linalg.cholesky(scores), dtype=np.float64)
    w, v = normal_scores(u), u.copy()
    for i in np.flatnonzero((np.tril(scores, -1) != 0.0).any(axis=1)):
        v[:, i] = ndtr(_combination(w[:, : i + 1], factor[i, : i + 1]))
    return v


def independent_scores(z: FloatArray, scores: FloatArray) -> FloatArray:
    """Independent normal scores w = L^-1 z of dependent ones z, [n, k] both."""
    factor = np.asarray(np.linalg.cholesky(scores), dtype=np.float64)
    w = np.empty_like(z)
    for i in range(z.shape[1]):
        w[:, i] = (z[:, i] - _combination(w[:, :i], factor[i, :i])) / factor[i, i]
    return w


def _combination(columns: FloatArray, weights: FloatArray) -> FloatArray:
    """Sum of weighted columns, [n], one after another: a matrix product may round a row differently in a larger batch."""
    total = np.zeros(columns.shape[0])
    for column, weight in zip(columns.T, weights, strict=True):
        total += weight * column
    return total


def resampled_prefixes(first: FloatArray, second: FloatArray, order: NDArray[np.int64], scores: FloatArray) -> FloatArray:
    """Normal scores in which more and more factors are drawn anew, given those that are kept.

    For each row the factors are taken from last to first in its order: the conditional (Rosenblatt) transformation in that
    sequence makes the last l to be taken, which are the first l of the order, depend on the last l coordinates alone. Drawing
    those anew is a draw from the Gaussian copula conditional on all other factors.

    Parameters
    ----------
    first, second
        [n, k], two independent sets of independent standard normal scores; column j belongs to factor j.
    order
        [n, k], a permutation of the factors in each row.
    scores
        [k, k], correlation matrix R.

    Returns
    -------
    [n, k + 1, k] dependent normal scores in the order of the factors: entry l keeps all but the first l factors of the
    order, which are drawn anew given the others.
    """
    n, k = first.shape
    sequence = order[:, ::-1]
    with OneBlasThread():
        factor = np.linalg.cholesky(scores[sequence[:, :, None], sequence[:, None, :]])
        taken = np.arange(k)[None, None, :] >= k - np.arange(k + 1)[None, :, None]
        kept, anew = (np.take_along_axis(scores_in, sequence, axis=1)[:, None, :] for scores_in in (first, second))
        inputs = np.where(taken, anew, kept)
        mixed = inputs @ factor.transpose(0, 2, 1)
    result = np.empty((n, k + 1, k))
    np.put_along_axis(result, np.broadcast_to(sequence[:, None, :], result.shape), mixed, axis=2)
    return result
