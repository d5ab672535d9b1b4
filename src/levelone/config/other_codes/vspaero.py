"""Reader of VSPAERO's stability files (``.stab``, written by ``vspaero -stab``; the layout is the same in VSPAERO 4 to 7).

The file holds, for each condition, a header of reference values, a table of cases (the base and one step in each variable) and the
table of forward differences made of them. Its source (``vspaero.C``, CalculateStabilityDerivatives) divides the steps in p, q, r by
2V/b, 2V/c, 2V/b and writes CMl = -CMx, CMm = CMy, CMn = -CMz in its axes x aft, y right, z up: names apart, these are this
package's conventions. The reader does not take that on trust: it forms the differences of the table of cases itself and refuses a
file whose derivatives are normalised in another way.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from levelone.config.files import read_text
from levelone.config.other_codes.other_code import COEFFICIENTS, NAMES, VARIABLES, WHOLE_SIDE_FORCE, OtherCode, number, positive
from levelone.errors import InputError

#: the file's names of our coefficients and variables; CS is the side force across the stream, CFy that along the body's y axis
COEFFICIENT = dict(zip(COEFFICIENTS, ("CL", "CD", "CFy", "CMl", "CMm", "CMn"), strict=True))
VARIABLE = dict(zip(VARIABLES, ("Alpha", "Beta", "p", "q", "r"), strict=True))
CASE = dict(zip(VARIABLES, ("Alpha", "Beta", "Roll__Rate", "Pitch_Rate", "Yaw___Rate"), strict=True))
UNIT = dict(zip(VARIABLES, ("deg", "deg", "rad/Tunit", "rad/Tunit", "rad/Tunit"), strict=True))
HEADER = ("Sref_", "Cref_", "Bref_", "Xcg_", "Ycg_", "Zcg_", "Mach_", "AoA_", "Beta_", "Vinf_")
CASES = re.compile(r"(?P<name>\S.*?)\s+\+\s*(?P<step>\S+)\s+(?P<unit>\S+)\s+(?P<values>\S.*)")
#: half a unit of the last printed digit
ROUNDING = 0.5e-7


@dataclass
class _Condition:
    line: int
    header: dict[str, float] = field(default_factory=dict)
    case_columns: list[str] = field(default_factory=list)
    cases: dict[str, tuple[float, str, dict[str, float]]] = field(default_factory=dict)
    columns: list[str] = field(default_factory=list)
    rows: dict[str, dict[str, float]] = field(default_factory=dict)


def read_stab(path: Path | str) -> OtherCode:
    """Read a file that holds one condition.

    Raises
    ------
    InputError
        As for :func:`read_stab_conditions`; several conditions, which only that function reads.
    """
    found = read_stab_conditions(path)
    if len(found) != 1:
        shown = ", ".join(f"alpha {math.degrees(one.alpha):g} deg, beta {math.degrees(one.beta):g} deg" for one in found[:8])
        raise InputError(Path(path).name, f"holds {len(found)} conditions ({shown}), expected one: use read_stab_conditions")
    return found[0]


def read_stab_conditions(path: Path | str) -> tuple[OtherCode, ...]:
    """Read every condition of a file, in its order.

    Raises
    ------
    InputError
        Missing or broken file: a table or value that is missing, a value that is not a finite number, reference values that are not
        positive, derivatives that do not follow from the table of cases.
    """
    path = Path(path)
    where = path.name
    conditions = _parse(where, read_text(path, where))
    if not conditions:
        raise InputError(where, "line 1: expected the reference values of a condition (Sref_ ...): this is no VSPAERO .stab file")
    return tuple(_converted(where, condition) for condition in conditions)


def _parse(where: str, text: str) -> list[_Condition]:
    conditions: list[_Condition] = []
    table = "header"
    for line, content in enumerate(text.splitlines(), 1):
        cells = content.split()
        if not cells or cells[0].startswith(("#", "*")):
            # the last table ends where the file prints its static margin
            table = "result" if content.startswith("# Result") else table
        elif cells[0] == "Sref_":
            conditions.append(_Condition(line))
            table = "header"
            _header(where, line, cells, conditions[-1])
        elif not conditions:
            raise InputError(where, f"line {line}: expected Sref_ first, got {content.strip()[:40]!r}")
        elif cells[0] in ("Case", "Coef"):
            table = cells[0]
            columns = conditions[-1].case_columns if table == "Case" else conditions[-1].columns
            columns[:] = cells[3:] if table == "Case" else cells[1:]
        elif table == "header":
            _header(where, line, cells, conditions[-1])
        elif table == "Case":
            _case(where, line, content, conditions[-1])
        elif table == "Coef":
            columns = conditions[-1].columns
            conditions[-1].rows[cells[0]] = _values(where, line, cells[0], columns, cells[1:])
    return conditions


def _header(where: str, line: int, cells: list[str], condition: _Condition) -> None:
    if cells[0] in HEADER:
        if len(cells) < 2:
            raise InputError(where, f"line {line}: expected {cells[0]} and its value")
        condition.header[cells[0]] = number(where, line, cells[0], cells[1])


def _case(where: str, line: int, content: str, condition: _Condition) -> None:
    found = CASES.fullmatch(content.strip())
    if found is None:
        raise InputError(
            where, f"line {line}: expected a case, its step (+1.000), unit and coefficients, got {content.strip()[:40]!r}"
        )
    name = found["name"]
    values = _values(where, line, name, condition.case_columns, found["values"].split())
    condition.cases[name] = (number(where, line, f"the step of {name}", found["step"]), found["unit"], values)


def _values(where: str, line: int, name: str, columns: list[str], cells: list[str]) -> dict[str, float]:
    if len(cells) != len(columns):
        raise InputError(where, f"line {line}: {name} has {len(cells)} values, expected {len(columns)}: {', '.join(columns)}")
    return {column: number(where, line, f"{name} {column}", cell) for column, cell in zip(columns, cells, strict=True)}


def _converted(where: str, condition: _Condition) -> OtherCode:
    header = condition.header
    for name in HEADER:
        if name not in header:
            raise InputError(where, f"line {condition.line}: expected the value of {name} in the table that starts here")
    positive(where, header, ("Sref_", "Cref_", "Bref_", "Vinf_"))
    derivatives = {name: _derivative(where, condition, name) for name in NAMES}
    totals = {ours: _entry(where, condition, theirs, "Total") for ours, theirs in COEFFICIENT.items()}
    return OtherCode(
        code="VSPAERO",
        source=where,
        alpha=math.radians(header["AoA_"]),
        beta=math.radians(header["Beta_"]),
        mach=header["Mach_"],
        airspeed=header["Vinf_"],
        area=header["Sref_"],
        chord=header["Cref_"],
        span=header["Bref_"],
        reference_point=(header["Xcg_"], header["Ycg_"], header["Zcg_"]),
        coefficients=MappingProxyType(totals),
        derivatives=MappingProxyType(derivatives),
        not_converted=_reservations(condition),
    )


def _entry(where: str, condition: _Condition, row: str, column: str) -> float:
    try:
        return condition.rows[row][column]
    except KeyError:
        raise InputError(
            where, f"line {condition.line}: the condition that starts here holds no {row}, {column} in its table of derivatives"
        ) from None


def _derivative(where: str, condition: _Condition, name: str) -> float:
    """One derivative, checked against the table of cases within what the printed digits allow."""
    ours, variable = next((c, name[len(c) :]) for c in COEFFICIENTS if name.startswith(c))
    row, column = COEFFICIENT[ours], VARIABLE[variable]
    value = _entry(where, condition, row, column)
    for case in ("Base_Aero", CASE[variable]):
        if row not in condition.cases.get(case, (0.0, "", {}))[2]:
            raise InputError(
                where, f"line {condition.line}: expected the case {case} with {row}: without it the normalisation cannot be checked"
            )
    step, unit, stepped = condition.cases[CASE[variable]]
    header = condition.header
    if unit != UNIT[variable] or step == 0.0:
        raise InputError(
            where, f"the step of {CASE[variable]} must be given in {UNIT[variable]} and not be zero, got {step:g} {unit}"
        )
    length = {"p": header["Bref_"], "q": header["Cref_"], "r": header["Bref_"]}.get(variable)
    change = math.radians(step) if length is None else step * length / (2.0 * header["Vinf_"])
    difference = (stepped[row] - condition.cases["Base_Aero"][2][row]) / change
    # the header's own values are printed to seven decimals as well
    if abs(difference - value) > 4.0 * ROUNDING / abs(change) + 1e-5 * abs(value) + 2.0 * ROUNDING:
        per = "rad" if length is None else f"{column} times {'c' if variable == 'q' else 'b'}/(2V)"
        raise InputError(
            where, f"{row} per {column} is {value:g}, but the cases give {difference:g} per {per}: normalised otherwise"
        )
    return value


def _reservations(condition: _Condition) -> tuple[tuple[str, str], ...]:
    known = {"Base_Aero", "Mach", *CASE.values()}
    groups = tuple(name for name in condition.cases if name not in known)
    return (
        ("lengths and airspeed", "in the file's own unit (Lunit, Tunit), which it does not name"),
        ("C_Lalphadot, C_malphadot", "not in the file: its rate derivatives are quasi-steady"),
        ("derivatives", "forward differences over the printed steps (1 deg, 1 rad/s), not limits"),
        ("C_D", "holds friction in the newest versions of VSPAERO only; the file does not say which one wrote it"),
        ("C_Y", WHOLE_SIDE_FORCE),
        ("Mach, U", "derivatives with Mach number and speed have no name here"),
        *((f"control group {name}", "sign and surfaces of a control group are the model's own") for name in groups),
    )
