from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from handling_signals import DT, grid
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import levelone
from levelone.errors import InputError
from levelone.handling.coupling import RETURNED, coupling
from levelone.handling.history import TimeHistory
from levelone.handling.levels import Level, load_boundaries
from levelone.status import Status

FIELDS = ("off_axis_peak", "on_axis_change", "on_axis_peak", "ratio", "ratio_literal")


def both_axes(theta, phi, *, time=None, on=1.0, status=None, trim=(0.0, 0.0)):
    """A record of pitch and roll after a step of ``V_lon``: changes from trim, ``[run, time]``."""
    time = grid() if time is None else time
    theta, phi = np.broadcast_arrays(np.atleast_2d(theta), np.atleast_2d(phi))
    runs = theta.shape[0]
    return TimeHistory(
        time=time,
        channels={
            "V_lon_ref": np.tile(np.where(time >= on - 1e-9, 6.0, 5.0), (runs, 1)),
            "theta": theta + trim[0],
            "phi": phi + trim[1],
        },
        units={"V_lon_ref": "m/s", "theta": "rad", "phi": "rad"},
        trim={"V_lon_ref": np.full(runs, 5.0), "theta": np.full(runs, trim[0]), "phi": np.full(runs, trim[1])},
        input_name="V_lon_ref",
        input_on=on,
        input_off=np.nan,
        delay=np.zeros(runs),
        wind=(0.0, 0.0, 0.0),
        status=np.zeros(runs, dtype=np.int64) if status is None else np.asarray(status, dtype=np.int64),
    )


def since(time, on=1.0):
    return np.maximum(time - on, 0.0)


def held_attitude(s, zeta=0.4, omega=3.0, final=-0.2):
    """Second-order step response: an attitude command, which keeps its new value."""
    damped = omega * np.sqrt(1.0 - zeta**2)
    return final * (1.0 - np.exp(-zeta * omega * s) * (np.cos(damped * s) + zeta * omega / damped * np.sin(damped * s)))


def returning_attitude(s, peak=-0.15, at=0.5):
    """Nose down and back to trim, as under a velocity command: peak at ``at`` seconds."""
    return peak * s / at * np.exp(1.0 - s / at)


@pytest.mark.theory
def test_a_held_attitude_against_closed_forms():
    zeta, omega, final, tau, size = 0.4, 3.0, -0.2, 0.7, 0.05
    s = since(grid())
    result = coupling(both_axes(held_attitude(s, zeta, omega, final), size * s * np.exp(-s / tau)))
    overshoot = np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2))
    at_4 = abs(held_attitude(4.0, zeta, omega, final))
    assert result.status[0] == result.status_literal[0] == Status.OK
    assert result.off_axis_peak[0] == pytest.approx(size * tau / np.e, rel=1e-7)
    assert result.on_axis_peak[0] == pytest.approx(0.2 * (1.0 + overshoot), rel=1e-7)
    assert result.on_axis_change[0] == pytest.approx(at_4, rel=1e-7)
    assert result.ratio[0] == pytest.approx(size * tau / np.e / (0.2 * (1.0 + overshoot)), rel=1e-7)
    assert result.ratio_literal[0] == pytest.approx(size * tau / np.e / at_4, rel=1e-7)


@pytest.mark.theory
def test_an_attitude_that_returns_to_trim_has_no_literal_ratio():
    s = since(grid())
    result = coupling(both_axes(returning_attitude(s), 0.03 * np.sin(2.0 * s) * np.exp(-s)))
    peak_at = np.arctan2(2.0, 1.0) / 2.0  # of exp(-s) sin(2 s)
    off = 0.03 * np.sin(2.0 * peak_at) * np.exp(-peak_at)
    assert result.status[0] == Status.OK
    assert result.ratio[0] == pytest.approx(off / 0.15, rel=1e-6)
    assert result.on_axis_change[0] == pytest.approx(0.15 * 8.0 * np.exp(-7.0), rel=1e-6)
    assert result.status_literal[0] == Status.ON_AXIS_RETURNED
    assert np.isnan(result.ratio_literal[0])
    assert "peak" in Status.ON_AXIS_RETURNED.text


@pytest.mark.parametrize(("kept", "status"), [(RETURNED - 0.01, Status.ON_AXIS_RETURNED), (RETURNED + 0.01, Status.OK)])
def test_the_literal_ratio_needs_a_fraction_of_the_peak_at_4_s(kept, status):
    s = since(grid())
    back = np.sin(0.25 * np.pi * np.clip(s - 1.0, 0.0, 2.0)) ** 2
    theta = 0.1 * np.where(s <= 1.0, np.sin(0.5 * np.pi * s) ** 2, 1.0 - (1.0 - kept) * back)
    result = coupling(both_axes(theta, 0.1 * theta))
    assert result.status_literal[0] == status
    assert result.ratio[0] == pytest.approx(0.1, rel=1e-9)
    assert np.isnan(result.ratio_literal[0]) == (status != Status.OK)
    lenient = coupling(both_axes(theta, 0.1 * theta), returned=0.1)
    assert lenient.ratio_literal[0] == pytest.approx(0.1 / kept, rel=1e-5)


def test_a_symmetric_vehicle_couples_exactly_nothing_and_is_level_1():
    theta = returning_attitude(since(grid()))
    rounding = 1e-16 * np.sin(np.arange(theta.size))
    for phi in (np.zeros_like(theta), rounding):
        result = coupling(both_axes(theta, phi))
        assert result.ratio[0] == 0.0
        assert result.off_axis_peak[0] == 0.0
        assert result.level[0] == Level.LEVEL_1


def test_the_reference_vehicle_couples_nothing_in_pitch_and_a_little_in_roll():
    vehicle = levelone.load_vehicle("reference-evtol")
    pitched = coupling(levelone.simulate(vehicle, levelone.step("V_lon", 1.0, trim_speed=5.0, duration=6.0)))
    assert (pitched.ratio[0], pitched.level[0], pitched.status[0]) == (0.0, Level.LEVEL_1, Status.OK)
    assert pitched.status_literal[0] == Status.ON_AXIS_RETURNED
    rolled = coupling(levelone.simulate(vehicle, levelone.step("V_lat", 1.0, trim_speed=5.0, duration=6.0)), "roll")
    assert 0.0 < rolled.ratio[0] < rolled.ratio_literal[0]


@pytest.mark.parametrize(("ratio", "level"), [(0.249, 1), (0.251, 2), (0.599, 2), (0.601, 3)])
def test_levels_of_the_ratio_to_the_peak(ratio, level):
    theta = returning_attitude(since(grid()))
    assert coupling(both_axes(theta, ratio * theta)).level[0] == level


@settings(max_examples=30, deadline=None)
@given(factor=st.floats(1e-3, 1e3), on_sign=st.sampled_from([-1.0, 1.0]), off_sign=st.sampled_from([-1.0, 1.0]))
def test_ratios_do_not_depend_on_size_or_sign(factor, on_sign, off_sign):
    s = since(grid())
    theta, phi = held_attitude(s), returning_attitude(s, 0.02, 0.8)
    before = coupling(both_axes(theta, phi))
    after = coupling(both_axes(on_sign * factor * theta, off_sign * factor * phi))
    assert after.ratio[0] == pytest.approx(before.ratio[0], rel=1e-9)
    assert after.ratio_literal[0] == pytest.approx(before.ratio_literal[0], rel=1e-9)
    assert after.off_axis_peak[0] == pytest.approx(factor * before.off_axis_peak[0], rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(damping=st.floats(0.1, 0.9), at=st.floats(0.3, 2.0))
def test_the_ratio_to_the_peak_is_never_above_the_literal_one(damping, at):
    s = since(grid())
    result = coupling(both_axes(held_attitude(s, damping), returning_attitude(s, 0.05, at)))
    assert result.ratio[0] <= result.ratio_literal[0]


def test_trim_is_taken_off_and_a_batch_equals_a_loop():
    s = since(grid())
    size = np.array([[0.1], [0.2], [0.3]])
    history = both_axes(size * held_attitude(s), size**2 * returning_attitude(s))
    plain, trimmed = (
        coupling(history),
        coupling(both_axes(size * held_attitude(s), size**2 * returning_attitude(s), trim=(-0.1, 0.02))),
    )
    for name in FIELDS:
        assert getattr(trimmed, name) == pytest.approx(getattr(plain, name), rel=1e-9)
        for run in range(3):
            assert getattr(coupling(history.select(run)), name)[0] == getattr(plain, name)[run]


def test_what_happens_after_the_window_does_not_count():
    s = since(grid())
    phi = returning_attitude(s, 0.02, 0.8)
    late = phi + np.where(s > 4.0, 0.5, 0.0)
    on = held_attitude(s)
    quiet, disturbed = coupling(both_axes(on, phi)), coupling(both_axes(on, late))
    assert disturbed.off_axis_peak[0] == quiet.off_axis_peak[0]
    assert disturbed.off_axis_peak[0] < 0.021


def test_a_window_may_end_between_samples():
    s = since(grid())
    theta, phi = -0.05 * s, 0.01 * s**2
    result = coupling(both_axes(theta, phi), window=2.0 + 0.3 * DT)
    assert result.on_axis_change[0] == pytest.approx(0.05 * (2.0 + 0.3 * DT), rel=1e-9)
    assert result.off_axis_peak[0] == pytest.approx(0.01 * (2.0 + 0.3 * DT) ** 2, rel=1e-9)


def test_roll_is_read_with_the_axes_exchanged():
    s = since(grid())
    theta, phi = held_attitude(s), returning_attitude(s, 0.02, 0.8)
    pitch, roll = coupling(both_axes(theta, phi)), coupling(both_axes(phi, theta), "roll")
    for name in FIELDS:
        assert getattr(pitch, name)[0] == getattr(roll, name)[0]


@pytest.mark.parametrize(
    ("spoil", "status"),
    [
        ("no pitch", Status.NO_ATTITUDE_CHANGE),
        ("ends before 4 s", Status.RECORD_TOO_SHORT),
        ("ends at the input", Status.RECORD_TOO_SHORT),
        ("missing roll", Status.RECORD_TOO_SHORT),
        ("unsteady pitch", Status.NOT_AT_TRIM),
        ("unsteady roll", Status.NOT_AT_TRIM),
        ("pitch below its own noise", Status.NOT_AT_TRIM),
    ],
)
def test_each_failure_has_its_status_and_no_value(spoil, status):
    time = grid()
    s = since(time)
    theta, phi = held_attitude(s), returning_attitude(s, 0.02)
    if spoil == "no pitch":
        theta = 0.0 * theta
    elif spoil.startswith("ends"):
        stop = 1245 if spoil == "ends before 4 s" else 255
        time, theta, phi = time[:stop], theta[:stop], phi[:stop]
    elif spoil == "missing roll":
        phi = np.where(s > 2.0, np.nan, phi)
    elif spoil == "unsteady pitch":
        theta = theta + 0.05
    elif spoil == "unsteady roll":
        phi = phi + 0.05
    elif spoil == "pitch below its own noise":
        theta = np.where(time < 1.0, 1e-3 * np.sin(40.0 * time), 0.0) + theta * 4e-3
    result = coupling(both_axes(theta, phi, time=time))
    assert result.status[0] == status
    assert result.status_literal[0] == result.status[0]
    assert result.level[0] == Level.UNDEFINED
    for name in FIELDS:
        assert np.isnan(getattr(result, name)[0])


def test_a_record_that_ends_exactly_with_the_window_is_long_enough():
    time = grid(5.0)
    s = since(time)
    result = coupling(both_axes(held_attitude(s), returning_attitude(s, 0.02), time=time))
    assert result.status[0] == Status.OK


def test_a_failed_run_keeps_its_own_status_and_leaves_the_others_alone():
    s = since(grid())
    history = both_axes(np.tile(held_attitude(s), (2, 1)), returning_attitude(s, 0.02), status=[Status.DIVERGED, Status.OK])
    result = coupling(history)
    assert result.status.tolist() == [Status.DIVERGED, Status.OK]
    assert np.isnan(result.ratio[0])
    assert result.ratio[1] > 0.0


NUMBERS = st.one_of(st.floats(-10.0, 10.0), st.sampled_from([0.0, 1e-300, 1e300, np.nan, np.inf]))


@settings(max_examples=150, deadline=None)
@given(theta=arrays(float, (2, 80), elements=NUMBERS), phi=arrays(float, (2, 80), elements=NUMBERS), quiet=st.booleans())
def test_a_value_is_undefined_exactly_where_its_status_says_so(theta, phi, quiet):
    if quiet:
        theta[:, :12] = phi[:, :12] = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        result = coupling(both_axes(theta, phi, time=np.arange(80) * 0.1))
    for names, status in ((("ratio", "on_axis_peak"), result.status), (("ratio_literal",), result.status_literal)):
        failed = np.array([Status(code).failed for code in status])
        for name in names:
            np.testing.assert_array_equal(np.isfinite(getattr(result, name)), ~failed)
    np.testing.assert_array_equal(result.level == Level.UNDEFINED, np.isnan(result.ratio))


def test_bad_input_says_what_is_allowed():
    s = since(grid())
    history = both_axes(held_attitude(s), returning_attitude(s, 0.02))
    with pytest.raises(InputError, match="did you mean 'pitch'"):
        coupling(history, "pich")
    with pytest.raises(InputError, match=r"window: is -1.0 s, must be positive"):
        coupling(history, window=-1.0)
    with pytest.raises(InputError, match="between 0 and 1"):
        coupling(history, returned=1.5)
    no_roll = replace(
        history,
        channels={name: values for name, values in history.channels.items() if name != "phi"},
        units={name: unit for name, unit in history.units.items() if name != "phi"},
        trim={name: value for name, value in history.trim.items() if name != "phi"},
    )
    with pytest.raises(InputError, match="unknown name 'phi'"):
        coupling(no_roll)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({}, "unknown name 'pitch_roll_coupling'"),
        ({"pitch_roll_coupling": {"level_1": 0.25}}, "unknown name 'level_2'"),
        ({"pitch_roll_coupling": {"level_1": "0.25", "level_2": 0.6}}, "must be a finite number"),
        ({"pitch_roll_coupling": {"level_1": 0.6, "level_2": 0.25}}, "two numbers that increase"),
        ({"pitch_roll_coupling": {"level_1": [0.1, 0.25], "level_2": 0.6}}, "two numbers that increase"),
    ],
)
def test_boundaries_without_usable_limits_are_refused(limits, message):
    s = since(grid())
    history = both_axes(held_attitude(s), returning_attitude(s, 0.02))
    with pytest.raises(InputError, match=message):
        coupling(history, boundaries=replace(load_boundaries(), limits=limits))
