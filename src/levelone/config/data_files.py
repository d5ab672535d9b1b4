"""Recorded data of flight and simulation: one form for CSV, Parquet, MATLAB and ULog files.

Nothing here knows what a column means: :mod:`levelone.config.column_mapping` says which channel it is, and
:mod:`levelone.config.data_table` brings all of them to one uniform clock.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from levelone.config.files import read_bytes
from levelone.errors import InputError, closest

FloatArray = NDArray[np.float64]

LARGEST = 2**30
"""bytes: larger files are refused before they are read."""
NO_UNIT = ("-", "–", "−")
"""How files write the unit of a pure number."""
_UNIT = re.compile(r"^\s*(.*?\S)\s*(?:\[([^\[\]]*)\]|(?<=\s)\(([^()]*)\))\s*$")


@dataclass(frozen=True, eq=False)
class Column:
    """One recorded quantity.

    Parameters
    ----------
    values
        ``[sample]``, in ``unit``; NaN where the file has no number.
    unit
        As the file states it; empty where it states none.
    clock
        ``[sample]``, s: times of the column's own samples; None where the file has one column of time for all.
    problem
        What stands in place of a number, and where; empty where every cell is one.
    """

    values: FloatArray
    unit: str = ""
    clock: FloatArray | None = None
    problem: str = ""


@dataclass(frozen=True, eq=False)
class DataFile:
    """A file of recorded data as it was read.

    Parameters
    ----------
    path, sha256
        The file, and what identifies its content.
    kind
        ``"CSV"``, ``"Parquet"``, ``"MATLAB"`` or ``"ULog"``.
    columns
        By name, in the order of the file.
    attributes
        What the file's comments state, ``key = value``.
    notes
        What a reader should know, in words (dropouts of a logger).
    """

    path: Path
    sha256: str
    kind: str
    columns: Mapping[str, Column]
    attributes: Mapping[str, str]
    notes: tuple[str, ...] = ()

    def column(self, name: str, field: str) -> Column:
        """One column; InputError with the closest names if there is none, or where it holds other things than numbers."""
        if name not in self.columns:
            raise InputError(field, f"{self.path.name} has no column {name!r}; {closest(name, self.columns)}")
        found = self.columns[name]
        if found.problem:
            raise InputError(field, f"{self.path.name}: column {name!r} is not made of numbers: {found.problem}")
        return found


Content = tuple[dict[str, Column], dict[str, str], tuple[str, ...]]
"""Columns, attributes and notes: what a reader of one format gives."""


def read_data(path: str | PathLike[str]) -> DataFile:
    """Read a file of recorded data; its format is that of its ending.

    Parameters
    ----------
    path
        ``.csv``, ``.txt``, ``.tsv`` (text), ``.parquet``, ``.mat`` (MATLAB 5 to 7.3) or ``.ulg`` (PX4's log).

    Raises
    ------
    InputError
        No such file, an unknown ending, a file too large, damaged, or without a column of numbers; a missing library.
    """
    place = Path(path)
    kind, reader = _reader(place)
    try:
        size = place.stat().st_size
    except OSError as error:
        raise InputError(str(place), f"cannot be read: {error.strerror}") from None
    if size > LARGEST:
        raise InputError(str(place), f"holds {size / 2**20:.0f} MiB, at most {LARGEST // 2**20} MiB are read: cut it first")
    content = read_bytes(place, str(place))
    columns, attributes, notes = reader(place, content)
    if not columns:
        raise InputError(str(place), "holds no column of numbers")
    return DataFile(place, hashlib.sha256(content).hexdigest(), kind, columns, attributes, notes)


def _reader(path: Path) -> tuple[str, Callable[[Path, bytes], Content]]:
    """Kind and reader by the file's ending; each is imported only when it is needed."""
    ending = path.suffix.lower()
    if ending in (".csv", ".txt", ".tsv"):
        from levelone.config.data_csv import read_csv

        return "CSV", read_csv
    if ending in (".parquet", ".pq"):
        from levelone.config.data_parquet import read_parquet

        return "Parquet", read_parquet
    if ending == ".mat":
        from levelone.config.data_mat import read_mat

        return "MATLAB", read_mat
    if ending in (".ulg", ".ulog"):
        from levelone.config.data_ulog import read_ulog

        return "ULog", read_ulog
    known = (".csv", ".txt", ".tsv", ".parquet", ".mat", ".ulg")
    raise InputError(str(path), f"no format is known by the ending {ending!r}; {closest(ending, known)}")


def name_and_unit(text: str) -> tuple[str, str]:
    """``"pitch rate [deg/s]"`` or ``"pitch rate (deg/s)"`` as name and unit; an index such as ``q[0]`` is no unit."""
    found = _UNIT.match(text)
    unit = "" if found is None else (found[2] if found[2] is not None else found[3]).strip()
    if found is None or (unit.isdigit() and unit != "1"):
        return text.strip(), ""
    return found[1], "1" if unit in NO_UNIT else unit


def names_and_units(texts: Iterable[str]) -> list[tuple[str, str]]:
    """Names and units of all columns of a file: ``xyz[1]`` is an element where the file has ``xyz[0]`` or ``xyz[2]``, too."""
    cells = [text.strip() for text in texts]
    known = set(cells)
    found = []
    for cell in cells:
        name, unit = name_and_unit(cell)
        element = unit == "1" and cell.endswith("[1]") and not known.isdisjoint({f"{cell[:-3]}[0]", f"{cell[:-3]}[2]"})
        found.append((cell, "") if element else (name, unit))
    return found


def unique(path: Path, names: Iterable[str]) -> list[str]:
    """The names; InputError where one is empty or stands twice."""
    known: list[str] = []
    for number, name in enumerate(names, 1):
        if not name:
            raise InputError(str(path), f"column {number} has no name")
        if name in known:
            raise InputError(str(path), f"two columns are called {name!r}")
        known.append(name)
    return known
