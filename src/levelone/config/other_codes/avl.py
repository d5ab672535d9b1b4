"""Reader of AVL's stability-derivative files (command ``st`` of the OPER menu; the layout is the same in AVL 3.2 to 3.40).

AVL prints ``st`` in stability axes: moments and the rates p', r' are about axes turned by the incidence, x' against the stream.
Its source (``aoutput.f``, DERMATS) takes them from the body axes by

    Cl' = Cl cos a + Cn sin a,   Cn' = Cn cos a - Cl sin a,   p' = p cos a + r sin a,   r' = r cos a - p sin a,

with the rates as p b/(2V), q c/(2V), r b/(2V), beta positive for wind from the right, and in the standard orientation (x forward,
z down) moments and rates in the sense of this package. The reader turns them back; in the geometric orientation (x aft, z up)
Cl, Cn, p and r have the other sign.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import MappingProxyType

from levelone.config.files import read_text
from levelone.config.other_codes.other_code import COEFFICIENTS, NAMES, VARIABLES, WHOLE_SIDE_FORCE, OtherCode, number, positive
from levelone.errors import InputError

#: AVL's names of our coefficients and variables
COEFFICIENT = dict(zip(COEFFICIENTS, ("CL", "CD", "CY", "Cl", "Cm", "Cn"), strict=True))
VARIABLE = dict(zip(VARIABLES, "abpqr", strict=True))
HEADER = (
    "Sref", "Cref", "Bref", "Xref", "Yref", "Zref", "Alpha", "Beta", "Mach", "pb/2V", "rb/2V",
    "CLtot", "CDtot", "CYtot", "Cltot", "Cmtot", "Cntot", "Cl'tot", "Cn'tot",
)  # fmt: skip
#: sign of Cl, Cn, p and r against the standard orientation
ORIENTATIONS = {"Standard axis orientation": 1.0, "Geometric axis orientation": -1.0}
ASSIGNMENT = re.compile(r"([A-Za-z][\w'/]*)\s*=\s*(\S+)")
STABILITY, BODY = "Stability-axis derivatives", "Geometry-axis derivatives"


def read_st(path: Path | str) -> OtherCode:
    """Read a file.

    Raises
    ------
    InputError
        Missing or broken file: another of AVL's outputs, a value that is missing, given twice or not a finite number, reference
        values that are not positive, a condition with roll or yaw rate (its derivatives with incidence hold stability-axis rates
        constant, not those of the body).
    """
    path = Path(path)
    where = path.name
    lines = read_text(path, where).splitlines()
    start = _start(where, lines)
    header = _assignments(where, lines, 0, start, HEADER)
    for name in HEADER:
        if name not in header:
            raise InputError(where, f"line {start + 1}: expected the value of {name} above the derivatives")
    positive(where, header, ("Sref", "Cref", "Bref"))
    for name in ("pb/2V", "rb/2V"):
        if header[name] != 0.0:
            raise InputError(where, f"{name} is {header[name]:g}, expected 0: AVL holds stability-axis rates while it varies alpha")
    sign = _orientation(where, lines[:start])
    values = _derivatives(where, lines, start, sign)
    moments = sign * header["Cl'tot"], sign * header["Cn'tot"]
    return _result(where, header, sign, _in_body_axes(values, math.radians(header["Alpha"]), moments))


def _start(where: str, lines: list[str]) -> int:
    """Index of the line that opens the derivatives."""
    found = [i for i, line in enumerate(lines) if STABILITY in line]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(where, f"line {found[1] + 1}: expected one run, here {STABILITY!r} stands again")
    if any(BODY in line for line in lines):
        raise InputError(where, f"holds {BODY!r} (command sb), expected {STABILITY!r} (command st)")
    raise InputError(where, f"expected a line with {STABILITY!r}: this is no file of AVL's command st")


def _orientation(where: str, lines: list[str]) -> float:
    for line in lines:
        for name, sign in ORIENTATIONS.items():
            if name in line:
                return sign
    raise InputError(where, f"expected a line with {' or '.join(map(repr, ORIENTATIONS))} above the derivatives")


def _assignments(where: str, lines: list[str], first: int, last: int, names: tuple[str, ...]) -> dict[str, float]:
    """The values of the names wanted, each given once."""
    values: dict[str, float] = {}
    for i in range(first, last):
        for name, text in ASSIGNMENT.findall(lines[i]):
            if name not in names:
                continue
            if name in values:
                raise InputError(where, f"line {i + 1}: {name} is given twice")
            values[name] = number(where, i + 1, name, text)
    return values


def _derivatives(where: str, lines: list[str], start: int, sign: float) -> dict[str, float]:
    """Derivatives in stability axes under our names, in the standard orientation; NaN for drag where the version prints none."""
    # only the rows of the matrices: the spiral ratio below them reads 'Clb Cnr / Clr Cnb = ...'
    rows = [line if "|" in line else "" for line in lines]
    wanted = {c + v: COEFFICIENT[c] + VARIABLE[v] for c in COEFFICIENTS for v in VARIABLES}
    found = _assignments(where, rows, start, len(rows), tuple(wanted.values()))
    values = {}
    for ours, theirs in wanted.items():
        if theirs not in found and not ours.startswith("C_D"):
            raise InputError(where, f"line {start + 1}: expected the value of {theirs} in the derivatives that start here")
        turned = ours.startswith(("C_l", "C_n")) != ours.endswith(("p", "r"))
        values[ours] = found.get(theirs, math.nan) * (sign if turned else 1.0)
    return values


def _in_body_axes(values: dict[str, float], alpha: float, moments: tuple[float, float]) -> dict[str, float]:
    """Derivatives of body-axis coefficients with body-axis rates, from those in stability axes.

    ``moments`` are Cl' and Cn' of the condition: with incidence the axes turn as well, dCl'/da = (Cl_a cos a + Cn_a sin a) + Cn'.
    """
    cosine, sine = math.cos(alpha), math.sin(alpha)
    body = dict(values)
    body["C_lalpha"] -= moments[1]
    body["C_nalpha"] += moments[0]
    for coefficient in COEFFICIENTS:
        roll, yaw = body[coefficient + "p"], body[coefficient + "r"]
        body[coefficient + "p"] = cosine * roll - sine * yaw
        body[coefficient + "r"] = cosine * yaw + sine * roll
    for variable in VARIABLES:
        roll, yaw = body["C_l" + variable], body["C_n" + variable]
        body["C_l" + variable] = cosine * roll - sine * yaw
        body["C_n" + variable] = cosine * yaw + sine * roll
    return {name: body[name] for name in NAMES}


def _result(where: str, header: dict[str, float], sign: float, derivatives: dict[str, float]) -> OtherCode:
    totals = {ours: header[theirs + "tot"] * (sign if theirs in ("Cl", "Cn") else 1.0) for ours, theirs in COEFFICIENT.items()}
    drag = (("C_Dalpha, C_Dbeta, C_Dp, C_Dq, C_Dr", "not printed by this version of AVL: NaN"),)
    return OtherCode(
        code="AVL",
        source=where,
        alpha=math.radians(header["Alpha"]),
        beta=math.radians(header["Beta"]),
        mach=header["Mach"],
        airspeed=math.nan,
        area=header["Sref"],
        chord=header["Cref"],
        span=header["Bref"],
        reference_point=(header["Xref"], header["Yref"], header["Zref"]),
        coefficients=MappingProxyType(totals),
        derivatives=MappingProxyType(derivatives),
        not_converted=(
            ("lengths", "in the file's own unit, which it does not name"),
            ("airspeed", "not in the file: NaN"),
            ("C_Lalphadot, C_malphadot", "not in the file: its rate derivatives are quasi-steady"),
            ("C_Y", WHOLE_SIDE_FORCE),
            ("control and design variables", "per unit of the model's own variables, whose scale and sign the file does not hold"),
            *(drag if math.isnan(derivatives["C_Dalpha"]) else ()),
        ),
    )
