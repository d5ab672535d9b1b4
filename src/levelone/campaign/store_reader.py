"""Rows of the store of a campaign, and the arrays they stand for."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.models.protocol import STANDS, Evaluations, FloatArray, IntArray
from levelone.campaign.store_schema import refusing
from levelone.errors import InputError
from levelone.status import Status

#: no answer of the model, against an answer that no criterion can read
NO_ANSWER = (Status.MODEL_FAILED, Status.TIMED_OUT, Status.CRASHED, Status.OUTPUT_MISSING, Status.OUTPUT_NOT_FINITE)
#: columns of a row that :func:`decoded` reads
COLUMNS = "key, point, response, status, level, seconds, message, checksum"

_REAL, _STATUS, _LEVEL = np.dtype("<f8"), np.dtype("<i2"), np.dtype("<i1")


@dataclass(frozen=True)
class StoredModel:
    """A model of which the store holds evaluations.

    Parameters
    ----------
    id
        Its row.
    hash
        SHA-256 of all that decides its values, see :func:`model_hash`.
    key
        That content, as the model gave it.
    names, units
        The m responses.
    judged
        The c criteria that have a Level.
    factors
        The k factors, the columns of a point.
    """

    id: int
    hash: str
    key: Mapping[str, Any]
    names: tuple[str, ...]
    units: tuple[str, ...]
    judged: tuple[str, ...]
    factors: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Stored:
    """Evaluations of one model as the store holds them, in the order of their points.

    Parameters
    ----------
    model
        The model.
    points
        [n, k], in the units that the model was given.
    evaluations
        n, without histories.
    attempts
        [n] times that the model was run at the point.
    finished
        [n] seconds since 1970 in UTC.
    studies
        n hashes of the study that asked first.
    """

    model: StoredModel
    points: FloatArray
    evaluations: Evaluations
    attempts: IntArray
    finished: FloatArray
    studies: tuple[str, ...]


def model_hash(
    key: Mapping[str, Any], names: Sequence[str], units: Sequence[str], judged: Sequence[str], factors: Sequence[str]
) -> str:
    """SHA-256 of everything that decides what a stored row means: the model's key, its responses, criteria and factors."""
    return _hash_of(model_texts(key, names, units, judged, factors))


def model_texts(
    key: Mapping[str, Any], names: Sequence[str], units: Sequence[str], judged: Sequence[str], factors: Sequence[str]
) -> tuple[str, ...]:
    """The five as JSON, as the store holds them."""
    return tuple(json.dumps(each, sort_keys=True) for each in (key, *map(list, (names, units, judged, factors))))


def _hash_of(texts: Sequence[str]) -> str:
    return hashlib.sha256("\n".join(texts).encode("utf-8")).hexdigest()


def content_keys(model: str, points: FloatArray) -> list[bytes]:
    """SHA-256 of a model's hash and each point [n, k], by its bits; the two zeros are one.

    Raises
    ------
    InputError
        A point is not finite.
    """
    rows = plain_points(points)
    if not np.isfinite(rows).all():
        row = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise InputError("points", f"point {row} is {rows[row].tolist()}: every factor needs a finite value")
    start = hashlib.sha256(bytes.fromhex(model))
    keys = []
    for row in rows:
        whole = start.copy()
        whole.update(row)
        keys.append(whole.digest())
    return keys


def plain_points(points: FloatArray) -> FloatArray:
    """Points as they are hashed and stored: little-endian, in order of rows, without negative zeros."""
    return np.ascontiguousarray(np.asarray(points, dtype=_REAL) + 0.0)


def outcomes(status: IntArray) -> IntArray:
    """One code for each evaluation [n] of statuses [n, m]: the failure nearest to its beginning, OK where every value stands.

    Codes of the run are lower than those of the measurement on it, so that the lowest failure is the first cause.
    """
    failed = ~np.isin(status, STANDS)
    most = np.iinfo(np.int64).max
    first = np.where(failed, status, most).min(axis=1, initial=most)
    return np.where(failed.any(axis=1), first, int(Status.OK))


def unanswered(status: IntArray) -> NDArray[np.bool_]:
    """Evaluations [n] of which a response is missing because the model did not answer: those that another attempt may repair.

    One response is enough: where several runs make an evaluation, one of them may have timed out or crashed alone.
    """
    return np.isin(status, [int(code) for code in NO_ANSWER]).any(axis=1)


def status_text(code: int) -> str:
    """A status in words; a code of another version as its number."""
    try:
        return Status(code).text
    except ValueError:
        return f"status {code}, which this version of levelone does not know"


def status_name(code: int) -> str:
    """A status in a word or two, for columns and legends."""
    try:
        return Status(code).name.lower().replace("_", " ")
    except ValueError:
        return f"status {code}"


def encoded(keys: Sequence[bytes], points: FloatArray, evaluations: Evaluations) -> list[tuple[Any, ...]]:
    """Columns of :data:`COLUMNS` for each evaluation."""
    values = np.ascontiguousarray(evaluations.values, dtype=_REAL)
    status = _narrow(evaluations.status, _STATUS)
    levels = _narrow(evaluations.levels, _LEVEL)
    texts = [text.replace("\0", "\ufffd").encode("utf-8", "replace").decode("utf-8") for text in evaluations.messages]
    rows = zip(keys, plain_points(points), values, status, levels, evaluations.seconds.tolist(), texts, strict=True)
    out = []
    for key, *arrays, seconds, text in rows:
        cells = (key, *(array.tobytes() for array in arrays))
        out.append((*cells, seconds, text, _checksum(cells)))
    return out


def decoded(rows: Sequence[Sequence[Any]], shape: tuple[int, int, int]) -> tuple[FloatArray, Evaluations]:
    """Points and evaluations of rows whose columns are :data:`COLUMNS`, for so many factors, responses and criteria.

    Raises
    ------
    ValueError
        A row has another size, or is not what was written: a bit has changed.
    """
    if any(_checksum(row[:5]) != row[7] for row in rows):
        raise ValueError("a row is not as it was written")
    columns = zip(*(row[:8] for row in rows), strict=True) if rows else ((),) * 8
    _, point, response, status, level, seconds, messages, _ = columns
    if not all(isinstance(text, str) for text in messages):
        raise ValueError("a message is no text")
    evaluations = Evaluations(
        matrix(response, _REAL, shape[1]).astype(np.float64),
        matrix(status, _STATUS, shape[1]).astype(np.int64),
        matrix(level, _LEVEL, shape[2]).astype(np.int64),
        np.array([np.nan if each is None else each for each in seconds], dtype=np.float64),
        tuple(messages),
    )
    return matrix(point, _REAL, shape[0]).astype(np.float64), evaluations


def _checksum(cells: Sequence[bytes]) -> int:
    return crc32(b"".join(cells))


def matrix(blobs: Sequence[bytes], kind: np.dtype[Any], width: int) -> NDArray[Any]:
    """Rows [n, width] of binary cells; ValueError where one has another size."""
    if any(len(blob) != width * kind.itemsize for blob in blobs):
        raise ValueError(f"a cell holds another number of values than {width}")
    return np.frombuffer(b"".join(blobs), dtype=kind).reshape(len(blobs), width)


def _narrow(codes: IntArray, kind: np.dtype[Any]) -> NDArray[Any]:
    narrow = np.ascontiguousarray(codes, dtype=kind)
    if not np.array_equal(narrow, codes):
        raise ValueError(f"a code does not fit into {kind.itemsize} bytes")
    return narrow


def stored_models(connection: sqlite3.Connection, path: Path) -> list[StoredModel]:
    """The models that have evaluations, the one evaluated last first."""
    query = (
        "SELECT id, hash, key, names, units, judged, factors FROM model JOIN "
        "(SELECT model, max(id) AS last FROM evaluation GROUP BY model) ON model = model.id ORDER BY last DESC"
    )
    with refusing(path):
        rows = connection.execute(query).fetchall()
    models = []
    for row, digest, *texts in rows:
        if _hash_of(texts) != digest:
            raise InputError(str(path), "is damaged: the description of a model is not as it was written")
        key, *lists = map(json.loads, texts)
        models.append(StoredModel(row, digest, key, *map(tuple, lists)))
    return models


def read_stored(connection: sqlite3.Connection, path: Path, model: StoredModel, *, planned: bool = False) -> Stored:
    """Evaluations of a model, sorted by their points: the order in which they were finished is chance.

    Parameters
    ----------
    connection, path
        From :func:`levelone.campaign.store_schema.open_to_read`.
    model
        One of :func:`stored_models`.
    planned
        Only those that the study that ran last needs.

    Raises
    ------
    InputError
        A row does not hold what its model says.
    """
    query = (
        f"SELECT {COLUMNS}, attempts, finished, coalesce(study.hash, '') "
        "FROM evaluation LEFT JOIN study ON study.id = evaluation.study WHERE evaluation.model = ?"
    )
    if planned:
        query += " AND evaluation.key IN (SELECT key FROM plan)"
    with refusing(path):
        rows = connection.execute(query, (model.id,)).fetchall()
    try:
        points, found = decoded(rows, (len(model.factors), len(model.names), len(model.judged)))
        attempts = np.array([row[8] for row in rows], dtype=np.int64)
        finished = np.array([row[9] for row in rows], dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(str(path), f"is damaged: {error}") from None
    order = np.lexsort(points.T[::-1]) if points.size else np.arange(len(rows))
    return Stored(
        model, points[order], found.select(order), attempts[order], finished[order], tuple(str(rows[i][10]) for i in order)
    )
