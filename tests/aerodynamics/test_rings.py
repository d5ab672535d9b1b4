"""Vortex rings: speed, leapfrogging, and what free rings conserve."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelone.aerodynamics.invariants import invariants
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.particles import ParticleModel, Particles, step, velocity_at
from levelone.aerodynamics.rvpm import uniform

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "aerodynamics.toml").read_text(encoding="utf-8"))["particles"]
STILL = uniform((0.0, 0.0, 0.0))


def ring(n, radius, height, core, mode=0, amplitude=0.0):
    """A ring of unit circulation about the z axis, its radius waved ``mode`` times; it moves upwards."""
    t = 2.0 * np.pi * np.arange(n) / n
    r, slope = radius * (1.0 + amplitude * np.cos(mode * t)), -radius * amplitude * mode * np.sin(mode * t)
    position = np.stack([r * np.cos(t), r * np.sin(t), height + 0.0 * t], axis=1)
    tangent = np.stack([slope * np.cos(t) - r * np.sin(t), slope * np.sin(t) + r * np.cos(t), 0.0 * t], axis=1)
    return Particles(position, tangent * (2.0 * np.pi / n), np.full(n, core))


def together(*clouds):
    return Particles(*(np.concatenate([getattr(c, name) for c in clouds]) for name in ("position", "strength", "core")))


def run(particles, steps, dt, model):
    yield particles
    for _ in range(steps):
        result = step(particles, STILL, dt, model)
        assert result.outcome is Outcome.OK
        particles = result.particles
        yield particles


def passages(formulation, end=9.0, dt=0.025):
    """Times at which one of two equal rings passes through the other."""
    given = REFERENCE["leapfrog"]
    n, size, gap, core = 100, given["R"], given["dZ"], given["core"]
    rings = together(ring(n, size, 0.0, core), ring(n, size, gap, core))
    model = ParticleModel(given["kernel"], formulation)
    ahead = [p.position[n:, 2].mean() - p.position[:n, 2].mean() for p in run(rings, round(end / dt), dt, model)]
    found = [i for i in range(len(ahead) - 1) if ahead[i] * ahead[i + 1] < 0.0]
    return dt * np.array([i + ahead[i] / (ahead[i] - ahead[i + 1]) for i in found])


@pytest.mark.theory
@pytest.mark.parametrize("formulation", ["classic", "reformulated"])
@pytest.mark.parametrize(("kernel", "key"), [("winckelmans", "speed_winckelmans"), ("gaussian-erf", "speed_gaussian_erf")])
def test_speed_of_a_ring(kernel, key, formulation):
    given = REFERENCE["ring"]
    start = ring(given["particles"], given["R"], 0.0, given["core"])
    *_, end = run(start, 20, 0.1, ParticleModel(kernel, formulation))
    speed = (end.position[:, 2].mean() - start.position[:, 2].mean()) / 2.0
    assert speed == pytest.approx(given[key], rel=given["tolerance"])
    assert np.ptp(end.position[:, 2]) < 1e-13


@pytest.mark.theory
@pytest.mark.parametrize(
    ("kernel", "constant"), [("winckelmans", -0.5), ("gaussian-erf", -1.0 + 0.5 * (np.euler_gamma - np.log(2.0)))]
)
def test_speed_of_a_thin_ring(kernel, constant):
    """Gamma / (4 pi R) (ln(8 R / core) + constant); constant = -1 + int_0^inf (g(p) - p^3 / (p^2 + 1)^(3/2)) dp / p."""
    core = 0.02
    start = ring(800, 1.0, 0.0, core)
    speed = velocity_at(start.position[:1], start, ParticleModel(kernel))[0, 2]
    assert speed == pytest.approx((np.log(8.0 / core) + constant) / (4.0 * np.pi), rel=5e-4)


@pytest.mark.theory
def test_leapfrogging_rings():
    first, second = passages("classic")
    assert first == pytest.approx(REFERENCE["leapfrog"]["first_passage"], rel=0.03)
    assert second - first == pytest.approx(REFERENCE["leapfrog"]["repeats_every"], rel=0.03)


@pytest.mark.pin
def test_reformulated_rings_one_particle_thick_leapfrog_too_early():
    """Strength grows like stretch^(2/5), so circulation falls where such a ring is stretched: 9 % early, as the docs say."""
    first, second = passages("reformulated")
    assert first == pytest.approx(1.986, abs=0.002)
    assert second - first == pytest.approx(3.971, abs=0.004)


@pytest.mark.theory
@pytest.mark.parametrize(
    ("kernel", "formulation", "limits"),
    [
        ("winckelmans", "classic", (5e-4, 1e-3, 1e-3)),
        ("gaussian-erf", "classic", (1e-5, 1e-5, 1e-5)),
        ("winckelmans", "reformulated", (0.03, 0.06, 0.04)),
        ("gaussian-erf", "reformulated", (0.03, 0.06, 0.04)),
    ],
)
def test_what_two_rings_conserve(kernel, formulation, limits):
    """Two waved, tilted, unequal rings that meet: changes by t = 1.5 in parts of sum |G|, |impulse| and R |impulse|."""
    b = ring(80, 0.7, 0.4, 0.15, 3, 0.15)
    turn = Rotation.from_rotvec(0.5 * np.array([0.6, 0.8, 0.0]))
    b = Particles(turn.apply(b.position) + np.array([0.2, 0.1, 0.3]), 1.3 * turn.apply(b.strength), b.core)
    start = together(ring(80, 1.0, 0.0, 0.15, 2, 0.1), b)
    *_, end = run(start, 60, 0.025, ParticleModel(kernel, formulation))
    before, after = (invariants(p.position, p.strength) for p in (start, end))
    size = np.linalg.norm(before.impulse)
    scales = (np.linalg.norm(start.strength, axis=1).sum(), size, size)
    for name, limit, scale in zip(("strength", "impulse", "angular"), limits, scales, strict=True):
        assert np.linalg.norm(getattr(after, name) - getattr(before, name)) < limit * scale, name
    kept = np.linalg.norm(end.strength, axis=1) * end.core**2
    if formulation == "reformulated":
        np.testing.assert_allclose(kept, np.linalg.norm(start.strength, axis=1) * start.core**2, rtol=1e-4)
    else:
        np.testing.assert_array_equal(end.core, start.core)


@pytest.mark.theory
def test_invariants_of_a_ring():
    """Impulse pi R^2 along the axis; strength and angular impulse zero; off the origin the angular impulse is (x x I)."""
    n = 200
    r, shift = ring(n, 1.5, 0.0, 0.1), np.array([0.3, -0.2, 0.9])
    found, moved = invariants(r.position, r.strength), invariants(r.position + shift, r.strength)
    np.testing.assert_allclose(found.impulse, [0.0, 0.0, np.pi * 1.5**2], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.strength, 0.0, atol=1e-13)
    np.testing.assert_allclose(found.angular, 0.0, atol=1e-12)
    np.testing.assert_allclose(moved.impulse, found.impulse, atol=1e-12)
    np.testing.assert_allclose(moved.angular, np.cross(shift, found.impulse), atol=1e-12)
