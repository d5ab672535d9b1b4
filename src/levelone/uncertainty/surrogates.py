"""Kriging of several responses side by side, in threads with one BLAS thread each."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from levelone.errors import InputError, unknown_name
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.correlation import Correlation
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import check_policy
from levelone.uncertainty.kriging import Kriging, Trend

Item = TypeVar("Item")
Result = TypeVar("Result")


def fit_all(
    x: ArrayLike,
    y: ArrayLike,
    seed: int,
    *,
    workers: int | None = None,
    policy: Literal["refuse", "drop"] = "refuse",
    correlation: Correlation | Literal["likeliest"] = "likeliest",
    trend: Trend = "constant",
    nugget: bool = True,
    starts: int = 6,
    progress: Callable[[], None] | None = None,
) -> tuple[Kriging, ...]:
    """One Kriging model for each column of y.

    Parameters
    ----------
    x
        [n, k] inputs.
    y
        [n, m] responses, NaN where a run failed.
    seed
        Every response starts its search from the same points: a response added or left out changes no other.
    workers
        Threads; the number of available cores by default. It changes no digit of the result.
    policy
        "refuse" failed runs, or "drop" them from the response in which they failed. For bounding values fit the
        columns of :func:`levelone.uncertainty.failures.bounding_values`.
    correlation, trend, nugget, starts
        As for :meth:`Kriging.fit`.
    progress
        Called after each response, from the thread that fitted it.

    Raises
    ------
    InputError
        As :meth:`Kriging.fit`, and failed runs under "refuse".
    """
    inputs, responses = np.asarray(x, dtype=np.float64), np.array(y, dtype=np.float64)
    if responses.ndim != 2 or inputs.ndim != 2 or len(inputs) != len(responses):
        raise InputError("x, y", f"shapes {inputs.shape} and {responses.shape}; [n, k] and [n, m] are needed")
    if policy not in ("refuse", "drop"):
        raise unknown_name("policy", policy, ("refuse", "drop"))
    responses[~np.isfinite(responses)] = np.nan
    for column in responses.T:
        check_policy(policy, column)

    def fit(column: FloatArray) -> Kriging:
        kept = ~np.isnan(column)
        if kept.any() and not kept.all() and (np.ptp(inputs[kept], axis=0) == 0.0).any():
            kept[:] = False  # the failures left an input that never varies: too few runs, and no error in a batch
        model = Kriging.fit(inputs[kept], column[kept], seed, correlation=correlation, trend=trend, nugget=nugget, starts=starts)
        if progress is not None:
            progress()
        return model

    return tuple(_side_by_side(fit, list(responses.T), workers))


def predict_all(models: Sequence[Kriging], x: ArrayLike, *, workers: int | None = None) -> FloatArray:
    """Means of m models at x [n, k], shape [n, m], the models side by side in threads."""
    points = np.ascontiguousarray(x, dtype=np.float64)
    columns = _side_by_side(lambda model: model.predict_mean(points), models, workers)
    return np.column_stack(columns) if columns else np.empty((len(points), 0))


def _side_by_side(call: Callable[[Item], Result], items: Sequence[Item], workers: int | None) -> list[Result]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads = max(1, min(workers if workers is not None else cores, len(items)))
    with OneBlasThread(), ThreadPoolExecutor(threads) as pool:
        return list(pool.map(call, items))
