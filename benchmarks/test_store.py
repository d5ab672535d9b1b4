"""The store of a campaign at 100,000 evaluations: time to write, to resume and to read, and the size of the file.

`pytest benchmarks/test_store.py -s` prints the numbers of docs/reference/campaign-store.md; some half a minute.
"""

from __future__ import annotations

import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.history_store import HistoryStore
from levelone.campaign.models.protocol import Evaluations
from levelone.campaign.store_export import export
from levelone.campaign.store_reader import read_stored, stored_models
from levelone.campaign.store_schema import open_to_read
from levelone.handling.history import TimeHistory

N, FACTORS, RESPONSES, CRITERIA, BATCH = 100_000, 14, 11, 5, 256
SAID = (
    {"kind": "benchmark"}, [f"r{i}" for i in range(RESPONSES)], ["1"] * RESPONSES, [f"c{i}" for i in range(CRITERIA)],
    [f"f{i}" for i in range(FACTORS)], "study",
)  # fmt: skip


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    rng = np.random.default_rng(1)
    points = rng.random((N, FACTORS))
    failed = rng.random((N, 1)) < 0.02
    status = np.where(failed, 7, 0) * np.ones((1, RESPONSES), dtype=np.int64)
    messages = tuple("x" * 200 if each else "" for each in failed[:, 0])
    given = Evaluations(
        np.where(failed, np.nan, rng.random((N, RESPONSES))),
        status,
        np.ones((N, CRITERIA), dtype=np.int64),
        rng.random(N),
        messages,
    )
    path = tmp_path_factory.mktemp("store") / "campaign.sqlite"
    begin = time.perf_counter()
    with EvaluationStore.open(path, *SAID) as store:
        for i in range(0, N, BATCH):
            part = slice(i, min(i + BATCH, N))
            store.add(points[part], given.select(part))
    spent = time.perf_counter() - begin
    print(f"\n{N} evaluations in commits of {BATCH}: {spent:.1f} s, {1e3 * spent / (N / BATCH):.1f} ms a commit")
    return path, points, given


def test_resume(campaign):
    path, points, given = campaign
    begin, cpu = time.perf_counter(), time.process_time()
    with EvaluationStore.open(path, *SAID) as store:
        opened = time.perf_counter()
        found, back = store.lookup(points)
        ended, cpu = time.perf_counter(), time.process_time() - cpu
        few = store.lookup(points[::1000])[0]
        spent = time.perf_counter() - ended
        print(f"\nfile {path.stat().st_size / 1e6:.1f} MB, {path.stat().st_size / N:.0f} bytes an evaluation")
        print(f"open {opened - begin:.2f} s, look all up {ended - opened:.2f} s, both {cpu:.2f} CPU-s; {few.size}: {spent:.3f} s")
    np.testing.assert_array_equal(back.values, given.values)
    assert found.all()
    assert path.stat().st_size < 60e6


def test_read_and_export(campaign):
    path = campaign[0]
    begin = time.perf_counter()
    with closing(open_to_read(path)) as connection:
        stored = read_stored(connection, path, stored_models(connection, path)[0])
    print(f"\nread for a status: {time.perf_counter() - begin:.2f} s")
    assert len(stored.points) == N
    for ending in ("csv", "parquet", "nc"):
        begin = time.perf_counter()
        export(path, path.with_name(f"out.{ending}"))
        spent = time.perf_counter() - begin
        print(f"export to {ending}: {spent:.1f} s, {path.with_name(f'out.{ending}').stat().st_size / 1e6:.0f} MB")


def test_small_commits(tmp_path, campaign):
    _, points, given = campaign
    with EvaluationStore.open(tmp_path / "campaign.sqlite", *SAID) as store:
        begin = time.perf_counter()
        for i in range(200):
            store.add(points[i : i + 1], given.select(slice(i, i + 1)))
        print(f"\na commit of one evaluation: {1e3 * (time.perf_counter() - begin) / 200:.1f} ms")


def test_histories(tmp_path: Path):
    """A record of 90 s at 200 Hz with eight channels of noise, which nothing compresses well."""
    rng = np.random.default_rng(2)
    time_ = np.arange(0.0, 90.0, 0.005)
    names = [f"c{i}" for i in range(8)]
    channels = {name: np.cumsum(rng.normal(size=(1, time_.size)), axis=1) for name in names}
    record = TimeHistory(
        time_, channels, dict.fromkeys(names, "1"), {name: np.zeros(1) for name in names}, "c0", 1.0, np.nan, np.zeros(1),
        (0.0, 0.0, 0.0), np.zeros(1, dtype=np.int64),
    )  # fmt: skip
    store = HistoryStore.for_writing(tmp_path / "histories")
    begin = time.perf_counter()
    store.add([bytes(32)], [{"sweep": record}])
    written = time.perf_counter()
    store.read(bytes(32))
    size = store.files()[0].stat().st_size
    print(f"\na sweep of {8 * time_.size * 9 / 1e6:.2f} MB: {size / 1e6:.2f} MB, "
          f"written in {1e3 * (written - begin):.0f} ms, read in {1e3 * (time.perf_counter() - written):.0f} ms")  # fmt: skip
