from __future__ import annotations

import math

import numpy as np
import pytest

from levelone.errors import InputError
from levelone.handling.added_dynamics import added_dynamics, envelopes
from levelone.handling.frequency import FrequencyResponse
from levelone.status import Status

OMEGA = np.geomspace(0.3, 20.0, 200)


def response(added=1.0, coherence=None):
    s = 1j * OMEGA
    return FrequencyResponse(OMEGA, 16.0 / (s**2 + 5.6 * s + 16.0) * added, coherence)


@pytest.mark.theory
def test_bounds_at_the_ends_are_the_ratios_of_the_coefficients():
    """Towards zero and infinity only the last and first coefficients count; a delay is left of the phase."""
    low, high = envelopes([1e-7]), envelopes([1e6])
    for name, ends in (("gain_above", (22.79 / 1.84, 3.16)), ("gain_below", (2.15 / 4.95, 0.0955))):
        np.testing.assert_allclose(getattr(low, name), 20.0 * math.log10(ends[0]), rtol=1e-6)
        np.testing.assert_allclose(getattr(high, name), 20.0 * math.log10(ends[1]), rtol=1e-6)
    np.testing.assert_allclose([low.phase_above[0], low.phase_below[0]], [math.pi, 0.0], atol=1e-4)
    np.testing.assert_allclose([high.phase_above[0], high.phase_below[0]], [0.0059e6, -0.0072e6], rtol=1e-3)


def test_bounds_enclose_no_error_at_all_and_grow_at_both_ends():
    """The gain's bounds mirror each other about 0 dB within 0.2 dB between 2 and 12 rad/s: a wrong digit would break that."""
    found = envelopes(np.geomspace(0.1, 30.0, 100))
    assert (found.gain_below < 0.0).all()
    assert (found.gain_above > 0.0).all()
    assert (found.phase_below < 0.0).all()
    assert (found.phase_above > 0.0).all()
    middle = (found.omega > 2.0) & (found.omega < 12.0)
    assert np.abs(found.gain_above + found.gain_below)[middle].max() < 0.2
    width = found.gain_above - found.gain_below
    assert 1.5 < found.omega[np.argmin(width)] < 4.0
    assert width.min() == pytest.approx(2.7, abs=0.2)


def test_a_perfect_simulation_is_inside():
    found = added_dynamics(response(), response())
    assert found.share == 1.0
    assert found.verdict == "inside"
    assert found.error.omega[0] == pytest.approx(0.5)
    assert found.error.omega[-1] == pytest.approx(10.0)


@pytest.mark.theory
@pytest.mark.parametrize(
    ("delay", "inside"),
    [
        (0.04, True),
        (0.20, False),
    ],
)
def test_a_small_delay_goes_unnoticed_and_a_large_one_does_not(delay, inside):
    """44 deg at 10 rad/s are 0.077 s of delay; 14 deg at 1 rad/s 0.25 s: the narrow end is the high one."""
    found = added_dynamics(response(np.exp(-delay * 1j * OMEGA)), response())
    assert (found.share == 1.0) is inside
    assert found.inside_gain.all()
    lag = -delay * found.error.omega
    np.testing.assert_array_equal(found.inside_phase, lag >= found.envelopes.phase_below)
    assert found.share == found.inside_phase.mean()


@pytest.mark.theory
def test_a_constant_gain_counts():
    simulation = response(10.0 ** (2.0 / 20.0))
    found = added_dynamics(simulation, response())
    np.testing.assert_array_equal(found.inside_gain, found.envelopes.gain_above >= 2.0)
    assert found.verdict == "outside"


def test_whole_turns_do_not_matter():
    turned = FrequencyResponse(OMEGA, response().value * np.exp(2j * np.pi))
    assert added_dynamics(turned, response()).verdict == "inside"


def test_frequencies_that_cannot_be_read_count_on_neither_side():
    coherence = np.where((OMEGA > 3.0) & (OMEGA < 5.0), 0.2, 0.9)
    found = added_dynamics(response(coherence=coherence), response())
    assert found.share == 1.0
    assert found.error.used < 40
    assert found.inside_gain.sum() == found.error.used


def test_nothing_to_read_is_no_verdict():
    found = added_dynamics(response(), response(coherence=np.full(OMEGA.size, 0.1)))
    assert math.isnan(found.share)
    assert found.status is Status.LOW_COHERENCE
    assert found.verdict == Status.LOW_COHERENCE.text


def test_frequencies_must_be_positive():
    with pytest.raises(InputError, match="finite and positive"):
        envelopes([0.0, 1.0])
