from __future__ import annotations

import numpy as np
import pytest
from handling_signals import DT, batch, decaying_sine, decaying_sine_metrics, grid, second_difference
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling.levels import Level
from levelone.handling.quickness import attitude_quickness
from levelone.status import Status

FIELDS = ("quickness", "q_pk", "delta_theta_pk", "delta_theta_min", "t_q_pk", "t_theta_pk", "t_second")


def step_response(zeta, omega_n, *, time=None, **options):
    time = grid() if time is None else time
    rate, attitude = decaying_sine(time, zeta, omega_n)
    return batch(rate, attitude, time=time, **options)


@pytest.mark.theory
@pytest.mark.parametrize(("zeta", "omega_n"), [(0.35, 5.61), (0.2, 3.0), (0.6, 8.0), (-0.05, 4.0)])
def test_against_calculus(zeta, omega_n):
    result = attitude_quickness(step_response(zeta, omega_n))
    q_pk, theta_pk, theta_min, first, peak, second = decaying_sine_metrics(zeta, omega_n)
    assert result.status[0] == result.status_min[0] == Status.OK
    assert result.q_pk[0] == pytest.approx(q_pk, rel=1e-7)
    assert result.delta_theta_pk[0] == pytest.approx(theta_pk, rel=1e-7)
    assert result.delta_theta_min[0] == pytest.approx(theta_min, rel=1e-6)
    assert result.quickness[0] == pytest.approx(q_pk / theta_pk, rel=1e-7)
    times = [result.t_q_pk[0], result.t_theta_pk[0], result.t_second[0]]
    assert times == pytest.approx([1.0 + first, 1.0 + peak, 1.0 + second], abs=1e-5)


def test_nose_down_is_measured_as_a_magnitude_from_trim():
    plain = attitude_quickness(step_response(0.35, 5.61))
    trimmed = attitude_quickness(step_response(0.35, 5.61, trim_rate=0.01, trim_attitude=-0.12))
    assert plain.picks.value[0, 0] < 0.0
    for name in FIELDS:
        assert getattr(trimmed, name) == pytest.approx(getattr(plain, name), rel=1e-9)


@settings(max_examples=30, deadline=None)
@given(factor=st.floats(1e-3, 1e3), mirrored=st.booleans())
def test_amplitude_and_sign_of_the_response_leave_quickness_alone(factor, mirrored):
    time = grid()
    rate, attitude = decaying_sine(time, [0.3, 0.45], [5.0, 6.5])
    scale = -factor if mirrored else factor
    before = attitude_quickness(batch(rate, attitude, time=time))
    after = attitude_quickness(batch(scale * rate, scale * attitude, time=time))
    np.testing.assert_allclose(after.quickness, before.quickness, rtol=1e-10)
    np.testing.assert_allclose(after.delta_theta_min, factor * before.delta_theta_min, rtol=1e-10)
    np.testing.assert_array_equal(np.sign(after.picks.value), np.sign(scale) * np.sign(before.picks.value))


@settings(max_examples=20, deadline=None)
@given(shift=st.integers(0, 500))
def test_a_later_input_moves_times_only(shift):
    time = grid(14.0)
    begin = 1.0 + shift * DT
    rate, attitude = decaying_sine(time, 0.35, 5.61, begin=begin)
    late = attitude_quickness(batch(rate, attitude, time=time, on=begin))
    early = attitude_quickness(step_response(0.35, 5.61, time=time))
    assert late.quickness[0] == pytest.approx(early.quickness[0], rel=1e-9)
    assert late.t_second[0] - begin == pytest.approx(early.t_second[0] - 1.0, abs=1e-8)


def test_batch_equals_loop():
    history = step_response(np.linspace(0.2, 0.6, 7), np.linspace(4.0, 7.0, 7))
    together = attitude_quickness(history)
    for run in range(7):
        alone = attitude_quickness(history.select(run))
        for name in FIELDS:
            assert getattr(alone, name)[0] == getattr(together, name)[run]


@pytest.mark.parametrize("varied", ["zeta", "omega_n", "begin"])
def test_metrics_are_smooth_in_the_inputs(varied):
    time = grid(6.0)
    values = {"zeta": np.linspace(0.3, 0.4, 401), "omega_n": np.linspace(5.0, 6.0, 401), "begin": np.linspace(1.0, 1.02, 401)}
    inputs = {"zeta": 0.35, "omega_n": 5.61, "begin": 1.0017, varied: values[varied]}
    rate, attitude = decaying_sine(time, inputs["zeta"], inputs["omega_n"], begin=inputs["begin"])
    rate, attitude = np.broadcast_to(rate, (401, time.size)), np.broadcast_to(attitude, (401, time.size))
    result = attitude_quickness(batch(rate, attitude, time=time))
    exact = decaying_sine_metrics(inputs["zeta"], inputs["omega_n"])
    for name, closed in zip(("q_pk", "delta_theta_pk", "delta_theta_min"), exact, strict=False):
        metric = getattr(result, name)
        np.testing.assert_allclose(metric, closed, rtol=3e-7)
        assert second_difference(metric) < 1e-6 + second_difference(np.broadcast_to(closed, 401))
    staircase = np.abs(rate).max(axis=1)  # the largest sample, for comparison
    assert second_difference(staircase) > 20.0 * second_difference(result.q_pk)


def test_pitch_roll_and_yaw_read_their_own_channels():
    time = grid()
    history = step_response(0.35, 5.61)
    channels, trim = dict(history.channels), dict(history.trim)
    units = dict(history.units)
    for factor, axis_rate, axis_attitude in ((2.0, "p", "phi"), (3.0, "r", "psi")):
        channels[axis_rate], channels[axis_attitude] = factor * channels["q"], 0.5 * factor * channels["theta"]
        units[axis_rate], units[axis_attitude] = "rad/s", "rad"
        trim[axis_rate] = trim[axis_attitude] = np.zeros(1)
    # a heading recorded within half a turn, from a trim close to its edge
    channels["psi"] = (channels["psi"] - 3.1 + np.pi) % (2.0 * np.pi) - np.pi
    trim["psi"] = np.array([-3.1])
    full = type(history)(time, channels, units, trim, "V_lon_ref", 1.0, np.nan, history.delay, history.wind, history.status)
    assert np.abs(np.diff(channels["psi"])).max() > 6.0
    pitch, roll, yaw = (attitude_quickness(full, axis) for axis in ("pitch", "roll", "yaw"))
    assert roll.quickness[0] == pytest.approx(2.0 * pitch.quickness[0], rel=1e-9)
    assert yaw.quickness[0] == pytest.approx(2.0 * pitch.quickness[0], rel=1e-9)
    assert yaw.delta_theta_pk[0] == pytest.approx(1.5 * pitch.delta_theta_pk[0], rel=1e-9)


def test_attitude_that_comes_to_rest_without_turning_back_counts_its_whole_change():
    time = grid()
    s = np.maximum(time - 1.0, 0.0)
    rate = -0.4 * s * np.exp(-3.0 * s)
    attitude = -0.4 * (1.0 - np.exp(-3.0 * s) * (1.0 + 3.0 * s)) / 9.0
    result = attitude_quickness(batch(rate, attitude, time=time))
    assert result.status[0] == Status.OK
    assert result.delta_theta_pk[0] == pytest.approx(0.4 / 9.0, rel=1e-6)
    assert result.q_pk[0] == pytest.approx(0.4 / 3.0 * np.exp(-1.0), rel=1e-7)
    assert result.status_min[0] == Status.NO_SECOND_STATIONARY_POINT
    assert np.isnan(result.delta_theta_min[0])
    assert result.level[0] == Level.UNDEFINED


def test_level_is_outside_the_requirement_below_5_deg_and_counted_apart():
    small = attitude_quickness(step_response(0.35, 5.61))
    assert np.degrees(small.delta_theta_min[0]) < 5.0
    assert small.level[0] == Level.OUTSIDE
    assert small.level_extrapolated[0] == Level.LEVEL_1
    time = grid()
    rate, attitude = decaying_sine(time, 0.35, 5.61, amplitude=-1.2)
    large = attitude_quickness(batch(rate, attitude, time=time))
    assert np.degrees(large.delta_theta_min[0]) > 5.0
    assert large.level[0] == Level.LEVEL_1
    rate, attitude = decaying_sine(time, 0.35, 1.2, amplitude=-0.2)
    slow = attitude_quickness(batch(rate, attitude, time=time))
    assert slow.quickness[0] < 1.5
    assert slow.level[0] == Level.LEVEL_2


@pytest.mark.parametrize(
    ("spoil", "status", "status_min"),
    [
        ("nothing", Status.NO_FIRST_PEAK, Status.NO_FIRST_PEAK),
        ("ramp", Status.RECORD_TOO_SHORT, Status.RECORD_TOO_SHORT),
        ("constant rate", Status.NO_FIRST_PEAK, Status.NO_FIRST_PEAK),
        ("ends at input", Status.RECORD_TOO_SHORT, Status.RECORD_TOO_SHORT),
        ("cut before second", Status.OK, Status.RECORD_TOO_SHORT),
        ("no attitude", Status.NO_ATTITUDE_CHANGE, Status.OK),
        ("unsteady", Status.NOT_AT_TRIM, Status.NOT_AT_TRIM),
        ("missing samples", Status.RECORD_TOO_SHORT, Status.RECORD_TOO_SHORT),
    ],
)
def test_each_failure_has_its_status_and_no_value(spoil, status, status_min):
    time = grid()
    rate, attitude = decaying_sine(time, 0.35, 5.61)
    s = np.maximum(time - 1.0, 0.0)
    if spoil == "nothing":
        rate, attitude = 0.0 * rate, 0.0 * attitude
    elif spoil == "ramp":
        rate, attitude = -0.1 * s[None], -0.05 * s[None] ** 2
    elif spoil == "constant rate":
        rate, attitude = -0.1 * (1.0 - np.exp(-6.0 * s))[None], -0.1 * s[None]
    elif spoil == "ends at input":
        time, rate, attitude = time[:255], rate[:, :255], attitude[:, :255]
    elif spoil == "cut before second":
        stop = round(1.75 / DT)  # after the attitude's peak, before the rate's second
        time, rate, attitude = time[:stop], rate[:, :stop], attitude[:, :stop]
    elif spoil == "no attitude":
        attitude = 0.0 * attitude
    elif spoil == "unsteady":
        rate = rate + 0.05
    elif spoil == "missing samples":
        rate = rate.copy()
        rate[:, 300:] = np.nan
    result = attitude_quickness(batch(rate, attitude, time=time))
    assert (result.status[0], result.status_min[0]) == (status, status_min)
    assert np.isnan(result.quickness[0]) == (status != Status.OK)
    assert np.isnan(result.delta_theta_min[0]) == (status_min != Status.OK)


def test_a_failed_run_keeps_its_own_status_and_leaves_the_others_alone():
    history = step_response([0.3, 0.3], [5.0, 5.0], status=[Status.DIVERGED, Status.OK])
    result = attitude_quickness(history)
    assert result.status.tolist() == [Status.DIVERGED, Status.OK]
    assert np.isnan(result.quickness[0])
    assert result.quickness[1] > 0.0


def test_bad_input_says_what_is_allowed():
    history = step_response(0.35, 5.61)
    with pytest.raises(InputError, match="did you mean 'pitch'"):
        attitude_quickness(history, "pich")
    with pytest.raises(InputError, match=r"unknown name 'p'"):
        attitude_quickness(history, "roll")
    with pytest.raises(InputError, match="between 0 and 1"):
        attitude_quickness(history, prominence=2.0)
