"""Which column of a file is which channel: name, unit and sign, stated by the user and by nobody else.

In one line: ``theta=pitch_angle[deg], q=GyroY[deg/s]*-1, delta_lon=stick[in]/5``; or in a file of TOML::

    [columns.theta]
    name = "pitch_angle"
    unit = "deg"
    sign = -1
    offset = 0.5      # in the unit, added after the sign
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from levelone.config.data_files import DataFile, FloatArray, name_and_unit
from levelone.config.files import read_toml
from levelone.config.units import to_si
from levelone.errors import InputError, unknown_name
from levelone.handling.records import CHANNEL_UNITS

_INPUTS = ("delta_lon", "delta_lat", "delta_col", "delta_ped")
CHANNELS: dict[str, str] = {
    "time": "s",
    **CHANNEL_UNITS,
    **{f"{name}_ref": unit for name, unit in CHANNEL_UNITS.items()},
    **dict.fromkeys(_INPUTS, "1"),
}
"""Channels that a column can be, with their SI units. The pilot's controls are fractions: ``delta_lon`` is positive nose up,
``delta_lat`` right, ``delta_col`` up, ``delta_ped`` nose right; ``V_vert`` is positive up, body axes are forward, right, down."""
TIMES = ("time", "t", "timestamp")
"""Names under which a column of time is found when none is given, in any case."""

_LAST = re.compile(r"^(.*\S)\s*([*/])\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*$")
"""A name, and the last operation behind it."""
_KEYS = ("name", "unit", "sign", "scale", "offset")


@dataclass(frozen=True)
class Source:
    """Where a channel comes from: SI value = (``factor`` times the column + ``offset``), turned from ``unit`` into SI.

    ``unit`` is empty where the file's own counts, and ``name`` may still carry it in brackets. ``field`` is what an error names.
    ``text`` is what the user wrote for name and factor in one, until :func:`in_file` has found what of it is the name.
    """

    channel: str
    name: str
    unit: str = ""
    factor: float = 1.0
    offset: float = 0.0
    field: str = "--columns"
    text: str = ""


def parse_columns(text: str, field: str = "--columns") -> dict[str, Source]:
    """A mapping in one line; parts divided by commas.

    Raises
    ------
    InputError
        A part that is not ``channel=column``, an unknown channel, a channel given twice, a factor of zero.
    """
    found: dict[str, Source] = {}
    for part in text.split(","):
        channel, equals, column = (piece.strip() for piece in part.partition("="))
        if not (equals and channel and column):
            raise InputError(field, f"{part.strip()!r} is not CHANNEL=COLUMN; write it like theta=pitch_angle[deg]")
        _check_channel(channel, field, found)
        name, factor = column, 1.0
        while (split := _LAST.match(name)) is not None:
            name, factor = split[1], factor * _factor(split)
        if not (math.isfinite(factor) and factor != 0.0):
            raise InputError(f"{field}: {channel}", f"{column!r} multiplies by {factor:g}; must be finite and not zero")
        found[channel] = Source(channel, name, factor=factor, field=f"{field}: {channel}", text=column)
    return found


def _factor(operation: re.Match[str]) -> float:
    number = float(operation[3])
    if operation[2] == "*":
        return number
    return 1.0 / number if number else math.inf


def read_mapping(path: Path) -> dict[str, Source]:
    """A mapping file with tables ``[columns.CHANNEL]``: name, and if need be unit, sign (1 or -1), scale and offset.

    Raises
    ------
    InputError
        No such file, no TOML, an unknown key or channel, a value of the wrong kind.
    """
    content = read_toml(path)
    for key in content:
        if key != "columns":
            raise unknown_name(str(path), key, ["columns"])
    tables = content.get("columns", {})
    if not (isinstance(tables, Mapping) and tables):
        raise InputError(str(path), "names no channel; write tables like [columns.theta] with name and unit")
    return {channel: _source(f"{path}: columns.{channel}", channel, table) for channel, table in tables.items()}


def _source(field: str, channel: str, table: Any) -> Source:
    _check_channel(channel, field, {})
    if not isinstance(table, Mapping):
        raise InputError(field, f"is {table!r}, must be a table with name and unit")
    for key in table:
        if key not in _KEYS:
            raise unknown_name(field, key, _KEYS)
    for key in ("name", "unit"):
        if not isinstance(table.get(key, ""), str) or (key == "name" and not table.get(key)):
            raise InputError(f"{field}.{key}", f"is {table.get(key)!r}, must be a text")
    numbers = {key: table.get(key, default) for key, default in (("sign", 1), ("scale", 1.0), ("offset", 0.0))}
    for key, value in numbers.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{field}.{key}", f"is {value!r}, must be a finite number")
    if numbers["sign"] not in (1, -1):
        raise InputError(f"{field}.sign", f"is {numbers['sign']}, must be 1 or -1")
    if numbers["scale"] == 0.0:
        raise InputError(f"{field}.scale", "is 0: the channel would be lost")
    factor = float(numbers["sign"] * numbers["scale"])
    return Source(channel, table["name"], table.get("unit", ""), factor, float(numbers["offset"]), field)


def _check_channel(channel: str, field: str, known: Mapping[str, Source]) -> None:
    if channel not in CHANNELS:
        raise unknown_name(field, channel, CHANNELS)
    if channel in known:
        raise InputError(field, f"channel {channel!r} is given twice")


def by_name(file: DataFile) -> dict[str, Source]:
    """The mapping of a file whose columns already bear the names of channels."""
    return {name: Source(name, name, field=f"{file.path.name}: {name}") for name in file.columns if name in CHANNELS}


def source_of_time(file: DataFile, mapping: Mapping[str, Source]) -> Source | None:
    """The column of time: as mapped, or the one called so; None where every column has its own clock."""
    if "time" in mapping:
        return mapping["time"]
    names = {name.lower(): name for name in reversed(file.columns)}
    for wanted in TIMES:
        if wanted in names and file.columns[names[wanted]].clock is None:
            return Source("time", names[wanted], field=f"{file.path.name}: {names[wanted]}")
    if all(column.clock is not None for column in file.columns.values()):
        return None
    raise InputError(str(file.path), "has no column of time; name it: time=COLUMN[s]")


def in_file(file: DataFile, source: Source) -> Source:
    """The source with the name that the file has: a column that bears the longest part of what was written, ``gyro/2`` before
    half of ``gyro``."""
    name, factor = source.text, 1.0
    while name:
        if name in file.columns or name_and_unit(name)[0] in file.columns:
            return replace(source, name=name, factor=factor, text="")
        split = _LAST.match(name)
        if split is None:
            break
        name, factor = split[1], factor * _factor(split)
    return source


def series(file: DataFile, source: Source) -> tuple[FloatArray, FloatArray | None, str]:
    """Values of a channel in SI, the clock of its column, and the unit they were read in; the source as of :func:`in_file`.

    Raises
    ------
    InputError
        No such column, a unit that does not fit, or a control in a unit of its own without the factor to a fraction.
    """
    name, unit = _name_in(file, source)
    column = file.column(name, source.field)
    unit = unit or column.unit
    expected = CHANNELS[source.channel]
    values = column.values if source.factor == 1.0 and source.offset == 0.0 else source.factor * column.values + source.offset
    if expected == "1" and unit not in ("", "1", "percent", "%"):
        if source.factor in (1.0, -1.0):
            raise InputError(
                source.field, f"is in {unit!r}, must be a fraction of full travel: divide by it, {source.channel}={name}[{unit}]/5"
            )
        return values, column.clock, unit
    if not unit or unit == expected:
        return values, column.clock, unit
    if (unit, expected) in (("deg", "rad"), ("deg/s", "rad/s")):  # nearly every record: spares the reading of all units
        return np.radians(values), column.clock, unit
    return to_si(values, unit, expected, source.field), column.clock, unit


def _name_in(file: DataFile, source: Source) -> tuple[str, str]:
    """Name of the column in the file and the unit beside it: a name that the file has as it stands is never taken apart."""
    if source.name in file.columns:
        return source.name, source.unit
    name, unit = name_and_unit(source.name)
    return name, source.unit or unit
