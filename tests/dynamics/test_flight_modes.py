"""Closed-loop flight: each mode follows its command, with the sign the convention gives it, in wind and gusts."""

from __future__ import annotations

import numpy as np
import pytest
from vehicles import AERO, vehicle

from levelone.dynamics import simulate, trim
from levelone.handling.history import TimeHistory
from levelone.handling.manoeuvres import Manoeuvre, step

CRAFT = vehicle(rotors={"tau_d": 0.01})


def end(history: TimeHistory, channel: str) -> float:
    """Mean over the last half second."""
    assert history.status[0] == 0
    return float(history.channels[channel][0, -125:].mean())


def fly(axis: str, amplitude: float, mode: str = "velocity", speed: float = 3.0, duration: float = 12.0, **options) -> TimeHistory:
    return simulate(CRAFT, step(axis, amplitude, trim_speed=speed, flight_mode=mode, duration=duration, **options))


def test_a_forward_speed_command_pitches_down_and_speeds_up() -> None:
    history = fly("V_lon", 1.0)
    q = history.channels["q"][0]
    assert q[np.argmax(np.abs(q) > 0.2 * np.abs(q).max())] < 0.0
    assert history.change("theta")[0].min() < -0.03
    assert end(history, "V_lon") == pytest.approx(4.0, abs=0.05)
    assert np.abs(history.change("altitude")).max() < 0.5


def test_a_command_to_the_right_rolls_right() -> None:
    history = fly("V_lat", 1.0)
    assert history.channels["phi"][0].max() > 0.03
    assert end(history, "V_lat") == pytest.approx(1.0, abs=0.1)
    assert history.channels["y_east"][0, -1] > 5.0
    assert end(history, "psi") == pytest.approx(0.0, abs=0.02)


def test_a_climb_command_climbs() -> None:
    history = fly("V_vert", 1.0)
    assert end(history, "V_vert") == pytest.approx(1.0, abs=0.02)
    assert history.channels["altitude"][0, -1] == pytest.approx(11.0, abs=0.3)


def test_a_yaw_rate_command_turns_right_and_the_speed_turns_along() -> None:
    history = fly("yaw_rate", 0.2, duration=10.0)
    assert end(history, "psi") == pytest.approx(0.2 * 8.75, abs=0.1)
    assert end(history, "V_lon") == pytest.approx(3.0, abs=0.1)
    # forward is where the nose points: after a quarter turn and more, the vehicle moves east
    north, east = (np.gradient(history.channels[name][0, -125:], 0.004).mean() for name in ("x_north", "y_east"))
    assert east > 2.5
    assert abs(np.arctan2(east, north) - end(history, "psi")) < 0.1


@pytest.mark.parametrize(("axis", "channel"), [("theta", "theta"), ("phi", "phi")])
def test_attitude_mode_holds_an_attitude(axis: str, channel: str) -> None:
    history = fly(axis, 0.05, "attitude", duration=3.0)
    assert end(history, channel) == pytest.approx(history.trim[channel][0] + 0.05, abs=5e-3)
    assert np.abs(history.change("altitude")).max() < 0.3


@pytest.mark.parametrize(("axis", "sign"), [("q", 1.0), ("p", -1.0)])
def test_rate_mode_holds_a_body_rate(axis: str, sign: float) -> None:
    """Without a wing, whose static stability turns against it as soon as the vehicle drifts."""
    craft = vehicle(aero=dict.fromkeys(AERO, 0.0))
    history = simulate(craft, step(axis, 0.1 * sign, trim_speed=3.0, flight_mode="rate", duration=5.0))
    assert end(history, axis) == pytest.approx(0.1 * sign, abs=0.003)


@pytest.mark.parametrize("mode", ["rate", "attitude"])
def test_the_vertical_command_acts_in_every_mode(mode: str) -> None:
    assert end(fly("V_vert", 0.5, mode, duration=5.0), "V_vert") == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(("north", "east"), [(-3.0, 0.0), (2.0, 0.0), (0.0, 1.0), (-2.0, -0.8)])
def test_ground_speed_is_followed_in_a_steady_wind(north: float, east: float) -> None:
    """Trim takes the wind up; the command then moves the ground speed, not the airspeed."""
    wind = (north, east, 0.0)
    history = fly("V_lon", 1.0, wind=wind)
    assert history.channels["V_lon"][0, 0] == pytest.approx(3.0, abs=1e-9)
    assert end(history, "V_lon") == pytest.approx(4.0, abs=0.05)
    assert end(history, "V_lat") == pytest.approx(0.0, abs=0.02)
    assert end(history, "airspeed") == pytest.approx(np.hypot(4.0 - north, east), abs=0.1)
    assert history.wind == wind


def test_position_mode_holds_a_place_against_the_wind() -> None:
    """A gust pushes the hovering vehicle away; position mode brings it back, velocity mode only stops it."""
    gust = np.zeros((7501, 3))
    gust[250:, 0] = 4.0 * np.minimum(1.0, 0.004 * np.arange(7251))
    craft = vehicle(aero={"C_D0": 0.5}, law={"trim_speeds": (-5.0, 5.0, 1.0)})
    hover = {"name": "hold", "axis": "V_lon", "trim_speed": 0.0, "shape": "none", "duration": 30.0}
    place, speed = (simulate(craft, Manoeuvre(flight_mode=mode, **hover), gust=gust) for mode in ("position", "velocity"))
    assert np.abs(place.channels["x_north"]).max() > 0.1
    assert end(place, "x_north") == pytest.approx(0.0, abs=0.02)
    assert end(speed, "V_lon") == pytest.approx(0.0, abs=0.01)
    assert abs(end(speed, "x_north")) > 0.2


def test_position_mode_follows_a_moving_place() -> None:
    """A speed command there moves the held position: 5 m/s for 12 s, and 0.5 m/s more from 1 s on."""
    history = fly("V_lon", 0.5, "position", speed=5.0, duration=20.0)
    assert end(history, "V_lon") == pytest.approx(5.5, abs=0.02)
    assert history.channels["x_north"][0, -1] == pytest.approx(5.0 * 20.0 + 0.5 * 19.0, abs=0.2)
    side = fly("V_lat", 0.5, "position", speed=5.0, duration=20.0)
    assert side.channels["y_east"][0, -1] == pytest.approx(0.5 * 19.0, abs=0.3)


def test_a_gust_disturbs_and_is_recovered_from() -> None:
    """A head-on gust of one second slows the vehicle down, lifts it, and is over ten seconds later."""
    ticks = 3001
    gust = np.zeros((ticks, 3))
    inside = slice(250, 500)
    gust[inside, 0] = -2.0 * np.sin(np.pi * np.linspace(0.0, 1.0, 250))
    history = simulate(CRAFT, Manoeuvre("gust", "velocity", "V_lon", 5.0, shape="none", duration=12.0), gust=gust)
    assert np.array_equal(history.channels["q"][0, :251], np.full(251, history.channels["q"][0, 0])) or (
        np.abs(history.channels["q"][0, :251]).max() < 1e-9
    )
    assert history.change("airspeed")[0, inside].max() > 1.5
    assert history.change("V_lon")[0].min() < -0.02
    assert history.change("altitude")[0, inside.start : inside.stop + 250].max() > 0.02
    for name in ("V_lon", "theta", "q"):
        assert abs(end(history, name) - history.trim[name][0]) < 0.02


def test_a_record_begins_in_the_trim_of_its_wind_and_gust() -> None:
    gust = np.tile([-1.0, 0.2, 0.0], (251, 1))
    hold = Manoeuvre("hold", "velocity", "V_lon", 5.0, shape="none", duration=1.0, wind=(-1.0, 0.0, 0.0))
    history = simulate(CRAFT, hold, gust=gust)
    assert history.trim["theta"][0] == pytest.approx(trim(CRAFT, 5.0, 0.0, (-2.0, 0.2, 0.0)).attitude[0, 0], abs=1e-12)
    assert np.abs(history.channels["q"]).max() < 1e-9


def test_integrators_wait_while_a_loop_is_at_its_limit() -> None:
    """A step far beyond the attitude limit: the speed arrives with little overshoot, not by the integral of a long error."""
    history = fly("V_lon", 5.0, duration=25.0)
    assert history.channels["theta"][0].min() > -np.radians(45.0)
    assert history.channels["V_lon"][0].max() < 8.0 + 0.3 * 5.0
    assert end(history, "V_lon") == pytest.approx(8.0, abs=0.1)
