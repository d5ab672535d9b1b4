"""Small oscillations of a lattice in the frequency domain: every motion at every reduced frequency by one linear solve.

The wake lies flat along the free stream, as far as infinity. The mean flow is that of the geometry at rest in the stream (its
incidence and camber); the forces are linear about it. At k = 0 the same equations are the steady lattice and its quasi-steady
rates.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from levelone.aerodynamics import modes
from levelone.aerodynamics.coefficients import NAMES, Coefficients, coefficients, in_wind_axes
from levelone.aerodynamics.harmonic_wake import harmonic_wake
from levelone.aerodynamics.kernels import influence, influence_vectors
from levelone.aerodynamics.lattice import FloatArray, IntArray, Lattice, rings, shed_line, starts
from levelone.aerodynamics.loads import Array, Carriers, bound_forces, carriers, net, rate_forces, side_forces, total
from levelone.errors import InputError

ComplexArray = NDArray[np.complex128]
#: length of the wake, in chords, that is lumped like the bound vortices
LUMPED = 2.0
#: mean circulation below this share of V c counts as none
UNLOADED = 1e-12
#: free stream of unit speed
STREAM = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Plant:
    """A lattice made ready: its vortices, and the velocities that its rings induce on one half of it (on all if not mirrored)."""

    lattice: Lattice
    carrier: Carriers
    lines: FloatArray  # [m, 2, 3] shed lines, m
    rows: IntArray  # [m] of the wake, lumped
    influence: FloatArray  # [p, n] normal velocity at collocation points by rings of unit circulation, 1/m
    vectors: FloatArray  # [3, p, n] velocity at the bound vortices, 1/m; empty without a mean load
    mean: FloatArray  # [n] mean circulation at unit speed, m
    wind: FloatArray  # [n, 3] mean wind at the bound vortices, of unit free stream

    @property
    def half(self) -> int:
        """Panels that are solved for."""
        return len(self.influence)

    @property
    def loaded(self) -> bool:
        """Whether the geometry at rest carries load."""
        return self.vectors.size > 0


@dataclass(frozen=True)
class Wakes:
    """Velocities by the wakes of strips of unit circulation at one frequency."""

    normal: ComplexArray  # [p, m] at the collocation points, along the normal
    vectors: ComplexArray  # [3, p, m] at the bound vortices; empty without a mean load


def prepare(lattice: Lattice) -> Plant:
    """Everything about a lattice that does not depend on frequency."""
    rows = _rows(lattice)
    h = (rows > 0).astype(np.float64)
    count = len(lattice.bound)
    half = count // 2 if lattice.mirrored else count
    corners = rings(lattice, h)
    plant = Plant(
        lattice, carriers(lattice, h), shed_line(lattice, starts(h) + 0.5 * h), rows,
        influence(lattice.collocation[:half], lattice.normal[:half], corners), np.empty((3, 0, 0)), np.zeros(count),
        np.tile(STREAM, (count, 1)),
    )  # fmt: skip
    if np.max(np.abs(lattice.normal[:, 0])) < UNLOADED:
        return plant
    plant = replace(plant, vectors=influence_vectors(lattice.midpoint[:half], corners))
    wakes = wakes_at(plant, 0.0)
    gamma = circulations(plant, wakes, plant.wind[:, :, None].astype(complex), 1.0)[:, 0]
    return replace(plant, mean=gamma.real, wind=plant.wind + _induced(plant, wakes, gamma, 1.0).real)


def oscillate(plant: Plant, k: FloatArray, motions: tuple[str, ...], centre: FloatArray, threads: int = 2) -> ComplexArray:
    """Coefficients [motion, k, 6] (C_L, C_D, C_Y, C_l, C_m, C_n) per unit amplitude: real in phase, imaginary 90 deg ahead.

    Parameters
    ----------
    k
        Reduced frequencies omega c/(2V) with the reference length of the lattice; 0 for steady motions ("alpha", "q" ... in
        :mod:`levelone.aerodynamics.modes`, rates in rad over V, 1/m).
    centre
        Point [3] about which the body turns, m.

    Raises
    ------
    InputError
        If a reduced frequency is negative or not finite.
    """
    bad = [each for each in np.atleast_1d(k) if not (np.isfinite(each) and each >= 0.0)]
    if bad:
        raise InputError("k", f"{bad[0]:g} is no reduced frequency: a positive number is needed")
    with ThreadPoolExecutor(threads) as pool:
        found = list(pool.map(lambda each: _at(plant, float(each), motions, centre), np.atleast_1d(k)))
    return np.stack(found, axis=1)


def steady(plant: Plant) -> Coefficients:
    """Coefficients of the geometry at rest in the stream."""
    bound, side = forces_at_rest(plant)
    return coefficients(plant.lattice, *_sum(plant, bound, side, np.zeros_like(bound)))


def forces_at_rest(plant: Plant) -> tuple[FloatArray, FloatArray]:
    """Forces over density at unit speed on the bound vortices [n, 3] and the side segments [n, 2, 3], m^2."""
    carrier = plant.carrier
    bound = bound_forces(carrier, plant.wind, net(plant.lattice, plant.mean))
    return bound, side_forces(carrier, np.broadcast_to(STREAM, carrier.side.shape), plant.mean)


def _at(plant: Plant, k: float, motions: tuple[str, ...], centre: FloatArray) -> ComplexArray:
    kappa = 2.0 * k / plant.lattice.chord
    wakes = wakes_at(plant, kappa)
    found = np.empty((len(motions), len(NAMES)), dtype=complex)
    for sign in (1.0, -1.0):
        chosen = [i for i, motion in enumerate(motions) if modes.antisymmetric(motion) == (sign < 0.0)]
        if chosen:
            winds = [modes.relative_wind(motions[i], plant.lattice.collocation, centre, kappa) for i in chosen]
            gammas = circulations(plant, wakes, np.stack(winds, axis=2), sign)
            for i, gamma in zip(chosen, gammas.T, strict=True):
                found[i] = _answer(plant, wakes, motions[i], gamma, centre, kappa)
    return found


def _answer(plant: Plant, wakes: Wakes, motion: str, gamma: ComplexArray, centre: FloatArray, kappa: float) -> ComplexArray:
    """Coefficients [6] of a motion whose circulations [n] are known."""
    bound, side = forces(plant, wakes, motion, gamma, centre, kappa)
    change = coefficients(plant.lattice, *_sum(plant, bound, side, rate_forces(plant.carrier, 1j * kappa * gamma)))
    return in_wind_axes(change, steady(plant), modes.INCIDENCE.get(motion, 0.0))


def forces(
    plant: Plant, wakes: Wakes, motion: str, gamma: ComplexArray, centre: FloatArray, kappa: float
) -> tuple[ComplexArray, ComplexArray]:
    """Changes of the forces over density on bound vortices [n, 3] and side segments [n, 2, 3] with a unit of a motion, m^2.

    ``gamma`` [n] are the circulations of the motion; the mean load meets the motion's wind and what they induce.
    """
    lattice, carrier = plant.lattice, plant.carrier
    bound = bound_forces(carrier, plant.wind.astype(complex), net(lattice, gamma))
    side = side_forces(carrier, np.broadcast_to(STREAM, carrier.side.shape).astype(complex), gamma)
    if plant.loaded:
        sign = -1.0 if modes.antisymmetric(motion) else 1.0
        wind = modes.relative_wind(motion, lattice.midpoint, centre, kappa) + _induced(plant, wakes, gamma, sign)
        bound += bound_forces(carrier, wind, net(lattice, plant.mean).astype(complex))
        at_sides = modes.relative_wind(motion, carrier.side_middle.reshape(-1, 3), centre, kappa).reshape(carrier.side.shape)
        side += side_forces(carrier, at_sides, plant.mean.astype(complex))
    return bound, side


def _sum(plant: Plant, bound: Array, side: Array, ring: Array) -> tuple[Array, Array]:
    about = plant.lattice.reference_point
    parts = [(plant.lattice.midpoint, bound), (plant.carrier.side_middle, side), (plant.carrier.ring_middle, ring)]
    sums = [total(points, forces, about) for points, forces in parts]
    return np.sum([force for force, _ in sums], axis=0), np.sum([moment for _, moment in sums], axis=0)


def wakes_at(plant: Plant, kappa: float) -> Wakes:
    """Velocities by the wakes at omega/V = ``kappa``, 1/m; 0: steady."""
    lattice = plant.lattice
    at_points = harmonic_wake(lattice.collocation[: plant.half], plant.lines, lattice.last, plant.rows, kappa)
    normal = np.einsum("apm,pa->pm", at_points, lattice.normal[: plant.half])
    if not plant.loaded:
        return Wakes(normal, np.empty((3, 0, 0), dtype=complex))
    return Wakes(normal, harmonic_wake(lattice.midpoint[: plant.half], plant.lines, lattice.last, plant.rows, kappa))


def _fold(plant: Plant, matrix: Array, sign: float) -> Array:
    """Columns of one half, for circulations that are mirrored with a sign."""
    if not plant.lattice.mirrored:
        return matrix
    half = matrix.shape[-1] // 2
    return np.asarray(matrix[..., :half] + sign * matrix[..., half:])


def circulations(plant: Plant, wakes: Wakes, winds: ComplexArray, sign: float) -> ComplexArray:
    """Circulations [n, motion] of the rings that let no wind [n, 3, motion] through the collocation points."""
    half = plant.half
    matrix = _fold(plant, plant.influence, sign).astype(complex)
    wake = _fold(plant, wakes.normal, sign)
    matrix[:, plant.lattice.trailing[: wake.shape[1]]] += wake
    gamma = np.linalg.solve(matrix, -np.einsum("pam,pa->pm", winds[:half], plant.lattice.normal[:half]))
    return np.concatenate([gamma, sign * gamma]) if plant.lattice.mirrored else gamma


def _induced(plant: Plant, wakes: Wakes, gamma: ComplexArray, sign: float) -> ComplexArray:
    """Velocity [n, 3] at the bound vortices, for circulations [n] that are mirrored with a sign."""
    wind = (plant.vectors @ gamma + wakes.vectors @ gamma[plant.lattice.trailing]).T
    return np.concatenate([wind, sign * wind * [1.0, -1.0, 1.0]]) if plant.lattice.mirrored else wind


def _rows(lattice: Lattice) -> IntArray:
    """Lumped rows of the wake of each strip [m]: over a fixed length, and out of reach of what lies behind.

    A fixed number of rows would leave an error at their end that does not vanish with the size of the panels.
    """
    length = LUMPED * lattice.chord_at
    for j in range(len(lattice.first)):
        gap = lattice.collocation[:, 0] - lattice.edge[j, :, 0].mean()
        behind = gap[(gap > 0.0) & (lattice.strip != j)]
        length[j] = min(length[j], 0.5 * behind.min()) if len(behind) else length[j]
    rows = np.floor(length / lattice.last + 1e-6).astype(np.int64)
    return rows if np.all(rows > 0) else np.zeros_like(rows)
