"""Evaluations of a campaign: what is run, what is kept and when, and in which order it comes back."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from executor_models import Plain, answers
from hypothesis import given
from hypothesis import strategies as st

from levelone.campaign.evaluate import CampaignInterrupted, evaluate
from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.executors.batch import BatchExecutor
from levelone.campaign.models.protocol import Evaluations, failed, joined
from levelone.campaign.progress import Tally, duration, tally_text
from levelone.campaign.store_schema import StoreError
from levelone.errors import InputError, LeveloneError
from levelone.status import Status

POINTS = np.random.default_rng(8).random((40, 3))


@dataclass
class Scripted:
    """Answers one by one in a shuffled order; fails where it is told to, so many times; can stop with an error."""

    seed: int = 0
    failures: dict[float, int] = field(default_factory=dict)
    retries: int = 0
    stop: BaseException | None = None
    stop_after: int = 10**9
    pauses: int = 1
    seen: list[float] = field(default_factory=list)
    closed: int = 0

    def run(self, model: Plain, points: np.ndarray) -> Iterator[tuple[np.ndarray, Evaluations]]:
        try:
            for count, i in enumerate(np.random.default_rng(self.seed).permutation(len(points))):
                if count == self.stop_after and self.stop is not None:
                    raise self.stop
                first = float(points[i, 0])
                self.seen.append(first)
                left = self.failures.get(first, 0)
                self.failures[first] = left - 1
                answer = failed(Status.CRASHED, "broken", 2, 1) if left > 0 else model.evaluate(points[[i]])
                yield np.array([i]), answer
                if count % self.pauses == 0:
                    yield np.empty(0, dtype=np.int64), answer.select(slice(0))
        finally:
            self.closed += 1


@pytest.fixture
def store(tmp_path: Path) -> Iterator[EvaluationStore]:
    with opened(tmp_path) as made:
        yield made


def opened(folder: Path) -> EvaluationStore:
    model = Plain()
    return EvaluationStore.open(folder / "campaign.sqlite", model.key, model.names, model.units, model.judged, "abc", "hash")


def same(found: Evaluations, expected: Evaluations) -> None:
    for name in ("values", "status", "levels", "messages"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


@given(which=st.lists(st.integers(0, 9), max_size=30), seed=st.integers(0, 99))
def test_answers_in_order_of_the_points_and_each_point_once(which: list[int], seed: int) -> None:
    points, executor = POINTS[np.array(which, dtype=int)].reshape(-1, 3), Scripted(seed)
    same(evaluate(Plain(), points, None, executor), answers(points))
    assert sorted(executor.seen) == sorted({float(p) for p in points[:, 0]})


def test_zero_and_minus_zero_are_one_point() -> None:
    executor = Scripted()
    evaluate(Plain(), np.array([[0.0, 1.0, 1.0], [-0.0, 1.0, 1.0]]), None, executor)
    assert executor.seen == [0.0]


def test_what_the_store_holds_is_not_run(store: EvaluationStore) -> None:
    evaluate(Plain(), POINTS[:25], store, Scripted())
    executor, tallies = Scripted(), list[Tally]()
    same(evaluate(Plain(), POINTS, store, executor, tallies.append), answers(POINTS))
    assert sorted(executor.seen) == sorted(POINTS[25:, 0].tolist())
    assert (tallies[0].done, tallies[0].reused) == (25, 25)
    assert (tallies[-1].done, tallies[-1].total, tallies[-1].reused) == (40, 40, 25)
    idle = Scripted()
    same(evaluate(Plain(), POINTS, store, idle), answers(POINTS))
    assert idle.closed == 0


def test_nothing_is_counted_that_is_not_in_the_store(tmp_path: Path) -> None:
    with opened(tmp_path) as store:

        def compare(tally: Tally) -> None:
            assert store.lookup(POINTS)[0].sum() == tally.done

        evaluate(Plain(), POINTS, store, Scripted(pauses=3), compare)


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), InputError("model", "gone"), LeveloneError("scheduler gone")])
@pytest.mark.parametrize("pauses", [1, 1000])
def test_what_came_back_before_the_end_is_kept(store: EvaluationStore, stop: BaseException, pauses: int) -> None:
    executor = Scripted(stop=stop, stop_after=15, pauses=pauses)
    expected = CampaignInterrupted if isinstance(stop, KeyboardInterrupt) else type(stop)
    with pytest.raises(expected) as caught:
        evaluate(Plain(), POINTS, store, executor)
    assert executor.closed == 1
    assert store.lookup(POINTS)[0].sum() == 15
    if expected is CampaignInterrupted:
        assert (
            str(caught.value) == "interrupted after 15 of 40 evaluations; those are kept: repeat the command with --resume to go on"
        )
    same(evaluate(Plain(), POINTS, store, Scripted(seed=1)), answers(POINTS))


def test_interrupt_without_a_store_says_that_nothing_is_kept() -> None:
    with pytest.raises(CampaignInterrupted, match="none is kept"):
        evaluate(Plain(), POINTS, None, Scripted(stop=KeyboardInterrupt(), stop_after=3))


def test_a_store_that_cannot_be_written_ends_the_campaign(store: EvaluationStore, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def full(*arguments: object, **options: object) -> None:
        calls.append(arguments)
        raise StoreError("the disk is full")

    monkeypatch.setattr(store, "add", full)
    executor = Scripted()
    with pytest.raises(StoreError, match="the disk is full"):
        evaluate(Plain(), POINTS, store, executor)
    assert len(calls) == 1
    assert executor.closed == 1


def test_failed_evaluations_are_repeated_as_often_as_asked_and_the_last_stands(tmp_path: Path) -> None:
    first, second, third = POINTS[3, 0], POINTS[9, 0], POINTS[20, 0]
    executor = Scripted(failures={first: 1, second: 2, third: 3}, retries=2)
    with opened(tmp_path) as store:
        found = evaluate(Plain(), POINTS, store, executor)
    assert [executor.seen.count(point) for point in (first, second, third, POINTS[0, 0])] == [2, 3, 3, 1]
    expected = answers(POINTS)
    stands = np.arange(40) != 20
    same(found.select(stands), expected.select(stands))
    assert found.status[20].tolist() == [Status.CRASHED] * 2
    assert found.messages[20] == "broken"
    assert attempts(tmp_path) == {1: 37, 2: 1, 3: 2}


def attempts(folder: Path) -> dict[int, int]:
    """How many evaluations of a store took so many attempts."""
    import sqlite3
    from contextlib import closing

    with closing(sqlite3.connect(folder / "campaign.sqlite")) as file:
        return dict(file.execute("SELECT attempts, count(*) FROM evaluation GROUP BY attempts"))


def test_failures_in_the_store_are_run_again_only_if_asked(store: EvaluationStore) -> None:
    point = float(POINTS[5, 0])
    evaluate(Plain(), POINTS, store, Scripted(failures={point: 1}))
    idle, again = Scripted(), Scripted()
    assert evaluate(Plain(), POINTS, store, idle).status[5, 0] == Status.CRASHED
    assert idle.seen == []
    same(evaluate(Plain(), POINTS, store, again, retry_failed=True), answers(POINTS))
    assert again.seen == [point]


def test_an_executor_that_leaves_points_out_or_answers_twice_is_found_out() -> None:
    class Forgetful(Scripted):
        def run(self, model: Plain, points: np.ndarray) -> Iterator[tuple[np.ndarray, Evaluations]]:
            return (pair for pair in [(np.arange(39), answers(points[:39]))])

    class Doubtful(Scripted):
        def run(self, model: Plain, points: np.ndarray) -> Iterator[tuple[np.ndarray, Evaluations]]:
            pair = np.arange(40), answers(points)
            return (each for each in (pair, (np.empty(0, dtype=int), pair[1].select(slice(0))), pair))

    with pytest.raises(LeveloneError, match="1 evaluations were not answered by Forgetful; the first is 39"):
        evaluate(Plain(), POINTS, None, Forgetful())
    with pytest.raises(LeveloneError, match="answered twice"):
        evaluate(Plain(), POINTS, None, Doubtful())


def test_histories_of_the_others_survive_a_failed_evaluation() -> None:
    class Recorded(Scripted):
        def run(self, model: Plain, points: np.ndarray) -> Iterator[tuple[np.ndarray, Evaluations]]:
            whole = replace(answers(points[:3]), histories=({"step": 1}, {"step": 2}, {"step": 3}))
            yield np.arange(3), whole
            yield np.array([3]), failed(Status.CRASHED, "", 2, 1)

    assert evaluate(Plain(), POINTS[:4], None, Recorded()).histories == ({"step": 1}, {"step": 2}, {"step": 3}, {})


def test_batch_and_store_agree_on_a_mixture(store: EvaluationStore) -> None:
    order = np.array([*range(30, 40), *range(30), 5, 5, 39])
    evaluate(Plain(), POINTS[::3], store, BatchExecutor())
    same(evaluate(Plain(), POINTS[order], store, BatchExecutor()), joined([answers(POINTS[order])]))


class TestTally:
    """Progress in numbers and words."""

    def test_counts_rate_and_rest(self, monkeypatch: pytest.MonkeyPatch) -> None:
        clock = itertools.count(100.0, 2.0)
        monkeypatch.setattr("levelone.campaign.evaluate.time.monotonic", lambda: next(clock))
        tallies = list[Tally]()
        evaluate(Plain(), POINTS[:4], None, Scripted(failures={float(POINTS[0, 0]): 1}, seed=2), tallies.append)
        assert [tally.done for tally in tallies] == [0, 1, 2, 3, 4]
        assert math.isnan(tallies[0].rate)
        for tally in tallies[1:]:
            assert tally.remaining == pytest.approx((4 - tally.done) / tally.rate)
        assert tallies[-1].failed == {Status.CRASHED.text: 1}
        assert tallies[-1].remaining == 0.0

    @pytest.mark.parametrize(
        ("tally", "text"),
        [
            (Tally(0, 400), "0/400"),
            (Tally(120, 400, 100, {}, 2.0, 140.0), "120/400  100 found in the store  2/s  2 min 20 s left"),
            (Tally(3, 400, 0, {}, 0.05, 7940.0), "3/400  20 s each  2 h 12 min left"),
            (
                Tally(400, 400, 0, {Status.TIMED_OUT.text: 1, Status.CRASHED.text: 2, Status.DIVERGED.text: 1}, 8.0, 0.0),
                "400/400  8/s  4 failed (2 crashed, 1 timed out, 1 the run diverged)",
            ),
        ],
    )
    def test_line(self, tally: Tally, text: str) -> None:
        assert tally_text(tally) == text

    @pytest.mark.parametrize(
        ("seconds", "text"), [(0.2, "0 s"), (59.6, "1 min"), (3600.0, "1 h"), (3725.0, "1 h 2 min"), (190_000.0, "2 d 4 h")]
    )
    def test_duration(self, seconds: float, text: str) -> None:
        assert duration(seconds) == text
