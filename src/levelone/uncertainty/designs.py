"""Point sets in the factor box that remember how they were built.

An analysis reads the structure of the set from its :class:`Design`, so that sampling and analysis cannot disagree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import qmc

from levelone.errors import InputError
from levelone.uncertainty.counts import check_count, check_power_of_two
from levelone.uncertainty.distributions import Discrete, FloatArray
from levelone.uncertainty.factors import FactorSpace
from levelone.uncertainty.groups import Groups, group_columns, group_names, resolve_groups
from levelone.uncertainty.seeds import check_seed, stage_seed

DesignKind = Literal["morris", "latin_hypercube", "sobol", "shapley", "derivatives"]


@dataclass(frozen=True, eq=False)
class Design:
    """Points at which a model is to be run.

    Attributes
    ----------
    kind
        How the set was built.
    space
        The factors; they are the columns.
    unit_points
        [runs, factors], coordinates in the unit cube.
    points
        [runs, factors], physical values: ``space.transform(unit_points)``.
    seed
        Seed it was built from.
    base
        Number of blocks: trajectories (Morris), points (Latin hypercube), base points of all scramblings (the others).
    block
        Consecutive runs in a block: columns + 1 (Morris, Shapley), 1 (Latin hypercube), columns + 2 or, with second
        order, 2 columns + 2 (Sobol), 2 columns + 1 (derivatives).
    levels
        Levels of the Morris grid; 0 for a radial Morris design and for other kinds.
    scramblings
        Independent scramblings of the Sobol points, one after another; ``base / scramblings`` base points each.
    second_order
        Whether a Sobol design holds the rows from which pairs are estimated.
    groups
        Groups of factors that the design moves together, name and factors, in the order of the columns; empty
        where every factor moves alone.
    """

    kind: DesignKind
    space: FactorSpace
    unit_points: FloatArray
    points: FloatArray
    seed: int
    base: int
    block: int
    levels: int = 0
    scramblings: int = 1
    second_order: bool = False
    groups: Groups = ()

    def __post_init__(self) -> None:
        self.unit_points.setflags(write=False)
        self.points.setflags(write=False)

    @property
    def runs(self) -> int:
        """Number of runs of the model."""
        return self.points.shape[0]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the factors, in the order of the columns."""
        return self.space.names

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of what is moved on its own, for which there are indices: the groups, or the factors without groups."""
        return group_names(self.groups) or self.space.names

    def require(self, kind: DesignKind) -> None:
        """Refuse to analyse a design of another kind."""
        if self.kind != kind:
            raise InputError("design", f"a {kind} design is needed, and this one is {self.kind}")


def _build(kind: DesignKind, space: FactorSpace, unit: FloatArray, seed: int, base: int, levels: int = 0) -> Design:
    return Design(kind, space, unit, space.transform(unit), seed, base, unit.shape[0] // base, levels)


def morris_design(space: FactorSpace, trajectories: int, levels: int, seed: int) -> Design:
    """Random trajectories on a grid of the unit cube, each moving every factor once.

    Source: Morris, Technometrics 33, 1991, 161-174.

    Run ``t * (k + 1) + s`` is step s of trajectory t. The grid has ``levels`` equidistant levels from 0 to 1; a step
    is delta = levels / (2 (levels - 1)), up or down with equal probability, and the order of the factors is random in
    each trajectory.

    A discrete factor has no value for each level: level i of p stands for the middle of the i-th of p equal shares of
    its probability, (i + 1/2) / p, which never falls on the edge of a step of its distribution. Its step then moves
    half of the probability. Its elementary effect is divided by the same delta as that of the others: for a factor of
    two values on 4 levels it is 1.5 times the difference between them, for one of very many values 0.75 times the
    range of a linear effect.

    Parameters
    ----------
    space
        Factors, each with finite ends.
    trajectories
        Number of trajectories, at least 1 (2 for a standard deviation).
    levels
        Even number of levels, at least 2.
    seed
        Seed.

    Raises
    ------
    InputError
        An unbounded factor, correlated factors, an odd number of levels, counts too small.
    """
    space.require_bounded("a Morris design")
    space.require_independent("a Morris design", "Shapley effects and given-data indices keep their meaning")
    trajectories = check_count("trajectories", trajectories, 1)
    levels = check_count("levels", levels, 2)
    if levels % 2:
        raise InputError("levels", f"{levels} is odd; an even number makes every level equally likely")
    rng = np.random.default_rng(check_seed(seed))
    k, jump = len(space), levels // 2
    start = rng.integers(0, jump, size=(trajectories, 1, k))
    upward = rng.integers(0, 2, size=(trajectories, 1, k))
    order = rng.permuted(np.tile(np.arange(k), (trajectories, 1)), axis=1)
    # Factor j moves at step rank[j]; in row s it has moved if rank[j] < s. Factors that move down start at the upper
    # level.
    rank = np.argsort(order, axis=1)[:, None, :]
    moved = rank < np.arange(k + 1)[None, :, None]
    level = (start + jump * (moved == upward)).reshape(-1, k)
    unit = level / (levels - 1)
    for j, factor in enumerate(space.factors):
        if isinstance(factor.distribution, Discrete):
            unit[:, j] = (level[:, j] + 0.5) / levels
    return _build("morris", space, unit, int(seed), trajectories, levels)


def latin_hypercube(space: FactorSpace, n: int, seed: int) -> Design:
    """Latin hypercube of ``n`` points, each at random inside its cell (scipy.stats.qmc.LatinHypercube)."""
    n = check_count("n", n, 1)
    unit = qmc.LatinHypercube(len(space), rng=np.random.default_rng(check_seed(seed))).random(n)
    return _build("latin_hypercube", space, unit, int(seed), n)


def sobol_design(
    space: FactorSpace,
    n: int,
    seed: int,
    *,
    second_order: bool = False,
    scramblings: int = 1,
    groups: Mapping[str, Sequence[str]] | None = None,
) -> Design:
    """Pick-freeze design on scrambled Sobol points.

    Source: Saltelli et al., Computer Physics Communications 181, 2010, 259-270, section 3; rows for pairs Saltelli,
    Computer Physics Communications 145, 2002, 280-297, theorem 2.

    A scrambled Sobol sequence in 2k dimensions gives A (first k coordinates) and B (last k). A block of consecutive
    runs belongs to base point i: A_i; then, for each column j, A_i with column j taken from B_i; with second order, for
    each column j, B_i with column j taken from A_i; last B_i. A column is a factor, or a group of factors that are
    taken together. A leading part of the runs of one scrambling is therefore a design of fewer base points.

    Scramblings follow one another, each with n base points of its own and independent of the others. The first comes
    from ``seed`` itself and scrambling r from the seed of the stage "scrambling r", so that a design of more
    scramblings begins with the runs of the smaller one: samples are added without repeating any.

    Parameters
    ----------
    space
        Factors; those that are correlated with one another must share a group.
    n
        Number of base points in each scrambling, a power of two (only then is a Sobol point set balanced).
    seed
        Seed of the scrambling.
    second_order
        Whether pairs are to be estimated; nearly doubles the runs.
    scramblings
        Number of independent scramblings; from 4 on, intervals come from the spread between them.
    groups
        Factors by name of the group; a factor in none stays alone, after the groups, under its own name.

    Returns
    -------
    Design with n scramblings (c + 2) runs for c columns, or n scramblings (2c + 2) with second order.

    Raises
    ------
    InputError
        Correlated factors in different columns, a wrong count, a factor that is unknown or in two groups.
    """
    n, scramblings = check_power_of_two("n", n), check_count("scramblings", scramblings, 1)
    resolved = resolve_groups(space, groups)
    columns = group_columns(space, resolved)
    _require_independent_columns(space, columns)
    seeds = [check_seed(seed), *(stage_seed(seed, f"scrambling {r}") for r in range(1, scramblings))]
    unit = np.concatenate([_pick_freeze(len(space), n, one, columns, second_order) for one in seeds])
    base = n * scramblings
    return Design(
        "sobol", space, unit, space.transform(unit), int(seed), base, unit.shape[0] // base,
        scramblings=scramblings, second_order=second_order, groups=resolved,
    )  # fmt: skip


def _require_independent_columns(space: FactorSpace, columns: tuple[tuple[int, ...], ...]) -> None:
    """Refuse correlations between different columns; inside a group they are harmless, since it moves as one."""
    if not space.correlated:
        return
    column = np.empty(len(space), dtype=np.int64)
    for number, members in enumerate(columns):
        column[list(members)] = number
    apart = column[:, None] != column
    if np.array(space.correlation)[apart].any():
        space.require_independent(
            "a pick-freeze design",
            "Shapley effects and given-data indices keep their meaning, and so does a group that holds all factors that are "
            "correlated with one another",
        )


def _pick_freeze(k: int, n: int, seed: int, columns: tuple[tuple[int, ...], ...], second_order: bool) -> FloatArray:
    """Unit points of one scrambling, [n block, k]."""
    base = qmc.Sobol(2 * k, scramble=True, rng=np.random.default_rng(seed)).random_base2(n.bit_length() - 1)
    a, b = base[:, :k], base[:, k:]
    c = len(columns)
    unit = np.repeat(a[:, None, :], 2 * c + 2 if second_order else c + 2, axis=1)
    unit[:, c + 1 :, :] = b[:, None, :]
    for j, column in enumerate(columns):
        unit[:, 1 + j, column] = b[:, column]
        if second_order:
            unit[:, 1 + c + j, column] = a[:, column]
    return unit.reshape(-1, k)
