"""Evaluation through a real Dask scheduler and two worker processes on the loopback interface."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from executor_models import FAULTS, Faulty, Logged, Plain, answers

from levelone.campaign.evaluate import evaluate
from levelone.campaign.models.protocol import Evaluations
from levelone.config.campaign_table import Cluster
from levelone.errors import InputError, LeveloneError
from levelone.status import Status

distributed = pytest.importorskip("distributed", reason="needs Dask")
dask_cluster = pytest.importorskip("levelone.campaign.executors.dask_cluster", reason="needs Dask")
connect = pytest.importorskip("levelone.campaign.executors.connect", reason="needs Dask")
dask_chunk = pytest.importorskip("levelone.campaign.executors.dask_chunk", reason="needs Dask")

POINTS = np.random.default_rng(9).random((200, 3))


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A scheduler and two worker processes of one thread each."""
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address=None,
        scheduler_kwargs=connect.NO_PAGES,
        silence_logs=50,
    ) as made:
        yield made


def carried(model: Plain, points: np.ndarray, *where: Any, progress: Any = lambda tally: None, **options: Any) -> Evaluations:
    """What the model answers through Dask."""
    with closing(dask_cluster.DaskExecutor(*where, **options)) as executor:
        return evaluate(model, points, None, executor, progress)


@pytest.fixture
def address(cluster: Any) -> str:
    return cluster.scheduler_address.removeprefix("tcp://")


def children() -> list[int]:
    """Processes that a Dask worker has started for models."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state = folder.joinpath("stat").read_text().rsplit(")", 1)[1].split()
            words = folder.joinpath("cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if int(state[1]) == os.getpid() and state[0] != "Z" and any(word.endswith(b"campaign/worker.py") for word in words):
            found.append(int(folder.name))
    return found


def test_same_answers_and_no_process_left(cluster: Any, address: str) -> None:
    found = carried(Plain(), POINTS, address)
    expected = answers(POINTS)
    for name in ("values", "status", "levels", "messages"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    with distributed.Client(cluster, set_as_default=False) as client:
        until = time.monotonic() + 5.0
        while any(client.run(children).values()):
            assert time.monotonic() < until
            time.sleep(0.05)


def test_a_worker_killed_midway_changes_nothing(cluster: Any, address: str, tmp_path: Path) -> None:
    log = tmp_path / "log"
    log.touch()
    with distributed.Client(cluster, set_as_default=False) as client:
        before = client.run(os.getpid)
        killed: list[int] = []

        def kill_one(tally: Any) -> None:
            if tally.done >= 20 and not killed:
                killed.append(min(before.values()))
                os.kill(killed[0], signal.SIGKILL)

        found = carried(Logged(log=str(log)), POINTS, address, chunk=8, progress=kill_one)
        until = time.monotonic() + 20.0
        while len(client.scheduler_info()["workers"]) < 2:
            assert time.monotonic() < until
            time.sleep(0.05)
        after = client.run(os.getpid)
    expected = answers(POINTS)
    for name in ("values", "status", "levels"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert killed
    assert killed[0] not in after.values()
    ended = [line.split()[2] for line in log.read_text().splitlines() if line.startswith("end")]
    assert set(ended) == {point.tobytes().hex() for point in POINTS}
    # what was under way on the lost worker, and no more, was run twice
    assert len(ended) - len(POINTS) <= 8 * dask_cluster.AHEAD


def test_crashes_and_hangs_do_not_take_a_dask_worker_along(cluster: Any, address: str) -> None:
    points, faults = POINTS.copy(), [Faulty.SEGFAULT, Faulty.RAISE, Faulty.NAN]
    points[[20, 60, 61], 0] = faults
    points[100, 0] = Faulty.HANG
    with distributed.Client(cluster, set_as_default=False) as client:
        before = client.run(os.getpid)
        found = carried(Faulty(), points, address, 0.5, opening=1.0)
        assert client.run(os.getpid) == before
    for i, fault in zip((20, 60, 61), faults, strict=True):
        assert found.status[i, 0] == FAULTS[fault][0]
        assert FAULTS[fault][1] in found.messages[i]
    assert found.status[100, 0] == Status.TIMED_OUT
    rest = np.setdiff1d(np.arange(200), [20, 60, 61, 100])
    np.testing.assert_array_equal(found.values[rest], answers(points[rest]).values)


def test_all_runs_of_a_campaign_share_one_connection(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    points, events = POINTS[:12].copy(), []
    points[5, 0] = Faulty.NAN

    @contextmanager
    def counted(where: str) -> Iterator[Any]:
        with connect.connected(where) as client:
            events.append("opened")
            yield client
            events.append("closed")

    monkeypatch.setattr(dask_cluster, "connected", counted)
    with closing(dask_cluster.DaskExecutor(address, retries=1)) as executor:
        assert events == []
        for part in (points[:6], points[6:]):
            found = evaluate(Faulty(), part, None, executor)
            np.testing.assert_array_equal(found.values[:5], answers(part[:5]).values)
        assert events == ["opened"]
    assert events == ["opened", "closed"]


def test_a_mistake_of_the_user_comes_back_as_such(address: str) -> None:
    points = POINTS[:30].copy()
    points[25, 0] = Faulty.MISTAKE
    with pytest.raises(InputError, match=r"model\.file: there is none"):
        carried(Faulty(), points, address)


def test_workers_of_another_version_are_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_cluster, "__version__", "0.0.1")
    with pytest.raises(LeveloneError, match=r"started with levelone 0\.0\.1, and a worker of the cluster has"):
        carried(Plain(), POINTS, address)


def test_no_scheduler_at_the_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connect, "PATIENCE", "0.3s")
    with pytest.raises(InputError, match=r"no Dask scheduler answers at dask://127\.0\.0\.1:9"):
        carried(Plain(), POINTS, "127.0.0.1:9")


def test_a_cluster_whose_workers_have_all_gone_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    threads = iter([{"one": 1}, {}, {}])
    client = SimpleNamespace(status="running", nthreads=lambda: next(threads))
    tasks = dask_cluster._Tasks(client, dask_chunk.Job("", "", b"", 2, 1, np.inf, 1.0), POINTS, 4)
    clock = iter([1000.0, 1010.0, 1301.0])
    monkeypatch.setattr(dask_cluster.time, "monotonic", lambda: next(clock))
    tasks._look()
    tasks._look()
    with pytest.raises(LeveloneError, match="no worker of the Dask cluster is left since 300 s"):
        tasks._look()


class Lost:
    """A task whose workers were lost with it."""

    def __init__(self, key: str) -> None:
        self.key = key

    def add_done_callback(self, call: Any) -> None:
        call(self)

    def result(self) -> Any:
        raise distributed.KilledWorker(self.key, SimpleNamespace(address="tcp://node7:1"), 3)


def test_a_chunk_that_takes_its_workers_along_is_split_to_find_the_cause() -> None:
    """The client stands in for a cluster that loses every worker which is given point 3."""

    class Deadly:
        status = "running"

        def nthreads(self) -> dict[str, int]:
            return {"one": 1}

        def submit(self, function: Any, job: Any, points: np.ndarray, pure: bool) -> Any:
            task = Lost(str(len(sizes)))
            sizes.append(len(points))
            if not (points == POINTS[3]).all(axis=1).any():
                task.result = lambda: dask_chunk.Answer(answers(points), 0.0)  # type: ignore[method-assign]
            return task

    sizes: list[int] = []
    job = dask_chunk.Job("", "", b"", 2, 1, np.inf, 1.0)
    tasks = dask_cluster._Tasks(Deadly(), job, POINTS[:16], 4)
    tasks._seconds = 0.0
    pairs = [(int(i), answer.select([k])) for index, answer in tasks.run() for k, i in enumerate(index)]
    found = {i: int(answer.status[0, 0]) for i, answer in pairs}
    assert len(pairs) == 16
    assert dict(pairs)[3].messages == ("4 Dask workers were lost one after the other, each of them with this evaluation",)
    assert found == {i: Status.CRASHED if i == 3 else Status.OK for i in range(16)}
    assert sizes[0] == 4
    assert sizes.count(1) >= 4


def test_cluster_of_this_machine_is_closed_to_others() -> None:
    pytest.importorskip("cryptography", reason="needs certificates")
    with connect.connected(Cluster("local", workers=1)) as client:
        assert client.scheduler.address.startswith("tls://127.0.0.1:")
        with pytest.raises((OSError, TimeoutError)), distributed.Client(f"tcp{client.scheduler.address[3:]}", timeout="0.3s"):
            pass


class TestSlurm:
    """A queueing system played by two scripts, the first of which keeps what it is given."""

    cluster = Cluster("slurm", workers=2, cores=3, memory="4 GB", walltime="01:00:00", queue="short", account="vtol")

    @pytest.fixture
    def folder(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        pytest.importorskip("cryptography", reason="needs certificates")
        pytest.importorskip("dask_jobqueue", reason="needs dask-jobqueue")
        (tmp_path / "work").mkdir()
        monkeypatch.chdir(tmp_path / "work")
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
        self.script(tmp_path / "scancel", "exit 0")
        return tmp_path

    @staticmethod
    def script(path: Path, text: str) -> None:
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)

    def test_job(self, folder: Path) -> None:
        self.script(folder / "sbatch", f'cat "$1" > {folder}/job; echo "Submitted batch job 7"')
        with connect.connected(self.cluster) as client:
            assert client.scheduler.address.startswith("tls://")
            certificates = next((folder / "work").iterdir())
            assert certificates.stat().st_mode & 0o077 == 0
            job = (folder / "job").read_text()
        for words in ("#SBATCH -p short", "#SBATCH -A vtol", "#SBATCH -t 01:00:00", "--cpus-per-task=3", "--nthreads 3"):
            assert words in job
        assert f"--tls-key {certificates}/worker_key.pem" in job
        assert list((folder / "work").iterdir()) == []

    def test_certificates_that_a_killed_campaign_of_this_machine_left_are_removed(self, folder: Path) -> None:
        self.script(folder / "sbatch", 'echo "Submitted batch job 7"')
        host = socket.gethostname()
        left = [folder / "work" / name for name in (f".levelone-{host}@tmp1", f".levelone-{host}-2@tmp2")]
        for each in left:
            each.mkdir()
            (each / "lock").touch()
        with connect.connected(self.cluster):
            assert [each.exists() for each in left] == [False, True]

    def test_refused(self, folder: Path) -> None:
        self.script(folder / "sbatch", "echo 'invalid partition' >&2; exit 1")
        with (
            pytest.raises(InputError, match="the queueing system took none of 2 jobs"),
            connect.connected(self.cluster),
        ):
            pass
        assert list((folder / "work").iterdir()) == []
