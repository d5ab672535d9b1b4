from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from handling_signals import DT, grid, second_difference
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import brentq

import levelone
from levelone.errors import InputError
from levelone.handling.froude import froude_scaled
from levelone.handling.history import TimeHistory
from levelone.handling.levels import Level, load_boundaries
from levelone.handling.translation import BAND, RISE, rise_time_levels, translational_rate
from levelone.status import Status

FIELDS = ("rise_time", "overshoot", "settling_time", "commanded")


def speed_record(change, *, command=1.0, time=None, on=1.0, off=np.nan, status=None, trim=5.0, axis="V_lon"):
    """A record of ground speed after a step: ``change`` from trim, ``[run, time]``; ``command`` for each run, or as changes."""
    time = grid() if time is None else time
    change = np.atleast_2d(change)
    runs = change.shape[0]
    command = np.asarray(command, dtype=float)
    if command.ndim < 2:
        command = np.where(time >= on - 1e-9, np.broadcast_to(command, (runs,))[:, None], 0.0)
    reference = f"{axis}_ref"
    return TimeHistory(
        time=time,
        channels={reference: trim + command, axis: trim + change},
        units={reference: "m/s", axis: "m/s"},
        trim={reference: np.full(runs, trim), axis: np.full(runs, trim)},
        input_name=reference,
        input_on=on,
        input_off=off,
        delay=np.zeros(runs),
        wind=(0.0, 0.0, 0.0),
        status=np.zeros(runs, dtype=np.int64) if status is None else np.asarray(status, dtype=np.int64),
    )


def since(time, on=1.0):
    return np.maximum(time - on, 0.0)


def first_order(s, tau):
    return 1.0 - np.exp(-s / tau)


def second_order(s, zeta, omega):
    damped = omega * np.sqrt(1.0 - zeta**2)
    return 1.0 - np.exp(-zeta * omega * s) * (np.cos(damped * s) + zeta * omega / damped * np.sin(damped * s))


@pytest.mark.theory
@pytest.mark.parametrize("tau", [0.3, 0.93, 2.0, 3.5])
@pytest.mark.parametrize("delay", [0.0, 0.1])
def test_a_first_order_response_reads_its_time_constant(tau, delay):
    result = translational_rate(speed_record(first_order(since(grid(12.0), 1.0 + delay), tau), time=grid(12.0)))
    assert result.status[0] == Status.OK
    assert result.rise_time[0] == pytest.approx(tau + delay, rel=1e-9)
    assert result.settling_time[0] == pytest.approx(-tau * np.log(BAND) + delay, rel=1e-9)
    assert result.overshoot[0] == 0.0
    assert result.commanded[0] == pytest.approx(1.0)


@pytest.mark.theory
@pytest.mark.parametrize(("zeta", "omega"), [(0.35, 2.0), (0.6, 1.2), (0.8, 0.9)])
def test_a_second_order_response_against_closed_forms(zeta, omega):
    time = grid(16.0)
    result = translational_rate(speed_record(second_order(since(time), zeta, omega), time=time))
    half_period = np.pi / (omega * np.sqrt(1.0 - zeta**2))
    rise = brentq(lambda s: second_order(s, zeta, omega) - RISE, 0.0, half_period, xtol=1e-13)
    assert result.rise_time[0] == pytest.approx(rise, rel=1e-9)
    assert result.overshoot[0] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2)), rel=1e-7)
    # the last crossing of the band lies after the last half-cycle whose extremum leaves it
    leaves = [k for k in range(1, 20) if np.exp(-k * half_period * zeta * omega) > BAND]
    k = leaves[-1] if leaves else 0
    side = -1.0 if k % 2 == 0 else 1.0
    settles = brentq(lambda s: second_order(s, zeta, omega) - 1.0 - side * BAND, k * half_period, (k + 1) * half_period, xtol=1e-13)
    assert result.settling_time[0] == pytest.approx(settles, rel=1e-9)


@pytest.mark.parametrize(
    ("tau", "level", "status"),
    [
        (2.49, Level.LEVEL_2, Status.LEVEL_2_AT_BEST),
        (2.51, Level.LEVEL_1, Status.OK),
        (4.99, Level.LEVEL_1, Status.OK),
        (5.01, Level.LEVEL_2, Status.LEVEL_2_AT_BEST),
    ],
)
def test_the_level_comes_from_the_rise_time(tau, level, status):
    time = grid(20.0)
    result = translational_rate(speed_record(first_order(since(time), tau), time=time))
    assert (result.level[0], result.status[0], result.status_level[0]) == (level, Status.OK, status)
    assert not Status.LEVEL_2_AT_BEST.failed


def test_the_limits_of_the_rise_time_are_inclusive():
    found = rise_time_levels([2.4, 2.5, 3.0, 5.0, 5.1, np.nan], load_boundaries())
    assert found.tolist() == [Level.LEVEL_2, Level.LEVEL_1, Level.LEVEL_1, Level.LEVEL_1, Level.LEVEL_2, Level.UNDEFINED]


def test_overshoot_alone_sets_no_level():
    time = grid(60.0)
    result = translational_rate(speed_record(second_order(since(time), 0.3, 0.4), time=time))
    assert result.overshoot[0] > 0.3
    assert result.level[0] == Level.LEVEL_1


@settings(max_examples=30, deadline=None)
@given(tau=st.floats(0.5, 6.0), ratio=st.floats(0.25, 20.0))
def test_a_froude_similar_aircraft_has_the_same_level_at_the_scaled_limits(tau, ratio):
    if min(abs(tau - 2.5), abs(tau - 5.0)) < 1e-6:
        tau += 1e-3
    time = grid(24.0, dt=0.02)
    small = time / np.sqrt(ratio)
    full = translational_rate(speed_record(first_order(since(time), tau), time=time))
    scaled = translational_rate(
        speed_record(first_order(since(small, 1.0 / np.sqrt(ratio)), tau / np.sqrt(ratio)), time=small, on=1.0 / np.sqrt(ratio)),
        boundaries=froude_scaled(load_boundaries(), 1.0, ratio),
    )
    assert scaled.rise_time[0] == pytest.approx(full.rise_time[0] / np.sqrt(ratio), rel=1e-9)
    assert scaled.level[0] == full.level[0]


@settings(max_examples=30, deadline=None)
@given(amplitude=st.floats(0.01, 20.0), backwards=st.booleans())
def test_size_and_direction_of_the_step_do_not_matter(amplitude, backwards):
    y = second_order(since(grid()), 0.5, 1.8)
    size = -amplitude if backwards else amplitude
    one, other = translational_rate(speed_record(y)), translational_rate(speed_record(size * y, command=size))
    for name in ("rise_time", "overshoot", "settling_time"):
        assert getattr(other, name)[0] == pytest.approx(getattr(one, name)[0], rel=1e-7)
    assert other.commanded[0] == pytest.approx(size)


@settings(max_examples=20, deadline=None)
@given(shift=st.integers(0, 500))
def test_times_count_from_the_input(shift):
    time = grid(14.0)
    on = 1.0 + shift * DT
    late = translational_rate(speed_record(second_order(since(time, on), 0.5, 1.8), time=time, on=on))
    early = translational_rate(speed_record(second_order(since(time), 0.5, 1.8), time=time))
    assert late.rise_time[0] == pytest.approx(early.rise_time[0], rel=1e-9)
    assert late.settling_time[0] == pytest.approx(early.settling_time[0], rel=1e-9)


def test_the_rise_time_is_smooth_in_the_response():
    tau = np.linspace(1.0, 1.02, 401)
    result = translational_rate(speed_record(first_order(since(grid()), tau[:, None])))
    np.testing.assert_allclose(result.rise_time, tau, rtol=1e-9)
    y = first_order(since(grid()), tau[:, None])
    staircase = grid()[np.argmax(y >= RISE, axis=1)]  # the first sample above, for comparison
    assert second_difference(staircase) > 1e3 * second_difference(result.rise_time)


def test_batch_equals_loop_and_failures_leave_the_others_alone():
    y = second_order(since(grid()), np.array([[0.4], [0.5], [0.7]]), 1.8)
    history = speed_record(y, command=[1.0, 1.0, 1.0], status=[Status.OK, Status.DIVERGED, Status.OK])
    together = translational_rate(history)
    assert together.status.tolist() == [Status.OK, Status.DIVERGED, Status.OK]
    assert together.level[1] == Level.UNDEFINED
    for name in FIELDS:
        assert np.isnan(getattr(together, name)[1])
        for run in (0, 2):
            assert getattr(translational_rate(history.select(run)), name)[0] == getattr(together, name)[run]


def test_lateral_speed_is_read_from_its_own_channels():
    y = second_order(since(grid()), 0.5, 1.8)
    lateral = translational_rate(speed_record(y, axis="V_lat", trim=0.0), "V_lat")
    assert lateral.rise_time[0] == pytest.approx(translational_rate(speed_record(y)).rise_time[0], rel=1e-9)


@pytest.mark.parametrize(
    ("spoil", "status"),
    [
        ("slow", Status.NOT_SETTLED),
        ("oscillates", Status.NOT_SETTLED),
        ("grows", Status.NOT_SETTLED),
        ("stops short", Status.OTHER_FINAL_SPEED),
        ("stays", Status.OTHER_FINAL_SPEED),
        ("no command", Status.NO_STEADY_COMMAND),
        ("ramp command", Status.NO_STEADY_COMMAND),
        ("unsteady", Status.NOT_AT_TRIM),
        ("missing samples", Status.RECORD_TOO_SHORT),
        ("ends at input", Status.RECORD_TOO_SHORT),
        ("ends soon", Status.NOT_SETTLED),
    ],
)
def test_each_failure_has_its_status_and_no_value(spoil, status):
    time = grid()
    s = since(time)
    y, command = second_order(s, 0.5, 1.8), np.where(time >= 1.0 - 1e-9, 1.0, 0.0)
    if spoil == "slow":
        y = first_order(s, 6.0)
    elif spoil == "oscillates":
        y = first_order(s, 0.5) * (1.0 + 0.3 * np.sin(8.0 * s))
    elif spoil == "grows":
        y = np.exp(0.5 * s) - 1.0
    elif spoil == "stops short":
        y = 0.8 * y
    elif spoil == "stays":
        y = 0.0 * y
    elif spoil == "no command":
        command = 0.0 * command
    elif spoil == "ramp command":
        command = s
    elif spoil == "unsteady":
        y = np.where(time < 0.5, 0.2, y)
    elif spoil == "missing samples":
        y = np.where(time > 7.0, np.nan, y)
    elif spoil.startswith("ends"):
        stop = 255 if spoil == "ends at input" else 500
        time, y, command = time[:stop], y[:stop], command[:stop]
    result = translational_rate(speed_record(y, command=command[None], time=time))
    assert (result.status[0], result.status_level[0]) == (status, status)
    assert result.level[0] == Level.UNDEFINED
    for name in FIELDS:
        assert np.isnan(getattr(result, name)[0])


def test_the_band_decides_what_counts_as_settled():
    history = speed_record(0.96 * first_order(since(grid()), 0.5))
    assert translational_rate(history).status[0] == Status.OK
    assert translational_rate(history, band=0.03).status[0] == Status.OTHER_FINAL_SPEED
    # 1 - 1/e of the commanded change, not of what is reached
    assert translational_rate(history).rise_time[0] == pytest.approx(-0.5 * np.log(1.0 - RISE / 0.96), rel=1e-9)


def test_a_simulated_step_is_read():
    vehicle = levelone.load_vehicle("reference-evtol")
    history = levelone.simulate(vehicle, levelone.step("V_lon", 1.0, trim_speed=5.0, duration=30.0), channels=("V_lon",))
    result = translational_rate(history)
    assert result.status[0] == Status.OK
    change = history.change("V_lon")[0]
    first = np.argmax(change >= RISE)
    assert history.time[first - 1] <= result.rise_time[0] + 1.0 <= history.time[first]
    assert result.overshoot[0] == pytest.approx(max(change.max() - 1.0, 0.0), abs=1e-5)


NUMBERS = st.one_of(st.floats(-3.0, 3.0), st.sampled_from([0.0, 1.0, 1e-300, 1e300, np.nan, np.inf]))


@settings(max_examples=150, deadline=None)
@given(y=arrays(float, (3, 40), elements=NUMBERS), command=arrays(float, (3, 40), elements=NUMBERS), how=st.integers(0, 2))
def test_a_value_is_undefined_exactly_where_its_status_says_so(y, command, how):
    if how > 0:
        y[:, :20] = command[:, :20] = 0.0
        command[:, 20:] = 1.0
    if how > 1:
        y[:, 34:] = 1.0
    with np.errstate(over="ignore", invalid="ignore"):
        result = translational_rate(speed_record(y, command=command, time=np.arange(40) * 0.05, trim=0.0))
    failed = np.array([Status(code).failed for code in result.status])
    for name in ("rise_time", "overshoot", "settling_time", "commanded"):
        np.testing.assert_array_equal(np.isfinite(getattr(result, name)), ~failed)
    np.testing.assert_array_equal(result.level == Level.UNDEFINED, failed)
    assert (result.rise_time[~failed] >= 0.0).all()
    assert (result.overshoot[~failed] >= 0.0).all()
    assert (result.settling_time[~failed] >= 0.0).all()


def test_bad_input_says_what_is_allowed():
    history = speed_record(first_order(since(grid()), 1.0))
    with pytest.raises(InputError, match="did you mean 'V_lon'"):
        translational_rate(history, "V_lom")
    with pytest.raises(InputError, match="unknown name 'V_lat_ref'"):
        translational_rate(history, "V_lat")
    with pytest.raises(InputError, match=r"input_off: is 2.0 s: the rise time needs a step that stays"):
        translational_rate(replace(history, input_off=2.0))
    with pytest.raises(InputError, match=r"band: is 0.5, must lie between 0 and 0.368"):
        translational_rate(history, band=0.5)
    with pytest.raises(InputError, match="unknown name 'translational_rate'"):
        translational_rate(history, boundaries=replace(load_boundaries(), limits={}))
    reversed_limits = {"translational_rate": {"rise_time_level_1": [5.0, 2.5]}}
    with pytest.raises(InputError, match="must be two numbers that increase"):
        translational_rate(history, boundaries=replace(load_boundaries(), limits=reversed_limits))
