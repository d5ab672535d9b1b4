"""Steady flight: Newton on the six accelerations, for one airframe or many, and the design vehicle's trim table.

Unknowns are pitch and roll attitude and the four mixer commands (upward force, roll, pitch and yaw moment); heading is north,
sideways ground speed zero. Residuals are forces over weight and moments over weight times chord.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from levelone.compiled import innermost, kernel
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
    gains_of,
    read_trim,
    trim_place,
)
from levelone.dynamics.frames import quaternion, to_body
from levelone.dynamics.integrate import N_SENSORS, measure
from levelone.dynamics.model import N_STATE, Inputs, Plant, make_work, plant_of, plants_of, rate_under
from levelone.errors import InputError
from levelone.status import Status
from levelone.vehicle import Vehicle, VehicleBatch, allocation, batch_of, design_slopes
from levelone.vehicle.tables import FloatArray, piecewise_cubics

N_UNKNOWN = 6
#: residual at which Newton stops, and the largest that counts as a trim
TOLERANCE, SETTLED = 1e-11, 1e-10
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


@innermost
def solve_in_place(a, b):
    """Gaussian elimination with partial pivoting; leaves the solution in ``b``. Returns False for a singular matrix."""
    n = len(b)
    for c in range(n):
        best = c
        for r in range(c + 1, n):
            if abs(a[r, c]) > abs(a[best, c]):
                best = r
        if not abs(a[best, c]) > 1e-14:
            return False
        for j in range(n):
            a[c, j], a[best, j] = a[best, j], a[c, j]
        b[c], b[best] = b[best], b[c]
        for r in range(c + 1, n):
            factor = a[r, c] / a[c, c]
            for j in range(c, n):
                a[r, j] -= factor * a[c, j]
            b[r] -= factor * b[c]
    for c in range(n - 1, -1, -1):
        for j in range(c + 1, n):
            b[c] -= a[c, j] * b[j]
        b[c] /= a[c, c]
    return True


@innermost
def steady_state(z, speed, climb, x):
    """State in steady flight at attitude z[0] (theta), z[1] (phi), heading north."""
    q0, q1, q2, q3 = quaternion(z[1], z[0], 0.0)
    for j in range(N_STATE):
        x[j] = 0.0
    x[3], x[4], x[5] = to_body(q0, q1, q2, q3, speed, 0.0, -climb)
    x[6], x[7], x[8], x[9] = q0, q1, q2, q3


@innermost
def residual_of(plant, work, alloc, base, z, speed, climb, wind, x, throttle, out):
    """Accelerations as forces over weight and moments over weight times chord."""
    steady_state(z, speed, climb, x)
    for i in range(len(throttle)):
        throttle[i] = base[i] + alloc[i, 0] * z[2] + alloc[i, 1] * z[3] + alloc[i, 2] * z[4] + alloc[i, 3] * z[5]
    rate = rate_under(plant, work, x, throttle, Inputs(0.0, (0.0, 0.0, 0.0), wind, (0.0, 0.0, 0.0)))
    a = plant.scalars
    arm = a.mass * a.gravity * a.chord
    for j in range(3):
        out[j] = rate[3 + j] / a.gravity
    out[3] = (a.I_xx * rate[10] - a.I_xz * rate[12]) / arm
    out[4] = a.I_yy * rate[11] / arm
    out[5] = (a.I_zz * rate[12] - a.I_xz * rate[10]) / arm


@innermost
def keep_collective(alloc, base, low, high, z):
    """Shift the upward force in ``z`` until the lowest (or else the highest) throttle lies inside its limits."""
    least, most, first, last = np.inf, -np.inf, 0, 0
    for i in range(len(base)):
        t = base[i] + alloc[i, 0] * z[2] + alloc[i, 1] * z[3] + alloc[i, 2] * z[4] + alloc[i, 3] * z[5]
        if t < least:
            least, first = t, i
        if t > most:
            most, last = t, i
    if least < low and alloc[first, 0] > 0.0:
        z[2] += (low - least) / alloc[first, 0]
    elif most > high and alloc[last, 0] > 0.0:
        z[2] -= (most - high) / alloc[last, 0]


@innermost
def damped_step(jacobian, residual, damping, normal, step):
    """Step of Levenberg and Marquardt: Newton's for no damping, towards steepest descent for much; False if it is undefined."""
    n = len(step)
    for i in range(n):
        step[i] = 0.0
        for k in range(n):
            step[i] += jacobian[k, i] * residual[k]
        for j in range(n):
            normal[i, j] = damping if i == j else 0.0
            for k in range(n):
                normal[i, j] += jacobian[k, i] * jacobian[k, j]
    return solve_in_place(normal, step)


@innermost
def largest(v):
    """Largest absolute value; NaN where one is NaN."""
    out = 0.0
    for x in v:
        if abs(x) > out or math.isnan(x):
            out = abs(x)
    return out


@innermost
def square(v):
    """Sum of squares."""
    out = 0.0
    for x in v:
        out += x * x
    return out


@kernel
def newton(plant, work, alloc, base, low, high, speed, climb, wind, z, x, throttle, residual):
    """Solve for ``z`` in place, from the guess it holds; returns whether the residual fell below the tolerance.

    Every step lowers the residual, if need be by damping, and leaves the throttles where the rotors answer: at the ends of their
    table thrust has no slope, and Newton's method would stop there although a trim exists.
    """
    n = N_UNKNOWN
    shifted, step, trial, scale = np.empty(n), np.empty(n), np.empty(n), np.ones(n)
    jacobian, normal = np.empty((n, n)), np.empty((n, n))
    weight = plant.scalars.mass * plant.scalars.gravity
    scale[2] = weight
    scale[3] = scale[4] = scale[5] = weight * plant.scalars.chord
    damping, moved = 0.0, True
    keep_collective(alloc, base, low, high, z)
    residual_of(plant, work, alloc, base, z, speed, climb, wind, x, throttle, residual)
    for _ in range(60):
        if largest(residual) < TOLERANCE or not moved:
            break
        for j in range(n):
            kept = z[j]
            z[j] = kept + 1e-6 * scale[j]
            residual_of(plant, work, alloc, base, z, speed, climb, wind, x, throttle, shifted)
            z[j] = kept
            for i in range(n):
                jacobian[i, j] = (shifted[i] - residual[i]) / 1e-6
        moved = False
        for _ in range(12):
            defined = damped_step(jacobian, residual, damping, normal, step)
            # attitude steps are limited: the incidence model is linear only near level flight
            shrink = min(1.0, 0.2 / max(abs(step[0]), abs(step[1]), 1e-12))
            for j in range(n):
                trial[j] = z[j] - shrink * scale[j] * step[j]
            keep_collective(alloc, base, low, high, trial)
            residual_of(plant, work, alloc, base, trial, speed, climb, wind, x, throttle, shifted)
            if defined and square(shifted) < square(residual):
                for j in range(n):
                    z[j], residual[j] = trial[j], shifted[j]
                damping, moved = 0.1 * damping if damping > 1e-6 else 0.0, True
                break
            damping = max(10.0 * damping, 1e-4)
    residual_of(plant, work, alloc, base, z, speed, climb, wind, x, throttle, residual)
    return largest(residual) < SETTLED


@kernel
def trim_chunk(plants, law, speeds, climb, wind, unknowns, residuals, states, memories, throttles, status):
    """Trim each airframe of a chunk at its own speed; fills the state, controller memory and throttles from which runs start."""
    scalars, wrench, cubics, rest = plants
    g, n = law.gains, law.allocation.shape[0]
    base, y = np.empty(n), np.empty(N_SENSORS)
    for i in range(len(scalars)):
        plant = Plant(scalars[i], wrench[i], cubics[i], *rest)
        work = make_work(plant)
        z, x, memory, throttle = unknowns[i], states[i], memories[i], throttles[i]
        segment, d = trim_place(law, speeds[i])
        theta, phi = read_trim(law, segment, d, 0), read_trim(law, segment, d, 1)
        for r in range(n):
            base[r] = read_trim(law, segment, d, 2 + r)
        z[:] = 0.0
        z[0], z[1] = theta, phi
        good = newton(
            plant, work, law.allocation, base, g.throttle_min, g.throttle_max, speeds[i], climb, wind, z, x, throttle, residuals[i]
        )
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
    throttle = np.linspace(0.0, 1.0, 201)
    spline = plant.spline.reshape(*plant.spline.shape[:2], -1, 2)[:, :, : -rot.BLOCK // 2]
    return np.array([(t, *rot.read_table(np.ascontiguousarray(spline), plant.grid, t, 0.0, 0.0)) for t in throttle])


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
    table = run_trim(everywhere, start, speeds)
    for i in np.flatnonzero(np.abs(table.residual).max(axis=1) > SETTLED):
        worst = AXES[int(np.argmax(np.abs(table.residual[i])))]
        raise InputError(
            "controller.trim_speeds",
            f"the vehicle has no level trim at {speeds[i]:.3g} m/s (largest residual on {worst})",
        )
    return Law(gains, pid, alloc, piecewise_cubics(speeds, np.hstack([table.attitude, table.throttle])))


def run_trim(
    batch: VehicleBatch,
    law: Law,
    speeds: FloatArray,
    climb: float = 0.0,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Trim:
    """Trim each airframe of a batch at its own speed."""
    n = len(batch)
    unknowns, residual = np.empty((n, N_UNKNOWN)), np.empty((n, N_UNKNOWN))
    state, memory = np.empty((n, N_STATE)), np.empty((n, N_MEMORY))
    throttle, status = np.empty((n, batch.nominal.n_rotors)), np.empty(n, np.int64)
    trim_chunk(plants_of(batch), law, speeds, float(climb), wind, unknowns, residual, state, memory, throttle, status)
    return Trim(state, unknowns[:, :2], unknowns[:, 2:], throttle, residual, status, memory)


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
    found = run_trim(batch, law_of(batch.nominal), np.full(len(batch), float(speed)), climb, wind)
    for values in (found.state, found.attitude, found.mixer, found.throttle, found.memory):
        values[found.status != Status.OK] = np.nan
    return found
