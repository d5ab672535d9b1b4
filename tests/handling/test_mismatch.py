from __future__ import annotations

import doctest
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling import mismatch
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.mismatch import mean_cost, mismatch_cost, response_error, verdict
from levelone.status import Status

OMEGA = np.geomspace(0.2, 20.0, 77)  # every fourth is one of the 20 at which responses are compared
FULL_WEIGHT = (1.58 * (1.0 - math.exp(-1.0))) ** 2


def second_order(omega=OMEGA, delay=0.05, coherence=None):
    s = 1j * omega
    return FrequencyResponse(omega, 16.0 / (s**2 + 5.6 * s + 16.0) * np.exp(-delay * s), coherence)


def cost(simulation, flight, **options):
    return mismatch_cost(response_error(simulation, flight, **options))


def test_a_response_matches_itself():
    assert cost(second_order(), second_order()).cost < 1e-20
    assert cost(second_order(), second_order()).verdict == "nearly indistinguishable"


@pytest.mark.theory
@given(decibel=st.floats(-6.0, 6.0), degrees=st.floats(-60.0, 60.0))
def test_constant_errors_cost_what_the_formula_says(decibel, degrees):
    """J = 20 W_gamma (dG^2 + 0.01745 dP^2) for errors that are the same at every frequency."""
    flight = second_order()
    simulation = FrequencyResponse(OMEGA, flight.value * 10.0 ** (decibel / 20.0) * np.exp(1j * math.radians(degrees)))
    found = cost(simulation, flight)
    assert found.gain_part == pytest.approx(20.0 * FULL_WEIGHT * decibel**2, rel=1e-9, abs=1e-15)
    assert found.phase_part == pytest.approx(20.0 * FULL_WEIGHT * 0.01745 * degrees**2, rel=1e-9, abs=1e-15)
    assert found.cost == found.gain_part + found.phase_part


@pytest.mark.theory
def test_an_added_delay_costs_the_mean_square_of_its_phase():
    found = cost(second_order(delay=0.11), second_order(delay=0.05), points=20)
    grid = np.geomspace(0.2, 20.0, 20)
    wanted = 20.0 * FULL_WEIGHT * 0.01745 * np.mean(np.degrees(0.06 * grid) ** 2)
    assert found.cost == pytest.approx(wanted, rel=1e-9)


@pytest.mark.theory
def test_a_coherence_of_0_6_counts_half_as_much_as_1():
    """(1 - exp(-0.6))^2 / (1 - exp(-1))^2 = 0.5094..."""
    low = second_order(coherence=np.full(OMEGA.size, 0.6))
    simulation = second_order(delay=0.1)
    ratio = cost(simulation, low).cost / cost(simulation, second_order()).cost
    assert ratio == pytest.approx((math.expm1(-0.6) / math.expm1(-1.0)) ** 2, rel=1e-9)
    assert ratio == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("turns", [-2, -1, 1, 3])
def test_whole_turns_of_either_phase_do_not_matter(turns):
    """A delay of one turn at the lowest frequency is no whole turn elsewhere; a branch is."""
    flight = second_order()
    simulation = second_order(delay=0.08)
    shifted = FrequencyResponse(OMEGA, simulation.value * np.exp(2j * math.pi * turns))
    assert cost(shifted, flight).cost == pytest.approx(cost(simulation, flight).cost, rel=1e-9)


def test_the_error_of_a_long_delay_is_followed_beyond_half_a_turn():
    error = response_error(second_order(delay=0.45), second_order(delay=0.05))
    np.testing.assert_allclose(error.phase, -0.4 * error.omega, rtol=1e-9)
    assert error.phase.min() < -2.0 * math.pi


def test_a_response_on_another_grid_is_compared_between_its_frequencies():
    dense = second_order(np.geomspace(0.1, 30.0, 4000))
    error = response_error(dense, second_order(np.linspace(0.05, 25.0, 900)), omega_min=0.5)
    assert np.abs(error.gain).max() < 0.01
    assert np.abs(error.phase).max() < 1e-3


def test_frequencies_without_coherence_are_left_out():
    coherence = np.where((OMEGA > 3.0) & (OMEGA < 5.0), 0.4, 0.9)
    error = response_error(second_order(delay=0.1), second_order(coherence=coherence))
    unread = np.isnan(error.gain)
    assert unread.any()
    assert (unread == np.isnan(error.phase)).all()
    assert error.omega[unread].min() > 2.5
    assert error.omega[unread].max() < 5.5
    assert error.used == 20 - unread.sum()
    np.testing.assert_allclose(error.phase[~unread], -0.05 * error.omega[~unread], rtol=1e-6)


def test_the_range_is_what_both_hold_with_coherence():
    coherence = np.where(OMEGA < 0.5, 0.3, 0.95)
    error = response_error(second_order(np.geomspace(0.1, 12.0, 60)), second_order(coherence=coherence), omega_max=50.0)
    assert error.omega[0] == pytest.approx(OMEGA[OMEGA >= 0.5][0])
    assert error.omega[-1] == pytest.approx(12.0)
    assert error.used == 20


def test_without_coherence_or_values_the_cost_is_undefined_and_says_why():
    nothing = second_order(coherence=np.full(OMEGA.size, 0.1))
    found = cost(second_order(), nothing)
    assert math.isnan(found.cost)
    assert found.status is Status.LOW_COHERENCE
    assert "coherence" in found.verdict
    empty = FrequencyResponse(OMEGA, np.full(OMEGA.size, np.nan + 0j))
    assert cost(empty, second_order()).status is Status.MODEL_FAILED
    assert math.isnan(mean_cost([found, cost(second_order(), second_order())]))
    assert math.isnan(mean_cost([]))


@pytest.mark.parametrize(
    ("value", "words"),
    [(50.0, "nearly indistinguishable"), (50.1, "good"), (100.0, "good"), (100.1, "not good"), (math.nan, "undefined")],
)
def test_costs_in_words(value, words):
    assert verdict(value) == words


def test_mean_of_several():
    costs = [cost(second_order(delay=d), second_order()) for d in (0.05, 0.08)]
    assert mean_cost(costs) == pytest.approx(0.5 * costs[1].cost)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"omega_min": 30.0}, "no range in common"),
        ({"points": 1}, "must be 2 or more"),
        ({"coherence_min": 1.5}, "between 0 and 1"),
    ],
)
def test_bad_input_says_what_is_allowed(options, message):
    with pytest.raises(InputError, match=message):
        response_error(second_order(), second_order(), **options)


def test_a_batch_is_refused():
    batch = FrequencyResponse(OMEGA, np.ones((2, OMEGA.size)))
    with pytest.raises(InputError, match="flight: holds 2 runs: select one"):
        response_error(second_order(), batch)


def test_docstring_examples():
    outcome = doctest.testmod(mismatch)
    assert outcome.attempted > 0
    assert outcome.failed == 0
