"""The indices that Dakota itself prints, read back from what it printed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from levelone.errors import InputError
from levelone.uncertainty.distributions import FloatArray

NUMBER = r"[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|nan|inf)"
SOBOL_HEAD = re.compile(r"^(\S+) Sobol' indices:\s*$")
SOBOL_ROW = re.compile(rf"^\s+({NUMBER})\s+({NUMBER})\s+(\S+)\s*$")
MOAT_HEAD = re.compile(r"MOAT Analysis")
MOAT_ROW = re.compile(rf"^Input\s+(\d+) \(mod\. mean & std\) =\s+({NUMBER})\s+({NUMBER})\s*$")


@dataclass(frozen=True, eq=False)
class PrintedIndices:
    """Two indices of each of k factors for one response, in the order of ``names``, as Dakota printed them.

    ``first`` and ``second`` [k] are S1 and ST of a decomposition, or mu_star and sigma of psuade_moat (per full range of a factor);
    NaN where Dakota printed none.
    """

    names: tuple[str, ...]
    first: FloatArray
    second: FloatArray


def read_sobol(text: str, names: Sequence[str]) -> dict[str, PrintedIndices]:
    """Main and total indices of each response, from the tables that a decomposition prints.

    Parameters
    ----------
    text
        Dakota's output file, or its log.
    names
        Factors, in the order wanted.

    Returns
    -------
    By response; empty where nothing was printed, which is what Dakota 6.24 does when a single run was NaN. Indices of interactions
    are left aside. A factor that a table does not hold is NaN: with drop_tolerance Dakota leaves out small ones.
    """
    found: dict[str, PrintedIndices] = {}
    response = None
    rows: dict[str, tuple[float, float]] = {}
    for line in [*text.splitlines(), ""]:
        head, row = SOBOL_HEAD.match(line), SOBOL_ROW.match(line)
        if response is not None and row is not None and row[3] in names:
            rows[row[3]] = (float(row[1]), float(row[2]))
        elif response is not None and rows:
            found[response] = _indices(rows, names)
            response, rows = None, {}
        if head is not None:
            response = head[1]
    return found


def read_moat(text: str, variables: Sequence[str], responses: Sequence[str], names: Sequence[str]) -> dict[str, PrintedIndices]:
    """Modified means and standard deviations of the elementary effects, from what psuade_moat prints on standard output.

    Parameters
    ----------
    text
        Dakota's log: its output file does not hold these tables, and they name neither variables nor responses.
    variables, responses
        In the order of Dakota's own files.
    names
        Factors, in the order wanted.

    Raises
    ------
    InputError
        Another number of tables than of responses, or of rows than of variables.
    """
    tables: list[dict[str, tuple[float, float]]] = []
    for line in text.splitlines():
        if MOAT_HEAD.search(line):
            tables.append({})
        row = MOAT_ROW.match(line.rstrip())
        if row is not None and tables:
            at = int(row[1]) - 1
            if at >= len(variables):
                raise InputError("psuade_moat", f"prints an input {at + 1}, and the study has {len(variables)} factors")
            tables[-1][variables[at]] = (float(row[2]), float(row[3]))
    if tables and (len(tables) != len(responses) or any(len(table) != len(variables) for table in tables)):
        raise InputError(
            "psuade_moat",
            f"{len(tables)} tables of {sorted({len(t) for t in tables})} inputs are printed; {len(responses)} responses of "
            f"{len(variables)} factors are needed",
        )
    return {response: _indices(table, names) for response, table in zip(responses, tables, strict=False)}


def _indices(rows: Mapping[str, tuple[float, float]], names: Sequence[str]) -> PrintedIndices:
    missing = (float("nan"), float("nan"))
    values = np.array([rows.get(name, missing) for name in names], dtype=np.float64)
    return PrintedIndices(tuple(names), values[:, 0], values[:, 1])
