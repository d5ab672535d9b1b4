"""Study files: a TOML file becomes a :class:`Study`, everything that a run of the study needs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from levelone.config.correlation_table import correlated, described
from levelone.config.deceleration_table import deceleration_of
from levelone.config.epistemic_table import Epistemic, epistemic_of
from levelone.config.extends import StudySource, read_study
from levelone.config.factor_table import check_corners, inputs_of
from levelone.config.manoeuvres import manoeuvre
from levelone.config.schema import in_section
from levelone.config.study_schema import Condition, FrequencyGrid, Manoeuvres, MethodTable, StudyFile
from levelone.config.study_sections import (
    Cases,
    Coupling,
    Deceleration,
    Froude,
    amplitudes_of,
    assumed_of,
    cases_of,
    coupling_of,
    findings_of,
    froude_of,
)
from levelone.config.vehicle_file import load_vehicle, vehicle_path
from levelone.errors import InputError
from levelone.handling.history import FloatArray
from levelone.handling.levels import Boundaries, load_boundaries
from levelone.handling.manoeuvres import Manoeuvre, Start
from levelone.uncertainty import FactorSpace
from levelone.uncertainty.failures import Policy
from levelone.vehicle import Controller, Vehicle


@dataclass(frozen=True)
class Method:
    """How the study is sampled and analysed.

    ``trajectories`` and ``levels`` of the Morris design, ``samples`` of the Latin hypercube, ``base_points`` of the Sobol design on
    the surrogate, ``bootstrap`` resamplings of each interval; ``kernel`` ("likeliest", "matern52", "squared_exponential") and
    ``trend`` ("constant", "linear") of the Kriging models.
    """

    trajectories: int
    levels: int
    samples: int
    base_points: int
    bootstrap: int
    kernel: str
    trend: str


@dataclass(frozen=True, eq=False)
class Study:
    """A checked study, SI and radians.

    Parameters
    ----------
    name, title, intended_use
        For the report; ``name`` is also the name of its folder of results.
    path, hash
        The study file, and its SHA-256 (over all files of the chain where it extends another).
    vehicle, vehicle_path
        The nominal vehicle and its file.
    seed
        From which the seeds of all stages are derived.
    policy
        What failed runs do to indices: "refuse", "drop" or "bound".
    trim_speed, flight_mode, start
        m/s, level flight; mode of the controller; from which trim a varied vehicle begins.
    quickness, stability, sweep
        Manoeuvres: the step, the pulse, and the sweep that the linear response is compared with.
    windows
        s: window lengths of the sweep's spectra.
    omega
        [nf] rad/s: frequencies of the linear response.
    space, targets, nominal
        Factors in the unit of what they set; their targets (names in ``levelone.vehicle.TARGETS``) and [factors] nominal values.
    correlations
        Both factors, rank correlation and origin in words of each correlated pair.
    method
        Sizes and options of the analysis.
    boundaries, boundaries_source, task
        Level boundaries, where they come from (library name or path), and the bandwidth chart that sets the Level.
    not_validated, validity_domain, notes
        Statements that the report repeats.
    findings
        File of claims that results are compared with; None where there is none.
    coupling, cases, froude, deceleration, epistemic
        What is done beside screening, Monte Carlo and decomposition; None or empty where it is not asked for.
    amplitudes
        m/s: sweeps that are compared with the linear response.
    assumed
        (path, why) of every value of the study file that is marked as assumed.
    """

    name: str
    title: str
    intended_use: str
    path: Path
    hash: str
    vehicle: Vehicle
    vehicle_path: Path
    seed: int
    policy: Policy
    trim_speed: float
    flight_mode: str
    start: Start
    quickness: Manoeuvre
    stability: Manoeuvre
    sweep: Manoeuvre
    windows: tuple[float, ...]
    omega: FloatArray
    space: FactorSpace
    targets: tuple[str, ...]
    nominal: FloatArray
    correlations: tuple[tuple[str, str, float, str], ...]
    method: Method
    boundaries: Boundaries
    boundaries_source: str
    task: str
    not_validated: tuple[str, ...]
    validity_domain: tuple[str, ...]
    notes: tuple[str, ...]
    findings: Path | None
    coupling: Coupling | None
    cases: tuple[Cases, ...]
    amplitudes: tuple[float, ...]
    froude: Froude | None
    deceleration: Deceleration | None
    epistemic: Epistemic | None
    assumed: tuple[tuple[str, str], ...]


def load_study(path: str | PathLike[str]) -> Study:
    """Read a study and its vehicle, and refuse what would fail in every run.

    Parameters
    ----------
    path
        TOML file; the format is described in docs/reference/study-file.md. Paths of a vehicle, of boundaries, of findings and of
        a study that it extends are relative to it.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed.
    """
    source = read_study(Path(path))
    content = source.checked()
    with source.blamed(), in_section("study"):
        where = vehicle_path(content.study.vehicle)
    vehicle = load_vehicle(where)
    with source.blamed():
        return _study(content, source, vehicle, where)


def _study(content: StudyFile, source: StudySource, vehicle: Vehicle, where: Path) -> Study:
    general, condition = content.study, content.condition
    quickness, stability, swept = _manoeuvres(content.manoeuvre, condition, vehicle.controller)
    factors = [(f"factor.{table.name}", table) for table in content.factor]
    inputs = inputs_of(factors, vehicle, condition.trim_speed)
    paths = [path for path, _ in factors]
    check_corners(inputs, paths, vehicle, (quickness, stability, swept))
    inputs = correlated(inputs, content.correlation, content.coupling)
    boundaries_source = _boundaries_source(content.levels.boundaries)
    boundaries = load_boundaries(boundaries_source)
    boundaries.chart("bandwidth", content.levels.task)
    return Study(
        name=general.name,
        title=general.title,
        intended_use=general.intended_use,
        path=source.path,
        hash=source.hash,
        vehicle=vehicle,
        vehicle_path=where,
        seed=general.seed,
        policy=general.failures,
        trim_speed=condition.trim_speed,
        flight_mode=condition.flight_mode,
        start=condition.start,
        quickness=quickness,
        stability=stability,
        sweep=swept,
        windows=_windows(content.manoeuvre.bandwidth, swept),
        omega=_omega(content.manoeuvre.bandwidth, vehicle.controller),
        space=inputs.space,
        targets=inputs.targets,
        nominal=inputs.nominal,
        correlations=described(content.correlation),
        method=method_of(content.method),
        boundaries=boundaries,
        boundaries_source=boundaries_source,
        task=content.levels.task,
        not_validated=tuple(general.not_validated),
        validity_domain=tuple(general.validity_domain),
        notes=tuple(general.notes),
        findings=findings_of(general.findings),
        coupling=coupling_of(content.coupling, factors, vehicle, quickness),
        cases=cases_of(content.cases, vehicle, condition.trim_speed),
        amplitudes=amplitudes_of(content.manoeuvre.bandwidth.sweep.amplitudes),
        froude=froude_of(content.levels.froude),
        deceleration=deceleration_of(content.deceleration, inputs, paths, vehicle),
        epistemic=epistemic_of(content.epistemic, inputs.space),
        assumed=assumed_of(content),
    )


def _manoeuvres(given: Manoeuvres, condition: Condition, controller: Controller) -> tuple[Manoeuvre, Manoeuvre, Manoeuvre]:
    quick, free, swept = given.attitude_quickness, given.dynamic_stability, given.bandwidth.sweep
    fixed = controller, condition.trim_speed, condition.flight_mode
    with _manoeuvre("attitude_quickness"):
        options: dict[str, Any] = {"on": quick.on, "duration": quick.duration}
        first = manoeuvre("step", "V_lon", quick.amplitude, *fixed, name="attitude_quickness", **options)
    with _manoeuvre("dynamic_stability"):
        options = {"on": free.on, "length": free.length, "duration": free.duration}
        second = manoeuvre("pulse", "V_lon", free.amplitude, *fixed, name="dynamic_stability", **options)
    with _manoeuvre("bandwidth.sweep"):
        options = {"omega_min": swept.omega_min, "omega_max": swept.omega_max, "length": swept.length}
        third = manoeuvre("sweep", "V_lon", swept.amplitude, *fixed, name="bandwidth", **options)
    return first, second, third


@contextmanager
def _manoeuvre(name: str) -> Iterator[None]:
    """Errors of a manoeuvre under the path of its section."""
    try:
        yield
    except InputError as error:
        raise InputError(error.field.replace("manoeuvre", f"manoeuvre.{name}", 1), error.problem) from None


def _windows(given: FrequencyGrid, swept: Manoeuvre) -> tuple[float, ...]:
    for i, window in enumerate(given.sweep.windows, 1):
        if not 0.0 < window <= swept.duration:
            raise InputError(
                f"manoeuvre.bandwidth.sweep.windows.{i}", f"is {window:g} s, must lie within the record of {swept.duration:g} s"
            )
    return tuple(given.sweep.windows)


def _omega(given: FrequencyGrid, controller: Controller) -> FloatArray:
    nyquist = math.pi * controller.rate
    if not 0.0 < given.omega_min < given.omega_max < nyquist:
        raise InputError(
            "manoeuvre.bandwidth.omega_max",
            f"is {given.omega_max:g} rad/s; needs 0 < omega_min < omega_max < {nyquist:.4g} rad/s (Nyquist), "
            f"with omega_min = {given.omega_min:g}",
        )
    return np.geomspace(given.omega_min, given.omega_max, given.points)


def method_of(given: MethodTable) -> Method:
    """Sizes and options of the analysis; InputError unless the Sobol design has a power of two."""
    n = given.base_points
    if n & (n - 1):
        near = 1 << (n.bit_length() - 1)
        raise InputError("method.base_points", f"{n} is not a power of two; the nearest are {near} and {2 * near}")
    return Method(**given.model_dump())


def _boundaries_source(name: str) -> str:
    """Name in the library, or path of the user's own file."""
    return str(Path(name).resolve()) if name.endswith(".toml") else name
