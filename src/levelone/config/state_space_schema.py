"""Sections of a state-space file. An entry of a matrix is a number or the name of a parameter, perhaps with a minus before it."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from levelone.config.schema import Finite, Strict, Text, shown
from levelone.errors import InputError

MOST = 200
"""Most states, inputs or outputs of a file."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
Names = Annotated[list[Name], Field(min_length=1, max_length=MOST)]
Units = Annotated[list[Text], Field(min_length=1, max_length=MOST)]
Sign = Literal[1, -1]


def _entry(given: Any) -> float | str:
    if isinstance(given, str) and given:
        return given
    if isinstance(given, int | float) and not isinstance(given, bool) and math.isfinite(given):
        return float(given)
    raise InputError("", f"{shown(given)} is neither a finite number nor the name of a parameter")


def _entries(given: Any) -> list[float | str]:
    if not isinstance(given, list) or len(given) > MOST:
        raise InputError("", f"{shown(given)} is not a list of up to {MOST} numbers or names of parameters")
    return [_entry(each) for each in given]


def _matrix(given: Any) -> list[list[float | str]] | str:
    if isinstance(given, str) and given.endswith(".csv"):
        return given
    if not isinstance(given, list) or not 0 < len(given) <= MOST:
        raise InputError("", f"{shown(given)} is neither a list of up to {MOST} rows nor the name of a .csv file")
    return [_entries(row) for row in given]


# one validator in place of a union, whose errors would name the branches that were tried
Entry = Annotated[Any, AfterValidator(_entry)]
Entries = Annotated[Any, AfterValidator(_entries)]
Matrix = Annotated[Any, AfterValidator(_matrix)]


class System(Strict):
    """[system]"""

    name: Text
    source: Text | None = None
    notes: Text | None = None


class Quantities(Strict):
    """[states]: names and units."""

    names: Names
    units: Units


class Late(Quantities):
    """[inputs] or [outputs]: names, units and delays."""

    delay: Entries | None = None


class Matrices(Strict):
    """[matrices]: without C the states are the outputs; without D it is zero."""

    A: Matrix
    B: Matrix
    C: Matrix | None = None
    D: Matrix | None = None


class Actuator(Strict):
    """[[actuator]]: the same second-order actuator before each of the inputs that it names."""

    inputs: Names
    omega: Entry
    zeta: Entry


class Integral(Strict):
    """[[feedback.integral]]: what is integrated, a command taken from it."""

    of: Annotated[dict[str, Entry], Field(min_length=1, max_length=MOST)]
    command: Text | None = None


class Feedback(Strict):
    """[feedback]: the law v = sign_x K_x x + sign_i K_i e + K_r r.

    ``controls`` are v, which are inputs unless there is an allocation; ``internal`` are controls that are no inputs but commands
    inside the law.
    """

    controls: Names
    states: Names
    Kx: Matrix
    sign_x: Sign
    Ki: Matrix | None = None
    sign_i: Sign | None = None
    Kr: Matrix | None = None
    delay: Entry = 0.0
    internal: Annotated[list[Text], Field(max_length=MOST, default_factory=list)]
    commands: Quantities
    integral: Annotated[list[Integral], Field(max_length=MOST, default_factory=list)]


class Allocation(Strict):
    """[allocation]: the controls of the law shared among others by weights; ``effect`` is what these do to those."""

    controls: Names
    weights: Annotated[list[Finite], Field(min_length=1, max_length=MOST)]
    effect: Matrix


class StateSpace(Strict):
    """A whole state-space file."""

    system: System
    parameters: Annotated[dict[Name, Finite], Field(max_length=1000, default_factory=dict)]
    states: Quantities
    inputs: Late
    outputs: Late | None = None
    matrices: Matrices
    actuator: Annotated[list[Actuator], Field(max_length=MOST, default_factory=list)]
    feedback: Feedback | None = None
    allocation: Allocation | None = None
