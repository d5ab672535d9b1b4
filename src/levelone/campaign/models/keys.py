"""What identifies a model: everything that decides a value as plain JSON, with hashes in place of files."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from levelone.errors import InputError

#: files of one folder that are hashed before it is taken for the wrong folder
MOST_FILES = 10_000


def plain(value: Any) -> Any:
    """A value as JSON can hold it: dataclasses as their fields, arrays as lists, numbers that are not finite as text.

    Raises
    ------
    TypeError
        Something else: a key must not depend on how an object prints itself.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, np.ndarray) and value.dtype.kind in "fi" and np.isfinite(value).all():
        return value.tolist()
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if value is None:
        return "none"
    if isinstance(value, bool | int | str):
        return value
    raise TypeError(f"{type(value).__name__} has no place in a key")


def value_digest(value: Any) -> str:
    """SHA-256 of a value as plain JSON, in hexadecimal: for what is too large to stand in a key as it is."""
    return hashlib.sha256(json.dumps(plain(value), sort_keys=True).encode()).hexdigest()


def file_digest(path: Path, field: str) -> str:
    """SHA-256 of a file, in hexadecimal, read in pieces; InputError where it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(field, f"{path} cannot be read: {error.strerror}") from None


def files_digest(folder: Path, files: Iterable[Path], field: str) -> str:
    """SHA-256 over the names, relative to a folder, and contents of files, whatever order they are found in.

    Raises
    ------
    InputError
        A file that cannot be read, or more of them than a model has.
    """
    found = sorted(files)
    if len(found) > MOST_FILES:
        raise InputError(
            field, f"{folder} holds {len(found)} files, at most {MOST_FILES} are taken: name a folder of the model alone"
        )
    together = hashlib.sha256()
    for path in found:
        together.update(f"{path.relative_to(folder).as_posix()}\0{file_digest(path, field)}\n".encode())
    return together.hexdigest()


def versions(*distributions: str) -> dict[str, str]:
    """Versions of installed distributions; "not installed" for one that is missing."""
    from importlib.metadata import PackageNotFoundError, version

    found = {}
    for name in distributions:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
