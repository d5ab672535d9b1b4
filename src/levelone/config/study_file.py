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

from levelone.config.factor_table import factor_of
from levelone.config.files import file_hash, read_toml
from levelone.config.manoeuvres import manoeuvre
from levelone.config.schema import check, in_file
from levelone.config.study_schema import Condition, FrequencyGrid, Manoeuvres, MethodTable, StudyFile
from levelone.config.vehicle_file import library, load_vehicle, vehicle_path
from levelone.errors import InputError
from levelone.handling.history import FloatArray
from levelone.handling.levels import Boundaries, load_boundaries
from levelone.handling.manoeuvres import Manoeuvre
from levelone.uncertainty import FactorSpace
from levelone.uncertainty.failures import Policy
from levelone.vehicle import Controller, Vehicle, vary


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
        The study file and its SHA-256.
    vehicle, vehicle_path
        The nominal vehicle and its file.
    seed
        From which the seeds of all stages are derived.
    policy
        What failed runs do to indices: "refuse", "drop" or "bound".
    trim_speed, flight_mode
        m/s, level flight; mode of the controller.
    quickness, stability, sweep
        Manoeuvres: the step, the pulse, and the sweep that the linear response is compared with.
    windows
        s: window lengths of the sweep's spectra.
    omega
        [nf] rad/s: frequencies of the linear response.
    space, targets, nominal
        Factors in the unit of what they set; their targets (names in ``levelone.vehicle.TARGETS``) and [factors] nominal values.
    method
        Sizes and options of the analysis.
    boundaries, boundaries_source, task
        Level boundaries, where they come from (library name or path), and the bandwidth chart that sets the Level.
    not_validated, validity_domain, notes
        Statements that the report repeats.
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
    quickness: Manoeuvre
    stability: Manoeuvre
    sweep: Manoeuvre
    windows: tuple[float, ...]
    omega: FloatArray
    space: FactorSpace
    targets: tuple[str, ...]
    nominal: FloatArray
    method: Method
    boundaries: Boundaries
    boundaries_source: str
    task: str
    not_validated: tuple[str, ...]
    validity_domain: tuple[str, ...]
    notes: tuple[str, ...]


def load_study(path: str | PathLike[str]) -> Study:
    """Read a study and its vehicle, and refuse what would fail in every run.

    Parameters
    ----------
    path
        TOML file; the format is described in docs/reference/study-file.md. A vehicle's or boundaries' path is relative to it.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed.
    """
    path = Path(path)
    content = check(StudyFile, read_toml(path), path.name)
    with in_file(path.name):
        where = _vehicle_path(content.study.vehicle, path)
    vehicle = load_vehicle(where)
    with in_file(path.name):
        return _study(content, path, vehicle, where)


def _study(content: StudyFile, path: Path, vehicle: Vehicle, where: Path) -> Study:
    general, condition = content.study, content.condition
    quickness, stability, swept = _manoeuvres(content.manoeuvre, condition, vehicle.controller)
    space, targets, nominal = _factors(content, vehicle)
    _check_corners(vehicle, space, targets, (quickness, stability, swept))
    source = _boundaries_source(content.levels.boundaries, path)
    boundaries = load_boundaries(source)
    boundaries.chart("bandwidth", content.levels.task)
    return Study(
        name=general.name,
        title=general.title,
        intended_use=general.intended_use,
        path=path,
        hash=file_hash(path),
        vehicle=vehicle,
        vehicle_path=where,
        seed=general.seed,
        policy=general.failures,
        trim_speed=condition.trim_speed,
        flight_mode=condition.flight_mode,
        quickness=quickness,
        stability=stability,
        sweep=swept,
        windows=_windows(content.manoeuvre.bandwidth, swept),
        omega=_omega(content.manoeuvre.bandwidth, vehicle.controller),
        space=space,
        targets=targets,
        nominal=nominal,
        method=_method(content.method),
        boundaries=boundaries,
        boundaries_source=source,
        task=content.levels.task,
        not_validated=tuple(general.not_validated),
        validity_domain=tuple(general.validity_domain),
        notes=tuple(general.notes),
    )


def _vehicle_path(name: str, study: Path) -> Path:
    if name in library() or not name.endswith(".toml"):
        return vehicle_path(name)
    return study.parent / name


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


def _method(given: MethodTable) -> Method:
    n = given.base_points
    if n & (n - 1):
        near = 1 << (n.bit_length() - 1)
        raise InputError("method.base_points", f"{n} is not a power of two; the nearest are {near} and {2 * near}")
    return Method(**given.model_dump())


def _factors(content: StudyFile, vehicle: Vehicle) -> tuple[FactorSpace, tuple[str, ...], FloatArray]:
    factors, targets, nominal = zip(
        *(factor_of(table, vehicle, content.condition.trim_speed) for table in content.factor), strict=True
    )
    for target in targets:
        if targets.count(target) > 1:
            same = [factor.name for factor in factors if factor.target == target]
            raise InputError(f"factor.{same[1]}", f"sets {target} as the factor {same[0]} does; each target may be set once")
    space = FactorSpace(factors)
    space.require_bounded("a Morris design")
    values = np.array(nominal)
    values.setflags(write=False)
    return space, targets, values


def _check_corners(vehicle: Vehicle, space: FactorSpace, targets: tuple[str, ...], manoeuvres: tuple[Manoeuvre, ...]) -> None:
    """Refuse a box whose lowest or highest corner is no vehicle, or leaves what every run needs."""
    from levelone.dynamics.simulate import check_before_flight

    corners = space.transform(np.array([[0.0], [1.0]]) * np.ones(len(space)))
    try:
        batch = vary(vehicle, targets, corners, manoeuvres[0].trim_speed)
    except InputError as error:
        name = space.names[targets.index(error.field)] if error.field in targets else error.field
        raise InputError(f"factor.{name}.range", error.problem) from None
    for flown in manoeuvres:
        check_before_flight(batch, flown)


def _boundaries_source(name: str, study: Path) -> str:
    """Name in the library, or path of the user's own file."""
    return str((study.parent / name).resolve()) if name.endswith(".toml") else name
