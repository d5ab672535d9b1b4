"""Steady flight: Newton on the six accelerations, for one airframe or many, and the design vehicle's trim table.

Unknowns are pitch and roll attitude and the four mixer commands (upward force, roll, pitch and yaw moment); heading is north,
sideways ground speed zero. Residuals are forces over weight and moments over weight times chord.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from levelone.compiled import kernel
from levelone.dynamics import rotors as rot
from levelone.dynamics.controller import (
    L_LAT,
    L_LON,
    L_P,
    L_Q,
    L_R,
    L_VERT,
    LAG_LON,
    M_P,
    M_Q,
    M_R,
    M_VLAT,
    M_VLON,
    M_VVERT,
    N_MEMORY,
    PHI_TRIM,
    THETA_TRIM,
    Law,
    Laws,
    gains_of,
    read_trim,
    trim_place,
)
from levelone.dynamics.integrate import N_SENSORS, measure
from levelone.dynamics.model import N_STATE, Plant, make_work, plant_of, plants_of
from levelone.dynamics.newton import N_UNKNOWN, SETTLED, newton
from levelone.errors import InputError
from levelone.status import Status
from levelone.vehicle import Vehicle, VehicleBatch, allocation, batch_of, design_slopes
from levelone.vehicle.tables import FloatArray, piecewise_cubics

AXES = ("X", "Y", "Z", "L", "M", "N")
OK, TRIM_FAILED = int(Status.OK), int(Status.TRIM_FAILED)


@dataclass(frozen=True)
class Trim:
    """Trimmed flight of each airframe of a batch.

    Parameters
    ----------
    state
        [n, 13] in the order of ``STATE_NAMES``.
    attitude
        [n, 2] theta and phi, rad.
    mixer
        [n, 4] upward force (N) and roll, pitch, yaw moments (N m) on top of the design vehicle's feed-forward.
    throttle
        [n, rotors].
    residual
        [n, 6] forces over weight and moments over weight times chord.
    status
        [n] codes of :class:`levelone.status.Status`; also set where a throttle or a loop would leave its limits.
    memory
        [n, ..] controller memory in this trim.
    """

    state: FloatArray
    attitude: FloatArray
    mixer: FloatArray
    throttle: FloatArray
    residual: FloatArray
    status: NDArray[np.int64]
    memory: FloatArray


@kernel
def trim_chunk(plants, laws, speeds, climb, wind, unknowns, residuals, states, memories, throttles, status):
    """Trim each airframe of a chunk at its own speed; fills the state, controller memory and throttles from which runs start."""
    scalars, wrench, cubics, rest = plants
    n = laws.allocation.shape[1]
    base, y = np.empty(n), np.empty(N_SENSORS)
    for i in range(len(scalars)):
        k = laws.which[i]
        law = Law(laws.gains[k], laws.pid[k], laws.allocation[k], laws.trim[k])
        g = law.gains
        plant = Plant(scalars[i], wrench[i], cubics[i], *rest)
        work = make_work(plant)
        z, x, memory, throttle = unknowns[i], states[i], memories[i], throttles[i]
        segment, d = trim_place(law, speeds[i])
        theta, phi = read_trim(law, segment, d, 0), read_trim(law, segment, d, 1)
        for r in range(n):
            base[r] = read_trim(law, segment, d, 2 + r)
        # straight from level flight; where that wanders off, through steps of the climb that each start from the last
        for stages in (1, 8):
            z[:] = 0.0
            z[0], z[1] = theta, phi
            for stage in range(stages):
                part = climb * (stage + 1.0) / stages
                good = newton(
                    plant,
                    work,
                    law.allocation,
                    base,
                    g.throttle_min,
                    g.throttle_max,
                    speeds[i],
                    part,
                    wind,
                    z,
                    x,
                    throttle,
                    residuals[i],
                )
            if good or climb == 0.0:
                break
        good = good and throttle.min() >= g.throttle_min and throttle.max() <= g.throttle_max
        measure(x, y)
        memory[:] = 0.0
        for loop, channel in enumerate((M_VLON, M_VLAT, M_VVERT, M_P, M_Q, M_R)):
            memory[2 * loop + 1] = y[channel]
        memory[2 * L_LON], memory[2 * L_LAT] = (theta - z[0]) * g.gravity, (z[1] - phi) * g.gravity
        memory[2 * L_VERT] = z[2] / g.mass
        memory[2 * L_P], memory[2 * L_Q], memory[2 * L_R] = z[3] / g.I_xx, z[4] / g.I_yy, z[5] / g.I_zz
        # a trim that lies beyond the limit of a loop cannot be held by it
        for loop in range(len(law.pid)):
            good = good and abs(memory[2 * loop]) <= law.pid[loop, 4]
        status[i] = OK if good else TRIM_FAILED
        memory[LAG_LON] = speeds[i]
        memory[PHI_TRIM], memory[THETA_TRIM] = z[1], z[0]


def rotor_at_rest(plant: Plant) -> FloatArray:
    """[201, 3] throttle, thrust and torque of the table's rotor at zero airspeed."""
    spline = np.ascontiguousarray(plant.spline.reshape(*plant.spline.shape[:2], -1, 2)[:, :, : -rot.BLOCK // 2])
    curve = float(plant.scalars["throttle_exponent"])
    return np.array([(t, *rot.read_table(spline, plant.grid, t**curve, 0.0, 0.0)) for t in np.linspace(0.0, 1.0, 201)])


def stacked(laws: Sequence[Law], which: NDArray[np.int64]) -> Laws:
    """Controllers side by side, and which of them flies each run."""
    gains, pid, alloc, table = (np.stack(part) for part in zip(*laws, strict=True))
    return Laws(gains, pid, alloc, table, which)


def laws_of(batch: VehicleBatch) -> Laws:
    """The controllers of a batch; see :func:`law_of`."""
    vehicles = [replace(batch.nominal, controller=controller) for controller in batch.controllers]
    return stacked([law_of(vehicle) for vehicle in vehicles], batch.which)


def law_of(vehicle: Vehicle) -> Law:
    """The controller with its allocation and the trim table of the vehicle it was designed for.

    Raises
    ------
    InputError
        If the design vehicle cannot hover, or cannot be trimmed at a speed of its own table.
    """
    controller = vehicle.controller
    design = batch_of(Vehicle(vehicle.name, controller.design, controller, validity=vehicle.validity))
    hover, thrust_slope, torque_slope = design_slopes(controller.design, rotor_at_rest(plant_of(design)))
    alloc = allocation(controller.design.rotors, thrust_slope, torque_slope)
    first, last, step = controller.trim_speeds
    speeds: FloatArray = first + step * np.arange(round((last - first) / step) + 1, dtype=float)
    level = np.concatenate([[0.0, 0.0], np.full(len(alloc), hover)])
    gains, pid = gains_of(controller)
    start = Law(gains, pid, alloc, piecewise_cubics(speeds, np.tile(level, (len(speeds), 1))))
    everywhere = design.select(np.zeros(len(speeds), dtype=np.intp))
    table = run_trim(everywhere, stacked([start], everywhere.which), speeds)
    for i in np.flatnonzero(np.abs(table.residual).max(axis=1) > SETTLED):
        worst = AXES[int(np.argmax(np.abs(table.residual[i])))]
        raise InputError(
            "controller.trim_speeds",
            f"the vehicle has no level trim at {speeds[i]:.3g} m/s (largest residual on {worst})",
        )
    return Law(gains, pid, alloc, piecewise_cubics(speeds, np.hstack([table.attitude, table.throttle])))


def run_trim(
    batch: VehicleBatch,
    laws: Laws,
    speeds: FloatArray,
    climb: float = 0.0,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Trim:
    """Trim each airframe of a batch at its own speed."""
    n = len(batch)
    unknowns, residual = np.empty((n, N_UNKNOWN)), np.empty((n, N_UNKNOWN))
    state, memory = np.empty((n, N_STATE)), np.empty((n, N_MEMORY))
    throttle, status = np.empty((n, batch.nominal.n_rotors)), np.empty(n, np.int64)
    trim_chunk(plants_of(batch), laws, speeds, float(climb), wind, unknowns, residual, state, memory, throttle, status)
    return Trim(state, unknowns[:, :2], unknowns[:, 2:], throttle, residual, status, memory)


def design_trim(batch: VehicleBatch, laws: Laws, speed: float, climb: float, wind: tuple[float, float, float]) -> Trim:
    """For each airframe of a batch, the trim of the vehicle that its controller was designed for."""
    designs = batch_of([replace(batch.nominal, airframe=each.design, controller=each) for each in batch.controllers])
    found = run_trim(designs, laws._replace(which=designs.which), np.full(len(designs), speed), climb, wind)
    return Trim(*(getattr(found, field.name)[batch.which] for field in fields(Trim)))


def trim(
    vehicles: Vehicle | VehicleBatch,
    speed: float,
    climb: float = 0.0,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Trim:
    """Trim at a ground speed and climb rate.

    Parameters
    ----------
    vehicles
        One vehicle or a batch.
    speed
        Forward ground speed V_lon, m/s.
    climb
        Rate of climb, m/s.
    wind
        Steady wind towards north, east, down, m/s.

    Returns
    -------
    Trim
        A failed trim is NaN with the status ``TRIM_FAILED``; it keeps the residual of each axis.
    """
    batch = batch_of(vehicles)
    found = run_trim(batch, laws_of(batch), np.full(len(batch), float(speed)), climb, wind)
    for values in (found.state, found.attitude, found.mixer, found.throttle, found.memory):
        values[found.status != Status.OK] = np.nan
    return found
