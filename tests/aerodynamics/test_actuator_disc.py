"""Discs that shed rings: what a ring holds, and settled slipstreams against momentum theory."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from levelone.aerodynamics.actuator_disc import Disc, shed, stations
from levelone.aerodynamics.disc_rings import column, theory
from levelone.aerodynamics.disc_wake import Marching, settle
from levelone.aerodynamics.invariants import invariants
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.particles import ParticleModel, Particles, velocity_at
from levelone.aerodynamics.rvpm import uniform
from levelone.errors import InputError

TILTED = Disc((0.3, -0.2, 0.1), 0.7, 5.0, (0.6, 0.0, 0.8))
#: unit density, so that v_h = 1
UNIT = Disc((0.0, 0.0, 0.0), 1.0, 2.0 * math.pi)
COARSE = Marching(step=0.1, points=24, core=0.3, free=16, far=16, settle=32, window=8)
NOWHERE = np.empty((0, 3))


def inflow(stream, how=COARSE):
    """Mean inflow of the unit disc over that of momentum theory, without the core's error of first order."""
    found = []
    for march in (how, replace(how, core=0.5 * how.core, points=2 * how.points)):
        settled = settle([UNIT], stream, 1.0, march, NOWHERE)
        assert settled.outcome is Outcome.OK, settled.words
        found.append(settled.inflow.mean())
    return (2.0 * found[1] - found[0]) / theory(UNIT, np.array(stream), 1.0).induced


def test_a_ring_holds_the_impulse_of_the_thrust():
    ring = shed([TILTED], 1.2, 0.01, 12, 0.1)
    kept = invariants(ring.position, ring.strength)
    np.testing.assert_allclose(kept.strength, 0.0, atol=1e-15)
    np.testing.assert_allclose(kept.impulse, -TILTED.thrust * 0.01 / 1.2 * np.array(TILTED.axis), atol=1e-14)


def test_stations_average_a_disc():
    points, weights = stations(TILTED)
    away = points - np.array(TILTED.centre)
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(away @ np.array(TILTED.axis), 0.0, atol=1e-14)
    assert weights @ (away**2).sum(axis=1) == pytest.approx(0.5 * TILTED.radius**2, rel=1e-12)


@pytest.mark.theory
def test_a_column_is_a_row_of_rings():
    # the same half-infinite row as rings of particles, dense near its start and cut far away
    along, spacing, count = np.array([0.6, 0.0, -0.8]), 0.05, 4000
    ring = shed([replace(UNIT, radius=0.02, thrust=1.0)], 1.0, 1.0, 16, 1e-3)
    places = (np.arange(count) + 0.5)[:, None] * spacing * along
    position = (places[:, None] + ring.position).reshape(-1, 3)
    row = Particles(position, np.tile(ring.strength, (count, 1)), np.full(len(position), 1e-3))
    points = np.array([[1.0, 0.5, 0.3], [-0.4, 0.8, 0.2], [0.2, -0.7, -0.9]])
    wanted = velocity_at(points, row, ParticleModel(tree_from=10**9))
    moment = 0.5 * np.cross(ring.position, ring.strength).sum(axis=0)
    got = column(points, np.zeros(3), along, moment / spacing, 1e-3)
    np.testing.assert_allclose(got, wanted, rtol=2e-3, atol=2e-3 * np.abs(wanted).max())


def test_a_column_along_its_moment_is_a_sink():
    points = np.array([[0.3, -1.0, 0.4], [2.0, 1.0, -0.5]])
    got = column(points, np.zeros(3), np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, -2.5]), 0.2)
    distance = np.sqrt((points**2).sum(axis=1, keepdims=True) + 0.2**2)
    np.testing.assert_allclose(got, -2.5 / (4.0 * np.pi) * points / distance**3, rtol=1e-12)


@pytest.mark.theory
def test_a_column_ends_flat():
    # far ahead on its axis, a sink spread evenly over a disc: Q / (2 pi a^2) (1 - d / sqrt(d^2 + a^2))
    a, d = 0.4, 2.0
    got = column(np.array([[0.0, 0.0, d]]), np.zeros(3), np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, -3.0]), a / math.sqrt(2.0))
    assert got[0, 2] == pytest.approx(-3.0 / (2.0 * math.pi * a**2) * (1.0 - d / math.hypot(d, a)), rel=2 * (a / d) ** 4)


@pytest.mark.theory
def test_hover():
    assert inflow((0.0, 0.0, 0.0)) == pytest.approx(1.0, abs=0.03)


@pytest.mark.theory
def test_axial_climb():
    assert inflow((0.0, 0.0, -1.0)) == pytest.approx(1.0, abs=0.03)


@pytest.mark.theory
@pytest.mark.parametrize("speed", [0.42, 1.0])
def test_edgewise_flow(speed):
    assert inflow((speed, 0.0, 0.0)) == pytest.approx(1.0, abs=0.10)


@pytest.mark.theory
def test_the_slipstream_contracts_and_doubles_its_speed():
    how = replace(COARSE, core=0.2, points=36, free=32, settle=48, window=16)
    found = settle([UNIT], (0.0, 0.0, 0.0), 1.0, how, np.array([[0.0, 0.0, -2.2]]))
    # where it is narrowest: farther down rings roll up in pairs, which widens them
    assert found.radius[:, 0].min() == pytest.approx(math.sqrt(0.5), rel=0.04)
    assert -found.velocity.mean(axis=0)[0, 2] == pytest.approx(2.0, rel=0.06)


def test_a_mirrored_disc_is_two_discs():
    pair = [replace(UNIT, centre=(0.0, y, 0.0)) for y in (1.5, -1.5)]
    points, how = np.array([[1.0, 0.3, 0.5], [1.0, -0.3, 0.5]]), replace(COARSE, settle=6, window=2)
    whole = settle(pair, (0.5, 0.0, 0.0), 1.0, how, points)
    half = settle(pair[:1], (0.5, 0.0, 0.0), 1.0, how, points, mirrored=True)
    np.testing.assert_allclose(half.velocity, whole.velocity, atol=1e-9)
    np.testing.assert_allclose(half.velocity[:, 0], half.velocity[:, 1] * [1.0, -1.0, 1.0], atol=1e-12)


def test_threads_change_no_bit():
    how = replace(COARSE, settle=4, window=2)
    one, two = (settle([UNIT], (0.5, 0.0, 0.0), 1.0, how, np.ones((1, 3)), threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.velocity, two.velocity)
    np.testing.assert_array_equal(one.inflow, two.inflow)


def test_a_run_that_is_too_short_says_so():
    found = settle([UNIT], (0.0, 0.0, 0.0), 1.0, replace(COARSE, settle=0, window=8), NOWHERE)
    assert found.outcome is Outcome.NOT_CONVERGED
    assert "not settled" in found.words


def test_a_march_that_diverges_leaves_nan():
    def wild(points, vectors, time):
        return np.full_like(points, np.inf if time > 0.0 else 1.0), np.zeros_like(points)

    found = settle([UNIT], (0.0, 0.0, 0.0), 1.0, COARSE, np.ones((1, 3)), background=wild)
    assert found.outcome is Outcome.DIVERGED
    assert "step 1 of 40" in found.words
    assert all(np.isnan(each).all() for each in (found.velocity, found.inflow, found.radius, found.drift))


def test_a_background_moves_the_rings():
    how = replace(COARSE, settle=8, window=2)
    push = settle([UNIT], (0.0, 0.0, 0.0), 1.0, how, NOWHERE, background=uniform((0.5, 0.0, 0.0)))
    still = settle([UNIT], (0.0, 0.0, 0.0), 1.0, how, NOWHERE)
    assert push.drift[0, 0] - still.drift[0, 0] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"radius": 0.0}, "disc.radius"),
        ({"thrust": -1.0}, "disc.thrust"),
        ({"axis": (0.0, 0.0, 2.0)}, "disc.axis"),
        ({"centre": (0.0, math.nan, 0.0)}, "disc.centre"),
    ],
)
def test_bad_discs(change, field):
    with pytest.raises(InputError) as caught:
        replace(UNIT, **change)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("change", "field"),
    [({"step": 0.0}, "step"), ({"core": 2.0}, "core"), ({"points": 4}, "points"), ({"free": 1}, "free"), ({"window": 3}, "window")],
)
def test_bad_marches(change, field):
    with pytest.raises(InputError) as caught:
        replace(COARSE, **change)
    assert caught.value.field == f"marching.{field}"


@pytest.mark.parametrize(
    ("discs", "stream", "how", "mirrored", "field"),
    [
        ([], (0.0, 0.0, 0.0), COARSE, False, "discs"),
        ([UNIT], (0.0, 0.0, 0.0), COARSE, True, "disc.centre"),
        ([UNIT], (0.0, 0.0, 1.0), COARSE, False, "climb"),
        ([replace(UNIT, thrust=0.0)], (0.0, 0.0, 0.0), COARSE, False, "thrust"),
        ([UNIT], (0.0, 0.0, 0.0), replace(COARSE, points=400, free=200), False, "marching"),
    ],
)
def test_bad_runs(discs, stream, how, mirrored, field):
    with pytest.raises(InputError) as caught:
        settle(discs, stream, 1.0, how, NOWHERE, mirrored)
    assert caught.value.field == field
