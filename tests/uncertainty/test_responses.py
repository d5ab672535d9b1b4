from __future__ import annotations

import numpy as np
import pytest

from levelone.errors import InputError
from levelone.status import Status
from levelone.uncertainty import Responses

NAN = np.nan
SAMPLE = Responses(
    np.array([[1.0, NAN], [2.0, 5.0], [NAN, 6.0], [3.0, NAN]]),
    np.array(
        [
            [Status.OK, Status.NO_VALLEY],
            [Status.PEAK_CHOICE_CHANGED, Status.OK],
            [Status.DIVERGED, Status.OK],
            [Status.OK, Status.NO_VALLEY],
        ]
    ),
    ("quickness", "zeta"),
    ("1/s", "1"),
)


def test_a_caution_keeps_its_value_and_a_failure_does_not():
    np.testing.assert_array_equal(SAMPLE.column("quickness"), [1.0, 2.0, NAN, 3.0])
    assert SAMPLE.failed("quickness").tolist() == [False, False, True, False]
    assert SAMPLE.failed("zeta").tolist() == [True, False, False, True]
    assert len(SAMPLE) == 4


def test_outcomes_are_counted_commonest_first():
    assert list(SAMPLE.counts("quickness").items()) == [
        (Status.OK, 2),
        (Status.DIVERGED, 1),
        (Status.PEAK_CHOICE_CHANGED, 1),
    ]


def test_values_without_status_get_one():
    responses = Responses.from_values([[1.0], [np.inf], [NAN]], ["y"])
    assert responses.counts("y") == {Status.MODEL_FAILED: 2, Status.OK: 1}
    np.testing.assert_array_equal(responses.column("y"), [1.0, NAN, NAN])
    assert responses.units == ("1",)


def test_responses_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        SAMPLE.values[0, 0] = 0.0


@pytest.mark.parametrize(
    ("values", "status", "names", "units", "words"),
    [
        ([[1.0, 2.0]], [[0]], ("a", "b"), ("1", "1"), r"\[n, m\]"),
        ([[1.0, 2.0]], [[0, 0]], ("a",), ("1", "1"), "1 names"),
        ([[1.0, 2.0]], [[0, 0]], ("a", "a"), ("1", "1"), "twice"),
        ([[1.0]], [[999]], ("a",), ("1",), "unknown code 999"),
        ([[0.0]], [[2]], ("a",), ("1",), "0.0 with status DIVERGED"),
        ([[NAN]], [[0]], ("a",), ("1",), "nan with status OK"),
        ([[NAN]], [[60]], ("a",), ("1",), "nan with status PEAK_CHOICE_CHANGED"),
        ([[np.inf]], [[0]], ("a",), ("1",), "inf with status OK"),
    ],
)
def test_contradictions_are_refused(values, status, names, units, words):
    with pytest.raises(InputError, match=words):
        Responses(np.array(values), np.array(status), names, units)


def test_an_unknown_response_is_answered_with_the_closest():
    with pytest.raises(InputError, match=r"did you mean 'zeta'\?"):
        SAMPLE.column("zetta")
