"""State-space files: matrices with names, units, delays, actuators and a feedback law, some entries of them parameters.

A file keeps its own units throughout; the study that uses it says for each input and output how to get to SI, and is refused where
its unit is not the file's.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from levelone.config.files import beside, read_text, read_toml
from levelone.config.schema import check, in_file
from levelone.config.state_space_model import Entries, LawEntries, StateSpaceFile
from levelone.config.state_space_schema import MOST, Actuator, Feedback, StateSpace
from levelone.dynamics.feedback import FloatArray
from levelone.errors import InputError, unknown_name

Entry = float | str
Matrix = list[list[Entry]] | str


def load_state_space(path: str | Path) -> StateSpaceFile:
    """Read a state-space file; the format is described in docs/how-to/state-space.md.

    Parameters
    ----------
    path
        A .toml file.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed.
    """
    path = Path(path)
    content = check(StateSpace, read_toml(path), path.name)
    with in_file(path.name):
        file = _Reader(path, content).file()
        file.system({})  # what the parameters' own values cannot make is refused here
        return file


class _Reader:
    """Names, parameters and the folder that matrices are read with."""

    def __init__(self, path: Path, content: StateSpace) -> None:
        self.path, self.content = path, content
        self.files = [path]
        given = content.feedback
        self.states, self.inputs = tuple(content.states.names), tuple(content.inputs.names)
        self.outputs = tuple(content.outputs.names) if content.outputs else self.states
        self.commands = tuple(given.commands.names) if given else ()
        _distinct("parameters", [*content.parameters])
        for field, names in (("states", self.states), ("inputs", (*self.inputs, *self.commands)), ("outputs", self.outputs)):
            _distinct(f"{field}.names", names)

    def file(self) -> StateSpaceFile:
        """Everything, checked."""
        given, (n, m, p) = self.content, (len(self.states), len(self.inputs), len(self.outputs))
        tables = given.matrices
        if (tables.C is None) != (given.outputs is None):
            raise InputError("matrices.C", "C and [outputs] belong together: without both the states are the outputs")
        omega, zeta = self.actuators(given.actuator)
        late_out = given.outputs.delay if given.outputs else None
        units = given.feedback.commands.units if given.feedback else []
        return StateSpaceFile(
            name=given.system.name,
            states=self.states,
            inputs=(*self.inputs, *self.commands),
            outputs=self.outputs,
            input_units=(*_units("inputs", given.inputs.units, m), *_units("feedback.commands", units, len(self.commands))),
            output_units=_units("outputs", (given.outputs or given.states).units, p),
            parameters=tuple(given.parameters.items()),
            A=self.matrix("matrices.A", tables.A, (n, n)),
            B=self.matrix("matrices.B", tables.B, (n, m)),
            C=self.matrix("matrices.C", tables.C, (p, n), np.eye(n)),
            D=self.matrix("matrices.D", tables.D, (p, m)),
            input_delay=self.vector("inputs.delay", given.inputs.delay, m),
            output_delay=self.vector("outputs.delay", late_out, p),
            omega=omega,
            zeta=zeta,
            law=self.law(given.feedback),
            files=tuple(self.files),
        )

    def matrix(self, field: str, given: Matrix | None, shape: tuple[int, int], default: FloatArray | None = None) -> Entries:
        """A matrix of the file, or of the CSV file that it names."""
        if given is None:
            return Entries(np.zeros(shape) if default is None else default)
        rows: Sequence[Sequence[Entry]] = self.csv(field, given) if isinstance(given, str) else given
        if len(rows) != shape[0] or any(len(row) != shape[1] for row in rows):
            widths = sorted({len(row) for row in rows})
            raise InputError(
                field, f"has {len(rows)} rows of {' or '.join(map(str, widths))} entries, must be {shape[0]} by {shape[1]}"
            )
        return self.entries(field, [entry for row in rows for entry in row], shape)

    def csv(self, field: str, name: str) -> list[list[Entry]]:
        """Rows of a CSV file beside, lines with # passed over."""
        path = beside(self.path, name, field)
        self.files.append(path)
        lines = [line for line in read_text(path, field).splitlines() if line.strip() and not line.startswith("#")]
        if len(lines) > MOST or any(line.count(",") >= MOST for line in lines):
            raise InputError(field, f"{name} holds more than {MOST} rows or columns")
        return [[_cell(cell.strip()) for cell in line.split(",")] for line in lines]

    def vector(self, field: str, given: Sequence[Entry] | None, length: int, default: float = 0.0) -> Entries:
        """A list of the file."""
        if given is not None and len(given) != length:
            raise InputError(field, f"has {len(given)} entries, must have {length}")
        return Entries(np.full(length, default)) if given is None else self.entries(field, given, (length,))

    def entries(self, field: str, given: Sequence[Entry], shape: tuple[int, ...]) -> Entries:
        """Numbers and parameters in one array."""
        numbers, named = np.zeros(len(given)), []
        for place, entry in enumerate(given):
            if isinstance(entry, str):
                name = entry.removeprefix("-")
                if name not in self.content.parameters:
                    raise unknown_name(f"{field}: {entry!r}", name, self.content.parameters)
                named.append((place, -1.0 if entry.startswith("-") else 1.0, name))
            else:
                numbers[place] = entry
        return Entries(numbers.reshape(shape), tuple(named))

    def actuators(self, given: Sequence[Actuator]) -> tuple[Entries, Entries]:
        """Frequency and damping of each input's actuator, NaN where it has none."""
        m = len(self.inputs)
        found: dict[str, list[Entry]] = {"omega": [np.nan] * m, "zeta": [np.nan] * m}
        taken: set[str] = set()
        for number, actuator in enumerate(given, 1):
            for name in actuator.inputs:
                i = _place(f"actuator.{number}.inputs", name, self.inputs)
                if name in taken:
                    raise InputError(f"actuator.{number}.inputs", f"{name!r} has an actuator already")
                taken.add(name)
                found["omega"][i], found["zeta"][i] = actuator.omega, actuator.zeta
        omega, zeta = (self.entries(f"actuator.{key}", values, (m,)) for key, values in found.items())
        return omega, zeta

    def law(self, given: Feedback | None) -> LawEntries | None:
        """The feedback law, with the allocation of its controls."""
        shared = self.content.allocation
        if given is None:
            if shared is not None:
                raise InputError("allocation", "shares the controls of a [feedback], which is missing")
            return None
        v, r, i = len(given.controls), len(self.commands), len(given.integral)
        if (given.Ki is None) != (not i) or (given.Ki is None) != (given.sign_i is None):
            raise InputError("feedback.Ki", "Ki, sign_i and [[feedback.integral]] belong together")
        effectors = given.controls if shared is None else shared.controls
        if shared is not None and len(shared.weights) != len(effectors):
            raise InputError(
                "allocation.weights", f"has {len(shared.weights)} entries, must have {len(effectors)}, one for each control"
            )
        places = self.destinations(effectors, given.internal, "feedback" if shared is None else "allocation")
        R, inside, S = self.regulated(given)
        return LawEntries(
            F_x=self.matrix("feedback.Kx", given.Kx, (v, len(given.states))),
            F_i=self.matrix("feedback.Ki", given.Ki, (v, i)),
            F_r=self.matrix("feedback.Kr", given.Kr, (v, r)),
            sign_x=float(given.sign_x),
            sign_i=float(given.sign_i or 0.0),
            states=tuple(_place("feedback.states", name, self.states) for name in _distinct("feedback.states", given.states)),
            R=R,
            R_internal=inside,
            S=S,
            weights=None if shared is None else np.array(shared.weights, dtype=np.float64),
            effect=self.matrix("allocation.effect", shared.effect if shared else None, (v, len(effectors))),
            to_inputs=places[0],
            to_internal=places[1],
            delay=self.entries("feedback.delay", [given.delay], ()),
        )

    def destinations(self, controls: Sequence[str], internal: Sequence[str], where: str) -> tuple[tuple[tuple[int, int], ...], ...]:
        """(control, place) of those that go to inputs, and of those that are commands inside the law."""
        _distinct(f"{where}.controls", controls)
        for name in _distinct("feedback.internal", internal):
            if name not in controls or name in self.states or name in self.inputs:
                raise InputError("feedback.internal", f"{name!r} must be among {where}.controls, and neither a state nor an input")
        for name in controls:
            if name not in internal:
                _place(f"{where}.controls", name, self.inputs)
        inputs = tuple((k, self.inputs.index(name)) for k, name in enumerate(controls) if name in self.inputs)
        inside = tuple((k, list(internal).index(name)) for k, name in enumerate(controls) if name in internal)
        return inputs, inside

    def regulated(self, given: Feedback) -> tuple[Entries, Entries, FloatArray]:
        """What the integrals integrate: of states, of commands inside the law, and which command is taken from each."""
        names = (*self.states, *given.internal)
        table: list[list[Entry]] = [[0.0] * len(names) for _ in given.integral]
        S = np.zeros((len(given.integral), len(self.commands)))
        for row, integral in enumerate(given.integral):
            field = f"feedback.integral.{row + 1}"
            for name, entry in integral.of.items():
                table[row][_place(f"{field}.of", name, names)] = entry
            if integral.command is not None:
                S[row, _place(f"{field}.command", integral.command, self.commands)] = 1.0
        n, rows = len(self.states), len(table)
        of_states = self.entries("feedback.integral.of", [entry for row in table for entry in row[:n]], (rows, n))
        inside = self.entries("feedback.integral.of", [entry for row in table for entry in row[n:]], (rows, len(names) - n))
        return of_states, inside, S


def _cell(text: str) -> Entry:
    try:
        value = float(text)
    except ValueError:
        return text
    if not np.isfinite(value):
        raise InputError("matrices", f"{text!r} is not a finite number")
    return value


def _units(field: str, given: Sequence[str], length: int) -> tuple[str, ...]:
    if len(given) != length:
        raise InputError(f"{field}.units", f"has {len(given)} entries, must have {length}, one for each name")
    return tuple(given)


def _place(field: str, name: str, allowed: Sequence[str]) -> int:
    if name not in allowed:
        raise unknown_name(field, name, allowed)
    return list(allowed).index(name)


def _distinct(field: str, names: Iterable[str]) -> list[str]:
    found = list(names)
    twice = next((name for name in found if found.count(name) > 1), None)
    if twice is not None:
        raise InputError(field, f"{twice!r} stands there twice")
    return found
