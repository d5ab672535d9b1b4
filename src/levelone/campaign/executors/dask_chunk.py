"""What a Dask worker does with a chunk of a campaign: it hands it to a process of its own, which it keeps for the next.

A model that crashes or hangs then costs that process, and the Dask worker stays.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from levelone._version import __version__
from levelone.campaign.executors.guard import none_of, with_histories
from levelone.campaign.executors.pool import Pool
from levelone.campaign.models.protocol import Evaluations, FloatArray, IntArray, joined
from levelone.errors import InputError, LeveloneError


@dataclass(frozen=True)
class Job:
    """What all chunks of a campaign have in common.

    Parameters
    ----------
    version
        Of levelone where the campaign was started.
    key
        Names the campaign: a worker keeps a process for it.
    pickled
        The model.
    responses, levels
        Its number of responses, and of criteria judged.
    time_limit, opening
        s, see :class:`levelone.campaign.executors.pool.Pool`.
    """

    version: str
    key: str
    pickled: bytes
    responses: int
    levels: int
    time_limit: float
    opening: float


@dataclass(frozen=True)
class Answer:
    """Evaluations in the order of the points and the time they took, s; or what the user has to mend: field and problem."""

    evaluations: Evaluations
    seconds: float
    refused: tuple[str, str] | None = None


@dataclass
class _Kept:
    """The process of one thread of a Dask worker; whoever holds the lock may use or end it."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    key: str = ""
    pool: Pool | None = None

    def close(self) -> None:
        if self.pool is not None:
            self.pool.close()
        self.pool = None


_kept: dict[int, _Kept] = {}


def run_chunk(job: Job, points: FloatArray) -> Answer:
    """Answers at ``points`` [n, factors].

    Raises
    ------
    LeveloneError
        This machine has another version of levelone; the model's process cannot be started.
    """
    if job.version != __version__:
        raise LeveloneError(f"the campaign was started with levelone {job.version}, and a worker of the cluster has {__version__}")
    began = time.perf_counter()
    indices: list[IntArray] = []
    parts = [none_of(job.responses, job.levels)]
    try:
        with _pool(job) as pool:
            for index, answer in pool.run(points, len(points)):
                indices.append(index)
                parts.append(answer)
    except InputError as error:
        return Answer(parts[0], 0.0, (error.field, error.problem))
    order = np.argsort(np.concatenate(indices))
    return Answer(joined(with_histories(parts)).select(order), time.perf_counter() - began)


def release(key: str) -> None:
    """End the processes that this Dask worker keeps for a campaign, those at work as well."""
    for kept in list(_kept.values()):
        if kept.key == key and kept.pool is not None:
            kept.pool.stopped = True
            # one that is at work sees it and goes by itself
            if kept.lock.acquire(blocking=False):
                try:
                    kept.close()
                finally:
                    kept.lock.release()


@contextlib.contextmanager
def _pool(job: Job) -> Iterator[Pool]:
    kept = _kept.setdefault(threading.get_ident(), _Kept())
    with kept.lock:
        if kept.pool is None or kept.pool.stopped or kept.key != job.key:
            kept.close()
            kept.key = job.key
            kept.pool = Pool(job.pickled, job.responses, job.levels, 1, job.time_limit, job.opening)
        pool = kept.pool
        try:
            yield pool
        except BaseException:
            pool.stopped = True
            raise
        finally:
            if pool.stopped:
                kept.close()
