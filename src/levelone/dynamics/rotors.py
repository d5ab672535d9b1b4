"""Thrust and torque of the rotors out of their spline table."""

from __future__ import annotations

import numpy as np

from levelone.compiled import inlined, kernel
from levelone.dynamics.arcsine import arcsine

#: values taken together: four throttle nodes of thrust and torque, the reach of one rotor's spline
BLOCK = 8


@inlined
def cell(x, first, per_step, n):
    """Index of the spline cell that holds ``x`` and the place in it (0 to 1); clamped to the table."""
    t = (x - first) * per_step
    # the outer max tells the compiler that no index counts from the end, which saves it a test at every access
    i = max(int(min(max(t, 0.0), n - 4.0)), 0)
    return i, min(max(t - i, 0.0), 1.0)


@inlined
def weights(t):
    """The four uniform cubic B-spline weights at place ``t`` of a cell (de Boor, ch. X)."""
    s = 1.0 - t
    return (
        s * s * s * (1.0 / 6.0),
        (4.0 + t * t * (3.0 * t - 6.0)) * (1.0 / 6.0),
        (4.0 + s * s * (3.0 * s - 6.0)) * (1.0 / 6.0),
        t * t * t * (1.0 / 6.0),
    )


@inlined
def table_throttle(throttle, exponent):
    """Throttle at which the table is entered."""
    return throttle if exponent == 1.0 else max(throttle, 0.0) ** exponent


@inlined
def set_throttles(throttle, plant, work):
    """Prepare the force and moment of the rotors as sums over the table's throttle nodes; needed only when a throttle changes.

    A rotor's thrust is a weighted sum of spline nodes in throttle, and the wrench is a weighted sum of thrusts and torques: both
    sums are merged into ``work.mix`` [groups, 6, 2 * nodes], of which [low, high) is in use. Rotors that see the same flow form
    one group, so that the table is interpolated in airspeed and angle once for all of them.
    """
    low, high, mix = work.low, work.high, work.mix
    n_groups, n_nodes = mix.shape[0], plant.spline.shape[2] // 2 - BLOCK // 2
    for g in range(n_groups):
        for block in range((high[g] - low[g] + BLOCK - 1) // BLOCK):
            first = max(low[g] + BLOCK * block, 0)
            for j in range(6):
                for k in range(BLOCK):
                    mix[g, j, first + k] = 0.0
        low[g], high[g] = 2 * n_nodes, 0
    scale = plant.scalars.thrust_scale
    for r in range(len(throttle)):
        g = min(r, n_groups - 1)
        i, t = cell(table_throttle(throttle[r], plant.scalars.throttle_exponent), plant.grid[0, 0], plant.grid[0, 1], n_nodes)
        low[g], high[g] = min(low[g], 2 * i), max(high[g], 2 * i + BLOCK)
        w = weights(t)
        for j in range(6):
            thrust, torque = plant.wrench[j, r] * scale, plant.wrench[6 + j, r]
            if thrust != 0.0:
                spread(mix, g, j, 2 * i, w, thrust)
            if torque != 0.0:
                spread(mix, g, j, 2 * i + 1, w, torque)


@inlined
def spread(mix, g, j, at, w, value):
    """Add ``value`` times the four weights to every other element from ``at`` on."""
    mix[g, j, at] += w[0] * value
    mix[g, j, at + 2] += w[1] * value
    mix[g, j, at + 4] += w[2] * value
    mix[g, j, at + 6] += w[3] * value


@inlined
def disc_angle(axial, per_speed):
    """Angle of the flow to a disc, +90 deg in a climb along its axis, from the axial velocity and the reciprocal of the speed."""
    return arcsine(min(max(axial * per_speed, -1.0), 1.0))


@inlined
def group_wrench(spline, grid, mix, g, low, high, speed, angle):
    """Body force and moment of one group of rotors in one flow."""
    i, ti = cell(speed, grid[1, 0], grid[1, 1], spline.shape[0])
    j, tj = cell(angle, grid[2, 0], grid[2, 1], spline.shape[1])
    a0, a1, a2, a3 = weights(ti)
    b0, b1, b2, b3 = weights(tj)
    fx = fy = fz = mx = my = mz = 0.0
    # indexed without views of the array: a view costs a reference count, here more than the arithmetic
    # blocks of fixed length: the compiler turns each into a few vector operations
    for block in range((high - low + BLOCK - 1) // BLOCK):
        first = max(low + BLOCK * block, 0)
        for k in range(BLOCK):
            m = first + k
            node = (
                a0 * (b0 * spline[i, j, m] + b1 * spline[i, j + 1, m] + b2 * spline[i, j + 2, m] + b3 * spline[i, j + 3, m])
                + a1
                * (
                    b0 * spline[i + 1, j, m]
                    + b1 * spline[i + 1, j + 1, m]
                    + b2 * spline[i + 1, j + 2, m]
                    + b3 * spline[i + 1, j + 3, m]
                )
                + a2
                * (
                    b0 * spline[i + 2, j, m]
                    + b1 * spline[i + 2, j + 1, m]
                    + b2 * spline[i + 2, j + 2, m]
                    + b3 * spline[i + 2, j + 3, m]
                )
                + a3
                * (
                    b0 * spline[i + 3, j, m]
                    + b1 * spline[i + 3, j + 1, m]
                    + b2 * spline[i + 3, j + 2, m]
                    + b3 * spline[i + 3, j + 3, m]
                )
            )
            fx += mix[g, 0, m] * node
            fy += mix[g, 1, m] * node
            fz += mix[g, 2, m] * node
            mx += mix[g, 3, m] * node
            my += mix[g, 4, m] * node
            mz += mix[g, 5, m] * node
    return fx, fy, fz, mx, my, mz


@kernel
def read_table(spline, grid, throttle, speed, angle):
    """All columns of a spline table [.., .., nodes, columns] at one throttle, airspeed (m/s) and angle (rad)."""
    i, ti = cell(speed, grid[1, 0], grid[1, 1], spline.shape[0])
    j, tj = cell(angle, grid[2, 0], grid[2, 1], spline.shape[1])
    k, tk = cell(throttle, grid[0, 0], grid[0, 1], spline.shape[2])
    wi, wj, wk = weights(ti), weights(tj), weights(tk)
    out = np.zeros(spline.shape[3])
    for a in range(4):
        for b in range(4):
            for c in range(4):
                for n in range(len(out)):
                    out[n] += wi[a] * wj[b] * wk[c] * spline[i + a, j + b, k + c, n]
    return out
