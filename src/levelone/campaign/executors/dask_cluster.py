"""Evaluation on a Dask cluster: chunks travel as tasks, and a worker that is lost costs time, not results."""

from __future__ import annotations

import contextlib
import math
import queue
import time
import uuid
from collections import deque
from collections.abc import Generator, Iterator
from concurrent.futures import CancelledError
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from levelone._version import __version__
from levelone.campaign.executors.connect import connected
from levelone.campaign.executors.dask_chunk import Answer, Job, release, run_chunk
from levelone.campaign.executors.guard import none_of
from levelone.campaign.executors.pool import TICK, pickled_model
from levelone.campaign.models.protocol import Evaluations, FloatArray, IntArray, Model, failed
from levelone.errors import InputError, LeveloneError
from levelone.status import Status

if TYPE_CHECKING:
    from distributed import Client, Future

    from levelone.config.campaign_table import Cluster

#: s, what a chunk should take: this much of each worker is lost when the campaign is killed
TASK = 0.5
#: chunks under way for each thread of the cluster: one at work, one that waits there
AHEAD = 2
#: s between two looks at how many threads the cluster has
LOOK = 2.0
#: s without any worker, where there were some
GONE = 300.0
LARGEST = 256
ALIVE = ("running", "connecting")
LOST = "the Dask scheduler cannot be reached any more; what came back is kept: start one and repeat the command with --resume"


class _Connection:
    """The client of a cluster, made when it is first asked for."""

    def __init__(self) -> None:
        self._kept = ExitStack()
        self._client: Client | None = None

    def client(self, where: str | Cluster) -> Client:
        if self._client is None:
            self._client = self._kept.enter_context(connected(where))
        return self._client

    def close(self) -> None:
        self._client = None
        self._kept.close()


@dataclass(frozen=True)
class DaskExecutor:
    """The workers of a Dask cluster; each thread of a worker keeps one process in which the model runs.

    A cluster is reached or started by the first run and serves all others, so that a queueing system is asked once for its jobs;
    it ends with :meth:`close`.

    Parameters
    ----------
    where
        HOST:PORT of a scheduler, or the cluster to start.
    time_limit, opening
        s, as of :class:`levelone.campaign.executors.processes.ProcessExecutor`.
    retries
        See :func:`levelone.campaign.evaluate.evaluate`.
    chunk
        Most points in one task; as few as take half a second, where that is less.
    """

    where: str | Cluster
    time_limit: float = math.inf
    retries: int = 0
    chunk: int = LARGEST
    opening: float = 60.0
    _connection: _Connection = field(default_factory=_Connection, init=False, repr=False, compare=False)

    def run(self, model: Model, points: FloatArray) -> Generator[tuple[IntArray, Evaluations], None, None]:
        """Indices and answers, chunk by chunk; see :class:`levelone.campaign.executors.Executor`."""
        shape = len(model.names), len(model.judged)
        job = Job(__version__, uuid.uuid4().hex, pickled_model(model), *shape, self.time_limit, self.opening)
        tasks = _Tasks(self._connection.client(self.where), job, points, self.chunk)
        try:
            yield from tasks.run()
        finally:
            tasks.close()

    def close(self) -> None:
        """Leave the scheduler, and end the cluster where it was started here."""
        self._connection.close()


class _Tasks:
    """The tasks of one campaign on one client."""

    def __init__(self, client: Client, job: Job, points: FloatArray, chunk: int) -> None:
        self._client, self._job, self._points, self._chunk = client, job, points, chunk
        self._todo = deque(range(len(points)))
        self._flying: dict[str, tuple[Future, list[int]]] = {}
        self._done: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._seconds = math.inf
        self._threads, self._looked, self._seen = 1, -math.inf, math.inf

    def run(self) -> Generator[tuple[IntArray, Evaluations], None, None]:
        """Indices and answers; empty ones while nothing comes."""
        while self._todo or self._flying:
            self._look()
            while self._todo and len(self._flying) < AHEAD * self._threads:
                self._submit([self._todo.popleft() for _ in range(self._size())])
            try:
                future = self._done.get(timeout=TICK)
            except queue.Empty:
                yield np.empty(0, dtype=np.int64), none_of(self._job.responses, self._job.levels)
                continue
            _, indices = self._flying.pop(str(future.key))
            yield from self._answered(future, indices)

    def close(self) -> None:
        """Cancel what is under way, and let the workers end the processes that they keep."""
        with contextlib.suppress(Exception):
            self._client.cancel([future for future, _ in self._flying.values()], force=True)
            self._client.run(release, self._job.key, on_error="ignore")

    def _look(self) -> None:
        """Learn how many threads there are, and whether the scheduler is."""
        if self._client.status not in ALIVE:
            raise LeveloneError(LOST)
        now = time.monotonic()
        if now - self._looked <= LOOK:
            return
        self._looked = now
        try:
            threads = sum(self._client.nthreads().values())
        except (OSError, TimeoutError):
            raise LeveloneError(LOST) from None
        # workers that have not come yet may wait in a queue for hours; those that have gone may be replaced
        self._seen = now if threads else self._seen
        if now - self._seen > GONE:
            raise LeveloneError(f"no worker of the Dask cluster is left since {GONE:g} s; repeat the command with --resume")
        self._threads = max(1, threads)

    def _size(self) -> int:
        quick = self._chunk if self._seconds == 0.0 else min(self._chunk, int(TASK / self._seconds))
        return max(1, min(quick, len(self._todo) // (AHEAD * self._threads)))

    def _submit(self, indices: list[int]) -> None:
        future = self._client.submit(run_chunk, self._job, self._points[indices], pure=False)
        self._flying[str(future.key)] = future, indices
        future.add_done_callback(self._done.put)

    def _answered(self, future: Future, indices: list[int]) -> Iterator[tuple[IntArray, Evaluations]]:
        answer = _result(future)
        if isinstance(answer, str):
            if len(indices) > 1:
                # one of them may be the cause: each travels alone
                for index in indices:
                    self._submit([index])
            else:
                yield np.array(indices), failed(Status.CRASHED, answer, self._job.responses, self._job.levels)
        elif answer.refused:
            raise InputError(*answer.refused)
        else:
            self._seconds = answer.seconds / len(indices)
            yield np.array(indices), answer.evaluations


def _result(future: Future) -> Answer | str:
    """What a task answered; a text where it took its workers with it.

    Raises
    ------
    LeveloneError
        The scheduler is gone, or a worker cannot take part.
    """
    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        return f"{error.allowed_failures + 1} Dask workers were lost one after the other, each of them with this evaluation"
    except LeveloneError:
        raise
    except CancelledError:
        raise LeveloneError(LOST) from None
    except (ModuleNotFoundError, AttributeError) as error:
        raise LeveloneError(f"a worker of the Dask cluster cannot import levelone as this process does: {error}") from None
    except Exception as error:
        if future.client.status not in ALIVE:
            raise LeveloneError(LOST) from None
        raise LeveloneError(f"a worker of the Dask cluster failed: {type(error).__name__}: {error}") from None
