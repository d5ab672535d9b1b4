"""First-order, second-order and total shares of the variance of a response, by pick-freeze."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.uncertainty.bootstrap import interval, resampled_means
from levelone.uncertainty.designs import Design
from levelone.uncertainty.distributions import FloatArray
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
from levelone.uncertainty.pick_freeze import pick_freeze_ratios, pick_freeze_terms
from levelone.uncertainty.scrambling_intervals import FEWEST, scrambling_intervals

IntervalKind = Literal["bootstrap", "scramblings"]


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Sobol indices of one response for each of k columns: the factors, or the groups of a grouped design.

    Attributes
    ----------
    names
        Names of the columns.
    S1, ST
        [k]: first-order and total indices; estimates, so that they may leave [0, 1] by their sampling error.
    S1_ci, ST_ci
        [k, 2]: 95 % intervals of the kind ``interval_kind``. On a surrogate they say nothing about the surrogate's own
        error.
    S2, S2_ci
        [k, k], [k, k, 2]: share of each pair beyond the first-order shares of its two, above the diagonal; NaN on and
        below it, and everywhere unless the design has second order.
    interval_kind
        "scramblings" where the design has at least four: Student intervals from the spread between them. Otherwise
        "bootstrap", over base points as if they were independent.
    variance
        Variance of the response.
    base, used
        Base points of the design, and those without a failed run.
    scramblings_used
        Scramblings with at least one base point without a failed run.
    failed
        Runs that failed.
    failure_p
        Whether failures gather in a part of the factor box: the smallest probability, times the number of tests, of the
        rank tests (Mann and Whitney) of each factor's coordinate and of its distance from the middle, over the rows A
        and B; NaN where none of these failed.
    status
        ``CONSTANT_RESPONSE`` or ``TOO_FEW_RUNS``: every index is then NaN. ``TOO_FEW_SCRAMBLINGS``: intervals are,
        since the complete base points of fewer than four scramblings differ among themselves.
    bounding
        Under the policy "bound" with failures: the indices with failed runs at the lowest and at the highest value
        seen.
    """

    names: tuple[str, ...]
    S1: FloatArray
    ST: FloatArray
    S1_ci: FloatArray
    ST_ci: FloatArray
    S2: FloatArray
    S2_ci: FloatArray
    interval_kind: IntervalKind
    variance: float
    base: int
    used: int
    scramblings_used: int
    failed: int
    failure_p: float
    status: EstimateStatus
    bounding: tuple[SobolIndices, SobolIndices] | None = None

    @property
    def doubt(self) -> str:
        """Why these indices cannot be trusted, in words; empty where nothing speaks against them.

        In this order: a status other than ok; failures under the policy "bound" that move an S1 or ST out of its own
        interval when set to the lowest or to the highest value seen; failures under the policy "drop" that gather in a
        part of the factor box, since leaving them out then leaves that part out. The limits are those of
        :mod:`levelone.uncertainty.failure_doubt`.
        Under "drop" without such evidence the user's word stands that failures have nothing to do with the response.
        """
        moved = None
        if self.bounding is not None:
            ci = np.concatenate([self.S1_ci, self.ST_ci])
            moved = leaves(ci, [np.concatenate([side.S1, side.ST]) for side in self.bounding])
        return doubt(self.status, self.failed, self.failure_p, moved)

    @property
    def trustworthy(self) -> bool:
        """Whether there is no :attr:`doubt`."""
        return not self.doubt


def widest(indices: SobolIndices) -> float:
    """Full width of the widest interval of an S1 or ST; NaN where any of them is undefined."""
    return float(np.max(np.diff(np.concatenate([indices.S1_ci, indices.ST_ci]), axis=1)))


def sobol(design: Design, values: ArrayLike, *, bootstrap: int = 500, policy: Policy = "refuse") -> SobolIndices:
    """Sobol indices from a pick-freeze design.

    The estimators and their sources are those of :func:`levelone.uncertainty.pick_freeze.pick_freeze_terms`, over all
    base points of all scramblings together; those of a design with second order have a smaller error.

    Parameters
    ----------
    design
        From :func:`levelone.uncertainty.designs.sobol_design`.
    values
        [runs], one response; NaN where a run failed.
    bootstrap
        Number of resamplings of the base points where the design has fewer than four scramblings; their seed derives
        from that of the design. The points are treated as independent, which on Sobol points makes the intervals wider
        than the error that is there.
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
    failures = int(np.isnan(y).sum()), _failure_p(design, np.isnan(y))
    bounding = None
    if policy == "bound" and failures[0]:
        low, high = (_indices(design, filled, bootstrap, failures) for filled in bounding_values(y))
        bounding = (low, high)
    return _indices(design, y, bootstrap, failures, bounding)


def _indices(
    design: Design,
    y: FloatArray,
    bootstrap: int,
    failures: tuple[int, float],
    bounding: tuple[SobolIndices, SobolIndices] | None = None,
) -> SobolIndices:
    """Indices from the complete blocks of ``y``; ``failures`` are the number of failed runs and whether they gather."""
    complete = complete_blocks(y, design.block)
    blocks = y.reshape(-1, design.block)[complete]
    scrambling = (np.arange(design.base) // (design.base // design.scramblings))[complete]
    estimate, ci, status = _estimate(design, blocks, scrambling, bootstrap)
    S2, S2_ci = _by_pair(design, estimate, ci)
    k = len(design.columns)
    return SobolIndices(
        design.columns, estimate[:k], estimate[k : 2 * k], ci[:k], ci[k : 2 * k], S2, S2_ci, _interval_kind(design),
        variance=float("nan") if np.isnan(estimate).all() else float(np.var(blocks[:, [0, -1]])),
        base=design.base, used=blocks.shape[0], scramblings_used=np.unique(scrambling).size,
        failed=failures[0], failure_p=failures[1], status=status, bounding=bounding,
    )  # fmt: skip


def _interval_kind(design: Design) -> IntervalKind:
    return "scramblings" if design.scramblings >= FEWEST else "bootstrap"


def _estimate(
    design: Design, blocks: FloatArray, scrambling: NDArray[np.int64], bootstrap: int
) -> tuple[FloatArray, FloatArray, EstimateStatus]:
    """S1, ST and, with second order, the pairs i < j: [q], their intervals [q, 2], and the status of all."""
    k = len(design.columns)
    q = 2 * k + (k * (k - 1) // 2 if design.second_order else 0)
    undefined = np.full(q, np.nan), np.full((q, 2), np.nan)
    if blocks.shape[0] < 2:
        return *undefined, EstimateStatus.TOO_FEW_RUNS
    if is_constant(blocks[:, [0, -1]]):
        return *undefined, EstimateStatus.CONSTANT_RESPONSE
    terms = pick_freeze_terms(blocks, design.second_order)
    ratios = partial(pick_freeze_ratios, k=k, second_order=design.second_order)
    estimate = ratios(terms.mean(axis=0)[None])[0]
    if _interval_kind(design) == "bootstrap":
        means = resampled_means(terms, bootstrap, design.seed, "bootstrap of sobol")
        return estimate, interval(ratios(means)), EstimateStatus.OK
    varying = [label for label in np.unique(scrambling) if not is_constant(blocks[scrambling == label][:, [0, -1]])]
    if len(varying) < FEWEST:
        return estimate, undefined[1], EstimateStatus.TOO_FEW_SCRAMBLINGS
    return estimate, scrambling_intervals(terms, scrambling, ratios), EstimateStatus.OK


def _by_pair(design: Design, estimate: FloatArray, ci: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Estimates of the pairs and their intervals above the diagonal, [k, k] and [k, k, 2]; NaN elsewhere."""
    k = len(design.columns)
    S2, S2_ci = np.full((k, k), np.nan), np.full((k, k, 2), np.nan)
    if design.second_order:
        above = np.triu_indices(k, 1)
        S2[above], S2_ci[above] = estimate[2 * k :], ci[2 * k :]
    return S2, S2_ci


def _failure_p(design: Design, failed: NDArray[np.bool_]) -> float:
    """Whether failures gather in a part of the box; of a block only rows A and B belong to a sample of independent points."""
    ends = np.array([0, design.block - 1])
    unit = design.unit_points.reshape(design.base, design.block, -1)[:, ends].reshape(2 * design.base, -1)
    return gathered_p(unit, failed.reshape(design.base, design.block)[:, ends].ravel())
