"""The position-capture pilot: what is commanded when, and that the aircraft arrives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vehicles import vehicle

from levelone.dynamics import simulate
from levelone.errors import InputError
from levelone.handling.history import TimeHistory
from levelone.handling.manoeuvres import Manoeuvre, step
from levelone.handling.pilot import Pilot

CRAFT = vehicle()
PERIOD = 0.004
PILOT = {"gain": 0.4, "lead": 0.5, "delay": 0.25, "deceleration": 0.5, "reverse": 1.0, "distance": 40.0}


def hold(speed: float = 5.0, duration: float = 30.0, **fields: object) -> Manoeuvre:
    return Manoeuvre("deceleration", "velocity", "V_lon", speed, shape="none", duration=duration, **fields)


def flown(duration: float = 30.0, **numbers: float) -> TimeHistory:
    return simulate(CRAFT, hold(duration=duration), pilot=Pilot(**{**PILOT, **numbers}))


def wanted(history: TimeHistory, pilot: Pilot) -> np.ndarray:
    """The pilot's law written out with NumPy over the recorded position and speed."""
    late, on = round(pilot.delay / PERIOD), round(history.input_on / PERIOD)
    north, speed = history.channels["x_north"][0], history.channels["V_lon"][0]
    out = np.full(len(north), speed[0])
    for k in range(max(late, on), len(north)):
        to_go = pilot.distance - north[k - late] - pilot.lead * speed[k - late]
        near, a = pilot.deceleration / pilot.gain**2, pilot.deceleration
        free = pilot.gain * to_go if to_go < near else np.sqrt(2.0 * a * to_go - a * near)
        out[k] = np.clip(free, -pilot.reverse, speed[0])
    return out


@given(st.floats(0.2, 0.6), st.floats(0.0, 1.0), st.floats(0.0, 0.5), st.floats(0.5, 3.0))
@settings(max_examples=8, deadline=None)
def test_the_command_is_the_law_over_what_was_flown(gain: float, lead: float, delay: float, deceleration: float) -> None:
    numbers = {"gain": gain, "lead": lead, "delay": delay, "deceleration": deceleration}
    history = flown(12.0, **numbers)
    np.testing.assert_allclose(history.channels["V_lon_ref"][0], wanted(history, Pilot(**{**PILOT, **numbers})), atol=1e-9)


def test_the_aircraft_stops_at_the_point() -> None:
    history = flown(40.0)
    assert history.channels["x_north"][0, -1] == pytest.approx(40.0, abs=0.02)
    assert history.channels["V_lon"][0, -1] == pytest.approx(0.0, abs=0.01)
    assert np.array_equal(history.trim["V_lon_ref"], [5.0])


@pytest.mark.theory
def test_far_out_the_command_is_a_constant_deceleration() -> None:
    """Speed squared falls linearly with the distance: by 2 a for each metre, to the last bit of what the delay lets through."""
    history = flown(20.0, lead=0.0, delay=0.0)
    to_go, command = 40.0 - history.channels["x_north"][0], history.channels["V_lon_ref"][0]
    far = (to_go > 4.0) & (command < 5.0)
    slope = np.diff(command[far] ** 2) / np.diff(to_go[far])
    np.testing.assert_allclose(slope, 2.0 * 0.5, rtol=1e-6)
    assert far.sum() > 1000


def test_a_batch_of_piloted_runs_is_its_loop() -> None:
    crafts = [CRAFT, vehicle(rotors={"tau_d": 0.03})]
    together = simulate(crafts, hold(duration=10.0), pilot=Pilot(**PILOT), chunk=1, threads=2)
    for run, craft in enumerate(crafts):
        alone = simulate(craft, hold(duration=10.0), pilot=Pilot(**PILOT))
        for name in ("V_lon_ref", "x_north", "theta"):
            assert np.array_equal(alone.channels[name][0], together.channels[name][run])


def test_a_run_that_cannot_be_trimmed_has_no_command() -> None:
    heavy = vehicle(mass={"mass": 40.0})
    history = simulate([CRAFT, type(heavy)("heavy", heavy.airframe, CRAFT.controller)], hold(duration=2.0), pilot=Pilot(**PILOT))
    assert np.isnan(history.channels["V_lon_ref"][1]).all()
    assert np.isfinite(history.channels["V_lon_ref"][0]).all()


def test_only_one_may_command() -> None:
    pilot = Pilot(**PILOT)
    with pytest.raises(InputError, match=r"manoeuvre\.shape: is 'step'; with a pilot it must be 'none'"):
        simulate(CRAFT, step("V_lon", 1.0, trim_speed=5.0), pilot=pilot)
    with pytest.raises(InputError, match=r"manoeuvre\.flight_mode: is 'position'"):
        simulate(CRAFT, Manoeuvre("x", "position", "V_lon", 5.0, shape="none"), pilot=pilot)


@pytest.mark.parametrize(
    ("name", "value"),
    [("gain", 0.0), ("gain", -0.1), ("delay", -1.0), ("lead", float("nan")), ("distance", 0.0), ("deceleration", 0.0)],
)
def test_impossible_pilots_are_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=rf"pilot\.{name}: is {value:g}, must be"):
        Pilot(**{**PILOT, name: value})
