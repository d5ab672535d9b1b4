from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import integrate, signal

from levelone.errors import InputError
from levelone.handling.bandwidth import bandwidth
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.identification import identify
from levelone.handling.joint_identification import identify_records, random_error
from levelone.handling.records import record
from levelone.status import Status

DT = 0.04
LOW, HIGH = 0.3, 12.0
SYSTEM = ([25.0], [1.0, 7.0, 25.0])


def swept(length, noise=0.0, rng=None, dt=DT):
    """A linear sweep through the system, its output with white noise of standard deviation ``noise``."""
    time = np.arange(round((length + 10.0) / dt) + 1) * dt
    s = np.clip(time - 2.0, 0.0, length)
    fade = np.clip(np.minimum(s, length - s) / 2.0, 0.0, 1.0)
    command = fade * np.sin(LOW * s + 0.5 * (HIGH - LOW) / length * s**2)
    answer = signal.lsim(SYSTEM, command, time)[1]
    if noise:
        answer = answer + noise * rng.standard_normal(time.size)
    zero = {"stick": 0.0, "theta": 0.0}
    channels = {"stick": command, "theta": answer}
    return record(time, channels, input_name="stick", input_on=2.0, trim=zero, units={"stick": "1"})


def noisy(clean, noise, rng):
    answer = clean.channels["theta"] + noise * rng.standard_normal(clean.channels["theta"].shape)
    return dataclasses.replace(clean, channels={**clean.channels, "theta": answer})


def exact(omega):
    s = 1j * omega
    return np.polyval(SYSTEM[0], s) / np.polyval(SYSTEM[1], s)


def known_coherence(records, noise, omega):
    """By the definition: what share of the output's energy at each frequency is the answer to the input."""
    swept_energy = sum(np.abs(DT * np.exp(-1j * np.outer(omega, each.time)) @ each.channels["stick"][0]) ** 2 for each in records)
    noise_energy = noise**2 * DT * sum(each.time.size * DT for each in records)
    return 1.0 / (1.0 + noise_energy / (np.abs(exact(omega)) ** 2 * swept_energy))


def test_one_record_gives_the_numbers_of_identify():
    history = swept(60.0, 0.3, np.random.default_rng(1))
    alone, joint = identify(history, "theta"), identify_records([history], "theta")
    np.testing.assert_array_equal(joint.response.value, alone.value[0])
    np.testing.assert_array_equal(joint.response.coherence, alone.coherence[0])
    assert joint.used == 1


def test_copies_of_a_record_change_nothing_but_the_number_of_averages():
    history = swept(60.0, 0.3, np.random.default_rng(1))
    one, four = identify_records([history], "theta", windows=15.0), identify_records([history] * 4, "theta", windows=15.0)
    np.testing.assert_allclose(four.response.value, one.response.value, rtol=1e-12)
    np.testing.assert_allclose(four.response.coherence, one.response.coherence, rtol=1e-12)
    np.testing.assert_allclose(four.averages, 4.0 * one.averages, rtol=1e-12)
    np.testing.assert_allclose(four.error, 0.5 * one.error, rtol=1e-9)


def hann_correlation(tau):
    """Autocorrelation of a Hann window of length 1, 1 at no lag (closed form)."""
    return (1.0 - tau) * (2.0 + np.cos(2.0 * np.pi * tau)) / 3.0 + np.sin(2.0 * np.pi * tau) / (2.0 * np.pi)


@pytest.mark.theory
@pytest.mark.parametrize(("taper", "correlation"), [("boxcar", lambda tau: 1.0 - tau), ("hann", hann_correlation)])
def test_averages_are_the_record_over_the_correlation_length_of_the_taper(taper, correlation):
    history = swept(60.0, 0.3, np.random.default_rng(1))
    found = identify_records([history, history], "theta", windows=14.0, taper=taper)
    shared = 14.0 * 2.0 * integrate.quad(lambda tau: correlation(tau) ** 2, 0.0, 1.0)[0]
    np.testing.assert_allclose(found.averages, 2 * history.time.size * DT / shared, rtol=2e-3)


@pytest.mark.theory
def test_records_of_different_length_give_the_system():
    found = identify_records([swept(60.0), swept(80.0), swept(100.0)], "theta")
    inside = (found.response.omega > 0.6) & (found.response.omega < 11.0)
    ratio = found.response.value[inside] / exact(found.response.omega[inside])
    assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < 0.3
    assert np.abs(np.degrees(np.angle(ratio))).max() < 1.0
    assert found.response.coherence[inside].min() > 0.98


@pytest.mark.theory
def test_no_segment_lies_across_a_joint():
    """Records whose trims differ: one after the other in time they would hold a step of the output."""
    first, second = swept(60.0), swept(60.0)
    lifted = dataclasses.replace(
        second,
        channels={**second.channels, "theta": second.channels["theta"] + 3.0},
        trim={**second.trim, "theta": np.array([3.0])},
    )
    apart, level = identify_records([first, lifted], "theta"), identify_records([first, second], "theta")
    np.testing.assert_allclose(apart.response.value, level.response.value, rtol=1e-9)


@pytest.mark.theory
def test_random_error_is_that_of_the_books():
    """Bendat and Piersol: sqrt(1 - gamma^2) / (|gamma| sqrt(2 n)); a coherence of 0.5 with 8 averages gives 1/4."""
    response = FrequencyResponse(np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0j, np.nan]), np.array([0.5, 1.0, 0.5]))
    np.testing.assert_allclose(random_error(response, 8.0), [0.25, 0.0, np.nan])


@pytest.mark.theory
def test_bands_hold_the_system_as_often_as_they_say():
    """60 sets of three sweeps in white noise: coherence, spread, coverage and bias against what is known."""
    rng = np.random.default_rng(7)
    noise, clean = 0.6, [swept(length) for length in (60.0, 80.0, 100.0)]
    found = [identify_records([noisy(each, noise, rng) for each in clean], "theta") for _ in range(60)]
    omega = found[0].response.omega
    inside = (omega > 0.6) & (omega < 11.0)
    ratio = np.array([each.response.value[inside] for each in found]) / exact(omega[inside])
    known = known_coherence(clean, noise, omega[inside])
    averages = np.mean([each.averages[inside] for each in found], axis=0)
    spread = np.sqrt((1.0 - known) / (2.0 * averages * known))
    assert np.mean([each.response.coherence[inside] for each in found]) == pytest.approx(known.mean(), abs=0.02)
    assert np.mean(ratio.real.std(axis=0) / spread) == pytest.approx(1.0, abs=0.08)
    assert np.mean(ratio.imag.std(axis=0) / spread) == pytest.approx(1.0, abs=0.08)
    width = np.array([each.half_width()[inside] for each in found])
    assert np.mean(np.abs(np.abs(ratio) - 1.0) < width) == pytest.approx(0.95, abs=0.025)
    assert np.mean(np.abs(np.angle(ratio)) < width) == pytest.approx(0.95, abs=0.025)
    assert np.median(np.abs(ratio.mean(axis=0) - 1.0) / ratio.std(axis=0)) < 0.5


def test_a_band_is_wider_for_a_higher_probability_and_for_few_averages():
    found = identify_records([swept(60.0, 0.5, np.random.default_rng(2))], "theta", windows=20.0)
    with_few = found.half_width(0.95) / found.error
    assert (with_few > 1.96).all()
    assert (found.half_width(0.99) > found.half_width(0.95)).all()
    many = dataclasses.replace(found, averages=np.full(found.averages.shape, 1e6))
    np.testing.assert_allclose(many.half_width(0.95) / many.error, 1.95996, rtol=1e-5)


def test_runs_that_cannot_be_used_are_left_out_and_counted():
    good, failed, holed = swept(60.0), swept(60.0), swept(60.0)
    failed.status[0] = Status.DIVERGED
    holed.channels["theta"][0, 300] = np.nan
    found = identify_records([good, failed, holed], "theta")
    assert found.status.tolist() == [Status.OK, Status.DIVERGED, Status.OUTPUT_NOT_FINITE]
    np.testing.assert_array_equal(found.response.value, identify_records([good], "theta").response.value)
    nothing = identify_records([failed, holed], "theta")
    assert nothing.used == 0
    assert np.isnan(nothing.response.value).all()
    assert np.isnan(nothing.error).all()
    assert bandwidth(nothing.response).status == Status.MODEL_FAILED


@pytest.mark.parametrize(
    ("lengths", "options", "message"),
    [
        ((), {}, "no record given"),
        ((60.0, 20.0), {"windows": 40.0}, "does not fit into the record of 30 s"),
        ((60.0,), {"sign": 2}, "1 or -1"),
        ((60.0,), {"taper": "han"}, "did you mean 'hann'"),
    ],
)
def test_bad_input_says_what_is_allowed(lengths, options, message):
    with pytest.raises(InputError, match=message):
        identify_records([swept(length) for length in lengths], "theta", **options)


def test_sampling_intervals_must_agree():
    with pytest.raises(InputError, match=r"histories\[1\].time: is sampled every 0.05 s, the first record every 0.04 s"):
        identify_records([swept(60.0), swept(60.0, dt=0.05)], "theta")


def test_random_error_needs_coherence_and_an_average():
    exact_response = FrequencyResponse(np.array([1.0]), np.array([1.0]))
    with pytest.raises(InputError, match=r"coherence: missing"):
        random_error(exact_response, 4.0)
    with pytest.raises(InputError, match=r"is 0\.5, must be 1 or more"):
        random_error(dataclasses.replace(exact_response, coherence=np.array([0.9])), 0.5)
    with pytest.raises(InputError, match="between 0 and 1"):
        identify_records([swept(60.0)], "theta").half_width(1.0)
