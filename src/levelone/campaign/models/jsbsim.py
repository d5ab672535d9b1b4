"""Aircraft of JSBSim: properties in, records out.

Time of a record. JSBSim advances its state to a frame's time, then reads the commands and computes the controls, forces and
accelerations of that same time, which act until the next. The command of sample k is therefore set before the frame that ends at
t_k = k dt, and the channels are read after it: the pairs that JSBSim's own output would log, with no delay of a frame between them.

Order of what is set, because it decides what a number means: the random seed and the step; the aircraft, whose control elements
take the step as it then is; ``initial``, and ``fixed`` and factors under ``ic/``; the initial conditions; the engines; the other
``fixed`` and factors; ``set``, in the order of the file; the inputs of trim. A trim that ``set`` asks for
(``simulation/do_simple_trim``) is therefore that of the aircraft with its factors.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from levelone.campaign.models.keys import files_digest, plain, versions
from levelone.campaign.models.mapping import channel_history, command_values, to_si
from levelone.campaign.models.protocol import FloatArray, ModelFailure
from levelone.errors import InputError, closest, unknown_name
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import Channel, JsbsimTable
    from levelone.handling.history import TimeHistory
    from levelone.handling.manoeuvres import Manoeuvre

#: what the end of a property's name says of its unit, by JSBSim's own convention
SUFFIXES = {"rad": "rad", "deg": "deg", "rad_sec": "rad/s", "deg_sec": "deg/s", "ft": "ft", "fps": "ft/s", "kts": "kt", "norm": "1"}
Listing = Mapping[str, str]


def _library() -> Any:
    try:
        import jsbsim
    except ImportError:
        raise InputError("model.kind", 'a "jsbsim" model needs the package jsbsim: pip install levelone[jsbsim]') from None
    return jsbsim


@dataclass(frozen=True)
class JsbsimSource:
    """One aircraft of JSBSim as a simulation that can be flown.

    Parameters
    ----------
    table
        The aircraft, what is set in it, and the properties that commands and channels map to.
    targets
        Property that each column of a point sets, in JSBSim's unit.

    Raises
    ------
    InputError
        JSBSim is not installed; there is no such aircraft, or it cannot be read; a property that it does not have, that cannot be
        set or read, or whose name says another unit than the study; a factor that is set twice.
    """

    table: JsbsimTable
    targets: tuple[str, ...]

    def __post_init__(self) -> None:
        with _listening() as said:
            aircraft = _loaded(self.table, said)
            _check(self.table, self.targets, _listing(aircraft))

    @cached_property
    def key(self) -> Mapping[str, Any]:
        """Description, version of JSBSim, and a hash of the aircraft with all engines and systems that it can name."""
        root = Path(_library().get_default_root_dir())
        folder = self.table.folder or root / "aircraft"
        own = folder / self.table.aircraft
        return {
            "source": plain({**_options(self.table), "targets": self.targets}),
            "aircraft": files_digest(own, (path for path in own.rglob("*") if path.is_file()), "model.aircraft"),
            "parts": files_digest(root, (p for part in ("engine", "systems") for p in (root / part).rglob("*.xml")), "model.kind"),
            **versions("jsbsim"),
        }

    def fly(self, point: FloatArray, manoeuvre: Manoeuvre) -> TimeHistory:
        """One run, sampled at the manoeuvre's ``dt``: as of :class:`levelone.campaign.models.protocol.HistorySource`.

        Raises
        ------
        InputError
            ``dt`` is no multiple of JSBSim's step.
        ModelFailure
            TRIM_FAILED; DIVERGED: it touches the ground; MODEL_FAILED: JSBSim ends the run, with its messages; see also
            :func:`levelone.campaign.models.mapping.channel_history`.
        """
        frames = _frames(manoeuvre.dt, self.table.step)
        jsbsim = _library()
        with _listening() as said:
            try:
                aircraft = _loaded(self.table, said)
                _begin(aircraft, self.table, list(zip(self.targets, map(float, point), strict=True)))
                time, channels = _fly(aircraft, self.table, manoeuvre, frames)
            except jsbsim.TrimFailureError as error:
                raise ModelFailure(Status.TRIM_FAILED, f"{error}\n{_text(said)}") from None
            except (jsbsim.BaseError, RuntimeError) as error:
                raise ModelFailure(Status.MODEL_FAILED, f"{error}\n{_text(said)}") from None
        return channel_history(time, channels, manoeuvre)


def _options(table: JsbsimTable) -> dict[str, Any]:
    """The description without the place of its files, which a hash stands for."""
    return {name: getattr(table, name) for name in table.__dataclass_fields__ if name != "folder"}


@contextmanager
def _listening() -> Iterator[list[str]]:
    """What JSBSim says in this thread is kept instead of printed."""
    jsbsim = _library()
    said: list[str] = []

    class Listener(jsbsim.FGLogger):
        def message(self, message: str) -> None:
            said.append(message)

        def file_location(self, filename: str, line: int) -> None:
            said.append(f"{filename}, line {line}: ")

        def format(self, format: Any) -> None:
            """Colours mean nothing here."""

        def flush(self) -> None:
            said.append("\n")

    before = jsbsim.get_logger()
    jsbsim.set_logger(Listener())
    try:
        yield said
    finally:
        jsbsim.set_logger(before)


def _text(said: Sequence[str]) -> str:
    return re.sub(r"\n\s*\n+", "\n", "".join(said)).strip()


def _loaded(table: JsbsimTable, said: list[str]) -> Any:
    """A fresh simulation with the aircraft in it; its own output files are switched off."""
    jsbsim = _library()
    aircraft = jsbsim.FGFDMExec(None)
    if table.folder is not None:
        aircraft.set_aircraft_path(str(table.folder))
    aircraft.set_debug_level(0)
    aircraft["simulation/randomseed"] = table.random_seed
    # before the aircraft: its filters and derivatives keep the step that they were loaded with
    aircraft.set_dt(table.step)
    folder = table.folder or Path(jsbsim.get_default_root_dir()) / "aircraft"
    if not (folder / table.aircraft / f"{table.aircraft}.xml").is_file():
        known = [path.name for path in folder.glob("*") if (path / f"{path.name}.xml").is_file()]
        raise InputError("model.aircraft", f"no aircraft {table.aircraft!r} in {folder}; {closest(table.aircraft, known)}")
    said.clear()
    try:
        loaded = aircraft.load_model(table.aircraft)
    except (jsbsim.BaseError, RuntimeError) as error:
        raise InputError("model.aircraft", f"JSBSim cannot read {table.aircraft!r}: {error}") from None
    if not loaded:
        raise InputError("model.aircraft", f"JSBSim cannot read {table.aircraft!r}: {_text(said)[-500:]}")
    output = 0
    while aircraft.set_output_filename(output, os.devnull):  # it is opened even where output is disabled
        output += 1
    aircraft.disable_output()
    return aircraft


def _plain_name(name: str) -> str:
    """A property's name without the index 0, which may be written or left out at every level."""
    return name.replace("[0]", "")


def _listing(aircraft: Any) -> Listing:
    """Properties of an aircraft, each with what may be done to it: R, W or RW."""
    lines = aircraft.query_property_catalog("").splitlines()
    pairs = (line.strip().rpartition(" ") for line in lines if line.strip().endswith(")"))
    return {_plain_name(name): access.strip("()") for name, _, access in pairs}


def _check(table: JsbsimTable, targets: Sequence[str], listing: Listing) -> None:
    for where, names in (("initial", table.initial), ("set", table.set), ("fixed", table.fixed)):
        for name, _ in names:
            _check_property(f"model.{where}", name, "W", listing)
    for target in targets:
        _check_property("factor.target", target, "W", listing)
    for group, channels, access in (("inputs", table.inputs, "W"), ("outputs", table.outputs, "R")):
        for channel in channels:
            field = f"model.{group}.{channel.levelone}"
            _check_property(f"{field}.name", channel.name, access, listing)
            _check_unit(f"{field}.unit", channel)
    seen: set[str] = set()
    for name in (*(name for part in (table.initial, table.set, table.fixed) for name, _ in part), *targets):
        if _plain_name(name) in seen:
            raise InputError("model.set", f"property {name!r} is set twice: which value holds would be hidden in the order")
        seen.add(_plain_name(name))


def _check_property(field: str, name: str, access: str, listing: Listing) -> None:
    allowed = listing.get(_plain_name(name))
    if allowed is None:
        raise unknown_name(field, name, listing)
    if access not in allowed:
        able = [each for each, how in listing.items() if access in how]
        verb = "set: JSBSim computes it" if access == "W" else "read: JSBSim takes it as an order only"
        raise InputError(field, f"property {name!r} cannot be {verb}; {closest(name, able)}")


def _check_unit(field: str, channel: Channel) -> None:
    from levelone.config.units import to_si

    suffix = re.sub(r"\[\d+\]$", "", channel.name).rpartition("-")[2]
    unit = SUFFIXES.get(suffix)
    if unit is not None and not math.isclose(to_si(1.0, channel.unit, unit, field), 1.0, rel_tol=1e-9):
        raise InputError(field, f"is {channel.unit!r}, but the name of property {channel.name!r} says {unit!r}")


def _frames(dt: float, step: float) -> int:
    frames = round(dt / step)
    if frames < 1 or abs(frames * step - dt) > 1e-6 * dt:
        raise InputError("model.step", f"{step} s of JSBSim does not divide the sampling interval of {dt} s of the test")
    return frames


def _is_initial(name: str) -> bool:
    return name.startswith("ic/")


def _begin(aircraft: Any, table: JsbsimTable, factors: Sequence[tuple[str, float]]) -> None:
    """Everything that happens before the first frame of the record."""
    varied = (*table.fixed, *factors)
    for name, value in (*table.initial, *(pair for pair in varied if _is_initial(pair[0]))):
        aircraft[name] = value
    if not aircraft.run_ic():
        raise ModelFailure(Status.MODEL_FAILED, "JSBSim could not begin at the initial conditions")
    if table.engines_running:
        aircraft["propulsion/set-running"] = -1
    for name, value in (*(pair for pair in varied if not _is_initial(pair[0])), *table.set):
        aircraft[name] = value
    for channel in table.inputs:
        if channel.trim is not None:
            aircraft[channel.name] = channel.trim
    for _ in range(round(table.settle / table.step)):
        _frame(aircraft)


def _fly(aircraft: Any, table: JsbsimTable, manoeuvre: Manoeuvre, frames: int) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Times and channels of the record, SI."""
    channel = table.command(manoeuvre.axis)
    tree = aircraft.get_property_manager()
    set_input = tree.get_node(channel.name).set_double_value
    reads = [tree.get_node(each.name).get_double_value for each in table.outputs]
    contacts = [tree.get_node(name).get_double_value for name in _listing(aircraft) if name.endswith("/WOW")]
    samples = math.floor(manoeuvre.duration / manoeuvre.dt + 1e-6) + 1
    steps = np.arange((samples - 1) * frames + 1) * (manoeuvre.dt / frames)
    commands = command_values(channel, manoeuvre, steps, aircraft[channel.name]).tolist()
    standing, rows = any(touches() for touches in contacts), np.empty((samples, len(reads)))
    for k, value in enumerate(commands):
        set_input(value)
        _frame(aircraft)
        if k % frames:
            continue
        rows[k // frames] = [read() for read in reads]
        if not standing and any(touches() for touches in contacts):
            raise ModelFailure(Status.DIVERGED, f"the aircraft touches the ground at t = {steps[k]:.3g} s: begin higher")
    return steps[::frames], {each.levelone: to_si(each, rows[:, i]) for i, each in enumerate(table.outputs)}


def _frame(aircraft: Any) -> None:
    if not aircraft.run():
        raise ModelFailure(Status.MODEL_FAILED, f"JSBSim ended the run at its time {aircraft.get_sim_time():.6g} s")
