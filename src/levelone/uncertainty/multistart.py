"""Search for the hyperparameters of a Kriging model: several starts, several correlations, the likeliest wins.

One start fails on functions with inert inputs, whatever the library. Starts are explored on half of the points, where
an evaluation costs a fifth; the best distinct optima found there are then refined on all points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import Bounds, minimize
from scipy.stats import qmc

from levelone.uncertainty.correlation import Correlation
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.likelihood import RestrictedLikelihood

LENGTH_BOUNDS = (0.01, 100.0)
"""Length scales searched, in units of an input's range."""
NUGGET_BOUNDS = (1e-8, 10.0)
"""Nugget over process variance."""

# Measured on Ishigami and Sobol G among 14 inputs: 78 % of the starts with a small nugget reach the best optimum, and
# 15 to 35 % of those with 1e-2, which explain the response as noise. On a response that is half noise it is the other
# way round: a nugget of 1e-5 stays there, since the likelihood no longer feels it. One start in three takes the large
# one.
_LENGTH_STARTS = (0.5, 10.0)
_NUGGET_STARTS = (1e-5, 1e-5, 1e-2)

# More corrections than SciPy's ten save a fifth of the evaluations; 1e-6 of a log likelihood of some hundreds is far
# below what matters.
_DESCENT: Any = {"maxiter": 200, "maxcor": 30, "ftol": 1e-6}

_REFINE_NUGGET = 1e-4  # least nugget from which refinement starts
# Fewer points than this are explored whole: of Ishigami's function in 14 inputs, half of 200 points can miss the best optimum.
_EXPLORE_PART_FROM = 300
_FINALISTS = 3
_DECISIVE = 20.0  # log likelihood on half of the points by which an optimum is out of the race on all of them
_SAME_OPTIMUM = 0.05  # log likelihood within which two explorations have found one optimum


@dataclass(frozen=True, eq=False)
class Optimum:
    """An optimum found: the correlation, log l (and log g), the penalised negative log likelihood there."""

    kind: Correlation
    parameters: FloatArray
    objective: float


def search(
    x: FloatArray,
    y: FloatArray,
    trend: FloatArray,
    kinds: Sequence[Correlation],
    nugget: bool,
    seed: int,
    starts: int,
) -> Optimum:
    """Minimise the penalised negative log restricted likelihood.

    Parameters
    ----------
    x, y, trend, nugget
        As for :class:`RestrictedLikelihood`.
    kinds
        Correlations that compete.
    seed
        The result depends on nothing else: starts are a scrambled Sobol sequence in log l, the explored part a random
        half.
    starts
        Starts for each correlation.
    """
    rng = np.random.default_rng(seed)
    n, k = x.shape
    part = np.arange(n) if n < _EXPLORE_PART_FROM else np.sort(rng.permutation(n)[: n // 2])
    explored = {kind: RestrictedLikelihood(x[part], y[part], trend[part], kind, nugget) for kind in kinds}
    found = [_descend(explored[kind], begin) for kind in kinds for begin in _starts(k, nugget, starts, rng)]
    # A correlation whose own starts all missed is judged from where the best one ended.
    best = min(found, key=_objective)
    found += [_descend(explored[kind], best.parameters) for kind in kinds if kind != best.kind]
    finalists = _finalists(found)
    if len(part) == n:
        return finalists[0]
    return min((_refine(x, y, trend, nugget, finalist) for finalist in finalists), key=_objective)


def _objective(optimum: Optimum) -> float:
    return optimum.objective


def _starts(k: int, nugget: bool, starts: int, rng: np.random.Generator) -> list[FloatArray]:
    low, high = np.log(_LENGTH_STARTS)
    unit = qmc.Sobol(k, rng=rng).random_base2(max(starts - 1, 0).bit_length())[:starts]
    nuggets = np.log(np.resize(_NUGGET_STARTS, starts))
    return [np.append(low + (high - low) * point, [value] * nugget) for point, value in zip(unit, nuggets, strict=True)]


def _descend(likelihood: RestrictedLikelihood, begin: FloatArray) -> Optimum:
    k = likelihood.x.shape[1]
    low = np.log([LENGTH_BOUNDS[0]] * k + [NUGGET_BOUNDS[0]] * likelihood.nugget)
    high = np.log([LENGTH_BOUNDS[1]] * k + [NUGGET_BOUNDS[1]] * likelihood.nugget)
    result = minimize(likelihood, begin, jac=True, method="L-BFGS-B", bounds=Bounds(low, high), options=_DESCENT)
    return Optimum(likelihood.kind, result.x, float(result.fun))


def _finalists(found: list[Optimum]) -> list[Optimum]:
    """The best distinct optima, best first, as long as they are in the race."""
    ranked = sorted(found, key=_objective)
    kept = ranked[:1]
    for optimum in ranked[1:]:
        if optimum.objective - kept[0].objective > _DECISIVE or len(kept) == _FINALISTS:
            break
        if optimum.kind != kept[-1].kind or optimum.objective - kept[-1].objective > _SAME_OPTIMUM:
            kept.append(optimum)
    return kept


def _refine(x: FloatArray, y: FloatArray, trend: FloatArray, nugget: bool, optimum: Optimum) -> Optimum:
    begin = optimum.parameters.copy()
    if nugget:
        # A nugget explored down to its lower bound could not come back by itself.
        begin[-1] = max(begin[-1], np.log(_REFINE_NUGGET))
    return _descend(RestrictedLikelihood(x, y, trend, optimum.kind, nugget), begin)
