from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from levelone.errors import InputError
from levelone.handling.manoeuvres import Manoeuvre, pulse, step, sweep


def test_step_and_pulse():
    assert step("V_lon", 1.5, trim_speed=5.0).command([0.0, 0.996, 1.0, 99.0]).tolist() == [0.0, 0.0, 1.5, 1.5]
    given = pulse("V_lon", 0.7, trim_speed=5.0, length=0.5)
    assert given.command([0.996, 1.0, 1.496, 1.5]).tolist() == [0.0, 0.7, 0.7, 0.0]
    assert (given.on, given.off, given.flight_mode, given.unit) == (1.0, 1.5, "velocity", "m/s")


@pytest.mark.parametrize("length", [0.1, 0.3, 0.5, 0.7, 1.1])
def test_input_lasts_the_same_number_of_ticks_whatever_the_rounding(length):
    given = pulse("V_lon", 0.7, trim_speed=5.0, on=1.2, length=length)
    assert np.count_nonzero(given.command(given.ticks())) == round(length * 250)


def test_ticks_are_inclusive():
    ticks = step("V_lon", 1.0, trim_speed=5.0, duration=10.0).ticks()
    assert (ticks[0], ticks[-1], ticks.size) == (0.0, 10.0, 2501)
    assert step("V_lon", 1.0, trim_speed=5.0, duration=10.003).ticks()[-1] == 10.0
    fine = step("V_lon", 1.0, trim_speed=5.0, dt=0.001, controller_rate=250.0)
    assert fine.steps_per_tick == 4


@pytest.mark.theory
def test_phase_of_the_sweep_is_the_integral_of_its_frequency():
    given = sweep("V_lon", 0.5, trim_speed=5.0, omega_min=0.3, omega_max=12.0, length=90.0, fade=0.0)
    for since in (3.0, 17.3, 60.1):
        phase, _ = quad(lambda t: 0.3 + (12.0 - 0.3) * t / 90.0, 0.0, since)
        assert given.command(1.0 + since) == pytest.approx(0.5 * np.sin(phase), abs=1e-9)


def test_sweep_fades_in_and_out_and_is_zero_outside():
    given = sweep("V_lon", 0.5, trim_speed=5.0, fade=2.0)
    time = given.ticks()
    command = given.command(time)
    assert not command[time < 1.0].any()
    assert not command[time >= 91.0].any()
    assert np.abs(command).max() == pytest.approx(0.5, rel=1e-3)
    assert np.abs(np.diff(command)).max() < 0.5 * 12.0 * 0.004 * 1.01
    plain = sweep("V_lon", 0.5, trim_speed=5.0, fade=0.0).command(time)
    inside = (time > 3.0) & (time < 89.0)
    np.testing.assert_allclose(command[inside], plain[inside], atol=1e-12)
    half = np.argmin(np.abs(time - 2.0))
    assert command[half] == pytest.approx(0.5 * plain[half], abs=1e-12)
    assert given.duration == 96.0


def test_nothing_is_commanded_where_the_trim_is_held():
    held = Manoeuvre("trim", "velocity", "V_lon", 5.0, shape="none")
    assert not held.command(held.ticks()).any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"on": 0.5}, "1 s or later"),
        ({"amplitude": 0.0}, "shape = 'none'"),
        ({"amplitude": np.nan}, "must be finite"),
        ({"trim_speed": np.inf}, "trim_speed"),
        ({"dt": 0.003}, "does not divide"),
        ({"dt": 0.008}, "does not divide"),
        ({"duration": 1.0}, "ends before the input"),
        ({"duration": -1.0}, "must be positive"),
        ({"off": 3.0}, "use shape = 'pulse'"),
        ({"off": 0.9, "shape": "pulse"}, "must come after"),
        ({"shape": "pulse"}, "within the record"),
        ({"shape": "ramp"}, "allowed: none, pulse, step, sweep"),
        ({"axis": "V_long"}, "did you mean 'V_lon'"),
        ({"flight_mode": "speed"}, "allowed: attitude"),
        ({"flight_mode": "attitude"}, "cannot be commanded in mode 'attitude'"),
        ({"wind": (0.0, 1.0)}, "north, east, down"),
        ({"shape": "sweep", "off": 9.0, "omega_min": 0.0}, "must be positive"),
        ({"shape": "sweep", "off": 9.0, "omega_max": 0.2}, "must exceed"),
        ({"shape": "sweep", "off": 9.0, "omega_max": 800.0}, "Nyquist"),
        ({"shape": "sweep", "off": 9.0, "fade": 5.0}, "half the sweep"),
    ],
)
def test_bad_input_is_refused(options, message):
    fields = {"name": "", "flight_mode": "velocity", "axis": "V_lon", "trim_speed": 5.0, "amplitude": 1.0, **options}
    with pytest.raises(InputError, match=message):
        Manoeuvre(**fields)


def test_an_unknown_option_names_the_closest():
    with pytest.raises(InputError, match="did you mean 'duration'"):
        step("V_lon", 1.0, trim_speed=5.0, durations=3.0)
