"""Newton's method on the six accelerations of steady flight, damped where a full step does not lower the residual.

Unknowns are pitch and roll attitude and the four mixer commands (upward force, roll, pitch and yaw moment). Source of the damping:
Levenberg and Marquardt, see Nocedal and Wright, Numerical Optimization, 2nd ed., section 10.3.
"""

from __future__ import annotations

import math

import numpy as np

from levelone.compiled import innermost, kernel
from levelone.dynamics.frames import quaternion, to_body
from levelone.dynamics.model import N_STATE, Inputs, rate_under

N_UNKNOWN = 6
#: residual at which the search stops, and the largest that counts as a trim
TOLERANCE, SETTLED = 1e-11, 1e-10


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
