"""The tree against the direct sum: error, order of the expansion, determinism, targets elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from levelone.aerodynamics.particle_kernels import KERNELS, direct_sums, gathered
from levelone.aerodynamics.particles import ParticleModel, Particles, velocity_at
from levelone.aerodynamics.treecode import tree_sums

N, SAMPLE = 10_000, slice(None, None, 37)


def volume(seed=0):
    """Strengths of random direction in a box: nothing coherent adds up, the hardest case for an expansion."""
    rng = np.random.default_rng(seed)
    core = 1.5 * N ** (-1.0 / 3.0) * (0.7 + 0.6 * rng.random(N))
    return rng.random((N, 3)), rng.normal(size=(N, 3)) / N, core


def wake(seed=0):
    """A folded sheet twelve long and three wide, trailing and shed vorticity."""
    rng = np.random.default_rng(seed)
    x, y = 12.0 * rng.random(N), 3.0 * rng.random(N) - 1.5
    h = np.sqrt(36.0 / N)
    strength = np.stack([np.sign(y) * y**2, 0.5 * np.cos(2.0 * x), 0.1 * y], axis=1)
    return np.stack([x, y, 0.3 * np.sin(3.0 * y + x)], axis=1), strength * h**2, 1.5 * h * (0.9 + 0.2 * rng.random(N))


def relative(found, wanted):
    return [np.sqrt(((a - b) ** 2).sum() / (b**2).sum()) for a, b in zip(found, wanted, strict=True)]


@pytest.mark.oracle
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize(("make", "limit"), [(volume, 1e-3), (wake, 1e-4)])
def test_error_against_the_direct_sum(kernel, make, limit):
    position, strength, core = make()
    sources = gathered(position, strength, core)
    found = [part[SAMPLE] for part in tree_sums(position, strength, sources, kernel)]
    errors = relative(found, direct_sums(position[SAMPLE], strength[SAMPLE], sources, kernel))
    assert max(errors) < limit


@pytest.mark.order
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("cores", [0.001, 0.3])
def test_cells_are_expanded_to_second_order(kernel, cores):
    """One cell asked from further and further away: the relative error falls with the third power, in u and in (h . grad) u."""
    rng = np.random.default_rng(3)
    position, strength, way = rng.random((30, 3)) - 0.5, rng.random((30, 3)), np.array([0.48, -0.6, 0.64])
    distances = np.array([8.0, 16.0, 32.0, 64.0])
    errors = []
    for distance in distances:
        points, h = distance * way[None], np.array([[0.3, 0.9, -0.2]])
        sources = gathered(position, strength, np.full(30, cores * distance))
        errors.append(relative(tree_sums(points, h, sources, kernel, angle=1.0), direct_sums(points, h, sources, kernel)))
    assert np.polyfit(np.log(distances), np.log(errors), 1)[0] == pytest.approx([-3.0, -3.0], abs=0.3)


def test_threads_change_no_bit():
    position, strength, core = wake()
    sources = gathered(position, strength, core)
    one, three = (tree_sums(position, strength, sources, "winckelmans", threads) for threads in (1, 3))
    np.testing.assert_array_equal(one, three)


@pytest.mark.parametrize("kernel", KERNELS)
def test_points_elsewhere_and_images(kernel):
    """Velocity at a few points that are no particles, through the model that chooses the tree, with images."""
    particles = Particles(*wake())
    points = np.random.default_rng(5).random((50, 3)) * (14.0, 4.0, 1.0) - (1.0, 2.0, 0.5)
    tree, direct = (velocity_at(points, particles, ParticleModel(kernel, mirrored=True, tree_from=n)) for n in (1, 10**9))
    assert np.abs(tree - direct).max() < 2e-4 * np.abs(direct).max()
    assert (tree != direct).any()


@pytest.mark.parametrize("kernel", KERNELS)
def test_cells_of_unequal_cores_are_opened(kernel):
    """Every second core ten times the other: cells of both act as one only where that no longer matters."""
    position, strength, core = wake()
    core = np.where(np.arange(N) % 2 == 0, core, 10.0 * core)
    sources = gathered(position, strength, core)
    found = [part[SAMPLE] for part in tree_sums(position, strength, sources, kernel)]
    assert max(relative(found, direct_sums(position[SAMPLE], strength[SAMPLE], sources, kernel))) < 5e-4


def test_coincident_particles_and_particles_without_strength():
    position = np.repeat(np.random.default_rng(6).random((20, 3)), 60, axis=0)
    strength = np.zeros((1200, 3))
    strength[::7] = (0.1, -0.2, 0.3)
    sources = gathered(position, strength, np.full(1200, 0.2))
    found, wanted = (how(position, strength, sources, "winckelmans") for how in (tree_sums, direct_sums))
    assert max(relative(found, wanted)) < 1e-3
