"""Fixed-step Runge-Kutta 4 under held commands, with an exact pure delay, and the closed loop's trajectory.

The controller holds its output for its period T_c. A delay tau_d = (m + f) T_c, 0 <= f < 1, means that within period k the
rotors first follow command k - m - 1 for f T_c, then command k - m. Each part is integrated by itself, so no step ever straddles
a jump and the order of the method is kept for every delay.
"""

from __future__ import annotations

import math

import numpy as np

from levelone.compiled import inlined, innermost, kernel
from levelone.dynamics import rotors as rot
from levelone.dynamics.aerodynamics import drag_coefficient, reciprocal, sine_angle
from levelone.dynamics.controller import C_VLON, control
from levelone.dynamics.frames import euler_angles, heading_frame, to_body, to_earth
from levelone.dynamics.model import N_STATE, Inputs, along, as_state, make_work, state_rate
from levelone.dynamics.pilot import pilot_speed
from levelone.status import Status
from levelone.vehicle.vehicle import SENSOR_CHANNELS

#: past commands kept, and the longest delay of the rotors in control periods
RING = 256
BUFFER = RING - 2
#: what a trajectory can record, besides the throttles that follow these
CHANNELS = (*SENSOR_CHANNELS, "u", "v", "w", "airspeed", "alpha", "beta")
EXTREMES = ("alpha_min", "alpha_max", "beta_min", "beta_max", "C_D_min", "airspeed_max", "saturated")
N_SENSORS, N_CHANNELS = len(SENSOR_CHANNELS), len(CHANNELS)
OK, DIVERGED, TABLE_EXCEEDED = int(Status.OK), int(Status.DIVERGED), int(Status.TABLE_EXCEEDED)
#: beyond these the run is called diverged: attitude from the horizon (rad), body rate (rad/s)
ATTITUDE_MAX, RATE_MAX = 1.5, 60.0


@inlined
def rk4_step(plant, work, throttles, lagged, x, inputs, since, h):
    """One step of length ``h`` of the state tuple ``x`` under the throttles [first, middle, end of the step].

    The four stages are one loop, so that the airframe's equations are compiled into it once.
    """
    stage = result = x
    for s in range(4):
        if s == 0 or (lagged and s != 2):
            rot.set_throttles(throttles[(s + 1) // 2], plant, work)
        k = state_rate(plant, work, stage, inputs, since + (0.0 if s == 0 else h if s == 3 else 0.5 * h))
        result = along(result, k, h / (6.0 if s == 0 or s == 3 else 3.0))
        stage = along(x, k, h if s == 2 else 0.5 * h)
    return result


@inlined
def hold(plant, work, state, throttles, command, inputs, since, length, dt):
    """Advance the state tuple and the rotors' throttles (``throttles[0]``) over ``length`` seconds under one command."""
    steps = max(1, math.ceil(length / dt - 1e-9))
    h = length / steps
    lag = plant.scalars.motor_lag
    half = math.exp(-0.5 * h / lag) if lag > 0.0 else 0.0
    for s in range(steps):
        for i in range(len(command)):
            gap = throttles[0, i] - command[i] if lag > 0.0 else 0.0
            throttles[0, i] = command[i] + gap
            throttles[1, i] = command[i] + gap * half
            throttles[2, i] = command[i] + gap * half * half
        state = rk4_step(plant, work, throttles, lag > 0.0, state, inputs, since + s * h, h)
        for i in range(len(command)):
            throttles[0, i] = throttles[2, i]
    return state


@inlined
def period_map(plant, work, x, throttles, old, new, fraction, inputs, period, dt):
    """One control period of the state array ``x``: ``fraction`` of it under the command ``old``, the rest under ``new``."""
    state = as_state(x)
    first = fraction * period if fraction > 1e-9 else 0.0
    for part in range(2):
        if part == 0 and first == 0.0:
            continue
        command, since, length = (old, 0.0, first) if part == 0 else (new, first, period - first)
        state = hold(plant, work, state, throttles, command, inputs, since, length, dt)
    norm = 1.0 / math.sqrt(state[6] * state[6] + state[7] * state[7] + state[8] * state[8] + state[9] * state[9])
    for j in range(N_STATE):
        x[j] = state[j] * (norm if 6 <= j < 10 else 1.0)


@inlined
def measure(x, y):
    """The sensor channels (``SENSOR_CHANNELS``) of a state."""
    phi, theta, psi = euler_angles(x[6], x[7], x[8], x[9])
    vn, ve, vd = to_earth(x[6], x[7], x[8], x[9], x[3], x[4], x[5])
    lon, lat = heading_frame(vn, ve, psi)
    y[0], y[1], y[2] = x[0], x[1], -x[2]
    y[3], y[4], y[5] = lon, lat, -vd
    y[6], y[7], y[8] = phi, theta, psi
    y[9], y[10], y[11] = x[10], x[11], x[12]


@inlined
def observe(plant, x, y, wind, throttle, now, extremes):
    """All channels of a tick into ``now``, and the extremes so far; returns a status code."""
    wu, wv, ww = to_body(x[6], x[7], x[8], x[9], wind[0], wind[1], wind[2])
    ua, va, wa = x[3] - wu, x[4] - wv, x[5] - ww
    speed = math.sqrt(ua * ua + va * va + wa * wa)
    alpha = math.atan2(wa, ua) if speed > 1e-9 else 0.0
    per_speed = reciprocal(speed)
    beta = sine_angle(va, per_speed)
    for c in range(N_SENSORS):
        now[c] = y[c]
    now[N_SENSORS], now[N_SENSORS + 1], now[N_SENSORS + 2] = x[3], x[4], x[5]
    now[N_SENSORS + 3], now[N_SENSORS + 4], now[N_SENSORS + 5] = speed, alpha, beta
    for i in range(len(throttle)):
        now[N_CHANNELS + i] = throttle[i]
    if speed > plant.scalars.airspeed_min:
        q_hat = 0.5 * x[11] * plant.scalars.chord * per_speed
        drag = drag_coefficient(plant.knots, plant.cubics, speed, sine_angle(wa, per_speed), q_hat)
        extremes[0], extremes[1] = min(extremes[0], alpha), max(extremes[1], alpha)
        extremes[2], extremes[3] = min(extremes[2], beta), max(extremes[3], beta)
        extremes[4] = min(extremes[4], drag)
    extremes[5] = max(extremes[5], speed)
    rates = abs(x[10]) + abs(x[11]) + abs(x[12])
    if not (math.isfinite(speed) and rates < RATE_MAX and abs(y[6]) < ATTITUDE_MAX and abs(y[7]) < ATTITUDE_MAX):
        return DIVERGED
    reach = (plant.spline.shape[0] - 3) / plant.grid[1, 1]
    if speed * plant.scalars.T_u > reach or (len(plant.knots) > 1 and speed > plant.knots[len(plant.knots) - 1]):
        return TABLE_EXCEEDED
    return OK


@inlined
def sense(y, lag_gain, lag_memory, delays, past, k, out):
    """Sensor unit: first-order lags exact for signals linear between ticks, then delays of whole periods."""
    depth = past.shape[0]
    slot = k % depth
    for c in range(len(y)):
        a, b0, b1 = lag_gain[c, 0], lag_gain[c, 1], lag_gain[c, 2]
        lagged = lag_memory[c] + b1 * y[c]
        lag_memory[c] = a * lagged + b0 * y[c]
        past[slot, c] = lagged
        late = slot - delays[c]
        out[c] = past[late + depth if late < 0 else late, c]


@innermost
def ticks(
    plant, law, sensors, mode, commands, wind, pilot, trim_speed, climb, dt, rows, record, asked, extremes, x, memory, work, loop
):  # fmt: skip
    """The ticks of one trajectory, allocating nothing; returns a status code and the tick at which it was given."""
    lag_gain, delays, lag_memory, past = sensors
    throttle, throttles, ring, y, seen, now, command, sight = loop
    piloted = len(asked) > 0
    n_ticks, n, period = commands.shape[0], len(throttle), law.gains.period
    late = plant.scalars.tau_d / period
    m = int(late)
    for k in range(n_ticks):
        i, j = min(k, wind.shape[0] - 1), min(k + 1, wind.shape[0] - 1)
        here = (wind[i, 0], wind[i, 1], wind[i, 2])
        slope = ((wind[j, 0] - here[0]) / period, (wind[j, 1] - here[1]) / period, (wind[j, 2] - here[2]) / period)
        measure(x, y)
        status = observe(plant, x, y, here, throttles[0], now, extremes)
        if status != OK:
            return status, k
        for row in range(len(rows)):
            record[row, k] = now[rows[row]]
        sense(y, lag_gain, lag_memory, delays, past, k, seen)
        for c in range(len(command)):
            command[c] = commands[k, c]
        if piloted:
            asked[k] = pilot_speed(pilot, sight, k, y[0], y[3], trim_speed)
            command[C_VLON] += asked[k] - trim_speed
        extremes[6] += control(law, mode, command, trim_speed, climb, seen, memory, throttle)
        for r in range(n):
            ring[k % RING, r] = throttle[r]
        inputs = Inputs(0.0, (0.0, 0.0, 0.0), here, slope)
        old, new = ring[(k - m - 1 + RING) % RING], ring[(k - m + RING) % RING]
        period_map(plant, work, x, throttles, old, new, late - m, inputs, period, dt)
    return OK, n_ticks


@kernel
def fly(plant, law, sensors, mode, commands, wind, pilot, start, trim_speed, climb, dt, rows, record, asked, extremes):
    """One closed-loop trajectory from a trimmed start; returns a status code. Ticks after a failure hold NaN.

    ``commands`` [ticks, COMMANDS]; ``wind`` [ticks or 1, 3] m/s north, east, down, linear between ticks; ``start`` holds state,
    memory, throttles; ``rows`` says which channel each row of ``record`` [rows, ticks] takes; ``asked`` [ticks] takes what the
    pilot commands and is empty where none flies.
    """
    x, memory, throttle = start[0].copy(), start[1].copy(), start[2].copy()
    lag_gain, delays = sensors
    n = len(throttle)
    throttles, ring = np.empty((3, n)), np.empty((RING, n))
    throttles[:] = throttle
    ring[:] = throttle
    y, seen, now = np.empty(N_SENSORS), np.empty(N_SENSORS), np.empty(N_CHANNELS + n)
    measure(x, y)
    past = np.empty((delays.max() + 1, N_SENSORS))
    past[:] = y
    unit = (lag_gain, delays, (1.0 - lag_gain[:, 2]) * y, past)
    sight = np.zeros((int(pilot.delay) + 1 if len(asked) > 0 else 0, 2))
    loop = (throttle, throttles, ring, y, seen, now, np.empty(commands.shape[1]), sight)
    extremes[:] = np.array([np.inf, -np.inf, np.inf, -np.inf, np.inf, -np.inf, 0.0])
    status, reached = ticks(
        plant, law, unit, mode, commands, wind, pilot, trim_speed, climb, dt, rows, record, asked, extremes, x, memory,
        make_work(plant), loop,
    )  # fmt: skip
    record[:, reached:] = np.nan
    if len(asked) > 0:
        asked[reached:] = np.nan
    return status
