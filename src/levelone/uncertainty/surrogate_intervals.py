"""Sobol indices on a Kriging model, with intervals that hold its own error as well as that of sampling it.

Three errors stand between an index computed on a surrogate and that of the true response:

- the surrogate is sampled at a finite number of base points (the intervals of :func:`levelone.uncertainty.sobol.sobol`);
- between its runs the true function is unknown: functions drawn from the posterior, hyperparameters included, say what it may be;
- the model itself is an assumption (one correlation for the whole box): what changes when a fifth of the runs is left out asks
  the data rather than the model.

What was tried, and how often each interval holds the truth, is in docs/theory/surrogate-intervals.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from levelone.errors import InputError, unknown_name
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.bootstrap import CONFIDENCE
from levelone.uncertainty.designs import Design, sobol_design
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import EstimateStatus
from levelone.uncertainty.groups_out import random_groups, without_groups
from levelone.uncertainty.hyperparameters import draw_hyperparameters
from levelone.uncertainty.kriging import Kriging, trend_functions
from levelone.uncertainty.likelihood import RestrictedLikelihood
from levelone.uncertainty.paths import posterior_paths
from levelone.uncertainty.pick_freeze import pick_freeze_ratios, pick_freeze_terms
from levelone.uncertainty.seeds import stage_seed
from levelone.uncertainty.sobol import SobolIndices, sobol
from levelone.uncertainty.surrogate_bound import worst_case

Coordinates = Literal["unit", "physical"]
ErrorKind = Literal["bounded", "drawn"]

DRAWS, PATHS = 20, 8
"""Draws of the hyperparameters, and functions drawn at each."""
POWER = 0.5
"""Power of the likelihood from which hyperparameters are drawn: at 1 their spread is too small for functions that no stationary
process describes."""
PATH_POINTS = 512
"""Base points on which the index of a drawn function is compared with that of the mean."""
GROUPS = 5
"""Groups of runs left out in turn."""
GROUP_POINTS = 2048
"""Base points on which the indices without each group are compared."""
MINOR, NEGLIGIBLE = 0.5, 1e-3
"""The worst case of a very good surrogate stands for its error where no index is moved by more than the first part of its sampling
error, or by more than the second share of the variance."""


@dataclass(frozen=True, eq=False)
class SurrogateIndices:
    """Sobol indices of one response for each of k columns, estimated on a surrogate.

    Attributes
    ----------
    names
        Names of the columns: factors or groups.
    S1, ST
        [k], on the mean of the surrogate, at the points of the design.
    S1_ci, ST_ci
        [k, 2]: 95 % intervals that hold sampling and surrogate error.
    S1_ci_sampling, ST_ci_sampling
        [k, 2]: those of sampling alone.
    S1_shift, ST_shift
        [k]: mean index of the drawn functions minus that of the surrogate's mean. A drawn function varies between the runs
        where the mean is smooth; this adds variance that no single input explains, so that the shift of S1 is mostly
        negative and that of ST positive. The intervals hold the estimate with and without it.
    error_kind
        How the surrogate's error was found: "drawn" functions and the jackknife, or "bounded" by the worst case
        (:mod:`levelone.uncertainty.surrogate_bound`), where that is minor beside the sampling error: shifts, inflation and
        acceptance are then NaN.
    inflation
        Factor on the posterior's standard deviation: root mean square of the standardised leave-one-out residuals, at least 1.
    acceptance
        Share of proposals accepted when drawing hyperparameters; far below 0.5 the draws are few distinct ones.
    sampled
        All that :func:`levelone.uncertainty.sobol.sobol` says about the mean of the surrogate.
    status
        ``CONSTANT_RESPONSE`` or ``TOO_FEW_RUNS``: every number above is then NaN.
    """

    names: tuple[str, ...]
    S1: FloatArray
    ST: FloatArray
    S1_ci: FloatArray
    ST_ci: FloatArray
    S1_ci_sampling: FloatArray
    ST_ci_sampling: FloatArray
    S1_shift: FloatArray
    ST_shift: FloatArray
    error_kind: ErrorKind
    inflation: float
    acceptance: float
    sampled: SobolIndices
    status: EstimateStatus


def sobol_on_surrogate(
    x: ArrayLike,
    y: ArrayLike,
    model: Kriging,
    design: Design,
    seed: int,
    *,
    coordinates: Coordinates = "unit",
    bootstrap: int = 500,
    sampled: SobolIndices | None = None,
) -> SurrogateIndices:
    """Sobol indices of the mean of a Kriging model, and intervals for those of the response it was fitted to.

    The lower end lies sqrt(p^2 + (z e)^2 + s^2) below the estimate. p: with d the difference between the index of a drawn
    function and that of the mean on the same points, the lowest of 0, the lower quantile of d, and that quantile with d
    about its mean. e: standard deviation of the index by the jackknife that leaves out a fifth of the runs at a time. s:
    distance of the sampling interval's lower end. z = 1.96. The upper end likewise. Lengths, nugget and variance of the
    process are drawn from their posterior, the likelihood to the power :data:`POWER`. Where the surrogate is so good that its worst
    case is minor beside the sampling error, p is that worst case, e is 0 and nothing is drawn.

    Responses may run side by side in threads, one each.

    Parameters
    ----------
    x, y
        [n, k], [n]: the runs that ``model`` was fitted to, those without failure.
    model
        From :meth:`levelone.uncertainty.kriging.Kriging.fit`.
    design
        From :func:`levelone.uncertainty.designs.sobol_design`.
    seed
        Seed of the draws; the result depends on no thread count.
    coordinates
        Whether the model was fitted on "unit" or on "physical" points.
    bootstrap
        Resamplings for the sampling error, where the design has fewer than four scramblings.
    sampled
        Indices of the mean of ``model`` on ``design`` where they are known already: it is then not asked again.

    Raises
    ------
    InputError
        Another kind of design, runs that are not those of the model, indices that are not those of the design.
    """
    if coordinates not in get_args(Coordinates):
        raise unknown_name("coordinates", coordinates, get_args(Coordinates))
    x, y = model.require_runs(x, y)
    design.require("sobol")
    if sampled is not None and (sampled.names, sampled.base) != (design.columns, design.base):
        raise InputError("sampled", f"{sampled.base} base points of {len(sampled.names)} columns; the design has {design.base}")
    with OneBlasThread():
        if sampled is None:
            sampled = sobol(design, model.predict_mean(_points(design, coordinates)), bootstrap=bootstrap, policy="drop")
        few = len(y) - -(-len(y) // GROUPS) < model.trend_terms + 2
        own = EstimateStatus.TOO_FEW_RUNS if few and model.status is EstimateStatus.OK else model.status
        status = own if own is not EstimateStatus.OK else sampled.status
        if status is not EstimateStatus.OK:
            return _undefined(sampled, status)
        bounded = _bounded(sampled, model.q2)
        if bounded is not None:
            return bounded
        inflation = max(1.0, float(np.sqrt(np.mean((model.loo_residual / model.loo_std) ** 2))))
        difference, acceptance = _differences(x, y, model, _small(design, PATH_POINTS, seed), coordinates, seed, inflation)
        left_out = _jackknife(x, y, model, _small(design, GROUP_POINTS, seed), coordinates, seed)
    ci = _intervals(sampled, difference, left_out)
    shift = difference.mean(axis=0)
    both = (sampled.S1, sampled.ST, ci[0], ci[1], sampled.S1_ci, sampled.ST_ci)
    return SurrogateIndices(sampled.names, *both, shift[0], shift[1], "drawn", inflation, acceptance, sampled, status)


def _bounded(sampled: SobolIndices, q2: float) -> SurrogateIndices | None:
    """Indices whose intervals hold the worst case of the surrogate; None where that is not minor."""
    estimate, ci = _pair(sampled)
    reach = np.abs(worst_case(estimate, q2) - np.maximum(estimate, 0.0)[..., None])
    if not (reach <= np.maximum(MINOR * np.abs(ci - estimate[..., None]), NEGLIGIBLE)).all():
        return None
    wide = _joined(estimate, ci, reach)
    nothing = np.full(len(sampled.names), np.nan)
    both = (sampled.S1, sampled.ST, wide[0], wide[1], sampled.S1_ci, sampled.ST_ci)
    return SurrogateIndices(sampled.names, *both, nothing, nothing, "bounded", np.nan, np.nan, sampled, EstimateStatus.OK)


def _pair(sampled: SobolIndices) -> tuple[FloatArray, FloatArray]:
    """S1 and ST, [2, k], and their sampling intervals, [2, k, 2]."""
    return np.array([sampled.S1, sampled.ST]), np.array([sampled.S1_ci, sampled.ST_ci])


def _joined(estimate: FloatArray, ci: FloatArray, reach: FloatArray) -> FloatArray:
    """Intervals [2, k, 2] whose ends lie as far from the estimate as sampling and ``reach`` together, added as squares."""
    distance = np.sqrt(reach**2 + (ci - estimate[..., None]) ** 2)
    return estimate[..., None] + distance * np.array([-1.0, 1.0])


def _small(design: Design, n: int, seed: int) -> Design:
    """A pick-freeze design of the same columns with n base points of its own."""
    return sobol_design(design.space, n, stage_seed(seed, f"{n} points of the surrogate"), groups=dict(design.groups) or None)


def _points(design: Design, coordinates: Coordinates) -> FloatArray:
    return design.unit_points if coordinates == "unit" else design.points


def _differences(
    x: FloatArray, y: FloatArray, model: Kriging, small: Design, coordinates: Coordinates, seed: int, inflation: float
) -> tuple[FloatArray, float]:
    """S1 and ST of drawn functions minus those of the mean, [functions, 2, k], and the acceptance of the hyperparameters."""
    rng = np.random.default_rng(stage_seed(seed, "paths of the surrogate"))
    u, k, points = (x - x.min(axis=0)) / np.ptp(x, axis=0), x.shape[1], _points(small, coordinates)
    noisy = model.nugget > 0.0
    likelihood = RestrictedLikelihood(u, (y - y.mean()) / y.std(), trend_functions(u, model.trend), model.correlation, noisy)
    start = np.log(np.append(model.lengths, [model.nugget] * noisy))
    draws = draw_hyperparameters(likelihood, start, DRAWS, rng, POWER)
    indices = []
    for parameters in draws.parameters:
        nugget = float(np.exp(parameters[k])) if noisy else 0.0
        paths = posterior_paths(
            x, y, np.exp(parameters[:k]), nugget, PATHS, rng, correlation=model.correlation, trend=model.trend, inflation=inflation
        )
        indices.append(_indices(small, paths(points)))
    return np.concatenate(indices) - _indices(small, model.predict_mean(points)[None]), draws.acceptance


def _jackknife(x: FloatArray, y: FloatArray, model: Kriging, small: Design, coordinates: Coordinates, seed: int) -> FloatArray:
    """Standard deviation [2, k] of S1 and ST of the mean, from leaving out each group of runs in turn.

    Shao and Tu, The Jackknife and Bootstrap, 1995, chapter 2.
    """
    groups = random_groups(len(y), GROUPS, np.random.default_rng(stage_seed(seed, "groups left out")))
    indices = _indices(small, without_groups(x, y, model, groups).predict_mean(_points(small, coordinates)).T)
    return np.asarray(np.sqrt((GROUPS - 1.0) * indices.var(axis=0)))


def _indices(design: Design, values: FloatArray) -> FloatArray:
    """S1 and ST of several functions, [functions, 2, k], from their values [functions, runs]."""
    k = len(design.columns)
    means = [pick_freeze_terms(row.reshape(-1, design.block), False).mean(axis=0) for row in values]
    return pick_freeze_ratios(np.array(means), k, False).reshape(-1, 2, k)


def _intervals(sampled: SobolIndices, difference: FloatArray, left_out: FloatArray) -> FloatArray:
    """Intervals [2, k, 2] from differences of indices [draws, 2, k] and the jackknife's standard deviations [2, k]."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    mean = difference.mean(axis=0)
    low, high = np.quantile(difference, [tail, 1.0 - tail], axis=0)
    below, above = np.minimum(np.minimum(low, low - mean), 0.0), np.maximum(np.maximum(high, high - mean), 0.0)
    jackknife = norm.ppf(1.0 - tail) * left_out
    return _joined(*_pair(sampled), np.hypot(np.stack([below, above], axis=-1), jackknife[..., None]))


def _undefined(sampled: SobolIndices, status: EstimateStatus) -> SurrogateIndices:
    nothing, nowhere = np.full(len(sampled.names), np.nan), np.full((len(sampled.names), 2), np.nan)
    return SurrogateIndices(
        sampled.names,
        nothing,
        nothing,
        nowhere,
        nowhere,
        nowhere,
        nowhere,
        nothing,
        nothing,
        "drawn",
        np.nan,
        np.nan,
        sampled,
        status,
    )
