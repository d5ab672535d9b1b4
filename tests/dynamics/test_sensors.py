"""The sensor unit: lags exact for ramps, delays of whole periods, nothing when it is ideal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from test_linear_response import sensor_unit
from vehicles import vehicle

from levelone.dynamics import simulate
from levelone.dynamics.integrate import sense
from levelone.dynamics.simulate import sensor_arrays
from levelone.handling.manoeuvres import Manoeuvre, step
from levelone.vehicle import SENSOR_CHANNELS, Sensors

PERIOD = 0.004
N = len(SENSOR_CHANNELS)


def seen(sensors: Sensors, signal: np.ndarray) -> np.ndarray:
    """[ticks, channels] what the unit makes of a signal that was constant before its first sample."""
    gain, late = sensor_arrays(sensors, PERIOD)
    past = np.tile(signal[0], (late.max() + 1, 1))
    memory = (1.0 - gain[:, 2]) * signal[0]
    out = np.empty_like(signal)
    for k, y in enumerate(signal):
        sense(y, gain, memory, late, past, k, out[k])
    return out


@pytest.mark.theory
def test_a_lag_follows_a_ramp_exactly() -> None:
    """First order: x - tau (1 - exp(-t / tau)) behind a ramp of slope one, at every tick."""
    lags = np.linspace(0.0, 0.2, N)
    t = PERIOD * np.arange(200)
    slopes = np.linspace(-2.0, 3.0, N)
    out = seen(Sensors(lag=lags), 1.0 + slopes * t[:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        behind = np.where(lags > 0.0, lags * (1.0 - np.exp(-t[:, None] / lags)), 0.0)
    np.testing.assert_allclose(out, 1.0 + slopes * (t[:, None] - behind), atol=1e-13)


def test_a_lag_is_the_filter_that_scipy_applies() -> None:
    signal = np.random.default_rng(0).normal(size=(300, N))
    lags = np.full(N, 0.05)
    ((a, b0, b1), *_), _ = sensor_arrays(Sensors(lag=lags), PERIOD)
    begin = (1.0 - b1) * signal[0]
    expected = np.array(
        [lfilter([b1, b0], [1.0, -a], column, zi=[first])[0] for column, first in zip(signal.T, begin, strict=True)]
    )
    np.testing.assert_allclose(seen(Sensors(lag=lags), signal), expected.T, atol=1e-12)


def test_a_delay_shifts_by_whole_periods() -> None:
    delays = np.arange(N)
    signal = np.random.default_rng(0).normal(size=(60, N))
    out = seen(Sensors(delay=delays), signal)
    for channel, late in enumerate(delays):
        expected = np.concatenate([np.full(late, signal[0, channel]), signal[: 60 - late, channel]])
        assert np.array_equal(out[:, channel], expected)


def test_an_ideal_unit_is_no_unit() -> None:
    manoeuvre = step("V_lon", 1.0, trim_speed=5.0, duration=3.0)
    without, ideal = (simulate(vehicle(sensors=unit), manoeuvre) for unit in (None, sensor_unit({"q": 1e-9}, {"q": 0})))
    for name, values in without.channels.items():
        np.testing.assert_allclose(ideal.channels[name], values, rtol=0.0, atol=1e-5, err_msg=name)
    assert np.array_equal(seen(Sensors(), np.arange(5.0 * N).reshape(5, N)), np.arange(5.0 * N).reshape(5, N))


def test_a_delay_of_every_sensor_is_a_delay_of_the_rotors() -> None:
    """The loop does not know where its delay sits: only the command is later by it."""
    periods = 5
    late_sensors = vehicle(sensors=sensor_unit({}, dict.fromkeys(SENSOR_CHANNELS, periods)))
    late_rotors = vehicle(rotors={"tau_d": periods * PERIOD})
    gust = np.zeros((751, 3))
    gust[:, 0] = 3.0 * np.sin(2.0 * PERIOD * np.arange(751))
    hold = Manoeuvre("gust", "velocity", "V_lon", 5.0, shape="none", duration=3.0)
    first, second = (simulate(craft, hold, gust=gust) for craft in (late_sensors, late_rotors))
    assert np.ptp(first.channels["q"]) > 0.01
    np.testing.assert_allclose(first.channels["q"], second.channels["q"], atol=1e-9)


def test_the_record_counts_the_sensors_delay() -> None:
    craft = vehicle(sensors=sensor_unit({}, {"q": 3, "theta": 5}), rotors={"tau_d": 0.01})
    history = simulate(craft, step("V_lon", 1.0, trim_speed=5.0, duration=2.0))
    np.testing.assert_allclose(history.delay, 0.01 + 5 * PERIOD)


def test_trim_holds_through_lagging_sensors() -> None:
    """Filters start from what they would show in trim."""
    craft = vehicle(sensors=sensor_unit(dict.fromkeys(SENSOR_CHANNELS, 0.1), dict.fromkeys(SENSOR_CHANNELS, 3)))
    history = simulate(craft, Manoeuvre("hold", "velocity", "V_lon", 5.0, shape="none", duration=5.0))
    assert np.abs(history.channels["q"]).max() < 1e-9
