"""Dakota's tabular files: points and responses, annotated, custom or freeform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from levelone.campaign.dakota.printed import PrintedIndices
from levelone.campaign.models.builtin import RESPONSES
from levelone.errors import InputError, closest
from levelone.uncertainty import FactorSpace, Responses
from levelone.uncertainty.distributions import FloatArray

LEADING = ("eval_id", "interface")


@dataclass(frozen=True, eq=False)
class Imported:
    """What a results file of Dakota's holds.

    Parameters
    ----------
    source
        The file.
    columns
        The factors in the order of the file.
    points
        [runs, k] physical values in the order of the study's factors.
    responses
        Values; NaN, or what is not finite, has the status MODEL_FAILED, since these files do not say why.
    printed
        By response: the Sobol indices that Dakota has written, where the file holds them.
    """

    source: Path
    columns: tuple[str, ...]
    points: FloatArray
    responses: Responses
    printed: dict[str, PrintedIndices] = field(default_factory=dict)


def read_tabular(path: Path, space: FactorSpace, columns: Sequence[str] = ()) -> Imported:
    """Read a tabular file.

    Parameters
    ----------
    path
        Annotated (header, evaluation number, interface), or custom with any of these.
    space
        The study's factors, all of which the file must hold.
    columns
        Names of factors and responses, from left to right; needed where the file has no header (freeform), since nothing else tells
        its columns apart.

    Raises
    ------
    InputError
        A file that cannot be read, is cut off, holds something that is no number, an unknown or missing column.
    """
    text = _text(path)
    header, _, rest = text.partition("\n")
    words = header.lstrip().lstrip("%").split()
    headed = header.lstrip().startswith("%") or any(name in words for name in space.names)
    if headed == bool(columns):
        raise InputError(
            "--columns", f"{path.name} has a header: leave it out" if headed else f"{path.name} has no header: name its columns"
        )
    names = [word for word in words if word not in LEADING] if headed else list(columns)
    body = rest if headed else text
    width = len(body.split("\n", 1)[0].split())
    leading = width - len(names)
    if body.strip() and leading not in ((len(words) - len(names),) if headed else (0, 1, 2)):
        raise InputError("dakota", f"{path}: rows of {width} entries, and {len(names)} columns are named: {', '.join(names)}")
    return imported(path, space, names, _numbers(path, body, leading, len(names)))


def imported(
    path: Path, space: FactorSpace, names: Sequence[str], table: FloatArray, printed: dict[str, PrintedIndices] | None = None
) -> Imported:
    """A table of [runs, names] as points and responses.

    Raises
    ------
    InputError
        An unknown or missing name, a name given twice, a point that is not finite.
    """
    allowed = [*space.names, *RESPONSES]
    for name in names:
        if name not in allowed:
            raise InputError(f"{path.name}", f"unknown column {name!r}; {closest(name, allowed)}")
    if len(set(names)) != len(names):
        raise InputError(f"{path.name}", f"a column is given twice in {', '.join(names)}")
    for name in space.names:
        if name not in names:
            raise InputError(f"{path.name}", f"lacks the factor {name} of the study: is it a file of another study?")
    found = [name for name in names if name in RESPONSES]
    points = table[:, [names.index(name) for name in space.names]]
    bad = np.argwhere(~np.isfinite(points))
    if bad.size:
        raise InputError(f"{path.name}", f"run {bad[0, 0] + 1}: {space.names[bad[0, 1]]} is not finite")
    values = table[:, [names.index(name) for name in found]]
    responses = Responses.from_values(values, found, [RESPONSES[name][0] for name in found])
    return Imported(path, tuple(name for name in names if name in space.names), points, responses, printed or {})


def _text(path: Path) -> str:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("dakota", f"cannot read {path}: {getattr(error, 'strerror', None) or 'it is no text'}") from None
    if not text.strip():
        raise InputError("dakota", f"{path} is empty")
    if not text.endswith("\n"):
        raise InputError("dakota", f"{path} ends inside a line: the run was interrupted; restart it with -read_restart")
    return text


def _numbers(path: Path, body: str, leading: int, count: int) -> FloatArray:
    """[rows, count] numbers that follow ``leading`` entries of each row."""
    rows = [line for line in body.split("\n") if line.strip()]
    if not rows:
        return np.empty((0, count))
    try:
        return np.loadtxt(rows, usecols=range(leading, leading + count), ndmin=2, comments=None)
    except ValueError as error:
        raise InputError("dakota", f"{path}: {error}") from None
