"""What is flown with a model of one's own: [[test]] entries become manoeuvres and the criteria that are read on them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from levelone.config.manoeuvres import integration_step
from levelone.config.model_schema import TestTable
from levelone.config.model_table import BuiltInTable, Description, FmuTable, JsbsimTable, Test, response_names, whole_steps
from levelone.config.quantities import plain
from levelone.errors import InputError, unknown_name
from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.identification import WINDOWS
from levelone.handling.manoeuvres import MODE_AXES, UNITS, Manoeuvre, pulse, step, sweep
from levelone.handling.records import CHANNEL_UNITS

MOST_SAMPLES = 5_000_000
"""Samples of one record."""
USUAL_DT = 0.004
"""s: sampling interval where neither the test nor the model states one."""
#: criterion -> shapes that it can be read on, the usual one first
SHAPES = {
    "attitude_quickness": ("step", "pulse"),
    "dynamic_stability": ("pulse",),
    "bandwidth": ("sweep",),
    "translational_rate": ("step",),
}
LINEAR_KINDS = ("built-in", "state-space")
_MAKERS: dict[str, Any] = {"step": step, "pulse": pulse, "sweep": sweep}
#: shape, or "linear" -> keys that it needs, and keys that it may have
_SHAPE_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "step": (("amplitude", "duration"), ("on", "dt")),
    "pulse": (("amplitude", "length", "duration"), ("on", "dt")),
    "sweep": (("amplitude", "omega_min", "omega_max", "length"), ("on", "dt", "fade", "settle", "windows", "coherence_min")),
    "linear": (("omega_min", "omega_max"), ("points",)),
}
_CRITERION_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "attitude_quickness": (("axis",), ("delay",)),
    "dynamic_stability": (("axis",), ("delay",)),
    "bandwidth": (("axis", "output", "response_type"), ("sign", "integrate", "method", "phase_reference", "task")),
    "translational_rate": ((), ()),
}
_ALWAYS = ("name", "criterion", "command", "shape")
RESERVED = (
    "assumptions", "campaign", "certainty", "failure_map", "failures", "levels", "model", "provenance", "responses", "summary",
    "values", "worst",
)  # fmt: skip
"""Names of sections of the report, and of the Level over all tests."""
_POINTS = 400
RATES = ("p", "q", "r", "yaw_rate")
"""Outputs of a bandwidth that ``integrate`` turns into the response of an attitude."""
_SETTLE = 5.0


@dataclass(frozen=True)
class _Entry:
    """One entry on its way: its path for errors, its shape, and the model that it is flown with."""

    table: TestTable
    path: str
    shape: str
    linear: bool
    model: Description


def tests_of(tables: Sequence[TestTable], model: Description, task: str) -> tuple[Test, ...]:
    """The tests of a study.

    Parameters
    ----------
    tables
        Entries of the study file.
    model
        Whose commands and channels they use.
    task
        Bandwidth chart of the tests that name none.

    Raises
    ------
    InputError
        A key that is missing or has no place, a command or channel that is not mapped, a manoeuvre that cannot be flown, a record
        of too many samples, names that would give two responses one name.
    """
    for i, table in enumerate(tables):
        if table.name in RESERVED:
            raise InputError(
                f"test.{table.name}.name", f"is a name of the report's own, as are {', '.join(RESERVED)}; choose another"
            )
        if table.name in [other.name for other in tables[:i]]:
            raise InputError(f"test.{table.name}", "is the name of two tests; each needs one of its own")
    tests = tuple(_test(_entry(table, model), task) for table in tables)
    names = [name for name, _, _ in response_names(tests)]
    for name, _, test in response_names(tests):
        if names.count(name) > 1:
            raise InputError(f"test.{test}.name", f"gives a second response {name!r}; choose another name")
    return tests


def _entry(table: TestTable, model: Description) -> _Entry:
    path = f"test.{table.name}"
    if table.criterion not in SHAPES:
        raise unknown_name(f"{path}.criterion", table.criterion, SHAPES)
    shapes = SHAPES[table.criterion]
    shape = table.shape if table.shape is not None else shapes[0]
    if shape not in shapes:
        raise unknown_name(f"{path}.shape", shape, shapes)
    linear = table.method == "linear"
    if linear and model.kind not in LINEAR_KINDS:
        raise InputError(f"{path}.method", f'is "linear", which takes a model of kind {" or ".join(LINEAR_KINDS)}; use "sweep"')
    entry = _Entry(table, path, shape, linear, model)
    _check_keys(entry)
    return entry


def _check_keys(entry: _Entry) -> None:
    """Refuse a key that is missing, or that another shape or criterion has."""
    needed, optional = (
        (*first, *second)
        for first, second in zip(
            _CRITERION_KEYS[entry.table.criterion], _SHAPE_KEYS["linear" if entry.linear else entry.shape], strict=True
        )
    )
    manner = 'with method = "linear"' if entry.linear else f"with a {entry.shape}"
    takes = f"{entry.table.criterion} {manner} takes {', '.join((*needed, *optional))}"
    given = {name for name in type(entry.table).model_fields if getattr(entry.table, name) is not None}
    for name in sorted(given - {*_ALWAYS, *needed, *optional}):
        raise InputError(f"{entry.path}.{name}", f"has no place here: {takes}")
    for name in needed:
        if name not in given:
            raise InputError(f"{entry.path}.{name}", f"missing: {takes}")
    if isinstance(entry.model, BuiltInTable) and entry.table.dt is not None:
        raise InputError(f"{entry.path}.dt", "has no place here: the controller of the built-in vehicle sets it")


def _test(entry: _Entry, task: str) -> Test:
    table = entry.table
    _check_command(entry)
    _check_channels(entry)
    manoeuvre = _manoeuvre(entry)
    chosen: dict[str, Any] = {}
    if table.criterion == "bandwidth":
        chosen = {
            "output": table.output,
            "sign": table.sign or 1,
            "integrate": bool(table.integrate),
            "method": table.method or "sweep",
            "windows": () if entry.linear else _windows(entry, manoeuvre),
            "omega": _omega(entry) if entry.linear else None,
            "response_type": table.response_type,
            "task": table.task or task,
        }
        chosen |= {name: given for name in ("coherence_min", "phase_reference") if (given := getattr(table, name)) is not None}
    if table.delay is not None:
        if entry.model.kind in LINEAR_KINDS:
            raise InputError(f"{entry.path}.delay", f"has no place here: a {entry.model.kind} model knows its own delays")
        chosen["delay"] = table.delay
    return Test(table.name, table.criterion, table.axis, manoeuvre, **chosen)


def _check_command(entry: _Entry) -> None:
    command, path = entry.table.command, f"{entry.path}.command"
    if isinstance(entry.model, BuiltInTable):
        allowed = MODE_AXES[entry.model.flight_mode]
    elif not entry.model.inputs:
        raise InputError("model.inputs", f"missing: {path} is {command!r}, and no input is mapped")
    else:
        allowed = tuple(channel.levelone for channel in entry.model.inputs)
    if command not in allowed:
        raise unknown_name(path, command, allowed)
    if entry.table.criterion == "translational_rate" and command not in ("V_lon", "V_lat"):
        raise InputError(path, f"is {command!r}; translational_rate is read on a commanded speed: V_lon, V_lat")


def _check_channels(entry: _Entry) -> None:
    """Every channel that the criterion reads must come from the model."""
    table = entry.table
    if table.axis is not None and table.axis not in RATE_AND_ATTITUDE:
        raise unknown_name(f"{entry.path}.axis", table.axis, RATE_AND_ATTITUDE)
    if table.integrate and table.output not in RATES:
        raise InputError(f"{entry.path}.integrate", f"is true, but output is {table.output!r}; it takes a rate: {', '.join(RATES)}")
    if table.criterion == "bandwidth":
        needed: tuple[str, ...] = (str(table.output),)
    elif table.criterion == "translational_rate":
        needed = (table.command,)
    else:
        needed = RATE_AND_ATTITUDE[str(table.axis)]
    built_in = isinstance(entry.model, BuiltInTable)
    mapped = list(CHANNEL_UNITS) if built_in else [channel.levelone for channel in entry.model.outputs]
    for channel in needed:
        if channel not in mapped and table.output is not None:
            raise unknown_name(f"{entry.path}.output", channel, mapped) if mapped else InputError("model.outputs", "missing")
        if channel not in mapped:
            what = f"{table.criterion}" + (f" on {table.axis}" if table.axis else "")
            raise InputError(f"model.outputs.{channel}", f"missing: {entry.path} ({what}) reads {' and '.join(needed)}")


def _manoeuvre(entry: _Entry) -> Manoeuvre:
    table, model = entry.table, entry.model
    speed, mode, rate = 0.0, "direct", 0.0
    if isinstance(model, BuiltInTable):
        dt, speed, mode, rate = (
            integration_step(model.vehicle.controller),
            model.trim_speed,
            model.flight_mode,
            model.vehicle.controller.rate,
        )
    else:
        dt, mode = _sampling(entry), next(name for name in _MODES if table.command in MODE_AXES[name])
    fixed: dict[str, Any] = {"trim_speed": speed, "flight_mode": mode, "name": table.name}
    with _at(entry):
        if entry.linear:
            return Manoeuvre(axis=table.command, shape="none", **fixed)  # type: ignore[arg-type]  # checked by Manoeuvre itself
        _check_size(entry, dt)
        amplitude = plain(UNITS[table.command]).func(table.amplitude)  # type: ignore[call-arg,misc]
        options = {name: getattr(table, name) for name in ("on", "length", "duration", "fade", "omega_min", "omega_max", "settle")}
        given = {name: value for name, value in options.items() if value is not None}
        timing = {"dt": dt, "controller_rate": rate or 1.0 / dt}
        made: Manoeuvre = _MAKERS[entry.shape](table.command, amplitude, **fixed, **timing, **given)
        return made


_MODES = ("direct", "velocity", "attitude", "rate")
"""Where a command of a model other than the built-in one is looked for: it has no flight mode of its own."""


def _sampling(entry: _Entry) -> float:
    """Sampling interval of the record, s: a whole number of steps where the model states its step."""
    own = entry.model.step if isinstance(entry.model, JsbsimTable | FmuTable) else None
    dt = entry.table.dt
    if dt is None:
        return own if own is not None else USUAL_DT
    if not dt > 0.0:
        raise InputError(f"{entry.path}.dt", f"is {dt:g} s, must be positive")
    if own is not None:
        whole_steps(dt, own, f"{entry.path}.dt")
    return dt


def _check_size(entry: _Entry, dt: float) -> None:
    table = entry.table
    settle = table.settle if table.settle is not None else _SETTLE
    if settle < 0.0:
        raise InputError("manoeuvre.settle", f"is {settle:g} s, must not be negative")
    on = table.on if table.on is not None else 1.0
    longest = table.duration if table.duration is not None else on + float(table.length or 0.0) + settle
    field = "duration" if table.duration is not None else "length"
    if longest / dt > MOST_SAMPLES:
        raise InputError(f"manoeuvre.{field}", f"makes a record of {longest / dt:.3g} samples; at most {MOST_SAMPLES} are taken")
    if entry.shape == "sweep" and table.omega_max is not None and table.omega_max >= math.pi / dt:
        raise InputError(
            "manoeuvre.omega_max",
            f"{table.omega_max:g} rad/s reaches the Nyquist frequency of samples {dt:g} s apart, {math.pi / dt:.4g} rad/s",
        )


@contextmanager
def _at(entry: _Entry) -> Iterator[None]:
    """Errors of a manoeuvre under the path of its test and the names of its keys."""
    try:
        yield
    except InputError as error:
        name = error.field.removeprefix("manoeuvre").removeprefix(".") or "amplitude"
        raise InputError(f"{entry.path}.{'length' if name == 'off' else name}", error.problem) from None


def _windows(entry: _Entry, manoeuvre: Manoeuvre) -> tuple[float, ...]:
    """Window lengths, s; those of :func:`levelone.handling.identification.identify` where none are given."""
    given = entry.table.windows
    if given is None:
        return tuple(part * manoeuvre.duration for part in WINDOWS)
    for i, window in enumerate(given, 1):
        if not 8.0 * manoeuvre.dt <= window <= manoeuvre.duration:
            raise InputError(
                f"{entry.path}.windows.{i}",
                f"is {window:g} s, must lie within the record of {manoeuvre.duration:g} s and hold 8 samples",
            )
    return tuple(given)


def _omega(entry: _Entry) -> tuple[float, ...]:
    table = entry.table
    low, high = float(table.omega_min or 0.0), float(table.omega_max or 0.0)
    if not 0.0 < low < high:
        raise InputError(f"{entry.path}.omega_max", f"is {high:g} rad/s; needs 0 < omega_min < omega_max, with omega_min = {low:g}")
    return tuple(np.geomspace(low, high, table.points if table.points is not None else _POINTS).tolist())
