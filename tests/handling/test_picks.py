from __future__ import annotations

import numpy as np
import pytest
from handling_signals import batch, decaying_sine, grid

from levelone.errors import InputError
from levelone.handling.damping import dynamic_stability
from levelone.handling.picks import flag_changed_choice
from levelone.handling.quickness import attitude_quickness
from levelone.status import Status


def responses(bump):
    """Six runs around one oscillation; the third carries a bump ahead of its first peak, ``bump`` times its size."""
    time = grid()
    rate, attitude = decaying_sine(time, np.full(6, 0.35), np.linspace(4.8, 6.4, 6))
    rate[2] -= bump * np.abs(rate[2]).max() * np.exp(-(((time - 1.06) / 0.012) ** 2))
    return batch(rate, attitude, time=time)


def test_a_range_of_frequencies_is_no_change_of_choice():
    history = responses(0.0)
    result = attitude_quickness(history)
    flagged = flag_changed_choice(result, result, run=3)
    assert (flagged.status == Status.OK).all()
    assert (flagged.status_min == Status.OK).all()


def test_an_earlier_bump_that_was_picked_is_flagged_and_its_value_stands():
    nominal = attitude_quickness(responses(0.0))
    result = attitude_quickness(responses(0.6))
    assert result.t_q_pk[2] < nominal.t_q_pk[2] - 0.05
    flagged = flag_changed_choice(result, nominal)
    expected = [Status.OK, Status.OK, Status.PEAK_CHOICE_CHANGED, Status.OK, Status.OK, Status.OK]
    assert flagged.status.tolist() == expected
    assert flagged.status_min.tolist() == expected
    assert not Status(flagged.status[2]).failed
    np.testing.assert_array_equal(flagged.quickness, result.quickness)


def test_a_ripple_that_is_not_picked_is_no_change():
    result = flag_changed_choice(attitude_quickness(responses(0.08)), attitude_quickness(responses(0.0)))
    assert (result.status == Status.OK).all()


def test_first_free_extremum_of_the_other_sign_is_flagged():
    time, off = grid(), 1.5
    phase = np.array([0.2, 0.3, -0.1])  # the last has its positive peak before the response is free: a valley comes first
    s = np.maximum(time - off, 0.0)
    rate = np.where(time >= off - 1e-9, np.exp(-1.5 * s) * np.cos(5.0 * s - phase[:, None] - 0.29), 0.0)
    result = dynamic_stability(batch(rate, rate, time=time, off=off))
    assert np.sign(result.values[:, 0]).tolist() == [1.0, 1.0, -1.0]
    flagged = flag_changed_choice(result, result, run=0)
    assert flagged.status.tolist() == [Status.OK, Status.OK, Status.PEAK_CHOICE_CHANGED]
    assert flagged.status_omega.tolist() == [Status.OK, Status.OK, Status.PEAK_CHOICE_CHANGED]


def test_a_failed_run_keeps_its_status():
    time = grid()
    rate, attitude = decaying_sine(time, [0.35, 0.35], [5.0, 5.0])
    rate[1] = 0.0
    result = attitude_quickness(batch(rate, attitude, time=time))
    assert flag_changed_choice(result, result).status.tolist() == [Status.OK, Status.NO_FIRST_PEAK]


def test_a_reference_run_that_does_not_exist_is_refused():
    result = attitude_quickness(responses(0.0))
    with pytest.raises(InputError, match="not among the 6 runs"):
        flag_changed_choice(result, result, run=6)
