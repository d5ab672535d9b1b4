"""Simulation against flight, metric by metric, with the difference that is allowed.

The tolerances that ship are those of 14 CFR Part 60 Appendix C for helicopter simulators; they are data, and each names
its paragraph. A tolerance given as a value and as a percentage is met where the difference stays within either.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any, Literal, get_args

from levelone.errors import InputError, unknown_name
from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.levels import Confidence
from levelone.handling.toml_files import read_toml_file, subtable

Verdict = Literal["within", "outside", "undefined", "no tolerance"]
DEFAULT = "fidelity-tolerances"

_ROUNDING = 1e-12
_DEG = math.pi / 180.0
_UNITS = {
    **{unit: (unit, 1.0) for unit in ("1", "s", "1/s", "rad", "rad/s", "m", "m/s")},
    "deg": ("rad", _DEG),
    "deg/s": ("rad/s", _DEG),
}
"""Units that a tolerance may be stated in: SI unit of the metric, and the factor to it."""
_KEYS = ("absolute", "relative", "unit", "paragraph", "source", "confidence", "note")


@dataclass(frozen=True)
class Tolerance:
    """Difference of one metric that is allowed.

    Parameters
    ----------
    name
        Of the metric, behind its axis and a dot where it holds for one only.
    absolute
        SI; NaN where none is stated.
    relative
        Fraction of the value from flight; NaN where none is stated.
    unit
        SI unit of the metric.
    paragraph, source
        Where it comes from.
    confidence
        ``"high"``: confirmed; anything else must be drawn as unverified.
    note
        What to know about it.
    """

    name: str
    absolute: float
    relative: float
    unit: str
    paragraph: str
    source: str
    confidence: Confidence
    note: str = ""

    def allowed(self, flight: float) -> float:
        """Largest difference that is allowed beside a value from flight, in the metric's unit; NaN where that is."""
        if math.isnan(flight):
            return math.nan
        return max(limit for limit in (self.absolute, self.relative * abs(flight)) if not math.isnan(limit))


@dataclass(frozen=True)
class MetricRow:
    """One metric of simulation and flight; ``difference`` is simulation less flight, ``allowed`` the largest magnitude."""

    name: str
    flight: float
    simulation: float
    difference: float
    allowed: float
    verdict: Verdict
    tolerance: Tolerance | None


def compare_metrics(
    flight: Mapping[str, float],
    simulation: Mapping[str, float],
    tolerances: Mapping[str, Tolerance] | None = None,
    *,
    axis: str = "",
) -> tuple[MetricRow, ...]:
    """Difference and verdict of every metric, in the order of ``flight``, then of those that only ``simulation`` has.

    Parameters
    ----------
    flight, simulation
        Values, SI; NaN for one that could not be read. A metric that one of both lacks is NaN there.
    tolerances
        By metric; by default those of :func:`load_tolerances`. A metric without one gets its difference and the verdict
        ``"no tolerance"``.
    axis
        Of the motion: tolerances of this axis come before those of any.

    Notes
    -----
    ``"undefined"`` comes first: a metric that one side could not read is never within a tolerance, and never without one.
    A difference that equals the allowed one but for rounding is within.

    Examples
    --------
    >>> rows = compare_metrics({"zeta": 0.35, "omega_bw": 2.0}, {"zeta": 0.36, "omega_bw": 2.1}, axis="roll")
    >>> [row.verdict for row in rows]
    ['within', 'no tolerance']
    """
    known = load_tolerances() if tolerances is None else tolerances
    names = dict.fromkeys([*flight, *simulation])
    return tuple(
        _row(name, flight.get(name, math.nan), simulation.get(name, math.nan), tolerance_of(known, name, axis)) for name in names
    )


def tolerance_of(tolerances: Mapping[str, Tolerance], name: str, axis: str = "") -> Tolerance | None:
    """The tolerance of a metric on an axis, otherwise that of any axis, otherwise None."""
    return tolerances.get(f"{axis}.{name}", tolerances.get(name))


def _row(name: str, flight: float, simulation: float, tolerance: Tolerance | None) -> MetricRow:
    difference = simulation - flight
    allowed = math.nan if tolerance is None else tolerance.allowed(flight)
    verdict: Verdict
    if not math.isfinite(difference):
        difference, verdict = math.nan, "undefined"
    elif tolerance is None:
        verdict = "no tolerance"
    else:
        slack = _ROUNDING * max(abs(flight), abs(simulation))
        verdict = "within" if abs(difference) <= allowed + slack else "outside"
    return MetricRow(name, float(flight), float(simulation), float(difference), float(allowed), verdict, tolerance)


@cache
def load_tolerances(path: str | PathLike[str] | None = None) -> Mapping[str, Tolerance]:
    """Tolerances by metric: those that ship, or the user's from a TOML file of the same form.

    One for a single axis (table ``tolerance.yaw.damped_period``) stands under ``"yaw.damped_period"``.

    Raises
    ------
    InputError
        The file cannot be read, or an entry is missing, unknown or ill-formed, its unit not one of SI nor deg or deg/s.
    """
    source = Path(path) if path is not None else resources.files("levelone.handling").joinpath(f"library/{DEFAULT}.toml")
    content = read_toml_file(source, str(source))
    where = DEFAULT if path is None else str(path)
    known = ("schema", "name", "source", "tolerance")
    for key in content:
        if key not in known:
            raise unknown_name(where, key, known)
    if content.get("schema") != 1:
        raise InputError(f"{where}: schema", f"is {content.get('schema')!r}, must be 1")
    if "tolerance" not in content:
        raise InputError(f"{where}: tolerance", "missing: one table for each metric")
    origin = str(content.get("source", ""))
    tables: dict[str, Any] = {}
    for name, table in subtable(content["tolerance"], f"{where}: tolerance").items():
        if name in RATE_AND_ATTITUDE:
            tables |= {f"{name}.{metric}": each for metric, each in subtable(table, f"{where}: tolerance.{name}").items()}
        else:
            tables[name] = table
    return {name: _tolerance(f"{where}: tolerance.{name}", name, table, origin) for name, table in tables.items()}


def _tolerance(where: str, name: str, table: Any, origin: str) -> Tolerance:
    for key in subtable(table, where):
        if key not in _KEYS:
            raise unknown_name(where, key, _KEYS)
    if "unit" not in table:
        raise InputError(f"{where}.unit", "missing")
    if not isinstance(table["unit"], str) or table["unit"] not in _UNITS:
        raise unknown_name(f"{where}.unit", str(table["unit"]), _UNITS)
    if table.get("confidence") not in get_args(Confidence):
        raise unknown_name(f"{where}.confidence", str(table.get("confidence")), get_args(Confidence))
    absolute, relative = (_number(f"{where}.{key}", table.get(key)) for key in ("absolute", "relative"))
    if math.isnan(absolute) and math.isnan(relative):
        raise InputError(where, "states neither an absolute nor a relative tolerance")
    unit, factor = _UNITS[table["unit"]]
    return Tolerance(
        name=name,
        absolute=absolute * factor,
        relative=relative,
        unit=unit,
        paragraph=str(table.get("paragraph", "")),
        source=str(table.get("source", origin)),
        confidence=table["confidence"],
        note=str(table.get("note", "")),
    )


def _number(field: str, value: object) -> float:
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or not (math.isfinite(value) and value > 0.0):
        raise InputError(field, f"is {value!r}, must be a positive number")
    return float(value)
