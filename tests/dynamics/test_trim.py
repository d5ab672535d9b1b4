"""Trim: residuals, attitudes by hand, failures as data."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vehicles import AERO, K_T, rotor, vehicle

from levelone.dynamics import Command, State, derivative, simulate, trim
from levelone.errors import InputError
from levelone.handling.manoeuvres import Manoeuvre, step
from levelone.status import Status
from levelone.vehicle import PID, Vehicle, vary

CRAFT = vehicle()
#: drag enough, and lift that grows slowly enough with incidence, for a steady descent at every speed
DRAGGY = vehicle(aero={"C_D0": 0.2, "C_Lalpha": 2.5})
WEIGHT, CHORD = 7.0 * 9.80665, 0.26


def residuals(craft: Vehicle, result, wind) -> tuple[float, float]:
    """Largest force over weight and moment over weight times chord, from the public derivative."""
    rate = np.array(derivative(craft, State(*result.state[0]), Command(tuple(result.throttle[0])), wind))
    m = craft.airframe.mass
    moment = np.array([m.I_xx * rate[10] - m.I_xz * rate[12], m.I_yy * rate[11], m.I_zz * rate[12] - m.I_xz * rate[10]])
    return np.abs(m.mass * rate[3:6]).max() / WEIGHT, np.abs(moment).max() / (WEIGHT * CHORD)


@pytest.mark.theory
@given(st.floats(0.0, 15.0), st.sampled_from([-1.0, 0.0, 1.0]), st.floats(-3.0, 0.5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
@settings(max_examples=40, deadline=None)
def test_nothing_accelerates_in_trim(speed: float, climb: float, north: float, east: float, down: float) -> None:
    """At any speed, level, climbing and descending, in wind."""
    wind = (north, east, down)
    result = trim(DRAGGY, speed, climb, wind)
    assert result.status[0] == Status.OK
    force, moment = residuals(DRAGGY, result, wind)
    assert force < 1e-9
    assert moment < 1e-9
    assert np.abs(result.residual).max() < 1e-9
    # the state flies where it was told to: north at the ground speed, up at the rate of climb
    rate = np.array(derivative(DRAGGY, State(*result.state[0]), Command(tuple(result.throttle[0])), wind))
    np.testing.assert_allclose(rate[:3], [speed, 0.0, -climb], atol=1e-12)


@pytest.mark.theory
def test_level_trim_balances_weight_lift_drag_and_moment() -> None:
    """Without wind: drag and weight along the flight path give theta; lift and thrust carry the rest."""
    result = trim(CRAFT, 6.0)
    theta = float(result.attitude[0, 0])
    pressure = 0.5 * 1.225 * 36.0 * 0.78
    lift = pressure * (AERO["C_L0"] + AERO["C_Lalpha"] * theta)
    drag = pressure * (AERO["C_D0"] + AERO["C_Dalpha"] * theta)
    thrust = rotor(result.throttle[0], 6.0, -theta)[1]
    np.testing.assert_allclose(thrust.sum() * np.sin(theta), -drag, rtol=1e-4)
    np.testing.assert_allclose(thrust.sum() * np.cos(theta) + lift, WEIGHT, rtol=1e-4)
    moment = pressure * CHORD * (AERO["C_m0"] + AERO["C_malpha"] * theta)
    np.testing.assert_allclose(0.4 * (thrust[:4].sum() - thrust[4:].sum()), -moment, rtol=1e-2)


@pytest.mark.theory
@pytest.mark.parametrize("speed", [3.0, 5.0, 6.0, 8.0, 12.0])
def test_a_clean_vehicle_has_no_steady_descent_where_nothing_holds_it_back(speed: float) -> None:
    """Along the flight path weight pulls forward, drag and a tilted thrust hold back. The more the nose rises, the more the wing
    carries and the less thrust is left to tilt: beyond some speed no attitude balances a descent of 1 m/s."""
    path = np.arctan2(-1.0, speed)
    alpha = np.radians(np.linspace(-10.0, 40.0, 2001)) - path
    pressure = 0.5 * 1.225 * (speed**2 + 1.0) * 0.78
    lift, drag = (pressure * (AERO[f"C_{x}0"] + AERO[f"C_{x}alpha"] * alpha) for x in "LD")
    thrust = (WEIGHT * np.cos(path) - lift) / np.cos(alpha)
    surplus = -WEIGHT * np.sin(path) - drag - thrust * np.sin(alpha)
    exists = bool(np.any((surplus < 0.0) & (thrust > 0.0)))
    result = trim(CRAFT, speed, -1.0)
    assert result.status[0] == (Status.OK if exists else Status.TRIM_FAILED)
    if not exists:
        # what is missing is a force along X and nothing else
        assert result.residual[0, 0] > 1e-3
        np.testing.assert_allclose(result.residual[0, 3:], 0.0, atol=1e-3)


def test_too_heavy_a_vehicle_is_data_not_an_error() -> None:
    batch = vary(CRAFT, ["M"], np.array([[7.0], [40.0], [7.5]]), 5.0)
    result = trim(batch, 5.0)
    assert result.status.tolist() == [Status.OK, Status.TRIM_FAILED, Status.OK]
    # all rotors at full throttle lack most of the weight: the residual says so on Z
    assert np.argmax(np.abs(result.residual[1])) == 2
    assert np.isfinite(result.residual).all()


def test_a_trim_that_needs_more_than_full_throttle_has_failed() -> None:
    """Thrust at full throttle is K_T (15500 * 0.95)^2 = 15.09 N a rotor: 1 % less weight fits, 1 % more does not."""
    most = 8.0 * K_T * (15500.0 * 0.95) ** 2 / 9.80665
    craft = vehicle(law={"vertical": PID(2.0, 1.0, 0.0, 0.05, 20.0)})
    result = trim(vary(craft, ["M"], np.array([[0.99 * most], [1.01 * most]]), 0.0), 0.0)
    assert result.status.tolist() == [Status.OK, Status.TRIM_FAILED]


def test_a_vehicle_that_cannot_hover_is_refused_with_its_numbers() -> None:
    with pytest.raises(InputError, match=r"rotors: hover needs 49 N of each rotor, the table gives .* to 15\.1 N"):
        trim(vehicle(mass={"mass": 40.0}), 0.0)
    with pytest.raises(InputError, match=r"controller.trim_speeds: .* no level trim at .* m/s \(largest residual on [XYZLMN]\)"):
        trim(vehicle(aero={"C_m0": 2.0}), 5.0)


@pytest.mark.parametrize("climb", [-0.7, 0.0, 1.0])
def test_varied_vehicles_stay_at_rest_when_nothing_is_commanded(climb: float) -> None:
    """Integrators start from the trim of each sample, not from that of the nominal vehicle."""
    targets = ["M", "I_y", "K_T", "T_u", "C_L0", "C_m0", "C_malpha", "tau_d"]
    nominal = np.array([7.0, 0.7237, K_T, 1.0, 0.7745, -0.024, -0.54, 0.01])
    points = nominal * (1.0 + 0.2 * np.random.default_rng(3).uniform(-1.0, 1.0, (6, 8)))
    manoeuvre = Manoeuvre("hold", "velocity", "V_lon", 5.0, climb, "none", duration=5.0, wind=(-1.0, 0.3, 0.0))
    history = simulate(vary(DRAGGY, targets, points, 5.0), manoeuvre)
    assert history.status.tolist() == [0] * 6
    assert np.abs(history.channels["q"]).max() < 1e-9
    np.testing.assert_allclose(history.channels["V_lon"], 5.0, atol=1e-8)
    np.testing.assert_allclose(history.channels["altitude"] - climb * history.time, 0.0, atol=1e-8)


def test_a_trim_beyond_a_loops_limit_has_failed() -> None:
    """A vehicle 30 % heavier than its design asks the vertical loop for 0.3 g = 2.9 m/s^2 in hover; without them it would sink."""
    for limit, expected in ((3.5, Status.OK), (2.5, Status.TRIM_FAILED)):
        craft = vehicle(law={"vertical": PID(2.0, 1.0, 0.0, 0.05, limit)})
        history = simulate(vary(craft, ["M"], np.array([[1.3 * 7.0]]), 0.0), step("V_lon", 0.1, trim_speed=0.0, duration=4.0))
        assert history.status[0] == expected
    np.testing.assert_allclose(history.channels["altitude"], np.nan)
