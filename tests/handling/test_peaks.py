from __future__ import annotations

import numpy as np
import pytest
from handling_signals import DT, grid

from levelone.handling.peaks import extrema, refine, value_at


def starts(x, k=0):
    return np.full(x.shape[0], k, dtype=np.int64)


@pytest.mark.theory
@pytest.mark.parametrize("omega", [2.0, 5.61, 12.0])
def test_refined_peak_of_an_oscillator_is_within_1e_minus_6(omega):
    time = grid(6.0)
    phase = np.linspace(0.0, 2.0 * np.pi, 97)[:, None]
    sigma = 0.3 * omega
    x = np.exp(-sigma * time) * np.cos(omega * time + phase)
    found = extrema(x, 0, starts(x), 0.02, 2)
    # stationary where tan(omega t + phase) = -sigma / omega
    angle = np.arctan2(-sigma, omega)
    first = (np.ceil((phase[:, 0] - angle) / np.pi) * np.pi + angle - phase[:, 0]) / omega
    exact = np.exp(-sigma * first) * np.cos(omega * first + phase[:, 0])
    inside = (first > 4 * DT) & (np.abs(found.place[:, 0] * DT - first) < 0.5 * np.pi / omega)
    assert inside.sum() > 90
    assert np.abs(found.value[inside, 0] / exact[inside] - 1.0).max() < 1e-6
    assert np.abs(found.place[inside, 0] * DT - first[inside]).max() < 2e-3 * DT


@pytest.mark.order
def test_error_of_the_peak_value_is_of_sixth_order():
    steps = np.array([0.08, 0.06, 0.045, 0.034, 0.025])
    errors = []
    for dt in steps:
        offsets = np.linspace(-0.45, 0.45, 19)
        worst = 0.0
        for offset in offsets:
            x = np.cos((np.arange(-10, 11) + offset) * dt * 5.0)
            worst = max(worst, abs(refine(x, 10, 0, 20)[1] - 1.0))
        errors.append(worst)
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(6.0, abs=0.2)


def test_nearest_sample_would_miss_what_the_fit_finds():
    x = np.cos((np.arange(41) - 20.37) * DT * 5.61)
    assert 1.0 - x.max() > 1e-5
    assert refine(x, int(x.argmax()), 0, 40) == (pytest.approx(20.37, abs=1e-5), pytest.approx(1.0, abs=1e-10))


def test_value_between_samples_follows_a_quartic_exactly():
    k = np.arange(15.0)
    poly = np.polynomial.Polynomial([0.3, -0.2, 0.05, 0.01, -0.002])
    for position in (0.0, 1.2, 6.5, 7.49, 12.9, 14.0):
        assert value_at(poly(k), position, 0, 14) == pytest.approx(poly(position), rel=1e-11, abs=1e-11)


def test_window_never_reaches_before_the_start():
    # the response begins with a bend at sample 20: what lies before must not enter the fit
    time = grid(4.0)
    smooth = np.cos(5.0 * time - 0.2)
    x = np.where(np.arange(time.size) < 5, 7.0, smooth)[None, :]
    found = extrema(x, 0, starts(x, 5), 0.02, 1)
    assert found.value[0, 0] == pytest.approx(1.0, abs=1e-8)


def test_ripple_below_the_prominence_is_passed():
    time = grid(6.0)
    x = (np.exp(-time) * np.sin(3.0 * time) + 0.004 * np.sin(120.0 * time))[None, :]
    found = extrema(x, 0, starts(x), 0.02, 2)
    assert found.place[0, 0] * DT == pytest.approx(np.arctan(3.0) / 3.0, abs=0.05)
    rough = extrema(x, 0, starts(x), 0.001, 2)
    assert rough.place[0, 0] < found.place[0, 0] - 5.0


def test_blip_ahead_of_the_response_is_not_the_first_extremum():
    time = grid(6.0)
    blip = 0.003 * np.exp(-(((time - 0.3) / 0.03) ** 2))
    x = (blip + np.where(time > 1.0, -np.exp(-(time - 1.0)) * np.sin(3.0 * (time - 1.0)), 0.0))[None, :]
    found = extrema(x, 0, starts(x), 0.02, 2)
    assert found.value[0, 0] < -0.4
    assert found.place[0, 0] * DT == pytest.approx(1.0 + np.arctan(3.0) / 3.0, abs=1e-3)


def test_noise_seen_before_the_input_is_not_taken_for_a_peak():
    rng = np.random.default_rng(7)
    time = grid(8.0)
    clean = np.where(time > 2.0, np.exp(-(time - 2.0)) * np.sin(4.0 * (time - 2.0)), 0.0)
    x = clean + 0.02 * rng.uniform(-1.0, 1.0, (20, time.size))
    begin = round(2.0 / DT)
    found = extrema(x, begin, starts(x, begin), 0.02, 2)
    first = 2.0 + np.arctan(4.0) / 4.0
    assert np.abs(found.place[:, 0] * DT - first).max() < 0.12
    assert np.abs(found.place[:, 1] * DT - first - np.pi / 4.0).max() < 0.2


def test_growing_oscillation_begins_with_its_small_first_peak():
    time = grid(9.0)
    x = (np.exp(0.5 * time) * np.sin(5.0 * time))[None, :]
    found = extrema(x, 0, starts(x), 0.02, 3)
    assert found.place[0] * DT == pytest.approx((np.pi - np.arctan(10.0)) / 5.0 + np.pi / 5.0 * np.arange(3), abs=1e-4)


def test_record_is_read_up_to_its_first_missing_sample():
    time = grid(6.0)
    x = np.sin(3.0 * time)[None, :].repeat(2, axis=0)
    x[1, round(2.0 / DT) :] = np.nan
    found = extrema(x, 0, starts(x), 0.02, 3)
    assert found.count.tolist() == [3, 2]
    assert np.isnan(found.value[1, 2])
    assert found.value[1, 0] == found.value[0, 0]
