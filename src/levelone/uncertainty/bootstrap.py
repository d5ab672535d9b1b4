"""Resampling as a matrix product: counts of how often each block was drawn, times what each block contributes."""

from __future__ import annotations

import numpy as np

from levelone.errors import InputError
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.seeds import stage_seed

CONFIDENCE = 0.95
"""Level of every bootstrap interval."""

# Replicates whose counts are held at once: 64 rows of 2^14 blocks are 8 MiB.
_AT_ONCE = 64


def resampled_means(terms: FloatArray, replicates: int, seed: int, stage: str) -> FloatArray:
    """Means of ``terms`` over n blocks drawn with replacement.

    Parameters
    ----------
    terms
        [n, t], what each block contributes.
    replicates
        Number of resamplings, at least 2.
    seed, stage
        The draws come from the stream of the stage ``stage`` of this seed.

    Returns
    -------
    [replicates, t]
    """
    if replicates < 2:
        raise InputError("bootstrap", f"{replicates!r}; at least 2 resamplings are needed")
    rng = np.random.default_rng(stage_seed(seed, stage))
    n = terms.shape[0]
    means = np.empty((replicates, terms.shape[1]))
    with OneBlasThread():
        for start in range(0, replicates, _AT_ONCE):
            drawn = rng.integers(0, n, size=(min(_AT_ONCE, replicates - start), n))
            counts = np.array([np.bincount(row, minlength=n) for row in drawn], dtype=np.float64)
            means[start : start + len(counts)] = counts @ terms / n
    return means


def interval(replicates: FloatArray) -> FloatArray:
    """Percentile interval [k, 2] at :data:`CONFIDENCE` of bootstrap replicates [replicates, k]."""
    tail = 50.0 * (1.0 - CONFIDENCE)
    return np.percentile(replicates, [tail, 100.0 - tail], axis=0).T
