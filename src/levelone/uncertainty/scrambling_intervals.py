"""Intervals from the spread between independent scramblings of a quasi-random design."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from levelone.uncertainty.bootstrap import CONFIDENCE
from levelone.uncertainty.distributions import FloatArray

FEWEST = 4
"""Scramblings below which their spread says too little: Student's factor for three is 1.35 times that for four."""


def scrambling_intervals(
    terms: FloatArray, scrambling: NDArray[np.int64], ratios: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Student intervals at the level :data:`levelone.uncertainty.bootstrap.CONFIDENCE` about the pooled estimate.

    The points of one scrambling are not independent of one another, the scramblings are: the jackknife leaves out one
    scrambling at a time. Scramblings may differ in size, since base points with a failed run are left out.

    Source: Busing, Meijer and van der Leeden, Statistics and Computing 9, 1999, 3-8, equations 4 to 6 (delete-m_j
    jackknife), about the pooled estimate. That Student intervals over a few scramblings hold what they claim, where
    bootstraps do not: L'Ecuyer, Nakayama, Owen and Tuffin, Proc. Winter Simulation Conference 2023, 445-456.

    Parameters
    ----------
    terms
        [n, t]: what each base point contributes.
    scrambling
        [n]: which scrambling it belongs to; at least two different.
    ratios
        Map from means of the terms [replicates, t] to the estimates [replicates, q].

    Returns
    -------
    [q, 2]
    """
    labels, sizes = np.unique(scrambling, return_counts=True)
    sums = np.array([terms[scrambling == label].sum(axis=0) for label in labels])
    total = sums.sum(axis=0)
    whole = ratios(total[None] / sizes.sum())[0]
    without = ratios((total - sums) / (sizes.sum() - sizes)[:, None])
    h = (sizes.sum() / sizes)[:, None]
    pseudo = h * whole - (h - 1.0) * without
    spread = ((pseudo - (pseudo / h).sum(axis=0)) ** 2 / (h - 1.0)).mean(axis=0)
    half = student.ppf(0.5 + 0.5 * CONFIDENCE, labels.size - 1) * np.sqrt(spread)
    return np.stack([whole - half, whole + half], axis=1)
