"""Where failures lie: tables made by hand, and rules of failure that are known."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import entropy

from levelone.campaign.failure_map import BINS, SHOWN, _information, best_pair, failure_map, outcome_rows
from levelone.errors import InputError
from levelone.status import Status

CRASHED, TIMED_OUT, VALLEY = int(Status.CRASHED), int(Status.TIMED_OUT), int(Status.NO_VALLEY)
FACTORS = [f"f{i}" for i in range(6)]


def sample(n: int = 400, k: int = 6, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((n, k))


def mapped(unit: np.ndarray, failed: np.ndarray, seed: int = 0) -> dict:
    status = np.where(failed[:, None], CRASHED, 0) * np.ones((1, 2), dtype=np.int64)
    names = FACTORS[: unit.shape[1]]
    return failure_map(unit, 10.0 * unit, status, names, ["kg"] * len(names), ["zeta", "omega_n"], seed)


class TestPair:
    @pytest.mark.parametrize(
        ("rule", "pair"),
        [
            (lambda u: (u[:, 2] > 0.75) & (u[:, 4] < 0.25), (2, 4)),
            (lambda u: (u[:, 0] > 0.5) ^ (u[:, 5] > 0.5), (0, 5)),
            (lambda u: np.hypot(u[:, 1] - 1.0, u[:, 3] - 1.0) < 0.4, (1, 3)),
        ],
    )
    def test_the_two_factors_that_decide_are_found(self, rule, pair) -> None:
        unit = sample()
        found = best_pair(unit, rule(unit), seed=3)
        assert found.factors == pair
        assert found.p_value == 1.0 / 200.0
        assert found.information > 5.0 * max(found.alone) or pair != (0, 5)  # neither of an exclusive or tells anything alone

    def test_one_factor_that_decides_tells_all_by_itself(self) -> None:
        unit = sample()
        found = best_pair(unit, unit[:, 3] > 0.75, seed=3)
        assert 3 in found.factors
        alone = found.alone[found.factors.index(3)]
        share = np.mean(unit[:, 3] > 0.75)
        exact = entropy([share, 1.0 - share], base=2) - (BINS - 1) / (2 * 400 * math.log(2))
        assert alone == pytest.approx(exact)
        assert alone > found.information  # the other only adds to the correction

    def test_chance_is_called_so_as_often_as_promised(self) -> None:
        rng = np.random.default_rng(8)
        p = [best_pair(sample(200, 5, seed), rng.random(200) < 0.1, seed).p_value for seed in range(40)]
        assert np.mean(np.array(p) < 0.05) < 0.19  # 5 % expected; eight or more of 40 happen once in 2000
        assert 0.3 < np.mean(p) < 0.7

    def test_counts_are_those_of_the_quarters(self) -> None:
        unit = np.array([[0.1, 0.9], [0.2, 0.8], [0.6, 0.1], [0.99, 1.0], [0.0, 0.5]])
        found = best_pair(unit, np.array([True, True, False, False, True]), seed=0)
        runs = np.zeros((4, 4))
        failed = np.zeros((4, 4))
        for a, b, lost in ((0, 3, 1), (0, 3, 1), (2, 0, 0), (3, 3, 0), (0, 2, 1)):
            runs[a, b] += 1
            failed[a, b] += lost
        np.testing.assert_array_equal(found.runs, runs)
        np.testing.assert_array_equal(found.failed, failed)

    def test_many_failures_are_looked_at_in_part_and_counted_in_full(self) -> None:
        unit = sample(30_000, 3)
        failed = (unit[:, 0] > 0.5) & (unit[:, 2] > 0.25)
        found = best_pair(unit, failed, seed=1)
        assert found.factors == (0, 2)
        assert found.failed.sum() == failed.sum()
        assert found.runs.sum() == 30_000

    @pytest.mark.parametrize("failed", [np.zeros(20, dtype=bool), np.ones(20, dtype=bool)])
    def test_nothing_to_tell_apart(self, failed: np.ndarray) -> None:
        assert best_pair(sample(20), failed, 0) is None
        assert best_pair(sample(20, 1), np.arange(20) < 3, 0) is None


@pytest.mark.theory
@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=2, max_size=16))
def test_information_is_the_sum_of_entropies(counts: list[tuple[int, int]]) -> None:
    """I(X; Y) = H(X) + H(Y) - H(X, Y) (T. M. Cover, J. A. Thomas, Elements of Information Theory, 2006, eq. 2.45)."""
    table = np.array(counts, dtype=float)
    if table.sum() == 0:
        return
    exact = entropy(table.sum(axis=0), base=2) + entropy(table.sum(axis=1), base=2) - entropy(table.ravel(), base=2)
    bias = ((table.sum(axis=1) > 0).sum() - 1) / (2 * table.sum() * math.log(2))
    found = _information(table[None, :, 0], table.sum(axis=1)[None])
    assert found[0] == pytest.approx(exact - bias, abs=1e-12)


class TestMap:
    def test_without_failures_there_is_nothing_but_the_number(self) -> None:
        assert mapped(sample(50), np.zeros(50, dtype=bool)) == {"runs": 50, "failed": 0, "outcomes": []}

    def test_no_runs(self) -> None:
        assert mapped(sample(0), np.zeros(0, dtype=bool)) == {"runs": 0, "failed": 0, "outcomes": []}

    def test_when_all_failed_no_pair_is_claimed(self) -> None:
        found = mapped(sample(30), np.ones(30, dtype=bool))
        assert "pair" not in found
        assert all(math.isnan(row["p_value"]) for row in found["factors"])
        assert len(found["shown"]["x"]) == 30

    def test_one_factor_has_strips_and_no_pair(self) -> None:
        unit = sample(40, 1)
        found = mapped(unit, unit[:, 0] > 0.9)
        assert "pair" not in found
        assert [row["factor"] for row in found["factors"]] == ["f0"]

    def test_factors_come_by_their_rank_test_with_their_quarters(self) -> None:
        unit = sample()
        failed = unit[:, 4] > 0.8
        first = mapped(unit, failed)["factors"][0]
        assert first["factor"] == "f4"
        assert first["failed"] == [0, 0, 0, int(failed.sum())]
        assert sum(first["runs"]) == 400
        assert first["mean_failed"] == pytest.approx(unit[failed, 4].mean())

    def test_each_evaluation_counts_once_under_its_first_cause(self) -> None:
        status = np.array([[0, 0], [CRASHED, CRASHED], [VALLEY, 0], [0, VALLEY], [VALLEY, TIMED_OUT], [int(Status.PIO_CAUTION), 0]])
        rows = outcome_rows(status, ["a", "b"])
        assert rows == [
            {"name": "no valley", "status": Status.NO_VALLEY.text, "evaluations": 2, "all_responses": 0, "responses": ["a", "b"]},
            {"name": "timed out", "status": Status.TIMED_OUT.text, "evaluations": 1, "all_responses": 1, "responses": ["a", "b"]},
            {"name": "crashed", "status": Status.CRASHED.text, "evaluations": 1, "all_responses": 1, "responses": ["a", "b"]},
        ]

    def test_what_is_shown_lies_where_it_ran(self) -> None:
        unit = sample()
        failed = (unit[:, 2] > 0.75) & (unit[:, 4] < 0.25)
        shown = mapped(unit, failed)["shown"]
        lost = np.array(shown["outcome"]) == "crashed"
        np.testing.assert_array_equal(np.array(shown["x"])[lost], 10.0 * unit[failed, 2])
        np.testing.assert_array_equal(np.array(shown["y"])[~lost], 10.0 * unit[~failed, 4])
        np.testing.assert_array_equal(shown["positions"], unit[failed])
        assert (shown["factors"], shown["units"], shown["of"]) == (["f2", "f4"], ["kg", "kg"], [failed.sum(), 400 - failed.sum()])

    def test_a_large_sample_is_shown_in_part(self) -> None:
        unit = sample(2 * SHOWN + 500, 2)
        failed = np.arange(len(unit)) < 300
        shown = mapped(unit, failed)["shown"]
        assert len(shown["x"]) == 300 + SHOWN
        assert shown["of"] == [300, 2 * SHOWN + 200]

    def test_the_same_every_time_and_plain_enough_for_json(self) -> None:
        unit = sample()
        one, two = (json.dumps(mapped(unit, unit[:, 0] > 0.95, seed=5)) for _ in range(2))
        assert one == two
        assert "null" not in one

    def test_shapes_that_do_not_fit(self) -> None:
        with pytest.raises(InputError, match=r"unit_points: shape \(4, 2\); \[4, 3\]"):
            failure_map(np.zeros((4, 2)), np.zeros((4, 3)), np.zeros((4, 1), dtype=np.int64), ["a", "b", "c"], ["1"] * 3, ["r"], 0)
