from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from levelone.aerodynamics import theory
from levelone.aerodynamics.theory import MID_CHORD, QUARTER_CHORD, heave, pitch, pitch_rate
from levelone.errors import InputError

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "aerodynamics.toml").read_text(encoding="utf-8"))
EXACT = REFERENCE["theodorsen"]
K = np.array(EXACT["k"])
#: half a unit of the last printed digit
PRINTED = 0.51e-5

frequencies = st.floats(0.01, 3.0)
axes = st.floats(-2.0, 2.0)


@pytest.mark.theory
def test_theodorsen_function_is_that_of_the_tables():
    np.testing.assert_allclose(theory.theodorsen(K), np.array(EXACT["F"]) + 1j * np.array(EXACT["G"]), atol=PRINTED)


@pytest.mark.theory
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("lift_pitch_quarter_chord", pitch(K).lift_quadrature),
        ("lift_pitch_mid_chord", pitch(K, MID_CHORD).lift_quadrature),
        ("lift_heave", heave(K).lift_quadrature),
        ("moment_pitch_mid_chord", pitch(K, MID_CHORD).moment_quadrature),
        ("moment_heave_mid_chord", heave(K, MID_CHORD).moment_quadrature),
        ("moment_pitch_quarter_chord", pitch(K).moment_quadrature),
        ("moment_heave_quarter_chord", heave(K).moment_quadrature),
    ],
)
def test_out_of_phase_derivatives_are_the_exact_ones(name, value):
    np.testing.assert_allclose(value, EXACT[name], atol=PRINTED)


@pytest.mark.theory
def test_pure_pitch_rate_about_the_quarter_chord():
    rate = pitch_rate(K)
    np.testing.assert_allclose(rate.lift_quadrature, 2 * math.pi * np.array(EXACT["F"]), atol=1e-4)
    np.testing.assert_allclose(rate.moment_quadrature, -math.pi / 4, rtol=1e-12)


@pytest.mark.theory
def test_lift_derivative_about_the_quarter_chord_changes_sign_where_it_should():
    zero = EXACT["lift_pitch_quarter_chord_zero_at_k"]
    assert theory.lift_curve(zero - 1e-5).pitch < 0 < theory.lift_curve(zero + 1e-5).pitch


@pytest.mark.theory
@given(frequencies, axes, axes)
def test_pitch_about_one_axis_is_pitch_about_another_plus_its_heave(k, first, second):
    # turning nose up about `first` moves `second`, aft of it, down by theta (second - first): incidence i k (second - first)
    moved = 1j * k * (second - first)
    direct, other, translation = pitch(k, first), pitch(k, second), heave(k, second)
    assert direct.lift == pytest.approx(other.lift + moved * translation.lift, rel=1e-9, abs=1e-9)
    about_second = other.moment + moved * translation.moment
    assert direct.moment == pytest.approx(about_second + 0.5 * (first - second) * direct.lift, rel=1e-9, abs=1e-8)


@pytest.mark.theory
@given(frequencies, axes, axes)
def test_moment_of_heave_moves_with_the_lift(k, first, second):
    expected = heave(k, second).moment + 0.5 * (first - second) * heave(k).lift
    assert heave(k, first).moment == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.theory
@pytest.mark.parametrize("axis", [-1.0, QUARTER_CHORD, MID_CHORD, 0.7])
def test_slow_motion_ends_in_the_quasi_steady_values(axis):
    limit, rate = theory.quasi_steady(axis), pitch_rate(1e-8, axis)
    assert rate.lift_quadrature == pytest.approx(limit.C_Lq, rel=1e-6)
    assert rate.moment_quadrature == pytest.approx(limit.C_mq, rel=1e-6, abs=1e-6)
    assert pitch(1e-8, axis).lift.real == pytest.approx(limit.C_Lalpha, rel=1e-6)
    assert pitch(1e-8, axis).moment.real == pytest.approx(limit.C_malpha, rel=1e-6, abs=1e-6)


@pytest.mark.theory
def test_fast_heave_is_added_mass_with_half_the_circulation():
    k = 1e3
    assert heave(k).lift == pytest.approx(math.pi * (1j * k + 1.0), rel=1e-6)


@pytest.mark.theory
def test_lift_curve_is_the_derivative_of_both_motions():
    curve = theory.lift_curve(K, QUARTER_CHORD)
    np.testing.assert_allclose(curve.pitch, EXACT["lift_pitch_quarter_chord"], atol=PRINTED)
    np.testing.assert_allclose(curve.heave, EXACT["lift_heave"], atol=PRINTED)


@pytest.mark.theory
@pytest.mark.parametrize(("name", "function", "value"), [("wagner", theory.wagner, "phi"), ("kussner", theory.kussner, "psi")])
def test_indicial_functions_are_the_tabulated_ones(name, function, value):
    np.testing.assert_allclose(function(REFERENCE[name]["s"]), REFERENCE[name][value], atol=PRINTED)


@pytest.mark.theory
@pytest.mark.parametrize("s", [0.3, 1.0, 7.0])
def test_wagner_is_the_fourier_integral_of_theodorsen(s):
    def integrand(k):
        return (theory.theodorsen(k).real - 0.5) / k

    slow = quad(lambda k: integrand(k) * np.sin(k * s), 1e-9, 1.0, epsabs=1e-11, limit=200)[0]
    fast = quad(integrand, 1.0, np.inf, weight="sin", wvar=s, epsabs=1e-10, limit=200)[0]
    assert theory.wagner(s) == pytest.approx(0.5 + 2.0 / math.pi * (slow + fast), abs=1e-8)


@pytest.mark.theory
@pytest.mark.parametrize("s", [0.3, 1.0, 7.0])
def test_kussner_is_wagner_after_the_gust_has_passed_the_aerofoil(s):
    # a gust that travels over the plate is a superposition of steps: psi(s) = (2/pi) int Re[S(k) exp(-i k)] sin(k s) / k dk, where
    # Sears' function is written with the Bessel functions of Theodorsen's, S = [J0 - i J1] C + i J1
    from scipy.special import jv

    def integrand(k):
        sears = (jv(0, k) - 1j * jv(1, k)) * theory.theodorsen(k) + 1j * jv(1, k)
        return float((sears * np.exp(-1j * k)).real) / k

    slow = quad(lambda k: integrand(k) * np.sin(k * s), 1e-9, 1.0, epsabs=1e-11, limit=200)[0]
    fast = quad(integrand, 1.0, np.inf, weight="sin", wvar=s, epsabs=1e-9, limit=400)[0]
    assert theory.kussner(s) == pytest.approx(2.0 / math.pi * (slow + fast), abs=1e-7)


@pytest.mark.theory
def test_indicial_functions_start_as_their_expansions_do():
    # K1/K0 for large argument: C(p)/p = 1/(2p) + 1/(8p^2) - ..., and exp(-p)/(p^2 (K0 + K1)) = p^(-3/2)/sqrt(2 pi) - ...
    s = 1e-5
    assert theory.wagner(0.0) == 0.5
    assert theory.kussner(0.0) == 0.0
    assert (theory.wagner(s) - 0.5) / s == pytest.approx(1 / 8, rel=1e-4)
    assert theory.kussner(s) / math.sqrt(2 * s) == pytest.approx(1 / math.pi, rel=1e-4)
    assert theory.kussner(1e-10) / math.sqrt(2e-10) == pytest.approx(1 / math.pi, rel=1e-4)


@pytest.mark.theory
@pytest.mark.parametrize("function", [theory.wagner, theory.kussner])
def test_indicial_functions_end_with_the_lift_of_a_vortex_far_behind(function):
    # the starting vortex of strength Gamma at distance s semichords takes 1/s of the lift
    s = 1e4
    assert (1.0 - function(s)) * s == pytest.approx(1.0, rel=2e-3)


@given(st.lists(st.floats(0.0, 1e3), min_size=2, max_size=20, unique=True))
def test_indicial_functions_rise_and_stay_below_one(distances):
    s = np.sort(distances)
    for function in (theory.wagner, theory.kussner):
        value = function(s)
        assert np.all(np.diff(value) >= -1e-14)
        assert np.all(value < 1.0)


def test_arrays_give_what_single_values_give_whatever_their_size_and_shape():
    s = np.linspace(0.0, 30.0, 2 * theory.CHUNK + 6).reshape(2, -1)
    many = theory.wagner(s)
    assert many.shape == s.shape
    assert many[1, 77] == theory.wagner(s[1, 77])
    assert pitch(K.reshape(5, 1)).lift.shape == (5, 1)


@pytest.mark.theory
def test_step_of_incidence_and_gust_end_at_the_steady_lift():
    assert theory.impulsive_start(0.0, 0.1) == pytest.approx(0.1 * math.pi)
    assert theory.impulsive_start(1e6, 0.1) == pytest.approx(0.2 * math.pi, rel=1e-5)
    assert theory.sharp_edged_gust(4.0, 0.1) == pytest.approx(0.2 * math.pi * 0.69454, abs=1e-5)


@pytest.mark.theory
def test_elliptic_wing():
    assert theory.elliptic_lift_slope(6.0) == pytest.approx(1.5 * math.pi)
    assert theory.elliptic_lift_slope(math.inf) == 2 * math.pi


@pytest.mark.parametrize("k", [0.0, -0.1, math.nan, math.inf, 1e7, [0.1, 0.0]])
@pytest.mark.parametrize("function", [theory.theodorsen, pitch, heave, pitch_rate, theory.lift_curve])
def test_a_reduced_frequency_that_is_none_is_refused(function, k):
    with pytest.raises(InputError, match="k: a reduced frequency must lie between 1e-12 and 1e\\+06, got"):
        function(k)


@pytest.mark.parametrize("s", [-1e-9, math.nan, math.inf, [1.0, -2.0]])
@pytest.mark.parametrize("function", [theory.wagner, theory.kussner])
def test_a_distance_that_is_none_is_refused(function, s):
    with pytest.raises(InputError, match="s: a distance travelled must be finite and not negative, got"):
        function(s)


@pytest.mark.parametrize("axis", [math.nan, math.inf])
def test_an_axis_that_is_none_is_refused(axis):
    for function in (pitch, heave, pitch_rate):
        with pytest.raises(InputError, match="axis: must be a finite number"):
            function(0.1, axis)
    with pytest.raises(InputError, match="axis: must be a finite number"):
        theory.quasi_steady(axis)


@pytest.mark.parametrize("aspect_ratio", [0.0, -3.0, math.nan])
def test_an_aspect_ratio_that_is_none_is_refused(aspect_ratio):
    with pytest.raises(InputError, match="aspect_ratio: must be positive"):
        theory.elliptic_lift_slope(aspect_ratio)
