"""Time histories on disk: to the last bit, and never lost by a later write."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from levelone.campaign import history_store
from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.history_store import FOLDER_NAME, HistoryStore
from levelone.campaign.store_schema import StoreError
from levelone.errors import InputError
from levelone.handling.history import TimeHistory
from levelone.status import Status


def record(seed: int = 0, samples: int = 200, runs: int = 1) -> TimeHistory:
    rng = np.random.default_rng(seed)
    channels = {name: rng.normal(size=(runs, samples)) for name in ("q", "velocities/q-rad_sec", "délta")}
    channels["q"][0, 3] = np.nan
    return TimeHistory(
        np.arange(samples) * 0.01 + 0.1,
        channels,
        dict.fromkeys(channels, "rad/s"),
        {name: rng.normal(size=runs) for name in channels},
        "délta",
        1.0 + 1e-15,
        np.nan,
        np.full(runs, 0.1),
        (0.0, -1.5, 0.1),
        np.full(runs, int(Status.DIVERGED)),
        {"alpha_max": rng.normal(size=runs)},
        "flight 7",
    )


def assert_same(found: TimeHistory, wanted: TimeHistory) -> None:
    assert found.time.tobytes() == wanted.time.tobytes()
    for group in ("channels", "trim", "extremes"):
        one, other = getattr(found, group), getattr(wanted, group)
        assert list(one) == list(other)
        for name in one:
            assert one[name].tobytes() == other[name].tobytes()
            assert one[name].shape == other[name].shape
    for name in ("units", "input_name", "input_on", "wind", "name"):
        assert getattr(found, name) == getattr(wanted, name)
    np.testing.assert_array_equal([found.input_off, *found.delay], [wanted.input_off, *wanted.delay])
    np.testing.assert_array_equal(found.status, wanted.status)


def key(number: int) -> bytes:
    return number.to_bytes(32, "big")


@pytest.fixture
def store(tmp_path: Path) -> HistoryStore:
    return HistoryStore.for_writing(tmp_path / FOLDER_NAME)


class TestReading:
    @pytest.mark.parametrize("runs", [1, 3])
    def test_a_record_comes_back_to_the_last_bit(self, store: HistoryStore, runs: int) -> None:
        store.add([key(1), key(2)], [{"sweep": record(1, runs=runs), "step": record(2, 20)}, {"sweep": record(3)}])
        found = HistoryStore(store.folder).read(key(1))
        assert set(found) == {"sweep", "step"}
        assert_same(found["sweep"], record(1, runs=runs))
        assert_same(found["step"], record(2, 20))
        assert_same(store.read(key(2))["sweep"], record(3))

    def test_what_was_not_kept_is_nothing(self, store: HistoryStore) -> None:
        assert store.read(key(1)) == {}
        store.add([key(2)], [{}])
        assert store.read(key(2)) == {}
        assert store.files() == []

    def test_a_later_record_of_the_same_evaluation_counts(self, store: HistoryStore) -> None:
        store.add([key(1)], [{"step": record(1)}])
        assert_same(store.read(key(1))["step"], record(1))
        store.add([key(1)], [{"step": record(2)}])
        assert_same(store.read(key(1))["step"], record(2))

    def test_steady_channels_take_little_room(self, store: HistoryStore) -> None:
        smooth = record(0, 20_000)
        still = {name: np.zeros((1, 20_000)) for name in smooth.channels}
        store.add([key(1)], [{"step": TimeHistory(**{**vars(smooth), "channels": still})}])
        assert sum(path.stat().st_size for path in store.files()) < 0.2 * 4 * 8 * 20_000


class TestGathering:
    def test_many_files_become_few_and_lose_nothing(self, store: HistoryStore, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(history_store, "GATHER", 4)
        for i in range(11):
            store.add([key(i), key(0)], [{"step": record(i)}, {"step": record(100 + i)}])
        assert [path.name for path in store.files()] == [
            "00000004.pack.h5", "00000008.pack.h5", "00000009.h5", "00000010.h5", "00000011.h5",
        ]  # fmt: skip
        for i in range(1, 11):
            assert_same(store.read(key(i))["step"], record(i))
        assert_same(store.read(key(0))["step"], record(110))

    def test_what_an_interrupted_gathering_left_twice_is_removed(
        self, store: HistoryStore, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        for i in range(3):
            store.add([key(i)], [{"step": record(i)}])
        with monkeypatch.context() as patch:
            patch.setattr(HistoryStore, "_remove_loose", lambda self, last: None)
            store._gather(store.files())
        assert len(store.files()) == 4
        assert_same(HistoryStore(store.folder).read(key(1))["step"], record(1))
        again = HistoryStore.for_writing(store.folder)
        assert [path.name for path in again.files()] == ["00000003.pack.h5"]
        again.add([key(7)], [{"step": record(7)}])
        for i in (0, 1, 2, 7):
            assert_same(again.read(key(i))["step"], record(i))


CHILD = """
import os, sys
sys.path.insert(0, {here!r})
from test_history_store import key, record
from levelone.campaign import history_store
from pathlib import Path
history_store.GATHER = 5
store = history_store.HistoryStore.for_writing(Path({folder!r}))
for i in range(10000):
    store.add([key(i)], [{{"step": record(i)}}])
    os.write(1, b"%d\\n" % (i + 1))
"""


class TestDamage:
    def test_a_kill_costs_nothing_that_was_written_before(self, tmp_path: Path) -> None:
        code = CHILD.format(here=str(Path(__file__).parent), folder=str(tmp_path / FOLDER_NAME))
        with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            said = [int(child.stdout.readline()) for _ in range(13)]
            child.send_signal(signal.SIGKILL)
            said += map(int, child.stdout.read().split("\n")[:-1])
        store = HistoryStore.for_writing(tmp_path / FOLDER_NAME)
        for i in range(said[-1]):
            assert_same(store.read(key(i))["step"], record(i))

    def test_unfinished_files_are_removed_by_the_next_writer_only(self, store: HistoryStore) -> None:
        store.add([key(1)], [{"step": record(1)}])
        part = store.folder / "00000002.h5.part"
        part.write_bytes(b"half")
        assert_same(HistoryStore(store.folder).read(key(1))["step"], record(1))
        assert part.exists()
        HistoryStore.for_writing(store.folder)
        assert not part.exists()

    @pytest.mark.parametrize("damage", [lambda old: old[: len(old) // 2], lambda old: b"", lambda old: b"no HDF5" * 100])
    def test_a_damaged_file_is_named(self, store: HistoryStore, damage: Callable[[bytes], bytes]) -> None:
        store.add([key(1)], [{"step": record(1)}])
        path = store.files()[0]
        path.write_bytes(damage(path.read_bytes()))
        with pytest.raises(InputError, match=r"00000001\.h5: cannot be read") as caught:
            store.read(key(1))
        assert len(str(caught.value).splitlines()) == 1

    @pytest.mark.parametrize("damage", [lambda old: old[: len(old) // 2], lambda old: b"no HDF5" * 100])
    def test_a_damaged_file_does_not_keep_later_ones_from_the_disk(
        self, store: HistoryStore, damage: Callable[[bytes], bytes], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(history_store, "GATHER", 3)
        store.add([key(1)], [{"step": record(1)}])
        path = store.files()[0]
        path.write_bytes(damage(path.read_bytes()))
        broken = path.read_bytes()
        for i in range(2, 8):
            store.add([key(i)], [{"step": record(i)}])
        assert path.read_bytes() == broken
        with pytest.raises(InputError, match=r"00000001\.h5: cannot be read"):
            store.read(key(7))
        assert len(list(store.folder.iterdir())) == 7
        path.rename(store.folder.parent / path.name)
        again = HistoryStore.for_writing(store.folder)
        for i in range(2, 8):
            assert_same(again.read(key(i))["step"], record(i))

    def test_a_file_of_other_content_is_named(self, store: HistoryStore) -> None:
        with h5py.File(store.folder / "00000001.h5", "w") as file:
            file.create_group(key(1).hex()).create_group("step")
        with pytest.raises(InputError, match=r"00000001\.h5: cannot be read"):
            store.read(key(1))

    def test_a_stranger_is_named(self, store: HistoryStore) -> None:
        (store.folder / "mine.h5").touch()
        with pytest.raises(InputError, match=r"mine\.h5: does not belong"):
            store.read(key(1))

    def test_a_file_in_the_place_of_the_folder(self, tmp_path: Path) -> None:
        (tmp_path / FOLDER_NAME).touch()
        with pytest.raises(InputError, match="cannot be made"):
            HistoryStore.for_writing(tmp_path / FOLDER_NAME)

    def test_a_write_that_fails_leaves_nothing_behind(self, store: HistoryStore, monkeypatch: pytest.MonkeyPatch) -> None:
        store.add([key(1)], [{"step": record(1)}])

        def full(path: Path) -> None:
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr(history_store, "_sync", full)
            with pytest.raises(StoreError, match="No space left"):
                store.add([key(2)], [{"step": record(2)}])
        assert [path.name for path in store.folder.iterdir()] == ["00000001.h5"]
        assert_same(store.read(key(1))["step"], record(1))


def test_histories_are_found_by_the_keys_of_the_store_of_evaluations(tmp_path: Path) -> None:
    points = np.array([[1.0], [2.0]])
    with EvaluationStore.open(tmp_path / "campaign.sqlite", {"kind": "x"}, ("zeta",), ("1",), (), ("mass",), "s") as store:
        keys = store.keys(points)
    HistoryStore.for_writing(tmp_path / FOLDER_NAME).add(keys, [{"step": record(1)}, {}])
    kept = HistoryStore(tmp_path / FOLDER_NAME)
    assert_same(kept.read(keys[0])["step"], record(1))
    assert kept.read(keys[1]) == {}
