"""A linear model from a file of matrices, flown by the same manoeuvres and read by the same criteria.

Its frequency response is exact, delays included. Its time response is exact at the samples for the command that is held from
sample to sample, unless a delay lies inside a loop: see :mod:`levelone.campaign.models.discrete_linear`. Channels are changes from
trim, so that a speed begins at zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.models.keys import file_digest, plain, versions
from levelone.campaign.models.mapping import change_of_input, channel_history, ratio_of_units, sample_times, to_si
from levelone.campaign.models.protocol import FloatArray, ModelFailure
from levelone.config.model_table import Channel, StateSpaceTable
from levelone.errors import InputError, unknown_name
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import Test
    from levelone.config.state_space_model import StateSpaceFile
    from levelone.dynamics.feedback import DelayedSystem
    from levelone.handling.frequency import FrequencyResponse
    from levelone.handling.history import TimeHistory
    from levelone.handling.manoeuvres import Manoeuvre

#: a run has diverged where an output, in units of the file, exceeds its input by this factor
DIVERGED = 1e6
#: 1/s: a pole farther right than this makes the system unstable; integrators (poles at zero) are let through
UNSTABLE = 1e-6


@dataclass(frozen=True)
class StateSpaceSource:
    """A linear system in a file, as something that can be flown.

    Parameters
    ----------
    table
        The file, parameters that are set, and where commands and channels lie in it.
    targets
        Parameters of the file that the factors set, in its own units.
    tests
        What is read on the records: the delay of a record is that of the rate whose free response a test reads on it, or the
        longest of all three rates where no test does.

    Raises
    ------
    InputError
        The file is faulty, or does not hold an input, output, parameter or unit that the study names.
    """

    table: StateSpaceTable
    targets: tuple[str, ...]
    tests: tuple[Test, ...] = ()

    def __post_init__(self) -> None:
        self.check()

    @property
    def key(self) -> Mapping[str, Any]:
        """Hashes of the file and of those that it names, the mapping, and the versions of the libraries."""
        file = _read(self.table.file)
        return {
            "kind": self.table.kind,
            "files": [file_digest(path, "model.file") for path in file.files],
            "fixed": plain(self.table.fixed),
            "inputs": plain(self.table.inputs),
            "outputs": plain(self.table.outputs),
            "targets": list(self.targets),
            "versions": versions("numpy", "scipy"),
        }

    def check(self) -> None:
        """Refuse names and units that are not those of the file.

        Raises
        ------
        InputError
            An unknown input, output or parameter, or a unit that differs from the file's.
        """
        file, known = self._file(), dict(_read(self.table.file).parameters)
        groups = (("inputs", self.table.inputs, file.inputs, file.input_units),
                  ("outputs", self.table.outputs, file.outputs, file.output_units))  # fmt: skip
        for group, channels, names, units in groups:
            for channel in channels:
                _check_channel(f"model.{group}.{channel.levelone}", channel, dict(zip(names, units, strict=True)))
        for field, wanted in (("model.fixed", [name for name, _ in self.table.fixed]), ("factor.target", self.targets)):
            for name in wanted:
                if name not in known:
                    raise unknown_name(field, name, known)

    def fly(self, point: FloatArray, manoeuvre: Manoeuvre) -> TimeHistory:
        """One run; see :meth:`levelone.campaign.models.protocol.HistorySource.fly`."""
        file, channel = self._file(), self._command(manoeuvre.axis)
        column = file.inputs.index(channel.name)
        time = sample_times(manoeuvre)
        u = change_of_input(channel, manoeuvre).command(time)
        with _one_thread():
            system = self._system(point)
            values = self._flown(system, column, u, manoeuvre.dt)
        rows = {each.levelone: file.outputs.index(each.name) for each in self.table.outputs}
        channels = {each.levelone: to_si(each, values[rows[each.levelone]]) for each in self.table.outputs}
        late = [system.transport(column, row) for name, row in rows.items() if name in self._freely_read(manoeuvre)]
        delay = max((each for each in late if np.isfinite(each)), default=0.0)
        return channel_history(time, channels, manoeuvre, delay=delay)

    def frequency_response(self, point: FloatArray, command: str, output: str, omega: FloatArray) -> FrequencyResponse:
        """Exact response of a channel to a command, SI and rad.

        Raises
        ------
        ModelFailure
            The system is unstable: it has no steady answer to a sine, and nobody could measure one.
        InputError
            The command or the output is not mapped.
        """
        from levelone.handling.frequency import FrequencyResponse

        file, into, out = self._file(), self._command(command), _mapped("output", output, self.table.outputs)
        with _one_thread():
            value = self._answered(self._system(point), file.inputs.index(into.name), file.outputs.index(out.name), omega)
        scale = out.sign * out.scale / (into.sign * into.scale)
        return FrequencyResponse(np.asarray(omega, dtype=np.float64), scale * value)

    def _freely_read(self, manoeuvre: Manoeuvre) -> tuple[str, ...]:
        """Channels whose free response is read on a manoeuvre, the only reading that needs a delay."""
        from levelone.handling.axes import RATE_AND_ATTITUDE

        rates = {axis: rate for axis, (rate, _) in RATE_AND_ATTITUDE.items()}
        free = [each for each in self.tests if each.criterion == "dynamic_stability"]
        read = tuple(rates[str(each.axis)] for each in free if replace(each.manoeuvre, name=manoeuvre.name) == manoeuvre)
        return read or tuple(rates.values())

    def _file(self) -> StateSpaceFile:
        return _read(self.table.file)

    def _command(self, name: str) -> Channel:
        return _mapped("command", name, self.table.inputs)

    def _system(self, point: FloatArray) -> DelayedSystem:
        self.check()
        values = {**dict(self.table.fixed), **dict(zip(self.targets, map(float, point), strict=True))}
        try:
            return self._file().system(values)
        except InputError as error:  # the parameters of one point, after those of the file were accepted
            raise ModelFailure(Status.MODEL_FAILED, str(error)) from None

    @staticmethod
    def _answered(system: DelayedSystem, column: int, row: int, omega: FloatArray) -> NDArray[np.complex128]:
        rightmost = complex(system.poles()[0])
        if rightmost.real > UNSTABLE:
            raise ModelFailure(Status.DIVERGED, f"the linear system is unstable: pole at {_shown(rightmost)} 1/s")
        try:
            return system.frequency_response(column, row, omega)
        except np.linalg.LinAlgError:
            raise ModelFailure(Status.MODEL_FAILED, "a pole lies on the imaginary axis at one of the frequencies") from None

    @staticmethod
    def _flown(system: DelayedSystem, column: int, u: FloatArray, dt: float) -> FloatArray:
        from levelone.campaign.models.discrete_linear import time_response

        try:
            values = time_response(system, column, u, dt)
        except InputError as error:
            raise ModelFailure(Status.MODEL_FAILED, str(error)) from None
        with np.errstate(invalid="ignore"):
            beyond = ~(np.abs(values) <= DIVERGED * max(float(np.abs(u).max()), np.finfo(float).tiny))
        if beyond.any():
            first = dt * int(np.argmax(beyond.any(axis=0)))
            raise ModelFailure(
                Status.DIVERGED,
                f"an output exceeds {DIVERGED:g} times the input at {first:g} s; rightmost pole {_shown(system.poles()[0])} 1/s",
            )
        return values


def _one_thread() -> Any:
    """Context in which BLAS runs on one thread: digits then do not depend on the machine, nor on who else computes on it."""
    return _blas().limit(limits=1, user_api="blas")


@lru_cache(maxsize=1)
def _blas() -> Any:
    import scipy.linalg  # noqa: F401  # brings a BLAS of its own, which must be there when libraries are looked for
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _mapped(field: str, name: str, channels: tuple[Channel, ...]) -> Channel:
    found = {channel.levelone: channel for channel in channels}
    if name not in found:
        raise unknown_name(field, name, found)
    return found[name]


def _check_channel(field: str, channel: Channel, units: Mapping[str, str]) -> None:
    if channel.name not in units:
        raise unknown_name(f"{field}.name", channel.name, units)
    unit = units[channel.name]
    ratio = ratio_of_units(channel.unit, unit)
    if ratio is None or not math.isclose(ratio, 1.0, rel_tol=1e-12):
        raise InputError(f"{field}.unit", f"is {channel.unit!r}, and the file gives {channel.name!r} in {unit!r}: write that unit")


def _shown(pole: complex) -> str:
    return f"{pole.real:.4g}" + (f" +- {abs(pole.imag):.4g}j" if abs(pole.imag) > 1e-9 else "")


def _read(path: Path) -> StateSpaceFile:
    """The content of a file, read once in a process unless it, or a file that it names, changes."""
    file = _content(path, _stamp(path))
    return file if len(file.files) == 1 else _content(path, tuple(_stamp(each) for each in file.files))


def _stamp(path: Path) -> tuple[int, int]:
    try:
        found = path.stat()
    except OSError as error:
        raise InputError("model.file", f"{path} cannot be read: {error.strerror}") from None
    return found.st_mtime_ns, found.st_size


@lru_cache(maxsize=16)
def _content(path: Path, stamps: tuple[Any, ...]) -> StateSpaceFile:
    from levelone.config.state_space_file import load_state_space

    return load_state_space(path)
