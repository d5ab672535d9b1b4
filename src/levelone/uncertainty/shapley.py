"""Shapley effects: shares of the variance that add up to one, whether or not the factors are correlated.

The effect of factor j is the mean, over all orders in which the factors could be taken, of what j adds to the variance that
the factors taken so far explain (Owen, SIAM/ASA Journal on Uncertainty Quantification 2, 2014, 245-251). Interactions are
split evenly between those who take part, and so is what correlated factors have in common; a factor on which the model does
not depend has a share through its correlations. Three pure steps: :func:`shapley_design`, values of a model or of a surrogate
at its points, :func:`shapley`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr
from scipy.stats import qmc

from levelone.uncertainty.copula import independent_scores, normal_scores, resampled_prefixes
from levelone.uncertainty.counts import check_count, check_power_of_two
from levelone.uncertainty.designs import Design
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.factors import FactorSpace
from levelone.uncertainty.failure_doubt import doubt, gathered_p, leaves
from levelone.uncertainty.failures import (
    EstimateStatus,
    Policy,
    as_values,
    bounding_values,
    check_policy,
    complete_blocks,
    is_constant,
)
from levelone.uncertainty.scrambling_intervals import FEWEST, scrambling_intervals
from levelone.uncertainty.seeds import check_seed, stage_seed


@dataclass(frozen=True, eq=False)
class ShapleyEffects:
    """Shapley effects of one response for each of k factors.

    Attributes
    ----------
    names
        Names of the factors.
    Sh
        [k]: shares of the variance, which add up to 1; estimates, so that one may be negative by its sampling error.
    Sh_ci
        [k, 2]: 95 % Student intervals from the spread between independent scramblings.
    variance
        Variance of the response, as half the mean squared difference between the two ends of the blocks.
    base, used
        Blocks of the design, and those without a failed run.
    failed
        Runs that failed.
    failure_p
        Whether failures gather in a part of the factor box, over both ends of the blocks:
        :func:`levelone.uncertainty.failure_doubt.gathered_p`.
    status
        ``CONSTANT_RESPONSE`` or ``TOO_FEW_RUNS``: every share is NaN; ``TOO_FEW_SCRAMBLINGS``: the shares stand, the intervals
        are NaN.
    bounding
        Under the policy "bound" with failures: the effects with failed runs at the lowest and at the highest value seen.
    """

    names: tuple[str, ...]
    Sh: FloatArray
    Sh_ci: FloatArray
    variance: float
    base: int
    used: int
    failed: int
    failure_p: float
    status: EstimateStatus
    bounding: tuple[ShapleyEffects, ShapleyEffects] | None = None

    @property
    def doubt(self) -> str:
        """Why these figures cannot be trusted, in words; empty where nothing speaks against them.

        See :func:`levelone.uncertainty.failure_doubt.doubt`.
        """
        moved = None if self.bounding is None else leaves(self.Sh_ci, [side.Sh for side in self.bounding])
        return doubt(self.status, self.failed, self.failure_p, moved)


def shapley_design(space: FactorSpace, n: int, seed: int, *, scramblings: int = 8) -> Design:
    """Paths from one random point to another, along which the factors are drawn anew in random order.

    Sources: Goda, Reliability Engineering and System Safety 213, 2021, 107702 (independent factors); random
    orders with draws conditional on the factors that are kept: Song, Nelson and Staum, SIAM/ASA Journal on Uncertainty
    Quantification 4, 2016, 1060-1083.

    Row l of a block of k + 1 runs keeps all but the first l factors of its order, and draws those anew from their distribution
    given the ones that are kept. Both ends and the order come from one scrambled Sobol point in 3k dimensions: the order sorts
    its last k coordinates. Scramblings follow one another as in :func:`levelone.uncertainty.designs.sobol_design`.

    Parameters
    ----------
    space
        Factors, independent or correlated.
    n
        Number of blocks in each scrambling, a power of two.
    seed
        Seed.
    scramblings
        Number of independent scramblings; intervals need at least 4.

    Returns
    -------
    Design of kind "shapley" with n scramblings (k + 1) runs.

    Raises
    ------
    InputError
        A count that is too small or not a power of two.
    """
    n, scramblings = check_power_of_two("n", n), check_count("scramblings", scramblings, 1)
    first, second, order = _draws(len(space), n, check_seed(seed), scramblings)
    if space.correlated:
        scores = space.score_correlation()
        paths = resampled_prefixes(normal_scores(first), normal_scores(second), order, scores)
        unit = ndtr(independent_scores(paths.reshape(-1, len(space)), scores))
    else:
        anew = np.argsort(order, axis=1)[:, None, :] < np.arange(len(space) + 1)[None, :, None]
        unit = np.where(anew, second[:, None, :], first[:, None, :]).reshape(-1, len(space))
    base = n * scramblings
    return Design(
        "shapley", space, unit, space.transform(unit), int(seed), base, unit.shape[0] // base, scramblings=scramblings
    )  # fmt: skip


def _draws(k: int, n: int, seed: int, scramblings: int) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Both ends of each path, in the unit cube, and the order of the factors, [n scramblings, k] each."""
    seeds = [seed, *(stage_seed(seed, f"scrambling {r}") for r in range(1, scramblings))]
    power = n.bit_length() - 1
    points = np.concatenate([qmc.Sobol(3 * k, rng=np.random.default_rng(one)).random_base2(power) for one in seeds])
    return points[:, :k], points[:, k : 2 * k], np.argsort(points[:, 2 * k :], axis=1, kind="stable")


def shapley(design: Design, values: ArrayLike, *, policy: Policy = "refuse") -> ShapleyEffects:
    """Shapley effects of one response.

    With f_l the response at row l of a block, half the mean of (f_0 - f_l)^2 is the mean variance that is left when all but the
    first l factors of the order are known. What the factor at place l adds is therefore the mean of (f_0 - (f_l-1 + f_l) / 2)
    (f_l-1 - f_l) (Goda 2021), which correlated factors use. With independent factors the same holds seen from the
    other end of the path; the mean of the two views, (f_l-1 - f_l) (f_0 - f_k) / 2, has the smaller error.

    In both forms the terms of a block add up to (f_0 - f_k)^2 / 2, whose mean is the variance that they are divided by: the
    effects add up to one by construction, whatever the number of blocks.

    Parameters
    ----------
    design
        From :func:`shapley_design`.
    values
        [runs], one response, of the model at ``design.points``, or of a surrogate at these or at ``design.unit_points``,
        whichever it was fitted on; NaN where a run failed. On a surrogate the intervals say nothing about its own error.
    policy
        What to do about failed runs: see :mod:`levelone.uncertainty.failures`. A block with a failed run is left out whole.

    Raises
    ------
    InputError
        Another kind of design, another length, an unknown policy, failed runs under "refuse".
    """
    design.require("shapley")
    y = as_values(values, design.runs)
    check_policy(policy, y)
    failed = np.isnan(y)
    ends = np.flatnonzero(np.isin(np.arange(design.runs) % design.block, (0, design.block - 1)))
    failures = int(failed.sum()), gathered_p(design.points[ends], failed[ends])
    bounding = None
    if policy == "bound" and failures[0]:
        low, high = (_effects(design, filled, failures) for filled in bounding_values(y))
        bounding = (low, high)
    return _effects(design, y, failures, bounding)


def _effects(
    design: Design, y: FloatArray, failures: tuple[int, float], bounding: tuple[ShapleyEffects, ShapleyEffects] | None = None
) -> ShapleyEffects:
    k = len(design.space)
    kept = complete_blocks(y, design.block)
    blocks, used = y.reshape(-1, design.block)[kept], int(kept.sum())
    share, ci, variance = np.full(k, np.nan), np.full((k, 2), np.nan), np.nan
    status = EstimateStatus.OK
    if used < 2:
        status = EstimateStatus.TOO_FEW_RUNS
    elif is_constant(blocks):
        status = EstimateStatus.CONSTANT_RESPONSE
    else:
        scrambling = np.repeat(np.arange(design.scramblings), design.base // design.scramblings)[kept]
        terms = _terms(design, blocks, kept)
        share, variance = _shares(terms.mean(axis=0)[None])[0], float(terms.sum(axis=1).mean())
        if np.unique(scrambling).size < FEWEST:
            status = EstimateStatus.TOO_FEW_SCRAMBLINGS
        else:
            ci = scrambling_intervals(terms, scrambling, _shares)
    return ShapleyEffects(design.names, share, ci, variance, design.base, used, *failures, status, bounding)


def _terms(design: Design, blocks: FloatArray, kept: NDArray[np.bool_]) -> FloatArray:
    """What each block adds to the effects, [blocks, k], in the order of the factors."""
    start, end = blocks[:, :1], blocks[:, -1:]
    before, after = blocks[:, :-1], blocks[:, 1:]
    if design.space.correlated:
        added = (before - after) * (start - 0.5 * (before + after))
    else:
        added = (before - after) * 0.5 * (start - end)
    order = _draws(len(design.space), design.base // design.scramblings, design.seed, design.scramblings)[2][kept]
    terms = np.empty_like(added)
    np.put_along_axis(terms, order, added, axis=1)
    return terms


def _shares(means: FloatArray) -> FloatArray:
    """Effects [replicates, k] from means of the terms, of the same shape."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return means / means.sum(axis=1, keepdims=True)
