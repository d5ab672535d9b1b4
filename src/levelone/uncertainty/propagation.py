"""What a sample of runs says about a response: spread, shares of categories, agreement of rankings, failures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import beta, mannwhitneyu, rankdata

from levelone.errors import InputError
from levelone.uncertainty.bootstrap import CONFIDENCE
from levelone.uncertainty.distributions import FloatArray

QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)


@dataclass(frozen=True, eq=False)
class Summary:
    """Statistics of one response over the runs that did not fail; NaN where too few are left.

    ``n`` runs in all, of which ``failed`` are undefined; ``std`` has the divisor n - 1; ``quantiles`` at
    :data:`QUANTILES`.
    """

    n: int
    failed: int
    mean: float
    std: float
    min: float
    max: float
    quantiles: FloatArray


def summarize(values: ArrayLike) -> Summary:
    """Statistics of one response [n], NaN where a run failed."""
    array = np.asarray(values, dtype=np.float64)
    finite = array[np.isfinite(array)]
    failed = array.size - finite.size
    if not finite.size:
        return Summary(array.size, failed, np.nan, np.nan, np.nan, np.nan, np.full(len(QUANTILES), np.nan))
    return Summary(
        array.size,
        failed,
        mean=float(finite.mean()),
        std=float(finite.std(ddof=1)) if finite.size > 1 else np.nan,
        min=float(finite.min()),
        max=float(finite.max()),
        quantiles=np.quantile(finite, QUANTILES),
    )


@dataclass(frozen=True, eq=False)
class Shares:
    """Shares of a sample in named categories, with 95 % intervals.

    ``counts`` [c], ``share`` [c], ``ci`` [c, 2]; ``n`` is the number of all runs, those that failed included where
    they have a category.
    """

    names: tuple[str, ...]
    counts: NDArray[np.int64]
    share: FloatArray
    ci: FloatArray
    n: int


def shares(categories: Sequence[str], names: Sequence[str]) -> Shares:
    """Share of each category, with the interval of Clopper and Pearson (Biometrika 26, 1934, 404-413).

    Its coverage is at least the nominal one for independent runs; a Latin hypercube makes it wider than needed.

    Parameters
    ----------
    categories
        Category of each run, [n].
    names
        Every category that may occur, in the order of the result.

    Raises
    ------
    InputError
        No run, or a category that is not among the names.
    """
    labels = np.asarray(categories)
    if labels.size == 0:
        raise InputError("categories", "no run to take shares of")
    unknown = sorted(set(labels.tolist()) - set(names))
    if unknown:
        raise InputError("categories", f"{unknown[0]!r} is not among {', '.join(names)}")
    counts = np.array([(labels == name).sum() for name in names], dtype=np.int64)
    n, tail = labels.size, 0.5 * (1.0 - CONFIDENCE)
    with np.errstate(invalid="ignore"):
        low = np.where(counts > 0, beta.ppf(tail, np.maximum(counts, 1), n - counts + 1), 0.0)
        high = np.where(counts < n, beta.ppf(1.0 - tail, counts + 1, np.maximum(n - counts, 1)), 1.0)
    return Shares(tuple(names), counts, counts / n, np.column_stack([low, high]), n)


def rank_agreement(first: ArrayLike, second: ArrayLike) -> float:
    """Spearman's rank correlation of two sets of indices of the same factors (mu_star and ST); NaN where undefined."""
    pair = np.array([first, second], dtype=np.float64)
    if not np.isfinite(pair).all() or pair.shape[1] < 3 or (np.ptp(pair, axis=1) == 0.0).any():
        return float("nan")
    ranks = rankdata(pair, axis=1)
    return float(np.corrcoef(ranks[0], ranks[1])[0][1])


@dataclass(frozen=True, eq=False)
class FailureCorner:
    """In which part of the factor box runs failed, for each of k factors.

    Attributes
    ----------
    names
        Names of the factors.
    failed, n
        Failed runs and all runs.
    mean_failed, mean_all
        [k] mean unit coordinate of the failed and of all runs; NaN where none failed.
    p_value
        [k] two-sided rank test (Mann and Whitney) of failed against the other runs. One value for each factor:
        multiply by k before reading any of them as evidence. NaN where every run or none failed.
    """

    names: tuple[str, ...]
    failed: int
    n: int
    mean_failed: FloatArray
    mean_all: FloatArray
    p_value: FloatArray


def failure_corner(unit_points: ArrayLike, failed: ArrayLike, names: Sequence[str]) -> FailureCorner:
    """Where failures lie: unit coordinates [n, k] of a sample, and which runs failed [n]."""
    points, mask = np.asarray(unit_points, dtype=np.float64), np.asarray(failed, dtype=bool)
    if points.shape != (mask.size, len(names)):
        raise InputError("unit_points", f"shape {points.shape}; [{mask.size}, {len(names)}] is needed")
    count, mean_all = int(mask.sum()), points.mean(axis=0)
    mean_failed = points[mask].mean(axis=0) if count else np.full(len(names), np.nan)
    if 0 < count < mask.size:
        p_value = mannwhitneyu(points[mask], points[~mask], axis=0).pvalue
    else:
        p_value = np.full(len(names), np.nan)
    return FailureCorner(tuple(names), count, mask.size, mean_failed, mean_all, p_value)
