"""Rigid-body mechanics of the airframe in a near vacuum: closed forms and conservation laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from vehicles import attitude, measured, rate_of, rotation, vehicle

from levelone.dynamics import Command, State, derivative, simulate, trim
from levelone.handling.manoeuvres import Manoeuvre

pytestmark = pytest.mark.theory
G = 9.80665
OFF = Command((0.0,) * 8)
#: air so thin that its forces are some 1e-11 of the weight
VACUUM = vehicle(air_density=1e-12)
TUMBLING = State(0.0, 0.0, -100.0, 4.0, -2.0, 1.0, *attitude(0.3, -0.4, 2.0), 2.0, -1.5, 3.0)
INERTIA = np.array([[1.2, 0.0, -0.04], [0.0, 0.7237, 0.0], [-0.04, 0.0, 1.8]])


def flown(start: State, seconds: float) -> np.ndarray:
    """[time, state] of the unpowered body at ten times after the start, by SciPy."""
    run = solve_ivp(
        rate_of(VACUUM, lambda t: OFF.throttle), (0.0, seconds), np.array(start), "DOP853", np.linspace(0.0, seconds, 10),
        rtol=1e-11, atol=1e-11,
    )  # fmt: skip
    return run.y.T


ROTATING = flown(TUMBLING, 2.0)


def test_projectile_follows_the_parabola_while_it_tumbles() -> None:
    t = np.linspace(0.0, 2.0, 10)[:, None]
    velocity = rotation(TUMBLING).apply(TUMBLING[3:6])
    expected = np.array(TUMBLING[:3]) + velocity * t + 0.5 * np.array([0.0, 0.0, G]) * t**2
    np.testing.assert_allclose(ROTATING[:, :3], expected, rtol=0.0, atol=1e-8)


def test_angular_momentum_in_earth_axes_and_spin_energy_are_conserved() -> None:
    momentum = np.array([rotation(x).apply(INERTIA @ x[10:13]) for x in ROTATING])
    energy = np.array([x[10:13] @ INERTIA @ x[10:13] for x in ROTATING])
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)
    assert np.abs(ROTATING[:, 10:13] - ROTATING[0, 10:13]).max() > 1.0  # the body rates themselves change


def test_kinetic_and_potential_energy_exchange() -> None:
    energy = [0.5 * 7.0 * x[3:6] @ x[3:6] - 7.0 * G * x[2] for x in ROTATING]
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
@settings(max_examples=25, deadline=None)
def test_gravity_and_velocity_turn_with_the_attitude(phi: float, theta: float, psi: float) -> None:
    """Gravity in body axes is that of Stevens, Lewis and Johnson, eq. 1.7-12; earth velocity is SciPy's rotation."""
    rate = derivative(VACUUM, State(0.0, 0.0, 0.0, 3.0, -2.0, 5.0, *attitude(phi, theta, psi)), OFF)
    gravity = G * np.array([-np.sin(theta), np.sin(phi) * np.cos(theta), np.cos(phi) * np.cos(theta)])
    np.testing.assert_allclose(rate[3:6], gravity, atol=1e-9)
    np.testing.assert_allclose(rate[:3], Rotation.from_euler("ZYX", [psi, theta, phi]).apply([3.0, -2.0, 5.0]), atol=1e-12)


def test_the_attitude_turns_with_the_body_rates() -> None:
    """A constant spin about a principal axis turns by rate times time about it."""
    spin = flown(State(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, *attitude(0.2, 0.3, 0.4), 0.0, 1.7, 0.0), 1.0)
    expected = Rotation.from_euler("ZYX", [0.4, 0.3, 0.2]) * Rotation.from_rotvec([0.0, 1.7, 0.0])
    np.testing.assert_allclose((rotation(spin[-1]) * expected.inv()).magnitude(), 0.0, atol=1e-9)


def test_hover_is_an_equilibrium_held_by_a_quarter_of_the_weight_on_each_pair() -> None:
    craft = vehicle()
    hover = trim(craft, 0.0)
    rate = np.array(derivative(craft, State(*hover.state[0]), Command(tuple(hover.throttle[0]))))
    np.testing.assert_allclose(rate, 0.0, atol=1e-9)
    # one rotor carries an eighth: its throttle solves K_T rpm^2 = m g / 8
    rpm = np.sqrt(7.0 * G / 8.0 / 6.96e-8)
    expected = (1.0 - np.sqrt(1.0 - 4.0 * 0.05 * rpm / 15500.0)) / (2.0 * 0.05)
    np.testing.assert_allclose(hover.throttle[0], expected, rtol=1e-8)
    np.testing.assert_allclose(hover.attitude[0], 0.0, atol=1e-10)


def test_channels_are_the_states_seen_from_the_heading() -> None:
    """What a run records of its trim in a climb is SciPy's reading of the trimmed state."""
    craft = vehicle()
    wind = (-2.0, 1.5, 0.0)
    manoeuvre = Manoeuvre("climb", "velocity", "V_vert", 4.0, 1.0, "none", duration=1.0, wind=wind)
    history = simulate(craft, manoeuvre)
    start = trim(craft, 4.0, 1.0, wind).state[0]
    names = ("x_north", "y_east", "altitude", "V_lon", "V_lat", "V_vert", "phi", "theta", "psi", "p", "q", "r")
    np.testing.assert_allclose([history.channels[name][0, 0] for name in names], measured(start), atol=1e-12)
    np.testing.assert_allclose([history.channels[n][0, 0] for n in ("V_lon", "V_lat", "V_vert")], [4.0, 0.0, 1.0], atol=1e-12)
    air = np.array([4.0, 0.0, -1.0]) - np.array(wind)
    u, v, w = rotation(start).inv().apply(air)
    expected = [np.linalg.norm(air), np.arctan2(w, u), np.arcsin(v / np.linalg.norm(air))]
    np.testing.assert_allclose([history.channels[n][0, 0] for n in ("airspeed", "alpha", "beta")], expected, atol=1e-12)
