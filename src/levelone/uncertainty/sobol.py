"""First-order and total shares of the variance of a response, by pick-freeze."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from levelone.uncertainty.bootstrap import interval, resampled_means
from levelone.uncertainty.designs import Design
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import (
    EstimateStatus,
    Policy,
    as_values,
    bounding_values,
    check_policy,
    complete_blocks,
    is_constant,
)


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Sobol indices of one response for each of k factors.

    Attributes
    ----------
    names
        Names of the factors.
    S1, ST
        [k]: first-order and total indices; estimates, so that they may leave [0, 1] by their sampling error.
    S1_ci, ST_ci
        [k, 2]: 95 % bootstrap intervals over base points. On a surrogate they say nothing about the surrogate's own
        error.
    variance
        Variance of the response.
    base, used
        Base points of the design, and those without a failed run.
    failed
        Runs that failed.
    status
        ``CONSTANT_RESPONSE`` or ``TOO_FEW_RUNS``: every index is then NaN.
    bounding
        Under the policy "bound" with failures: the indices with failed runs at the lowest and at the highest value
        seen.
    """

    names: tuple[str, ...]
    S1: FloatArray
    ST: FloatArray
    S1_ci: FloatArray
    ST_ci: FloatArray
    variance: float
    base: int
    used: int
    failed: int
    status: EstimateStatus
    bounding: tuple[SobolIndices, SobolIndices] | None = None


def sobol(design: Design, values: ArrayLike, *, bootstrap: int = 500, policy: Policy = "refuse") -> SobolIndices:
    """Sobol indices from a pick-freeze design.

    With a, b, c_j the response at A, B and A with coordinate j from B, centred by the mean of all runs, and V the
    variance of a and b together: S1_j = mean(b (c_j - a)) / V (Saltelli et al., Computer Physics Communications 181,
    2010, 259-270, table 2, b) and ST_j = mean((a - c_j)^2) / (2 V) (Jansen, Computer Physics Communications 117,
    1999, 35-43; the same table, f).

    Parameters
    ----------
    design
        From :func:`levelone.uncertainty.designs.sobol_design`.
    values
        [runs], one response; NaN where a run failed.
    bootstrap
        Number of resamplings of the base points; their seed derives from that of the design. The points are treated
        as independent, which on Sobol points makes the intervals wider than the error that is there.
    policy
        What to do about failed runs: see :mod:`levelone.uncertainty.failures`.

    Raises
    ------
    InputError
        Another kind of design, another length, an unknown policy, failed runs under "refuse".
    """
    design.require("sobol")
    y = as_values(values, design.runs)
    check_policy(policy, y)
    failed = int(np.isnan(y).sum())
    bounding = None
    if policy == "bound" and failed:
        low, high = (_indices(design, filled, bootstrap, failed) for filled in bounding_values(y))
        bounding = (low, high)
    return _indices(design, y, bootstrap, failed, bounding)


def _indices(
    design: Design,
    y: FloatArray,
    bootstrap: int,
    failed: int,
    bounding: tuple[SobolIndices, SobolIndices] | None = None,
) -> SobolIndices:
    k = len(design.space)
    blocks = y.reshape(-1, design.block)[complete_blocks(y, design.block)]
    used = blocks.shape[0]
    point, ci, variance = np.full((2, k), np.nan), np.full((2, k, 2), np.nan), np.nan
    status = EstimateStatus.OK
    if used < 2:
        status = EstimateStatus.TOO_FEW_RUNS
    elif is_constant(blocks[:, [0, -1]]):
        status = EstimateStatus.CONSTANT_RESPONSE
    else:
        terms = _terms(blocks)
        estimate = _ratios(terms.mean(axis=0)[None])
        point, variance = estimate[:, 0], float(np.var(blocks[:, [0, -1]]))
        means = resampled_means(terms, bootstrap, design.seed, "bootstrap of sobol")
        ci = np.array([interval(replicates) for replicates in _ratios(means)])
    return SobolIndices(design.names, point[0], point[1], ci[0], ci[1], variance, design.base, used, failed, status, bounding)


def _terms(blocks: FloatArray) -> FloatArray:
    """What each base point adds to the means that the estimators are made of, [n, 2 k + 2]."""
    centred = blocks - blocks.mean()
    a, c, b = centred[:, :1], centred[:, 1:-1], centred[:, -1:]
    return np.hstack([b * (c - a), 0.5 * (a - c) ** 2, 0.5 * (a + b), 0.5 * (a * a + b * b)])


def _ratios(means: FloatArray) -> FloatArray:
    """S1 and ST, [2, replicates, k], from means of the terms [replicates, 2 k + 2]."""
    k = (means.shape[1] - 2) // 2
    variance = (means[:, -1] - means[:, -2] ** 2)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.array([means[:, :k] / variance, means[:, k : 2 * k] / variance])
