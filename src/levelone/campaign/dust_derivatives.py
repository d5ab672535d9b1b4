"""Derivatives from the loads that DUST prints for an oscillating body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from levelone.aerodynamics.coefficients import NAMES, Reference, coefficients
from levelone.aerodynamics.derivatives import Derivatives
from levelone.aerodynamics.extraction import derivative, harmonic
from levelone.aerodynamics.outcome import Outcome
from levelone.config.other_codes import read_loads
from levelone.errors import InputError, unknown_name

MOTIONS = ("pitch", "heave", "rate")


@dataclass(frozen=True)
class FromDust:
    """Derivatives from a history of loads, [1, 1, 6], and the outcome of each coefficient; errors are NaN: a history has none."""

    derivatives: Derivatives
    outcomes: tuple[Outcome, ...]


def from_dust(
    path: Path | str, omega: float, amplitude: float, airspeed: float, density: float, reference: Reference,
    point: Sequence[float] = (0.0, 0.0, 0.0), start: float = 0.0, motion: str = "pitch",
) -> FromDust:  # fmt: skip
    """Derivatives from DUST's integral loads under a motion amplitude sin(omega (t - start)), by harmonic fit to the last period.

    Parameters
    ----------
    path
        File of the loads, in a system that stands still, x along the stream and z up.
    omega, amplitude
        Of the motion, rad/s and rad.
    airspeed, density
        m/s and kg/m^3.
    reference
        Area (m^2), chord and span (m).
    point
        Moments are to be about this point [3] of the ground's frame, m.
    start
        Time (s) at which the motion passes zero upwards.
    motion
        "pitch", "heave" (incidence oscillates) or "rate": what the quadrature is, see :mod:`levelone.aerodynamics.derivatives`.

    Raises
    ------
    InputError
        A broken file, loads in a system that moves, numbers that are not positive, another motion.
    """
    for name, value in (("omega", omega), ("amplitude", amplitude), ("airspeed", airspeed), ("density", density)):
        _positive(name, value)
    if motion not in MOTIONS:
        raise unknown_name("motion", motion, MOTIONS)
    loads = read_loads(path)
    if not loads.fixed:
        raise InputError(Path(path).name, f"the reference system {loads.system!r} moves: ask for loads in one that stands still")
    moment = loads.moment - np.cross(np.asarray(point, dtype=float) - loads.offset, loads.force)
    values = np.asarray(coefficients(reference, loads.force, moment), dtype=float) / (density * airspeed**2)
    k = omega * reference.chord / (2.0 * airspeed)
    found = [derivative(harmonic(loads.time - start, column, omega), amplitude, k) for column in values.T]
    in_phase, quadrature = (np.array([[[getattr(each, part) for each in found]]]) for part in ("in_phase", "quadrature"))
    unknown = np.full(in_phase.shape, math.nan)
    derivatives = Derivatives((motion,), np.array([k]), NAMES, in_phase, quadrature, unknown, unknown, in_phase, quadrature)
    return FromDust(derivatives, tuple(each.outcome for each in found))


def _positive(name: str, value: float) -> None:
    if not 0.0 < value < math.inf:
        raise InputError(name, f"{value:g} is not a positive number")
