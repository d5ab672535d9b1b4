"""Symmetries of the equations: mirror images, moving frames, headings."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from vehicles import MIRRORED, attitude, rate_of, rotation, vehicle

from levelone.dynamics import Command, State, derivative, simulate, trim
from levelone.handling.manoeuvres import step
from levelone.vehicle import PID

SPEED, ANGLE, RATE = st.floats(-8.0, 8.0), st.floats(-1.2, 1.2), st.floats(-2.0, 2.0)
VECTOR = st.tuples(SPEED, SPEED, SPEED)
THROTTLES = st.lists(st.floats(0.1, 1.0), min_size=8, max_size=8)
MIRROR_STATE = np.array([1, -1, 1, 1, -1, 1, 1, -1, 1, -1, -1, 1, -1.0])
FEW = settings(max_examples=25, deadline=None)
CRAFT = vehicle()
LATERAL = ("y_east", "V_lat", "phi", "psi", "p", "r", "v", "beta")


@st.composite
def states(draw: st.DrawFn) -> State:
    """Any attitude short of the vertical, any velocity inside the rotor table, any body rates."""
    angles = draw(st.tuples(ANGLE, ANGLE, st.floats(-3.0, 3.0)))
    return State(*draw(VECTOR), *draw(VECTOR), *attitude(*angles), *draw(st.tuples(RATE, RATE, RATE)))


@given(states(), THROTTLES, VECTOR)
@FEW
def test_a_mirrored_flight_has_mirrored_rates(state: State, throttle: list[float], wind: tuple[float, float, float]) -> None:
    rate = np.array(derivative(CRAFT, state, Command(tuple(throttle), 0.3, 0.05, 0.04, -0.03), wind))
    other = State(*(MIRROR_STATE * np.array(state)))
    swapped = tuple(np.array(throttle)[MIRRORED])
    mirrored = derivative(CRAFT, other, Command(swapped, 0.3, 0.05, -0.04, 0.03), (wind[0], -wind[1], wind[2]))
    np.testing.assert_allclose(mirrored, MIRROR_STATE * rate, rtol=1e-11, atol=1e-10)


@pytest.mark.parametrize("local", [False, True])
def test_a_symmetric_manoeuvre_leaves_the_lateral_states_alone(local: bool) -> None:
    history = simulate(vehicle(rotors={"local_velocity": local, "tau_d": 0.01}), step("V_lon", 1.0, trim_speed=5.0, duration=6.0))
    assert np.ptp(history.channels["theta"]) > 0.02
    for name in LATERAL:
        np.testing.assert_allclose(history.channels[name], 0.0, atol=1e-12, err_msg=name)


def test_mirrored_commands_give_mirrored_flights() -> None:
    right, left = (
        simulate(CRAFT, step("V_lat", side, trim_speed=4.0, duration=4.0, wind=(0.0, 0.5 * side, 0.0))) for side in (1.0, -1.0)
    )
    assert np.ptp(right.channels["phi"]) > 0.02
    for name in (*LATERAL, "V_lon", "theta", "q", "altitude"):
        sign = -1.0 if name in LATERAL else 1.0
        np.testing.assert_allclose(left.channels[name], sign * right.channels[name], atol=1e-9, err_msg=name)


@given(states(), THROTTLES, VECTOR)
@FEW
def test_forces_depend_on_the_motion_through_the_air_alone(
    state: State, throttle: list[float], wind: tuple[float, float, float]
) -> None:
    """Galilean invariance: carried along by a steady wind, the same inertial acceleration and angular acceleration."""
    check_galilean(CRAFT, state, throttle, wind)


def check_galilean(craft, state: State, throttle: list[float], wind: tuple[float, float, float]) -> None:
    """Compare still air with a flight through the same air carried along by the wind."""
    body_wind = rotation(state).inv().apply(wind)
    carried = State(*state[:3], *(np.array(state[3:6]) + body_wind), *state[6:])
    command = Command(tuple(throttle))
    still, windy = np.array(derivative(craft, state, command)), np.array(derivative(craft, carried, command, wind))
    omega = np.array(state[10:13])
    np.testing.assert_allclose(windy[:3], still[:3] + wind, atol=1e-11)
    inertial = [rate[3:6] + np.cross(omega, x[3:6]) for rate, x in ((still, state), (windy, carried))]
    np.testing.assert_allclose(inertial[1], inertial[0], rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(windy[6:], still[6:], rtol=1e-10, atol=1e-9)


def test_alphadot_is_that_of_the_motion_through_the_air() -> None:
    """A steady wind adds no rate of incidence of its own: it turns in body axes exactly as the axes turn."""
    craft = vehicle(aero={"C_Lalphadot": 5.0, "C_malphadot": -8.0})
    state = State(0.0, 0.0, 0.0, 5.0, 0.0, 0.5, *attitude(0.0, 0.1, 0.0), 0.0, 1.0, 0.0)
    check_galilean(craft, state, [0.65] * 8, (-4.0, 0.0, 0.0))


@given(states(), THROTTLES, VECTOR, st.floats(-3.0, 3.0))
@FEW
def test_no_heading_is_special(state: State, throttle: list[float], wind: tuple[float, float, float], turn: float) -> None:
    about_down = Rotation.from_rotvec([0.0, 0.0, turn])
    x, y, z, w = (about_down * rotation(state)).as_quat()
    turned = State(*about_down.apply(state[:3]), *state[3:6], w, x, y, z, *state[10:])
    first, second = (
        np.array(derivative(CRAFT, *given))
        for given in ((state, Command(tuple(throttle)), wind), (turned, Command(tuple(throttle)), tuple(about_down.apply(wind))))
    )
    np.testing.assert_allclose(second[:3], about_down.apply(first[:3]), atol=1e-10)
    np.testing.assert_allclose(second[[3, 4, 5, 10, 11, 12]], first[[3, 4, 5, 10, 11, 12]], rtol=1e-10, atol=1e-9)


@given(states(), THROTTLES)
@FEW
def test_the_quaternion_keeps_its_norm(state: State, throttle: list[float]) -> None:
    rate = np.array(derivative(CRAFT, state, Command(tuple(throttle))))
    np.testing.assert_allclose(rate[6:10] @ np.array(state[6:10]), 0.0, atol=1e-13)
    # its rate is half the quaternion times the body rates: so is SciPy's, by a small rotation
    h = 1e-5
    ahead = (rotation(state) * Rotation.from_rotvec(h * np.array(state[10:13]))).as_quat()[[3, 0, 1, 2]]
    ahead *= np.sign(ahead @ np.array(state[6:10]))
    np.testing.assert_allclose(rate[6:10], (ahead - np.array(state[6:10])) / h, atol=1e-4)


@given(st.floats(1.0, 10.0), st.floats(-4.0, 4.0), st.floats(-1.0, 1.0))
@FEW
def test_trim_depends_on_the_airspeed_alone(speed: float, headwind: float, climb: float) -> None:
    # the feed-forward follows the ground speed: the vertical loop makes up for the wind, and needs the room
    craft = vehicle(law={"vertical": PID(2.0, 1.0, 0.0, 0.05, 30.0)})
    in_wind = trim(craft, speed - headwind, climb, (-headwind, 0.0, 0.0))
    in_calm = trim(craft, speed, climb)
    np.testing.assert_allclose(in_wind.attitude, in_calm.attitude, atol=1e-9)
    np.testing.assert_allclose(in_wind.throttle, in_calm.throttle, atol=1e-9)


def test_the_position_on_earth_changes_nothing() -> None:
    """A flat earth without an atmosphere model: the derivative does not know where it is."""
    here = rate_of(CRAFT, lambda t: (0.7,) * 8)
    near, far = np.array(State(u=5.0, q=0.3)), np.array(State(1e5, -2e4, -900.0, u=5.0, q=0.3))
    assert np.array_equal(here(0.0, near), here(0.0, far))
