"""Loads of a lattice in a wind that changes from place to place: limits that are known, and symmetry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from levelone.aerodynamics import frequency, wing_in_wake
from levelone.aerodynamics.geometry import Geometry, Surface
from levelone.aerodynamics.kernels import velocities
from levelone.aerodynamics.lattice import build, rings

WING = Surface("wing", (0.0, 0.0, 0.0), 1.5, 0.26, 0.26, incidence=0.08, chordwise=4, strips=6)
TAIL = Surface("tail", (1.0, 0.0, 0.1), 0.4, 0.13, 0.13, chordwise=2, strips=3)
SHAPE = Geometry("both", "", (WING, TAIL), 0.78, 0.26, 3.0, (0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def plant():
    return frequency.prepare(build(SHAPE))


@pytest.fixture(scope="module")
def points(plant):
    return wing_in_wake.points(plant)


def test_without_wind_it_is_the_steady_lattice(plant, points):
    found = wing_in_wake.steady_in(plant, np.zeros_like(points))
    np.testing.assert_allclose(found.whole, frequency.steady(plant), atol=1e-13)
    np.testing.assert_allclose(found.gamma, plant.mean, atol=1e-14)
    np.testing.assert_allclose(found.surfaces.sum(axis=0), found.whole, atol=1e-14)


def test_a_faster_stream_has_its_own_dynamic_pressure(plant, points):
    found = wing_in_wake.steady_in(plant, np.broadcast_to([0.2, 0.0, 0.0], points.shape))
    np.testing.assert_allclose(found.whole, 1.2**2 * frequency.steady(plant), atol=1e-12)


def test_a_uniform_upwash_is_incidence(plant, points):
    change = 1e-6
    wind = np.broadcast_to([0.0, 0.0, change], points.shape)
    slope = (wing_in_wake.steady_in(plant, wind).whole - frequency.steady(plant)) / change
    alpha = frequency.oscillate(plant, np.zeros(1), ("alpha",), np.zeros(3))[0, 0].real
    # the derivative is in wind axes, which turn with the incidence
    assert slope[0] == pytest.approx(alpha[0] + frequency.steady(plant)[1], rel=1e-5)
    assert slope[4] == pytest.approx(alpha[4], rel=1e-5)


def test_wind_on_one_side_and_its_mirror_image(plant, points):
    wind = 0.1 * np.exp(-((points[:, 1:2] - 0.7) ** 2)) * [0.2, 0.3, 1.0]
    mirrored = 0.1 * np.exp(-((points[:, 1:2] + 0.7) ** 2)) * [0.2, -0.3, 1.0]
    right, left = (wing_in_wake.steady_in(plant, each).whole for each in (wind, mirrored))
    np.testing.assert_allclose(right[[0, 1, 4]], left[[0, 1, 4]], rtol=1e-10)
    np.testing.assert_allclose(right[[2, 3, 5]], -left[[2, 3, 5]], rtol=1e-8)
    assert abs(right[3]) > 1e-3


def test_one_half_by_itself_agrees_with_both(points, plant):
    # the same wing as two surfaces that are not mirrored is solved without folding
    lattice = replace(plant.lattice, mirrored=False)
    wind = 0.1 * np.exp(-((points[:, 1:2] - 0.7) ** 2)) * [0.2, 0.3, 1.0]
    folded, whole = (wing_in_wake.steady_in(each, wind) for each in (plant, frequency.prepare(lattice)))
    np.testing.assert_allclose(folded.gamma, whole.gamma, atol=1e-12)
    np.testing.assert_allclose(folded.whole, whole.whole, atol=1e-12)


def test_a_wind_that_is_undefined_leaves_nan(plant, points):
    wind = np.zeros_like(points)
    wind[3, 1] = np.nan
    found = wing_in_wake.steady_in(plant, wind)
    assert np.isnan(found.whole).all()
    assert np.isnan(found.surfaces).all()


def test_the_background_is_the_wing_from_afar(plant):
    gamma, lattice = 5.0 * plant.mean, plant.lattice
    at = np.array([[-0.5, 0.4, -0.3], [0.1, -0.9, 0.5], [0.5, 0.2, -0.6]])
    background = wing_in_wake.as_background(plant, gamma, 0.06, 40.0)
    got, _ = background(at, np.zeros_like(at), 0.0)
    shed = plant.lines
    wake = np.stack([shed[:, 0], shed[:, 1], shed[:, 1] + [40.0, 0.0, 0.0], shed[:, 0] + [40.0, 0.0, 0.0]], axis=1)
    bound = velocities(at, rings(lattice, (plant.rows > 0).astype(float)), gamma)
    wanted = bound + velocities(at, np.ascontiguousarray(wake), gamma[lattice.trailing])
    np.testing.assert_allclose(got, wanted, atol=0.01 * np.abs(wanted).max())
