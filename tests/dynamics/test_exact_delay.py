"""Delay, hold and motor lag of the closed loop against an integration from event to event; and the order of the method."""

from __future__ import annotations

import numpy as np
import pytest
from exact import fly_exactly, gust_at, no_commands
from scipy.integrate import solve_ivp
from vehicles import measured, open_loop, rate_of, vehicle

from levelone.dynamics import simulate, trim
from levelone.dynamics.controller import COMMANDS
from levelone.dynamics.integrate import BUFFER
from levelone.errors import InputError
from levelone.handling.manoeuvres import Manoeuvre, step
from levelone.vehicle import PID, Vehicle

KINEMATIC = ("x_north", "y_east", "altitude", "V_lon", "V_lat", "V_vert", "phi", "theta", "psi", "p", "q", "r")
TICKS = 76
SLOPE_OF_FOUR = pytest.approx(4.0, abs=0.2)


def gust_for(ticks: int, period: float) -> np.ndarray:
    """A smooth wind from all sides, zero at the start, so that no trim is moved."""
    t = period * np.arange(ticks)[:, None]
    return np.sin(np.array([3.0, 2.0, 4.0]) * t) * np.array([2.0, 0.4, 0.8])


def held(seconds: float, craft: Vehicle, steps: int) -> Manoeuvre:
    """Nothing commanded at 5 m/s, in ``steps`` integration steps a control period."""
    rate = craft.controller.rate
    options = {"duration": seconds, "dt": 1.0 / (rate * steps), "controller_rate": rate}
    return Manoeuvre("gust", "velocity", "V_lon", 5.0, shape="none", **options)


def recorded(history, names=KINEMATIC) -> np.ndarray:
    return np.array([history.channels[name][0] for name in names]).T


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("tau_d", "motor_lag"), [(0.0, 0.0), (0.0137, 0.0), (0.0012, 0.0), (0.012, 0.0), (0.0, 0.03), (0.0137, 0.03)]
)
def test_the_closed_loop_is_exact_between_its_events(tau_d: float, motor_lag: float) -> None:
    """tau_d below, between and at multiples of the period of 4 ms."""
    craft = vehicle(rotors={"tau_d": tau_d, "motor_lag": motor_lag})
    gust = gust_for(TICKS, 0.004)
    history = simulate(craft, held(0.3, craft, 4), gust=gust)
    exact = fly_exactly(craft, 5.0, gust, no_commands(TICKS))
    expected = np.array([measured(row[:13]) for row in exact])
    assert np.ptp(expected[:, 10]) > 1e-3
    np.testing.assert_allclose(recorded(history), expected, rtol=0.0, atol=1e-8)
    names = [f"throttle_{i + 1}" for i in range(8)]
    np.testing.assert_allclose(recorded(history, names)[1:], exact[1:, 13:], rtol=0.0, atol=1e-8)


@pytest.mark.oracle
def test_a_step_in_attitude_after_one_second_arrives_after_the_delay() -> None:
    """The first throttle that differs from trim is recorded at the first tick after the input and the delay."""
    craft = vehicle(rotors={"tau_d": 0.0137})
    manoeuvre = step("theta", 0.02, trim_speed=5.0, flight_mode="attitude", duration=1.1)
    history = simulate(craft, manoeuvre)
    commands = no_commands(len(history.time))
    commands[:, COMMANDS.index("theta")] = manoeuvre.command(history.time)
    exact = fly_exactly(craft, 5.0, np.zeros((len(history.time), 3)), commands, "attitude")
    np.testing.assert_allclose(history.channels["q"][0], exact[:, 11], rtol=0.0, atol=1e-8)
    moved = np.abs(history.channels["throttle_1"][0] - history.channels["throttle_1"][0, 0]) > 1e-6
    assert history.time[np.argmax(moved)] == pytest.approx(1.0 + 0.0137, abs=0.004)
    assert history.time[np.argmax(moved)] >= 1.0 + 0.0137


def test_a_delay_beyond_the_buffer_is_refused() -> None:
    """The last delay that fits is a whole number of periods of 4 ms, at least one second."""
    longest = BUFFER * 0.004
    assert longest >= 1.0
    manoeuvre = step("V_lon", 0.1, trim_speed=5.0, duration=1.0 + longest)
    with pytest.raises(InputError, match=rf"tau_d: .* longer than the delay buffer of {longest:.6g} s"):
        simulate(vehicle(rotors={"tau_d": longest + 1e-4}), manoeuvre)
    # the rotors stay at trim for as long as the record lasts: the longest delay works
    history = simulate(vehicle(rotors={"tau_d": longest}), manoeuvre)
    assert history.status.tolist() == [0]
    np.testing.assert_allclose(history.channels["throttle_1"], history.channels["throttle_1"][0, 0], rtol=1e-12)


@pytest.mark.order
def test_runge_kutta_is_of_fourth_order_on_the_smooth_airframe() -> None:
    """Open loop at 5 m/s through a gust; reference: SciPy's DOP853 on the public derivative. Errors of the state after 0.8 s."""
    craft = vehicle(law=open_loop(10.0), aero={"C_Lalphadot": 2.0, "C_malphadot": -4.0})
    gust = 0.5 * gust_for(11, 0.1)
    start = trim(craft, 5.0)
    rate = rate_of(craft, lambda t: start.throttle[0], lambda t: gust_at(gust, 0.1, t))
    x = start.state[0]
    for k in range(10):
        x = solve_ivp(rate, (0.1 * k, 0.1 * (k + 1)), x, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    steps = 2 ** np.arange(0, 6)
    errors = []
    for n in steps:
        history = simulate(craft, held(1.0, craft, int(n)), gust=gust)
        got = [history.channels[name][0, -1] for name in ("u", "v", "w", "p", "q", "r")]
        errors.append(np.linalg.norm(np.array(got) - x[[3, 4, 5, 10, 11, 12]]))
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert -slope == SLOPE_OF_FOUR, errors


@pytest.mark.order
def test_the_delayed_closed_loop_keeps_the_order() -> None:
    """tau_d = 2.5 T_c: every period holds a jump, which a step across it would turn into first order."""
    slow = PID(2.0, 1.0, 0.0, 0.1, 40.0)
    gains = {"rate": 20.0, "pitch": 2.0, "roll": 2.0, "pitch_rate": slow, "roll_rate": slow}
    craft = vehicle(law={**gains, "horizontal": PID(0.3, 0.05, 0.0, 0.1, 8.0)}, rotors={"tau_d": 0.125})
    gust, names = gust_for(41, 0.05), ("q", "theta", "V_lon", "p")
    steps = np.array([2, 4, 8, 16, 32])
    flights = {n: recorded(simulate(craft, held(2.0, craft, int(n)), gust=gust), names) for n in (*steps, 128)}
    errors = np.array([np.abs(flights[n] - flights[128]).max() for n in steps])
    assert np.ptp(flights[128][:, 0]) > 0.01
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] == SLOPE_OF_FOUR, errors
