"""Reader of text tables: comma, semicolon or tab, a row of names with or without units, comments, decimal commas.

The usual case, a rectangle of numbers, goes through NumPy's compiled reader; only what it refuses is read cell by cell.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from levelone.config.data_files import NO_UNIT, Column, Content, FloatArray, names_and_units, unique
from levelone.errors import InputError

DELIMITERS = (",", ";", "\t")


def read_csv(path: Path, content: bytes) -> Content:
    """Columns of a text table.

    Parameters
    ----------
    path
        Of the file, for errors.
    content
        UTF-8 text. Lines that begin with ``#`` are comments, and ``# key = value`` an attribute. The first other line holds the
        names (``pitch rate [deg/s]`` and ``pitch rate (deg/s)`` state a unit, a second row of text states them all). Cells are
        divided by what divides the names: comma, semicolon or tab; with the latter two numbers may have a decimal comma.

    Raises
    ------
    InputError
        No text, fewer than two rows of numbers, no names, two columns of one name, or a row of another number of cells.

    Notes
    -----
    An empty cell is NaN. A cell that is no number is NaN too and is named when its column is used.
    """
    comments, numbered = _lines(path, content)
    if len(numbered) < 3:
        raise InputError(str(path), "holds no record: a row of names and two rows of numbers are the least")
    delimiter = max(DELIMITERS, key=numbered[0][1].count)
    header = _cells(numbered[0][1], delimiter)
    if all(_is_number(cell) for cell in header):
        raise InputError(f"{path}: line {numbered[0][0]}", "holds numbers where the names of the columns are expected")
    parts = names_and_units(header)
    names, units = unique(path, [name for name, _ in parts]), [unit for _, unit in parts]
    second, third = (_cells(line, delimiter) for _, line in numbered[1:3])
    body = numbered[1:]
    if _are_units(second, third, len(header)):
        stated = [cell.strip("[]() ") for cell in second]
        units = [given or ("1" if unit in NO_UNIT else unit) for given, unit in zip(units, stated, strict=True)]
        body = numbered[2:]
    if delimiter != "," and any("," in line for _, line in body[:50]):
        body = [(number, line.replace(",", ".")) for number, line in body]
    table, problems = _numbers(path, body, len(names), delimiter)
    columns = {
        name: Column(np.ascontiguousarray(table[:, j]), units[j], problem=problems.get(j, "")) for j, name in enumerate(names)
    }
    return columns, comments, ()


def _lines(path: Path, content: bytes) -> tuple[dict[str, str], list[tuple[int, str]]]:
    """Comments as keys and values, and the other lines with their numbers."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(str(path), f"is not UTF-8 text: {error.reason} at byte {error.start}") from None
    comments: dict[str, str] = {}
    numbered: list[tuple[int, str]] = []
    for number, line in enumerate(text.split("\n"), 1):
        if line.startswith("#"):
            key, equals, value = line[1:].partition("=")
            if equals:
                comments[key.strip()] = value.strip()
        elif line.strip():
            numbered.append((number, line.rstrip("\r")))
    return comments, numbered


def _cells(line: str, delimiter: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
    except (csv.Error, StopIteration):
        return [cell.strip() for cell in line.split(delimiter)]


def _numbers(path: Path, body: Sequence[tuple[int, str]], width: int, delimiter: str) -> tuple[FloatArray, dict[int, str]]:
    """The rectangle of numbers, and for each column that holds something else what it is."""
    try:
        table = np.loadtxt([line for _, line in body], delimiter=delimiter, comments=None, quotechar='"', ndmin=2)
        if table.shape[1] == width:
            return table, {}
    except (ValueError, OverflowError):
        pass  # a cell that is empty or text: read slowly, and say which
    table, problems = np.full((len(body), width), np.nan), {}
    for row, (number, line) in enumerate(body):
        cells = _cells(line, delimiter)
        if len(cells) != width:
            raise InputError(f"{path}: line {number}", f"has {len(cells)} cells, the row of names has {width}")
        for column, cell in enumerate(cells):
            try:
                table[row, column] = float(cell) if cell else np.nan
            except ValueError:
                problems.setdefault(column, f"line {number} holds {cell[:40]!r}")
    return table, problems


def _are_units(cells: Sequence[str], below: Sequence[str], width: int) -> bool:
    """Whether a row states units: words, ``1`` or nothing in every cell, and no word where the next row has one as well."""
    if not len(cells) == len(below) == width:
        return False
    words = [bool(cell) and not _is_number(cell) for cell in cells]
    stated = all(word or cell in ("", "1") for word, cell in zip(words, cells, strict=True))
    return stated and any(words) and all(not word or not cell or _is_number(cell) for word, cell in zip(words, below, strict=True))


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True
