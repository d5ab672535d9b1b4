"""How a wake moves within a time step: with the wind, and in a free wake also with the velocity of all vortices.

Panels and particles are carried together by Williamson's Runge-Kutta method of third order. The bound circulation stays that of
the beginning of the step; the body itself is where it is at the time of each stage, so that only the motion relative to the air
matters.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from levelone.aerodynamics.body import Body
from levelone.aerodynamics.gust import Wind
from levelone.aerodynamics.lattice import FloatArray
from levelone.aerodynamics.motion import Motion
from levelone.aerodynamics.particle_kernels import gathered
from levelone.aerodynamics.particles import WILLIAMSON, ParticleModel, Particles
from levelone.aerodynamics.rvpm import rates
from levelone.aerodynamics.wake_blobs import of_panels
from levelone.aerodynamics.wake_panels import Panels


@dataclass(frozen=True)
class Flow:
    """What moves: panels, particles and the bound circulations [p] at a time."""

    time: float
    panels: Panels
    particles: Particles
    gamma: FloatArray


def blown(flow: Flow, wind: Wind, dt: float) -> Flow:
    """The wake after a step with the wind alone."""
    nodes = flow.panels.nodes.reshape(-1, 3)
    moved, change = nodes, np.zeros_like(nodes)
    for kept, along, when in WILLIAMSON:
        change = kept * change + dt * wind.velocity(moved, flow.time + when * dt)
        moved = moved + along * change
    return replace(flow, time=flow.time + dt, panels=replace(flow.panels, nodes=moved.reshape(flow.panels.nodes.shape)))


def free(flow: Flow, body: Body, motion: Motion, wind: Wind, dt: float, core: float, model: ParticleModel) -> Flow:
    """The wake after a step with the full velocity; ``core`` (m) of bound vortices and panels where they act on it."""
    panels, cloud, count = flow.panels, flow.particles, flow.panels.nodes.size // 3
    x = np.concatenate([panels.nodes.reshape(-1, 3), cloud.position])
    g, cores = np.concatenate([np.zeros((count, 3)), cloud.strength]), np.concatenate([np.full(count, core), cloud.core])
    dx, dg, dcore = np.zeros_like(x), np.zeros_like(g), np.zeros_like(cores)
    for kept, along, when in WILLIAMSON:
        time = flow.time + when * dt
        attached = _attached(replace(panels, nodes=x[:count].reshape(panels.nodes.shape)), body, motion, time, flow.gamma, core)
        sources = np.concatenate([attached, gathered(x[count:], g[count:], cores[count:])], axis=1)
        if model.mirrored:
            sources = gathered(sources[:3].T, sources[3:6].T, sources[6], mirrored=True)
        velocity, stretching = model.sums(x, g, sources)
        with np.errstate(over="ignore", invalid="ignore"):
            g_rate, core_rate = rates(stretching, g, cores, model.formulation)
            dx = kept * dx + dt * (velocity + wind.velocity(x, time))
            dg, dcore = kept * dg + dt * g_rate, kept * dcore + dt * core_rate
            x, g, cores = x + along * dx, g + along * dg, cores + along * dcore
        if not (np.isfinite(x).all() and np.isfinite(g).all() and cores.min() > 0.0):
            x, g, cores = (np.full_like(each, np.nan) for each in (x, g, cores))
            break
    moved = replace(panels, nodes=x[:count].reshape(panels.nodes.shape))
    return Flow(flow.time + dt, moved, Particles(x[count:], g[count:], cores[count:]), flow.gamma)


def _attached(panels: Panels, body: Body, motion: Motion, time: float, gamma: FloatArray, core: float) -> FloatArray:
    """Sources of the bound rings and of the panels; the row that grows between the shed line and the panels closes the gap."""
    pose = motion.pose(time)
    grown = panels.grown(pose.points(body.shed), body.at_edge(gamma))
    nodes = np.concatenate([pose.points(body.lines), grown.nodes])
    return of_panels(replace(grown, nodes=nodes, circulation=np.concatenate([gamma[body.closing], grown.circulation])), core)
