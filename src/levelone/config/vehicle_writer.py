"""A vehicle's file with some of its numbers changed: comments, order and everything else stay as they are."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import InlineTable

from levelone.config.changes import COORDINATES, changed
from levelone.config.files import beside, read_text, read_toml
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError
from levelone.vehicle import Vehicle


def write_vehicle(source: Path, folder: Path, changes: Mapping[str, float], why: Mapping[str, str]) -> tuple[Path, Vehicle]:
    """Write a changed copy of a vehicle's file, with its rotor tables beside it.

    Parameters
    ----------
    source
        The vehicle's file.
    folder
        Where the copy goes, under the same name; not the folder of ``source``.
    changes
        As :func:`levelone.config.vehicle_file.load_vehicle` takes them, numbers only.
    why
        For each of ``changes`` the reason, which the entry gets as ``assumed`` in place of what it had.

    Returns
    -------
    Path, Vehicle
        The new file, and the vehicle read back from it.

    Raises
    ------
    InputError
        No such entry, a file that is not fit to be read or written, or one that would be overwritten.
    """
    path = copy_path(source, folder)
    content = changed(read_toml(source), changes)
    document = tomlkit.parse(read_text(source, source.name))
    for name in changes:
        _set(document, content, name, why[name])
    try:
        path.write_text(tomlkit.dumps(document), encoding="utf-8", newline="\n")
        for key in ("file", "fine_file"):
            table = content["rotors"]["table"].get(key)
            if table is not None:
                (folder / table).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(beside(source, table, f"rotors.table.{key}"), folder / table)
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from error
    return path, load_vehicle(path)


def copy_path(source: Path, folder: Path) -> Path:
    """Where the copy goes; InputError if that is the file itself."""
    path = folder / source.name
    if path.resolve() == source.resolve():
        raise InputError("--out", f"{path} is the vehicle itself, which is not overwritten: choose another folder")
    return path


def _set(document: Any, content: Mapping[str, Any], name: str, why: str) -> None:
    """Bring one entry of the document to the changed content."""
    *folders, key = name.split(".")
    if key in COORDINATES and "value" in _at(content, folders):
        *folders, key = folders
    place, entry = _at(document, folders), _at(content, folders)[key]
    if key not in place:
        place[key] = _inline(entry | {"assumed": why}, "")
        return
    old = place[key]
    if isinstance(entry["value"], list):
        for row, numbers in zip(old["value"], entry["value"], strict=True):
            for j, number in enumerate(numbers):
                if row[j] != number:
                    row[j] = number
        old["assumed"] = why
        return
    new = _inline({k: v for k, v in entry.items() if k not in ("source", "assumed")} | {"assumed": why}, old.trivia.comment)
    new.trivia.comment_ws = old.trivia.comment_ws
    place[key] = new


def _at(content: Any, folders: list[str]) -> Any:
    for folder in folders:
        content = content[folder]
    return content


def _inline(entry: Mapping[str, Any], comment: str) -> InlineTable:
    """``{ value = ..., unit = ..., assumed = ... }`` with the spaces that a person would write."""
    body = ", ".join(f"{key} = {tomlkit.item(value).as_string()}" for key, value in entry.items())
    made = tomlkit.parse(f"x = {{ {body} }}\n")["x"]
    assert isinstance(made, InlineTable)
    made.trivia.comment = comment
    return made
