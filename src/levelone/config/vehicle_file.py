"""Vehicle files: a TOML file and its rotor tables become a :class:`levelone.vehicle.Vehicle`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from levelone.config.changes import Change, changed
from levelone.config.files import PathOrName, beside, file_hash, joint_hash, path_of, read_toml, shipped
from levelone.config.quantities import Quantity, origins
from levelone.config.rotor_csv import read_rotor_table
from levelone.config.schema import check, in_file, in_section
from levelone.config.vehicle_schema import (
    OPTIONAL_COEFFICIENTS,
    Control,
    PusherGroup,
    RateLoop,
    RotorGroup,
    VehicleFile,
    VelocityLoop,
)
from levelone.errors import InputError
from levelone.vehicle import (
    COEFFICIENTS,
    PID,
    SENSOR_CHANNELS,
    Aerodynamics,
    Airframe,
    Controller,
    MassProperties,
    Pushers,
    Rotors,
    RotorTable,
    Schedule,
    Sensors,
    Validity,
    Vehicle,
)


def library() -> dict[str, Path]:
    """Vehicles that ship with the package: name and file."""
    return shipped("levelone.vehicle")


def vehicle_path(path_or_name: PathOrName) -> Path:
    """File of a vehicle of the library by its name, or of the user's by its path (which ends in .toml).

    Raises
    ------
    InputError
        Neither a known name nor a path; the closest name is in the text.
    """
    return path_of(path_or_name, library(), "vehicle")


def load_vehicle(path_or_name: PathOrName, changes: Mapping[str, Change] | None = None) -> Vehicle:
    """Read a vehicle.

    Parameters
    ----------
    path_or_name
        Path of a .toml file, or the name of a vehicle of the library (``"reference-evtol"``). Paths in the file are relative
        to it and stay in its folder. The format is described in docs/reference/vehicle-file.md.
    changes
        Entries of the file to change first, see :func:`levelone.config.changes.changed`:
        ``{"controller.pitch_rate.Kp": 5.0, "rotors.position.x": 1.2}``. The controller is designed for the changed vehicle. The
        vehicles of one file under any changes share its rotor table, so that they can be flown as one batch.

    Returns
    -------
    Vehicle
        SI and radians; ``assumed`` lists every field that the file marks as assumed, with its reason.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed.
    """
    path = vehicle_path(path_or_name)
    content = _content(path, changes)
    with in_file(path.name):
        assumed = tuple(_assumed(content))
        airframe = _airframe(content, path)
        controller = _controller(content.controller, airframe)
        return Vehicle(
            name=content.vehicle.name,
            airframe=airframe,
            controller=controller,
            sensors=_sensors(content, controller.period),
            validity=_validity(content),
            assumed=assumed,
        )


def load_fine_table(path_or_name: PathOrName) -> RotorTable | None:
    """The vehicle's rotor table on its finer grid; None where its file names none."""
    path = vehicle_path(path_or_name)
    with in_file(path.name):
        name = _content(path).rotors.table.fine_file
        return None if name is None else _table(path, name, "rotors.table.fine_file")


def with_table(vehicle: Vehicle, table: RotorTable) -> Vehicle:
    """The same vehicle, its controller's design included, with another rotor table."""
    airframe = replace(vehicle.airframe, rotors=replace(vehicle.airframe.rotors, table=table))
    design = replace(vehicle.controller.design, rotors=replace(vehicle.controller.design.rotors, table=table))
    return replace(vehicle, airframe=airframe, controller=replace(vehicle.controller, design=design))


def table_hash(path_or_name: PathOrName) -> str:
    """SHA-256 of the vehicle's rotor table as a file."""
    path = vehicle_path(path_or_name)
    with in_file(path.name):
        return file_hash(beside(path, _content(path).rotors.table.file, "rotors.table.file"))


def vehicle_hash(path_or_name: PathOrName) -> str:
    """SHA-256 over the vehicle's file and all of its tables."""
    path = vehicle_path(path_or_name)
    with in_file(path.name):
        table = _content(path).rotors.table
        names = [("file", table.file)] + ([("fine_file", table.fine_file)] if table.fine_file else [])
        return joint_hash([path, *(beside(path, name, f"rotors.table.{key}") for key, name in names)])


def _content(path: Path, changes: Mapping[str, Change] | None = None) -> VehicleFile:
    content = read_toml(path)
    if changes:
        with in_file(path.name):
            content = changed(content, changes)
    return check(VehicleFile, content, path.name)


def _table(path: Path, name: str, field: str) -> RotorTable:
    return read_rotor_table(beside(path, name, field), field)


def _assumed(content: VehicleFile) -> list[tuple[str, str]]:
    found = list(origins(content))
    for group, why in OPTIONAL_COEFFICIENTS.items():
        missing = [name for name in group if getattr(content.aerodynamics, name) is None]
        if missing:
            found.append((f"aerodynamics.{', '.join(missing)}", why))
    return found


def _airframe(content: VehicleFile, path: Path) -> Airframe:
    mass, air = content.mass, content.environment
    with in_section("mass"):
        properties = MassProperties(mass.mass.value, mass.I_xx.value, mass.I_yy.value, mass.I_zz.value, mass.I_xz.value)
    return Airframe(
        mass=properties,
        aerodynamics=_aerodynamics(content.aerodynamics),
        rotors=_rotors(content.rotors, path),
        pushers=_pushers(content.pushers),
        air_density=air.air_density.value,
        gravity=air.gravity.value,
    )


def _aerodynamics(given: Any) -> Aerodynamics:
    knots = np.zeros(1) if given.airspeed is None else given.airspeed.value
    values = np.empty((len(knots), len(COEFFICIENTS)))
    for j, name in enumerate(COEFFICIENTS):
        number = getattr(given, name)
        column: Any = 0.0 if number is None else number.value
        if np.ndim(column) and given.airspeed is None:
            raise InputError(
                f"aerodynamics.{name}", f"has {len(column)} values, and aerodynamics.airspeed gives no speeds for them"
            )
        if np.ndim(column) and len(column) != len(knots):
            raise InputError(
                f"aerodynamics.{name}", f"has {len(column)} values for the {len(knots)} speeds of aerodynamics.airspeed"
            )
        values[:, j] = column
    with in_section("aerodynamics"):
        return Aerodynamics(given.area.value, given.chord.value, given.span.value, Schedule(knots, values))


def _rotors(given: RotorGroup, path: Path) -> Rotors:
    n = len(given.position.value)
    for name in ("axis", "spin", "effectiveness"):
        _check_count(f"rotors.{name}", getattr(given, name), n)
    with in_section("rotors"):
        return Rotors(
            position=given.position.value,
            axis=np.tile([0.0, 0.0, -1.0], (n, 1)) if given.axis is None else given.axis.value,
            spin=given.spin.value,
            effectiveness=np.ones(n) if given.effectiveness is None else given.effectiveness.value,
            table=_table(path, given.table.file, "rotors.table.file"),
            K_T=given.K_T.value,
            K_T_table=given.K_T_table.value,
            T_u=given.T_u.value,
            tau_d=given.tau_d.value,
            motor_lag=given.motor_lag.value,
            throttle_exponent=1.0 if given.throttle_exponent is None else given.throttle_exponent.value,
            local_velocity=given.velocity == "local",
        )


def _pushers(given: PusherGroup | None) -> Pushers:
    if given is None:
        return Pushers(np.empty((0, 3)), np.empty((0, 3)), 0.0)
    n = len(given.position.value)
    _check_count("pushers.axis", given.axis, n)
    axis = np.tile([1.0, 0.0, 0.0], (n, 1)) if given.axis is None else given.axis.value
    if not np.allclose(np.linalg.norm(axis, axis=1), 1.0, atol=1e-9):
        raise InputError("pushers.axis", "must be unit vectors")
    return Pushers(given.position.value, axis, given.max_thrust.value)


def _check_count(field: str, given: Quantity | None, n: int) -> None:
    if given is not None and len(given.value) != n:
        raise InputError(field, f"has {len(given.value)} entries, and position has {n}")


def _controller(given: Control, design: Airframe) -> Controller:
    gains: dict[str, Any] = {
        name: _loop(part) if isinstance(part, VelocityLoop | RateLoop) else part.value
        for name in Control.model_fields
        if isinstance(part := getattr(given, name), Quantity | VelocityLoop | RateLoop)
    }
    first, last, step = gains.pop("trim_speeds")
    steps = (last - first) / step if step > 0 else 0.0
    if steps < 2 or abs(steps - round(steps)) > 1e-6 * steps:
        raise InputError(
            "controller.trim_speeds", f"needs [first, last, step] with two whole steps or more, got {first:g}, {last:g}, {step:g}"
        )
    with in_section("controller"):
        return Controller(design=design, trim_speeds=(float(first), float(last), float(step)), **gains)


def _loop(given: VelocityLoop | RateLoop) -> PID:
    return PID(given.Kp.value, given.Ki.value, given.Kd.value, given.tau_f.value, given.limit.value)


def _sensors(content: VehicleFile, period: float) -> Sensors:
    lag, delay = np.zeros(len(SENSOR_CHANNELS)), np.zeros(len(SENSOR_CHANNELS), dtype=np.int64)
    for j, name in enumerate(SENSOR_CHANNELS):
        channel = getattr(content.sensors, name) if content.sensors is not None else None
        if channel is None:
            continue
        lag[j] = channel.lag.value if channel.lag else 0.0
        seconds = channel.delay.value if channel.delay else 0.0
        delay[j] = round(seconds / period)
        if abs(seconds - delay[j] * period) > 1e-9:
            raise InputError(
                f"sensors.{name}.delay",
                f"{seconds:g} s is no whole number of control periods of {period:g} s; the nearest is {delay[j] * period:g} s",
            )
    return Sensors(lag, delay)


def _validity(content: VehicleFile) -> Validity:
    ranges = {}
    for name in ("alpha", "beta"):
        low, high = getattr(content.validity, name).value.tolist()
        if not low < high:
            raise InputError(f"validity.{name}", f"range reversed or empty: {low:g} to {high:g} rad")
        ranges[name] = (low, high)
    return Validity(airspeed_min=content.validity.airspeed_min.value, **ranges)
