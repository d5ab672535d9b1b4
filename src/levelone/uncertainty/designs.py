"""Point sets in the factor box that remember how they were built.

An analysis reads the structure of the set from its :class:`Design`, so that sampling and analysis cannot disagree.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import qmc

from levelone.errors import InputError
from levelone.uncertainty.distributions import Discrete, FloatArray
from levelone.uncertainty.factors import FactorSpace
from levelone.uncertainty.seeds import check_seed

DesignKind = Literal["morris", "latin_hypercube", "sobol"]


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
        Number of blocks: trajectories (Morris), points (Latin hypercube), base points (Sobol).
    block
        Consecutive runs in a block: factors + 1 (Morris), 1 (Latin hypercube), factors + 2 (Sobol).
    levels
        Levels of the Morris grid; 0 for other kinds.
    """

    kind: DesignKind
    space: FactorSpace
    unit_points: FloatArray
    points: FloatArray
    seed: int
    base: int
    block: int
    levels: int = 0

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

    def require(self, kind: DesignKind) -> None:
        """Refuse to analyse a design of another kind."""
        if self.kind != kind:
            raise InputError("design", f"a {kind} design is needed, and this one is {self.kind}")


def _build(kind: DesignKind, space: FactorSpace, unit: FloatArray, seed: int, base: int, levels: int = 0) -> Design:
    return Design(kind, space, unit, space.transform(unit), seed, base, unit.shape[0] // base, levels)


def _check_count(name: str, value: int, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(name, f"{value!r}; a whole number of at least {least} is needed")
    return int(value)


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
        An unbounded factor, an odd number of levels, counts too small.
    """
    space.require_bounded("a Morris design")
    trajectories = _check_count("trajectories", trajectories, 1)
    levels = _check_count("levels", levels, 2)
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
    n = _check_count("n", n, 1)
    unit = qmc.LatinHypercube(len(space), rng=np.random.default_rng(check_seed(seed))).random(n)
    return _build("latin_hypercube", space, unit, int(seed), n)


def sobol_design(space: FactorSpace, n: int, seed: int) -> Design:
    """Pick-freeze design on scrambled Sobol points.

    Source: Saltelli et al., Computer Physics Communications 181, 2010, 259-270, section 3.

    A scrambled Sobol sequence in 2k dimensions gives A (first k coordinates) and B (last k). Block i of k + 2
    consecutive runs belongs to base point i: row 0 is A_i, row 1 + j is A_i with coordinate j taken from B_i, row k +
    1 is B_i. A leading part of the runs is therefore a design of fewer base points.

    Parameters
    ----------
    space
        Factors.
    n
        Number of base points, a power of two (only then is a Sobol point set balanced).
    seed
        Seed of the scrambling.

    Returns
    -------
    Design with n (k + 2) runs.
    """
    n = _check_count("n", n, 2)
    if n & (n - 1):
        near = 1 << (n.bit_length() - 1)
        raise InputError("n", f"{n} is not a power of two; the nearest are {near} and {2 * near}")
    k = len(space)
    sequence = qmc.Sobol(2 * k, scramble=True, rng=np.random.default_rng(check_seed(seed)))
    base = sequence.random_base2(n.bit_length() - 1)
    a, b = base[:, :k], base[:, k:]
    unit = np.repeat(a[:, None, :], k + 2, axis=1)
    unit[:, np.arange(1, k + 1), np.arange(k)] = b
    unit[:, k + 1, :] = b
    return _build("sobol", space, unit.reshape(-1, k), int(seed), n)
