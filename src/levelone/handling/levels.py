"""Levels: where the boundaries run, how far they are confirmed, and which side a value lies on.

Boundaries are data: the file that ships, ``library/ads33-levels.toml``, or one of the user's in the same form.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from levelone.errors import InputError, unknown_name
from levelone.handling.history import FloatArray, IntArray
from levelone.handling.toml_files import read_toml_file, subtable

Confidence = Literal["high", "medium", "low"]
DEFAULT = "ads33-levels"
SHIPPED = (DEFAULT, "ads33-roll", "ads33-yaw")


class Level(IntEnum):
    """Handling-qualities Level, with the two ways of having none."""

    UNDEFINED = -1
    """The metric has no value."""
    OUTSIDE = 0
    """The metric lies where the requirement (or its chart, as far as known) says nothing."""
    LEVEL_1 = 1
    LEVEL_2 = 2
    LEVEL_3 = 3


@dataclass(frozen=True, eq=False)
class Chart:
    """Two boundary lines over one metric: above ``level_1_2`` is Level 1, below ``level_2_3`` Level 3.

    Parameters
    ----------
    name
        Path in the file, ``"attitude_quickness.pitch"``.
    level_1_2, level_2_3
        ``[point, 2]``: abscissa (SI) and limit (SI), straight between points and extended straight beyond them.
    low, high
        Range of the abscissa in which the requirement holds, inclusive.
    confidence
        ``"high"``: confirmed; anything else must be drawn as unverified.
    source, note
        Where it comes from, and what to know about it.
    """

    name: str
    level_1_2: FloatArray
    level_2_3: FloatArray
    low: float
    high: float
    confidence: Confidence
    source: str
    note: str = ""

    @property
    def verified(self) -> bool:
        """Whether the boundary is confirmed."""
        return self.confidence == "high"

    def limits(self, x: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Limits of Level 1 and of Level 2 at ``x``, extended straight outside the drawn points."""
        return _extended(x, self.level_1_2), _extended(x, self.level_2_3)

    def levels(self, x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[IntArray, IntArray]:
        """Level, and Level by the extended lines, in the shape of ``x`` and ``y``.

        The first is ``OUTSIDE`` where ``x`` leaves the requirement's range; the second ignores the range.
        """
        abscissa = np.asarray(x, dtype=np.float64)
        extended = _below(np.asarray(y, dtype=np.float64), *self.limits(abscissa))
        inside = (abscissa >= self.low) & (abscissa <= self.high)
        return np.where(inside | (extended == Level.UNDEFINED), extended, Level.OUTSIDE), extended


@dataclass(frozen=True)
class DampingLimits:
    """Limits of the damping ratio over the natural frequency.

    Level 1 needs ``zeta_1`` above ``corner`` (rad/s) and ``zeta_below_corner`` at or below it; Level 2 lets an
    oscillation grow with a real part up to ``growth`` (1/s).
    """

    name: str
    zeta_1: float
    corner: float
    zeta_below_corner: float
    growth: float
    confidence: Confidence
    confidence_zeta_1: Confidence
    source: str
    note: str = ""

    @property
    def verified(self) -> bool:
        """Whether all limits are confirmed; ``confidence_zeta_1`` holds for the Level 1 line above the corner."""
        return self.confidence == "high"

    def limits(self, omega_n: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Limits of zeta for Level 1 and Level 2 at natural frequencies in rad/s."""
        omega = np.asarray(omega_n, dtype=np.float64)
        below = np.where(omega <= self.corner, self.zeta_below_corner, math.nan)
        first = np.where(omega > self.corner, self.zeta_1, below)
        with np.errstate(divide="ignore"):
            return first, np.minimum(-self.growth / omega, first)

    def levels(self, omega_n: npt.ArrayLike, zeta: npt.ArrayLike) -> IntArray:
        """Level of each pair; damping enough for any frequency is Level 1 even where omega_n is undefined."""
        z = np.asarray(zeta, dtype=np.float64)
        level = _below(z, *self.limits(omega_n))
        return np.where(z >= max(self.zeta_1, self.zeta_below_corner), Level.LEVEL_1, level)


@dataclass(frozen=True)
class Boundaries:
    """All boundaries of one file.

    Parameters
    ----------
    attitude_quickness
        By axis: limit of the quickness (1/s) over the smallest attitude change (rad).
    bandwidth
        By task: limit of the bandwidth (rad/s) over the phase delay (s). The standard draws the bandwidth to the right.
    dynamic_stability
        Limits of the damping ratio over the natural frequency.
    limits
        Single limits of criteria without a chart, as the file states them.
    """

    name: str
    source: str
    attitude_quickness: Mapping[str, Chart]
    bandwidth: Mapping[str, Chart]
    dynamic_stability: DampingLimits
    limits: Mapping[str, Mapping[str, Any]]

    def chart(self, criterion: Literal["attitude_quickness", "bandwidth"], key: str) -> Chart:
        """The chart of one criterion for an axis or task.

        Raises
        ------
        InputError
            The file has none.
        """
        charts: Mapping[str, Chart] = getattr(self, criterion)
        if key not in charts:
            raise unknown_name(f"{self.name}: {criterion}", key, charts)
        return charts[key]


def worst(*levels: npt.ArrayLike) -> IntArray:
    """Worst Level of several criteria, element by element.

    Level 3 in one criterion decides; otherwise an undefined one leaves the result undefined; criteria outside their
    range say nothing, and the result is ``OUTSIDE`` only where all of them do.
    """
    stacked = np.stack(np.broadcast_arrays(*(np.asarray(level, dtype=np.int64) for level in levels)))
    highest = stacked.max(axis=0)
    undefined = (stacked == Level.UNDEFINED).any(axis=0) & (highest < Level.LEVEL_3)
    return np.where(undefined, Level.UNDEFINED, highest)


@cache
def load_boundaries(path_or_name: str | PathLike[str] = DEFAULT) -> Boundaries:
    """Boundaries of a library file by name, or of the user's file by its path.

    Raises
    ------
    InputError
        No such file, or a missing, unknown or ill-formed entry.
    """
    where = str(path_or_name)
    folder = resources.files("levelone.handling").joinpath("library")
    shipped = {name: folder.joinpath(f"{name}.toml") for name in SHIPPED}
    if where not in shipped and not where.endswith(".toml"):
        raise unknown_name("boundaries", where, shipped)
    source = shipped[where] if where in shipped else Path(where)
    return _boundaries(where, read_toml_file(source, where))


def _boundaries(where: str, content: dict[str, Any]) -> Boundaries:
    def charts(criterion: str, unit: str, factor: float) -> dict[str, Chart]:
        group = subtable(content.get(criterion, {}), f"{where}: {criterion}")
        return {key: _chart(f"{where}: {criterion}.{key}", table, unit, factor) for key, table in group.items()}

    known = ("schema", "name", "source", "attitude_quickness", "bandwidth", "dynamic_stability", "limits")
    for key in content:
        if key not in known:
            raise unknown_name(where, key, known)
    if content.get("schema") != 1:
        raise InputError(f"{where}: schema", f"is {content.get('schema')!r}, must be 1")
    if "dynamic_stability" not in content:
        raise InputError(f"{where}: dynamic_stability", "missing")
    limits = subtable(content.get("limits", {}), f"{where}: limits")
    return Boundaries(
        name=str(content.get("name", where)),
        source=str(content.get("source", "")),
        attitude_quickness=charts("attitude_quickness", "deg", math.pi / 180.0),
        bandwidth=charts("bandwidth", "s", 1.0),
        dynamic_stability=_damping(f"{where}: dynamic_stability", content["dynamic_stability"]),
        limits={key: subtable(table, f"{where}: limits.{key}") for key, table in limits.items()},
    )


def _chart(name: str, table: dict[str, Any], unit: str, factor: float) -> Chart:
    keys = ("level_1_2", "level_2_3", f"range_{unit}", "confidence", "source", "note")
    for key in subtable(table, name):
        if key not in keys:
            raise unknown_name(name, key, keys)
    low_high = _numbers(f"{name}.{keys[2]}", table.get(keys[2]), (2,))
    if not low_high[0] < low_high[1]:
        raise InputError(f"{name}.{keys[2]}", f"{low_high.tolist()} is reversed")
    return Chart(
        name=name.partition(": ")[2],
        level_1_2=_line(f"{name}.level_1_2", table.get("level_1_2"), factor),
        level_2_3=_line(f"{name}.level_2_3", table.get("level_2_3"), factor),
        low=float(low_high[0]) * factor,
        high=float(low_high[1]) * factor,
        confidence=_confidence(name, table.get("confidence")),
        source=str(table.get("source", "")),
        note=str(table.get("note", "")),
    )


def _damping(name: str, table: dict[str, Any]) -> DampingLimits:
    numbers = ("zeta_1", "corner", "zeta_below_corner", "growth")
    keys = (*numbers, "confidence", "confidence_zeta_1", "source", "note")
    for key in subtable(table, name):
        if key not in keys:
            raise unknown_name(name, key, keys)
    values = {key: float(_numbers(f"{name}.{key}", table.get(key), ())) for key in numbers}
    return DampingLimits(
        name=name.partition(": ")[2],
        **values,
        confidence=_confidence(name, table.get("confidence")),
        confidence_zeta_1=_confidence(name, table.get("confidence_zeta_1", table.get("confidence"))),
        source=str(table.get("source", "")),
        note=str(table.get("note", "")),
    )


def _numbers(field: str, value: Any, shape: tuple[int, ...]) -> FloatArray:
    try:  # not straight to float: NumPy would take the text "0.35" for a number
        numbers = np.asarray(value)
        numbers = numbers.astype(np.float64) if numbers.dtype.kind in "if" else np.full(shape, math.nan)
    except ValueError:
        numbers = np.full(shape, math.nan)
    if numbers.shape != shape or not np.isfinite(numbers).all():
        expected = {(): "a number", (2,): "two numbers"}.get(shape, "pairs of numbers")
        raise InputError(field, f"is {value!r}, must be {expected}")
    return numbers


def _line(field: str, value: Any, factor: float) -> FloatArray:
    count = len(value) if isinstance(value, list) else 0
    points = _numbers(field, value, (max(count, 2), 2))
    if not (np.diff(points[:, 0]) > 0.0).all():
        raise InputError(field, "its first column must increase from point to point")
    return points * np.array([factor, 1.0])


def _confidence(name: str, value: Any) -> Confidence:
    if value not in get_args(Confidence):
        raise unknown_name(f"{name}.confidence", str(value), get_args(Confidence))
    return value


def _extended(x: npt.ArrayLike, points: FloatArray) -> FloatArray:
    abscissa = np.asarray(x, dtype=np.float64)
    segment = np.clip(np.searchsorted(points[:, 0], abscissa) - 1, 0, len(points) - 2)
    x0, y0 = points[segment, 0], points[segment, 1]
    x1, y1 = points[segment + 1, 0], points[segment + 1, 1]
    return y0 + (abscissa - x0) * (y1 - y0) / (x1 - x0)


def _below(y: FloatArray, first: FloatArray, second: FloatArray) -> IntArray:
    """Level of y against both limits; undefined where any of them is NaN."""
    level = np.where(y >= first, Level.LEVEL_1, np.where(y >= second, Level.LEVEL_2, Level.LEVEL_3))
    return np.where(np.isnan(y) | np.isnan(first) | np.isnan(second), Level.UNDEFINED, level)
