"""Vehicles as arrays for compiled code: many airframes that share a rotor table and the schedule's knots."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelone.errors import InputError, unknown_name
from levelone.vehicle.mixer import effectiveness, pusher_effectiveness
from levelone.vehicle.tables import FloatArray, piecewise_cubics
from levelone.vehicle.vehicle import COEFFICIENTS, Controller, Vehicle

SCALARS = (
    "mass", "I_xx", "I_yy", "I_zz", "I_xz", "area", "chord", "span", "air_density", "gravity",
    "thrust_scale", "T_u", "tau_d", "motor_lag", "throttle_exponent", "airspeed_min",
)  # fmt: skip
AIRFRAME_DTYPE = np.dtype([(name, np.float64) for name in SCALARS])

# What a study may vary, and how it is found in a vehicle: name of the record's field, or a column of the schedule.
TARGETS = {
    "M": "mass", "I_x": "I_xx", "I_y": "I_yy", "I_z": "I_zz", "I_xz": "I_xz", "rho": "air_density",
    "K_T": "thrust_scale", "T_u": "T_u", "tau_d": "tau_d", "motor_lag": "motor_lag", "throttle_exponent": "throttle_exponent",
} | {name: name for name in COEFFICIENTS}  # fmt: skip
TARGET_UNITS = {
    "M": "kg", "I_x": "kg m^2", "I_y": "kg m^2", "I_z": "kg m^2", "I_xz": "kg m^2", "rho": "kg/m^3",
    "K_T": "N/rpm^2", "T_u": "1", "tau_d": "s", "motor_lag": "s", "throttle_exponent": "1",
} | {name: "1" if name.endswith("0") else "1/rad" for name in COEFFICIENTS}  # fmt: skip


@dataclass(frozen=True)
class VehicleBatch:
    """Vehicles that differ in numbers only.

    Parameters
    ----------
    nominal
        Supplies the sensors, the rotor table, and the layout where hubs see their own velocity.
    controllers, which
        The controllers of the batch, each with the vehicle it was designed for, and [n] which one flies each airframe.
    scalars
        [n] records of ``AIRFRAME_DTYPE``.
    wrench
        [n, 12, rotors], see :func:`levelone.vehicle.mixer.effectiveness`.
    cubics
        [n, segments, 4, coefficients] schedule of each airframe.
    """

    nominal: Vehicle
    controllers: tuple[Controller, ...]
    which: NDArray[np.int64]
    scalars: NDArray[np.void]
    wrench: FloatArray
    cubics: FloatArray

    def __len__(self) -> int:
        return len(self.scalars)

    @property
    def knots(self) -> FloatArray:
        """Airspeeds of the schedule's knots, m/s."""
        return self.nominal.airframe.aerodynamics.schedule.knots

    @property
    def layout(self) -> FloatArray:
        """[rotors, 6] hub position (m) and thrust axis."""
        rotors = self.nominal.airframe.rotors
        return np.ascontiguousarray(np.hstack([rotors.position, rotors.axis]))

    @property
    def pushers(self) -> FloatArray:
        """[6, pushers] force and moment at full throttle."""
        return np.ascontiguousarray(pusher_effectiveness(self.nominal.airframe.pushers))

    def select(self, index: slice | NDArray[np.intp]) -> VehicleBatch:
        """Some of the airframes."""
        arrays = {name: getattr(self, name)[index] for name in ("which", "scalars", "wrench", "cubics")}
        return replace(self, **arrays)


def batch_of(vehicles: Vehicle | VehicleBatch | Sequence[Vehicle]) -> VehicleBatch:
    """Arrays of one vehicle, or of several that share sensors, rotor table, pushers and schedule knots.

    Controllers may differ in their gains and in the vehicle they were designed for, not in their rate or their table of trims;
    rotors in their positions unless each hub sees its own velocity.

    Raises
    ------
    InputError
        If the vehicles do not share these.
    """
    if isinstance(vehicles, VehicleBatch):
        return vehicles
    several = [vehicles] if isinstance(vehicles, Vehicle) else list(vehicles)
    if not several:
        raise InputError("vehicles", "an empty list")
    first = several[0]
    for other in several[1:]:
        for what, same in _shared(first, other):
            if not same:
                raise InputError("vehicles", f"{other.name!r} has another {what} than {first.name!r}")
    controllers: dict[int, Controller] = {id(v.controller): v.controller for v in several}
    places = list(controllers)
    return VehicleBatch(
        nominal=first,
        controllers=tuple(controllers.values()),
        which=np.array([places.index(id(v.controller)) for v in several], dtype=np.int64),
        scalars=np.array([_record(v) for v in several], dtype=AIRFRAME_DTYPE),
        wrench=np.stack([effectiveness(v.airframe.rotors) for v in several]),
        cubics=np.stack([v.airframe.aerodynamics.schedule.polynomials for v in several]),
    )


def _shared(first: Vehicle, other: Vehicle) -> Iterator[tuple[str, bool]]:
    """What the airframes of a batch have in common, and whether these two do."""
    a, b = first.airframe, other.airframe
    yield "controller rate", first.controller.rate == other.controller.rate
    yield "controller's trim_speeds", first.controller.trim_speeds == other.controller.trim_speeds
    for name in ("lag", "delay"):
        yield f"sensors.{name}", np.array_equal(getattr(first.sensors, name), getattr(other.sensors, name))
    yield "rotor table", a.rotors.table is b.rotors.table
    for name in ("axis", "local_velocity", *(["position"] if a.rotors.local_velocity else [])):
        yield f"rotors.{name}", np.array_equal(getattr(a.rotors, name), getattr(b.rotors, name))
    yield "set of pushers", np.array_equal(pusher_effectiveness(a.pushers), pusher_effectiveness(b.pushers))
    yield "set of schedule knots", np.array_equal(a.aerodynamics.schedule.knots, b.aerodynamics.schedule.knots)


def _record(vehicle: Vehicle) -> tuple[float, ...]:
    a = vehicle.airframe
    m, aero, rotors = a.mass, a.aerodynamics, a.rotors
    return (
        m.mass, m.I_xx, m.I_yy, m.I_zz, m.I_xz, aero.area, aero.chord, aero.span, a.air_density, a.gravity,
        rotors.K_T / rotors.K_T_table, rotors.T_u, rotors.tau_d, rotors.motor_lag, rotors.throttle_exponent,
        vehicle.validity.airspeed_min,
    )  # fmt: skip


def nominal_value(vehicle: Vehicle, target: str, airspeed: float) -> float:
    """Value of a target in the vehicle itself; coefficients are read at ``airspeed`` (m/s)."""
    if target not in TARGETS:
        raise unknown_name("target", target, TARGETS)
    if target in COEFFICIENTS:
        return vehicle.airframe.aerodynamics.value(target, airspeed)
    if target == "K_T":
        return vehicle.airframe.rotors.K_T
    return float(batch_of(vehicle).scalars[0][TARGETS[target]])


def vary(vehicle: Vehicle, targets: Sequence[str], points: FloatArray, airspeed: float) -> VehicleBatch:
    """One airframe for each row of ``points``; the controller stays that of the nominal vehicle.

    Parameters
    ----------
    vehicle
        The nominal vehicle.
    targets
        Names out of ``TARGETS``, one for each column of ``points``.
    points
        [n, targets] in the units of ``TARGET_UNITS``.
    airspeed
        Speed (m/s) at which a coefficient takes the value asked for; elsewhere its schedule keeps its shape (it is scaled, or
        shifted where it is zero at that speed).

    Raises
    ------
    InputError
        For an unknown target, a value that is not finite, or one that no vehicle can have.
    """
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != len(targets):
        raise InputError("points", f"shape {points.shape} does not fit {len(targets)} targets")
    base = batch_of(vehicle)
    n = len(points)
    scalars = np.repeat(base.scalars, n)
    schedule = vehicle.airframe.aerodynamics.schedule
    values = np.repeat(schedule.values[None], n, axis=0)
    for target, column in zip(targets, points.T, strict=True):
        if target not in TARGETS:
            raise unknown_name("target", target, TARGETS)
        _check_values(target, column)
        if target in COEFFICIENTS:
            j = COEFFICIENTS.index(target)
            here = vehicle.airframe.aerodynamics.value(target, airspeed)
            values[:, :, j] = values[:, :, j] * (column / here)[:, None] if here != 0.0 else values[:, :, j] + column[:, None]
        elif target == "K_T":
            scalars["thrust_scale"] = column / vehicle.airframe.rotors.K_T_table
        else:
            scalars[TARGETS[target]] = column
    if np.any(scalars["I_xx"] * scalars["I_zz"] <= scalars["I_xz"] ** 2):
        raise InputError("I_xz", "some points make the inertia matrix indefinite")
    cubics = piecewise_cubics(schedule.knots, np.moveaxis(values, 0, 1).reshape(len(schedule.knots), -1))
    shaped: Any = cubics.reshape(*cubics.shape[:2], n, -1)
    return replace(
        base,
        which=np.zeros(n, dtype=np.int64),
        scalars=scalars,
        wrench=np.repeat(base.wrench, n, axis=0),
        cubics=np.ascontiguousarray(np.moveaxis(shaped, 2, 0)),
    )


def _check_values(target: str, column: FloatArray) -> None:
    if not np.all(np.isfinite(column)):
        raise InputError(target, "values must be finite numbers")
    if target in {"M", "I_x", "I_y", "I_z", "rho", "K_T", "T_u", "throttle_exponent"} and column.min() <= 0:
        raise InputError(target, f"must be positive, got {column.min()}")
    if target in {"tau_d", "motor_lag"} and column.min() < 0:
        raise InputError(target, f"must not be negative, got {column.min()}")
