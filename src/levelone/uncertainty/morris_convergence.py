"""Whether more trajectories would still change the ranking of a Morris study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.errors import InputError
from levelone.uncertainty.bootstrap import interval, resampled_means
from levelone.uncertainty.designs import Design
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import EstimateStatus, Policy, as_values, check_policy, complete_blocks
from levelone.uncertainty.morris import elementary_effects

TIE = 0.05
"""Difference of two mu_star, as a fraction of the largest, within which their order is of no consequence (assumed: a twentieth
of the largest effect is below what a screening is read for)."""

FEWEST_TRAJECTORIES = 10
"""Trajectories below which no ranking is called settled: the bootstrap of so few is too narrow."""


@dataclass(frozen=True, eq=False)
class MorrisConvergence:
    """mu_star of one response as trajectories are added.

    Attributes
    ----------
    names
        Names of the k factors or groups.
    trajectories, used
        [c]: trajectories of the leading part of the design, and those of them without a failed run.
    mu_star, mu_star_ci
        [c, k] and [c, k, 2]: as in :class:`levelone.uncertainty.morris.MorrisIndices`, NaN where fewer than two are complete.
    open_pairs
        [c]: neighbours in the ranking whose order is not settled; k - 1 at most.
    stable_from
        Trajectories from which on the ranking is settled at every later checkpoint; NaN where it is not at the last.
    failed
        Runs that failed.
    status
        ``TOO_FEW_RUNS`` where fewer than ten trajectories are complete.
    """

    names: tuple[str, ...]
    trajectories: NDArray[np.int64]
    used: NDArray[np.int64]
    mu_star: FloatArray
    mu_star_ci: FloatArray
    open_pairs: NDArray[np.int64]
    stable_from: float
    failed: int
    status: EstimateStatus


def morris_convergence(
    design: Design,
    values: ArrayLike,
    *,
    checkpoints: Sequence[int] | None = None,
    bootstrap: int = 1000,
    policy: Policy = "refuse",
) -> MorrisConvergence:
    """mu_star against the number of trajectories, and from where on its ranking no longer changes.

    Two neighbours in the ranking by mu_star are settled when the 95 % bootstrap interval of their difference, over the same
    trajectories for both, lies above zero (they differ) or within :data:`TIE` of the largest mu_star (their order does not
    matter). The ranking is settled when all neighbours are, with at least :data:`FEWEST_TRAJECTORIES` complete trajectories. The
    idea of judging the ranking by resampling the trajectories: Sarrazin, Pianosi and Wagener, Environmental Modelling and Software
    79, 2016, 135-152; the rule is ours.

    Parameters
    ----------
    design
        Any Morris design.
    values
        [runs], one response; NaN where a run failed.
    checkpoints
        Numbers of trajectories, increasing, each at most that of the design; ten even steps from 10 on by default.
    bootstrap
        Number of resamplings at each checkpoint.
    policy
        "refuse" failed runs, or leave out their trajectories ("drop" or "bound", which are the same here).

    Raises
    ------
    InputError
        Another kind of design, checkpoints that do not increase or exceed the design, failed runs under "refuse".
    """
    design.require("morris")
    y = as_values(values, design.runs)
    check_policy(policy, y)
    steps = _checkpoints(design, checkpoints)
    complete = complete_blocks(y, design.block)
    magnitude, k = np.abs(elementary_effects(design, y)), design.block - 1
    used = np.cumsum(complete, dtype=np.int64)[steps - 1]
    mu_star, ci = np.full((steps.size, k), np.nan), np.full((steps.size, k, 2), np.nan)
    open_pairs = np.full(steps.size, k - 1)
    for c, r in enumerate(steps):
        terms = magnitude[:r][complete[:r]]
        if used[c] >= 2:
            mu_star[c] = terms.mean(axis=0)
            means = resampled_means(terms, bootstrap, design.seed, f"bootstrap of morris convergence at {r}")
            ci[c] = interval(means)
            if used[c] >= FEWEST_TRAJECTORIES:
                open_pairs[c] = _open_pairs(mu_star[c], means)
    settled = np.logical_and.accumulate((open_pairs == 0)[::-1])[::-1] & (used >= FEWEST_TRAJECTORIES)
    stable_from = float(steps[settled.argmax()]) if settled.any() else np.nan
    status = EstimateStatus.OK if used[-1] >= FEWEST_TRAJECTORIES else EstimateStatus.TOO_FEW_RUNS
    failed = int(np.isnan(y).sum())
    return MorrisConvergence(design.columns, steps, used, mu_star, ci, open_pairs, stable_from, failed, status)


def _open_pairs(mu_star: FloatArray, means: FloatArray) -> int:
    """Neighbours in the ranking whose order the replicates [bootstrap, k] leave open."""
    order = np.argsort(-mu_star, kind="stable")
    low, high = interval(means[:, order[:-1]] - means[:, order[1:]]).T
    tie = TIE * mu_star.max()
    return int(np.logical_not((low > 0.0) | ((low >= -tie) & (high <= tie))).sum())


def _checkpoints(design: Design, checkpoints: Sequence[int] | None) -> NDArray[np.int64]:
    if checkpoints is None:
        return np.unique(np.linspace(min(FEWEST_TRAJECTORIES, design.base), design.base, 10).round().astype(np.int64))
    steps = np.asarray(checkpoints)
    if steps.ndim != 1 or not steps.size or not np.issubdtype(steps.dtype, np.integer):
        raise InputError("checkpoints", f"{checkpoints!r}; whole numbers of trajectories are needed")
    if steps[0] < 1 or (np.diff(steps) <= 0).any() or steps[-1] > design.base:
        raise InputError("checkpoints", f"{checkpoints!r}; they must increase from 1 or more to at most {design.base}")
    return steps.astype(np.int64)
