"""What an evaluation costs beyond its model, by executor; and a campaign killed at twenty random moments.

``pytest benchmarks/test_executors.py -s`` prints the numbers of docs/theory/campaigns.md; about two minutes.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "campaign" / "executors"))
from executor_models import Plain
from kill_campaign import POINTS
from kill_watch import Campaign, check_the_end, check_the_kill

from levelone.campaign.evaluate import evaluate
from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.executors import Executor
from levelone.campaign.executors.batch import BatchExecutor
from levelone.campaign.executors.processes import ProcessExecutor

FACTORS = 14


def points(n: int) -> np.ndarray:
    return np.random.default_rng(1).random((n, FACTORS))


def between_first_and_last(executor: Executor, n: int) -> float:
    """s an evaluation of a model that takes none, between the first answer and the last: the start of workers left out."""
    first = last = None
    for index, _ in executor.run(Plain(), points(n)):
        if index.size:
            last = time.perf_counter()
            first = last if first is None else first
    return (last - first) / n


def report(name: str, measure: Callable[[], float], limit: float = np.inf, repeats: int = 3) -> None:
    found = min(measure() for _ in range(repeats))
    print(f"{name:55s}{1e6 * found:10.2f} us" + (f" (at most {1e6 * limit:g})" if limit < np.inf else ""))
    assert found < limit


def test_batch() -> None:
    evaluate(Plain(), points(10), None, BatchExecutor())
    n = 200_000
    print()
    report("in-process", lambda: between_first_and_last(BatchExecutor(), n), 5e-6)
    report("in-process, with all that evaluate() does", lambda: whole(BatchExecutor(), n, None))


def whole(executor: Executor, n: int, store: EvaluationStore | None) -> float:
    given, began = points(n), time.perf_counter()
    evaluate(Plain(), given, store, executor)
    return (time.perf_counter() - began) / n


def test_processes(tmp_path: Path) -> None:
    n = 5000
    print()
    report("worker processes, one", lambda: between_first_and_last(ProcessExecutor(1), n), 1e-3)
    report("worker processes, two", lambda: between_first_and_last(ProcessExecutor(2), n), 1e-3)
    stores = iter(range(3))

    def stored() -> float:
        model, path = Plain(), tmp_path / f"{next(stores)}.sqlite"
        names = [f"f{i}" for i in range(FACTORS)]
        with EvaluationStore.open(path, model.key, model.names, model.units, model.judged, names, "benchmark") as store:
            return whole(ProcessExecutor(2), n, store)

    report("worker processes, two, with store and start", stored)


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler and two workers on the loopback interface."""
    distributed = pytest.importorskip("distributed", reason="needs Dask")
    from levelone.campaign.executors.connect import NO_PAGES

    workers: dict[str, Any] = {"n_workers": 2, "threads_per_worker": 1, "host": "127.0.0.1", "silence_logs": 50}
    with distributed.LocalCluster(**workers, dashboard_address=None, scheduler_kwargs=NO_PAGES) as cluster:
        yield cluster.scheduler_address.removeprefix("tcp://")


def test_dask(address: str) -> None:
    from levelone.campaign.executors.dask_cluster import DaskExecutor

    print()
    for chunk in (16, 256):
        executor = DaskExecutor(address, chunk=chunk)
        report(f"Dask, two workers, chunks of {chunk}", lambda executor=executor: between_first_and_last(executor, 5000), 3e-3)


def test_twenty_kills(tmp_path: Path) -> None:
    """Each campaign is killed once, after a random number of evaluations or, one in five, at a random time, and runs to its end."""
    rng, committed = np.random.default_rng(20), []
    began = time.perf_counter()
    (tmp_path / "whole").mkdir()
    check_the_end(Campaign(tmp_path / "whole"), [])
    life = time.perf_counter() - began
    for kill in range(20):
        folder = tmp_path / f"{kill}"
        folder.mkdir()
        campaign = Campaign(folder)
        if kill % 5:
            campaign.stop_after(int(rng.integers(1, len(POINTS) - 10)), signal.SIGKILL)
        else:
            with campaign.start() as process:
                time.sleep(life * rng.random())
                process.send_signal(signal.SIGKILL)
        kept = check_the_kill(campaign, 0)
        lost = len(campaign.lines("end")) - len(kept)
        check_the_end(campaign, [(kept, len(campaign.lines("begin")))])
        committed.append((len(kept), lost))
    print(f"\nkilled with (committed, finished but not committed) of {len(POINTS)}: {committed}; cores {os.cpu_count()}")
