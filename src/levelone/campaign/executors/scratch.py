"""Folders for what worker processes leave behind while they run, removed even when their owner was killed: by the next run.

The owner holds a lock (flock) on a file in its folder. The kernel drops the lock with the process, however that ends; a folder of
this user whose lock can be had is nobody's.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from levelone.errors import LeveloneError

PREFIX = "levelone-workers-"


@contextmanager
def scratch(root: Path | None = None, prefix: str = PREFIX) -> Iterator[Path]:
    """A folder of one's own; those that killed runs have left are removed first.

    Parameters
    ----------
    root
        Where it lies; None for the system's folder for temporary files.
    prefix
        Its name begins so. On a disk that several machines share it has to name the machine: a lock may be seen by one alone.

    Raises
    ------
    LeveloneError
        It cannot be made.
    """
    root = Path(tempfile.gettempdir()) if root is None else root
    for left in root.glob(f"{prefix}*"):
        _remove_if_left(left)
    try:
        folder, lock = _made(root, prefix)
    except OSError as error:
        raise LeveloneError(f"{root}: no folder for temporary files can be made in it: {error.strerror}") from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def _made(root: Path, prefix: str) -> tuple[Path, int]:
    """A folder and the descriptor that holds its lock."""
    # it gets its name when it is locked: another run must not take it for one that was left
    unnamed = Path(tempfile.mkdtemp(dir=root, prefix=".levelone-"))
    lock = os.open(unnamed / "lock", os.O_CREAT | os.O_RDWR, 0o600)
    # where a disk has no locks nobody can have this one either: the folder then stays after a kill
    with suppress(OSError):
        fcntl.flock(lock, fcntl.LOCK_EX)
    return unnamed.rename(root / f"{prefix}{unnamed.name.removeprefix('.levelone-')}"), lock


def _remove_if_left(folder: Path) -> None:
    try:
        if folder.is_symlink() or folder.stat().st_uid != os.getuid():
            return
        lock = os.open(folder / "lock", os.O_RDWR | os.O_NOFOLLOW)
    except OSError:
        # another's, or gone already
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder, ignore_errors=True)
    except OSError:
        # it has an owner, or the disk has no locks
        pass
    finally:
        os.close(lock)
