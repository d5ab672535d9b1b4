"""The file of a campaign: one SQLite database, its tables, its marks, and how it is opened and refused.

SQLite because it is one file that every language reads, whose transactions hold through a kill or a loss of power. The journal is a
rollback journal and never a write-ahead log: that one needs shared memory between processes, which network disks do not have.
``synchronous=FULL`` with ``journal_mode=TRUNCATE`` also syncs the end of each transaction, so that what was committed stays so.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from levelone._version import __version__
from levelone.errors import InputError, LeveloneError

FILE_NAME = "campaign.sqlite"
#: "LVL1" in ASCII: the mark of the format in the header of the file
APPLICATION_ID = 0x4C564C31
#: raised whenever a table changes
FORMAT = 2
#: s that a commit waits for a reader, and a reader for a commit
PATIENCE = 60.0

_TABLES = (
    """CREATE TABLE campaign (
    created TEXT NOT NULL,
    levelone TEXT NOT NULL
)""",
    """CREATE TABLE model (
    id INTEGER PRIMARY KEY,
    hash TEXT NOT NULL UNIQUE,
    key TEXT NOT NULL,
    names TEXT NOT NULL,
    units TEXT NOT NULL,
    judged TEXT NOT NULL,
    factors TEXT NOT NULL
)""",
    """CREATE TABLE study (
    id INTEGER PRIMARY KEY,
    hash TEXT NOT NULL UNIQUE,
    title TEXT NOT NULL,
    first_seen TEXT NOT NULL
)""",
    # A table with row numbers and not WITHOUT ROWID: rows of some 350 bytes are appended in order, and only the short keys, which
    # are random, go to random pages.
    """CREATE TABLE evaluation (
    id INTEGER PRIMARY KEY,
    key BLOB NOT NULL UNIQUE,
    model INTEGER NOT NULL REFERENCES model (id),
    study INTEGER NOT NULL REFERENCES study (id),
    point BLOB NOT NULL,
    response BLOB NOT NULL,
    status BLOB NOT NULL,
    level BLOB NOT NULL,
    outcome INTEGER NOT NULL,
    unanswered INTEGER NOT NULL,
    seconds REAL,
    message TEXT NOT NULL,
    checksum INTEGER NOT NULL,
    attempts INTEGER NOT NULL,
    finished REAL NOT NULL
)""",
    # what the study that ran last is going to need: a key may be here before its evaluation is, or after
    """CREATE TABLE plan (
    key BLOB PRIMARY KEY,
    model INTEGER NOT NULL REFERENCES model (id),
    study INTEGER NOT NULL REFERENCES study (id)
) WITHOUT ROWID""",
)


class StoreError(LeveloneError):
    """What was evaluated could not be kept; everything committed before still is."""


def now() -> str:
    """Date and time in UTC, ISO 8601, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def connect(path: Path, mode: str) -> sqlite3.Connection:
    """A connection in autocommit; ``mode`` is SQLite's: ``"rw"``, or ``"rwc"`` to create the file.

    The path goes in as a URI with every odd character escaped, so that no file name can set an option.
    """
    return sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, isolation_level=None, timeout=PATIENCE)


def open_to_write(path: Path) -> sqlite3.Connection:
    """The database of a campaign, created where there is none.

    Raises
    ------
    InputError
        The file is no store, is damaged, has the format of another version, or cannot be opened; it is left as it is.
    """
    with refusing(path):
        connection = connect(path, "rwc")
        try:
            if _is_empty(connection):
                _settings(connection)
                _create(connection)
            else:
                _check(connection, path)
                _settings(connection)
        except BaseException:
            connection.close()
            raise
    return connection


def open_to_read(path: Path) -> sqlite3.Connection:
    """The database of a campaign for reading, also while another process writes it.

    A connection that may write and is told not to: after a kill SQLite must roll the last transaction back before anybody can read,
    and a connection in mode ``ro`` could not.

    Raises
    ------
    InputError
        There is no such file, or as in :func:`open_to_write`.
    """
    if not path.is_file():
        raise InputError(str(path), "missing: no campaign has been run in this folder")
    with refusing(path):
        connection = connect(path, "rw")
        try:
            if _is_empty(connection):
                raise InputError(str(path), "is empty: no campaign has been run in this folder")
            _check(connection, path)
            connection.execute("PRAGMA query_only = ON")
        except BaseException:
            connection.close()
            raise
    return connection


@contextmanager
def refusing(path: Path) -> Iterator[None]:
    """SQLite's complaints about a file as one line for its user."""
    try:
        yield
    except sqlite3.OperationalError as error:
        raise InputError(str(path), f"cannot be opened or read: {_line(error)}") from None
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:
        raise InputError(
            str(path), f"is no store of a campaign, or is damaged ({_line(error)}); it has been left as it is"
        ) from None


def _line(error: Exception | str) -> str:
    """SQLite's words, which may quote a whole table, in one short line."""
    text = " ".join(str(error).split())
    return text if len(text) <= 120 else f"{text[:117]}..."


@contextmanager
def transaction(connection: sqlite3.Connection, path: Path) -> Iterator[None]:
    """All that is written inside, or nothing.

    Raises
    ------
    StoreError
        The disk is full or fails, or a reader keeps the file for longer than a minute.
    """
    try:
        connection.execute("BEGIN IMMEDIATE")
        yield
        connection.execute("COMMIT")
    except (sqlite3.ProgrammingError, sqlite3.IntegrityError):
        undo(connection)
        raise
    except sqlite3.DatabaseError as error:
        undo(connection)
        full = error.sqlite_errorcode == sqlite3.SQLITE_FULL
        reason = "the disk is full: make room" if full else f"{_line(error)}: put it right"
        raise StoreError(
            f"{path}: cannot be written: {reason}, and run again with --resume; evaluations committed before are kept"
        ) from None
    except BaseException:
        undo(connection)
        raise


def undo(connection: sqlite3.Connection) -> None:
    """Roll back what is not committed; after some errors SQLite has done so itself."""
    with suppress(sqlite3.Error):
        if connection.in_transaction:
            connection.execute("ROLLBACK")


@contextmanager
def only_writer(path: Path) -> Iterator[None]:
    """Keep every other process from writing the same campaign.

    An exclusive SQLite lock on an empty file beside the store: it ends with its process however that ends, is not inherited by a
    forked one, and leaves the store itself open to readers.

    Raises
    ------
    InputError
        Another process, or another store in this one, has the lock.
    """
    guard = path.with_suffix(".lock")
    with refusing(guard):
        connection = connect(guard, "rwc")
    with closing(connection):
        try:
            connection.execute("PRAGMA busy_timeout = 1000")  # :func:`is_written` holds it for an instant
            connection.execute("PRAGMA journal_mode = MEMORY")  # nothing is ever written: no journal is to be left behind
            connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.DatabaseError as error:
            if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_BUSY:
                raise InputError(str(path), "another process is running this campaign: wait for its end, or stop it") from None
            raise InputError(str(guard), f"cannot be locked: {_line(error)}") from None
        yield


def is_written(path: Path) -> bool:
    """Whether a process holds the campaign for writing at this moment."""
    guard = path.with_suffix(".lock")
    if not guard.is_file():
        return False
    with refusing(guard), closing(connect(guard, "rw")) as connection:
        connection.execute("PRAGMA busy_timeout = 0")
        try:
            connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
                return True
            raise
    return False


def _is_empty(connection: sqlite3.Connection) -> bool:
    return connection.execute("PRAGMA page_count").fetchone()[0] == 0


def _settings(connection: sqlite3.Connection) -> None:
    for setting in ("journal_mode = TRUNCATE", "synchronous = FULL", "fullfsync = ON", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {setting}")


def _create(connection: sqlite3.Connection) -> None:
    with closing(connection.cursor()) as cursor:
        cursor.execute("BEGIN EXCLUSIVE")
        for table in _TABLES:
            cursor.execute(table)
        cursor.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        cursor.execute(f"PRAGMA user_version = {FORMAT}")
        cursor.execute("INSERT INTO campaign VALUES (?, ?)", (now(), __version__))
        cursor.execute("COMMIT")


def _check(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse whatever is not a whole store of this format."""
    connection.execute("PRAGMA trusted_schema = OFF")
    mark, version = (connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version"))
    if mark != APPLICATION_ID:
        raise InputError(str(path), "is a database of another application; it has been left as it is")
    if version != FORMAT:
        other = "a newer one" if version > FORMAT else "another folder"
        raise InputError(
            str(path), f"has format {version}, this version of levelone reads {FORMAT}: use the levelone that wrote it, or {other}"
        )
    if _schema(connection) != _wanted():
        raise InputError(str(path), "holds other tables than a store of a campaign; it has been left as it is")
    found = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
    if found != "ok":
        raise InputError(str(path), f"is damaged ({_line(found)}); it has been left as it is")


def _schema(connection: sqlite3.Connection) -> list[tuple[str, str, str]]:
    return sorted(connection.execute("SELECT type, name, coalesce(sql, '') FROM sqlite_schema").fetchall())


@cache
def _wanted() -> list[tuple[str, str, str]]:
    with closing(sqlite3.connect(":memory:")) as fresh:
        for table in _TABLES:
            fresh.execute(table)
        return _schema(fresh)
