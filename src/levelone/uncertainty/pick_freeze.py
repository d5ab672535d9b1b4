"""What each base point of a pick-freeze design adds to the means from which indices are made, and the indices from them.

a, b, c_j and d_j stand for the response at A, at B, at A with column j from B and at B with column j from A.
"""

from __future__ import annotations

import numpy as np

from levelone.uncertainty.distributions import FloatArray


def pick_freeze_terms(blocks: FloatArray, second_order: bool) -> FloatArray:
    """Terms whose means are numerators and denominators of the indices.

    Without second order: S1_j = mean(b (c_j - a)) / V (Saltelli et al., Computer Physics Communications 181, 2010,
    259-270, table 2, b) and ST_j = mean((a - c_j)^2) / (2 V) (Jansen, Computer Physics Communications 117, 1999, 35-43;
    the same table, f), V the variance of a and b together.

    With second order the two halves of the design take each other's part (Azzini, Mara and Rosati, Environmental
    Modelling and Software 144, 2021, 105167, equations of the innovative estimators): with W_j = mean((a - b)^2 + (c_j -
    d_j)^2), S1_j = 2 mean((c_j - a) (b - d_j)) / W_j and ST_j = mean((c_j - a)^2 + (b - d_j)^2) / W_j, so that S1_j is
    never above ST_j, and both are exactly zero for an inert column. The share of a pair is the mean of the products
    (c_i - a) (d_j - b) and (c_j - a) (d_i - b), over V: each expands to the four products of Saltelli, Computer Physics
    Communications 145, 2002, 280-297, section 3, with the first-order part of i taken from one half of the design and
    that of j from the other; it is exactly zero where one of the two is inert.

    Parameters
    ----------
    blocks
        [n, block]: a, the c_j, the d_j (second order only), b.
    second_order
        Whether the blocks hold the d_j.

    Returns
    -------
    [n, t]: k numerators of S1, k of ST and, with second order, those of the pairs i < j row by row and k of W_j / 4; last,
    half of a + b and half of a^2 + b^2. All are about the mean of all runs.
    """
    centred = blocks - blocks.mean()
    a, b, inner = centred[:, :1], centred[:, -1:], centred[:, 1:-1]
    moments = [0.5 * (a + b), 0.5 * (a * a + b * b)]
    if not second_order:
        return np.hstack([b * (inner - a), 0.5 * (a - inner) ** 2, *moments])
    c, d = np.split(inner, 2, axis=1)
    from_a, from_b = c - a, d - b
    i, j = np.triu_indices(c.shape[1], 1)
    pairs = 0.5 * (from_a[:, i] * from_b[:, j] + from_a[:, j] * from_b[:, i])
    spread = 0.25 * ((a - b) ** 2 + (c - d) ** 2)
    return np.hstack([-0.5 * from_a * from_b, 0.25 * (from_a**2 + from_b**2), pairs, spread, *moments])


def pick_freeze_ratios(means: FloatArray, k: int, second_order: bool) -> FloatArray:
    """Indices from means of the terms.

    Parameters
    ----------
    means
        [replicates, t], in the order of :func:`pick_freeze_terms`.
    k
        Number of columns.
    second_order
        Whether the terms are those of a design with second order.

    Returns
    -------
    [replicates, q]: S1, ST and, with second order, the pairs i < j row by row. NaN or infinite where the response does
    not vary.
    """
    variance = (means[:, -1] - means[:, -2] ** 2)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        if not second_order:
            return np.asarray(means[:, :-2] / variance)
        own = means[:, -2 - k : -2]
        return np.hstack([means[:, :k] / own, means[:, k : 2 * k] / own, means[:, 2 * k : -2 - k] / variance])
