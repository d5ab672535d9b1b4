"""Velocity induced by the wake of an oscillating strip, to infinity and without truncation (compiled).

The wake lies behind the trailing edge along the free stream (+x). Its circulation, for unit circulation Gamma of the strip, is
mu(x) = exp(-i kappa (x - x_s)), kappa = omega/V: what was shed travels with the stream. With H(x) the velocity of a horseshoe
vortex whose bound segment lies at x and whose legs run to infinity, a wake whose circulation changes in steps dmu at places x_j
induces sum H(x_j) dmu_j, and a continuous one the integral of H(x) dmu.

The first rows behind the edge are lumped at the distance h of a panel, as in the time domain: with h = 1 they continue the row
of bound vortices and the lattice is of second order (see wake_start). The rest is continuous and integrated by Gauss-Legendre
quadrature on intervals that grow with the distance from the point; the last interval, to infinity, along the line x = L - i
s/kappa of the complex plane, where the integrand decays like exp(-s). A point in the plane of the wake sees a principal value:
intervals there lie symmetrically, so that the odd part cancels.
"""

from __future__ import annotations

import numpy as np

from levelone.aerodynamics.kernels import QUARTER_PI
from levelone.compiled import inlined, kernel

_X, _W = np.polynomial.legendre.leggauss(10)
_S, _E = np.polynomial.laguerre.laggauss(16)
#: heights below this share of a strip's width count as in the plane of its wake
IN_PLANE = 1e-9


@inlined
def _leg(dx, dy, dz):
    """Half-infinite vortex along +x from the origin, at (dx, dy, dz), times 4 pi; dx may be complex."""
    rho2 = dy * dy + dz * dz
    r = np.sqrt(dx * dx + rho2)
    factor = (r + dx) / (r * rho2) if dx.real > 0.0 else 1.0 / (r * (r - dx))
    return -dz * factor, dy * factor


@inlined
def _horseshoe(x, px, py, pz, line):
    """Velocity (3) at p of a horseshoe of unit circulation; ``line`` [2, 3] its bound segment, moved aft by x (complex)."""
    ax, ay, az = px - line[0, 0] - x, py - line[0, 1], pz - line[0, 2]
    bx, by, bz = px - line[1, 0] - x, py - line[1, 1], pz - line[1, 2]
    ra = np.sqrt(ax * ax + ay * ay + az * az)
    rb = np.sqrt(bx * bx + by * by + bz * bz)
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    product, dot = ra * rb, ax * bx + ay * by + az * bz
    # product + dot; between the ends the sum would cancel
    sum_ = (cx * cx + cy * cy + cz * cz) / (product - dot) if dot.real < 0.0 else product + dot
    factor = (ra + rb) / (product * sum_)
    ly, lz = _leg(ax, ay, az)
    ry, rz = _leg(bx, by, bz)
    return (
        QUARTER_PI * (factor * cx),
        QUARTER_PI * (factor * cy + ry - ly),
        QUARTER_PI * (factor * cz + rz - lz),
    )


@inlined
def _distance(py, pz, line):
    """Distance of a point from the strip of the wake as seen along x, and from the nearer of its edges."""
    ey, ez = line[1, 1] - line[0, 1], line[1, 2] - line[0, 2]
    ay, az = py - line[0, 1], pz - line[0, 2]
    by, bz = py - line[1, 1], pz - line[1, 2]
    width2 = ey * ey + ez * ez
    share = min(max((ay * ey + az * ez) / width2, 0.0), 1.0)
    off = np.sqrt((ay - share * ey) ** 2 + (az - share * ez) ** 2)
    edge = np.sqrt(min(ay * ay + az * az, by * by + bz * bz))
    return (off if off > IN_PLANE * np.sqrt(width2) else 0.0), edge


@inlined
def _interval(low, high, kappa, origin, px, py, pz, line, total):
    """Adds the integral of exp(-i kappa (x - origin)) H(x) from low to high to ``total`` [3]; x is counted from ``line``."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    for i in range(_X.size):
        x = middle + half * _X[i]
        weight = half * _W[i] * np.exp(-1j * kappa * (x - origin))
        ux, uy, uz = _horseshoe(x, px, py, pz, line)
        total[0] += weight * ux
        total[1] += weight * uy
        total[2] += weight * uz


@kernel
def _sheet(origin, kappa, px, py, pz, line, total):
    """Adds the integral of exp(-i kappa (x - origin)) H(x) from ``origin`` to infinity to ``total`` [3]."""
    here = px - 0.5 * (line[0, 0] + line[1, 0])
    scale, edge = _distance(py, pz, line)
    core = scale if scale > 0.0 else 0.5 * edge
    longest = 1.0 / kappa
    x = origin
    distance = here - origin
    while distance > core:  # towards the point
        nearer = max(distance - min(0.5 * distance, longest), core)
        _interval(here - distance, here - nearer, kappa, origin, px, py, pz, line, total)
        distance = nearer
    if distance > 0.0:  # past the point, symmetrically
        _interval(here - distance, here + distance, kappa, origin, px, py, pz, line, total)
        x = here + distance
    while x - here < longest:  # away from it
        step = min(max(x - here, scale), longest)
        _interval(x, x + step, kappa, origin, px, py, pz, line, total)
        x += step
    phase = -1j / kappa * np.exp(-1j * kappa * (x - origin))
    for i in range(_S.size):
        ux, uy, uz = _horseshoe(x - 1j * _S[i] / kappa, px, py, pz, line)
        total[0] += phase * _E[i] * ux
        total[1] += phase * _E[i] * uy
        total[2] += phase * _E[i] * uz


@kernel
def harmonic_wake(points, lines, step, rows, kappa):
    """Velocity [3, p, m], complex, at points [p, 3] by the wakes of strips of unit circulation.

    ``lines`` [m, 2, 3] shed lines, m; ``step`` [m] distance of the lumped rows, m, the first of which is the shed line;
    ``rows`` their number (0: all continuous, from the shed line on); ``kappa`` = omega/V, 1/m (0: steady horseshoes).
    """
    out = np.zeros((3, points.shape[0], lines.shape[0]), dtype=np.complex128)
    total = np.empty(3, dtype=np.complex128)
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        for j in range(lines.shape[0]):
            line = lines[j]
            ux, uy, uz = _horseshoe(0.0, px, py, pz, line)
            out[0, i, j], out[1, i, j], out[2, i, j] = ux, uy, uz
            if kappa == 0.0:
                continue
            turn = np.exp(-1j * kappa * step[j])
            mu = 1.0 + 0j
            for row in range(rows[j]):
                ux, uy, uz = _horseshoe(row * step[j], px, py, pz, line)
                jump = mu * (turn - 1.0)
                out[0, i, j] += jump * ux
                out[1, i, j] += jump * uy
                out[2, i, j] += jump * uz
                mu *= turn
            total[:] = 0.0
            _sheet((rows[j] - 0.5) * step[j] if rows[j] > 0 else 0.0, kappa, px, py, pz, line, total)
            for axis in range(3):
                out[axis, i, j] += -1j * kappa * mu * total[axis]
    return out
