"""Orthonormal polynomials on the unit cube: which products of Legendre polynomials to offer, and their values.

A term is a multi-index alpha, one degree for each input; its value at u is the product over j of sqrt(2 alpha_j + 1)
P_alpha_j(2 u_j - 1), with P_d the Legendre polynomials. Over independent uniform coordinates the mean of the product of
two terms is 1 if they are the same and 0 otherwise, so that the variance of an expansion is the sum of its squared
coefficients. Other distributions enter by their map from the unit cube.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from math import comb

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from levelone.uncertainty.distributions import FloatArray

Terms = NDArray[np.int64]

# A pattern of degrees whose norm is the bound itself must not fall to rounding.
_ROUNDING = 1e-9


def hyperbolic_terms(k: int, degree: int, norm: float, most: int) -> tuple[Terms, FloatArray]:
    """Multi-indices with q-norm (sum_j alpha_j^q)^(1/q) up to a degree, shortest norm first.

    Source: Blatman and Sudret, Journal of Computational Physics 230, 2011, 2345-2367, section 3.2. q = 1 is total
    degree; below 1 terms of many inputs have to be of lower degree than those of one.

    Parameters
    ----------
    k
        Number of inputs.
    degree
        Largest q-norm.
    norm
        q, above 0 and up to 1.
    most
        Sets of more terms than this are cut at the largest whole degree that stays below.

    Returns
    -------
    terms
        [p, k], without the constant.
    norms
        [p], ascending.
    """
    whole = 0
    while whole < degree and _count(k, whole + 1, norm) <= most:
        whole += 1
    rows = list(_indices(k, whole, norm))
    terms = np.array(rows, dtype=np.int64).reshape(-1, k)
    norms = np.sum(terms.astype(np.float64) ** norm, axis=1) ** (1.0 / norm)
    order = np.argsort(norms, kind="stable")
    return terms[order], norms[order]


def _count(k: int, degree: int, norm: float) -> int:
    budget = _budget(degree, norm)
    return sum(
        comb(k, inputs) * sum(1 for _ in _patterns(inputs, budget, norm)) for inputs in range(1, _most_inputs(k, budget) + 1)
    )


def _indices(k: int, degree: int, norm: float) -> Iterator[list[int]]:
    budget = _budget(degree, norm)
    for order in range(1, _most_inputs(k, budget) + 1):
        patterns = list(_patterns(order, budget, norm))
        for inputs in combinations(range(k), order):
            for pattern in patterns:
                index = [0] * k
                for j, d in zip(inputs, pattern, strict=True):
                    index[j] = d
                yield index


def _budget(degree: int, norm: float) -> float:
    return degree**norm * (1.0 + _ROUNDING)


def _most_inputs(k: int, budget: float) -> int:
    return min(k, int(budget))


def _patterns(inputs: int, budget: float, norm: float) -> Iterator[tuple[int, ...]]:
    """Positive degrees of so many inputs whose powers add up to no more than the budget."""
    if inputs == 0:
        yield ()
        return
    degree = 1
    while degree**norm + inputs - 1 <= budget:
        for rest in _patterns(inputs - 1, budget - degree**norm, norm):
            yield (degree, *rest)
        degree += 1


def evaluate(terms: Terms, u: FloatArray) -> FloatArray:
    """Values of terms [p, k] at points u [n, k] of the unit cube, shape [p, n]."""
    values = np.ones((len(terms), len(u)))
    for j in range(terms.shape[1]):
        rows = np.flatnonzero(terms[:, j])
        if rows.size:
            degree = int(terms[rows, j].max())
            legendre = (legvander(2.0 * u[:, j] - 1.0, degree) * np.sqrt(2.0 * np.arange(degree + 1) + 1.0)).T
            values[rows] *= legendre[terms[rows, j]]
    return values


def neighbours(offered: Terms, chosen: Terms) -> Terms:
    """The terms offered, those chosen, and those one and two degrees beyond a chosen one in one input, [p, k].

    Two, since a response that is even or odd in an input has no neighbour of one degree; a term of one input gains a
    second input in the same way.
    """
    k = offered.shape[1]
    steps = np.concatenate([np.eye(k, dtype=np.int64), 2 * np.eye(k, dtype=np.int64)])
    beyond = (chosen[:, None, :] + steps).reshape(-1, k)
    return np.unique(np.concatenate([offered, chosen, beyond]), axis=0)
