"""Allocation and effectiveness: signs by hand, and each the other's inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vehicles import POSITION, SPIN, airframe

from levelone.errors import InputError
from levelone.vehicle import Rotors, allocation, effectiveness

ROTORS = airframe().rotors
SLOPE = st.floats(1.0, 50.0)


def with_(**changes) -> Rotors:
    return airframe(rotors=changes).rotors


@pytest.mark.theory
def test_signs_and_arms_of_one_rotor() -> None:
    """Thrust up at (x, y): Z = -1, L = -y, M = +x; torque of a rotor that turns clockwise from above yaws the nose left."""
    wrench = effectiveness(ROTORS)
    np.testing.assert_allclose(wrench[:3], np.tile([[0.0], [0.0], [-1.0]], 8), atol=1e-15)
    np.testing.assert_allclose(wrench[3:6], [-POSITION[:, 1], POSITION[:, 0], np.zeros(8)], atol=1e-15)
    np.testing.assert_allclose(wrench[6:11], 0.0, atol=1e-15)
    np.testing.assert_allclose(wrench[11], -SPIN, atol=1e-15)


def test_a_weak_rotor_loses_thrust_and_torque_alike() -> None:
    weak = effectiveness(with_(effectiveness=np.where(np.arange(8) == 2, 0.7, 1.0)))
    np.testing.assert_allclose(weak[:, 2], 0.7 * effectiveness(ROTORS)[:, 2])
    np.testing.assert_array_equal(weak[:, 3], effectiveness(ROTORS)[:, 3])


@given(SLOPE, st.floats(0.01, 1.0), st.floats(-0.15, 0.15), st.floats(0.0, 0.3))
@settings(max_examples=30, deadline=None)
def test_allocation_inverts_the_effectiveness(thrust: float, torque: float, offset: float, tilt: float) -> None:
    """Lift, roll, pitch and yaw come out one at a time, also for rotors off centre and tilted."""
    axis = np.stack([np.sin(tilt) * SPIN, np.zeros(8), -np.cos(tilt) * np.ones(8)], axis=1)
    rotors = with_(position=POSITION + np.array([offset, 0.0, -0.1]), axis=axis)
    wrench = effectiveness(rotors)
    controls = (thrust * wrench[:6] + torque * wrench[6:])[2:]
    controls[0] *= -1.0
    np.testing.assert_allclose(controls @ allocation(rotors, thrust, torque), np.eye(4), atol=1e-9)


def test_the_smallest_throttle_changes_are_chosen() -> None:
    """Least squares: nothing is spent on what the four commands do not feel."""
    B = allocation(ROTORS, 20.0, 0.4)
    random = np.random.default_rng(0).normal(size=8)
    silent = random - B @ np.linalg.pinv(B) @ random
    np.testing.assert_allclose(B.T @ silent, 0.0, atol=1e-12)


def test_a_layout_that_cannot_do_it_is_refused() -> None:
    with pytest.raises(InputError, match="cannot command lift, roll, pitch and yaw independently"):
        allocation(with_(position=POSITION * [0.0, 1.0, 1.0]), 20.0, 0.4)
    with pytest.raises(InputError, match="cannot command lift, roll, pitch and yaw independently"):
        allocation(with_(spin=np.ones(8)), 20.0, 0.4)
