"""Motions against the relative wind of the linear solution, their velocities against differences, and gusts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.aerodynamics import gust, modes, motion
from levelone.errors import InputError

POINTS = np.random.default_rng(3).normal(size=(7, 3))
CENTRE = np.array([0.2, 0.1, -0.3])
SPEED, OMEGA = 3.0, 2.0
KINDS = (*modes.LONGITUDINAL, *modes.LATERAL)
times = st.floats(0.0, 5.0)


def relative_wind(pose, points):
    """Wind relative to points, in the frame of the geometry, for a stream of SPEED along +x."""
    return (np.array([SPEED, 0.0, 0.0]) - pose.velocities(points)) @ pose.rotation


def motions():
    swings = [motion.oscillation(kind, 0.3, OMEGA, SPEED, CENTRE, incidence=0.1) for kind in KINDS]
    return [*swings, motion.ramp(0.4, 2.0, CENTRE), motion.step(0.1, SPEED), motion.flying(swings[0], (-1.0, 0.5, 0.2))]


@pytest.mark.theory
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("quarter", [0.0, 1.0])
def test_a_small_oscillation_gives_the_wind_of_the_linear_solution(kind, quarter):
    amplitude, t = 1e-6, quarter * 0.5 * np.pi / OMEGA
    pose = motion.oscillation(kind, amplitude, OMEGA, SPEED, CENTRE).pose(t)
    wind = (relative_wind(pose, POINTS) / SPEED - [1.0, 0.0, 0.0]) / amplitude
    linear = modes.relative_wind(kind, POINTS, CENTRE, OMEGA / SPEED)
    assert np.allclose(wind, linear.imag if quarter == 0.0 else linear.real, atol=1e-5)


@given(t=times)
def test_velocities_are_the_rates_of_positions(t):
    for each in motions():
        before, after = each.pose(t), each.pose(t + 1e-5)
        middle = each.pose(t + 0.5e-5)
        moved = (after.points(POINTS) - before.points(POINTS)) / 1e-5
        assert np.allclose(moved, middle.velocities(POINTS), atol=1e-8), each.name


@given(t=times)
def test_bodies_stay_rigid(t):
    for each in motions():
        assert np.allclose(each.pose(t).rotation @ each.pose(t).rotation.T, np.eye(3), atol=1e-14)


@pytest.mark.theory
@pytest.mark.parametrize(("kind", "axis"), [("pitch", (0.0, 0.0, -1.0)), ("roll", (0.0, 0.0, -1.0)), ("yaw", (0.0, 1.0, 0.0))])
def test_angles_are_positive_in_the_sense_of_the_pilot(kind, axis):
    """Nose up: the tail (+x) goes down; right wing down: so does +y; nose right: the nose (-x) goes to +y."""
    pose = motion.oscillation(kind, 0.1, OMEGA, SPEED).pose(0.5 * np.pi / OMEGA)
    arm = {"pitch": [1.0, 0.0, 0.0], "roll": [0.0, 1.0, 0.0], "yaw": [-1.0, 0.0, 0.0]}[kind]
    assert pose.points(np.array(arm)) @ np.array(axis) == pytest.approx(np.sin(0.1), rel=1e-12)


@pytest.mark.theory
def test_a_pure_rate_keeps_its_incidence_to_third_order():
    pose = motion.oscillation("rate", 0.1, OMEGA, SPEED, CENTRE).pose(0.5 * np.pi / OMEGA)
    wind = relative_wind(pose, CENTRE[None])[0]
    assert abs(np.arctan2(wind[2], wind[0])) == pytest.approx(0.1**3 / 3.0, rel=0.02)


@pytest.mark.theory
def test_heave_and_step_give_their_incidence():
    heave = relative_wind(motion.oscillation("heave", 0.1, OMEGA, SPEED).pose(0.5 * np.pi / OMEGA), CENTRE[None])[0]
    plunge = relative_wind(motion.step(0.1, SPEED).pose(1.0), CENTRE[None])[0]
    for wind in (heave, plunge):
        assert np.allclose(wind, [SPEED, 0.0, 0.1 * SPEED], rtol=1e-12)


def test_sideslip_is_positive_with_the_wind_from_the_right():
    for each in (motion.steady(sideslip=0.1), motion.oscillation("sideslip", 0.1, OMEGA, SPEED)):
        assert relative_wind(each.pose(0.5 * np.pi / OMEGA), CENTRE[None])[0, 1] < -0.29


def test_motions_in_the_plane_of_symmetry_are_known_as_such():
    for kind in KINDS:
        swing = motion.oscillation(kind, 0.1, OMEGA, SPEED, (0.1, 0.0, 0.2))
        assert swing.pose(0.3).symmetric == (kind in modes.LONGITUDINAL)


def test_ramp_ends_at_its_angle_and_rests():
    pose = motion.ramp(0.2, 1.0, CENTRE).pose(1.5)
    assert np.arcsin(pose.rotation[0, 2]) == pytest.approx(0.2, rel=1e-12)
    assert np.array_equal(pose.velocities(POINTS), np.zeros_like(POINTS))


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: motion.oscillation("pich", 0.1, 1.0, 1.0), "motion"),
        (lambda: motion.oscillation("pitch", 0.1, 0.0, 1.0), "omega"),
        (lambda: motion.oscillation("heave", 0.1, 1.0, -1.0), "speed"),
        (lambda: motion.oscillation("heave", np.nan, 1.0, 1.0), "amplitude"),
        (lambda: motion.ramp(0.1, 0.0), "duration"),
        (lambda: motion.step(np.inf, 1.0), "incidence"),
        (lambda: gust.uniform((1.0, 0.0)), "velocity"),
        (lambda: gust.sharp_edged_gust((1.0, 0.0, 0.0), (0.0, 0.0, np.nan), 0.0), "gust"),
        (lambda: gust.one_minus_cosine((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0, 0.0), "length"),
    ],
)
def test_bad_values_are_named(call, field):
    with pytest.raises(InputError, match=rf"^{field}: "):
        call()


def test_gusts_travel_with_the_stream():
    x = np.array([[-2.0, 0.0, 0.0], [-0.5, 1.0, 0.0], [0.5, 0.0, 1.0]])
    sharp = gust.sharp_edged_gust((2.0, 0.0, 0.0), (0.0, 0.0, 0.3), -1.0)
    cosine = gust.one_minus_cosine((2.0, 0.0, 0.0), (0.0, 0.0, 0.3), -1.0, 2.0)
    assert np.array_equal(sharp.velocity(x, 0.0)[:, 2], [0.3, 0.0, 0.0])
    assert np.array_equal(sharp.velocity(x, 0.5)[:, 2], [0.3, 0.3, 0.0])
    assert np.allclose(cosine.velocity(x, 0.0)[:, 2], [0.3, 0.0, 0.0], atol=1e-15)
    assert np.allclose(cosine.velocity(x, 0.5)[:, 2], [0.0, 0.15, 0.0], atol=1e-15)
    assert np.array_equal(sharp.velocity(x, 0.5)[:, 0], [2.0, 2.0, 2.0])


def test_only_a_wind_without_sideways_part_is_symmetric():
    assert gust.uniform((1.0, 0.0, 0.3)).symmetric
    assert not gust.uniform((1.0, 0.1, 0.0)).symmetric
    assert not gust.sharp_edged_gust((1.0, 0.0, 0.0), (0.0, 0.2, 0.0), 0.0).symmetric
