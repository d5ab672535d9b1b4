"""What the readers of other codes' outputs have in common: the result, and numbers that must be numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from levelone.errors import InputError

#: the coefficients, and the variables of their derivatives: C_mq is ``COEFFICIENTS[4] + VARIABLES[3]``
COEFFICIENTS = ("C_L", "C_D", "C_Y", "C_l", "C_m", "C_n")
VARIABLES = ("alpha", "beta", "p", "q", "r")
NAMES = tuple(coefficient + variable for coefficient in COEFFICIENTS for variable in VARIABLES)

#: both codes print the force along y, drag included
WHOLE_SIDE_FORCE = "the whole force along the body's y axis; the flight model adds drag's part itself: its C_Ybeta is this plus C_D"


@dataclass(frozen=True)
class OtherCode:
    """Coefficients and derivatives of one condition, in this package's names, signs and normalisation.

    Lift across and drag along the stream, C_Y to the right along the body's y axis; moments about body axes: C_l right wing down,
    C_m nose up, C_n nose right. Derivatives per rad of alpha (nose up) and beta (wind from the right), and per p b/(2V), q c/(2V),
    r b/(2V) of the body (roll right, nose up, nose right). They are quasi-steady: C_jq holds no part in alphadot.

    Parameters
    ----------
    code, source
        The code, and the name of the file.
    alpha, beta
        Incidence and sideslip of the condition (rad).
    mach, airspeed
        Mach number, and airspeed in the file's own unit; NaN where the file does not state it.
    area, chord, span, reference_point
        Reference values and moment point (x aft, y right, z up), in the file's own unit of length.
    coefficients
        C_L, C_D, C_Y, C_l, C_m, C_n at the condition.
    derivatives
        Every name of ``NAMES``; NaN for one that the file does not hold.
    not_converted
        What was not taken over or holds with a reservation, and why.
    """

    code: str
    source: str
    alpha: float
    beta: float
    mach: float
    airspeed: float
    area: float
    chord: float
    span: float
    reference_point: tuple[float, float, float]
    coefficients: Mapping[str, float]
    derivatives: Mapping[str, float]
    not_converted: tuple[tuple[str, str], ...]


def number(where: str, line: int, name: str, text: str) -> float:
    """A finite number; InputError with file, line and name otherwise (Fortran fills a field that is too narrow with asterisks)."""
    try:
        value = float(text)
    except ValueError:
        raise InputError(where, f"line {line}: {name} must be a number, got {text!r}") from None
    if not math.isfinite(value):
        raise InputError(where, f"line {line}: {name} must be a finite number, got {text!r}")
    return value


def positive(where: str, values: Mapping[str, float], names: tuple[str, ...]) -> None:
    """InputError for the first reference value that is not positive."""
    for name in names:
        if not values[name] > 0.0:
            raise InputError(where, f"{name} must be positive, got {values[name]:g}")
