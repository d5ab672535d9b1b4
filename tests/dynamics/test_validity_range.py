"""What a run says of itself: extremes, tables exceeded, divergence."""

from __future__ import annotations

import numpy as np
from vehicles import AERO, vehicle

from levelone.dynamics import simulate
from levelone.handling.manoeuvres import Manoeuvre, step
from levelone.status import Status
from levelone.vehicle import PID

CHORD = 0.26


def test_extremes_are_those_of_the_channels() -> None:
    """Two tenths of the time below the least airspeed, at which an incidence means nothing: start from hover in a light wind."""
    craft = vehicle()
    gust = np.zeros((1501, 3))
    gust[250:, 0] = np.linspace(0.0, -6.0, 1251)
    gust[250:, 1] = 0.3 * np.sin(0.02 * np.arange(1251))
    history = simulate(craft, Manoeuvre("gust", "velocity", "V_lon", 0.0, shape="none", duration=6.0), gust=gust)
    assert history.status[0] == Status.OK
    flown = {name: values[0] for name, values in history.channels.items()}
    counts = flown["airspeed"] > 1.0
    assert 0.2 < counts.mean() < 0.95
    for name in ("alpha", "beta"):
        assert history.extremes[f"{name}_min"][0] == flown[name][counts].min()
        assert history.extremes[f"{name}_max"][0] == flown[name][counts].max()
    assert history.extremes["airspeed_max"][0] == flown["airspeed"].max()
    # beta small enough for sin(alpha) = w / V and tan(alpha) = w / u to be told apart only by the tolerance below
    q_hat = 0.5 * flown["q"] * CHORD / np.maximum(flown["airspeed"], 1e-9)
    sine = np.sin(flown["alpha"]) * np.cos(flown["beta"])
    drag = AERO["C_D0"] + AERO["C_Dalpha"] * np.arcsin(sine) + AERO["C_Dq"] * q_hat
    np.testing.assert_allclose(history.extremes["C_D_min"][0], drag[counts].min(), rtol=1e-12)


def test_a_drag_coefficient_below_zero_is_on_record() -> None:
    """A hard step forward pitches the nose down to where the linear drag changes its sign: C_D0 / C_Dalpha = 4.1 deg."""
    history = simulate(vehicle(), step("V_lon", 2.5, trim_speed=8.0, duration=3.0))
    assert history.extremes["alpha_min"][0] < -np.radians(4.2)
    assert history.extremes["C_D_min"][0] < 0.0


def test_saturated_ticks_are_counted() -> None:
    """A roll rate of 6 rad/s asks the outer rotors for more than they have; one of 0.1 rad/s does not."""
    hard, soft = (simulate(vehicle(), step("p", size, trim_speed=5.0, flight_mode="rate", duration=1.1)) for size in (6.0, 0.1))
    assert soft.extremes["saturated"][0] == 0.0
    throttle = np.array([values[0] for name, values in hard.channels.items() if name.startswith("throttle")])
    assert throttle.max() == 1.0
    at_limit = np.any(throttle == 1.0, axis=0)
    # the last tick's command is counted, and flown after the record's end
    assert hard.extremes["saturated"][0] - at_limit.sum() in (0, 1)


def test_a_speed_beyond_the_rotor_table_ends_the_run() -> None:
    """From 12 m/s towards 22 m/s with a table that ends at 20 m/s."""
    history = simulate(vehicle(aero={"C_D0": 0.005, "C_Dalpha": 0.0}), step("V_lon", 10.0, trim_speed=12.0, duration=25.0))
    assert history.status[0] == Status.TABLE_EXCEEDED
    airspeed = history.channels["airspeed"][0]
    last = int(np.argmax(np.isnan(airspeed)))
    assert history.time[last] > 1.0
    assert 19.9 < airspeed[last - 1] <= 20.0
    assert np.isnan(airspeed[last:]).all()


def test_a_speed_beyond_the_aerodynamic_knots_ends_the_run() -> None:
    """Knots to 6 m/s: the run ends there, though the rotor table goes on."""
    history = simulate(vehicle(knots=(0.0, 3.0, 6.0), law={"trim_speeds": (0.0, 6.0, 1.0)}), step("V_lon", 3.0, trim_speed=5.0))
    assert history.status[0] == Status.TABLE_EXCEEDED
    assert np.nanmax(history.channels["airspeed"]) <= 6.0


def test_the_airspeed_factor_shortens_the_reach() -> None:
    """T_u = 2: the table of 20 m/s is exceeded at 10 m/s."""
    history = simulate(vehicle(rotors={"T_u": 2.0}, law={"trim_speeds": (0.0, 9.0, 1.0)}), step("V_lon", 3.0, trim_speed=8.5))
    assert history.status[0] == Status.TABLE_EXCEEDED
    assert 9.9 < np.nanmax(history.channels["airspeed"]) <= 10.0


def test_an_unstable_loop_diverges_into_nan_from_where_it_left() -> None:
    """A pitch-rate loop of the wrong sign."""
    wild = vehicle(law={"pitch_rate": PID(-2.0, 0.0, 0.0, 0.02, 40.0)})
    history = simulate(wild, step("V_lon", 1.0, trim_speed=5.0, duration=20.0))
    assert history.status[0] == Status.DIVERGED
    q = history.channels["q"][0]
    lost = int(np.argmax(np.isnan(q)))
    assert history.time[lost] > 1.0
    assert np.isnan(q[lost:]).all()
    assert np.isfinite(q[:lost]).all()
    assert np.abs(history.channels["theta"][0, :lost]).max() < 1.5
