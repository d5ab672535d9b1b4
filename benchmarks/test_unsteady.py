"""Speed of the time domain beside DUST and PteraSoftware, with the loads that it leads to.

``pytest benchmarks/test_unsteady.py -s``. CPU seconds, and the same as a multiple of a direct sum over 10,000 particles in the same
run, since the clock of a shared machine wanders. Nothing here passes or fails by a time: the lines printed are the result.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest

from levelone.aerodynamics import motion
from levelone.aerodynamics.extraction import derivative, harmonic
from levelone.aerodynamics.geometry import Geometry, Surface
from levelone.aerodynamics.lattice import Lattice, build
from levelone.aerodynamics.particle_kernels import direct_sums
from levelone.aerodynamics.unsteady import Wake, simulate

SPEED, CHORD, AMPLITUDE, K = 6.0, 0.26, math.radians(2.0), 0.2
OMEGA = 2.0 * K * SPEED / CHORD
ORIGIN = (0.0, 0.0, 0.0)
N = 10_000

pytestmark = pytest.mark.benchmark(timer=time.process_time)


def lattice_of(*surfaces: Surface) -> Lattice:
    return build(Geometry("benchmark", "", surfaces, 0.78, CHORD, 3.0, ORIGIN))


def wing(strips: int) -> Surface:
    return Surface("wing", ORIGIN, 1.5, CHORD, CHORD, chordwise=8, strips=strips)


TAIL = Surface("tail", (1.08, 0.0, 0.0), 0.3605, 0.13, 0.13, chordwise=4, strips=4)


def direct_sum() -> float:
    """CPU seconds of a direct sum over 10,000 particles."""
    points = np.random.default_rng(0).normal(size=(N, 3))
    sources = np.ascontiguousarray(np.concatenate([points.T, points.T, np.ones((1, N))]))
    start = time.process_time()
    direct_sums(points, points, sources, "winckelmans", threads=1)
    return time.process_time() - start


def measured(benchmark: Any, name: str, lattice: Lattice, share: float, steps: int, wake: Wake) -> None:
    """Time and derivatives of ``steps`` time steps of a ``share`` of a chord, both threads' CPU seconds together."""
    period = 2.0 * math.pi / OMEGA
    dt = period / round(period / (share * CHORD / SPEED))
    moving = motion.oscillation("pitch", AMPLITUDE, OMEGA, SPEED)
    simulate(lattice, moving, SPEED, dt, 6, wake)
    direct_sum()
    started = time.perf_counter()
    history = benchmark.pedantic(lambda: simulate(lattice, moving, SPEED, dt, steps, wake), rounds=2, iterations=1)
    wall, cpu = 0.5 * (time.perf_counter() - started), float(benchmark.stats.stats.min)
    fits = [derivative(harmonic(history.time, history.coefficients[:, i], OMEGA, tolerance=1.0), AMPLITUDE, K) for i in (0, 4)]
    lift, moment = (each.quadrature for each in fits)
    size = f"{len(lattice.bound)} panels, {steps} steps"
    cost = f"{cpu:.2f} CPU-s, {wall:.2f} s, {cpu / direct_sum():.1f} direct sums"
    print(f"\n{name}: {size}: {cost}; lift {lift:.3f}, moment {moment:.3f}")


def test_free_wake_of_wing_and_tail(benchmark: Any) -> None:
    """DUST: 14 CPU-s, 8.0 s on two threads; lift 11.03, moment -25.9. Converged: 8.2, -23.1."""
    measured(benchmark, "free wake, 12 c", lattice_of(wing(7), TAIL), 0.25, 94, Wake("free", cut=12.0))


def test_prescribed_wake_of_a_wing(benchmark: Any) -> None:
    """PteraSoftware: 145 CPU-s."""
    measured(benchmark, "prescribed wake, 30 c", lattice_of(wing(15)), 0.125, 378, Wake())
