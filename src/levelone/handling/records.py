"""Records of one run: plain arrays or a CSV file, read into and written from a :class:`TimeHistory`.

A file written here holds all that a criterion needs in comments ahead of its columns and is read back to the last bit::

    # input_name = V_lon_ref
    # input_on = 1.0
    # trim.q = 0.0
    time[s],V_lon_ref[m/s],q[rad/s]
    0.0,5.0,0.0

A flight test's own file needs the row of names only (units in brackets are optional, SI and rad without them); the
times of the input are then arguments, and the trim is the mean before the input.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from os import PathLike
from pathlib import Path

import numpy as np
import numpy.typing as npt

from levelone.errors import InputError, unknown_name
from levelone.handling.axes import without_jumps
from levelone.handling.history import FloatArray, TimeHistory

CHANNEL_UNITS = {
    **dict.fromkeys(("x_north", "y_east", "altitude"), "m"),
    **dict.fromkeys(("V_lon", "V_lat", "V_vert", "u", "v", "w", "airspeed"), "m/s"),
    **dict.fromkeys(("phi", "theta", "psi", "alpha", "beta"), "rad"),
    **dict.fromkeys(("p", "q", "r", "yaw_rate"), "rad/s"),
}
"""SI unit of each channel that the package knows by name; ``*_ref`` has the unit of its channel."""

_DEGREES = {"deg": ("rad", math.pi / 180.0), "deg/s": ("rad/s", math.pi / 180.0)}
_COLUMN = re.compile(r"^\s*([^\[\],]+?)\s*(?:\[([^\]]*)\])?\s*$")
_FILE = str | PathLike[str]


def record(
    time: npt.ArrayLike,
    channels: Mapping[str, npt.ArrayLike],
    *,
    input_name: str,
    input_on: float,
    input_off: float = math.nan,
    delay: float = 0.0,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
    trim: Mapping[str, float] | None = None,
    units: Mapping[str, str] | None = None,
    status: int = 0,
    extremes: Mapping[str, float] | None = None,
    name: str = "",
) -> TimeHistory:
    """One run from plain arrays of shape ``[time]``, SI and rad.

    A channel without a ``trim`` value takes its mean before ``input_on``; one without a unit takes that of its name. The mean of
    a heading or bank angle is that without whole turns between samples.

    Raises
    ------
    InputError
        As :class:`TimeHistory`; or a trim is needed and the record holds no sample before the input.
    """
    t = np.asarray(time, dtype=np.float64)
    series = {key: np.atleast_2d(np.asarray(values, dtype=np.float64)) for key, values in channels.items()}
    for group, given in (("trim", trim), ("units", units)):
        for key in given or {}:
            if key not in series:
                raise unknown_name(group, key, series)
    known = trim or {}
    trims = {
        key: np.array([float(known[key])]) if key in known else _mean_before(t, without_jumps(key, values), input_on, key)
        for key, values in series.items()
    }
    return TimeHistory(
        time=t,
        channels=series,
        units={key: (units or {}).get(key, _known_unit(key) or "") for key in series},
        trim=trims,
        input_name=input_name,
        input_on=float(input_on),
        input_off=float(input_off),
        delay=np.array([float(delay)]),
        wind=wind,
        status=np.array([int(status)], dtype=np.int64),
        extremes={key: np.array([float(value)]) for key, value in (extremes or {}).items()},
        name=name,
    )


def write_csv(history: TimeHistory, path: _FILE, run: int = 0) -> None:
    """Write one run with its trim, input times, delay and status in comments; numbers keep every bit.

    Raises
    ------
    InputError
        No such run, a channel's name that a header row cannot hold, or a path that cannot be written.
    """
    if not 0 <= run < history.n_runs:
        raise InputError("run", f"{run} is not among the {history.n_runs} runs of the record")
    names = list(history.channels)
    for key in names:
        found = _COLUMN.match(key)
        if found is None or found.group(1) != key or key == "time":
            raise InputError(f"channels.{key}", "a CSV column's name may hold no comma or bracket, and is not 'time'")
    lines = [f"# {key} = {value}" for key, value in _header(history, run).items()]
    lines.append(",".join(["time[s]", *(f"{key}[{history.units[key]}]" for key in names)]))
    table = np.column_stack([history.time, *(history.channels[key][run] for key in names)])
    lines.extend(",".join(map(repr, row)) for row in table.tolist())
    try:
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from error


def read_csv(
    path: _FILE,
    *,
    input_name: str | None = None,
    input_on: float | None = None,
    input_off: float | None = None,
    delay: float | None = None,
    trim: Mapping[str, float] | None = None,
) -> TimeHistory:
    """Read one run; arguments take precedence over the file's comments.

    Columns in ``deg`` or ``deg/s`` become rad and rad/s, with their trim; other units must be SI already. ``trim``
    given as an argument is SI.

    Raises
    ------
    InputError
        The file cannot be read, a cell is not a number, a known channel is not in SI, or the input is not stated.
    """
    comments, header, rows = _split(path)
    table = _numbers(path, header, rows)
    names, units, scales = _columns(path, header)
    if "time" not in names:
        raise InputError(str(path), f"has no column 'time'; columns: {', '.join(names)}")
    name_of_input = input_name if input_name is not None else comments.get("input_name")
    if name_of_input is None or (input_on is None and "input_on" not in comments):
        missing = "input_name" if name_of_input is None else "input_on"
        raise InputError(missing, f"{path} does not state it: give it as an argument")

    def number(key: str, given: float | None, default: str) -> float:
        return float(given) if given is not None else _number(path, key, comments.get(key, default))

    scale_of = dict(zip(names, scales, strict=True))
    file_trim = {key: value * scale_of.get(key, 1.0) for key, value in _group(path, comments, "trim.").items()}
    wind = [_number(path, "wind", text) for text in comments.get("wind", "0,0,0").split(",")]
    series = [key for key in names if key != "time"]
    return record(
        table[:, names.index("time")],
        {key: table[:, names.index(key)] * scale_of[key] for key in series},
        input_name=name_of_input,
        input_on=number("input_on", input_on, "nan"),
        input_off=number("input_off", input_off, "nan"),
        delay=number("delay", delay, "0"),
        wind=tuple(wind),  # type: ignore[arg-type]  # TimeHistory checks the length
        trim={**file_trim, **(trim or {})},
        units={key: units[names.index(key)] for key in series},
        status=int(number("status", None, "0")),
        extremes=_group(path, comments, "extremes."),
        name=comments.get("name", ""),
    )


def _header(history: TimeHistory, run: int) -> dict[str, str]:
    return {
        "name": " ".join(history.name.split()),
        "input_name": history.input_name,
        "input_on": repr(float(history.input_on)),
        "input_off": repr(float(history.input_off)),
        "delay": repr(float(history.delay[run])),
        "wind": ", ".join(repr(float(speed)) for speed in history.wind),
        "status": str(int(history.status[run])),
        **{f"trim.{key}": repr(float(values[run])) for key, values in history.trim.items()},
        **{f"extremes.{key}": repr(float(values[run])) for key, values in history.extremes.items()},
    }


def _group(path: _FILE, comments: Mapping[str, str], prefix: str) -> dict[str, float]:
    found = {key: text for key, text in comments.items() if key.startswith(prefix)}
    return {key.removeprefix(prefix): _number(path, key, text) for key, text in found.items()}


def _split(path: _FILE) -> tuple[dict[str, str], str, list[tuple[int, str]]]:
    """Comments as keys and values, the row of names, and the rows of numbers with their line numbers."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
        raise InputError(str(path), f"cannot be read: {reason}") from error
    comments: dict[str, str] = {}
    rows: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("#"):
            key, equals, value = line[1:].partition("=")
            if equals:
                comments[key.strip()] = value.strip()
        elif line.strip():
            rows.append((number, line))
    if len(rows) < 3:
        raise InputError(str(path), "holds no record: a row of names and two rows of numbers are the least")
    return comments, rows[0][1], rows[1:]


def _columns(path: _FILE, header: str) -> tuple[list[str], list[str], list[float]]:
    """Name, SI unit and factor to SI of each column."""
    names, units, scales = [], [], []
    for cell in header.split(","):
        found = _COLUMN.match(cell)
        if found is None:
            raise InputError(str(path), f"column {cell!r} is not a name, or name[unit]")
        name = found.group(1)
        known = "s" if name == "time" else _known_unit(name)
        unit = found.group(2).strip() if found.group(2) is not None else known or ""
        unit, scale = _DEGREES.get(unit, (unit, 1.0))
        if known is not None and unit != known:
            raise InputError(f"{path}: {name}", f"is in {unit!r}, must be in {known} (angles may be in deg)")
        if name in names:
            raise InputError(f"{path}: {name}", "stands in two columns")
        names.append(name)
        units.append(unit)
        scales.append(scale)
    return names, units, scales


def _numbers(path: _FILE, header: str, rows: list[tuple[int, str]]) -> FloatArray:
    width = header.count(",") + 1
    table = np.empty((len(rows), width))
    for k, (number, line) in enumerate(rows):
        cells = line.split(",")
        if len(cells) != width:
            raise InputError(f"{path}: line {number}", f"has {len(cells)} cells, the row of names has {width}")
        for column, cell in enumerate(cells):
            table[k, column] = _number(path, f"line {number}", cell)
    return table


def _number(path: _FILE, where: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{path}: {where}", f"{text.strip()!r} is not a number") from None


def _known_unit(name: str) -> str | None:
    base = name.removesuffix("_ref")
    return "1" if base.startswith("throttle_") else CHANNEL_UNITS.get(base)


def _mean_before(time: FloatArray, values: FloatArray, input_on: float, name: str) -> FloatArray:
    if values.shape[-1] != time.size:
        raise InputError(f"channels.{name}", f"has {values.shape[-1]} samples, time has {time.size}")
    before = time < input_on - 1e-9
    if not before.any():
        raise InputError(f"trim.{name}", f"no sample before the input at {input_on} s to take the trim from: give its value")
    return values[:, before].mean(axis=1)
