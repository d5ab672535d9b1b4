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

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from levelone.campaign.models.jsbsim_properties import check_properties, listing
from levelone.campaign.models.keys import files_digest, plain, versions
from levelone.campaign.models.mapping import channel_history, command_values, sample_times, to_si
from levelone.campaign.models.protocol import FloatArray, ModelFailure
from levelone.config.model_table import whole_steps
from levelone.errors import InputError, closest
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import JsbsimTable
    from levelone.handling.history import TimeHistory
    from levelone.handling.manoeuvres import Manoeuvre


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
            check_properties(self.table, self.targets, listing(aircraft))

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
        frames = whole_steps(manoeuvre.dt, self.table.step, "model.step")
        jsbsim = _library()
        with _listening() as said:
            try:
                aircraft = _loaded(self.table, said)
                ground = _begin(aircraft, self.table, list(zip(self.targets, map(float, point), strict=True)))
                time, channels = _fly(aircraft, self.table, manoeuvre, frames, ground)
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


def _is_initial(name: str) -> bool:
    return name.startswith("ic/")


class _Ground:
    """The ground under an aircraft, on which it may stand when time begins, and which it may not fall on later."""

    def __init__(self, aircraft: Any) -> None:
        tree = aircraft.get_property_manager()
        self._touches = [tree.get_node(name).get_double_value for name in listing(aircraft) if name.endswith("/WOW")]
        self._stands = any(touches() for touches in self._touches)

    def check(self, when: str, time: float) -> None:
        """ModelFailure where an aircraft that did not stand touches the ground."""
        if not self._stands and any(touches() for touches in self._touches):
            raise ModelFailure(Status.DIVERGED, f"the aircraft touches the ground {when} {time:.3g} s: begin higher")


def _begin(aircraft: Any, table: JsbsimTable, factors: Sequence[tuple[str, float]]) -> _Ground:
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
    ground = _Ground(aircraft)  # a trim that was asked for may have put the aircraft down
    for k in range(round(table.settle / table.step)):
        _frame(aircraft)
        ground.check("while it settles, after", (k + 1) * table.step)
    return ground


def _fly(
    aircraft: Any, table: JsbsimTable, manoeuvre: Manoeuvre, frames: int, ground: _Ground
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Times and channels of the record, SI."""
    channel = table.command(manoeuvre.axis)
    tree = aircraft.get_property_manager()
    set_input = tree.get_node(channel.name).set_double_value
    reads = [tree.get_node(each.name).get_double_value for each in table.outputs]
    samples = len(sample_times(manoeuvre))
    steps = np.arange((samples - 1) * frames + 1) * (manoeuvre.dt / frames)
    commands = command_values(channel, manoeuvre, steps, aircraft[channel.name]).tolist()
    rows = np.empty((samples, len(reads)))
    for k, value in enumerate(commands):
        set_input(value)
        _frame(aircraft)
        if k % frames:
            continue
        rows[k // frames] = [read() for read in reads]
        ground.check("at t =", float(steps[k]))
    return steps[::frames], {each.levelone: to_si(each, rows[:, i]) for i, each in enumerate(table.outputs)}


def _frame(aircraft: Any) -> None:
    if not aircraft.run():
        raise ModelFailure(Status.MODEL_FAILED, f"JSBSim ended the run at its time {aircraft.get_sim_time():.6g} s")
