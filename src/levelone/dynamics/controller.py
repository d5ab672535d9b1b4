"""Four cascaded loops, sampled: position P, velocity PID, attitude P, body-rate PID; mixer with priorities.

One call is one control period. Signs: a forward velocity error asks for a nose-down attitude (theta = -a / g), an error to the
right for a roll to the right (phi = +a / g). Derivatives act on the measurement through a first-order filter (backward
difference); integrators stop while their loop's limit is active and the error would push further.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelone.compiled import inlined
from levelone.vehicle.vehicle import PID, SENSOR_CHANNELS, Controller

#: columns of the command: what a manoeuvre may ask for, as changes from trim (SI, rad)
COMMANDS = ("x_north", "y_east", "altitude", "V_lon", "V_lat", "V_vert", "yaw_rate", "phi", "theta", "p", "q")
C_NORTH, C_EAST, C_ALTITUDE, C_VLON, C_VLAT, C_VVERT, C_YAW, C_PHI, C_THETA, C_P, C_Q = range(len(COMMANDS))
MODES = ("rate", "attitude", "velocity", "position")
RATE, ATTITUDE, VELOCITY, POSITION = range(len(MODES))
(M_NORTH, M_EAST, M_ALTITUDE, M_VLON, M_VLAT, M_VVERT, M_PHI, M_THETA, M_PSI, M_P, M_Q, M_R) = range(len(SENSOR_CHANNELS))

#: controller memory: six PID loops (integral, filtered measurement), references that integrate, filtered velocity commands,
#: trim attitude
LOOPS = ("lon", "lat", "vert", "roll", "pitch", "yaw")
L_LON, L_LAT, L_VERT, L_P, L_Q, L_R = range(6)
ALT_REF, PSI_REF, LAG_LON, LAG_LAT, PHI_TRIM, THETA_TRIM = 12, 13, 14, 15, 16, 17
N_MEMORY = 18

GAIN_FIELDS = (
    "period", "position", "altitude", "velocity_limit", "climb_limit", "roll", "pitch", "heading", "attitude_limit", "rate_limit",
    "throttle_min", "throttle_max", "mass", "I_xx", "I_yy", "I_zz", "gravity", "command_decay",
    "trim_speed_first", "trim_speed_step",
)  # fmt: skip
GAINS_DTYPE = np.dtype([(name, np.float64) for name in GAIN_FIELDS])


class Law(NamedTuple):
    """The controller as a kernel sees it.

    ``gains`` is a record of ``GAINS_DTYPE``; ``pid`` [LOOPS, 5] holds Kp, Ki, Kd, tau_f and limit; ``allocation`` [rotors, 4]
    throttle for a unit of upward force and of the three moments; ``trim`` [segments, 4, 2 + rotors] cubics in commanded
    forward speed of theta, phi and the throttles of the design
    vehicle.
    """

    gains: NDArray[np.void]
    pid: NDArray[np.float64]
    allocation: NDArray[np.float64]
    trim: NDArray[np.float64]


class Laws(NamedTuple):
    """The controllers of a batch: the arrays of :class:`Law` with one more axis in front, and ``which`` [runs] flies each run."""

    gains: NDArray[np.void]
    pid: NDArray[np.float64]
    allocation: NDArray[np.float64]
    trim: NDArray[np.float64]
    which: NDArray[np.int64]


def gains_of(c: Controller) -> tuple[NDArray[np.void], NDArray[np.float64]]:
    """Gains as one record, and the PID loops [LOOPS, 5]."""
    m = c.design.mass
    record = np.zeros(1, dtype=GAINS_DTYPE)[0]
    decay = math.exp(-c.period / c.command_lag) if c.command_lag > 0 else 0.0
    values = (
        c.period, c.position, c.altitude, c.velocity_limit, c.climb_limit, c.roll, c.pitch, c.heading, c.attitude_limit,
        c.rate_limit, c.throttle_min, c.throttle_max, m.mass, m.I_xx, m.I_yy, m.I_zz, c.design.gravity, decay,
        c.trim_speeds[0], c.trim_speeds[2],
    )  # fmt: skip
    for name, value in zip(GAIN_FIELDS, values, strict=True):
        record[name] = value
    loops: tuple[PID, ...] = (c.horizontal, c.horizontal, c.vertical, c.roll_rate, c.pitch_rate, c.yaw_rate)
    return record, np.array([(g.Kp, g.Ki, g.Kd, g.tau_f, g.limit) for g in loops])


@inlined
def clamp(x, limit):
    """x limited to +-limit."""
    return min(max(x, -limit), limit)


@inlined
def wrap(angle):
    """Angle brought into (-pi, pi]."""
    return angle - 2.0 * math.pi * math.ceil((angle - math.pi) / (2.0 * math.pi))


@inlined
def pid(law, loop, reference, measured, memory):
    """One PID loop; updates its integral and filter."""
    g = law.pid
    period = law.gains.period
    error = reference - measured
    integral = memory[2 * loop]
    filtered = memory[2 * loop + 1]
    slope = (measured - filtered) / (g[loop, 3] + period)
    memory[2 * loop + 1] = filtered + slope * period
    free = g[loop, 0] * error + integral - g[loop, 2] * slope
    out = clamp(free, g[loop, 4])
    if free == out or error * free < 0.0:
        memory[2 * loop] = integral + g[loop, 1] * error * period
    return out


@inlined
def trim_place(law, speed):
    """Segment of the design vehicle's trim table and the distance from its left knot; the ends are held."""
    n = law.trim.shape[0]
    t = min(max((speed - law.gains.trim_speed_first) / law.gains.trim_speed_step, 0.0), 1.0 * n)
    s = min(int(t), n - 1)
    return s, (t - s) * law.gains.trim_speed_step


@inlined
def read_trim(law, s, d, column):
    """Column of the trim table (theta, phi, throttles) at a place of it."""
    trim = law.trim
    return trim[s, 0, column] + d * (trim[s, 1, column] + d * (trim[s, 2, column] + d * trim[s, 3, column]))


@inlined
def velocity_loops(law, mode, command, trim_speed, y, memory):
    """Outer loops: returns phi_ref, theta_ref and the commanded forward speed that schedules the feed-forward."""
    g = law.gains
    if mode < VELOCITY:
        return command[C_PHI] + memory[PHI_TRIM], command[C_THETA] + memory[THETA_TRIM], trim_speed
    ref_lon, ref_lat = trim_speed + command[C_VLON], command[C_VLAT]
    if mode == POSITION:
        north, east = command[C_NORTH] - y[M_NORTH], command[C_EAST] - y[M_EAST]
        c, s = math.cos(y[M_PSI]), math.sin(y[M_PSI])
        ref_lon += clamp(g.position * (c * north + s * east), g.velocity_limit)
        ref_lat += clamp(g.position * (-s * north + c * east), g.velocity_limit)
    memory[LAG_LON] = ref_lon + g.command_decay * (memory[LAG_LON] - ref_lon)
    memory[LAG_LAT] = ref_lat + g.command_decay * (memory[LAG_LAT] - ref_lat)
    ref_lon, ref_lat = memory[LAG_LON], memory[LAG_LAT]
    forward = pid(law, L_LON, ref_lon, y[M_VLON], memory)
    right = pid(law, L_LAT, ref_lat, y[M_VLAT], memory)
    segment, d = trim_place(law, ref_lon)
    phi = clamp(read_trim(law, segment, d, 1) + right / g.gravity, g.attitude_limit)
    theta = clamp(read_trim(law, segment, d, 0) - forward / g.gravity, g.attitude_limit)
    return phi, theta, ref_lon


@inlined
def attitude_loops(law, mode, command, phi_ref, theta_ref, y, memory):
    """Rate references from attitude errors; heading follows the integral of the commanded yaw rate."""
    g = law.gains
    p_ref, q_ref = command[C_P], command[C_Q]
    if mode > RATE:
        p_ref = clamp(g.roll * (phi_ref - y[M_PHI]), g.rate_limit)
        q_ref = clamp(g.pitch * (theta_ref - y[M_THETA]), g.rate_limit)
    memory[PSI_REF] += command[C_YAW] * g.period
    r_ref = command[C_YAW] + clamp(g.heading * wrap(memory[PSI_REF] - y[M_PSI]), g.rate_limit)
    return p_ref, q_ref, r_ref


@inlined
def control(law, mode, command, trim_speed, climb, y, memory, throttle):
    """One control period: measurements ``y`` (SENSOR_CHANNELS) to throttles; updates ``memory``. Returns whether it saturated."""
    g = law.gains
    phi_ref, theta_ref, speed = velocity_loops(law, mode, command, trim_speed, y, memory)
    p_ref, q_ref, r_ref = attitude_loops(law, mode, command, phi_ref, theta_ref, y, memory)
    climb_ref = climb + command[C_VVERT]
    height_error = memory[ALT_REF] + command[C_ALTITUDE] - y[M_ALTITUDE]
    climb_ref = clamp(climb_ref + g.altitude * height_error, g.climb_limit)
    memory[ALT_REF] += (climb + command[C_VVERT]) * g.period
    lift = g.mass * pid(law, L_VERT, climb_ref, y[M_VVERT], memory)
    roll = g.I_xx * pid(law, L_P, p_ref, y[M_P], memory)
    pitch = g.I_yy * pid(law, L_Q, q_ref, y[M_Q], memory)
    yaw = g.I_zz * pid(law, L_R, r_ref, y[M_R], memory)
    return mix(law, speed, lift, roll, pitch, yaw, throttle)


@inlined
def mix(law, speed, lift, roll, pitch, yaw, throttle):
    """Throttles for force and moments on top of the feed-forward; keeps roll and pitch first, then collective, then yaw.

    Collective is a shift along the allocation's first column: equal throttle would pitch a vehicle whose rotors are not centred.
    """
    g, B = law.gains, law.allocation
    n = B.shape[0]
    segment, d = trim_place(law, speed)
    inside = True
    for i in range(n):
        level = read_trim(law, segment, d, 2 + i) + B[i, 0] * lift
        throttle[i] = level + B[i, 1] * roll + B[i, 2] * pitch + B[i, 3] * yaw
        inside = inside and g.throttle_min <= throttle[i] <= g.throttle_max
    if inside:
        return False
    for i in range(n):
        throttle[i] = read_trim(law, segment, d, 2 + i) + B[i, 0] * lift
    scale = tilt_scale(g, B, throttle, roll, pitch)
    # the smallest shift that brings every rotor inside; where none does, the excess is shared by both ends
    up, down = -1e9, 1e9
    for i in range(n):
        throttle[i] += scale * (B[i, 1] * roll + B[i, 2] * pitch)
        if B[i, 0] > 0.0:
            up, down = max(up, (g.throttle_min - throttle[i]) / B[i, 0]), min(down, (g.throttle_max - throttle[i]) / B[i, 0])
    shift = 0.5 * (up + down) if up > down else min(max(0.0, up), down)
    room = 1.0
    for i in range(n):
        throttle[i] += shift * B[i, 0]
        wanted = B[i, 3] * yaw
        if wanted > 0.0:
            room = min(room, max(g.throttle_max - throttle[i], 0.0) / wanted)
        elif wanted < 0.0:
            room = min(room, max(throttle[i] - g.throttle_min, 0.0) / -wanted)
    for i in range(n):
        throttle[i] = min(max(throttle[i] + room * B[i, 3] * yaw, g.throttle_min), g.throttle_max)
    return True


@inlined
def tilt_scale(g, B, level, roll, pitch):
    """Largest part (0 to 1) of a roll and pitch command for which some collective keeps every rotor within its limits.

    A collective must lift the lowest rotor to the minimum and leave the highest below the maximum: for each pair of rotors that
    is one inequality, linear in the part.
    """
    part = 1.0
    for i in range(len(level)):
        for j in range(len(level)):
            if B[i, 0] > 0.0 and B[j, 0] > 0.0:
                slope = (B[j, 1] * roll + B[j, 2] * pitch) / B[j, 0] - (B[i, 1] * roll + B[i, 2] * pitch) / B[i, 0]
                room = (g.throttle_max - level[j]) / B[j, 0] - (g.throttle_min - level[i]) / B[i, 0]
                if slope * part > room:
                    part = max(room / slope, 0.0)
    return part
