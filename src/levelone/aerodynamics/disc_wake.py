"""Slipstreams of actuator discs in a steady stream, marched in time until their mean no longer changes.

Geometry frame (x aft, y right, z up), SI. Each step every disc sheds one ring (:mod:`~levelone.aerodynamics.actuator_disc`). The
youngest rings move freely with the stream, with each other and with what else there is (``background``). A ring that has grown old
keeps its shape and is carried along at the mean velocity of the older half of the free rings of its disc; behind the last ring goes
on, to infinity, a line of dipoles of the same moment per length (:mod:`~levelone.aerodynamics.disc_rings`). A slipstream that
simply ended would roll up at its end, and would have a source of its whole flux there.

The march starts with the slipstream of momentum theory, so that there is no starting vortex. Means are those over a window of
steps; the newest ring counts by half there, since it stands for what leaves the rim from the last step to the next one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from levelone.aerodynamics import disc_rings
from levelone.aerodynamics.actuator_disc import FEWEST, Disc, stations
from levelone.aerodynamics.disc_rings import Setup, Wakes, theory
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.particle_kernels import FloatArray
from levelone.aerodynamics.particles import ParticleModel, joined, step
from levelone.aerodynamics.rvpm import Background
from levelone.errors import InputError

#: most by which the mean inflows of both halves of the window may differ, as a share, for a slipstream that counts as settled
SETTLED = 0.01
#: most particles of a run
CAPACITY = 60_000


@dataclass(frozen=True)
class Marching:
    """How slipstreams are marched; the defaults are those of the theory page's tables.

    Parameters
    ----------
    step
        Way of the air through the disc in a time step by momentum theory, in radii of the smallest disc.
    points
        Particles of a ring.
    core
        Core of the particles, in radii of the smallest disc.
    free, far
        Rings of each disc that move freely, and rings behind them that are carried along.
    settle, window
        Steps before, and steps of, the window of the means (an even number).

    Raises
    ------
    InputError
        A number out of range.
    """

    step: float = 0.1
    points: int = 48
    core: float = 0.15
    free: int = 40
    far: int = 20
    settle: int = 60
    window: int = 40

    def __post_init__(self) -> None:
        for name in ("step", "core"):
            if not 0.0 < getattr(self, name) <= 1.0:
                raise InputError(f"marching.{name}", f"{getattr(self, name):g} radii; allowed: above 0, up to 1")
        for name, least in (("points", FEWEST), ("free", 4), ("far", 4), ("settle", 0), ("window", 2)):
            if getattr(self, name) < least:
                raise InputError(f"marching.{name}", f"{getattr(self, name)}; allowed: {least} or more")
        if self.window % 2:
            raise InputError("marching.window", f"{self.window}; allowed: even numbers, since both halves are compared")


@dataclass(frozen=True)
class Settled:
    """Means over the window; NaN where the outcome says that the march failed.

    Parameters
    ----------
    velocity
        [2, p, 3] induced by all slipstreams (images included) at the points asked for, in both halves of the window, m/s.
    inflow
        [2, d] mean over each disc of the velocity against its axis that all slipstreams induce, in both halves, m/s.
    radius
        [free, d] effective radius of the free rings over that of the disc, sqrt(impulse/(pi circulation)), the newest first.
    centre
        [free, d, 3] their centres, m.
    drift
        [d, 3] velocity of the older half of them, m/s.
    """

    velocity: FloatArray
    inflow: FloatArray
    radius: FloatArray
    centre: FloatArray
    drift: FloatArray
    wakes: Wakes
    outcome: Outcome
    words: str


def settle(
    discs: Sequence[Disc],
    stream: tuple[float, float, float],
    density: float,
    how: Marching,
    points: FloatArray,
    mirrored: bool = False,
    background: Background | None = None,
    threads: int | None = None,
) -> Settled:
    """March the slipstreams of discs in a stream (m/s) and return the mean velocities at points [p, 3].

    Parameters
    ----------
    mirrored
        Every disc has an image in y = 0; stream and background are symmetric.
    background
        Velocity and its gradient of everything but stream and slipstreams, see :data:`levelone.aerodynamics.rvpm.Background`.

    Returns
    -------
    Settled
        With the outcome ``NOT_CONVERGED``, and its values standing, where the inflow still changes by more than ``SETTLED``; with
        ``DIVERGED``, and NaN, where the march ended early.

    Raises
    ------
    InputError
        No disc, a disc without thrust, a descent, a mirrored disc that reaches across y = 0, or more than ``CAPACITY`` particles.
    """
    run = _prepared(tuple(discs), np.asarray(stream, dtype=float), density, how, mirrored, background, threads)
    wakes = disc_rings.start(run)
    asked = np.concatenate([np.asarray(points, dtype=float).reshape(-1, 3), *(stations(disc)[0] for disc in run.discs)])
    mean, radius = np.zeros((2, *asked.shape)), np.zeros((how.free, len(run.discs)))
    centre, drift = np.zeros((*radius.shape, 3)), np.zeros((len(run.discs), 3))
    for n in range(how.settle + how.window):
        wakes = Wakes(joined(wakes.free, run.shed(), CAPACITY).particles, wakes.far, wakes.drift)
        if n >= how.settle:
            mean[2 * (n - how.settle) // how.window] += disc_rings.induced(run, wakes, asked) * 2.0 / how.window
            radius += disc_rings.sizes(run, wakes)[:0:-1] / how.window
            centre += run.rings(wakes.free.position)[:0:-1].mean(axis=2) / how.window
        moved = step(wakes.free, disc_rings.outer(run, wakes), run.dt, run.model)
        if n >= how.settle:
            drift += disc_rings.drifted(run, wakes.free.position, moved.particles.position) / how.window
        if moved.outcome is not Outcome.OK:
            words = f"{moved.outcome.text} (at step {n + 1} of {how.settle + how.window})"
            none = np.nan
            empty = np.full((2, len(points), 3), none), np.full((2, len(run.discs)), none)
            return Settled(*empty, none * radius, none * centre, none * drift, wakes, moved.outcome, words)
        wakes = disc_rings.aged(run, wakes, moved.particles)
    inflow = _inflow(run, mean[:, len(points) :])
    return Settled(mean[:, : len(points)], inflow, radius, centre, drift, wakes, *_judged(inflow))


def _prepared(
    discs: tuple[Disc, ...], stream: FloatArray, density: float, how: Marching, mirrored: bool,
    background: Background | None, threads: int | None,
) -> Setup:  # fmt: skip
    if not discs:
        raise InputError("discs", "none given; allowed: one or more")
    for disc in discs:
        reach = disc.radius * math.sqrt(1.0 - disc.axis[1] ** 2)
        if mirrored and disc.centre[1] < reach:
            raise InputError(
                "disc.centre", f"y = {disc.centre[1]:g} m: a mirrored disc must lie at y >= {reach:g} m, clear of its image"
            )
    particles = len(discs) * how.points * (how.free + how.far + 1)
    if particles > CAPACITY:
        raise InputError("marching", f"points, free and far make {particles} particles; allowed: up to {CAPACITY}")
    radius = min(disc.radius for disc in discs)
    fastest = max(
        math.hypot(each.edgewise, each.climb + each.induced) for each in (theory(disc, stream, density) for disc in discs)
    )
    model = ParticleModel("winckelmans", "classic", mirrored, threads=threads)
    return Setup(
        discs, stream, density, how.points, how.core * radius, how.free, how.far, how.step * radius / fastest, model, background
    )


def _inflow(run: Setup, velocity: FloatArray) -> FloatArray:
    """Mean over each disc of the velocity [2, d s, 3] at its stations, against its axis: [2, d]."""
    at = velocity.reshape(2, len(run.discs), -1, 3)
    weights, axes = stations(run.discs[0])[1], np.array([disc.axis for disc in run.discs])
    return np.asarray(-np.einsum("s,hdsa,da->hd", weights, at, axes))


def _judged(inflow: FloatArray) -> tuple[Outcome, str]:
    change = float(np.max(np.abs(inflow[1] - inflow[0]) / np.abs(inflow.mean(axis=0))))
    if change <= SETTLED:
        return Outcome.OK, Outcome.OK.text
    words = f"not settled: mean inflows of both halves of the window differ by {change:.1%}, allowed {SETTLED:.0%}: a longer run"
    return Outcome.NOT_CONVERGED, words
