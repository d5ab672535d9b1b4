"""Functional mock-up units (FMI 2.0 and 3.0, co-simulation and model exchange) as simulations that can be flown, by FMPy.

A run takes a fresh instance: start values (``fixed``, then the factors) and the inputs of trim, initialisation, ``settle`` seconds
that are not recorded, then the record. The input takes the value of the manoeuvre at a communication point and holds it until the
next; sample k is read at t = k dt, before the input changes there. A command therefore arrives as a digital controller would send
it, on average half a step late: keep ``step`` well below the times that matter.
"""

from __future__ import annotations

import ctypes
import math
import os
import sys
import tempfile
import threading
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from levelone.campaign.models.fmu_archive import FIELD, MODES, described, library, unpacked
from levelone.campaign.models.fmu_clock import Clock, CoSimulation, ModelExchange
from levelone.campaign.models.fmu_variables import check_variables, references
from levelone.campaign.models.keys import file_digest, plain, versions
from levelone.campaign.models.mapping import channel_history, command_values, sample_times, to_si
from levelone.campaign.models.protocol import TAIL, FloatArray, ModelFailure
from levelone.config.model_table import whole_steps
from levelone.status import Status

if TYPE_CHECKING:
    from pathlib import Path

    from levelone.config.model_table import FmuTable
    from levelone.handling.history import TimeHistory
    from levelone.handling.manoeuvres import Manoeuvre

_DISCARD, _FATAL = 2, 4
#: an FMU may keep what it likes outside its instances, and what it prints is caught for the whole process: one run at a time
_ONE_AT_A_TIME = threading.Lock()


@dataclass(frozen=True)
class FmuSource:
    """One FMU as a simulation that can be flown.

    Parameters
    ----------
    table
        The file, its mode and times, and the variables that commands and channels map to.
    targets
        Variable whose start value each column of a point sets, in the FMU's unit.

    Raises
    ------
    InputError
        FMPy is not installed, or see :func:`levelone.campaign.models.fmu_archive.described` and
        :func:`levelone.campaign.models.fmu_variables.check_variables`.

    Notes
    -----
    A crash inside the FMU takes the process with it: campaigns run such models in worker processes.
    """

    table: FmuTable
    targets: tuple[str, ...]

    def __post_init__(self) -> None:
        check_variables(self.table, self.targets, described(self.table.file, self.table.mode))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the file."""
        return file_digest(self.table.file, FIELD)

    @property
    def key(self) -> Mapping[str, Any]:
        """Description, hash of the file, and versions of what runs and integrates it."""
        options = {name: getattr(self.table, name) for name in self.table.__dataclass_fields__ if name != "file"}
        return {"source": plain({**options, "targets": self.targets}), "file": self.digest, **versions("FMPy", "scipy")}

    def fly(self, point: FloatArray, manoeuvre: Manoeuvre) -> TimeHistory:
        """One run, sampled at the manoeuvre's ``dt``: as of :class:`levelone.campaign.models.protocol.HistorySource`.

        Raises
        ------
        InputError
            ``dt`` is no multiple of the communication step, or the file has changed.
        ModelFailure
            MODEL_FAILED with the FMU's own messages; DIVERGED: it ended the run, or its integration failed; see also
            :func:`levelone.campaign.models.mapping.channel_history`.
        """
        folder, description = unpacked(self.table.file, self.table.mode, self.digest)
        steps = 1 if self.table.step is None else whole_steps(manoeuvre.dt, self.table.step, "model.step")
        start = {**dict(self.table.fixed), **dict(zip(self.targets, map(float, point), strict=True))}
        said: list[str] = []
        with _ONE_AT_A_TIME, _caught_output() as printed, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the integrator's: that it failed is asked for
            try:
                time, rows = _fly(self.table, folder, description, start, manoeuvre, steps, said)
            except ModelFailure as failure:
                raise ModelFailure(failure.status, _with_words(failure.message, said, printed)) from None
            except Exception as error:  # FMPy raises bare exceptions for what an FMU refuses
                raise ModelFailure(Status.MODEL_FAILED, _with_words(_in_words(error), said, printed)) from None
        channels = {each.levelone: to_si(each, rows[:, i]) for i, each in enumerate(self.table.outputs)}
        return channel_history(time, channels, manoeuvre)


def _fly(
    table: FmuTable,
    folder: Path,
    description: Any,
    start: Mapping[str, float],
    manoeuvre: Manoeuvre,
    steps: int,
    said: list[str],
) -> tuple[FloatArray, FloatArray]:
    """Times [time] and values [time, channel] of the record, in the FMU's units."""
    fmu = _instance(table, folder, description, said)
    fatal = False
    try:
        clock = _clock(fmu, table, description, manoeuvre.dt / steps)
        answer = _run(fmu, clock, table, description, start, manoeuvre, steps)
        fmu.terminate()
        return answer
    except Exception as error:
        fatal = getattr(error, "status", None) == _FATAL
        raise
    finally:
        if not fatal:  # after a fatal error the standard allows no call at all
            fmu.freeInstance()


def _instance(table: FmuTable, folder: Path, description: Any, said: list[str]) -> Any:
    second = description.fmiVersion == "2.0"

    def listen(*arguments: Any) -> None:
        text = arguments[-1] or b""
        said.append(text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text))

    here = os.getcwd()
    try:
        instantiate = library().simulation.instantiate_fmu
        return instantiate(str(folder), description, MODES[table.mode], logger=listen, debug_logging=second)
    finally:  # where a library cannot be loaded FMPy stays in its folder
        os.chdir(here)


def _clock(fmu: Any, table: FmuTable, description: Any, step: float) -> Clock:
    names = references(table.inputs, description)
    if table.mode == "co-simulation":
        return CoSimulation(fmu, description, names)
    return ModelExchange(fmu, description, names, table.tolerance, step)


def _run(
    fmu: Any,
    clock: Clock,
    table: FmuTable,
    description: Any,
    start: Mapping[str, float],
    manoeuvre: Manoeuvre,
    steps: int,
) -> tuple[FloatArray, FloatArray]:
    channel, step = table.command(manoeuvre.axis), manoeuvre.dt / steps
    clock.begin(start, [(each.name, each.trim) for each in table.inputs if each.trim is not None])
    before = math.ceil(table.settle / step - 1e-6)
    for k in range(before):
        clock.advance(k * step, step)
    samples = len(sample_times(manoeuvre))
    times = np.arange((samples - 1) * steps + 1) * step
    read = _reader(fmu, references(table.outputs, description), [each.name for each in table.outputs])
    held = _reader(fmu, references([channel], description), [channel.name])()[0]
    commands = command_values(channel, manoeuvre, times, held).tolist()
    rows = np.empty((samples, len(table.outputs)))
    for k, value in enumerate(commands):
        if k % steps == 0:
            rows[k // steps] = read()
        if k + 1 < len(commands):
            clock.hold(channel.name, value)
            clock.advance((before + k) * step, step)
    return times[::steps], rows


def _reader(fmu: Any, known: Mapping[str, tuple[int, str]], names: list[str]) -> Any:
    """A function that reads real variables in the order of their names."""
    if len({known[name][1] for name in names}) == 1:
        get, numbers = getattr(fmu, f"get{known[names[0]][1]}"), [known[name][0] for name in names]
        return lambda: get(numbers)
    calls = [(getattr(fmu, f"get{known[name][1]}"), [known[name][0]]) for name in names]
    return lambda: [get(number)[0] for get, number in calls]


def _in_words(error: Exception) -> str:
    if getattr(error, "status", None) == _DISCARD:
        return f"the FMU discarded a step: {error}"
    return f"{error}"


def _with_words(problem: str, said: list[str], printed: IO[bytes]) -> str:
    """What went wrong, the FMU's own messages and what it printed; the end is kept."""
    _flush()
    printed.seek(max(0, printed.seek(0, os.SEEK_END) - TAIL))
    chatter = printed.read().decode("utf-8", "replace")
    return "\n".join(part.strip() for part in (chatter, *said[-20:], problem) if part.strip())


@contextmanager
def _caught_output() -> Iterator[IO[bytes]]:
    """Standard output of the process, of libraries too, goes to a file for a while."""
    with tempfile.TemporaryFile() as file:
        sys.stdout.flush()
        _flush()
        kept = os.dup(1)
        os.dup2(file.fileno(), 1)
        try:
            yield file
        finally:
            _flush()
            os.dup2(kept, 1)
            os.close(kept)


def _flush() -> None:
    """What C libraries hold back in their buffers is written."""
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)
