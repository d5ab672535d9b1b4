"""Reader of rotor tables: CSV files with a comment header and the columns throttle, airspeed, angle_deg, rpm, thrust, torque."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from levelone.config.files import read_text
from levelone.config.schema import in_file
from levelone.config.units import to_si
from levelone.errors import InputError, closest
from levelone.vehicle import RotorTable
from levelone.vehicle.tables import FloatArray

AXES = ("throttle", "airspeed", "angle_deg")
COLUMNS = (*AXES, "rpm", "thrust", "torque")


def read_rotor_table(path: Path, field: str = "rotors.table.file") -> RotorTable:
    """Read a rotor table.

    Parameters
    ----------
    path
        CSV file: lines that begin with ``#`` come first and are kept as the table's source, then the names of the columns in any
        order, then one row for each node of a full grid, in any order. Units: throttle 1, airspeed m/s, angle deg, rpm rev/min,
        thrust N, torque N m.
    field
        Path that an error names.

    Raises
    ------
    InputError
        Missing file or column, text in place of a number, NaN, nodes that are missing, given twice or not uniform.
    """
    return _table(read_text(path, field), f"{field}: {path.name}")


@lru_cache(maxsize=4)
def _table(text: str, where: str) -> RotorTable:
    """The table of a file's text; kept, since a study builds many vehicles from one file."""
    lines = text.splitlines()
    comments = [line.lstrip("# ").rstrip() for line in lines if line.startswith("#")]
    rows = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if not rows:
        raise InputError(where, f"holds no table; its first row names the columns {','.join(COLUMNS)}")
    columns = _columns(where, rows[0][1])
    data = _numbers(where, rows[1:], len(columns))[:, [columns.index(name) for name in COLUMNS]]
    axes = [np.unique(data[:, j]) for j in range(3)]
    shape = tuple(len(axis) for axis in axes)
    _check_grid(where, data, shape)
    ordered = data[np.lexsort(data[:, 2::-1].T)]
    throttle, airspeed, angle = axes
    with in_file(where):
        return RotorTable(
            throttle, airspeed, to_si(angle, "deg", "rad", where), ordered[:, 3:].reshape(*shape, 3), "\n".join(comments)
        )


def _columns(where: str, header: str) -> list[str]:
    names = [name.strip() for name in header.split(",")]
    for name in COLUMNS:
        if names.count(name) != 1:
            what = "missing" if name not in names else "given twice"
            raise InputError(where, f"column {name!r} {what}; the columns are {', '.join(names)}")
    for name in names:
        if name not in COLUMNS:
            raise InputError(where, f"unknown column {name!r}; {closest(name, COLUMNS)}")
    return names


def _numbers(where: str, rows: list[tuple[int, str]], width: int) -> FloatArray:
    table = np.empty((len(rows), width))
    for i, (number, line) in enumerate(rows):
        cells = line.split(",")
        if len(cells) != width:
            raise InputError(where, f"line {number} has {len(cells)} cells, the header {width}")
        try:
            table[i] = [float(cell) for cell in cells]
        except ValueError:
            raise InputError(where, f"line {number} holds {line.strip()!r}: every cell must be a number") from None
    bad = np.flatnonzero(~np.isfinite(table).all(axis=1))
    if bad.size:
        raise InputError(where, f"line {rows[bad[0]][0]} holds a value that is not a finite number ({bad.size} such lines)")
    return table


def _check_grid(where: str, data: FloatArray, shape: tuple[int, ...]) -> None:
    nodes, counts = np.unique(data[:, :3], axis=0, return_counts=True)
    if counts.size and counts.max() > 1:
        twice = nodes[np.argmax(counts)]
        raise InputError(where, f"the node {_node(twice)} is given {counts.max()} times")
    if len(nodes) == np.prod(shape):
        return
    present = {tuple(node) for node in nodes.tolist()}
    axes = [np.unique(data[:, j]).tolist() for j in range(3)]
    missing = next((t, v, a) for t in axes[0] for v in axes[1] for a in axes[2] if (t, v, a) not in present)
    full = f"{' x '.join(map(str, shape))} = {np.prod(shape)}"
    raise InputError(where, f"is no full grid: {len(nodes)} of {full} nodes; the first missing is {_node(missing)}")


def _node(node: FloatArray | tuple[float, ...]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in zip(AXES, node, strict=True))
