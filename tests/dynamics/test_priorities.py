"""The mixer under saturation: pitch and roll before collective, collective before yaw, throttles inside their limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vehicles import POSITION, vehicle

from levelone.dynamics import Trim, trim
from levelone.dynamics.controller import COMMANDS, MODES, Law, control
from levelone.dynamics.trim import law_of
from levelone.vehicle import PID, SENSOR_CHANNELS

#: rate loops of pure gain one, so that a commanded rate is the angular acceleration asked for
PURE = dict.fromkeys(("roll_rate", "pitch_rate", "yaw_rate", "vertical"), PID(1.0, 0.0, 0.0, 0.02, 1e6))
CRAFT = vehicle(law={**PURE, "altitude": 0.0, "heading": 0.0, "rate_limit": 1e6, "climb_limit": 1e6})
LAW, HOVER = law_of(CRAFT), trim(CRAFT, 0.0)
SMALL, LARGE = st.floats(-3.0, 3.0), st.floats(-60.0, 60.0)
INERTIA = np.array([7.0, 1.2, 0.7237, 1.8])


class Sent(NamedTuple):
    """Wanted and delivered (lift, roll, pitch, yaw) on top of hover, the throttles, and whether the mixer saturated."""

    wanted: np.ndarray
    got: np.ndarray
    throttle: np.ndarray
    saturated: bool


def sent(lift: float, roll: float, pitch: float, yaw: float, law: Law = LAW, start: Trim = HOVER) -> Sent:
    """One control period in rate mode that asks for these accelerations, m/s^2 and rad/s^2."""
    command, y = np.zeros(len(COMMANDS)), np.zeros(len(SENSOR_CHANNELS))
    for name, value in (("V_vert", lift), ("p", roll), ("q", pitch), ("yaw_rate", yaw)):
        command[COMMANDS.index(name)] = value
    throttle = np.empty(8)
    saturated = control(law, MODES.index("rate"), command, 0.0, 0.0, y, start.memory[0].copy(), throttle)
    got = np.linalg.pinv(law.allocation) @ (throttle - start.throttle[0])
    return Sent(INERTIA * [lift, roll, pitch, yaw], got, throttle, bool(saturated))


@given(SMALL, SMALL, SMALL, st.floats(-0.2, 0.2))
@settings(max_examples=40, deadline=None)
def test_small_demands_are_met(lift: float, roll: float, pitch: float, yaw: float) -> None:
    wanted, got, throttle, saturated = sent(0.5 * lift, roll, pitch, yaw)
    assert not saturated
    np.testing.assert_allclose(got, wanted, atol=1e-9)
    assert throttle.min() >= 0.02
    assert throttle.max() <= 1.0


@given(LARGE, LARGE, LARGE, LARGE)
@settings(max_examples=80, deadline=None)
def test_large_demands_keep_the_order_of_priority(lift: float, roll: float, pitch: float, yaw: float) -> None:
    wanted, got, throttle, saturated = sent(lift, roll, pitch, yaw)
    assert throttle.min() >= 0.02
    assert throttle.max() <= 1.0
    share = (got[1:3] @ wanted[1:3]) / max(wanted[1:3] @ wanted[1:3], 1e-30)
    # roll and pitch keep their direction; they are scaled only if by themselves they exceed the whole range of throttle
    np.testing.assert_allclose(got[1:3], share * wanted[1:3], atol=1e-8)
    if np.hypot(*wanted[1:3]) > 1e-6:
        spread = np.ptp(LAW.allocation[:, 1:3] @ wanted[1:3])
        assert share == pytest.approx(min(1.0, 0.98 / spread), rel=1e-6)
    # yaw gets what is left, never against its demand nor more than it
    assert got[3] * wanted[3] >= -1e-12
    assert abs(got[3]) <= abs(wanted[3]) + 1e-9
    if not saturated:
        np.testing.assert_allclose(got, wanted, rtol=1e-7, atol=1e-8)


def test_yaw_gives_way_before_lift() -> None:
    """Full lift leaves no room for yaw; roll stays exact and lift gives way to it."""
    wanted, got, throttle, saturated = sent(60.0, 2.0, 0.0, 3.0)
    assert saturated
    assert throttle.max() == 1.0
    np.testing.assert_allclose(got[1:3], wanted[1:3], atol=1e-9)
    assert got[0] < wanted[0]
    assert got[3] == pytest.approx(0.0, abs=1e-9)


def test_lift_moves_the_least_that_roll_needs() -> None:
    """At the largest roll that fits, the highest rotor sits at its limit and lift falls by what the roll needs, no more."""
    wanted, got, throttle, saturated = sent(0.0, 30.0, 0.0, 0.0)
    assert saturated
    np.testing.assert_allclose(got[1], wanted[1], rtol=1e-9)
    assert throttle.max() == pytest.approx(1.0, abs=1e-12)
    assert got[0] < 0.0


def test_off_centre_rotors_keep_pitch_and_roll_too() -> None:
    """Centre of gravity 0.1 m behind the middle of the rotors: equal throttle is not pure lift, the allocation's column is."""
    law = {**PURE, "altitude": 0.0, "heading": 0.0, "rate_limit": 1e6, "climb_limit": 1e6}
    craft = vehicle(law=law, rotors={"position": POSITION + np.array([0.1, 0.0, 0.0])})
    wanted, got, throttle, saturated = sent(0.0, 18.0, 3.0, 0.0, law_of(craft), trim(craft, 0.0))
    assert saturated
    assert throttle.max() <= 1.0
    np.testing.assert_allclose(got[1:3], wanted[1:3], atol=1e-8)
