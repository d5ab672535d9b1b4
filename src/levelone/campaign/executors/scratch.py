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
from contextlib import contextmanager
from pathlib import Path

PREFIX = "levelone-workers-"


@contextmanager
def scratch() -> Iterator[Path]:
    """A folder of one's own under the system's folder for temporary files; those that killed runs have left are removed first."""
    root = Path(tempfile.gettempdir())
    for left in root.glob(f"{PREFIX}*"):
        _remove_if_left(left)
    # it gets its name when it is locked: another run must not take it for one that was left
    unnamed = Path(tempfile.mkdtemp(dir=root))
    lock = os.open(unnamed / "lock", os.O_CREAT | os.O_RDWR, 0o600)
    fcntl.flock(lock, fcntl.LOCK_EX)
    folder = unnamed.rename(root / f"{PREFIX}{unnamed.name}")
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


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
    except BlockingIOError:
        pass
    finally:
        os.close(lock)
