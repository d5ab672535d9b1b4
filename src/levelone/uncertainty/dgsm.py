"""Derivative-based measures: how steep a response is in each factor, and the most that its total index can be.

With nu_j = E[(df/dx_j)^2], S_T,j <= C_j nu_j / V, where C_j is the Poincare constant of the factor's distribution (Sobol and
Kucherenko, Mathematics and Computers in Simulation 79, 2009, 3009-3017; Lamboni, Iooss, Popelin and Gamboa, Mathematics and
Computers in Simulation 87, 2013, 45-54). A small bound shows that a factor does not matter with few runs; a large one shows
nothing. Constants:

- uniform of width w: (w / pi)^2, exact;
- triangular and truncated normal: (w / pi)^2, which holds for every log-concave density on an interval of width w (Payne and
  Weinberger, Archive for Rational Mechanics and Analysis 5, 1960, 286-292; Bobkov, Annals of Probability 27, 1999, 1903-1921);
  for the truncated normal no more than the variance before truncation (Bakry and Emery, Lecture Notes in Mathematics 1123, 1985,
  177-206);
- normal: the variance, exact;
- lognormal: the variance of the logarithm, and derivatives with respect to the logarithm.

Derivatives with respect to the coordinate in the unit cube would not do for all: divided by the density, they have an infinite mean
square where the density falls to zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr
from scipy.stats import qmc

from levelone.errors import InputError
from levelone.uncertainty.bootstrap import interval, resampled_means
from levelone.uncertainty.copula import normal_scores
from levelone.uncertainty.counts import check_power_of_two
from levelone.uncertainty.designs import Design
from levelone.uncertainty.distributions import Distribution, FloatArray, LogNormal, Normal, Triangular, TruncatedNormal, Uniform
from levelone.uncertainty.factors import Factor, FactorSpace
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
from levelone.uncertainty.seeds import check_seed


@dataclass(frozen=True, eq=False)
class DerivativeMeasures:
    """Derivative-based measures of one response for each of k factors.

    Attributes
    ----------
    names
        Names of the factors.
    nu
        [k]: mean squared derivative, in the square of the unit of the response over that of the factor (over 1 for a lognormal
        factor, whose logarithm is meant).
    mean_magnitude
        [k]: mean magnitude of the derivative, in the unit of the response over that of the factor.
    ST_bound
        [k]: C nu / V, an upper bound of the total index; may exceed 1.
    nu_ci, mean_magnitude_ci, ST_bound_ci
        [k, 2]: 95 % bootstrap intervals over base points.
    variance
        Variance of the response at the base points.
    base, used
        Base points of the design, and those without a failed run.
    failed
        Runs that failed.
    failure_p
        Whether failures gather in a part of the factor box, over the base points:
        :func:`levelone.uncertainty.failure_doubt.gathered_p`.
    status
        ``CONSTANT_RESPONSE`` or ``TOO_FEW_RUNS``: every figure is then NaN.
    bounding
        Under the policy "bound" with failures: the same with failed runs at the lowest and at the highest value seen.
    """

    names: tuple[str, ...]
    nu: FloatArray
    mean_magnitude: FloatArray
    ST_bound: FloatArray
    nu_ci: FloatArray
    mean_magnitude_ci: FloatArray
    ST_bound_ci: FloatArray
    variance: float
    base: int
    used: int
    failed: int
    failure_p: float
    status: EstimateStatus
    bounding: tuple[DerivativeMeasures, DerivativeMeasures] | None = None

    @property
    def doubt(self) -> str:
        """Why these figures cannot be trusted, in words; empty where nothing speaks against them.

        See :func:`levelone.uncertainty.failure_doubt.doubt`. The bound of the total index is what must not move.
        """
        moved = None if self.bounding is None else leaves(self.ST_bound_ci, [side.ST_bound for side in self.bounding])
        return doubt(self.status, self.failed, self.failure_p, moved)


def derivative_design(space: FactorSpace, n: int, seed: int, *, step: float = 0.01) -> Design:
    """Base points, each with two neighbours for each factor.

    A block of 2k + 1 runs holds a scrambled Sobol point, the point with factor 1 (2, ... k) one step lower, and the same one step
    higher. A bounded factor moves by ``step`` in the unit cube, and at an end of its range as far as it can; an unbounded one by
    sqrt(2 pi) ``step`` standard normal scores, which is the same in the middle.

    Parameters
    ----------
    space
        Independent factors with a continuous distribution.
    n
        Number of base points, a power of two.
    seed
        Seed of the scrambling.
    step
        Half the distance between the neighbours, in the unit cube, at most 0.1. The difference quotient is wrong by step^2 / 6
        times the third derivative there: 0.07 % at 0.01 for a sine over the whole range. A response with a resolution of its own
        needs larger steps.

    Returns
    -------
    Design of kind "derivatives" with n (2k + 1) runs.

    Raises
    ------
    InputError
        Correlated factors, a factor without a derivative or without a known constant, a wrong count or step.
    """
    space.require_independent("a derivative-based measure", "Shapley effects and given-data indices are offered in its place")
    for factor in space.factors:
        _poincare(factor)
    n = check_power_of_two("n", n)
    if not 0.0 < step <= 0.1:
        raise InputError("step", f"{step!r}; a number above 0 and at most 0.1 is needed")
    k = len(space)
    centre = qmc.Sobol(k, rng=np.random.default_rng(check_seed(seed))).random_base2(n.bit_length() - 1)
    unit = np.repeat(centre[:, None, :], 2 * k + 1, axis=1)
    for j, factor in enumerate(space.factors):
        for row, way in ((1 + j, -step), (1 + k + j, step)):
            if factor.bounded:
                unit[:, row, j] = np.clip(centre[:, j] + way, 0.0, 1.0)
            else:
                unit[:, row, j] = ndtr(normal_scores(centre[:, j]) + np.sqrt(2.0 * np.pi) * way)
    return Design("derivatives", space, unit.reshape(-1, k), space.transform(unit.reshape(-1, k)), int(seed), n, 2 * k + 1)


def derivative_measures(
    design: Design, values: ArrayLike, *, bootstrap: int = 500, policy: Policy = "refuse"
) -> DerivativeMeasures:
    """Derivative-based measures of one response.

    Parameters
    ----------
    design
        From :func:`derivative_design`.
    values
        [runs], one response; NaN where a run failed.
    bootstrap
        Number of resamplings of the base points; their seed derives from that of the design.
    policy
        What to do about failed runs: see :mod:`levelone.uncertainty.failures`. A base point with a failed neighbour is left out.

    Raises
    ------
    InputError
        Another kind of design, another length, an unknown policy, failed runs under "refuse".
    """
    design.require("derivatives")
    y = as_values(values, design.runs)
    check_policy(policy, y)
    failed = np.isnan(y)
    failures = int(failed.sum()), gathered_p(design.points[:: design.block], failed[:: design.block])
    bounding = None
    if policy == "bound" and failures[0]:
        low, high = (_measures(design, filled, bootstrap, failures) for filled in bounding_values(y))
        bounding = (low, high)
    return _measures(design, y, bootstrap, failures, bounding)


def _measures(
    design: Design,
    y: FloatArray,
    bootstrap: int,
    failures: tuple[int, float],
    bounding: tuple[DerivativeMeasures, DerivativeMeasures] | None = None,
) -> DerivativeMeasures:
    k = len(design.space)
    kept = complete_blocks(y, design.block)
    blocks, used = y.reshape(-1, design.block)[kept], int(kept.sum())
    point, ci, variance = np.full((3, k), np.nan), np.full((3, k, 2), np.nan), np.nan
    status = EstimateStatus.OK
    if used < 2:
        status = EstimateStatus.TOO_FEW_RUNS
    elif is_constant(blocks[:, 0]):
        status = EstimateStatus.CONSTANT_RESPONSE
    else:
        constants = np.array([_poincare(factor)[1] for factor in design.space.factors])
        slopes = derivatives(design, y)[kept]
        centred = blocks[:, :1] - blocks[:, 0].mean()
        terms = np.hstack([slopes**2, np.abs(slopes), centred, centred**2])
        point, variance = _statistics(terms.mean(axis=0)[None], constants)[:, 0], float(blocks[:, 0].var())
        means = resampled_means(terms, bootstrap, design.seed, "bootstrap of derivative measures")
        ci = np.array([interval(replicates) for replicates in _statistics(means, constants)])
    return DerivativeMeasures(
        design.names,
        *(point[0], point[1], point[2]),
        *(ci[0], ci[1], ci[2]),
        variance,
        design.base,
        used,
        *failures,
        status,
        bounding,
    )


def derivatives(design: Design, values: FloatArray) -> FloatArray:
    """Central differences [n, k] over the physical step, or over that of the logarithm; NaN where a neighbour failed."""
    k = len(design.space)
    points, y = design.points.reshape(design.base, design.block, k), values.reshape(design.base, design.block)
    change = y[:, 1 + k :] - y[:, 1 : 1 + k]
    columns = np.arange(k)
    low, high = points[:, 1 + columns, columns], points[:, 1 + k + columns, columns]
    logarithmic = [_poincare(factor)[0] for factor in design.space.factors]
    low[:, logarithmic], high[:, logarithmic] = np.log(low[:, logarithmic]), np.log(high[:, logarithmic])
    slopes: FloatArray = change / (high - low)
    return slopes


def _poincare(factor: Factor) -> tuple[bool, float]:
    """Whether derivatives are with respect to the logarithm of the factor, and its Poincare constant."""
    distribution: Distribution = factor.distribution
    if isinstance(distribution, Normal):
        return False, distribution.std**2
    if isinstance(distribution, LogNormal):
        return True, distribution.sigma**2
    if isinstance(distribution, Uniform | Triangular | TruncatedNormal):
        low, high = distribution.support
        constant = ((high - low) / np.pi) ** 2
        return False, min(constant, distribution.std**2) if isinstance(distribution, TruncatedNormal) else constant
    raise InputError(
        f"factor {factor.name}",
        f"{type(distribution).__name__} has no derivative or no known Poincare constant; "
        "allowed: Uniform, Triangular, TruncatedNormal, Normal, LogNormal",
    )


def _statistics(means: FloatArray, constants: FloatArray) -> FloatArray:
    """nu, mean magnitude and bound, [3, replicates, k], from means of the terms [replicates, 2 k + 2]."""
    k = constants.size
    variance = (means[:, -1] - means[:, -2] ** 2)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.array([means[:, :k], means[:, k : 2 * k], constants * means[:, :k] / variance])
