from __future__ import annotations

import numpy as np
import pytest
from handling_signals import DT, REFERENCE, batch, grid, second_difference
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling.damping import damping_from_ratio, dynamic_stability
from levelone.handling.levels import Level
from levelone.status import Status

OFF = 1.5


def free_response(zeta, omega_n, *, phase=0.3, amplitude=0.2, duration=10.0, delay=0.0, begin=OFF):
    """A rate that oscillates freely from the end of the pulse plus the delay, ``[run, time]``."""
    time = grid(duration)
    zeta, omega_n, phase, delay = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in (zeta, omega_n, phase, delay)))
    s = np.maximum(time - begin - delay[:, None], 0.0)
    omega = omega_n * np.sqrt(1.0 - zeta**2)
    rate = amplitude * np.exp(-(zeta * omega_n)[:, None] * s) * np.cos(omega[:, None] * s - phase[:, None])
    rate = np.where(time >= begin + delay[:, None] - 1e-9, rate, 0.0)
    return batch(rate, 0.1 * rate, time=time, off=begin, delay=delay)


@pytest.mark.theory
@pytest.mark.parametrize("case", REFERENCE["damping"]["case"], ids=lambda case: f"zeta={case['zeta']}")
def test_reference_vectors(case):
    tolerance = REFERENCE["damping"]["tolerance"]
    result = dynamic_stability(free_response(case["zeta"], case["omega_n"], phase=np.linspace(0.2, 2.8, 14)))
    assert (result.status == Status.OK).all()
    for name in ("zeta", "omega_n", "peak_ratio", "damped_period"):
        np.testing.assert_allclose(getattr(result, name), case[name], rtol=tolerance)


@pytest.mark.theory
def test_closed_form_between_samples():
    zeta, omega_n = np.meshgrid(np.linspace(-0.1, 0.6, 15), np.linspace(3.0, 8.0, 7))
    result = dynamic_stability(free_response(zeta.ravel(), omega_n.ravel(), phase=0.6))
    assert (result.status == Status.OK).all()
    assert (result.status_omega == Status.OK).all()
    np.testing.assert_allclose(result.zeta, zeta.ravel(), atol=1e-6)
    np.testing.assert_allclose(result.omega_n, omega_n.ravel(), rtol=2e-6)


def test_ratio_above_one_is_a_negative_damping():
    assert damping_from_ratio(np.array([1.0, 2.0]))[0] == 0.0
    assert damping_from_ratio(np.array([1.0, 2.0]))[1] == pytest.approx(-np.log(2) / np.hypot(np.pi, np.log(2)))
    result = dynamic_stability(free_response(-0.08, 5.0, duration=6.0))
    assert result.peak_ratio[0] > 1.0
    assert result.zeta[0] == pytest.approx(-0.08, abs=1e-6)
    assert result.level[0] == Level.LEVEL_3


@settings(max_examples=30, deadline=None)
@given(factor=st.floats(1e-3, 1e3), mirrored=st.booleans(), offset=st.floats(-0.5, 0.5))
def test_amplitude_sign_and_trim_leave_damping_alone(factor, mirrored, offset):
    history = free_response([0.2, 0.4], [5.0, 6.0])
    rate = history.channels["q"] * (-factor if mirrored else factor)
    before = dynamic_stability(history)
    after = dynamic_stability(batch(rate, rate, time=history.time, off=OFF, trim_rate=offset))
    np.testing.assert_allclose(after.zeta, before.zeta, rtol=1e-7)
    np.testing.assert_allclose(after.omega_n, before.omega_n, rtol=1e-6)


def test_free_response_begins_after_every_delay():
    # until the delay has passed the rate still answers the pulse: its peak there is not the first free one
    history = free_response(0.3, 5.0, delay=[0.0, 0.1, 0.25])
    rate = history.channels["q"].copy()
    time = history.time
    for run, delay in enumerate(history.delay):
        forced = (time > 1.0) & (time < OFF + delay - 1e-9)
        rate[run, forced] = 0.15 * np.sin(5.0 * np.pi * (time[forced] - 1.0))
    result = dynamic_stability(batch(rate, rate, time=time, off=OFF, delay=history.delay))
    np.testing.assert_allclose(result.zeta, 0.3, atol=1e-5)
    np.testing.assert_allclose(np.diff(result.times[:, 0]), np.diff(history.delay), atol=1e-6)
    wrong = dynamic_stability(batch(rate, rate, time=time, off=OFF))
    assert abs(wrong.zeta[2] - 0.3) > 0.05


@pytest.mark.parametrize("varied", ["zeta", "omega_n", "delay"])
def test_metrics_are_smooth_in_the_inputs(varied):
    values = {"zeta": np.linspace(0.3, 0.4, 401), "omega_n": np.linspace(5.0, 6.0, 401), "delay": np.linspace(0.0, 0.02, 401)}
    inputs = {"zeta": 0.35, "omega_n": 5.61, "delay": 0.0013, varied: values[varied]}
    result = dynamic_stability(free_response(**inputs, phase=0.9))
    assert (result.status_omega == Status.OK).all()
    np.testing.assert_allclose(result.zeta, inputs["zeta"], atol=1e-6)
    np.testing.assert_allclose(result.omega_n, inputs["omega_n"], rtol=1e-6)
    assert second_difference(result.zeta) < 1e-6
    assert second_difference(result.omega_n) < 1e-6


@pytest.mark.parametrize(
    ("spoil", "status", "status_omega"),
    [
        ("nothing", Status.NO_FIRST_PEAK, Status.NO_FIRST_PEAK),
        ("decay", Status.NO_FIRST_PEAK, Status.NO_FIRST_PEAK),
        ("well damped", Status.NO_VALLEY, Status.NO_VALLEY),
        ("same side", Status.NO_VALLEY, Status.NO_VALLEY),
        ("cut in valley", Status.RECORD_TOO_SHORT, Status.RECORD_TOO_SHORT),
        ("dies after valley", Status.OK, Status.NO_SECOND_PEAK),
        ("cut before second peak", Status.OK, Status.RECORD_TOO_SHORT),
        ("ends with the pulse", Status.RECORD_TOO_SHORT, Status.RECORD_TOO_SHORT),
        ("unsteady", Status.NOT_AT_TRIM, Status.NOT_AT_TRIM),
    ],
)
def test_each_failure_has_its_status_and_no_value(spoil, status, status_omega):
    time = grid()
    s = np.maximum(time - OFF, 0.0)
    rate = free_response(0.3, 5.0, phase=0.8).channels["q"]
    if spoil == "nothing":
        rate = 0.0 * rate
    elif spoil == "decay":
        rate = np.where(time >= OFF, np.exp(-2.0 * s), 0.0)[None]
    elif spoil == "well damped":
        rate = (s * np.exp(-3.0 * s))[None]
    elif spoil == "same side":
        rate = np.where(time >= OFF, (1.0 + np.exp(-s) * np.sin(5.0 * s)) * np.exp(-0.1 * s), 0.0)[None]
    elif spoil == "dies after valley":
        rate = free_response(0.8, 5.0, phase=0.8).channels["q"]
    elif spoil == "unsteady":
        rate = rate + 0.05
    cut = {"cut in valley": 2.2, "cut before second peak": 2.5, "ends with the pulse": 1.5}.get(spoil, 10.0)
    stop = round(cut / DT) + 1
    result = dynamic_stability(batch(rate[:, :stop], rate[:, :stop], time=time[:stop], off=OFF))
    assert (result.status[0], result.status_omega[0]) == (status, status_omega)
    assert np.isnan(result.zeta[0]) == (status != Status.OK)
    assert np.isnan(result.omega_n[0]) == (status_omega != Status.OK)


def test_zeta_may_stand_where_omega_n_does_not_and_still_give_a_level():
    result = dynamic_stability(free_response(0.8, 5.0, phase=0.8))
    assert result.zeta[0] == pytest.approx(0.8, abs=1e-4)
    assert np.isnan(result.omega_n[0])
    assert result.level[0] == Level.LEVEL_1


def test_an_input_that_never_ends_is_refused():
    history = free_response(0.3, 5.0)
    step = batch(history.channels["q"], history.channels["theta"], time=history.time)
    with pytest.raises(InputError, match="needs an input that ends"):
        dynamic_stability(step)
