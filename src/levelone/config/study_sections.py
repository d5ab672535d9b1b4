"""Optional sections of a study: what is done beside screening, Monte Carlo and decomposition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from levelone.config.factor_table import Inputs, check_corners, inputs_of
from levelone.config.quantities import Quantity, origins
from levelone.config.study_schema import BesideTable, CasesTable, CouplingTable, FactorTable, FroudeTable, StudyFile, in_words
from levelone.errors import InputError, unknown_name
from levelone.handling.capture import Tolerances
from levelone.handling.history import FloatArray
from levelone.handling.manoeuvres import Manoeuvre
from levelone.handling.pilot import Pilot
from levelone.uncertainty import FactorSpace
from levelone.vehicle import TARGETS, Vehicle, vary


@dataclass(frozen=True, eq=False)
class Coupling:
    """Screening of pitch-roll coupling.

    Parameters
    ----------
    space
        The study's factors, then those added for this screening.
    targets, nominal
        As of the study, for these factors.
    trajectories
        Of the Morris design; its levels are the study's.
    added
        Names of the factors that the study itself does not have.
    """

    space: FactorSpace
    targets: tuple[str, ...]
    nominal: FloatArray
    trajectories: int
    added: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Cases:
    """Vehicles that differ from the nominal one in a few numbers, for one criterion.

    Parameters
    ----------
    name, source
        Of the table, and where it comes from.
    criterion
        "attitude_quickness", "dynamic_stability" or "bandwidth".
    columns
        Targets (names in ``levelone.vehicle.TARGETS``).
    rows
        [cases, columns] in the units of ``levelone.vehicle.TARGET_UNITS``; read-only.
    beside
        The same cases with other numbers, to be shown beside these; None where there are none.
    """

    name: str
    criterion: str
    columns: tuple[str, ...]
    rows: FloatArray
    source: str
    beside: Cases | None = None


@dataclass(frozen=True)
class Froude:
    """Lengths (m) of the vehicle and of the aircraft for which limits were written; ``basis``: their origin in words."""

    length: float
    reference_length: float
    basis: str


@dataclass(frozen=True)
class Deceleration:
    """Deceleration to hover, flown by the pilot model, SI and radians.

    Parameters
    ----------
    speeds, distances
        m/s and m: trim speed of each run, and how far ahead of its start the hover point lies.
    duration
        s, whole record.
    hold
        s that the point must be held to count as captured.
    pilot
        For the first speed; replace its ``distance`` for the others.
    desired, adequate
        Largest values of the measures for desired and for adequate performance.
    """

    speeds: tuple[float, ...]
    distances: tuple[float, ...]
    duration: float
    hold: float
    pilot: Pilot
    desired: Tolerances
    adequate: Tolerances


def coupling_of(
    table: CouplingTable | None, factors: Sequence[tuple[str, FactorTable]], vehicle: Vehicle, manoeuvre: Manoeuvre
) -> Coupling | None:
    """The screening of coupling.

    Parameters
    ----------
    table
        The section.
    factors
        Path and entry of the study's own factors.
    vehicle
        The nominal vehicle.
    manoeuvre
        The step that is flown.

    Raises
    ------
    InputError
        As for the study's factors.
    """
    if table is None:
        return None
    entries = [*factors, *((f"coupling.factor.{each.name}", each) for each in table.factor)]
    inputs: Inputs = inputs_of(entries, vehicle, manoeuvre.trim_speed)
    check_corners(inputs, [path for path, _ in entries], vehicle, (manoeuvre,))
    return Coupling(inputs.space, inputs.targets, inputs.nominal, table.trajectories, inputs.space.names[len(factors) :])


def cases_of(tables: Sequence[CasesTable], vehicle: Vehicle, trim_speed: float) -> tuple[Cases, ...]:
    """The tables of cases, each of another criterion.

    Raises
    ------
    InputError
        Unknown or repeated target, a row of another length, numbers that no vehicle can have, a criterion given twice.
    """
    for i, table in enumerate(tables):
        if table.criterion in [other.criterion for other in tables[:i]]:
            raise InputError(f"cases.{table.name}.criterion", f"{table.criterion!r} has cases already: one table each")
    return tuple(_cases(table, vehicle, trim_speed) for table in tables)


def _cases(table: CasesTable, vehicle: Vehicle, trim_speed: float) -> Cases:
    path = f"cases.{table.name}"
    table.require(path)
    for i, target in enumerate(table.columns, 1):
        if target not in TARGETS:
            raise unknown_name(f"{path}.columns.{i}", target, TARGETS)
        if target in table.columns[: i - 1]:
            raise InputError(f"{path}.columns.{i}", f"{target!r} is given twice")
    made = Cases(table.name, table.criterion, tuple(table.columns), _rows(table, table, vehicle, trim_speed, path), in_words(table))
    if table.beside is None:
        return made
    path = f"{path}.beside"
    table.beside.require(path)
    if len(table.beside.rows) != len(table.rows):
        raise InputError(
            f"{path}.rows", f"holds {len(table.beside.rows)} cases; must be the {len(table.rows)} of the table, in order"
        )
    rows = _rows(table.beside, table, vehicle, trim_speed, path)
    return replace(made, beside=replace(made, name=table.beside.name, rows=rows, source=in_words(table.beside)))


def _rows(given: CasesTable | BesideTable, table: CasesTable, vehicle: Vehicle, trim_speed: float, path: str) -> FloatArray:
    for i, row in enumerate(given.rows, 1):
        if len(row) != len(table.columns):
            raise InputError(f"{path}.rows.{i}", f"holds {len(row)} numbers for {len(table.columns)} columns")
    rows = np.array(given.rows, dtype=np.float64)
    try:
        vary(vehicle, table.columns, rows, trim_speed)
    except InputError as error:
        raise InputError(f"{path}.rows", f"{error.field} {error.problem}") from None
    rows.setflags(write=False)
    return rows


def froude_of(table: FroudeTable | None) -> Froude | None:
    """The lengths of Froude scaling."""
    if table is None:
        return None
    lengths = {"length": table.length, "reference length": table.reference_length}
    basis = "; ".join(f"{name} {each.value:g} m: {_origin(each, table)}" for name, each in lengths.items())
    return Froude(float(table.length.value), float(table.reference_length.value), basis)


def _origin(number: Quantity, section: FroudeTable) -> str:
    """Origin of a number, which is that of its section where it has none."""
    return in_words(section if number.source is None and number.assumed is None else number)


def amplitudes_of(given: Sequence[float]) -> tuple[float, ...]:
    """Amplitudes of the sweeps, m/s; InputError unless they are positive and grow."""
    for i, (last, amplitude) in enumerate(zip((0.0, *given), given, strict=False), 1):
        if not amplitude > last:
            what = f"must exceed {last:g} m/s, which stands before it" if i > 1 else "must be positive"
            raise InputError(f"manoeuvre.bandwidth.sweep.amplitudes.{i}", f"is {amplitude:g} m/s, {what}")
    return tuple(given)


def findings_of(name: str | None) -> Path | None:
    """The file of claims that results are compared with; InputError where it does not exist."""
    if name is not None and not Path(name).is_file():
        raise InputError("study.findings", f"no such file: {name}")
    return None if name is None else Path(name)


def assumed_of(content: StudyFile) -> tuple[tuple[str, str], ...]:
    """(path, why) of everything that the study file marks as assumed.

    Raises
    ------
    InputError
        A quantity without an origin in a section without one.
    """
    found = list(origins(content))
    factors = [(f"factor.{each.name}", each) for each in content.factor]
    added = [(f"coupling.factor.{each.name}", each) for each in content.coupling.factor] if content.coupling is not None else []
    beside = [(f"cases.{each.name}.beside", each.beside) for each in content.cases if each.beside is not None]
    lists = [*factors, *added, *((f"cases.{each.name}", each) for each in content.cases), *beside]
    return (*found, *((path, table.assumed) for path, table in lists if table.assumed is not None))
