"""Velocity induced by a grid of straight vortex segments, such as the panels of a wake (compiled).

A segment is the one of :mod:`levelone.aerodynamics.kernels` with a core s at each end as a fourth coordinate: distances are
R^2 = r^2 + s^2, and u = Gamma/(4 pi) (d1 x d2)(R1 + R2) / (R1 R2 (R1 R2 + d1.d2 + s1 s2)). With equal cores this is the exact
integral of the Biot-Savart law smoothed as r/(r^2 + s^2)^(3/2); cores that change along a wake leave every vortex ring closed.

The distances to all nodes are found first, since four segments share each node; both loops over segments then run over neighbours
in memory and become vector code.
"""

from __future__ import annotations

import numpy as np

from levelone.aerodynamics.kernels import ON_SEGMENT, QUARTER_PI
from levelone.compiled import innermost, kernel


@innermost
def _segments(near, apart, circulation, first, last, ux, uy, uz):
    """Adds the velocity by segments from node i to node i + apart, of given circulation times 1/(4 pi)."""
    dx, dy, dz, core, r = near[0], near[1], near[2], near[3], near[4]
    for i in range(first, last):
        j = i + apart
        product = r[i] * r[j]
        sum_ = product + dx[i] * dx[j] + dy[i] * dy[j] + dz[i] * dz[j] + core[i] * core[j]
        on = sum_ <= ON_SEGMENT * product
        factor = 0.0 if on else circulation[i] * (r[i] + r[j]) / (product * sum_)
        ux += factor * (dy[i] * dz[j] - dz[i] * dy[j])
        uy += factor * (dz[i] * dx[j] - dx[i] * dz[j])
        uz += factor * (dx[i] * dy[j] - dy[i] * dx[j])
    return ux, uy, uz


@innermost
def _at(px, py, pz, nodes, columns, across, along, near):
    """Velocity (3) of a grid at one point; ``near`` [5, n] is overwritten."""
    x, y, z, core = nodes[0], nodes[1], nodes[2], nodes[3]
    dx, dy, dz, s, r = near[0], near[1], near[2], near[3], near[4]
    n = x.size
    for i in range(n):
        dx[i], dy[i], dz[i], s[i] = px - x[i], py - y[i], pz - z[i], core[i]
        r[i] = np.sqrt(dx[i] * dx[i] + dy[i] * dy[i] + dz[i] * dz[i] + s[i] * s[i])
    ux, uy, uz = _segments(near, 1, across, 0, n - 1, 0.0, 0.0, 0.0)
    return _segments(near, columns, along, 0, n - columns, ux, uy, uz)


@kernel
def grid_velocities(points, nodes, columns, across, along, mirrored, out):
    """Writes the velocity [p, 3] at points [p, 3] by a grid of vortex segments.

    ``nodes`` [4, n]: x, y, z and core, row by row of ``columns`` nodes; ``across`` [n] circulation from each node to the next one,
    ``along`` [n] to the one in the next row; the entries that lead out of the grid are zero. ``mirrored``: the image of the grid in
    y = 0 acts as well.
    """
    near = np.empty((5, nodes.shape[1]))
    across, along = across * QUARTER_PI, along * QUARTER_PI
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        ux, uy, uz = _at(px, py, pz, nodes, columns, across, along, near)
        out[i, 0], out[i, 1], out[i, 2] = ux, uy, uz
        if mirrored:
            ux, uy, uz = _at(px, -py, pz, nodes, columns, across, along, near)
            out[i, 0] += ux
            out[i, 1] -= uy
            out[i, 2] += uz
