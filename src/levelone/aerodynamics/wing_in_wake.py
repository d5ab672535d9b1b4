"""Loads of a lattice in a steady wind that changes from place to place, such as the mean wind of slipstreams.

Geometry frame (x aft, y right, z up), unit free stream along +x. The wind at the collocation points turns the flow there; the wind
at the bound segments carries their loads, its changes of speed included. The wake of the lattice stays flat and along the stream,
as in :mod:`levelone.aerodynamics.frequency`, whose steady flow is the limit without other wind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from levelone.aerodynamics.coefficients import Coefficients, coefficients
from levelone.aerodynamics.frequency import Plant, circulations, wakes_at
from levelone.aerodynamics.harmonic_wake import harmonic_wake
from levelone.aerodynamics.kernels import influence_vectors
from levelone.aerodynamics.lattice import FloatArray, rings
from levelone.aerodynamics.loads import bound_forces, net, side_forces, total
from levelone.aerodynamics.particle_kernels import direct_sums
from levelone.aerodynamics.rvpm import Background
from levelone.aerodynamics.wake_blobs import PART, blobs, parts_of

STREAM, MIRROR = np.array([1.0, 0.0, 0.0]), np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Loads:
    """Coefficients of the whole lattice [6], of each surface [s, 6], and the circulations [n] at unit speed (m)."""

    whole: Coefficients
    surfaces: Coefficients
    gamma: FloatArray


def points(plant: Plant) -> FloatArray:
    """Where :func:`steady_in` needs the wind [4 n, 3]: collocation points, bound vortices, right sides, left sides, m."""
    lattice, sides = plant.lattice, plant.carrier.side_middle
    return np.concatenate([lattice.collocation, lattice.midpoint, sides[:, 0], sides[:, 1]])


def steady_in(plant: Plant, wind: FloatArray) -> Loads:
    """Loads of a lattice at rest in a unit stream and an additional ``wind`` [4 n, 3] at :func:`points`, in units of the stream.

    NaN everywhere if the wind is not finite.
    """
    lattice, carrier, n = plant.lattice, plant.carrier, len(plant.lattice.bound)
    if not np.isfinite(wind).all():
        return Loads(np.full(6, np.nan), np.full((len(lattice.names), 6), np.nan), np.full(n, np.nan))
    at = wind.reshape(4, n, 3) + STREAM
    gamma = _circulation(plant, at[0])
    bound = bound_forces(carrier, at[1] + _induced(plant, gamma), net(lattice, gamma))
    side = side_forces(carrier, np.stack([at[2], at[3]], axis=1), gamma)
    of = lattice.surface[lattice.strip]
    parts = np.stack([_coefficients(plant, bound, side, of == each) for each in range(len(lattice.names))])
    return Loads(parts.sum(axis=0), parts, gamma)


def _circulation(plant: Plant, wind: FloatArray) -> FloatArray:
    """Circulations [n] in a wind [n, 3] at the collocation points: those of its symmetric and of its antisymmetric part."""
    wakes = wakes_at(plant, 0.0)
    if not plant.lattice.mirrored:
        return np.asarray(circulations(plant, wakes, wind[:, :, None].astype(complex), 1.0)[:, 0].real)
    image = np.roll(wind, len(wind) // 2, axis=0) * MIRROR
    parts = [(0.5 * (wind + sign * image), sign) for sign in (1.0, -1.0)]
    return np.sum([circulations(plant, wakes, part[:, :, None].astype(complex), sign)[:, 0].real for part, sign in parts], axis=0)


def _induced(plant: Plant, gamma: FloatArray) -> FloatArray:
    """Velocity [n, 3] of the lattice and its wake at the bound vortices."""
    lattice = plant.lattice
    wake = harmonic_wake(lattice.midpoint, plant.lines, lattice.last, plant.rows, 0.0).real
    return np.asarray((influence_vectors(lattice.midpoint, _corners(plant)) @ gamma + wake @ gamma[lattice.trailing]).T)


def _corners(plant: Plant) -> FloatArray:
    return rings(plant.lattice, (plant.rows > 0).astype(np.float64))


def _coefficients(plant: Plant, bound: FloatArray, side: FloatArray, chosen: FloatArray) -> Coefficients:
    lattice, about = plant.lattice, plant.lattice.reference_point
    force, moment = total(lattice.midpoint[chosen], bound[chosen], about)
    more, turning = total(plant.carrier.side_middle[chosen], side[chosen], about)
    return coefficients(lattice, force + more, moment + turning)


def as_background(plant: Plant, gamma: FloatArray, core: float, length: float) -> Background:
    """What a lattice of given circulations [n] (m^2/s) does to particles: its vortices as particles of a ``core`` (m).

    The wake of the lattice goes on for ``length`` (m) behind its shed lines. Both halves are contained.
    """
    lattice, corners, edge = plant.lattice, _corners(plant), gamma[plant.lattice.trailing]
    aft = np.array([length, 0.0, 0.0])
    # bound segments; right sides aft, left sides forward; the same behind the shed lines
    start = np.concatenate([corners[:, 0], corners[:, 1], corners[:, 3], plant.lines[:, 1], plant.lines[:, 0] + aft])
    end = np.concatenate([corners[:, 1], corners[:, 2], corners[:, 0], plant.lines[:, 1] + aft, plant.lines[:, 0]])
    circulation = np.concatenate([net(lattice, gamma), gamma, gamma, edge, edge])
    parts = parts_of(np.linalg.norm(end - start, axis=1), PART * core)
    sources = np.ascontiguousarray(blobs(start, end, circulation, core, parts))

    def background(at: FloatArray, vectors: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
        return direct_sums(at, vectors, sources, "winckelmans")

    return background
