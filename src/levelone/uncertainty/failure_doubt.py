"""Whether failed runs leave an estimate worth reading: evidence, and words for it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.stats import mannwhitneyu, rankdata

from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import EstimateStatus

GATHERED_BELOW = 0.01
"""Failures count as gathered in a part of the factor box below this probability, all tests together."""

NEGLIGIBLE = 1e-3
"""Part of the whole so small that failed runs which move an estimate by less raise no doubt: the interval of an inert factor may
have no width at all."""


def gathered_p(sample: FloatArray, failed: NDArray[np.bool_]) -> float:
    """Probability that failures which fall anywhere would look as gathered as these.

    Parameters
    ----------
    sample
        [n, k], factors of n independent runs, in any unit.
    failed
        [n], which of them failed.

    Returns
    -------
    Smallest p-value of the rank tests (Mann and Whitney) of each factor and of the distance of its rank from the middle, times
    the number of tests; NaN where none or all failed. The normal form of the test: the exact one, which SciPy prefers for a few
    failed runs, takes seconds beside thousands of others.
    """
    if not failed.any() or failed.all():
        return float("nan")
    ranks = rankdata(sample, axis=0)
    places = np.hstack([ranks, np.abs(ranks - 0.5 * (len(sample) + 1))])
    places = places[:, np.ptp(places, axis=0) > 0.0]
    if not places.shape[1]:
        return float("nan")
    p_value = mannwhitneyu(places[failed], places[~failed], axis=0, method="asymptotic").pvalue
    return float(min(1.0, p_value.min() * places.shape[1]))


def leaves(ci: FloatArray, others: Iterable[FloatArray], whole: float = 1.0) -> bool:
    """Whether any other estimate [q] lies outside the intervals [q, 2], made longer by :data:`NEGLIGIBLE` of ``whole``."""
    low, high = ci[:, 0] - NEGLIGIBLE * whole, ci[:, 1] + NEGLIGIBLE * whole
    return not all(((low <= other) & (other <= high)).all() for other in others)


def doubt(status: EstimateStatus, failed: int, failure_p: float, moved: bool | None) -> str:
    """Why an estimate cannot be trusted, in words; empty where nothing speaks against it.

    Parameters
    ----------
    status
        Status of the estimate; another than ok is the first reason.
    failed
        Number of failed runs.
    failure_p
        From :func:`gathered_p`; below :data:`GATHERED_BELOW` it is a reason where ``moved`` is not known.
    moved
        Whether failed runs at the lowest or at the highest value seen move the estimate; None where that was not computed.
    """
    if status is not EstimateStatus.OK:
        return status.text
    if moved is not None:
        return "failed runs at the lowest or at the highest value seen move the estimate out of its interval" if moved else ""
    if failed and failure_p < GATHERED_BELOW:
        return "failed runs gather in a part of the factor box, which leaving them out leaves out"
    return ""
