"""Velocities induced by straight vortex segments and by vortex rings (compiled).

Geometry frame: x aft, y right, z up. Katz and Plotkin, Low-Speed Aerodynamics, 2nd ed., section 10.4.5, in the form without
differences of nearly equal numbers: u = Gamma/(4 pi) (d1 x d2)(r1 + r2) / (r1 r2 (r1 r2 + d1.d2)), d1 and d2 from the ends to the
point.
"""

from __future__ import annotations

import numpy as np

from levelone.compiled import inlined, kernel

QUARTER_PI = 1.0 / (4.0 * np.pi)
#: below this square of the sine of the angle at the point, it lies on the segment's line, where nothing is induced
ON_SEGMENT = 1e-24


@inlined
def segment(px, py, pz, ax, ay, az, bx, by, bz):
    """Velocity (3) of a segment of unit circulation from a to b at the point p, m/s per m^2/s."""
    d1x, d1y, d1z = px - ax, py - ay, pz - az
    d2x, d2y, d2z = px - bx, py - by, pz - bz
    r1 = np.sqrt(d1x * d1x + d1y * d1y + d1z * d1z)
    r2 = np.sqrt(d2x * d2x + d2y * d2y + d2z * d2z)
    product, dot = r1 * r2, d1x * d2x + d1y * d2y + d1z * d2z
    cx, cy, cz = d1y * d2z - d1z * d2y, d1z * d2x - d1x * d2z, d1x * d2y - d1y * d2x
    across = cx * cx + cy * cy + cz * cz
    if across <= ON_SEGMENT * product * product:
        return 0.0, 0.0, 0.0
    # product + dot; between the ends the sum would cancel
    sum_ = across / (product - dot) if dot < 0.0 else product + dot
    factor = QUARTER_PI * (r1 + r2) / (product * sum_)
    return factor * cx, factor * cy, factor * cz


@inlined
def ring(px, py, pz, c):
    """Velocity (3) of a ring of unit circulation through the corners c [4, 3]."""
    ux, uy, uz = 0.0, 0.0, 0.0
    for i in range(4):
        j = (i + 1) % 4
        vx, vy, vz = segment(px, py, pz, c[i, 0], c[i, 1], c[i, 2], c[j, 0], c[j, 1], c[j, 2])
        ux += vx
        uy += vy
        uz += vz
    return ux, uy, uz


@kernel
def influence(points, normals, rings):
    """Normal velocity at points [p, 3] with normals [p, 3] by each ring [n, 4, 3] of unit circulation: [p, n]."""
    out = np.empty((points.shape[0], rings.shape[0]))
    for i in range(points.shape[0]):
        for j in range(rings.shape[0]):
            ux, uy, uz = ring(points[i, 0], points[i, 1], points[i, 2], rings[j])
            out[i, j] = ux * normals[i, 0] + uy * normals[i, 1] + uz * normals[i, 2]
    return out


@kernel
def influence_vectors(points, rings):
    """Velocity at points [p, 3] by each ring [n, 4, 3] of unit circulation: [3, p, n]."""
    out = np.empty((3, points.shape[0], rings.shape[0]))
    for i in range(points.shape[0]):
        for j in range(rings.shape[0]):
            out[0, i, j], out[1, i, j], out[2, i, j] = ring(points[i, 0], points[i, 1], points[i, 2], rings[j])
    return out


@kernel
def velocities(points, rings, gamma):
    """Velocity [p, 3], m/s, at points [p, 3] by rings [n, 4, 3] of circulation gamma [n], m^2/s."""
    out = np.zeros((points.shape[0], 3))
    for i in range(points.shape[0]):
        for j in range(rings.shape[0]):
            ux, uy, uz = ring(points[i, 0], points[i, 1], points[i, 2], rings[j])
            out[i, 0] += gamma[j] * ux
            out[i, 1] += gamma[j] * uy
            out[i, 2] += gamma[j] * uz
    return out
