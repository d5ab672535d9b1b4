"""Poles of the sampled closed loop: against python-control, against the ring-down of a flight, and by name."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from test_linear_response import CASES, sensor_unit
from vehicles import vehicle

from levelone.dynamics import LinearModel, linearize, simulate
from levelone.handling.manoeuvres import pulse
from levelone.vehicle import PID

PERIOD = 0.004


def delay_line(width: int, periods: int) -> control.StateSpace:
    """z^-periods on ``width`` channels."""
    one = control.ss(np.eye(periods, k=-1), np.eye(periods, 1), np.eye(1, periods, periods - 1), 0.0, PERIOD)
    return control.append(*[one] * width)


def closed_loop(model: LinearModel) -> control.StateSpace:
    """Airframe, delay and controller joined by python-control; ideal sensors."""
    n_u, late, law = model.B1.shape[2], int(model.whole_delay[0]), model.law()
    both = np.hstack([model.B0[0], model.B1[0]])
    airframe = control.ss(model.A[0], both, model.C[0], np.zeros((len(model.C[0]), 2 * n_u)), PERIOD)
    old = delay_line(n_u, 1)
    new = np.vstack([0.0 * old.D, np.eye(n_u)])
    split = control.ss(old.A, old.B, np.vstack([old.C, 0.0 * old.C]), new, PERIOD)
    path = airframe * split * delay_line(n_u, late) if late else airframe * split
    return control.feedback(path, control.ss(law.A, law.B, law.C, law.D, PERIOD), sign=1)


@pytest.mark.oracle
@pytest.mark.parametrize("tau_d", [0.0, 0.0013, 0.012, 0.0137])
def test_poles_are_those_of_the_loop_that_python_control_closes(tau_d: float) -> None:
    model = linearize(vehicle(rotors={"tau_d": tau_d}), 5.0)
    # a pole at z = 0 of high multiplicity is anywhere within eps^(1/m); the others agree to many digits
    ours, theirs = (z[np.abs(z) > 0.2] for z in (model.poles().z, closed_loop(model).poles()))
    assert len(ours) == len(theirs)
    distance = np.abs(ours[:, None] - theirs[None])
    assert distance[linear_sum_assignment(distance)].max() < 1e-6


@pytest.mark.oracle
def test_the_closed_frequency_response_is_that_of_python_control() -> None:
    """The loop closed at each frequency with z^-m against the state space with the delay as states; command at the throttles."""
    model = linearize(vehicle(rotors={"tau_d": 0.0137}), 5.0)
    law, omega = model.law(), np.array([0.3, 2.0, 6.0, 40.0])
    z = np.exp(1j * omega * PERIOD)
    loop = closed_loop(model)
    forward = [law.C @ np.linalg.solve(x * np.eye(len(law.A)) - law.A, law.Br[:, 3]) + law.Dr[:, 3] for x in z]
    expected = [(loop(x) @ f)[10] for x, f in zip(z, forward, strict=True)]
    np.testing.assert_allclose(model.frequency_response("V_lon", "q", omega).value[0], expected, rtol=1e-7)


def matrix_pencil(signal: np.ndarray, interval: float, order: int) -> np.ndarray:
    """Poles (1/s) of a sum of exponentials: Hua and Sarkar, IEEE Trans. ASSP 38 (1990) 814."""
    hankel = np.lib.stride_tricks.sliding_window_view(signal, len(signal) // 2)
    _, _, v = np.linalg.svd(hankel, full_matrices=False)
    space = v[:order].T
    return np.log(np.linalg.eigvals(np.linalg.pinv(space[:-1]) @ space[1:]).astype(complex)) / interval


@pytest.mark.theory
@pytest.mark.parametrize("tau_d", [0.0, 0.03])
def test_the_dominant_pole_is_what_a_flight_rings_with(tau_d: float) -> None:
    """omega_n and zeta of the free response after a small pulse, without the linear model."""
    craft = vehicle(rotors={"tau_d": tau_d})
    history = simulate(craft, pulse("V_lon", 0.01, trim_speed=5.0, length=0.5, duration=9.0))
    free = history.time > 1.5 + tau_d + 0.3
    found = matrix_pencil(history.change("q")[0, free][::15], 15 * PERIOD, 6)
    pole = linearize(craft, 5.0).dominant("V_lon", "q")
    nearest = found[np.argmin(np.abs(found - pole))]
    assert abs(nearest) == pytest.approx(abs(pole), rel=2e-3)
    assert -nearest.real / abs(nearest) == pytest.approx(-pole.real / abs(pole), abs=2e-3)


def test_delay_poles_are_named_and_the_rest_are_not() -> None:
    """A longer delay adds poles, of which those at z = 0 have no s; the airframe's and controller's stay in number."""
    for tau_d in (0.0, 0.02, 0.05):
        poles = linearize(vehicle(rotors={"tau_d": tau_d}), 5.0).poles()
        assert len(poles.s) + poles.delay.sum() == len(poles.z)
        assert np.isfinite(poles.s).all()
        assert np.abs(poles.z[poles.delay]).max() < 1e-6
        assert np.abs(poles.z[~poles.delay]).min() > 1e-2
    assert poles.omega_n == pytest.approx(np.abs(poles.s))
    moving = poles.omega_n > 1e-9
    np.testing.assert_allclose(poles.zeta[moving] * poles.omega_n[moving], -poles.s[moving].real)
    assert np.isnan(poles.zeta[~moving]).all()


def test_the_dominant_pole_moves_smoothly_with_the_delay() -> None:
    delays = np.linspace(0.0, 0.06, 31)
    poles = np.array([linearize(vehicle(rotors={"tau_d": float(d)}), 5.0).dominant("V_lon", "q") for d in delays])
    assert np.abs(np.diff(poles, 2)).max() < 0.02 * np.abs(poles[0] - poles[-1])


def test_sensor_lag_and_delay_move_the_poles_as_the_loop_closed_by_frequency_says() -> None:
    """det(z I - A - B(z) K(z) C) vanishes at the dominant pole."""
    craft = vehicle(sensors=CASES["sensors"]["sensors"], rotors={"tau_d": 0.0137})
    model = linearize(craft, 5.0)
    pole = model.dominant("V_lon", "q")
    assert abs(pole - linearize(vehicle(rotors={"tau_d": 0.0137}), 5.0).dominant("V_lon", "q")) > 0.02
    z, law = np.exp(pole * PERIOD), model.law()
    a, b0, b1 = model.lag_gain.T
    sensor = (b1 + (a * b1 + b0) / (z - a)) * z ** -model.sensor_delay.astype(float)
    feedback = (law.C @ np.linalg.solve(z * np.eye(len(law.A)) - law.A, law.B) + law.D) * sensor
    B = (model.B0[0] / z + model.B1[0]) * z ** -float(model.whole_delay[0])
    values = np.linalg.svd(z * np.eye(12) - model.A[0] - B @ feedback @ model.C[0], compute_uv=False)
    assert values[-1] < 1e-9 * values[0]


def test_an_unstable_loop_has_poles_outside_the_circle() -> None:
    """A delay of 0.15 s: the flight grows at the rate that the pole says."""
    craft = vehicle(rotors={"tau_d": 0.15})
    model = linearize(craft, 5.0)
    pole = model.dominant("V_lon", "q")
    assert pole.real > 0.0
    assert np.abs(model.poles().z).max() == pytest.approx(np.exp(pole.real * PERIOD), rel=1e-9)
    history = simulate(craft, pulse("V_lon", 1e-4, trim_speed=5.0, length=0.5, duration=8.0))
    q = np.abs(history.change("q")[0])
    early, late = (q[(history.time >= t) & (history.time < t + 2.0)].max() for t in (4.0, 6.0))
    assert np.log(late / early) / 2.0 == pytest.approx(pole.real, rel=0.1)


def test_a_loop_without_gain_still_has_poles() -> None:
    """Nothing is fed back: the airframe's own modes and the controller's memories."""
    still = PID(0.0)
    loops = dict.fromkeys(("horizontal", "vertical", "roll_rate", "pitch_rate", "yaw_rate"), still)
    model = linearize(vehicle(law={"position": 0.0, "altitude": 0.0, "roll": 0.0, "pitch": 0.0, "heading": 0.0, **loops}), 5.0)
    airframe = np.linalg.eigvals(model.A[0])
    ours = model.poles().z
    assert max(np.abs(ours - z).min() for z in airframe) < 1e-5


def test_a_sensor_delay_that_nothing_reads_adds_no_pole() -> None:
    units = (None, sensor_unit({"x_north": 0.5}, {"y_east": 20}))
    plain, unread = (linearize(vehicle(sensors=unit), 5.0).poles() for unit in units)
    assert len(plain.z) == len(unread.z)
    np.testing.assert_allclose(np.sort(np.abs(plain.z)), np.sort(np.abs(unread.z)), atol=1e-9)
