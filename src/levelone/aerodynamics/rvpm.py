"""How positions, strengths and cores of vortex particles change: reformulated and classic vortex particle method.

Alvarez and Ning, AIAA Journal 62, 2024, with f = 0 and g = 1/5 (``reformulated``) or f = g = 0 (``classic``) and without the
subfilter term (C = 0: no model of the turbulence that the particles do not resolve, and no viscosity):

    dx/dt = u,    Z = (f + g) / (1 + 3 f) (S . G) / |G|^2,    dG/dt = S - 3 Z G,    ds/dt = -s Z,    S = (G . grad) u.

The reformulated method keeps |G| s^2 of each particle, the angular momentum of its core; the classic one keeps s, and with it the
circulation of a line of particles while the line is stretched. Stretching is taken as (G . grad) u, not in the transposed form
(grad u) . G: the transposed form keeps the total strength to the last bit, but turns strengths away from the vorticity and loses
angular impulse ten times faster (measured; see the theory page on vortex particles).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from levelone.aerodynamics.particle_kernels import FloatArray, direct_sums, gathered
from levelone.aerodynamics.treecode import tree_sums

#: (f + g) / (1 + 3 f)
FORMULATIONS = {"reformulated": 0.2, "classic": 0.0}

Background = Callable[[FloatArray, FloatArray, float], tuple[FloatArray, FloatArray]]
"""(points [n, 3], vectors h [n, 3], time) to the velocity u [n, 3] of everything but the particles and to (h . grad) u [n, 3]."""
Sums = Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""(points [p, 3], vectors h [p, 3], sources [7, n]) to the velocity u [p, 3] and (h . grad) u [p, 3] of the sources."""


def uniform(velocity: tuple[float, float, float]) -> Background:
    """A background that is the same everywhere and at all times, m/s."""
    stream = np.asarray(velocity, dtype=float)
    return lambda points, vectors, time: (np.broadcast_to(stream, points.shape), np.zeros_like(points))


def differenced(velocity: Callable[[FloatArray, float], FloatArray], distance: float) -> Background:
    """A background known by its velocity (points [n, 3], time) only; (h . grad) u by a central difference over +-``distance`` m."""

    def background(points: FloatArray, vectors: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
        n, length = len(points), np.linalg.norm(vectors, axis=1, keepdims=True)
        shift = vectors * (distance / np.where(length > 0.0, length, 1.0))
        u = velocity(np.concatenate([points, points + shift, points - shift]), time)
        return u[:n], (u[n : 2 * n] - u[2 * n :]) * (length / (2.0 * distance))

    return background


def sums(kernel: str, threads: int | None, tree_from: int) -> Sums:
    """The sum over particles: pair by pair, or by the tree for at least ``tree_from`` sources (images are sources, too).

    NaN everywhere if a point or a source is not finite.
    """

    def both(points: FloatArray, vectors: FloatArray, sources: FloatArray) -> tuple[FloatArray, FloatArray]:
        if not (np.isfinite(points).all() and np.isfinite(sources).all()):
            return np.full(points.shape, np.nan), np.full(points.shape, np.nan)
        chosen = tree_sums if sources.shape[1] >= tree_from and len(points) > 0 else direct_sums
        return chosen(points, vectors, sources, kernel, threads)

    return both


def rates(stretching: FloatArray, strength: FloatArray, core: FloatArray, formulation: str) -> tuple[FloatArray, FloatArray]:
    """dG/dt [n, 3] and ds/dt [n] from the stretching S [n, 3], the strengths G [n, 3] and the cores s [n]."""
    square = np.einsum("ij,ij->i", strength, strength)
    # a particle without strength is not stretched: S is linear in G
    z = FORMULATIONS[formulation] * np.einsum("ij,ij->i", stretching, strength) / np.where(square > 0.0, square, 1.0)
    return stretching - 3.0 * z[:, None] * strength, -core * z


def vorticity(points: FloatArray, sources: FloatArray, both: Sums) -> FloatArray:
    """Curl of the velocity of the sources [7, n] at points [p, 3], 1/s: three sums, one for each direction of the gradient."""
    dx, dy, dz = (both(points, np.tile(unit, (len(points), 1)), sources)[1] for unit in np.eye(3))
    return np.stack([dy[:, 2] - dz[:, 1], dz[:, 0] - dx[:, 2], dx[:, 1] - dy[:, 0]], axis=1)


def relaxed(position: FloatArray, strength: FloatArray, core: FloatArray, share: float, mirrored: bool, both: Sums) -> FloatArray:
    """Strengths [n, 3] turned by a share (0 to 1) of the way to the direction of the vorticity, each of unchanged magnitude.

    Pedrizzetti, Fluid Dynamics Research 10, 1992, with the result brought back to the magnitude before.
    """
    size = np.linalg.norm(strength, axis=1, keepdims=True)
    omega = vorticity(position, gathered(position, strength, core, mirrored), both)
    spin = np.linalg.norm(omega, axis=1, keepdims=True)
    turned = (1.0 - share) * strength + share * size * omega / np.where(spin > 0.0, spin, 1.0)
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.where((length > 0.0) & (spin > 0.0), turned * (size / np.where(length > 0.0, length, 1.0)), strength)
