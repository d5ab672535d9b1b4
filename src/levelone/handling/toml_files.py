"""Reading of the TOML files that hold boundaries, tolerances and limits."""

from __future__ import annotations

import stat
import tomllib
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from levelone.errors import InputError

MOST_BYTES = 4 << 20
"""Largest file that is read."""


def read_toml_file(source: Path | Traversable, field: str) -> dict[str, Any]:
    """Content of a file of the library or of the user.

    Raises
    ------
    InputError
        It cannot be read, is no regular file, holds more than 4 MiB, is no TOML, is nested too deep, or holds an integer beyond
        64 bits.
    """
    try:
        if isinstance(source, Path) and not stat.S_ISREG(source.stat().st_mode):  # a pipe would be waited for
            raise InputError(field, "cannot be read: it is not a regular file")
        with source.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise InputError(field, f"cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise error if isinstance(error, InputError) else InputError(field, "cannot be read: no name of a file") from None
    if len(data) > MOST_BYTES:
        raise InputError(field, f"cannot be read: longer than {MOST_BYTES >> 20} MiB")
    try:
        content = tomllib.loads(data.decode("utf-8"))
        _refuse_long_integers(content, field)
    except InputError:
        raise
    except RecursionError:
        raise InputError(field, "cannot be read: its tables and lists are nested too deep") from None
    except ValueError as error:  # of the decoders, or of an integer of thousands of digits
        raise InputError(field, f"is not a TOML file: {' '.join(str(error).split())[:300]}") from None
    return content


def subtable(value: Any, field: str) -> dict[str, Any]:
    """The value, which must be a table.

    Raises
    ------
    InputError
        It is something else.
    """
    if not isinstance(value, dict):
        raise InputError(field, f"is {str(value)[:60]!r}, must be a table")
    return value


def _refuse_long_integers(value: Any, field: str) -> None:
    """Arithmetic and messages stumble over them."""
    if isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            _refuse_long_integers(each, field)
    elif isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise InputError(field, "holds an integer beyond 64 bits; write large numbers like 1e30")
