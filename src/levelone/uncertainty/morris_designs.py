"""Morris designs that move groups of factors, that step from one base point, or that grow.

Plain trajectories are built by :func:`levelone.uncertainty.designs.morris_design`; every design here is analysed by
:func:`levelone.uncertainty.morris.morris`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import qmc

from levelone.errors import InputError
from levelone.uncertainty.counts import check_count
from levelone.uncertainty.designs import Design, morris_design
from levelone.uncertainty.distributions import Discrete, FloatArray
from levelone.uncertainty.factors import FactorSpace
from levelone.uncertainty.groups import Groups, group_columns, resolve_groups
from levelone.uncertainty.seeds import check_seed, stage_seed

_INSTEAD = "Shapley effects and given-data indices keep their meaning"


def grouped_morris_design(
    space: FactorSpace, trajectories: int, levels: int, seed: int, groups: Mapping[str, Sequence[str]]
) -> Design:
    """Trajectories that move all factors of a group in one step, each up or down on its own.

    Source: Campolongo, Cariboni and Saltelli, Environmental Modelling and Software 22, 2007, 1509-1518. For m groups
    a trajectory has m + 1 runs in place of k + 1. Since the factors of a group move in different directions, only mu_star of the
    group means anything.

    Parameters
    ----------
    space, trajectories, levels, seed
        As for :func:`levelone.uncertainty.designs.morris_design`.
    groups
        Factors by name of the group; a factor in none stays alone, after the groups, under its own name.

    Raises
    ------
    InputError
        As for plain trajectories, and groups with an unknown factor or a factor in two of them.
    """
    resolved = resolve_groups(space, groups)
    # Each factor moves once between the first and the last point of a plain trajectory, by one step: here it does so together
    # with its group.
    plain = morris_design(space, trajectories, levels, seed)
    ends = plain.unit_points.reshape(plain.base, plain.block, -1)[:, [0, -1]]
    m = len(resolved)
    rng = np.random.default_rng(stage_seed(plain.seed, "order of groups"))
    rank = np.argsort(rng.permuted(np.tile(np.arange(m), (plain.base, 1)), axis=1), axis=1)
    of_factor = np.empty(len(space), dtype=np.int64)
    for group, columns in enumerate(group_columns(space, resolved)):
        of_factor[list(columns)] = group
    moved = rank[:, None, of_factor] < np.arange(m + 1)[None, :, None]
    unit = np.where(moved, ends[:, 1:], ends[:, :1]).reshape(-1, len(space))
    return _morris(space, unit, plain.seed, plain.base, plain.levels, resolved)


def radial_design(space: FactorSpace, trajectories: int, seed: int) -> Design:
    """Base points of a scrambled Sobol sequence, each with one step of every factor.

    Source: Campolongo, Saltelli and Cariboni, Computer Physics Communications 182, 2011, 978-988. Run 0 of a block is the base
    point a, run 1 + j differs from it in factor j, by the step to (a_j + 1/4 + b_j / 2) modulo 1, with b the second half of the
    Sobol point. There the step is to b_j itself and may be as small as it likes, so that an effect measures a derivative, or
    the resolution of the response; here it lies between a quarter and three quarters of the range, up or down, and the values
    of a factor are as evenly spread.

    Unbounded factors are allowed, since no point lies at an end of the cube. A larger design of the same seed begins with the
    runs of the smaller one.

    Parameters
    ----------
    space
        Independent continuous factors.
    trajectories
        Number of base points, at least 1 (2 for a standard deviation).
    seed
        Seed of the scrambling.

    Returns
    -------
    Design of kind "morris" with ``levels`` 0 and trajectories (k + 1) runs.

    Raises
    ------
    InputError
        Correlated factors, a discrete factor, a count too small.
    """
    space.require_independent("a radial design", _INSTEAD)
    for factor in space.factors:
        if isinstance(factor.distribution, Discrete):
            raise InputError(
                f"factor {factor.name}", "a discrete factor has no effect per unit of a step; use trajectories on levels"
            )
    trajectories = check_count("trajectories", trajectories, 1)
    k = len(space)
    sequence = qmc.Sobol(2 * k, rng=np.random.default_rng(check_seed(seed)))
    points = sequence.random_base2((trajectories - 1).bit_length())[:trajectories]
    base = points[:, :k]
    unit = np.repeat(base[:, None, :], k + 1, axis=1)
    unit[:, np.arange(1, k + 1), np.arange(k)] = np.mod(base + 0.25 + 0.5 * points[:, k:], 1.0)
    return _morris(space, unit.reshape(-1, k), int(seed), trajectories, 0, ())


def add_trajectories(design: Design, more: int) -> Design:
    """A larger design whose first runs are those of ``design``: only the others need to be run.

    Trajectory t beyond those of the original design is drawn from the seed of the stage "trajectory t", so that adding ten twice
    is adding twenty. A radial design goes on along its Sobol sequence.

    Parameters
    ----------
    design
        Any Morris design, also one that has grown before.
    more
        Number of trajectories to add, at least 1.

    Raises
    ------
    InputError
        Another kind of design, a count too small.
    """
    design.require("morris")
    more = check_count("more", more, 1)
    if design.levels == 0:
        return radial_design(design.space, design.base + more, design.seed)
    groups = dict(design.groups)
    parts = [design.unit_points]
    for t in range(design.base, design.base + more):
        seed = stage_seed(design.seed, f"trajectory {t}")
        if groups:
            one = grouped_morris_design(design.space, 1, design.levels, seed, groups)
        else:
            one = morris_design(design.space, 1, design.levels, seed)
        parts.append(one.unit_points)
    return _morris(design.space, np.concatenate(parts), design.seed, design.base + more, design.levels, design.groups)


def _morris(space: FactorSpace, unit: FloatArray, seed: int, base: int, levels: int, groups: Groups) -> Design:
    return Design("morris", space, unit, space.transform(unit), seed, base, unit.shape[0] // base, levels, groups=groups)
