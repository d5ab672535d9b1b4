"""Reader of the integral loads that DUST's post-processor prints (``type = integral_loads``, ``format = dat``)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from levelone.config.files import read_text
from levelone.config.other_codes.other_code import number
from levelone.errors import InputError

FloatArray = npt.NDArray[np.float64]

TITLE = "Integral loads: N.components:"
COLUMNS = ("t", "Fx", "Fy", "Fz", "Mx", "My", "Mz", "ref_mat(9)", "ref_off(3)")
#: numbers on a line: time, force, moment, rotation matrix and origin of the reference system
WIDTH = 1 + 3 + 3 + 9 + 3


@dataclass(frozen=True)
class Loads:
    """History of the loads on one or several components together.

    Parameters
    ----------
    time
        [t], s, increasing.
    force, moment
        [t, 3], N and N m, along the axes and about the origin of ``system``. Coefficients in the conventions of this package need
        a system that does not turn with the body: then C_L = F_z / (q S) and C_m = M_y / (q S c) for a stream along x, z up.
    rotation, offset
        [t, 9] and [t, 3]: the system's matrix, its nine numbers as printed, and its origin, at each time.
    components
        Names of the components whose loads are summed.
    system
        Name of the reference system; "0" is the ground.
    """

    time: FloatArray
    force: FloatArray
    moment: FloatArray
    rotation: FloatArray
    offset: FloatArray
    components: tuple[str, ...]
    system: str

    @property
    def fixed(self) -> bool:
        """Whether the reference system neither turns nor moves, and is aligned with the ground."""
        return bool(np.all(self.rotation == np.eye(3).ravel()) and np.all(self.offset == self.offset[0]))


def read_loads(path: Path | str) -> Loads:
    """Read a file of integral loads.

    Raises
    ------
    InputError
        Missing or broken file: another result than integral loads, averages in place of a history, a line with another count of
        numbers, a value that is not a finite number, times that do not increase, components that do not match their count.
    """
    path = Path(path)
    where = path.name
    lines = read_text(path, where).splitlines()
    components, system = _header(where, lines)
    rows = [(i, line.split()) for i, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    if not rows:
        raise InputError(where, f"holds no loads: expected lines of {WIDTH} numbers, {', '.join(COLUMNS)}")
    data = np.empty((len(rows), WIDTH))
    for row, (line, cells) in enumerate(rows):
        if len(cells) != WIDTH:
            raise InputError(where, f"line {line} has {len(cells)} numbers, expected {WIDTH}: {', '.join(COLUMNS)}")
        data[row] = [number(where, line, "every cell", cell) for cell in cells]
        if row and not data[row, 0] > data[row - 1, 0]:
            raise InputError(where, f"line {line}: times must increase, got {data[row, 0]:g} s after {data[row - 1, 0]:g} s")
    return Loads(data[:, 0], data[:, 1:4], data[:, 4:7], data[:, 7:16], data[:, 16:19], components, system)


def _header(where: str, lines: list[str]) -> tuple[tuple[str, ...], str]:
    if not lines or TITLE not in lines[0]:
        raise InputError(where, f"line 1 must hold {TITLE!r}: this is no file of DUST's integral loads")
    count = number(where, 1, "the number of components", lines[0].split(TITLE)[1].strip())
    system = _entry(where, lines, 2, "Ref.sys")
    components = tuple(name.strip() for name in _entry(where, lines, 3, "Components").split(","))
    if len(components) != count:
        raise InputError(where, f"line 3 names {len(components)} components ({', '.join(components)}), line 1 says {count:g}")
    columns = [name.strip() for name in lines[3].lstrip(" #").split(",")] if len(lines) > 3 else []
    if "_average" in "".join(columns):
        raise InputError(where, "line 4: holds averages, expected a history: set average = F for the analysis")
    if tuple(columns) != COLUMNS:
        raise InputError(where, f"line 4 must name the columns {', '.join(COLUMNS)}; got {', '.join(columns) or 'nothing'}")
    return components, system


def _entry(where: str, lines: list[str], line: int, name: str) -> str:
    found = re.match(rf"\s*#\s*{re.escape(name)}\s*:(.*)", lines[line - 1]) if len(lines) >= line else None
    if found is None or not found.group(1).strip():
        raise InputError(where, f"line {line} must hold '# {name} : ...'")
    return found.group(1).strip()
