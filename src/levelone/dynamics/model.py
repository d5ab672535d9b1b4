"""The airframe: rate of change of a rigid body's state under aerodynamics, rotors, pushers and gravity, over a flat earth.

Source of the equations of motion: Stevens, Lewis and Johnson, Aircraft Control and Simulation, 3rd ed., table 2.5-1 (flat earth,
body axes, quaternion). Rotor inertia (gyroscopic moments) is left out: the rotors turn in pairs of opposite sense.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelone.compiled import inlined, innermost, kernel
from levelone.dynamics import rotors as rot
from levelone.dynamics.aerodynamics import (
    C_LALPHADOT,
    C_MALPHADOT,
    aerodynamic_wrench,
    alphadot_moment,
    alphadot_terms,
    reciprocal,
    set_coefficients,
)
from levelone.dynamics.frames import to_body, to_earth
from levelone.vehicle import Vehicle, VehicleBatch, batch_of
from levelone.vehicle.tables import FloatArray

N_STATE = 13
#: places of the state vector: position north, east, down (m); velocity u, v, w (m/s); quaternion; rates p, q, r (rad/s)
STATE_NAMES = ("north", "east", "down", "u", "v", "w", "q0", "q1", "q2", "q3", "p", "q", "r")


class State(NamedTuple):
    """Rigid-body state: SI, body-axis inertial velocity, quaternion from body axes to north-east-down, rates in rad/s."""

    north: float = 0.0
    east: float = 0.0
    down: float = 0.0
    u: float = 0.0
    v: float = 0.0
    w: float = 0.0
    q0: float = 1.0
    q1: float = 0.0
    q2: float = 0.0
    q3: float = 0.0
    p: float = 0.0
    q: float = 0.0
    r: float = 0.0


class Command(NamedTuple):
    """What reaches the airframe: lift-rotor throttles (0 to 1), pusher throttle (0 to 1), surfaces (rad) and the flight mode."""

    throttle: tuple[float, ...]
    pusher: float = 0.0
    elevator: float = 0.0
    aileron: float = 0.0
    rudder: float = 0.0
    flight_mode: str = "vtol"


class Plant(NamedTuple):
    """One airframe of a batch, as a kernel sees it."""

    scalars: NDArray[np.void]
    wrench: NDArray[np.float64]
    cubics: NDArray[np.float64]
    knots: NDArray[np.float64]
    layout: NDArray[np.float64]
    pushers: NDArray[np.float64]
    spline: NDArray[np.float64]
    grid: NDArray[np.float64]
    flow: int


#: what the discs see: one flow for all, one for each axis, or one for each hub with the velocity of its own place
SHARED_FLOW, FLOW_BY_AXIS, FLOW_BY_HUB = range(3)


class Work(NamedTuple):
    """Scratch arrays of one trajectory, allocated once; ``inverse`` holds 1/m and the inverse inertia (yy, xx, xz, zz)."""

    coefficients: NDArray[np.float64]
    inverse: NDArray[np.float64]
    mix: NDArray[np.float64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]


class Inputs(NamedTuple):
    """Everything besides rotor throttles that acts during a step."""

    pusher: float
    surfaces: tuple[float, float, float]
    wind: tuple[float, float, float]
    wind_slope: tuple[float, float, float]


CALM = Inputs(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@kernel
def make_work(plant):
    """Scratch arrays that fit a plant; they hold its coefficients already where these do not vary with airspeed."""
    n = plant.wrench.shape[1]
    groups = 1 if plant.flow == SHARED_FLOW else n
    coefficients = np.empty(plant.cubics.shape[2])
    set_coefficients(plant.knots, plant.cubics, plant.knots[0], coefficients)
    a = plant.scalars
    det = a.I_xx * a.I_zz - a.I_xz * a.I_xz
    return Work(
        coefficients,
        np.array([1.0 / a.mass, 1.0 / a.I_yy, a.I_zz / det, a.I_xz / det, a.I_xx / det]),
        np.zeros((groups, 6, plant.spline.shape[2])),
        np.zeros(groups, np.int64),
        np.zeros(groups, np.int64),
    )


@inlined
def rotor_wrench(plant, work, u, v, w, speed, per_speed, p, q, r):
    """Body force and moment of the lift rotors (throttles set beforehand)."""
    layout = plant.layout
    fx = fy = fz = mx = my = mz = 0.0
    for g in range(work.mix.shape[0]):
        if plant.flow == FLOW_BY_HUB:
            x, y, z = layout[g, 0], layout[g, 1], layout[g, 2]
            ul, vl, wl = u + q * z - r * y, v + r * x - p * z, w + p * y - q * x
            speed = math.sqrt(ul * ul + vl * vl + wl * wl)
            per_speed = reciprocal(speed)
        else:
            ul, vl, wl = u, v, w
        angle = rot.disc_angle(ul * layout[g, 3] + vl * layout[g, 4] + wl * layout[g, 5], per_speed)
        part = rot.group_wrench(plant.spline, plant.grid, work.mix, g, work.low[g], work.high[g], speed * plant.scalars.T_u, angle)
        fx, fy, fz, mx, my, mz = fx + part[0], fy + part[1], fz + part[2], mx + part[3], my + part[4], mz + part[5]
    return fx, fy, fz, mx, my, mz


@inlined
def state_rate(plant, work, x, inputs, since):
    """Rate of the state ``x``, both tuples: arrays would pass every stage of a step through memory.

    ``since`` is the time (s) over which the wind has drifted from its value in ``inputs``.
    """
    a = plant.scalars
    u, v, w, q0, q1, q2, q3, p, q, r = x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12]
    wind, slope = inputs.wind, inputs.wind_slope
    wu, wv, ww = to_body(q0, q1, q2, q3, wind[0] + slope[0] * since, wind[1] + slope[1] * since, wind[2] + slope[2] * since)
    ua, va, wa = u - wu, v - wv, w - ww
    speed2 = ua * ua + va * va + wa * wa
    speed = math.sqrt(speed2)
    per_speed = reciprocal(speed)
    k = work.coefficients
    if len(plant.knots) > 1:
        set_coefficients(plant.knots, plant.cubics, speed, k)
    ax, ay, az, al, am, an = aerodynamic_wrench(a, k, ua, va, wa, speed, per_speed, p, q, r, inputs.surfaces)
    rx, ry, rz, rl, rm, rn = rotor_wrench(plant, work, ua, va, wa, speed, per_speed, p, q, r)
    px, py, pz, pl, pm, pn = pusher_wrench(plant.pushers, inputs.pusher)
    X, Y, Z = ax + rx + px, ay + ry + py, az + rz + pz
    L, M, N = al + rl + pl, am + rm + pm, an + rn + pn
    gx, gy, gz = to_body(q0, q1, q2, q3, 0.0, 0.0, a.gravity)
    per_mass = work.inverse[0]
    udot = X * per_mass + r * v - q * w + gx
    vdot = Y * per_mass + p * w - r * u + gy
    wdot = Z * per_mass + q * u - p * v + gz
    # lift and moment due to alphadot depend on the acceleration they cause: one linear equation, solved here
    if speed2 > 1e-12 and (k[C_LALPHADOT] != 0.0 or k[C_MALPHADOT] != 0.0):
        Xa, Za = alphadot_terms(a, k, ua, wa)
        # rates of the velocity through the air: in body axes a steady wind turns as the axes turn
        ua_rate, wa_rate = udot + q * ww - r * wv, wdot + p * wv - q * wu
        alphadot = (ua * wa_rate - wa * ua_rate) / (speed2 - (ua * Za - wa * Xa) * per_mass)
        udot += Xa * alphadot * per_mass
        wdot += Za * alphadot * per_mass
        M += alphadot_moment(a, k, speed) * alphadot
    pdot, qdot, rdot = angular_acceleration(a, work.inverse, p, q, r, L, M, N)
    vn, ve, vd = to_earth(q0, q1, q2, q3, u, v, w)
    return (
        vn, ve, vd, udot, vdot, wdot,
        -0.5 * (q1 * p + q2 * q + q3 * r), 0.5 * (q0 * p + q2 * r - q3 * q),
        0.5 * (q0 * q - q1 * r + q3 * p), 0.5 * (q0 * r + q1 * q - q2 * p),
        pdot, qdot, rdot,
    )  # fmt: skip


@inlined
def pusher_wrench(wrench, throttle):
    """Body force and moment of the pushers; off in VTOL mode."""
    X = Y = Z = L = M = N = 0.0
    if throttle != 0.0:
        for i in range(wrench.shape[1]):
            X += throttle * wrench[0, i]
            Y += throttle * wrench[1, i]
            Z += throttle * wrench[2, i]
            L += throttle * wrench[3, i]
            M += throttle * wrench[4, i]
            N += throttle * wrench[5, i]
    return X, Y, Z, L, M, N


@inlined
def angular_acceleration(a, inverse, p, q, r, L, M, N):
    """Euler's equations with the product of inertia I_xz, rad/s^2."""
    hx, hy, hz = a.I_xx * p - a.I_xz * r, a.I_yy * q, a.I_zz * r - a.I_xz * p
    lx, lz = L - (q * hz - r * hy), N - (p * hy - q * hx)
    return inverse[2] * lx + inverse[3] * lz, (M - (r * hx - p * hz)) * inverse[1], inverse[3] * lx + inverse[4] * lz


@inlined
def as_state(x):
    """State array as a tuple."""
    return (x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12])


@inlined
def along(x, k, h):
    """x + h k for state tuples."""
    return (
        x[0] + h * k[0], x[1] + h * k[1], x[2] + h * k[2], x[3] + h * k[3], x[4] + h * k[4], x[5] + h * k[5], x[6] + h * k[6],
        x[7] + h * k[7], x[8] + h * k[8], x[9] + h * k[9], x[10] + h * k[10], x[11] + h * k[11], x[12] + h * k[12],
    )  # fmt: skip


@innermost
def rate_under(plant, work, x, throttle, inputs):
    """Rate of the state array ``x`` under given throttles, as a tuple."""
    rot.set_throttles(throttle, plant, work)
    return state_rate(plant, work, as_state(x), inputs, 0.0)


def plants_of(batch: VehicleBatch) -> tuple[NDArray[np.void], FloatArray, FloatArray, tuple[Any, ...]]:
    """A batch as kernels take it: what differs between the airframes, and what they share (the last fields of ``Plant``)."""
    rotors = batch.nominal.airframe.rotors
    table = rotors.table
    spline = table.spline[..., 1:].reshape(*table.spline.shape[:2], -1)
    spline = np.pad(spline, ((0, 0), (0, 0), (0, rot.BLOCK)))  # a block may reach beyond the last node
    one_axis = bool(np.all(rotors.axis == rotors.axis[0]))
    flow = FLOW_BY_HUB if rotors.local_velocity else SHARED_FLOW if one_axis else FLOW_BY_AXIS
    shared = (batch.knots, batch.layout, batch.pushers, spline, table.grid, flow)
    return batch.scalars, batch.wrench, batch.cubics, shared


def plant_of(batch: VehicleBatch, i: int = 0) -> Plant:
    """The arrays of airframe ``i`` of a batch."""
    scalars, wrench, cubics, shared = plants_of(batch)
    return Plant(scalars[i], wrench[i], cubics[i], *shared)


def derivative(vehicle: Vehicle, state: State, command: Command, wind: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> State:
    """Rate of the state.

    Parameters
    ----------
    vehicle
        The vehicle; neither its controller nor its delay matters here.
    state
        Rigid-body state.
    command
        What reaches the airframe now.
    wind
        Velocity of the air over the earth, north, east, down, m/s.

    Returns
    -------
    State
        The time derivative of each component (the quaternion's included).
    """
    plant = plant_of(batch_of(vehicle))
    inputs = Inputs(command.pusher, (command.elevator, command.aileron, command.rudder), wind, (0.0, 0.0, 0.0))
    rate = rate_under(plant, make_work(plant), np.array(state, dtype=float), np.array(command.throttle, dtype=float), inputs)
    return State(*rate)
