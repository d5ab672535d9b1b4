"""Worker processes that share the points of a campaign: who gets what, who is late, who has to be replaced."""

from __future__ import annotations

import math
import os
import pickle
import time
from collections import deque
from collections.abc import Generator, Iterator
from contextlib import ExitStack
from multiprocessing.connection import wait
from types import TracebackType

import numpy as np

from levelone.campaign.executors.child import Child
from levelone.campaign.executors.guard import none_of
from levelone.campaign.executors.scratch import scratch
from levelone.campaign.models.protocol import Evaluations, FloatArray, IntArray, Model, failed
from levelone.errors import InputError, LeveloneError
from levelone.status import Status

#: s between two empty answers while nothing comes
TICK = 0.05
#: s, the most that a worker may take to import and open its model
START = 300.0
#: workers that end one after the other before any of them has opened the model
MOST_FAILED_STARTS = 3
#: s, what a worker is given at a time should take about this long, so that it is not idle while its parent commits
GIVEN = 0.1
#: most points that a worker is given at a time
CHUNK = 64


class Pool:
    """Worker processes that hold one model, started when they are needed and replaced when they end.

    Parameters
    ----------
    pickled
        The model, see :func:`pickled_model`.
    responses, levels
        Of the model: number of responses, and of criteria judged.
    workers
        Most processes at a time.
    time_limit
        s, of one evaluation; infinite where there is none.
    opening
        s, by which the first evaluation of a process may exceed the limit, because models open their files at the first. Where
        one was answered, ten times what it took is enough (5 s at least).

    Attributes
    ----------
    stopped
        Set from another thread, it ends :meth:`run` before its time.

    Raises
    ------
    InputError
        From :meth:`run`: the model cannot be opened, or met a mistake of its user.
    LeveloneError
        There is no room for a folder of temporary files. From :meth:`run`: a worker cannot be started, or three in a row ended
        before they had opened the model.
    """

    def __init__(
        self, pickled: bytes, responses: int, levels: int, workers: int, time_limit: float = math.inf, opening: float = 60.0
    ) -> None:
        self._pickled, self._shape = pickled, (responses, levels)
        self._workers, self._limit, self._opening = workers, time_limit, opening
        self.stopped = False
        self._longest_first, self._seconds = 0.0, math.inf
        self._failed_starts = self._started = 0
        self._children: list[Child] = []
        self._kept = ExitStack()
        self._folder = self._kept.enter_context(scratch())

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End every worker, whatever it is doing, and remove what they left."""
        for child in self._children:
            child.close()
        self._children = []
        self._kept.close()

    def run(self, points: FloatArray, chunk: int = CHUNK) -> Generator[tuple[IntArray, Evaluations], None, None]:
        """Indices and answers at ``points`` [n, factors] one by one, in the order in which they come.

        A worker holds at most ``chunk`` points, and as few as take it a tenth of a second; what no empty pair has followed yet is
        no more than that of each worker.
        """
        todo = deque(range(len(points)))
        while (todo or any(child.assigned for child in self._children)) and not self.stopped:
            self._staff(points, todo, chunk)
            ready = wait([child.channel for child in self._children], TICK)
            for child in [each for each in self._children if each.channel in ready]:
                yield from self._read(child, todo)
            # what has been answered is not late, however long ago: this process may have been busy since
            for child in [each for each in self._children if time.monotonic() > self._due(each) and not each.channel.poll()]:
                yield from self._lost(child, todo, Status.TIMED_OUT)
            yield np.empty(0, dtype=np.int64), none_of(*self._shape)

    def _staff(self, points: FloatArray, todo: deque[int], chunk: int) -> None:
        """Give points to the workers that have none, and start workers as long as there are points for them."""
        for child in self._children:
            if child.ready and not child.assigned and todo:
                # fewer towards the end, so that no worker is left with many while others have none
                quick = chunk if self._seconds * chunk < GIVEN else int(GIVEN / self._seconds)
                size = max(1, min(quick, len(todo) // (2 * self._workers - 1)))
                indices = [todo.popleft() for _ in range(size)]
                child.assign(indices, points[indices])
        starting = sum(not child.ready for child in self._children)
        while len(self._children) < self._workers and starting < len(todo):
            self._start()
            starting += 1

    def _start(self) -> None:
        number = len(self._children) + 1
        try:
            self._children.append(Child(self._folder / f"{self._started}", self._pickled))
        except OSError as error:
            raise LeveloneError(f"worker {number} of {self._workers} cannot be started: {error}; use fewer --workers") from None
        self._started += 1

    def _read(self, child: Child, todo: deque[int]) -> Iterator[tuple[IntArray, Evaluations]]:
        """All that a worker has sent: at most what it was given."""
        while True:
            began = child.since
            message = child.receive()
            if message is None:
                yield from self._lost(child, todo, Status.CRASHED)
                return
            kind, *content = message
            if kind == "refused":
                raise InputError(*content)
            if kind == "ready":
                child.ready = True
                self._failed_starts = 0
                return
            if not child.answered:
                child.answered = True
                self._longest_first = max(self._longest_first, child.since - began)
            yield np.array([child.assigned.popleft()]), content[0]
            if not child.assigned:
                self._seconds = child.pace()
            if not child.channel.poll():
                return

    def _due(self, child: Child) -> float:
        """When a worker is late, s of the monotonic clock."""
        if not child.ready:
            return child.since + START
        if not child.assigned:
            return math.inf
        usual = max(5.0, 10.0 * self._longest_first) if self._longest_first else math.inf
        return child.since + self._limit + (0.0 if child.answered else min(self._opening, usual))

    def _lost(self, child: Child, todo: deque[int], status: Status) -> Iterator[tuple[IntArray, Evaluations]]:
        """Take leave of a worker: what it was at has failed, and what it had not begun goes to others."""
        self._children.remove(child)
        seconds = time.monotonic() - child.since
        text = child.end(overdue=status is Status.TIMED_OUT)
        if not child.ready:
            self._failed_starts += 1
            if self._failed_starts >= MOST_FAILED_STARTS:
                raise LeveloneError(f"worker processes end before they can open the model: {text}")
        if child.assigned:
            index = child.assigned.popleft()
            todo.extendleft(reversed(child.assigned))
            yield np.array([index]), failed(status, text, *self._shape, seconds)


def pickled_model(model: Model) -> bytes:
    """A model as it travels to a worker.

    Raises
    ------
    InputError
        It cannot travel.
    """
    try:
        return pickle.dumps(model, protocol=pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        raise InputError("model", f"cannot be sent to a worker process: {type(error).__name__}: {error}") from None


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
