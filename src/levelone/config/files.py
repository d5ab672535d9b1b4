"""Input files: where they are, what they hold, and a hash that identifies them."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterable
from importlib import resources
from os import PathLike
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from levelone.errors import InputError, unknown_name

PathOrName = str | PathLike[str]


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


def read_bytes(path: Path, field: str) -> bytes:
    """Content of a file; InputError if there is none or it cannot be read."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(field, f"no such file: {path}") from None
    except OSError as error:
        raise InputError(field, f"{path} cannot be read: {error.strerror}") from None


def read_text(path: Path, field: str) -> str:
    """Content of a UTF-8 file."""
    try:
        return read_bytes(path, field).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(field, f"{path} is not a UTF-8 text file: {error.reason} at byte {error.start}") from None


def read_toml(path: Path) -> dict[str, Any]:
    """Content of a TOML file; errors name the line."""
    text = read_text(path, path.name)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(path.name, f"is not a TOML file: {error}") from None


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
