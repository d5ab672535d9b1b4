"""Vortex particles: values, a step in time, joining and cutting a cloud.

Geometry frame (x aft, y right, z up), SI. A particle has a position, a strength G = Gamma l (circulation times length, m^3/s, along
the vorticity) and a core. Sums: :mod:`~levelone.aerodynamics.particle_kernels`; rates: :mod:`~levelone.aerodynamics.rvpm`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from levelone.aerodynamics.invariants import Invariants, invariants
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.particle_kernels import KERNELS, FloatArray, gathered
from levelone.aerodynamics.rvpm import FORMULATIONS, Background, Sums, rates, relaxed, sums
from levelone.errors import InputError, unknown_name

#: sources from which on the tree is used: there it is as fast as the direct sum for the least favourable cloud measured
TREE_FROM = 8000
#: three-stage low-storage Runge-Kutta method of third order: share of the last increment kept, step along it, time of the stage
WILLIAMSON = ((0.0, 1.0 / 3.0, 0.0), (-5.0 / 9.0, 15.0 / 16.0, 1.0 / 3.0), (-153.0 / 128.0, 8.0 / 15.0, 3.0 / 4.0))


@dataclass(frozen=True)
class Particles:
    """Vortex particles: position [n, 3] (m), strength [n, 3] (m^3/s), core [n] (m).

    Raises
    ------
    InputError
        For shapes that do not fit together or a core that is not positive. NaN is let through: it is what a failed step leaves.
    """

    position: FloatArray
    strength: FloatArray
    core: FloatArray

    def __post_init__(self) -> None:
        for name in ("position", "strength", "core"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=float))
        n = len(self.core)
        for name, wanted in (("position", (n, 3)), ("strength", (n, 3)), ("core", (n,))):
            if getattr(self, name).shape != wanted:
                raise InputError(f"particles.{name}", f"shape {getattr(self, name).shape}; allowed: {wanted}, for {n} cores")
        if (self.core <= 0.0).any():
            raise InputError("particles.core", f"a core is {self.core.min():g} m; allowed: above 0")

    def __len__(self) -> int:
        return len(self.core)


@dataclass(frozen=True)
class ParticleModel:
    """How particles act and change.

    Parameters
    ----------
    kernel
        ``winckelmans`` or ``gaussian-erf``.
    formulation
        ``reformulated`` or ``classic``.
    mirrored
        Whether every particle has an image in the plane y = 0; only one half is then held and moved.
    relaxation
        Rate at which strengths are turned towards the vorticity, 1/s; 0: never.
    threads
        Worker threads, None for one on each processor; results do not depend on it.
    tree_from
        Number of sources (images counted) from which on the tree is used.

    Raises
    ------
    InputError
        For an unknown name or a number out of range.
    """

    kernel: str = "winckelmans"
    formulation: str = "reformulated"
    mirrored: bool = False
    relaxation: float = 0.0
    threads: int | None = None
    tree_from: int = TREE_FROM

    def __post_init__(self) -> None:
        if self.kernel not in KERNELS:
            raise unknown_name("particles.kernel", self.kernel, KERNELS)
        if self.formulation not in FORMULATIONS:
            raise unknown_name("particles.formulation", self.formulation, FORMULATIONS)
        if not 0.0 <= self.relaxation < np.inf:
            raise InputError("particles.relaxation", f"{self.relaxation:g} 1/s; allowed: 0 or more, finite")
        if self.threads is not None and self.threads < 1:
            raise InputError("particles.threads", f"{self.threads}; allowed: 1 or more")
        if self.tree_from < 1:
            raise InputError("particles.tree_from", f"{self.tree_from}; allowed: 1 or more")

    @property
    def sums(self) -> Sums:
        """The sum over sources that this model asks for."""
        return sums(self.kernel, self.threads, self.tree_from)


@dataclass(frozen=True)
class Moved:
    """Particles after a step or a join, and its outcome; every value is NaN if the outcome is not ``OK``."""

    particles: Particles
    outcome: Outcome


@dataclass(frozen=True)
class Cut:
    """Particles left after a cut, how many were removed, and what they held (without images)."""

    particles: Particles
    removed: int
    lost: Invariants


def velocity_at(points: FloatArray, particles: Particles, model: ParticleModel) -> FloatArray:
    """Velocity [p, 3] (m/s) that the particles, and their images if there are any, induce at points [p, 3]."""
    points = np.ascontiguousarray(points, dtype=float)
    return model.sums(points, np.zeros_like(points), _sources(particles, model))[0]


def step(particles: Particles, background: Background, dt: float, model: ParticleModel, time: float = 0.0) -> Moved:
    """Particles at ``time`` + ``dt`` (s): positions, strengths and cores by one step of Williamson's Runge-Kutta method.

    Williamson, J. Comput. Phys. 35, 1980. The background is asked at each of the three stages. Relaxation follows the step. Values
    that are not finite, or a core that has shrunk to nothing, give the outcome ``DIVERGED``.

    Raises
    ------
    InputError
        For a step that is not positive, or so long that relaxation would turn strengths by more than the whole way.
    """
    if not 0.0 < dt < np.inf:
        raise InputError("dt", f"{dt:g} s; allowed: above 0, finite")
    if model.relaxation * dt > 1.0:
        raise InputError("particles.relaxation", f"{model.relaxation:g} 1/s; allowed with a step of {dt:g} s: up to {1.0 / dt:g}")
    if len(particles) == 0:
        return Moved(particles, Outcome.OK)
    x, g, core = particles.position, particles.strength, particles.core
    dx, dg, dcore = np.zeros_like(x), np.zeros_like(g), np.zeros_like(core)
    for kept, along, when in WILLIAMSON:
        u, stretching = model.sums(x, g, gathered(x, g, core, model.mirrored))
        outer, strained = background(x, g, time + when * dt)
        with np.errstate(over="ignore", invalid="ignore"):
            g_rate, core_rate = rates(stretching + strained, g, core, model.formulation)
            dx, dg, dcore = kept * dx + dt * (u + outer), kept * dg + dt * g_rate, kept * dcore + dt * core_rate
            x, g, core = x + along * dx, g + along * dg, core + along * dcore
        if not (_finite(x, g, core) and core.min() > 0.0):
            return Moved(_undefined(len(particles)), Outcome.DIVERGED)
    if model.relaxation > 0.0:
        g = relaxed(x, g, core, model.relaxation * dt, model.mirrored, model.sums)
    return Moved(Particles(x, g, core), Outcome.OK)


def joined(particles: Particles, more: Particles, capacity: int) -> Moved:
    """Both clouds as one, ``more`` behind; outcome ``WAKE_FULL`` if that is more than ``capacity`` particles."""
    n = len(particles) + len(more)
    if n > capacity:
        return Moved(_undefined(n), Outcome.WAKE_FULL)
    pairs = ((getattr(particles, name), getattr(more, name)) for name in ("position", "strength", "core"))
    return Moved(Particles(*(np.concatenate(pair) for pair in pairs)), Outcome.OK)


def cut(particles: Particles, low: tuple[float, float, float], high: tuple[float, float, float]) -> Cut:
    """Remove the particles outside the box from ``low`` to ``high`` (m; infinite where open); a NaN position stays, and is seen."""
    x = particles.position
    out: npt.NDArray[np.bool_] = np.any((x < np.asarray(low)) | (x > np.asarray(high)), axis=1)
    return Cut(_part(particles, ~out), int(out.sum()), invariants(x[out], particles.strength[out]))


def with_images(particles: Particles) -> Particles:
    """The particles and, behind them, their images in the plane y = 0."""
    both = gathered(particles.position, particles.strength, particles.core, mirrored=True)
    return Particles(both[:3].T, both[3:6].T, both[6])


def _sources(particles: Particles, model: ParticleModel) -> FloatArray:
    return gathered(particles.position, particles.strength, particles.core, model.mirrored)


def _finite(*arrays: FloatArray) -> bool:
    return all(bool(np.isfinite(a).all()) for a in arrays)


def _part(particles: Particles, kept: npt.NDArray[np.bool_]) -> Particles:
    return Particles(particles.position[kept], particles.strength[kept], particles.core[kept])


def _undefined(n: int) -> Particles:
    return Particles(np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan))
