"""Loads on a moving body and its wake in the time domain: unsteady vortex lattice with a prescribed or a free wake.

Katz and Plotkin, Low-Speed Aerodynamics, 2nd ed., sections 13.12 and 13.13, with the shed line and the end of the load as in
:mod:`levelone.aerodynamics.wake_start`: with a time step of one panel length the scheme is of second order.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from levelone.aerodynamics import gust
from levelone.aerodynamics.body import Body, prepare
from levelone.aerodynamics.history import FinalWake, LoadHistory, Recorder
from levelone.aerodynamics.lattice import FloatArray, Lattice
from levelone.aerodynamics.motion import Motion, Pose
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.particles import ParticleModel, Particles, velocity_at
from levelone.aerodynamics.transport import Flow, blown, free
from levelone.aerodynamics.wake_blobs import released
from levelone.aerodynamics.wake_panels import Panels, cores, sharp_rows
from levelone.errors import InputError, unknown_name

KINDS = ("prescribed", "free")
#: length of the wake, in lengths of the cut wake, that the estimate of the cut adds
FAR = 1000.0
#: thinnest core of particles, in distances of rows: below it loads on a tail depend on how the rows happen to pass it
LEAST_CORE = 0.8


@dataclass(frozen=True)
class Wake:
    """How the wake is modelled.

    Parameters
    ----------
    kind
        "prescribed": panels that the wind carries; "free": panels near the edge and particles behind, carried by the full velocity.
    cut
        Length of the wake in reference chords; what is older than the time to travel it is removed.
    panel_length
        Length of the panels of a free wake before they become particles, in reference chords: some cores, since a core close to the
        edge that sheds it changes the load there.
    core
        Core of the particles of a free wake, in reference chords: a length that does not shrink with the panels.
    spacing
        Longest distance of the particles that a segment becomes, in reference chords; infinite: one particle a segment.
    kernel, formulation
        Of the particles, see :class:`levelone.aerodynamics.particles.ParticleModel`.
    capacity
        Particles (of one half where the flow is symmetric) from which on a run ends as ``WAKE_FULL``.
    """

    kind: str = "prescribed"
    cut: float = 30.0
    panel_length: float = 1.0
    core: float = 0.25
    spacing: float = math.inf
    kernel: str = "winckelmans"
    formulation: str = "reformulated"
    capacity: int = 40_000

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise unknown_name("wake.kind", self.kind, KINDS)
        for name in ("cut", "panel_length", "core"):
            _positive(f"wake.{name}", getattr(self, name))
        if not self.spacing > 0.0:
            raise InputError("wake.spacing", f"{self.spacing} is not positive")
        if self.capacity < 1:
            raise InputError("wake.capacity", f"{self.capacity}; 1 or more is needed")
        ParticleModel(self.kernel, self.formulation)


def simulate(
    lattice: Lattice,
    motion: Motion,
    speed: float,
    dt: float,
    steps: int,
    wake: Wake | None = None,
    wind: gust.Wind | None = None,
    density: float = 1.225,
    threads: int = 2,
    progress: Callable[[int], None] | None = None,
) -> LoadHistory:
    """Loads at dt, 2 dt, ... of a body that begins to move through air at rest at t = 0.

    Parameters
    ----------
    lattice, motion
        The body and its motion in the wind-tunnel frame.
    speed
        Airspeed (m/s) that wake spacing and coefficients refer to; also the wind along +x where ``wind`` is not given.
    dt, steps
        Time step (s), and number of steps.
    wind
        Undisturbed wind; zero for a body whose motion contains its flight.
    density
        kg/m^3.
    progress
        Called with the number of each step that is done.

    Returns
    -------
    LoadHistory
        With an outcome other than OK and NaN from that step on where the step is longer than a chord, the wake outgrows its
        capacity or anything is not finite. The force that starts the motion at t = 0 in no time is in no step.

    Raises
    ------
    InputError
        A speed, time step, density or number of steps or threads that is not positive.
    """
    for name, value in (("speed", speed), ("dt", dt), ("density", density), ("steps", steps), ("threads", threads)):
        _positive(name, value)
    wake, wind = wake or Wake(), wind or gust.uniform((speed, 0.0, 0.0))
    symmetric = lattice.mirrored and wind.symmetric and all(motion.pose(dt * n).symmetric for n in range(steps + 1))
    run = _Run(prepare(lattice, speed * dt, symmetric), motion, wind, wake, speed, dt, threads)
    recorder = Recorder(run.body, steps, density)
    if speed * dt > float(lattice.chord_at.min()):
        words = f"{Outcome.STEP_TOO_LONG.text} (speed times step {speed * dt:g} m, shortest chord {lattice.chord_at.min():g} m)"
        return recorder.history(dt, speed, Outcome.STEP_TOO_LONG, words, None, 0)
    if wake.kind == "free" and run.core < LEAST_CORE * run.length * (1.0 - 1e-9):
        rows = run.length / lattice.chord
        allowed = f"{LEAST_CORE * rows:.3g} or more for rows of {rows:.3g} chords, or a shorter time step"
        raise InputError("wake.core", f"{wake.core:g} chords; {allowed}: thinner particles act one by one")
    outcome, wake_left, removed = _march(run, recorder, steps, progress)
    words = outcome.text if outcome is Outcome.OK else f"{outcome.text} (at step {recorder.step + 1} of {steps})"
    return recorder.history(dt, speed, outcome, words, wake_left, removed)


@dataclass(frozen=True)
class _Run:
    body: Body
    motion: Motion
    wind: gust.Wind
    wake: Wake
    speed: float
    dt: float
    threads: int

    @property
    def length(self) -> float:
        """m."""
        return self.speed * self.dt

    @property
    def chord(self) -> float:
        return self.body.lattice.chord

    @property
    def rows(self) -> int:
        """Rows of the whole wake."""
        return self._rows(self.wake.cut)

    @property
    def panel_rows(self) -> int:
        return self.rows if self.wake.kind == "prescribed" else min(self._rows(self.wake.panel_length), self.rows)

    def _rows(self, chords: float) -> int:
        return max(math.ceil(chords * self.chord / self.length - 1e-9), 1)

    @property
    def core(self) -> float:
        """m."""
        return self.wake.core * self.chord

    @property
    def model(self) -> ParticleModel:
        return ParticleModel(self.wake.kernel, self.wake.formulation, self.body.symmetric, threads=self.threads)


@dataclass(frozen=True)
class _Batch:
    """Particles that a row of panels became: their number, and what closes the wake when those behind are cut off."""

    count: int
    closing: FloatArray


def _march(
    run: _Run, recorder: Recorder, steps: int, progress: Callable[[int], None] | None
) -> tuple[Outcome, FinalWake | None, int]:
    body, pose = run.body, run.motion.pose(0.0)
    panels = Panels(body.edges, pose.points(body.shed)[None], np.empty((0, body.strips)), np.zeros(body.strips))
    none = Particles(np.empty((0, 3)), np.empty((0, 3)), np.empty(0))
    flow = Flow(0.0, panels, none, np.zeros(body.panels))
    longest = min(run.panel_rows + 1, steps)
    thick = cores(body.edges, sharp_rows(body.lattice, body.strips, run.length), longest, run.length)
    flow, _ = _solved(run, flow, pose, thick)
    past, removed = [flow.gamma], 0
    batches: list[_Batch] = []
    for n in range(1, steps + 1):
        moved = blown(flow, run.wind, run.dt) if run.wake.kind == "prescribed" else _carried(run, flow)
        pose = run.motion.pose(n * run.dt)
        shed = moved.panels.grown(pose.points(body.shed), body.at_edge(flow.gamma))
        flow, lost = _aged(run, replace(moved, time=n * run.dt, panels=shed), batches)
        removed += lost
        if len(flow.particles) > run.wake.capacity:
            return Outcome.WAKE_FULL, None, removed
        flow, wind = _solved(run, flow, pose, thick)
        past = [flow.gamma, *past[:2]]
        air = _relative(run, pose, body.lattice.reference_point[None], flow.time)[0]
        beyond = _cut(run, pose, air, recorder.past(run.rows)) if n > run.rows else 0.0
        sides = _relative(run, pose, body.carrier.side_middle.reshape(-1, 3), flow.time) @ pose.rotation
        if not recorder.add(pose, air, wind, sides.reshape(-1, 2, 3), flow.gamma, _rate(past, run.dt), beyond):
            return Outcome.DIVERGED, None, removed
        if progress is not None:
            progress(n)
    return Outcome.OK, FinalWake(flow.panels, flow.particles, body.symmetric, pose.points(body.rings)), removed


def _solved(run: _Run, flow: Flow, pose: Pose, thick: FloatArray) -> tuple[Flow, FloatArray]:
    """The flow with its bound circulations, and the wind [p, 3] relative to the bound vortices in the frame of the geometry."""
    body, points = run.body, pose.points(run.body.points)
    wind = _relative(run, pose, body.points, flow.time)
    wind = wind + flow.panels.velocities(points, thick[: flow.panels.rows + 1], body.symmetric, run.threads)
    if len(flow.particles) > 0:
        # as for panels: free of the core's error in first order
        thicker = replace(flow.particles, core=2.0 * flow.particles.core)
        wind = wind + 2.0 * velocity_at(points, flow.particles, run.model) - velocity_at(points, thicker, run.model)
    relative = wind @ pose.rotation
    gamma = body.circulation(relative[: body.panels])
    return replace(flow, gamma=gamma), relative[body.panels :] + (body.vectors @ gamma).T


def _carried(run: _Run, flow: Flow) -> Flow:
    return free(flow, run.body, run.motion, run.wind, run.dt, run.core, run.model)


def _aged(run: _Run, flow: Flow, batches: list[_Batch]) -> tuple[Flow, int]:
    """The flow after old panels have become particles and the oldest part of the wake is cut off; number of particles lost."""
    if run.wake.kind == "prescribed":
        return replace(flow, panels=flow.panels.cut(run.rows)), 0
    if flow.panels.rows <= run.panel_rows:
        return flow, 0
    panels, new, closing = released(flow.panels, run.core, run.wake.spacing * run.chord)
    batches.append(_Batch(new.shape[1], closing))
    lost = batches.pop(0).count if len(batches) > run.rows - run.panel_rows else 0
    old = flow.particles
    sources = np.concatenate([np.vstack([old.position.T, old.strength.T, old.core]), new], axis=1)[:, lost:]
    if lost > 0 and not batches:
        panels = replace(panels, beyond=np.zeros(run.body.strips))
    elif lost > 0:
        sources[3:6, : len(batches[0].closing)] += batches[0].closing.T
    return replace(flow, panels=panels, particles=Particles(sources[:3].T, sources[3:6].T, sources[6])), lost


def _rate(past: list[FloatArray], dt: float) -> FloatArray:
    """Rate of change of the newest of two or three circulations: backward differences of first or second order."""
    if len(past) == 2:
        return np.asarray((past[0] - past[1]) / dt)
    return np.asarray((1.5 * past[0] - 2.0 * past[1] + 0.5 * past[2]) / dt)


def _relative(run: _Run, pose: Pose, points: FloatArray, time: float) -> FloatArray:
    """Undisturbed wind [p, 3] relative to points [p, 3] of the geometry, m/s."""
    return np.asarray(run.wind.velocity(pose.points(points), time) - pose.velocities(points))


def _cut(run: _Run, pose: Pose, air: FloatArray, old: FloatArray) -> float:
    """Largest change of incidence (rad) at the body by the wake behind the cut, if it went on with the circulation it has there."""
    body, shed = run.body, pose.points(run.body.shed)
    along = run.wake.cut * run.chord / max(float(np.linalg.norm(air)), 1e-300) * air
    beyond = Panels(body.edges, np.stack([shed + along, shed + FAR * along]), body.at_edge(old)[None], np.zeros(body.strips))
    points = pose.points(body.points[: body.panels])
    wind = beyond.velocities(points, np.zeros((2, body.edges.nodes)), body.symmetric, 1) @ pose.rotation
    return float(np.max(np.abs(np.einsum("pa,pa->p", wind, body.normal)))) / run.speed


def _positive(field: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise InputError(field, f"{value} is not a positive number")
