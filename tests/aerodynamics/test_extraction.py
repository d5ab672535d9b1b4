from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.aerodynamics import extraction, theory
from levelone.aerodynamics.extraction import derivative, harmonic, single_point
from levelone.aerodynamics.outcome import CAUTIONS, Outcome
from levelone.errors import InputError

REFERENCE = Path(__file__).parents[1] / "reference"
AERODYNAMICS = tomllib.loads((REFERENCE / "aerodynamics.toml").read_text(encoding="utf-8"))
OMEGA, AMPLITUDE, FREQUENCY = 3.0, 0.04, 0.15
PERIOD = 2 * math.pi / OMEGA


def wave(time, mean=0.3, in_phase=0.2, quadrature=-0.05, omega=OMEGA):
    return mean + in_phase * np.sin(omega * time) + quadrature * np.cos(omega * time)


@given(
    mean=st.floats(-2, 2),
    in_phase=st.floats(-1, 1),
    quadrature=st.floats(-1, 1),
    samples=st.floats(17, 90),
    periods=st.floats(2.05, 5),
    start=st.floats(-3, 3),
    fitted=st.integers(1, 2),
)
def test_a_sine_wave_is_recovered_whatever_its_sampling(mean, in_phase, quadrature, samples, periods, start, fitted):
    time = start + np.arange(0, fitted * periods * PERIOD, PERIOD / samples)
    fit = harmonic(time, wave(time, mean, in_phase, quadrature), OMEGA, fitted)
    assert fit.outcome in (Outcome.OK, Outcome.UNCHECKED)
    assert (fit.mean, fit.in_phase, fit.quadrature) == pytest.approx((mean, in_phase, quadrature), abs=1e-9)


def test_a_higher_harmonic_is_told_and_does_not_leak_into_the_first():
    time = np.arange(0, 3 * PERIOD, PERIOD / 23.7)
    fit = harmonic(time, wave(time) + 0.03 * np.sin(2 * OMEGA * time + 0.4), OMEGA)
    size = math.hypot(0.2, 0.05)
    assert (fit.in_phase, fit.quadrature) == pytest.approx((0.2, -0.05), abs=1e-12)
    assert fit.higher == pytest.approx(0.03 / math.sqrt(2) / size, rel=1e-9)
    assert fit.residual == pytest.approx(fit.higher, rel=0.05)


def test_noise_is_in_the_residual_and_not_in_the_higher_harmonics():
    time = np.arange(0, 4 * PERIOD, PERIOD / 200)
    noise = 0.01 * np.random.default_rng(5).standard_normal(time.size)
    fit = harmonic(time, wave(time) + noise, OMEGA)
    assert fit.residual == pytest.approx(0.01 / math.hypot(0.2, 0.05), rel=0.2)
    assert fit.higher < 0.3 * fit.residual


def test_a_constant_has_no_harmonic_and_says_so():
    time = np.arange(0, 3 * PERIOD, PERIOD / 40)
    fit = harmonic(time, np.full(time.size, 0.7), OMEGA)
    assert (fit.mean, fit.in_phase, fit.quadrature) == pytest.approx((0.7, 0.0, 0.0), abs=1e-13)
    assert fit.outcome is Outcome.OK


@given(
    slope=st.floats(-10, 10),
    damping=st.floats(-40, 40),
    mean_alpha=st.floats(-0.2, 0.2),
    phase=st.floats(0, 6.3),
    samples=st.floats(60, 120),
)
def test_the_loop_of_a_linear_response_gives_its_derivatives(slope, damping, mean_alpha, phase, samples):
    time = np.arange(0, 2.5 * PERIOD, PERIOD / samples)
    alpha = mean_alpha + AMPLITUDE * np.sin(OMEGA * time + phase)
    value = 0.3 + slope * (alpha - mean_alpha) + damping * FREQUENCY * AMPLITUDE * np.cos(OMEGA * time + phase)
    found = single_point(time, value, alpha, OMEGA, FREQUENCY)
    assert found.outcome is Outcome.OK
    # the error of the splines: (2 pi / 60)^4 / 384 of either part, twofold where a part is read at the other's slope
    tolerance = 2e-5 * (abs(slope) + abs(damping)) + 1e-9
    assert found.quadrature == pytest.approx(damping, abs=tolerance)
    assert found.in_phase == pytest.approx(slope, abs=tolerance)


def test_the_derivative_is_half_the_thickness_of_the_loop():
    time = np.linspace(0, 3 * PERIOD, 301)
    alpha = AMPLITUDE * np.sin(OMEGA * time)
    value = 0.01 * np.cos(OMEGA * time)
    # at alpha = 0 the loop runs through +0.01 upwards and -0.01 downwards: 0.02 thick
    assert single_point(time, value, alpha, OMEGA, FREQUENCY).quadrature == pytest.approx(
        0.02 / 2 / (AMPLITUDE * FREQUENCY), rel=1e-6
    )
    assert derivative(harmonic(time, value, OMEGA), AMPLITUDE, FREQUENCY).quadrature == pytest.approx(
        0.02 / 2 / (AMPLITUDE * FREQUENCY), rel=1e-9
    )


def dust(name, column, length=1.0):
    """A force or moment coefficient; the forces are along ground axes, so that F_z is the lift."""
    data = np.loadtxt(REFERENCE / "dust" / f"integral_loads_{name}.dat", comments="#")
    pressure, area = 0.5 * 1.225 * 6.0**2, 3.0 * 0.26
    return data[:, 0], data[:, column] / (pressure * area * length)


DUST_OMEGA, DUST_K, DUST_A = 9.230769, 0.2, math.radians(2.0)
LIFT, MOMENT = ("total", 3), ("total", 5, 0.26)


@pytest.mark.oracle
@pytest.mark.parametrize(("load", "expected", "in_phase"), [(LIFT, 11.03, 5.157), (MOMENT, -25.93, -2.188)])
def test_dust_loads_give_their_derivatives_by_harmonic_fit(load, expected, in_phase):
    time, value = dust(*load)
    found = derivative(harmonic(time, value, DUST_OMEGA), DUST_A, DUST_K)
    assert found.quadrature == pytest.approx(expected, rel=0.005)
    assert found.in_phase == pytest.approx(in_phase, rel=0.005)
    # the record is 1.49 periods long: nothing in it shows that the start has died out
    assert found.outcome is Outcome.UNCHECKED


@pytest.mark.oracle
@pytest.mark.parametrize(("load", "expected", "tolerance"), [(LIFT, 11.03, 0.015), (MOMENT, -25.93, 0.005)])
def test_dust_loads_read_at_single_points_still_feel_the_start(load, expected, tolerance):
    # measured: 10.88 (1.3 % less) and -25.81 (0.4 % less), for the downward crossing lies half a period after the start
    time, value = dust(*load)
    alpha = DUST_A * np.sin(DUST_OMEGA * time)
    assert single_point(time, value, alpha, DUST_OMEGA, DUST_K).quadrature == pytest.approx(expected, rel=tolerance)


@pytest.mark.oracle
def test_dust_loads_of_wing_and_tail_add_up():
    parts = [derivative(harmonic(*dust(name, 3), DUST_OMEGA), DUST_A, DUST_K).quadrature for name in ("wing", "tail", "total")]
    assert parts[0] + parts[1] == pytest.approx(parts[2], rel=1e-12)


def from_rest(k, axis, periods, samples=64, finer=8):
    """Lift of a thin aerofoil that starts to pitch at s = 0: Wagner's function superposed, exact but for the quadrature."""
    step = 2 * math.pi / k / samples
    fine = np.arange(0, periods * samples * finer + 1) * step / finer
    arm = 0.5 - axis
    rate = AMPLITUDE * (k * np.cos(k * fine) - arm * k**2 * np.sin(k * fine))
    phi = theory.wagner(fine)
    swept = (np.convolve(rate, phi)[: fine.size] - 0.5 * (rate[0] * phi + rate * phi[0])) * fine[1]
    circulatory = 2 * math.pi * (AMPLITUDE * k * arm * phi + swept)[::finer]
    time = fine[::finer]
    mass = math.pi * AMPLITUDE * (k * np.cos(k * time) + axis * k**2 * np.sin(k * time))
    return time, circulatory + mass, AMPLITUDE * np.sin(k * time)


@pytest.mark.theory
@pytest.mark.parametrize("axis", [theory.QUARTER_CHORD, theory.MID_CHORD])
@pytest.mark.parametrize("k", [0.05, 0.1, 0.2, 0.3, 0.5])
def test_a_start_from_rest_gives_theodorsen_after_two_periods(k, axis):
    time, lift, alpha = from_rest(k, axis, periods=2)
    exact = theory.pitch(k, axis)
    fit = derivative(harmonic(time, lift, k), AMPLITUDE, k)
    loop = single_point(time, lift, alpha, k, k)
    assert fit.outcome is loop.outcome is Outcome.OK
    assert fit.quadrature == pytest.approx(exact.lift_quadrature, abs=0.002 * 2 * math.pi)
    assert fit.in_phase == pytest.approx(exact.lift.real, abs=0.005 * 2 * math.pi)
    assert loop.quadrature == pytest.approx(fit.quadrature, abs=0.005 * 2 * math.pi)


@pytest.mark.theory
def test_the_first_period_alone_is_far_off_and_says_that_it_is_unchecked():
    time, lift, _ = from_rest(0.2, theory.QUARTER_CHORD, periods=1)
    fit = derivative(harmonic(time, lift, 0.2), AMPLITUDE, 0.2)
    assert abs(fit.quadrature - theory.pitch(0.2).lift_quadrature) > 0.05 * 2 * math.pi
    assert fit.outcome is Outcome.UNCHECKED


def test_a_record_that_still_drifts_gives_no_value():
    time = np.arange(0, 3 * PERIOD, PERIOD / 50)
    growing = wave(time) * (1 + 0.05 * time)
    fit = harmonic(time, growing, OMEGA)
    assert fit.outcome is Outcome.NOT_PERIODIC
    assert math.isnan(fit.mean)
    assert math.isnan(fit.quadrature)
    assert extraction.TOLERANCE < fit.drift < 0.2
    assert single_point(time, growing, np.sin(OMEGA * time), OMEGA, FREQUENCY).outcome is Outcome.NOT_PERIODIC
    assert harmonic(time, growing, OMEGA, tolerance=0.2).outcome is Outcome.OK


def long(samples=40, periods=3.0):
    return np.arange(0, periods * PERIOD, PERIOD / samples)


def holed():
    time = long()
    return time[(time < 2.2 * PERIOD) | (time > 2.4 * PERIOD)]


def with_nan():
    values = wave(long())
    values[3] = np.nan
    return values


FAULTS = [
    (long(periods=0.95), None, OMEGA, Outcome.RECORD_TOO_SHORT),
    (long()[:1], None, OMEGA, Outcome.RECORD_TOO_SHORT),
    (long(samples=12), None, OMEGA, Outcome.TOO_FEW_SAMPLES),
    (holed(), None, OMEGA, Outcome.TOO_FEW_SAMPLES),
    (np.array([0.0, 100.0]), None, OMEGA, Outcome.TOO_FEW_SAMPLES),
    (long(), None, 0.0, Outcome.NO_FREQUENCY),
    (long(), None, -OMEGA, Outcome.NO_FREQUENCY),
    (long(), None, math.nan, Outcome.NO_FREQUENCY),
    (long(), None, math.inf, Outcome.NO_FREQUENCY),
    (long(), with_nan(), OMEGA, Outcome.NOT_FINITE),
    (np.r_[long(), long()[-1]], None, OMEGA, Outcome.TIME_NOT_INCREASING),
]


@pytest.mark.parametrize(("time", "values", "omega", "outcome"), FAULTS)
def test_a_record_that_cannot_be_read_is_nan_with_words(time, values, omega, outcome):
    values = wave(time) if values is None else values
    fit = harmonic(time, values, omega)
    assert fit.outcome is outcome
    assert fit.outcome.failed
    assert np.isnan([fit.mean, fit.in_phase, fit.quadrature, fit.residual, fit.higher]).all()
    for found in (derivative(fit, AMPLITUDE, FREQUENCY), single_point(time, values, np.sin(OMEGA * time), omega, FREQUENCY)):
        assert found.outcome is outcome
        assert np.isnan([found.in_phase, found.quadrature]).all()


def test_more_periods_than_the_record_holds_are_refused():
    assert harmonic(long(periods=3), wave(long(periods=3)), OMEGA, periods=4).outcome is Outcome.RECORD_TOO_SHORT


@pytest.mark.parametrize(("amplitude", "k"), [(0.0, 0.1), (-0.1, 0.1), (0.1, 0.0), (0.1, -1.0), (math.nan, 0.1), (0.1, math.inf)])
def test_a_derivative_needs_amplitude_and_frequency(amplitude, k):
    found = derivative(harmonic(long(), wave(long()), OMEGA), amplitude, k)
    assert found.outcome is Outcome.NO_AMPLITUDE
    assert math.isnan(found.quadrature)


def test_the_single_point_method_needs_a_sine_of_incidence():
    time = long(periods=3)
    value = wave(time)
    assert single_point(time, value, np.zeros(time.size), OMEGA, FREQUENCY).outcome is Outcome.NO_AMPLITUDE
    assert single_point(time, value, np.sin(OMEGA * time), OMEGA, 0.0).outcome is Outcome.NO_AMPLITUDE
    assert single_point(time, value, np.sin(1.3 * OMEGA * time), OMEGA, FREQUENCY).outcome is Outcome.NOT_SINUSOIDAL
    assert single_point(time, value, np.full(time.size, np.nan), OMEGA, FREQUENCY).outcome is Outcome.NOT_FINITE


def test_arrays_that_do_not_fit_together_are_refused():
    with pytest.raises(InputError, match=r"values: must be one number for each time, got shapes \(3,\) and \(4,\)"):
        harmonic(np.zeros(4), np.zeros(3), OMEGA)
    with pytest.raises(InputError, match="periods: must be at least 1, got 0"):
        harmonic(long(), wave(long()), OMEGA, periods=0)
    with pytest.raises(InputError, match="tolerance: must be positive, got nan"):
        harmonic(long(), wave(long()), OMEGA, tolerance=math.nan)


def test_every_outcome_has_its_own_words():
    texts = [outcome.text for outcome in Outcome]
    assert len(set(texts)) == len(texts)
    assert {outcome for outcome in Outcome if not outcome.failed} == CAUTIONS | {Outcome.OK}
