"""Where to run the model next, so that Sobol indices on its Kriging surrogate become surer with few runs.

Half of a batch is a Latin hypercube, and all of it while the leave-one-out Q2 is below 0.8: a surrogate that has missed
an input would otherwise never be told. The other half is chosen one by one out of a scrambled Sobol set, each by how
much it lowers the posterior variance of

- the indices: the pick-freeze estimates of S1 and ST on N points, linearised at the surrogate's mean, are linear
  functionals L of the response (:func:`index_gradients`), and a run at c lowers the variance of L by cov(L, y(c))^2 /
  (var y(c) + noise);
- the response itself, averaged over the cube (integrated variance: Sacks, Welch, Mitchell and Wynn, Statistical Science
  4, 1989, 409-423), since the mean that the first part trusts may be wrong.

Both sums are taken relative to their mean over the candidates. The variance left after a run needs no value of it, so
that the runs of a batch know of one another and do not cluster.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from levelone.errors import InputError
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.designs import latin_hypercube
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.factors import FactorSpace
from levelone.uncertainty.failures import EstimateStatus
from levelone.uncertainty.kriging import Kriging
from levelone.uncertainty.posterior import Candidates, Functionals
from levelone.uncertainty.seeds import check_seed, stage_seed

# A surrogate that explains less is not asked where to go: measured on Ishigami among 14 inputs, it has missed an input
# that acts, and the runs that it chooses hide that input further.
_LEAST_Q2 = 0.8

_LOG_CANDIDATES = 10
_LOG_PICK_FREEZE = 9
_LOG_QUADRATURE = 9


@dataclass(frozen=True, eq=False)
class SequentialDesign:
    """Runs chosen batch by batch.

    Attributes
    ----------
    unit_points
        [n, k] coordinates in the unit cube, in the order of running.
    values
        [n], NaN where a run failed.
    sizes
        Runs after each stage; the first is the Latin hypercube that it started from.
    q2
        [stages], leave-one-out Q2 of the surrogate after each.
    failed
        Failed runs.
    model
        Surrogate of the runs that did not fail; ``TOO_FEW_RUNS`` where they determine none.
    """

    unit_points: FloatArray
    values: FloatArray
    sizes: tuple[int, ...]
    q2: FloatArray
    failed: int
    model: Kriging


def sequential_design(
    evaluate: Callable[[FloatArray], FloatArray], space: FactorSpace, start: int, total: int, batch: int, seed: int
) -> SequentialDesign:
    """Run a Latin hypercube, then batches where they are worth most.

    Parameters
    ----------
    evaluate
        The model: physical points [n, k] to one response [n]; what is not finite has failed, and is counted.
    space
        Factors, independent of one another.
    start, total, batch
        Runs at first, in the end, and of each batch (the last may be smaller).
    seed
        Seed of every stage.

    Raises
    ------
    InputError
        Counts that do not fit together, correlated factors, a model that answers another number of values.
    """
    space.require_independent("a sequential design for Sobol indices", "a Latin hypercube of all runs")
    if start < 2 or total < start or batch < 1:
        raise InputError("start, total, batch", f"{start}, {total}, {batch}; start at least 2, total no less, batch at least 1")
    unit = latin_hypercube(space, start, seed).unit_points
    values = _run(evaluate, space, unit)
    sizes, model = [start], _surrogate(unit, values, seed)
    q2 = [model.q2]
    while len(unit) < total:
        stage = stage_seed(seed, f"batch after {len(unit)} runs")
        new = next_points(model, unit, stage, min(batch, total - len(unit)))
        unit, values = np.vstack([unit, new]), np.concatenate([values, _run(evaluate, space, new)])
        model = _surrogate(unit, values, seed, model)
        sizes.append(len(unit))
        q2.append(model.q2)
    return SequentialDesign(unit, values, tuple(sizes), np.array(q2), int(np.isnan(values).sum()), model)


def next_points(model: Kriging, x_unit: ArrayLike, candidates_seed: int, m: int) -> FloatArray:
    """Points of the unit cube at which to run the model next, [m, k]: a Latin hypercube of m // 2, then those chosen.

    Parameters
    ----------
    model
        Kriging model of unit points; where it is degenerate or its ``q2`` below 0.8, all points are a Latin hypercube.
    x_unit
        [n, k] all runs so far, failed ones included: their places are not asked for again.
    candidates_seed
        Seed of the hypercube, of the candidates and of the points of the averages.
    m
        Number of points, at most 1024.

    Raises
    ------
    InputError
        Another number of inputs, an m out of range.
    """
    x = np.array(x_unit, dtype=np.float64)
    k = len(model.lengths)
    if x.ndim != 2 or x.shape[1] != k or not ((x >= 0.0) & (x <= 1.0)).all():
        raise InputError("x_unit", f"shape {x.shape}; [n, {k}] points of the unit cube are needed")
    if not 1 <= m <= 2**_LOG_CANDIDATES:
        raise InputError("m", f"{m!r}; 1 to {2**_LOG_CANDIDATES} points at a time")
    rng = np.random.default_rng(check_seed(candidates_seed))
    trusted = model.status is EstimateStatus.OK and model.q2 >= _LEAST_Q2
    spread = qmc.LatinHypercube(k, rng=rng).random(m // 2 if trusted else m)
    if not trusted:
        return spread
    points = qmc.Sobol(k, rng=rng).random_base2(_LOG_CANDIDATES)
    with OneBlasThread():
        candidates = Candidates(model, np.vstack([x, spread]), points)
        indices = candidates.covariance(_index_functionals(model, candidates, rng))
        average = qmc.Sobol(k, rng=rng).random_base2(_LOG_QUADRATURE)
        response = candidates.covariance(candidates.weighted(average, np.eye(len(average))))
        chosen = _greedy(candidates, [indices, response], m - len(spread))
    return np.vstack([spread, points[chosen]])


def _greedy(candidates: Candidates, groups: list[FloatArray], m: int) -> list[int]:
    """The m candidates that lower the variances of the groups of functionals most, one after the other."""
    relative = []
    for group in groups:
        gain = np.sum(group**2, axis=0) / (candidates.variance + candidates.noise)
        relative.append(group / np.sqrt(max(float(gain.mean()), np.finfo(np.float64).tiny)))
    covariance = np.vstack(relative)
    chosen: list[int] = []
    for _ in range(m):
        gain = np.sum(covariance**2, axis=0) / (candidates.variance + candidates.noise)
        gain[chosen] = -np.inf
        best = int(gain.argmax())
        scale = np.sqrt(candidates.variance[best] + candidates.noise)
        along = candidates.add(best)
        covariance -= np.outer(covariance[:, best] / scale, along)
        chosen.append(best)
    return chosen


def _index_functionals(model: Kriging, candidates: Candidates, rng: np.random.Generator) -> Functionals:
    """S1 and ST of all inputs, linearised at the mean of the model, [2 k] functionals."""
    k = len(model.lengths)
    base = qmc.Sobol(2 * k, rng=rng).random_base2(_LOG_PICK_FREEZE)
    points = [base[:, :k], base[:, k:]]
    for j in range(k):
        mixed = points[0].copy()
        mixed[:, j] = points[1][:, j]
        points.append(mixed)
    means = np.array([model.predict_mean(block) for block in points])
    parts = [candidates.weighted(block, weight) for block, weight in zip(points, index_gradients(means), strict=True)]
    return Functionals(
        np.sum([part.with_runs for part in parts], axis=0),
        np.sum([part.with_candidates for part in parts], axis=0),
        np.sum([part.trend for part in parts], axis=0),
    )


def index_gradients(means: FloatArray) -> Iterator[FloatArray]:
    """Derivatives of the pick-freeze estimates by the values that they are made of.

    With a, b, c_j the centred values at A, B and A with coordinate j from B, and V their variance (a and b together),
    S1_j = mean(b (c_j - a)) / V and ST_j = mean((a - c_j)^2) / (2 V); the centre is held.

    Parameters
    ----------
    means
        [k + 2, n] values at A, at B, then with each coordinate from B.

    Yields
    ------
    [2 k, n] for each of the k + 2 rows: derivatives of S1 (first k rows) and of ST.
    """
    k, n = len(means) - 2, means.shape[1]
    a, b, *rest = means - means[:2].mean()
    c = np.array(rest)
    variance = 0.5 * float(np.mean(a * a) + np.mean(b * b))
    S1 = np.mean(b * (c - a), axis=1)[:, None] / variance
    ST = 0.5 * np.mean((a - c) ** 2, axis=1)[:, None] / variance
    yield np.concatenate([-b - S1 * a, (a - c) - ST * a]) / (n * variance)
    yield np.concatenate([(c - a) - S1 * b, -ST * b]) / (n * variance)
    for j in range(k):
        weight = np.zeros((2 * k, n))
        weight[j], weight[k + j] = b / (n * variance), (c[j] - a) / (n * variance)
        yield weight


def _run(evaluate: Callable[[FloatArray], FloatArray], space: FactorSpace, unit: FloatArray) -> FloatArray:
    values = np.array(evaluate(space.transform(unit)), dtype=np.float64)
    if values.shape != (len(unit),):
        raise InputError("evaluate", f"answered shape {values.shape} to {len(unit)} points; one value for each is needed")
    values[~np.isfinite(values)] = np.nan
    return values


def _surrogate(unit: FloatArray, values: FloatArray, seed: int, before: Kriging | None = None) -> Kriging:
    """Kriging of the runs that did not fail: with the lengths found now, or those of before where they predict better.

    A search now and then ends where an input that acts is taken for noise (2 of 20 seeds on Ishigami among 14 inputs, at
    200 runs); the lengths of the batch before tell.
    """
    kept = np.isfinite(values)
    if kept.any() and (np.ptp(unit[kept], axis=0) == 0.0).any():
        kept[:] = False
    x, y = unit[kept], values[kept]
    found = Kriging.fit(x, y, stage_seed(seed, "sequential surrogate"))
    if before is None or before.status is not EstimateStatus.OK or found.status is not EstimateStatus.OK:
        return found
    held = Kriging.condition(x, y, before.lengths, before.nugget, correlation=before.correlation, trend=before.trend)
    return held if held.q2 > found.q2 else found
