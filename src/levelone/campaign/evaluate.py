"""The evaluations of a campaign: what the store holds is not run again, what is run is kept, and all comes back in order."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from levelone.campaign.executors.guard import none_of, with_histories
from levelone.campaign.models.protocol import Evaluations, FloatArray, IntArray, Model, joined
from levelone.campaign.progress import Tally
from levelone.campaign.store_reader import outcomes, plain_points, status_text, unanswered
from levelone.campaign.store_schema import StoreError
from levelone.errors import InputError, LeveloneError
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.campaign.evaluation_store import EvaluationStore
    from levelone.campaign.executors import Executor
    from levelone.campaign.history_store import HistoryStore

#: s after which answers are committed that come without a pause
COMMIT = 0.2
#: s between two calls of the progress function
REPORT = 0.1


class CampaignInterrupted(LeveloneError):
    """The campaign was stopped from the keyboard; what had been answered is kept.

    Parameters
    ----------
    done, total
        Evaluations that are kept, and all of them.
    stored
        Whether there is a store that keeps them.
    """

    exit_code = 130

    def __init__(self, done: int, total: int, stored: bool = True) -> None:
        kept = "those are kept: repeat the command with --resume to go on" if stored else "none is kept: there is no store"
        super().__init__(f"interrupted after {done} of {total} evaluations; {kept}")
        self.done, self.total, self.stored = done, total, stored


def evaluate(
    model: Model,
    points: FloatArray,
    store: EvaluationStore | None,
    executor: Executor,
    progress: Callable[[Tally], None] = lambda tally: None,
    *,
    retry_failed: bool = False,
    records: HistoryStore | None = None,
) -> Evaluations:
    """What a model answers at points, in their order, whatever the executor.

    An evaluation without any answer (:func:`levelone.campaign.store_reader.unanswered`) is repeated as often as the executor's
    ``retries`` say, after all others; the last attempt stands.

    Parameters
    ----------
    model
        Any model.
    points
        [n, factors]; a point that comes twice is evaluated once.
    store
        Where evaluations are looked up and kept; None to keep nothing. Histories are then not given back.
    executor
        Who runs the model.
    progress
        Told how far the campaign is, after evaluations have been committed.
    retry_failed
        Run those again that the store holds without any answer.
    records
        Where the time histories of a model that keeps them go; only with a store.

    Raises
    ------
    InputError
        The model's files have changed since the store was opened: what they answer has no place in it.
    CampaignInterrupted
        Ctrl-C; what had been answered is in the store.
    LeveloneError
        The model cannot be opened, the store cannot be written, the workers are gone. What had been answered is in the store.
    """
    rows = plain_points(points)
    first: dict[bytes, int] = {}
    which = np.array([first.setdefault(row.tobytes(), len(first)) for row in rows], dtype=np.int64)
    distinct = rows[np.unique(which, return_index=True)[1]]
    ledger = Ledger(model, distinct, store, progress, retry_failed, records)
    try:
        _run(model, ledger, executor)
    except KeyboardInterrupt:
        ledger.commit()
        raise CampaignInterrupted(ledger.done, len(distinct), store is not None) from None
    except StoreError:
        raise
    except BaseException:
        ledger.commit()
        raise
    return ledger.in_order().select(which)


def _run(model: Model, ledger: Ledger, executor: Executor) -> None:
    todo, attempt = ledger.missing(), 1
    while todo.size:
        again: list[IntArray] = []
        with closing(executor.run(model, ledger.points[todo])) as answers:
            for index, answer in answers:
                repeat = unanswered(answer.status) & (attempt <= executor.retries)
                again.append(todo[index[repeat]])
                ledger.take(todo[index[~repeat]], answer.select(~repeat) if repeat.any() else answer, attempt)
        ledger.commit()
        todo, attempt = np.sort(np.concatenate(again)), attempt + 1
    if (lost := ledger.missing()).size:
        raise LeveloneError(f"{lost.size} evaluations were not answered by {type(executor).__name__}; the first is {lost[0]}")


class Ledger:
    """What has been answered, what of it is in the store, and when the rest is committed.

    All that is at hand is committed together, as soon as the executor says that there is no more: workers go on meanwhile.

    Parameters
    ----------
    model, store, progress, retry_failed, records
        See :func:`evaluate`.
    points
        [n, factors], all different.
    """

    def __init__(
        self,
        model: Model,
        points: FloatArray,
        store: EvaluationStore | None,
        progress: Callable[[Tally], None],
        retry_failed: bool,
        records: HistoryStore | None = None,
    ) -> None:
        self.points, self.done = points, 0
        self._model, self._store, self._records = model, store, records
        self._progress, self._retry_failed = progress, retry_failed
        self._parts = [none_of(len(model.names), len(model.judged))]
        self._indices: list[IntArray] = [np.empty(0, dtype=np.int64)]
        self._pending: list[tuple[IntArray, Evaluations, int]] = []
        self._held = np.zeros(len(points), dtype=bool)
        self._failed: Counter[int] = Counter()
        self._reused = 0
        if store is not None:
            found, held = store.lookup(points, retry_failed=retry_failed)
            self._keep(np.flatnonzero(found), held)
            self._reused = self.done
        self._began = time.monotonic()
        self._due, self._next_report = self._began + COMMIT, 0.0
        self._report()

    def missing(self) -> IntArray:
        """Indices of the points without an answer."""
        return np.flatnonzero(~self._held)

    def take(self, index: IntArray, answer: Evaluations, attempt: int) -> None:
        """Take answers at points ``index`` [n]; commit what is pending where there are none, or where it is time."""
        if index.size:
            self._pending.append((index, answer, attempt))
        if not index.size or time.monotonic() >= self._due:
            self.commit()

    def commit(self) -> None:
        """Bring all that is pending into the store, and count it."""
        if not self._pending:
            return
        index = np.concatenate([each[0] for each in self._pending])
        answer = joined(with_histories([each[1] for each in self._pending]))
        attempts = np.concatenate([np.full(each[0].size, each[2]) for each in self._pending])
        if self._store is not None:
            self._check_unchanged()
            if self._records is not None and answer.histories:  # first: an evaluation in the store is not run again
                self._records.add(self._store.keys(self.points[index]), answer.histories)
            self._store.add(self.points[index], answer, attempts, replace_failed=self._retry_failed)
            answer = replace(answer, histories=())
        # only now: an interrupt before this line leaves them pending, and the store takes the same answer twice
        self._pending.clear()
        self._keep(index, answer)
        ended = time.monotonic()
        self._due = ended + COMMIT
        if ended >= self._next_report or self.done == len(self.points):
            self._next_report = ended + REPORT
            self._report()

    def _check_unchanged(self) -> None:
        """Refuse to keep answers of files that are not those under whose hash they would be found."""
        if self._store is not None and not self._store.is_of(self._model.key):
            raise InputError(
                "model", "its files have changed since the campaign began; what was answered since the last commit is not kept: "
                "leave them as they are and repeat the command",
            )  # fmt: skip

    def in_order(self) -> Evaluations:
        """All answers in the order of the points."""
        return joined(with_histories(self._parts)).select(np.argsort(np.concatenate(self._indices)))

    def _keep(self, index: IntArray, answer: Evaluations) -> None:
        if self._held[index].any():
            raise LeveloneError("an evaluation was answered twice")
        self._held[index] = True
        self._indices.append(index)
        self._parts.append(answer)
        self.done += index.size
        codes, counts = np.unique(outcomes(answer.status), return_counts=True)
        self._failed.update({int(code): int(n) for code, n in zip(codes, counts, strict=True) if code != Status.OK})

    def _report(self) -> None:
        run, elapsed = self.done - self._reused, time.monotonic() - self._began
        rate = run / elapsed if run and elapsed > 0.0 else math.nan
        left = len(self.points) - self.done
        failures = {status_text(code): n for code, n in sorted(self._failed.items())}
        self._progress(Tally(self.done, len(self.points), self._reused, failures, rate, left / rate))
