"""Worker processes: answers, faults, time limits, starts that fail, and what is left behind."""

from __future__ import annotations

import fcntl
import itertools
import os
import resource
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from executor_models import FAULTS, Commanding, Faulty, Plain, Slow, Unopenable, answers

from levelone.campaign.evaluate import evaluate
from levelone.campaign.executors import executor_of
from levelone.campaign.executors.batch import BatchExecutor
from levelone.campaign.executors.pool import MOST_FAILED_STARTS, cores
from levelone.campaign.executors.processes import ProcessExecutor
from levelone.campaign.executors.scratch import PREFIX, scratch
from levelone.config.campaign_table import CampaignOptions
from levelone.errors import InputError, LeveloneError
from levelone.status import Status

POINTS = np.random.default_rng(4).random((120, 3))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where temporary files go in this test."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize(("workers", "chunk"), [(1, 1), (3, 7)])
def test_same_answers_as_in_process(folder: Path, workers: int, chunk: int) -> None:
    found = evaluate(Plain(), POINTS, None, ProcessExecutor(workers, chunk=chunk))
    expected = evaluate(Plain(), POINTS, None, BatchExecutor())
    for name in ("values", "status", "levels"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert list(folder.iterdir()) == []


def test_one_in_a_hundred_crashes_hangs_or_answers_nan(folder: Path) -> None:
    points = np.random.default_rng(5).random((300, 3))
    faults = [Faulty.SEGFAULT, Faulty.ABORT, Faulty.EXIT, Faulty.HANG, Faulty.HANG, Faulty.HANG, *[Faulty.NAN] * 3]
    where = np.random.default_rng(6).choice(300, len(faults), replace=False)
    points[where, 0] = faults
    found = evaluate(Faulty(), points, None, ProcessExecutor(4, time_limit=0.7, opening=1.0))
    due = {Faulty.HANG: (Status.TIMED_OUT, "in misbehave"), **FAULTS}
    for i, fault in zip(where, faults, strict=True):
        status, words = due[fault]
        assert found.status[i].tolist() == [status, status]
        assert words in found.messages[i]
        assert np.isnan(found.values[i]).all()
    rest = np.setdiff1d(np.arange(300), where)
    np.testing.assert_array_equal(found.values[rest], answers(points[rest]).values)
    assert (found.status[rest] == Status.OK).all()
    assert (found.seconds[found.status[:, 0] == Status.TIMED_OUT] >= 0.7).all()
    assert list(folder.iterdir()) == []


def test_who_answered_in_time_is_not_late_because_the_parent_was_busy(folder: Path) -> None:
    points = np.array([[0.05, 1.0, 1.0], [0.3, 1.0, 1.0]])
    statuses = dict[int, int]()
    with closing(ProcessExecutor(2, time_limit=1.0, opening=0.0).run(Slow(), points)) as pairs:
        for index, answer in pairs:
            statuses |= zip(index.tolist(), answer.status[:, 0].tolist(), strict=True)
            if index.size and len(statuses) == 1:
                time.sleep(1.3)  # a commit on a slow disk
    assert statuses == {0: Status.OK, 1: Status.OK}


def test_a_late_first_evaluation_is_said_to_be_the_first(folder: Path) -> None:
    points = np.array([[0.5, 1.0, 1.0], [Faulty.HANG, 1.0, 1.0], [Faulty.HANG, 2.0, 1.0]])
    found = evaluate(Faulty(), points, None, ProcessExecutor(1, time_limit=0.3, opening=0.2))
    assert found.status[:, 0].tolist() == [Status.OK, Status.TIMED_OUT, Status.TIMED_OUT]
    assert ["the first evaluation of its process" in text for text in found.messages] == [False, False, True]


def test_message_of_a_crash_holds_the_signal_and_the_output_of_that_evaluation(folder: Path) -> None:
    points = POINTS[:4].copy()
    points[[1, 2], 0] = Faulty.NOISE, Faulty.SEGFAULT
    found = evaluate(Faulty(), points, None, ProcessExecutor(1))
    assert found.messages[2].startswith("the process ended by SIGSEGV (signal 11); its last output: about to read address zero")
    assert "Fatal Python error: Segmentation fault" in found.messages[2]
    assert "in misbehave" in found.messages[2]


def test_exceptions_inside_a_worker(folder: Path) -> None:
    points, faults = POINTS[:20].copy(), [Faulty.RAISE, Faulty.SHAPE, Faulty.QUIT, Faulty.KILLED]
    points[3:7, 0] = faults
    found = evaluate(Faulty(), points, None, ProcessExecutor(1))
    for i, fault in enumerate(faults, start=3):
        status, words = FAULTS[fault]
        assert found.status[i].tolist() == [status, status]
        assert words in found.messages[i]
    assert (found.status[7:] == Status.OK).all()


def test_a_mistake_of_the_user_is_raised_by_the_parent(folder: Path) -> None:
    points = POINTS.copy()
    points[60, 0] = Faulty.MISTAKE
    with pytest.raises(InputError, match=r"model\.file: there is none"):
        evaluate(Faulty(), points, None, ProcessExecutor(1))
    assert list(folder.iterdir()) == []


def test_a_model_that_cannot_be_opened_is_refused_at_once(folder: Path) -> None:
    with pytest.raises(InputError, match="cannot be opened in a process of its own: ImportError: no module named 'rotor'"):
        evaluate(Unopenable(), POINTS, None, ProcessExecutor(1))


def test_starts_that_crash_are_not_repeated_for_ever(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from levelone.campaign.executors import pool

    started = []

    class Counted(pool.Child):
        def __init__(self, where: Path, pickled: bytes) -> None:
            started.append(where)
            super().__init__(where, pickled)

    monkeypatch.setattr(pool, "Child", Counted)
    with pytest.raises(LeveloneError, match="before they can open the model: the process ended by SIGABRT"):
        evaluate(Unopenable(how="abort"), POINTS, None, ProcessExecutor(1))
    assert len(started) == MOST_FAILED_STARTS
    assert list(folder.iterdir()) == []


def test_more_workers_than_files_can_be_open_end_in_one_line_and_leave_none_open(folder: Path) -> None:
    before = set(os.listdir("/dev/fd"))
    free = (number for number in itertools.count() if str(number) not in before)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (next(itertools.islice(free, 16, None)), hard))
    try:
        with pytest.raises(
            LeveloneError, match=r"worker \d+ of 12 cannot be started: .*Too many open files.*; use fewer --workers"
        ):
            evaluate(Plain(), POINTS, None, ProcessExecutor(12))
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert set(os.listdir("/dev/fd")) == before
    assert list(folder.iterdir()) == []


def test_a_process_that_cannot_be_tied_is_not_left_behind(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from levelone.campaign.executors import child

    def refuse(self: object, group: int) -> None:
        groups.append(group)
        raise OSError(22, "Invalid argument")

    groups = list[int]()
    before = set(os.listdir("/dev/fd"))
    monkeypatch.setattr(child.Tether, "tie", refuse)
    with pytest.raises(LeveloneError, match="worker 1 of 2 cannot be started"):
        evaluate(Plain(), POINTS, None, ProcessExecutor(2))
    with pytest.raises(ProcessLookupError):
        os.killpg(groups[0], 0)
    assert set(os.listdir("/dev/fd")) == before


def test_no_room_for_temporary_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    with pytest.raises(LeveloneError, match="no folder for temporary files can be made in it: No such file"):
        evaluate(Plain(), POINTS, None, ProcessExecutor(1))


def test_a_model_that_cannot_travel_is_refused() -> None:
    class Local(Plain):
        pass

    with pytest.raises(InputError, match="cannot be sent to a worker process"):
        evaluate(Local(), POINTS, None, ProcessExecutor(1))


@pytest.mark.skipif(not hasattr(fcntl, "F_SETSIG"), reason="needs the signals of Linux")
def test_a_program_that_the_model_started_ends_with_its_worker(folder: Path) -> None:
    note = folder / "pid"
    found = evaluate(Commanding(note=str(note)), POINTS[:1], None, ProcessExecutor(1, time_limit=0.2, opening=1.0))
    assert found.status.tolist() == [[Status.TIMED_OUT] * 2]
    stat, until = Path(f"/proc/{int(note.read_text())}/stat"), time.monotonic() + 5.0
    while stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] != "Z":
        assert time.monotonic() < until
        time.sleep(0.01)


def test_closing_early_ends_the_workers(folder: Path) -> None:
    points = np.full((8, 3), Faulty.HANG)
    points[0] = 0.5
    with closing(ProcessExecutor(2, chunk=1).run(Faulty(), points)) as pairs:
        index, _ = next(pair for pair in pairs if pair[0].size)
        assert index.tolist() == [0]
        workers = [path.name for path in next(folder.glob(f"{PREFIX}*")).iterdir() if path.is_dir()]
        assert sorted(workers) == ["0", "1"]
    assert list(folder.iterdir()) == []


def test_folders_of_killed_runs_are_removed_and_those_of_others_are_not(folder: Path) -> None:
    left = folder / f"{PREFIX}left"
    left.mkdir()
    (left / "lock").touch()
    with scratch() as first:
        assert not left.exists()
        with scratch() as second:
            assert first.exists()
            assert second.exists()
    assert list(folder.iterdir()) == []


def test_a_disk_without_locks_costs_nothing_but_the_tidying(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(descriptor: int, operation: int) -> None:
        raise OSError(38, "Function not implemented")

    left = folder / f"{PREFIX}left"
    left.mkdir()
    (left / "lock").touch()
    monkeypatch.setattr(fcntl, "flock", refuse)
    with scratch() as mine:
        assert mine.exists()
    assert list(folder.iterdir()) == [left]


class TestExecutorOf:
    """The executor that the options name."""

    options: ClassVar = {"workers": 3, "time_limit": 2.0, "retries": 1}

    def test_processes(self) -> None:
        assert executor_of(CampaignOptions("processes", **self.options)) == ProcessExecutor(3, 2.0, 1)
        assert executor_of(CampaignOptions("processes", chunk=5)) == ProcessExecutor(chunk=5)

    @pytest.mark.parametrize("executor", ["processes", "dask://node7:8786"])
    def test_none_of_them_on_windows(self, executor: str, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(sys, "platform", "win32")
        with pytest.raises(InputError, match="needs Linux or macOS"):
            executor_of(CampaignOptions(executor))

    def test_batch(self) -> None:
        assert executor_of(CampaignOptions(retries=2)) == BatchExecutor(retries=2)

    def test_dask(self) -> None:
        dask_cluster = pytest.importorskip("levelone.campaign.executors.dask_cluster", reason="needs Dask")
        found = executor_of(CampaignOptions("dask://node7:8786", time_limit=2.0, chunk=9))
        assert found == dask_cluster.DaskExecutor("node7:8786", 2.0, chunk=9)

    def test_workers_are_as_many_as_cores_to_use(self) -> None:
        assert cores() == len(os.sched_getaffinity(0))
