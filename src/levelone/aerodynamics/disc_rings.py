"""Rings of discs as particles: free ones, old ones that are carried along, and the line of dipoles behind the last.

Geometry frame (x aft, y right, z up), SI. Particles lie in blocks of [disc, point], one block for each time step, from the oldest
to the newest. A ring is a closed material line: it keeps its circulation (Kelvin), and its strengths follow from where its
particles are. The classic rate of stretching says the same to first order; alone it lets strengths grow without bound where a ring
is drawn out between its particles (measured: in edgewise flow such a march diverges).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from levelone.aerodynamics.actuator_disc import Disc, rate, shed
from levelone.aerodynamics.particle_kernels import FloatArray, gathered
from levelone.aerodynamics.particles import ParticleModel, Particles, velocity_at
from levelone.aerodynamics.rotor_theory import Slipstream, slipstream
from levelone.aerodynamics.rvpm import Background

MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Wakes:
    """Slipstreams at one time: free and far particles, and the drift [d, 3] of the far ones (m/s)."""

    free: Particles
    far: Particles
    drift: FloatArray


@dataclass(frozen=True)
class Setup:
    """What stays the same during a march: discs, stream [3] (m/s), density, particles of a ring, core (m), free and far rings,
    time step (s), particle model, and the velocity of everything else, if there is any."""

    discs: tuple[Disc, ...]
    stream: FloatArray
    density: float
    points: int
    core: float
    free: int
    far: int
    dt: float
    model: ParticleModel
    background: Background | None

    @property
    def block(self) -> int:
        """Particles that are shed in a step."""
        return len(self.discs) * self.points

    def rings(self, values: FloatArray) -> FloatArray:
        """[ring, disc, point, ...] of values [n, ...]."""
        return values.reshape(-1, len(self.discs), self.points, *values.shape[1:])

    def shed(self) -> Particles:
        """The rings of one time step."""
        return shed(self.discs, self.density, self.dt, self.points, self.core)


def theory(disc: Disc, stream: FloatArray, density: float) -> Slipstream:
    """Momentum theory of a disc in a stream [3] (m/s)."""
    axis = np.asarray(disc.axis)
    climb = -float(stream @ axis)
    return slipstream(disc.thrust, density, disc.radius, climb, float(np.linalg.norm(stream + climb * axis)))


def start(run: Setup) -> Wakes:
    """The slipstreams of momentum theory: contracted rings that move with the stream and v_i."""
    ring = run.shed()
    age = run.dt * np.arange(run.free + run.far, 0, -1.0)
    position, strength, drift = [], [], []
    for i, disc in enumerate(run.discs):
        part = slice(i * run.points, (i + 1) * run.points)
        found, axis, centre = theory(disc, run.stream, run.density), np.asarray(disc.axis), np.asarray(disc.centre)
        drift.append(run.stream - found.induced * axis)
        way = age[:, None] * drift[-1]
        depth = -way @ axis / disc.radius
        # axial velocity on the axis of a half-infinite vortex cylinder, and the radius by continuity
        growth = 1.0 + found.induced / (found.climb + found.induced) * depth / np.sqrt(1.0 + depth**2)
        size = np.maximum(1.0 / np.sqrt(growth), found.contraction)[:, None, None]
        position.append(centre + way[:, None] + size * (ring.position[part] - centre))
        strength.append(size * ring.strength[part])
    x, g = (np.stack(each, axis=1).reshape(-1, 3) for each in (position, strength))
    cloud, behind = Particles(x, g, np.full(len(x), run.core)), run.far * run.block
    return Wakes(_part(cloud, slice(behind, None)), _part(cloud, slice(behind)), np.stack(drift))


def outer(run: Setup, wakes: Wakes) -> Background:
    """Stream, far rings on their way with what follows them, and the background.

    What follows them has no gradient here: strengths are made anew from positions after each step (:func:`relinked`).
    """
    moving = np.tile(np.repeat(wakes.drift, run.points, axis=0), (run.far, 1))

    def background(points: FloatArray, vectors: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
        far = wakes.far.position + time * moving
        u, stretching = run.model.sums(points, vectors, gathered(far, wakes.far.strength, wakes.far.core, run.model.mirrored))
        if run.background is not None:
            more, strained = run.background(points, vectors, time)
            u, stretching = u + more, stretching + strained
        return u + _beyond(run, wakes, points, time) + run.stream, stretching

    return background


def aged(run: Setup, wakes: Wakes, moved: Particles) -> Wakes:
    """After a step: the oldest free ring of each disc joins the far ones, the oldest of which is left behind."""
    far, block = wakes.far.position + run.dt * np.tile(np.repeat(wakes.drift, run.points, axis=0), (run.far, 1)), run.block
    moved, old = relinked(run, moved), slice(block)
    kept = Particles(
        np.concatenate([far[block:], moved.position[old]]), np.concatenate([wakes.far.strength[block:], moved.strength[old]]),
        np.concatenate([wakes.far.core[block:], moved.core[old]]),
    )  # fmt: skip
    return Wakes(_part(moved, slice(block, None)), kept, wakes.drift)


def relinked(run: Setup, particles: Particles) -> Particles:
    """The same positions, with the strengths of closed lines through them: differences of fourth order along each ring."""
    x = run.rings(particles.position)

    def apart(n: int) -> FloatArray:
        return np.asarray(np.roll(x, -n, axis=2) - np.roll(x, n, axis=2))

    along = (8.0 * apart(1) - apart(2)) / 12.0
    return Particles(particles.position, (-_circulation(run)[:, None, None] * along).reshape(-1, 3), particles.core)


def induced(run: Setup, wakes: Wakes, points: FloatArray) -> FloatArray:
    """Velocity [p, 3] of the slipstreams, images included, at points [p, 3]; the newest rings count by half."""
    newest = wakes.free.strength.copy()
    newest[-run.block :] *= 0.5
    cloud = Particles(
        np.concatenate([wakes.far.position, wakes.free.position]), np.concatenate([wakes.far.strength, newest]),
        np.concatenate([wakes.far.core, wakes.free.core]),
    )  # fmt: skip
    return velocity_at(points, cloud, run.model) + _beyond(run, wakes, points)


def _beyond(run: Setup, wakes: Wakes, points: FloatArray, time: float = 0.0) -> FloatArray:
    """Velocity [p, 3] of the slipstreams behind the last far rings, images included."""
    centre, moment = run.rings(wakes.far.position).mean(axis=(0, 2)), _moments(run, wakes.far).mean(axis=0)
    width = np.sqrt(np.linalg.norm(moment, axis=1) / (2.0 * np.pi * _circulation(run)))
    total = np.zeros_like(points)
    for i, drift in enumerate(wakes.drift):
        speed = float(np.linalg.norm(drift))
        line = centre[i] + (0.5 * run.far * run.dt + time) * drift, drift / speed, moment[i] / (speed * run.dt), float(width[i])
        total += column(points, *line)
        if run.model.mirrored:
            total += column(points * MIRROR, *line) * MIRROR
    return total


def column(points: FloatArray, start: FloatArray, along: FloatArray, density: FloatArray, width: float) -> FloatArray:
    """Velocity [p, 3] of a half-infinite line of vortex dipoles from ``start`` [3] along a unit vector [3].

    ``density`` [3]: circulation times area (along the normal) per length, m^3/s; the line acts as a sink at its start if it runs
    along it. Distances are s = sqrt(r^2 + width^2): with a ``width`` of 1/sqrt(2) of its radius, a slipstream with a flat end is
    met to second order far away. The gradient of -1/(4 pi) D . (r/s - e)/(s - r.e), the integral of the dipole's potential.
    """
    r = points - start
    size = np.sqrt(np.einsum("pa,pa->p", r, r) + width**2)[:, None]
    behind = size - r @ along[:, None]
    unit = r / size
    across = (density - unit * (unit @ density)[:, None]) / (size * behind)
    turned = unit - along
    return np.asarray((turned * (turned @ density)[:, None] / behind**2 - across) / (4.0 * np.pi))


def drifted(run: Setup, before: FloatArray, after: FloatArray) -> FloatArray:
    """Mean velocity [d, 3] of the older half of the free rings in a step."""
    older = slice(0, run.free // 2)
    return np.asarray((run.rings(after)[older] - run.rings(before)[older]).mean(axis=(0, 2)) / run.dt)


def sizes(run: Setup, wakes: Wakes) -> FloatArray:
    """Effective radius sqrt(impulse/(pi circulation)) of the free rings over that of their discs, [ring, d]."""
    radius = np.array([disc.radius for disc in run.discs])
    return np.asarray(np.sqrt(np.linalg.norm(_moments(run, wakes.free), axis=2) / (np.pi * _circulation(run))) / radius)


def _circulation(run: Setup) -> FloatArray:
    """Circulation of a ring of each disc [d], m^2/s."""
    return np.array([rate(disc, run.density) * run.dt for disc in run.discs])


def _moments(run: Setup, particles: Particles) -> FloatArray:
    """Circulation times area [ring, d, 3] (m^4/s) of each ring, about its own centre."""
    x, g = run.rings(particles.position), run.rings(particles.strength)
    return np.asarray(0.5 * np.cross(x - x.mean(axis=2, keepdims=True), g).sum(axis=2))


def _part(particles: Particles, which: slice) -> Particles:
    return Particles(particles.position[which], particles.strength[which], particles.core[which])
