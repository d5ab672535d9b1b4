"""What a state-space file holds: matrices some of whose entries are parameters, and the system that their values make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from levelone.dynamics.feedback import DelayedSystem, FeedbackLaw, FloatArray, Plant, allocation, closed
from levelone.errors import InputError, unknown_name


@dataclass(frozen=True, eq=False)
class Entries:
    """An array some of whose entries are parameters: ``named`` are (place in the flat array, sign, parameter)."""

    numbers: FloatArray
    named: tuple[tuple[int, float, str], ...] = ()

    def at(self, values: Mapping[str, float]) -> FloatArray:
        """The array with the values of the parameters."""
        found = self.numbers.copy()
        for place, sign, name in self.named:
            found.flat[place] = sign * values[name]
        return found


@dataclass(frozen=True, eq=False)
class LawEntries:
    """The feedback law of a file, see :class:`levelone.dynamics.feedback.FeedbackLaw`."""

    F_x: Entries
    F_i: Entries
    F_r: Entries
    sign_x: float
    sign_i: float
    states: tuple[int, ...]
    R: Entries
    R_internal: Entries
    S: FloatArray
    weights: FloatArray | None
    effect: Entries
    to_inputs: tuple[tuple[int, int], ...]
    """(control, input) pairs, and for commands inside the law:"""
    to_internal: tuple[tuple[int, int], ...]
    delay: Entries

    def at(self, values: Mapping[str, float], n: int, m: int) -> FeedbackLaw:
        """The law of a plant with n states and m inputs."""
        gains, regulated, internal = self.F_x.at(values), self.R.at(values), self.R_internal.at(values)
        F_x = np.zeros((len(gains), n))
        F_x[:, list(self.states)] = self.sign_x * gains
        shares = np.eye(len(gains)) if self.weights is None else allocation(self.weights, self.effect.at(values))
        M, inside = np.zeros((m, len(gains))), np.zeros((internal.shape[1], len(gains)))
        for control, i in self.to_inputs:
            M[i] = shares[control]
        for control, i in self.to_internal:
            inside[i] = shares[control]
        delay = float(self.delay.at(values))
        return FeedbackLaw(
            F_x, self.sign_i * self.F_i.at(values), self.F_r.at(values), regulated, internal @ inside, self.S, M, _late(delay)
        )


@dataclass(frozen=True, eq=False)
class StateSpaceFile:
    """The content of a state-space file.

    Parameters
    ----------
    states, outputs
        Names.
    inputs
        Names of those of the plant, then of the commands of its feedback law.
    input_units, output_units
        In the order of the names, as the file has them.
    parameters
        Names and values.
    files
        The file and those that it names.
    """

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    parameters: tuple[tuple[str, float], ...]
    files: tuple[Path, ...]
    A: Entries
    B: Entries
    C: Entries
    D: Entries
    input_delay: Entries
    output_delay: Entries
    omega: Entries
    zeta: Entries
    law: LawEntries | None

    def system(self, values: Mapping[str, float]) -> DelayedSystem:
        """The system, its law closed, with other values for some parameters.

        Raises
        ------
        InputError
            Unknown parameters, values that are not finite, delays below zero, actuators without a positive frequency.
        """
        known = dict(self.parameters)
        for name, value in values.items():
            if name not in known:
                raise unknown_name("parameters", name, known)
            if not np.isfinite(value):
                raise InputError(f"parameters.{name}", f"is {value}, must be finite")
        known.update(values)
        B, omega, zeta = self.B.at(known), self.omega.at(known), self.zeta.at(known)
        if (omega <= 0.0).any() or (zeta < 0.0).any():
            raise InputError(
                "actuator", f"needs omega above 0 and zeta of 0 or more, got {np.nanmin(omega):g} and {np.nanmin(zeta):g}"
            )
        before, after = _late(self.input_delay.at(known)), _late(self.output_delay.at(known))
        plant = Plant(self.A.at(known), B, self.C.at(known), self.D.at(known), before, after, omega, zeta)
        return closed(plant, None if self.law is None else self.law.at(known, *B.shape))


def _late(delay: Any) -> Any:
    if np.min(delay) < 0.0:
        raise InputError("delay", f"is {np.min(delay):g} s, must be 0 or more")
    return delay
