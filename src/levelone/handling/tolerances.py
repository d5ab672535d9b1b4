"""Simulation against flight, metric by metric, with the difference that is allowed.

The tolerances that ship are those of 14 CFR Part 60 Appendix C for helicopter simulators; they are data, and each names
its paragraph. A tolerance given as a value and as a percentage is met where the difference stays within either.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any, Literal, get_args

from levelone.errors import InputError, unknown_name
from levelone.handling.levels import Confidence

Verdict = Literal["within", "outside", "undefined", "no tolerance"]
DEFAULT = "fidelity-tolerances"

_ROUNDING = 1e-12
_SI = {"deg": ("rad", math.pi / 180.0), "deg/s": ("rad/s", math.pi / 180.0)}
_KEYS = ("absolute", "relative", "unit", "paragraph", "source", "confidence", "note")


@dataclass(frozen=True)
class Tolerance:
    """Difference of one metric that is allowed.

    Parameters
    ----------
    name
        Of the metric.
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
) -> tuple[MetricRow, ...]:
    """Difference and verdict of every metric, in the order of ``flight``, then of those that only ``simulation`` has.

    Parameters
    ----------
    flight, simulation
        Values, SI; NaN for one that could not be read. A metric that one of both lacks is NaN there.
    tolerances
        By metric; by default those of :func:`load_tolerances`. A metric without one gets its difference and the verdict
        ``"no tolerance"``.

    Notes
    -----
    ``"undefined"`` comes first: a metric that one side could not read is never within a tolerance, and never without one.
    A difference that equals the allowed one but for rounding is within.

    Examples
    --------
    >>> [row.verdict for row in compare_metrics({"zeta": 0.35, "omega_bw": 2.0}, {"zeta": 0.36, "omega_bw": 2.1})]
    ['within', 'no tolerance']
    """
    known = load_tolerances() if tolerances is None else tolerances
    names = dict.fromkeys([*flight, *simulation])
    return tuple(_row(name, flight.get(name, math.nan), simulation.get(name, math.nan), known.get(name)) for name in names)


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

    Raises
    ------
    InputError
        The file cannot be read, or an entry is missing, unknown or ill-formed.
    """
    source = Path(path) if path is not None else resources.files("levelone.handling").joinpath(f"library/{DEFAULT}.toml")
    try:
        content = tomllib.loads(source.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(str(source), f"cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(str(source), f"is not a TOML file: {error}") from error
    where = DEFAULT if path is None else str(path)
    known = ("schema", "name", "source", "tolerance")
    for key in content:
        if key not in known:
            raise unknown_name(where, key, known)
    if content.get("schema") != 1:
        raise InputError(f"{where}: schema", f"is {content.get('schema')!r}, must be 1")
    tables = content.get("tolerance")
    if not isinstance(tables, dict) or not all(isinstance(table, dict) for table in tables.values()):
        raise InputError(f"{where}: tolerance", "must hold one table for each metric")
    origin = str(content.get("source", ""))
    return {name: _tolerance(f"{where}: tolerance.{name}", name, table, origin) for name, table in tables.items()}


def _tolerance(where: str, name: str, table: Mapping[str, Any], origin: str) -> Tolerance:
    for key in table:
        if key not in _KEYS:
            raise unknown_name(where, key, _KEYS)
    if "unit" not in table:
        raise InputError(f"{where}.unit", "missing")
    if table.get("confidence") not in get_args(Confidence):
        raise unknown_name(f"{where}.confidence", str(table.get("confidence")), get_args(Confidence))
    absolute, relative = (_number(f"{where}.{key}", table.get(key)) for key in ("absolute", "relative"))
    if math.isnan(absolute) and math.isnan(relative):
        raise InputError(where, "states neither an absolute nor a relative tolerance")
    unit, factor = _SI.get(str(table["unit"]), (str(table["unit"]), 1.0))
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
