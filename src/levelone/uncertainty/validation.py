"""How far a Kriging model can be believed: predictions of runs that it has not seen, and whether their errors are as it claims."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import binom

from levelone.errors import InputError
from levelone.uncertainty.bootstrap import CONFIDENCE
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import EstimateStatus
from levelone.uncertainty.groups_out import random_groups, without_groups
from levelone.uncertainty.kriging import Kriging
from levelone.uncertainty.seeds import stage_seed

NORMAL_95 = 1.96
HELD_OUT = 5
"""One run in so many is held out for the honest test."""
GOOD_Q2, POOR_Q2 = 0.9, 0.5
"""Below the first the surrogate's own error is no detail, below the second it explains less than it leaves."""
FLATTERED = 0.1
"""Leave-one-out Q2 above the honest one by more than this: the hyperparameters hang on a few runs."""
_DOUBT = 0.01  # probability below which a share of residuals inside 1.96 standard deviations counts as off


@dataclass(frozen=True, eq=False)
class Validation:
    """What a surrogate of n runs says about itself.

    Attributes
    ----------
    q2_loo
        1 - (squared leave-one-out residuals) / (squares about the mean), hyperparameters held.
    q2_folds
        The same for runs left out in groups, hyperparameters held.
    q2_holdout
        The same for a random fifth of the runs, squares about the mean of the others, from a model whose hyperparameters are
        estimated on the others: the honest one, and the noisiest. NaN where an input never varies among the others.
    standardised
        [n] leave-one-out residuals over their standard deviations; standard normal for a model that is right.
    coverage_95
        Share of them within 1.96.
    spread
        Their root mean square; above 1 the model claims too small an error.
    verdict
        What speaks against the surrogate, in words; empty where nothing does. See :func:`validate`.
    status
        ``CONSTANT_RESPONSE`` or ``TOO_FEW_RUNS``: every number above is NaN.
    """

    q2_loo: float
    q2_folds: float
    q2_holdout: float
    standardised: FloatArray
    coverage_95: float
    spread: float
    verdict: str
    status: EstimateStatus


def validate(x: ArrayLike, y: ArrayLike, model: Kriging, seed: int, *, folds: int = 10) -> Validation:
    """Validate a Kriging model on its own runs.

    The verdict names, where it holds: a Q2 (the lowest of the three) below 0.5 or 0.9; a leave-one-out Q2 more than 0.1 above that
    of the held-out fifth; a share of standardised residuals within 1.96 that a binomial variable of n trials and probability 0.95
    reaches, on its side, with a probability below 0.005. Leave-one-out residuals are not independent, so that this is a rule and
    not a test of known size.

    Parameters
    ----------
    x, y
        [n, k], [n]: the runs that ``model`` was fitted to.
    model
        From :meth:`levelone.uncertainty.kriging.Kriging.fit`.
    seed
        Seed of the groups, of the held-out runs and of the search on the others.
    folds
        Groups left out in turn; at most n are made.

    Raises
    ------
    InputError
        Runs that are not those of the model, fewer than two folds.
    """
    x, y = model.require_runs(x, y)
    if folds < 2:
        raise InputError("folds", f"{folds!r}; at least two groups of runs are needed")
    if model.status is not EstimateStatus.OK:
        return Validation(*(np.nan,) * 3, np.full(len(y), np.nan), np.nan, np.nan, model.status.text, model.status)
    rng = np.random.default_rng(stage_seed(seed, "folds of the validation"))
    q2_folds = _folds(x, y, model, min(folds, len(y)), rng)
    q2_holdout = _holdout(x, y, model, seed)
    standardised = model.loo_residual / model.loo_std
    within, spread = np.abs(standardised) <= NORMAL_95, float(np.sqrt(np.mean(standardised**2)))
    words = [_on_q2(model.q2, q2_folds, q2_holdout), _on_coverage(int(within.sum()), len(y), spread)]
    verdict = "; ".join(word for word in words if word)
    return Validation(model.q2, q2_folds, q2_holdout, standardised, float(within.mean()), spread, verdict, EstimateStatus.OK)


def _folds(x: FloatArray, y: FloatArray, model: Kriging, folds: int, rng: np.random.Generator) -> float:
    """Q2 of groups of runs predicted from the others; NaN where a group leaves too few for the trend."""
    groups = random_groups(len(y), folds, rng)
    if len(y) - max(map(len, groups)) < model.trend_terms + 2:
        return float("nan")
    reduced = without_groups(x, y, model, groups).predict_mean(x)
    squares = sum(float(np.sum((y[group] - reduced[group, g]) ** 2)) for g, group in enumerate(groups))
    return 1.0 - squares / float(np.sum((y - y.mean()) ** 2))


def _holdout(x: FloatArray, y: FloatArray, model: Kriging, seed: int) -> float:
    """Q2 of a random fifth of the runs from a model fitted anew to the others."""
    order = np.random.default_rng(stage_seed(seed, "runs held out")).permutation(len(y))
    held, kept = order[: len(y) // HELD_OUT], np.sort(order[len(y) // HELD_OUT :])
    if not held.size or (np.ptp(x[kept], axis=0) == 0.0).any():
        return float("nan")
    search = stage_seed(seed, "search without the runs held out")
    other = Kriging.fit(x[kept], y[kept], search, correlation=model.correlation, trend=model.trend, nugget=model.nugget > 0.0)
    about = float(np.sum((y[held] - y[kept].mean()) ** 2))
    if other.status is not EstimateStatus.OK or about == 0.0:
        return float("nan")
    return 1.0 - float(np.sum((y[held] - other.predict_mean(x[held])) ** 2)) / about


def _on_q2(loo: float, folds: float, holdout: float) -> str:
    least = float(np.nanmin([loo, folds, holdout]))
    if least < POOR_Q2:
        return f"the surrogate explains less than half of the variance of unseen runs (Q2 {least:.2f}): do not use its indices"
    if loo - holdout > FLATTERED:
        return f"Q2 falls from {loo:.2f} to {holdout:.2f} when the length scales are estimated without the runs predicted: add runs"
    if least < GOOD_Q2:
        return f"the surrogate leaves more than a tenth of the variance of unseen runs (Q2 {least:.2f}): add runs"
    return ""


def _on_coverage(within: int, n: int, spread: float) -> str:
    found = f"{within} of {n} runs lie within 1.96 standard deviations of their prediction"
    if binom.cdf(within, n, CONFIDENCE) < 0.5 * _DOUBT:
        return f"{found}: its errors are larger than it claims (root mean square {spread:.2f} of the claim)"
    if binom.sf(within - 1, n, CONFIDENCE) < 0.5 * _DOUBT:
        return f"{found}: its errors are smaller than it claims (root mean square {spread:.2f} of the claim): on the safe side"
    return ""
