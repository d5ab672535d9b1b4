from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling.frequency import FrequencyResponse

OMEGA = np.geomspace(0.1, 50.0, 200)


@pytest.mark.theory
@pytest.mark.parametrize("delay", [0.0, 0.1, 0.4])
def test_phase_of_an_integrator_with_delay(delay):
    response = FrequencyResponse(OMEGA, np.exp(-1j * delay * OMEGA) / (1j * OMEGA))
    np.testing.assert_allclose(response.phase, -0.5 * np.pi - delay * OMEGA, atol=1e-12)
    np.testing.assert_allclose(response.gain_db, -20.0 * np.log10(OMEGA), atol=1e-12)


@given(start=st.floats(-20.0, 20.0), turns=st.integers(-3, 3))
def test_declared_branch_holds_at_the_first_frequency(start, turns):
    exact = start - 0.3 * OMEGA
    response = FrequencyResponse(OMEGA, np.exp(1j * exact))
    reference = start + 2.0 * np.pi * turns + 0.5
    phase = response.unwrapped_phase(reference)
    assert reference - np.pi - 1e-9 < phase[0] <= reference + np.pi + 1e-9
    np.testing.assert_allclose(phase - exact, phase[0] - exact[0], atol=1e-9)


def test_branch_at_plus_and_minus_180_deg():
    positive = FrequencyResponse(OMEGA, np.full(OMEGA.size, -1.0 + 0.0j))
    assert positive.phase[0] == pytest.approx(np.pi)
    assert positive.unwrapped_phase(-0.1)[0] == pytest.approx(-np.pi)


def test_undefined_values_are_passed_over():
    exact = -0.2 * OMEGA
    value = np.exp(1j * exact)
    value[[0, 50, 51]] = np.nan
    phase = FrequencyResponse(OMEGA, value).phase
    assert np.isnan(phase[[0, 50, 51]]).all()
    defined = ~np.isnan(phase)
    np.testing.assert_allclose(phase[defined], exact[defined], atol=1e-12)


def test_batch_equals_loop_and_sign_and_scale():
    rows = np.stack([np.exp(-1j * delay * OMEGA) / (1.0 + 1j * OMEGA) for delay in (0.0, 0.1, 0.5)])
    coherence = np.stack([np.full(OMEGA.size, c) for c in (0.7, 0.8, 0.9)])
    batch = FrequencyResponse(OMEGA, rows, coherence)
    for run in range(3):
        alone = batch.select(run)
        np.testing.assert_array_equal(alone.phase, batch.phase[run])
        np.testing.assert_array_equal(alone.coherence, coherence[run])
    np.testing.assert_array_equal((-batch).value, -rows)
    np.testing.assert_array_equal(batch.scaled(2.5).value, 2.5 * rows)


def test_zero_has_no_gain_and_raises_no_warning():
    assert FrequencyResponse(np.array([1.0]), np.array([0j])).gain_db[0] == -np.inf


@pytest.mark.parametrize(
    ("omega", "value", "coherence", "message"),
    [
        ([0.0, 1.0], [1, 1], None, "begins at 0.0 rad/s"),
        ([-1.0, 1.0], [1, 1], None, "positive"),
        ([1.0, 1.0], [1, 1], None, "increase"),
        ([1.0, np.nan], [1, 1], None, "finite"),
        ([1.0, 2.0], [1, 1, 1], None, r"must be \[frequency\]"),
        ([1.0, 2.0], [[[1, 1]]], None, r"must be \[frequency\]"),
        ([1.0, 2.0], [1, np.inf], None, "infinite"),
        ([1.0, 2.0], [1, 1], [0.5], "coherence: has shape"),
        ([1.0, 2.0], [1, 1], [0.5, 1.2], "between 0 and 1"),
    ],
)
def test_bad_input_is_refused(omega, value, coherence, message):
    with pytest.raises(InputError, match=message):
        FrequencyResponse(np.array(omega), np.array(value, dtype=complex), coherence)


def test_bad_arguments_are_refused():
    response = FrequencyResponse(np.array([1.0]), np.array([1j]))
    with pytest.raises(InputError, match="not zero"):
        response.scaled(0.0)
    with pytest.raises(InputError, match="not among the 1 runs"):
        response.select(1)
    with pytest.raises(InputError, match="finite angle"):
        response.unwrapped_phase(np.nan)
