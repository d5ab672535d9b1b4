"""Worker processes: answers, faults, time limits, starts that fail, and what is left behind."""

from __future__ import annotations

import fcntl
import os
import time
from contextlib import closing
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from executor_models import FAULTS, Commanding, Faulty, Plain, Unopenable, answers

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


class TestExecutorOf:
    """The executor that the options name."""

    options: ClassVar = {"workers": 3, "time_limit": 2.0, "retries": 1}

    def test_processes(self) -> None:
        assert executor_of(CampaignOptions("processes", **self.options)) == ProcessExecutor(3, 2.0, 1)
        assert executor_of(CampaignOptions("processes", chunk=5)) == ProcessExecutor(chunk=5)

    def test_batch(self) -> None:
        assert executor_of(CampaignOptions(retries=2)) == BatchExecutor(retries=2)

    def test_dask(self) -> None:
        dask_cluster = pytest.importorskip("levelone.campaign.executors.dask_cluster", reason="needs Dask")
        found = executor_of(CampaignOptions("dask://node7:8786", time_limit=2.0, chunk=9))
        assert found == dask_cluster.DaskExecutor("node7:8786", 2.0, chunk=9)

    def test_workers_are_as_many_as_cores_to_use(self) -> None:
        assert cores() == len(os.sched_getaffinity(0))
