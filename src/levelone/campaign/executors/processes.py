"""Evaluation in worker processes on this machine: a model that crashes or hangs costs one evaluation."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass

from levelone.campaign.executors.pool import CHUNK, Pool, cores, pickled_model
from levelone.campaign.models.protocol import Evaluations, FloatArray, IntArray, Model


@dataclass(frozen=True)
class ProcessExecutor:
    """Worker processes, started afresh and not forked, which end with this one however it ends.

    Parameters
    ----------
    workers
        Number of processes; None for as many as there are cores to use.
    time_limit
        s, of one evaluation: then its process is killed and replaced. The first evaluation of a process may take longer, see
        :class:`levelone.campaign.executors.pool.Pool`.
    retries
        See :func:`levelone.campaign.evaluate.evaluate`.
    chunk
        Most points that a process holds, as few as take a tenth of a second where that is less; they are answered one by one.
    opening
        s, see :class:`levelone.campaign.executors.pool.Pool`.
    """

    workers: int | None = None
    time_limit: float = math.inf
    retries: int = 0
    chunk: int = CHUNK
    opening: float = 60.0

    def run(self, model: Model, points: FloatArray) -> Generator[tuple[IntArray, Evaluations], None, None]:
        """Indices and answers, one by one; see :class:`levelone.campaign.executors.Executor`."""
        shape = len(model.names), len(model.judged)
        with Pool(pickled_model(model), *shape, self.workers or cores(), self.time_limit, self.opening) as pool:
            yield from pool.run(points, self.chunk)

    def close(self) -> None:
        """Nothing is kept: the processes of a run end with it."""
