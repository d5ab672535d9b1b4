"""Sums over vortex particles against their definition, rates against exact flows, steps in time, cuts and outcomes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import special

from levelone.aerodynamics.invariants import invariants
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.particle_kernels import KERNELS, boys, direct_sums, gathered
from levelone.aerodynamics.particles import ParticleModel, Particles, cut, joined, step, velocity_at, with_images
from levelone.aerodynamics.rvpm import differenced, rates, uniform
from levelone.errors import InputError

STILL = uniform((0.0, 0.0, 0.0))


def cloud(n, seed=0, spread=0.2, strength=1.0):
    rng = np.random.default_rng(seed)
    core = spread * (1.0 + 0.4 * rng.random(n))
    return Particles(rng.normal(size=(n, 3)), strength * rng.normal(size=(n, 3)) / n, core)


def defined(points, particles, kernel):
    """The sum as it is written in the books, with SciPy's error function."""
    r = points[:, None] - particles.position
    distance = np.linalg.norm(r, axis=2)
    p = distance / particles.core
    if kernel == "winckelmans":
        g = p**3 * (p**2 + 2.5) / (p**2 + 1.0) ** 2.5
    else:
        g = special.erf(p / np.sqrt(2.0)) - np.sqrt(2.0 / np.pi) * p * np.exp(-0.5 * p**2)
    return np.einsum("pq,pqi->pi", g / (4.0 * np.pi * distance**3), np.cross(particles.strength, r))


def moved(particles, steps, dt, model, background=STILL):
    for i in range(steps):
        result = step(particles, background, dt, model, i * dt)
        assert result.outcome is Outcome.OK
        particles = result.particles
    return particles


@pytest.mark.oracle
@pytest.mark.parametrize("kernel", KERNELS)
def test_velocity_is_the_regularised_biot_savart_sum(kernel):
    particles, points = cloud(60), np.random.default_rng(1).normal(size=(40, 3))
    wanted = defined(points, particles, kernel)
    found = velocity_at(points, particles, ParticleModel(kernel))
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-10 * np.abs(wanted).max())


@pytest.mark.oracle
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("distance", [1e-3, 0.1, 0.9, 1.40, 1.42, 3.0, 8.0, 9.0, 50.0])
def test_stretching_is_the_derivative_of_the_velocity(kernel, distance):
    """At distances in cores on both sides of every switch of the approximation."""
    particles = Particles(np.zeros((1, 3)), np.array([[0.3, -0.5, 0.8]]), np.array([0.7]))
    h, x = np.array([[0.6, 0.2, -0.4]]), np.array([[0.48, 0.6, 0.64]]) * distance * 0.7
    model, d = ParticleModel(kernel), 1e-4 * 0.7 * max(distance, 0.1)
    ahead, behind, further, back = (velocity_at(x + k * d * h, particles, model) for k in (1, -1, 2, -2))
    wanted = (8.0 * (ahead - behind) - (further - back)) / (12.0 * d)
    found = direct_sums(x, h, gathered(particles.position, particles.strength, particles.core), kernel)[1]
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-7 * np.abs(wanted).max())


@pytest.mark.oracle
def test_boys_functions_against_scipy():
    x = np.concatenate([np.geomspace(1e-9, 1e6, 5001), [np.nextafter(1.0, 0.0), 1.0, 36.0, 63.99, 64.0, 64.01]])
    found = np.array([boys(v) for v in x]).T
    for m in (1, 2):
        a = m + 0.5
        np.testing.assert_allclose(found[m - 1], special.gamma(a) * special.gammainc(a, x) / (2.0 * x**a), rtol=1e-11)
    np.testing.assert_allclose(found[2], np.exp(-x), rtol=0.0, atol=2e-13)


@pytest.mark.theory
@pytest.mark.parametrize("kernel", KERNELS)
def test_far_away_and_at_home(kernel):
    """At 100 cores the law of Biot and Savart; at its own place a particle induces and stretches nothing, whoever shares it."""
    one = Particles(np.zeros((1, 3)), np.array([[0.0, 0.0, 2.0]]), np.array([0.01]))
    far = velocity_at(np.array([[1.0, 0.0, 0.0]]), one, ParticleModel(kernel))
    np.testing.assert_allclose(far, [[0.0, 2.0 / (4.0 * np.pi), 0.0]], rtol=1e-7, atol=0.0)
    u, s = direct_sums(np.zeros((1, 3)), one.strength, gathered(one.position, one.strength, one.core), kernel)
    assert not u.any()
    assert not s.any()


@pytest.mark.parametrize("kernel", KERNELS)
def test_threads_change_no_bit(kernel):
    particles = cloud(900)
    sources = gathered(particles.position, particles.strength, particles.core)
    one, three = (direct_sums(particles.position, particles.strength, sources, kernel, threads) for threads in (1, 3))
    np.testing.assert_array_equal(one, three)
    some = direct_sums(particles.position[100:107], particles.strength[100:107], sources, kernel)
    np.testing.assert_array_equal(some, [part[100:107] for part in one])


@pytest.mark.theory
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("formulation", ["classic", "reformulated"])
def test_half_of_a_symmetric_cloud_with_images_moves_like_the_whole(kernel, formulation):
    half = cloud(40, spread=0.5)
    half = Particles(half.position * (1.0, 0.3, 1.0) + (0.0, 1.5, 0.0), half.strength, half.core)
    model = ParticleModel(kernel, formulation, mirrored=True, relaxation=0.3)
    a = with_images(moved(half, 10, 0.1, model))
    b = moved(with_images(half), 10, 0.1, dataclasses.replace(model, mirrored=False))
    for name in ("position", "strength", "core"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0.0, atol=1e-13)
    mirror = with_images(Particles(b.position[:40], b.strength[:40], b.core[:40]))
    np.testing.assert_allclose(mirror.position, b.position, rtol=0.0, atol=1e-13)


@pytest.mark.theory
def test_image_induces_no_flow_through_the_plane_of_symmetry():
    points = np.random.default_rng(4).normal(size=(30, 3)) * (1.0, 0.0, 1.0)
    velocity = velocity_at(points, cloud(30), ParticleModel(mirrored=True))
    np.testing.assert_allclose(velocity[:, 1], 0.0, atol=1e-16)
    assert np.abs(velocity[:, [0, 2]]).max() > 1e-2


@pytest.mark.theory
def test_a_uniform_stream_only_carries_the_cloud():
    stream, n, dt = (6.0, -1.0, 0.5), 20, 0.05
    a = moved(cloud(50), n, dt, ParticleModel(), uniform(stream))
    b = moved(cloud(50), n, dt, ParticleModel())
    np.testing.assert_allclose(a.position - n * dt * np.array(stream), b.position, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(a.strength, b.strength, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(a.core, b.core, rtol=0.0, atol=1e-13)


@pytest.mark.theory
@pytest.mark.parametrize(("formulation", "strength", "core"), [("classic", 1.0, 0.0), ("reformulated", 0.4, -0.2)])
def test_axial_strain_has_an_exact_solution(formulation, strength, core):
    """u = a (x, -y/2, -z/2), strength along x: G grows like exp(a t) or exp(2/5 a t), the core like exp(-1/5 a t)."""
    a, dt, n = 0.8, 0.02, 50
    background = differenced(lambda points, time: a * points * (1.0, -0.5, -0.5), distance=0.01)
    one = Particles(np.array([[0.5, 0.2, -0.3]]), np.array([[0.7, 0.0, 0.0]]), np.array([0.1]))
    end = moved(one, n, dt, ParticleModel(formulation=formulation), background)
    t = n * dt
    np.testing.assert_allclose(end.position, one.position * np.exp(a * t * np.array([1.0, -0.5, -0.5])), rtol=1e-6)
    np.testing.assert_allclose(end.strength, one.strength * np.exp(strength * a * t), rtol=1e-6)
    np.testing.assert_allclose(end.core, one.core * np.exp(core * a * t), rtol=1e-6)


@pytest.mark.theory
def test_reformulated_rates_keep_strength_times_core_squared():
    particles, stretching = cloud(30), np.random.default_rng(2).normal(size=(30, 3))
    g, core = particles.strength, particles.core
    dg, dcore = rates(stretching, g, core, "reformulated")
    size = np.linalg.norm(g, axis=1)
    change = (dg * g).sum(axis=1) / size * core**2 + 2.0 * size * core * dcore
    np.testing.assert_allclose(change, 0.0, atol=1e-15)
    assert np.abs(dcore).max() > 0.1
    assert not rates(stretching, 0.0 * g, core, "reformulated")[1].any()


@pytest.mark.order
@pytest.mark.parametrize("formulation", ["classic", "reformulated"])
def test_time_stepping_is_of_third_order(formulation):
    """The whole state, in a background that changes with time, against a step 16 times finer."""
    start = cloud(30, spread=0.6, strength=4.0)

    def background(points, vectors, time):
        angle = np.cos(2.0 * time)
        return angle * points[:, [1, 2, 0]], angle * vectors[:, [1, 2, 0]]

    def end(steps):
        p = moved(start, steps, 1.6 / steps, ParticleModel(formulation=formulation), background)
        return np.concatenate([p.position, p.strength, p.core[:, None]], axis=1)

    exact = end(512)
    steps = np.array([8, 16, 32])
    error = [np.linalg.norm(end(int(n)) - exact) for n in steps]
    assert np.polyfit(np.log(steps), np.log(error), 1)[0] == pytest.approx(-3.0, abs=0.2)


@pytest.mark.theory
def test_relaxation_turns_strengths_to_the_vorticity_and_keeps_their_size():
    """On a line of overlapping particles the vorticity is along the line: tilted strengths come back to it."""
    x = np.linspace(-4.0, 4.0, 161)
    tilt = np.where(np.arange(161) % 2 == 0, 0.3, -0.3)
    strength = 1e-6 * np.stack([np.cos(tilt), np.sin(tilt), 0.0 * x], axis=1)
    line = Particles(np.stack([x, 0.0 * x, 0.0 * x], axis=1), strength, np.full(161, 0.2))
    end = moved(line, 10, 0.1, ParticleModel(relaxation=3.0))
    angle = np.arctan2(end.strength[:, 1], end.strength[:, 0])
    np.testing.assert_allclose(np.abs(angle[40:120]), 0.3 * 0.7**10, rtol=0.1)
    np.testing.assert_allclose(np.linalg.norm(end.strength, axis=1), 1e-6, rtol=1e-5)


def test_cut_counts_what_it_removes():
    particles = cloud(80)
    result = cut(particles, (-np.inf, -1.0, -1.0), (0.5, np.inf, 1.0))
    x = particles.position
    gone = (x[:, 0] > 0.5) | (x[:, 1] < -1.0) | (np.abs(x[:, 2]) > 1.0)
    assert result.removed == gone.sum() == 80 - len(result.particles)
    before = invariants(particles.position, particles.strength)
    after = invariants(result.particles.position, result.particles.strength)
    for name in ("strength", "impulse", "angular"):
        np.testing.assert_allclose(getattr(result.lost, name) + getattr(after, name), getattr(before, name), atol=1e-15)


def test_capacity_is_an_outcome():
    a, b = cloud(5, 1), cloud(4, 2)
    both = joined(a, b, capacity=9)
    assert both.outcome is Outcome.OK
    np.testing.assert_array_equal(both.particles.strength, np.concatenate([a.strength, b.strength]))
    full = joined(a, b, capacity=8)
    assert full.outcome is Outcome.WAKE_FULL
    assert np.isnan(full.particles.strength).all()


@pytest.mark.parametrize("tree_from", [1, 1000])
def test_divergence_is_an_outcome(tree_from):
    """A step far too long for the strain shrinks a core below zero; what follows stays NaN, and says so."""
    background = differenced(lambda points, time: 500.0 * points * (1.0, -0.5, -0.5), distance=0.01)
    model = ParticleModel(tree_from=tree_from)
    result = step(cloud(10), background, 0.1, model)
    assert result.outcome is Outcome.DIVERGED
    assert np.isnan(result.particles.position).all()
    assert step(result.particles, STILL, 0.1, model).outcome is Outcome.DIVERGED
    assert np.isnan(velocity_at(np.zeros((2, 3)), result.particles, model)).all()


def test_no_particles_induce_nothing_and_stay():
    none = Particles(np.empty((0, 3)), np.empty((0, 3)), np.empty(0))
    assert not velocity_at(np.ones((3, 3)), none, ParticleModel()).any()
    assert step(none, STILL, 0.1, ParticleModel()).outcome is Outcome.OK
    assert velocity_at(np.empty((0, 3)), cloud(4), ParticleModel(tree_from=1)).shape == (0, 3)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Particles(np.zeros((3, 2)), np.zeros((3, 3)), np.ones(3)), "particles.position"),
        (lambda: Particles(np.zeros((3, 3)), np.zeros((2, 3)), np.ones(3)), "particles.strength"),
        (lambda: Particles(np.zeros((3, 3)), np.zeros((3, 3)), np.array([1.0, 0.0, 1.0])), "particles.core"),
        (lambda: ParticleModel(kernel="winkelmans"), "particles.kernel"),
        (lambda: ParticleModel(formulation="reform"), "particles.formulation"),
        (lambda: ParticleModel(relaxation=-1.0), "particles.relaxation"),
        (lambda: ParticleModel(threads=0), "particles.threads"),
        (lambda: ParticleModel(tree_from=0), "particles.tree_from"),
        (lambda: step(cloud(3), STILL, 0.0, ParticleModel()), "dt"),
        (lambda: step(cloud(3), STILL, np.nan, ParticleModel()), "dt"),
        (lambda: step(cloud(3), STILL, 0.5, ParticleModel(relaxation=3.0)), "particles.relaxation"),
    ],
)
def test_bad_input_names_the_field(make, field):
    with pytest.raises(InputError) as error:
        make()
    assert error.value.field == field
    assert "allowed" in error.value.problem
