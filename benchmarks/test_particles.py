"""Speed of the sums over vortex particles: direct sum against the measured peak of the core, tree against direct sum, memory.

``pytest benchmarks/test_particles.py -s``. CPU seconds of one thread; ratios are taken inside one run, since the clock of a shared
machine wanders. Nothing here passes or fails by a time: the lines printed are the result.
"""

from __future__ import annotations

import subprocess
import sys
import time
from typing import Any

import numba
import numpy as np
import pytest

from levelone.aerodynamics.particle_kernels import KERNELS, direct_sums, gathered
from levelone.aerodynamics.treecode import tree_sums

FLOPS_A_PAIR, N, CHAINS, LENGTH, ROUNDS = 62, 10_000, 10, 32, 10_000
WANTED = 0.30
MEMORY = """
import resource
import numpy as np
from levelone.aerodynamics.particles import ParticleModel, Particles, step
from levelone.aerodynamics.rvpm import uniform
rng = np.random.default_rng(0)
n = 100_000
cloud = Particles(rng.random((n, 3)) * (12.0, 3.0, 1.0), rng.normal(size=(n, 3)) / n, np.full(n, 0.05))
step(cloud, uniform((6.0, 0.0, 0.0)), 0.01, ParticleModel())
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)
"""

pytestmark = pytest.mark.benchmark(timer=time.process_time)


def fused_multiply_adds() -> Any:
    """A compiled loop of nothing but fused multiply-adds: enough independent chains to fill the pipelines, no memory."""
    chains = range(CHAINS)
    lines = [f"y{i} = v + {i}.0" for i in chains] + [f"y{i} = y{i} * v + c" for _ in range(LENGTH) for i in chains]
    body = "\n".join(f"            {line}" for line in ["v = x[j]", *lines, "out[j] = " + " + ".join(f"y{i}" for i in chains)])
    code = f"def loop(x, out, rounds, c):\n    for _ in range(rounds):\n        for j in range(x.shape[0]):\n{body}\n"
    space: dict[str, Any] = {}
    exec(code, space)
    return numba.njit(fastmath={"contract"})(space["loop"])


def peak() -> float:
    """Floating-point operations per CPU second of one core: the best of a few runs."""
    loop, x, out = fused_multiply_adds(), np.linspace(0.1, 0.9, 512), np.empty(512)
    loop(x, out, 1, 0.1)
    seconds = min(measured(lambda: loop(x, out, ROUNDS, 0.1)) for _ in range(4))
    return 2.0 * CHAINS * LENGTH * 512 * ROUNDS / seconds


def measured(work: Any) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def wake(n: int) -> tuple[Any, Any, Any]:
    """Points, strengths and sources of a folded sheet, twelve long and three wide, of overlapping particles."""
    rng, h = np.random.default_rng(0), np.sqrt(36.0 / n)
    x, y = 12.0 * rng.random(n), 3.0 * rng.random(n) - 1.5
    position = np.stack([x, y, 0.3 * np.sin(3.0 * y + x)], axis=1)
    strength = h**2 * np.stack([np.sign(y) * y**2, 0.5 * np.cos(2.0 * x), 0.1 * y], axis=1)
    return position, strength, gathered(position, strength, np.full(n, 1.5 * h))


def volume(n: int) -> tuple[Any, Any, Any]:
    """The same for strengths of random direction in a box: the least favourable cloud for a tree."""
    rng = np.random.default_rng(0)
    position, strength = rng.random((n, 3)), rng.normal(size=(n, 3)) / n
    return position, strength, gathered(position, strength, np.full(n, 1.5 * n ** (-1.0 / 3.0)))


@pytest.mark.parametrize("kernel", KERNELS)
def test_direct_sum_against_the_peak(benchmark: Any, kernel: str) -> None:
    points, vectors, sources = wake(N)
    direct_sums(points[:8], vectors[:8], sources, kernel)
    top = peak()
    benchmark.pedantic(lambda: direct_sums(points, vectors, sources, kernel, threads=1), rounds=4, iterations=1)
    pairs = N * N / float(benchmark.stats.stats.min)
    share = pairs * FLOPS_A_PAIR / top
    print(
        f"\n{kernel:14s} N {N}: {pairs / 1e6:.0f} M pairs/s a core, {share:.0%} of {top / 1e9:.1f} Gflop/s (wanted: {WANTED:.0%})"
    )


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("make", [wake, volume])
@pytest.mark.parametrize("n", [2_000, 4_000, 8_000, 16_000, 40_000, 100_000])
def test_tree_against_the_direct_sum(benchmark: Any, kernel: str, make: Any, n: int) -> None:
    """The direct sum is asked at up to 2000 of the particles, and its time scaled up."""
    points, vectors, sources = make(n)
    tree_sums(points[:8], vectors[:8], sources, kernel)
    some = np.random.default_rng(1).choice(n, min(n, 2000), replace=False)
    wanted = direct_sums(points[some], vectors[some], sources, kernel)
    direct = measured(lambda: direct_sums(points[some], vectors[some], sources, kernel, threads=1)) * n / len(some)
    found = benchmark.pedantic(lambda: tree_sums(points, vectors, sources, kernel, threads=1), rounds=2, iterations=1)
    tree = float(benchmark.stats.stats.min)
    u, s = (np.sqrt(((a[some] - b) ** 2).sum() / (b**2).sum()) for a, b in zip(found, wanted, strict=True))
    what = f"{kernel:14s} {make.__name__:7s} N {n:6d}"
    print(f"\n{what}: direct {direct:6.2f}, tree {tree:6.2f} CPU-s ({direct / tree:5.1f} x); error u {u:.1e}, stretching {s:.1e}")


def test_memory_of_a_hundred_thousand_particles() -> None:
    used = float(subprocess.run([sys.executable, "-c", MEMORY], capture_output=True, text=True, check=True).stdout)
    print(f"\nstep of 100,000 particles: {used:.2f} GiB with everything imported (wanted: 1)")
    assert used < 1.0
