"""Elementary effects: which factors matter, and which of them act nonlinearly or together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

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
)
from levelone.uncertainty.groups import group_columns


@dataclass(frozen=True, eq=False)
class MorrisIndices:
    """Statistics of the elementary effects of one response, in its unit, for each of k factors or groups of factors.

    Attributes
    ----------
    names
        Names of the factors, or of the groups of a grouped design.
    mu, mu_star, sigma, distance
        [k]: mean of the effects, mean of their magnitudes, standard deviation (divisor r - 1), sqrt(mu_star^2 +
        sigma^2). For a group of several factors, whose steps go different ways, only mu_star is defined; the others are
        NaN.
    mu_ci, mu_star_ci, sigma_ci, distance_ci
        [k, 2]: 95 % bootstrap intervals over trajectories.
    effects
        [r, k]: elementary effects of the r trajectories used; magnitudes for a group of several factors.
    trajectories
        Trajectories of the design.
    failed
        Runs that failed.
    failure_p
        Whether failures gather in a part of the factor box, over the two ends of a trajectory or the base point of a radial
        block: :func:`levelone.uncertainty.failure_doubt.gathered_p`.
    status
        ``TOO_FEW_RUNS`` where fewer than two trajectories are complete: every figure is then NaN.
    bounding
        Under the policy "bound" with failures: the indices with failed runs at the lowest and at the highest value
        seen.
    """

    names: tuple[str, ...]
    mu: FloatArray
    mu_star: FloatArray
    sigma: FloatArray
    distance: FloatArray
    mu_ci: FloatArray
    mu_star_ci: FloatArray
    sigma_ci: FloatArray
    distance_ci: FloatArray
    effects: FloatArray
    trajectories: int
    failed: int
    failure_p: float
    status: EstimateStatus
    bounding: tuple[MorrisIndices, MorrisIndices] | None = None

    @property
    def doubt(self) -> str:
        """Why these figures cannot be trusted, in words; empty where nothing speaks against them.

        See :func:`levelone.uncertainty.failure_doubt.doubt`. What must not move is mu_star.
        """
        moved = (
            None
            if self.bounding is None
            else leaves(self.mu_star_ci, [side.mu_star for side in self.bounding], float(self.mu_star.max()))
        )
        return doubt(self.status, self.failed, self.failure_p, moved)


def morris(design: Design, values: ArrayLike, *, bootstrap: int = 1000, policy: Policy = "refuse") -> MorrisIndices:
    """Morris indices of one response.

    Sources: Morris, Technometrics 33, 1991, 161-174; for mu_star Campolongo et al., Environmental Modelling and
    Software 22, 2007, 1509-1518.

    An elementary effect is the change of the response over one step of one factor, divided by the step in the unit
    cube: its unit is that of the response, and for a linear response it is the change over the factor's whole range. The
    effect of a group is the magnitude of the change when all its factors move by a step.

    Parameters
    ----------
    design
        From :func:`levelone.uncertainty.designs.morris_design` or :mod:`levelone.uncertainty.morris_designs`.
    values
        [runs], one response; NaN where a run failed.
    bootstrap
        Number of resamplings of the trajectories; their seed derives from that of the design.
    policy
        What to do about failed runs: see :mod:`levelone.uncertainty.failures`.

    Raises
    ------
    InputError
        Another kind of design, another length, an unknown policy, failed runs under "refuse".
    """
    design.require("morris")
    y = as_values(values, design.runs)
    check_policy(policy, y)
    failed = np.isnan(y)
    rows = [0, design.block - 1] if design.levels else [0]
    independent = np.isin(np.arange(design.runs) % design.block, rows)
    failures = int(failed.sum()), gathered_p(design.points[independent], failed[independent])
    bounding = None
    if policy == "bound" and failures[0]:
        low, high = (_indices(design, filled, bootstrap, failures) for filled in bounding_values(y))
        bounding = (low, high)
    return _indices(design, y, bootstrap, failures, bounding)


def elementary_effects(design: Design, values: FloatArray) -> FloatArray:
    """Elementary effects [trajectories, columns]; NaN where one end of the step failed, magnitudes for groups of several factors.

    A column is a factor, or a group of factors that move together.
    """
    columns = group_columns(design.space, design.groups)
    unit = design.unit_points.reshape(design.base, design.block, -1)
    y = values.reshape(design.base, design.block)
    if design.levels == 0:
        j = np.arange(len(columns))
        effects: FloatArray = (y[:, 1:] - y[:, :1]) / (unit[:, 1 + j, j] - unit[:, 0, j])
        return effects
    # The first factor of each group tells which group moved, and which way a factor that is alone moved.
    step = np.diff(unit, axis=1)[:, :, [column[0] for column in columns]]
    moved = np.abs(step).argmax(axis=2)
    sign = np.sign(np.take_along_axis(step, moved[:, :, None], axis=2)[:, :, 0])
    delta = design.levels / (2.0 * (design.levels - 1))
    change = np.diff(y, axis=1) * sign / delta
    effects = np.empty((design.base, len(columns)))
    np.put_along_axis(effects, moved, change, axis=1)
    several = _several(design)
    effects[:, several] = np.abs(effects[:, several])
    return effects


def _several(design: Design) -> list[int]:
    """Columns that are groups of more than one factor: their effects have no sign."""
    return [j for j, column in enumerate(group_columns(design.space, design.groups)) if len(column) > 1]


def _indices(
    design: Design,
    y: FloatArray,
    bootstrap: int,
    failures: tuple[int, float],
    bounding: tuple[MorrisIndices, MorrisIndices] | None = None,
) -> MorrisIndices:
    effects = elementary_effects(design, y)[complete_blocks(y, design.block)]
    r, k = effects.shape
    if r < 2:
        point, ci = np.full((4, k), np.nan), np.full((4, k, 2), np.nan)
        status = EstimateStatus.TOO_FEW_RUNS
    else:
        # Deviations from the plain mean keep the second moment free of cancellation.
        centre = effects.mean(axis=0)
        terms = np.hstack([effects - centre, np.abs(effects), (effects - centre) ** 2])
        point = _statistics(centre, terms.mean(axis=0)[None], r)[:, 0]
        means = resampled_means(terms, bootstrap, design.seed, "bootstrap of morris")
        ci = np.array([interval(replicates) for replicates in _statistics(centre, means, r)])
        several = _several(design)
        point[np.ix_([0, 2, 3], several)], ci[np.ix_([0, 2, 3], several)] = np.nan, np.nan
        status = EstimateStatus.OK
    return MorrisIndices(
        design.columns,
        *(point[0], point[1], point[2], point[3]),
        *(ci[0], ci[1], ci[2], ci[3]),
        effects,
        design.base,
        *failures,
        status,
        bounding,
    )


def _statistics(centre: FloatArray, means: FloatArray, r: int) -> FloatArray:
    """mu, mu_star, sigma, distance [4, replicates, k] from means of the terms [replicates, 3 k], r trajectories."""
    shift, mu_star, square = np.split(means, 3, axis=1)
    sigma = np.sqrt(np.maximum(square - shift**2, 0.0) * r / (r - 1))
    return np.array([centre + shift, mu_star, sigma, np.hypot(mu_star, sigma)])
