"""Changes to the numbers of an input file, named by their path: what calibration fits and what experiments alter."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from levelone.errors import InputError, unknown_name

#: columns of a list of points
COORDINATES = ("x", "y", "z")
Change = float | str


def changed(content: Mapping[str, Any], changes: Mapping[str, Change]) -> dict[str, Any]:
    """A copy of a vehicle file's content with some of its entries changed.

    Parameters
    ----------
    content
        Of the file, as TOML gives it.
    changes
        Path of an entry to its new value. An entry ``{ value = ..., unit = ... }`` takes a number in its own unit, a plain text
        another text. ``PATH.x`` (``.y``, ``.z``) of a list of points takes a factor on that coordinate of all points.

    Raises
    ------
    InputError
        No such entry (with the closest name), or a value of the wrong kind.
    """
    out: dict[str, Any] = copy.deepcopy(dict(content))
    for path, value in changes.items():
        _change(out, path, value)
    return out


def _change(content: dict[str, Any], path: str, value: Change) -> None:
    *folders, name = path.split(".")
    table: Any = content
    for depth, key in enumerate(folders):
        table = _entry(table, key, ".".join(folders[:depth]))
    if isinstance(table, dict) and name in COORDINATES and "value" in table:
        _stretch(table, path, COORDINATES.index(name), value)
    elif path == "rotors.throttle_exponent":
        table[name] = {"value": _number(path, value), "unit": "1", "assumed": "changed"}
    elif isinstance(found := _entry(table, name, ".".join(folders)), str):
        table[name] = value
    elif isinstance(found, dict) and isinstance(found.get("value"), int | float):
        found["value"] = _number(path, value)
    else:
        raise InputError(path, "is no single number or text: it cannot be changed")


def _entry(table: Any, key: str, where: str) -> Any:
    if not isinstance(table, dict) or key not in table:
        raise unknown_name(where or "changes", key, table if isinstance(table, dict) else ())
    return table[key]


def _stretch(table: dict[str, Any], path: str, column: int, value: Change) -> None:
    factor = _number(path, value)
    rows = table["value"]
    if not isinstance(rows, list) or not all(isinstance(row, list) and len(row) == len(COORDINATES) for row in rows):
        raise InputError(path, "is no list of points")
    table["value"] = [[each * (factor if j == column else 1.0) for j, each in enumerate(row)] for row in rows]


def _number(path: str, value: Change) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(path, f"is {value!r}, must be a number")
    return float(value)
