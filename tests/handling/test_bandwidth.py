from __future__ import annotations

import control
import numpy as np
import pytest
from handling_signals import REFERENCE, second_difference
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling.bandwidth import bandwidth
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.levels import Level
from levelone.status import Status

OMEGA = np.geomspace(0.1, 100.0, 300)
CASES = REFERENCE["bandwidth"]["case"]


def response(numerator, denominator, delay=0.0, omega=OMEGA):
    s = 1j * omega
    value = np.polyval(numerator, s) / np.polyval(denominator, s) * np.exp(-delay * s)
    return FrequencyResponse(omega, value)


def delayed(delay=0.05, omega=OMEGA):
    return response([16.0], [1.0, 5.6, 16.0], delay, omega)


@pytest.mark.theory
@pytest.mark.parametrize("case", CASES, ids=lambda case: case["system"])
def test_reference_vectors(case):
    result = bandwidth(response(case["numerator"], case["denominator"], case["delay"]))
    for name in ("omega_bw_phase", "omega_bw_gain", "omega_180", "tau_p"):
        if name in case:
            assert getattr(result, name) == pytest.approx(case[name], rel=REFERENCE["bandwidth"]["tolerance"])
        else:
            assert np.isnan(getattr(result, name))
    if "tau_p_least_squares" in case:
        fitted = bandwidth(response(case["numerator"], case["denominator"], case["delay"]), phase_delay="least_squares")
        assert fitted.tau_p == pytest.approx(case["tau_p_least_squares"], rel=REFERENCE["bandwidth"]["tolerance"])


@pytest.mark.theory
def test_closed_forms_far_beyond_the_vectors_digits():
    result = bandwidth(response([1.0], [1.0, 0.0], 0.1))
    assert result.omega_bw_phase == pytest.approx(2.5 * np.pi, rel=1e-8)
    assert result.omega_bw_gain == pytest.approx(5.0 * np.pi / 10**0.3, rel=1e-8)
    assert result.omega_180 == pytest.approx(5.0 * np.pi, rel=1e-8)
    assert result.tau_p == pytest.approx(0.05 * (180.0 / np.pi) / 57.3, rel=1e-7)


@pytest.mark.oracle
@pytest.mark.parametrize("seed", range(6))
def test_crossings_against_python_control(seed):
    rng = np.random.default_rng(seed)
    zeta, omega_n, pole = rng.uniform(0.2, 0.7), rng.uniform(3.0, 8.0), rng.uniform(8.0, 25.0)
    system = control.tf([omega_n**2], [1.0, 2.0 * zeta * omega_n, omega_n**2]) * control.tf([pole], [1.0, pole])
    numerator, denominator = system.num[0][0], system.den[0][0]
    result = bandwidth(response(numerator, denominator))
    # asked ten times tighter than the 1e-4 of the frequency that is promised
    gain_margin, _, omega_180, _ = control.margin(system)
    assert result.omega_180 == pytest.approx(omega_180, rel=1e-5)
    at_bandwidth = abs(system(1j * result.omega_bw_phase))
    _, phase_margin, _, crossover = control.margin(system / at_bandwidth)
    assert phase_margin == pytest.approx(45.0, abs=5e-3)
    assert crossover == pytest.approx(result.omega_bw_phase, rel=1e-5)
    assert abs(system(1j * result.omega_bw_gain)) * gain_margin == pytest.approx(10**0.3, rel=1e-5)


@settings(max_examples=50, deadline=None)
@given(factor=st.floats(1e-6, 1e6))
def test_a_positive_constant_changes_nothing(factor):
    before, after = bandwidth(delayed()), bandwidth(delayed().scaled(factor))
    for name in ("omega_bw", "omega_bw_gain", "omega_180", "tau_p"):
        assert getattr(after, name) == pytest.approx(getattr(before, name), rel=1e-10)


def test_the_sign_is_part_of_the_data():
    wrong = bandwidth(-delayed())
    assert wrong.omega_bw != pytest.approx(bandwidth(delayed()).omega_bw, rel=0.1)


@pytest.mark.theory
def test_the_branch_of_the_phase_is_declared_where_a_response_begins_near_180_deg():
    # 1 / s^2 lags by 180 deg from the beginning: whether it is -180 or +180 deg, its lead-lag must say
    lead = response([1.0, 0.5], [1.0, 20.0, 0.0, 0.0])
    assert np.degrees(lead.phase[0]) == pytest.approx(-169.0, abs=1.0)
    assert np.degrees(lead.unwrapped_phase(np.pi)[0]) == pytest.approx(191.0, abs=1.0)
    assert bandwidth(lead).status_180 == Status.NO_OMEGA_180
    # phase from -180 deg up to -105 and down again: the bandwidth is where it falls
    assert bandwidth(lead).omega_bw_phase == pytest.approx(18.97, abs=0.05)
    noisy_branch = FrequencyResponse(OMEGA, lead.value * np.exp(-0.4j))
    assert np.degrees(noisy_branch.phase[0]) > 160.0
    assert bandwidth(noisy_branch, phase_reference=-np.pi).omega_bw_phase < 12.0
    assert bandwidth(noisy_branch).status == Status.NO_PHASE_CROSSING


@pytest.mark.paper
@pytest.mark.parametrize("zeta", [0.30, 0.35, 0.40, 0.45])
def test_two_readings_of_one_aircraft(zeta):
    """A speed loop around an attitude loop: q / V_lon begins near 0 deg, -theta / V_lon near +90 deg."""
    omega_n, gravity, gain = 5.61, 9.81, 0.1
    loop = np.polyadd(np.polymul([1.0, 0.0], [1.0, 2.0 * zeta * omega_n, omega_n**2]), [gravity * gain * omega_n**2])
    theta = response([-gain * omega_n**2, 0.0], loop)
    rate = response([-gain * omega_n**2, 0.0, 0.0], loop)
    assert np.degrees((-theta).phase[0]) == pytest.approx(90.0, abs=15.0)
    assert np.degrees(rate.phase[0]) == pytest.approx(0.0, abs=15.0)
    limits = REFERENCE["study_reading"]
    assert limits["rate"][0] <= bandwidth(rate).omega_bw <= limits["rate"][1]
    assert limits["attitude"][0] <= bandwidth(-theta).omega_bw <= limits["attitude"][1]


def test_response_types_and_the_caution():
    attitude, rate = bandwidth(delayed()), bandwidth(delayed(), "rate_command")
    assert attitude.omega_bw == rate.omega_bw == attitude.omega_bw_phase < attitude.omega_bw_gain
    assert attitude.status == rate.status == Status.OK
    slow_gain = response([0.5, 1.0], [1.0, 0.0], 0.15)  # the gain hardly falls towards omega_180
    rate = bandwidth(slow_gain, "rate_command")
    assert rate.omega_bw == rate.omega_bw_gain < rate.omega_bw_phase
    assert rate.status == Status.OK
    caution = bandwidth(slow_gain)
    assert caution.omega_bw_gain < caution.omega_bw_phase
    assert caution.status == Status.PIO_CAUTION
    assert caution.omega_bw == caution.omega_bw_phase


def test_a_phase_that_never_reaches_180_deg_leaves_the_rest_undefined():
    plain = response([16.0], [1.0, 5.6, 16.0])
    attitude = bandwidth(plain)
    assert attitude.status == Status.PIO_CAUTION
    assert attitude.omega_bw == attitude.omega_bw_phase
    assert attitude.status_180 == attitude.status_gain == attitude.status_tau_p == Status.NO_OMEGA_180
    assert attitude.level == Level.UNDEFINED
    rate = bandwidth(plain, "rate_command")
    assert np.isnan(rate.omega_bw)
    assert rate.status == Status.NO_OMEGA_180


def test_a_range_that_ends_early_is_said_and_not_extrapolated():
    short = bandwidth(delayed(omega=np.geomspace(0.3, 12.0, 120)))
    assert short.omega_180 == pytest.approx(10.810794, rel=1e-5)
    assert np.isnan(short.tau_p)
    assert short.status_tau_p == Status.RANGE_TOO_SHORT
    assert short.status == Status.OK
    shorter = bandwidth(delayed(omega=np.geomspace(0.3, 5.0, 80)))
    assert shorter.status == Status.NO_PHASE_CROSSING
    assert shorter.status_180 == Status.NO_OMEGA_180


def test_no_gain_6_db_above():
    flat = FrequencyResponse(OMEGA, np.exp(-0.1j * OMEGA))
    result = bandwidth(flat)
    assert result.status_gain == Status.NO_GAIN_CROSSING
    assert np.isnan(result.omega_bw_gain)
    assert bandwidth(flat, "rate_command").status == Status.NO_GAIN_CROSSING


def test_gain_bandwidth_is_where_the_gain_falls_not_where_it_rises():
    # a zero at the origin: the gain passes 6 dB above its value at omega_180 twice
    result = bandwidth(response([16.0, 0.0], np.polymul([1.0, 0.3], [1.0, 5.6, 16.0]), 0.05))
    gain = np.abs(response([16.0, 0.0], np.polymul([1.0, 0.3], [1.0, 5.6, 16.0]), 0.05).value)
    assert gain[0] < gain.max() / 2.0
    assert result.omega_bw_gain > OMEGA[gain.argmax()]


@pytest.mark.parametrize(
    ("low", "high", "hidden"),
    [
        (5.0, 6.5, {"status", "status_phase"}),
        (7.2, 8.0, {"status_gain"}),
        (10.0, 12.0, {"status_180", "status_gain", "status_tau_p"}),
        (20.0, 23.0, {"status_tau_p"}),
        (18.0, 200.0, {"status_tau_p"}),
        (9.0, 200.0, {"status_180", "status_gain", "status_tau_p"}),
        (0.1, 0.5, set()),
    ],
)
def test_values_are_not_read_where_coherence_is_low(low, high, hidden):
    exact = delayed()
    coherence = np.where((low < OMEGA) & (high > OMEGA), 0.4, 0.95)
    result = bandwidth(FrequencyResponse(OMEGA, exact.value, coherence))
    for name in ("status_phase", "status_gain", "status_180", "status_tau_p"):
        expected = Status.LOW_COHERENCE if name in hidden else Status.OK
        assert getattr(result, name) == expected, name
    assert np.isnan(result.omega_bw) == ("status" in hidden)
    relaxed = bandwidth(FrequencyResponse(OMEGA, exact.value, coherence), coherence_min=0.3)
    assert relaxed.tau_p == bandwidth(exact).tau_p


def test_undefined_values_are_passed_over_and_an_empty_response_is_a_failure():
    value = delayed().value.copy()
    value[40] = np.nan
    assert bandwidth(FrequencyResponse(OMEGA, value)).tau_p == pytest.approx(bandwidth(delayed()).tau_p, rel=1e-9)
    empty = bandwidth(FrequencyResponse(OMEGA, np.full(OMEGA.size, np.nan + 0j)))
    assert empty.status == empty.status_tau_p == Status.MODEL_FAILED
    assert np.isnan(empty.omega_bw)


def test_batch_equals_loop():
    delays = np.linspace(0.02, 0.2, 9)
    rows = np.stack([delayed(delay).value for delay in delays])
    rows[4] = np.nan
    together = bandwidth(FrequencyResponse(OMEGA, rows))
    assert together.omega_bw.shape == (9,)
    for run in range(9):
        alone = bandwidth(FrequencyResponse(OMEGA, rows[run]))
        for name in ("omega_bw", "omega_bw_gain", "omega_180", "tau_p", "level", "status", "status_tau_p"):
            np.testing.assert_array_equal(getattr(together, name)[run], getattr(alone, name))


def test_metrics_are_smooth_in_the_inputs():
    damping = np.linspace(0.5, 0.7, 401)[:, None]
    s = 1j * OMEGA
    rows = 16.0 * np.exp(-0.05 * s) / (s**2 + 8.0 * damping * s + 16.0)
    for option in ("two_point", "least_squares"):
        result = bandwidth(FrequencyResponse(OMEGA, rows), phase_delay=option)
        for name in ("omega_bw", "omega_bw_gain", "omega_180", "tau_p"):
            assert second_difference(getattr(result, name)) < 3e-6, name


def test_level_in_the_plane_of_bandwidth_and_phase_delay():
    assert bandwidth(delayed()).level == Level.LEVEL_1
    assert bandwidth(delayed(), task="target_acquisition").level == Level.LEVEL_1
    slow = response([0.49], [1.0, 0.98, 0.49], 0.1)
    assert 0.5 < bandwidth(slow).omega_bw < 2.0
    late = bandwidth(delayed(0.4))
    assert late.tau_p > 0.12
    assert late.level == Level.OUTSIDE
    assert late.level_extrapolated == Level.LEVEL_1


def test_bad_input_says_what_is_allowed():
    with pytest.raises(InputError, match="did you mean 'rate_command'"):
        bandwidth(delayed(), "rate")
    with pytest.raises(InputError, match="two_point"):
        bandwidth(delayed(), phase_delay="three_point")
    with pytest.raises(InputError, match="between 0 and 1"):
        bandwidth(delayed(), coherence_min=1.5)
    with pytest.raises(InputError, match="all_other"):
        bandwidth(delayed(), task="other")
    with pytest.raises(InputError, match="finite angle"):
        bandwidth(delayed(), phase_reference=np.inf)
