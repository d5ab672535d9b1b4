"""Evaluation in this process: for models that answer many points at once and can be trusted not to crash or hang."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from levelone.campaign.executors.guard import Guard
from levelone.campaign.models.protocol import Evaluations, FloatArray, IntArray, Model

#: s, what one call of the model should take: this much is lost when the process is killed
CALL = 0.2
LARGEST = 4096


@dataclass(frozen=True)
class BatchExecutor:
    """In-process evaluation, in calls that grow from one point for as long as they are quick.

    A time limit cannot be kept here: a call that hangs, hangs the campaign, and one that crashes ends it (what was committed
    stays).

    Parameters
    ----------
    chunk
        Most points in one call.
    retries
        See :func:`levelone.campaign.evaluate.evaluate`.
    """

    chunk: int = LARGEST
    retries: int = 0

    def run(self, model: Model, points: FloatArray) -> Generator[tuple[IntArray, Evaluations], None, None]:
        """Indices and answers, call by call; see :class:`levelone.campaign.executors.Executor`."""
        from levelone.uncertainty.blas import OneBlasThread

        guard, first, size = Guard(model), 0, 1
        while first < len(points):
            last, began = min(first + size, len(points)), time.perf_counter()
            # as in the worker processes, so that the last digits agree
            with OneBlasThread():
                answer = guard.evaluate(points[first:last])
            took = time.perf_counter() - began
            yield np.arange(first, last), answer
            yield np.empty(0, dtype=np.int64), answer.select(slice(0))
            size = min(self.chunk, int(2 * size if 2 * took < CALL else max(1, size * CALL / took)))
            first = last

    def close(self) -> None:
        """Nothing is kept."""
