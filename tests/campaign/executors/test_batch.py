"""In-process evaluation."""

from __future__ import annotations

import numpy as np
import pytest
from executor_models import FAULTS, Faulty, Plain, answers
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.campaign.executors.batch import BatchExecutor
from levelone.campaign.models.protocol import Evaluations
from levelone.errors import InputError

POINTS = np.random.default_rng(3).random((300, 3))
IN_PROCESS = [Faulty.RAISE, Faulty.SHAPE, Faulty.QUIT, Faulty.NAN]


@settings(max_examples=15)
@given(n=st.integers(0, 40), chunk=st.integers(1, 50))
def test_every_point_is_answered_once_whatever_the_chunk(n: int, chunk: int) -> None:
    pairs = list(BatchExecutor(chunk).run(Plain(), POINTS[:n]))
    indices = np.concatenate([index for index, _ in pairs]) if pairs else np.empty(0)
    assert indices.tolist() == list(range(n))
    assert max((index.size for index, _ in pairs), default=0) <= chunk
    np.testing.assert_array_equal(np.concatenate([np.empty((0, 2)), *(a.values for _, a in pairs)]), answers(POINTS[:n]).values)


def test_calls_grow_from_one_point_while_they_are_quick() -> None:
    sizes = [index.size for index, _ in BatchExecutor(64).run(Plain(), POINTS) if index.size]
    assert sizes == [1, 2, 4, 8, 16, 32, 64, 64, 64, 45]


@pytest.mark.parametrize("fault", IN_PROCESS)
def test_one_bad_point_costs_one_evaluation(fault: float) -> None:
    points = POINTS[:40].copy()
    points[17, 0] = fault
    found = dict[int, Evaluations]()
    for index, answer in BatchExecutor().run(Faulty(), points):
        found |= {int(i): answer.select([k]) for k, i in enumerate(index)}
    status, words = FAULTS[fault]
    assert found[17].status.tolist() == [[status, status]]
    assert words in found[17].messages[0]
    assert np.isnan(found[17].values).all()
    for i in set(range(40)) - {17}:
        np.testing.assert_array_equal(found[i].values, answers(points[i : i + 1]).values)


def test_a_mistake_of_the_user_is_raised() -> None:
    points = POINTS[:5].copy()
    points[3, 0] = Faulty.MISTAKE
    with pytest.raises(InputError, match=r"model\.file: there is none"):
        list(BatchExecutor().run(Faulty(), points))
