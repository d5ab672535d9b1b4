"""Input files: where they are, what they hold, and a hash that identifies them."""

from __future__ import annotations

import hashlib
import re
import stat
import tomllib
from collections.abc import Iterable
from importlib import resources
from os import PathLike
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from levelone.errors import InputError, unknown_name

PathOrName = str | PathLike[str]
MOST_BYTES = 1 << 30
"""Largest file that is read as a whole."""
MOST_TOML = 4 << 20
"""Largest TOML file."""
DEEPEST = 16
TOO_DEEP = f"tables and lists are nested deeper than {DEEPEST} levels"
# a decoder's time grows with the square of the length of a dotted key: it must not see a long one
_PART = r"(?:[A-Za-z0-9_-]++|\"[^\"\n]*+\"|'[^'\n]*+')"
_LONG_KEY = re.compile(rf"(?:^|[{{,])[ \t]*+(?:\[{{1,2}}[ \t]*+)?{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{DEEPEST}}}", re.MULTILINE)
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


def shipped(package: str) -> dict[str, Path]:
    """Files of a package's library: name and path."""
    folder = Path(str(resources.files(package).joinpath("library")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def path_of(path_or_name: PathOrName, known: dict[str, Path], field: str) -> Path:
    """File of the library by its name, or the user's own by its path (which ends in .toml); InputError with the closest name."""
    text = str(path_or_name)
    if text in known:
        return known[text]
    if not text.endswith(".toml"):
        raise unknown_name(field, text, [*known, "PATH.toml"])
    return Path(text)


def read_bytes(path: Path, field: str, most: int = MOST_BYTES) -> bytes:
    """Content of a file; InputError if there is none, it cannot be read, is no regular file or holds more than ``most`` bytes."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # a pipe would be waited for, a device never ends
            raise InputError(field, f"{path} cannot be read: it is not a regular file")
        with path.open("rb") as file:
            content = file.read(most + 1)
    except FileNotFoundError:
        raise InputError(field, f"no such file: {path}") from None
    except OSError as error:
        raise InputError(field, f"{path} cannot be read: {error.strerror}") from None
    except ValueError:  # a name that holds a zero byte
        raise InputError(field, f"{str(path)!r} is not the name of a file") from None
    if len(content) > most:
        raise InputError(field, f"{path} is longer than {most / 2**20:g} MiB, the most that is read")
    return content


def read_text(path: Path, field: str, most: int = MOST_BYTES) -> str:
    """Content of a UTF-8 file."""
    try:
        return read_bytes(path, field, most).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(field, f"{path} is not a UTF-8 text file: {error.reason} at byte {error.start}") from None


def read_toml(path: Path) -> dict[str, Any]:
    """Content of a TOML file; errors name the line.

    Raises
    ------
    InputError
        No TOML file, longer than 4 MiB, nested deeper than 16 tables and lists, an integer beyond 64 bits, a control character.
    """
    text = read_text(path, path.name, MOST_TOML)
    if _LONG_KEY.search(text):
        raise InputError(path.name, TOO_DEEP)
    try:
        content = tomllib.loads(text)
    except ValueError as error:  # of the decoder, or of an integer of thousands of digits
        raise InputError(path.name, f"is not a TOML file: {' '.join(str(error).split())[:300]}") from None
    except RecursionError:
        raise InputError(path.name, TOO_DEEP) from None
    _check_content(content, path.name)
    return content


def _check_content(content: dict[str, Any], name: str) -> None:
    """Refuse what no input file needs and what later steps could stumble over; level by level, so that depth costs no stack."""
    level: list[Any] = [content]
    for _ in range(DEEPEST + 1):
        below: list[Any] = []
        for each in level:
            if isinstance(each, dict):
                below += [*each, *each.values()]
            elif isinstance(each, list):
                below += each
            elif isinstance(each, str) and _CONTROL.search(each):
                raise InputError(name, f"{each[:60]!r} holds a control character")
            elif isinstance(each, int) and not -(2**63) <= each < 2**63:
                raise InputError(name, "holds an integer beyond 64 bits; write large numbers like 1e30")
        if not below:
            return
        level = below
    raise InputError(name, TOO_DEEP)


def beside(file: Path, name: str, field: str) -> Path:
    """Path of a file that an input file names, which must lie in the input file's own folder or below it.

    A vehicle that comes from elsewhere can therefore read nothing but what came with it.
    """
    absolute = PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor != ""
    folder = file.resolve().parent
    path = (folder / name).resolve()
    if absolute or not path.is_relative_to(folder):
        raise InputError(field, f"{name!r} must be a path relative to {file.name} that stays in its folder")
    return path


def file_hash(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal."""
    return hashlib.sha256(read_bytes(path, path.name)).hexdigest()


def joint_hash(paths: Iterable[Path]) -> str:
    """SHA-256 over the hashes of several files, in hexadecimal."""
    return hashlib.sha256("".join(file_hash(path) for path in paths).encode("ascii")).hexdigest()
