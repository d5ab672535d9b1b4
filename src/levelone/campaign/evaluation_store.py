"""The store of a campaign: every evaluation on disk as soon as it is counted, found again by what it is an evaluation of.

A row is found by the SHA-256 of the model (all that is known to decide its values) and of the point. Changing the analysis of a
study or resuming it therefore runs only what is missing; another model, or the same with another file, option or library, finds
nothing.
Only one process writes; whatever was committed survives a kill, a full disk and a loss of power.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.campaign.models.protocol import Evaluations, FloatArray
from levelone.campaign.store_reader import (
    COLUMNS,
    content_keys,
    decoded,
    encoded,
    model_hash,
    model_texts,
    outcomes,
    status_text,
    unanswered,
)
from levelone.campaign.store_schema import now, only_writer, open_to_write, refusing, transaction
from levelone.errors import InputError

#: keys in one query; SQLite before 3.32 takes 999
_AT_ONCE = 900
_INSERT = (
    f"INSERT INTO evaluation ({COLUMNS}, outcome, unanswered, attempts, finished, model, study) "
    f"VALUES ({', '.join('?' * 14)}) ON CONFLICT (key) DO NOTHING"
)
_REPLACE = (
    "UPDATE evaluation SET response = ?, status = ?, level = ?, seconds = ?, message = ?, checksum = ?, outcome = ?, "
    "unanswered = ?, attempts = attempts + ?, finished = ? WHERE key = ?"
)


class EvaluationStore:
    """The evaluations of one model in the file of a campaign; made by :meth:`open`, and to be closed."""

    def __init__(self, connection: sqlite3.Connection, path: Path, model: str, shape: tuple[int, int, int], rows: tuple[int, int]):
        self._connection = connection
        self._path = path
        self._model = model
        self._shape = shape
        self._model_row, self._study_row = rows
        self._exit = ExitStack()
        self._described: tuple[Sequence[str], ...] = ((), (), (), ())

    @classmethod
    def open(
        cls,
        path: Path,
        model_key: Mapping[str, Any],
        names: Sequence[str],
        units: Sequence[str],
        judged: Sequence[str],
        factors: Sequence[str],
        study_hash: str,
        *,
        study_title: str = "",
    ) -> Self:
        """Open the file of a campaign for writing, or create it.

        Parameters
        ----------
        path
            The file, ``DIR/campaign.sqlite``; its folder exists.
        model_key
            All that decides a value, as plain JSON: ``Model.key``.
        names, units
            The m responses.
        judged
            The c criteria that have a Level.
        factors
            The k columns of a point.
        study_hash, study_title
            The study that asks.

        Raises
        ------
        InputError
            Another process writes the campaign; the file is no store, is damaged or has the format of another version.
        StoreError
            The disk is full.
        """
        model = model_hash(model_key, names, units, judged, factors)
        with ExitStack() as stack:
            stack.enter_context(only_writer(path))
            connection = open_to_write(path)
            stack.callback(connection.close)
            with transaction(connection, path):
                texts = model_texts(model_key, names, units, judged, factors)
                rows = (
                    _row(connection, "model", "hash, key, names, units, judged, factors", (model, *texts)),
                    _row(connection, "study", "hash, title, first_seen", (study_hash, study_title, now())),
                )
            store = cls(connection, path, model, (len(factors), len(names), len(judged)), rows)
            store._described = (names, units, judged, factors)
            store._exit = stack.pop_all()
        return store

    def is_of(self, model_key: Mapping[str, Any]) -> bool:
        """Whether this is still the model that the store was opened for: its files may have changed meanwhile."""
        return model_hash(model_key, *self._described) == self._model

    def keys(self, points: FloatArray) -> list[bytes]:
        """Content keys of ``points`` [n, k], as :class:`levelone.campaign.history_store.HistoryStore` reads them.

        Raises
        ------
        InputError
            A point of another size or not finite.
        """
        shape = np.shape(points)
        if len(shape) != 2 or shape[1] != self._shape[0]:
            raise InputError("points", f"have shape {shape}; [n, {self._shape[0]}] is needed")
        return content_keys(self._model, points)

    def plan(self, points: FloatArray) -> None:
        """Note that the study is going to need the evaluations at ``points`` [n, k]; takes the place of an earlier plan.

        For whoever asks how far the campaign is (:func:`levelone.campaign.store_plan.read_plan`); nothing else depends on it.

        Raises
        ------
        InputError
            A point of another size or not finite.
        StoreError
            The disk is full or fails; the earlier plan stays.
        """
        rows = [(key, self._model_row, self._study_row) for key in sorted(set(self.keys(points)))]
        with transaction(self._connection, self._path):
            self._connection.execute("DELETE FROM plan")
            self._connection.executemany("INSERT INTO plan (key, model, study) VALUES (?, ?, ?)", rows)

    def lookup(self, points: FloatArray, *, retry_failed: bool = False) -> tuple[NDArray[np.bool_], Evaluations]:
        """Which of the ``points`` [n, k] are held [n], and what the model answered there, in their order.

        Parameters
        ----------
        points
            [n, k]; the same point may come more than once.
        retry_failed
            Leave out evaluations of which the model left a response unanswered (:func:`unanswered`), so that they are run again.

        Raises
        ------
        InputError
            A point of another size or not finite; a row of the file is damaged.
        """
        keys = self.keys(points)
        held = self._rows(keys, "AND unanswered = 0" if retry_failed else "")
        found = np.array([key in held for key in keys], dtype=bool)
        try:
            return found, decoded([held[key] for key in keys if key in held], self._shape)[1]
        except (TypeError, ValueError) as error:
            raise InputError(str(self._path), f"is damaged: {error}") from None

    def add(self, points: FloatArray, evaluations: Evaluations, attempts: ArrayLike = 1, *, replace_failed: bool = False) -> None:
        """Keep n evaluations in one transaction; when this returns they are on the disk.

        The same evaluation given twice is kept once.

        Parameters
        ----------
        points
            [n, k].
        evaluations
            n; their histories go into a :class:`levelone.campaign.history_store.HistoryStore`, and before this.
        attempts
            [n] or one number: how often the model was run for each.
        replace_failed
            A held evaluation of which a response was left unanswered gives way to the new one, as a whole: an evaluation is never
            put together from two attempts. The attempts are added.

        Raises
        ------
        ValueError
            Another evaluation of the same point is held and may not be replaced, or sizes do not fit.
        InputError
            A point is not finite.
        StoreError
            The disk is full or fails; nothing of this call is kept, and all of the earlier ones.
        """
        keys = self.keys(points)
        _, responses, criteria = self._shape
        if evaluations.values.shape != (len(keys), responses) or evaluations.levels.shape != (len(keys), criteria):
            raise ValueError(f"evaluations of shape {evaluations.values.shape} and {evaluations.levels.shape} do not fit the store")
        judged = zip(outcomes(evaluations.status).tolist(), unanswered(evaluations.status).tolist(), strict=True)
        runs = np.broadcast_to(np.asarray(attempts, dtype=np.int64), len(keys)).tolist()
        finished = time.time()
        data = [
            (*row, *each, count, finished)
            for row, each, count in zip(encoded(keys, points, evaluations), judged, runs, strict=True)
        ]
        with transaction(self._connection, self._path):
            if replace_failed:
                old = self._rows(keys, "AND unanswered = 1")
                self._connection.executemany(_REPLACE, [(*row[2:], row[0]) for row in data if row[0] in old])
            before = self._connection.total_changes
            self._connection.executemany(_INSERT, [(*row, self._model_row, self._study_row) for row in data])
            if self._connection.total_changes - before < len(keys):
                self._agree(data)

    def counts(self) -> dict[str, int]:
        """Number of this model's evaluations by outcome in words, "ok" first; see :func:`outcomes`."""
        query = "SELECT outcome, count(*) FROM evaluation WHERE model = ? GROUP BY outcome ORDER BY outcome"
        with refusing(self._path):
            return {status_text(code): n for code, n in self._connection.execute(query, (self._model_row,))}

    def close(self) -> None:
        """Give up the file and the lock; nothing is pending."""
        self._exit.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _rows(self, keys: Sequence[bytes], condition: str) -> dict[bytes, tuple[Any, ...]]:
        """Key to :data:`COLUMNS` of the rows that are held and meet a condition."""
        wanted = list(dict.fromkeys(keys))
        rows: dict[bytes, tuple[Any, ...]] = {}
        with refusing(self._path):
            last = self._connection.execute("SELECT max(id) FROM evaluation").fetchone()[0] or 0
            if 4 * len(wanted) > last:  # most of the file is asked for: one pass over it takes a third of the time
                query = f"SELECT {COLUMNS} FROM evaluation WHERE model = ? {condition}"
                every = {row[0]: row for row in self._connection.execute(query, (self._model_row,))}
                return {key: every[key] for key in wanted if key in every}
            for some in _parts(wanted):
                query = f"SELECT {COLUMNS} FROM evaluation WHERE key IN ({', '.join('?' * len(some))}) {condition}"
                rows.update((row[0], row) for row in self._connection.execute(query, some))
        return rows

    def _agree(self, data: Sequence[tuple[Any, ...]]) -> None:
        """Refuse to have two answers for one point."""
        held = self._rows([row[0] for row in data], "")
        for i, row in enumerate(data):
            if held[row[0]][:5] != row[:5]:
                raise ValueError(f"{self._path}: another evaluation of point {i} is already held")


def _row(connection: sqlite3.Connection, table: str, columns: str, values: tuple[str, ...]) -> int:
    """Number of the row of a table with this hash, the first of the values; made where there is none."""
    marks = ", ".join("?" * len(values))
    connection.execute(f"INSERT INTO {table} ({columns}) VALUES ({marks}) ON CONFLICT (hash) DO NOTHING", values)
    return int(connection.execute(f"SELECT id FROM {table} WHERE hash = ?", values[:1]).fetchone()[0])


def _parts(keys: list[bytes]) -> Iterable[list[bytes]]:
    return (keys[i : i + _AT_ONCE] for i in range(0, len(keys), _AT_ONCE))
