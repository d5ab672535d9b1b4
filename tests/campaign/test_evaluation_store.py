"""The store of evaluations: what is found again, what survives, and what is refused."""

from __future__ import annotations

import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.models.protocol import Evaluations
from levelone.campaign.store_plan import Plan, read_plan
from levelone.campaign.store_reader import outcomes, read_stored, status_name, status_text, stored_models, unanswered
from levelone.campaign.store_schema import APPLICATION_ID, FORMAT, StoreError, is_written, open_to_read, transaction
from levelone.errors import InputError, LeveloneError
from levelone.status import Status

NAMES, UNITS, JUDGED, FACTORS = ("zeta", "omega_n"), ("1", "rad/s"), ("pitch_pulse",), ("mass", "gain", "delay")
KEY = {"kind": "python", "function": "a:b", "version": 2, "gain": 0.1}


def opened(path: Path, key: dict[str, Any] | None = None, study: str = "s1", **given: Any) -> EvaluationStore:
    return EvaluationStore.open(path, key or KEY, NAMES, UNITS, JUDGED, FACTORS, study, **given)


def answers(n: int, seed: int = 0) -> tuple[np.ndarray, Evaluations]:
    """Points, and answers of which some failed."""
    rng = np.random.default_rng(seed)
    status = np.zeros((n, 2), dtype=np.int64)
    status[3::7] = int(Status.CRASHED)
    status[2::5, 1] = int(Status.NO_VALLEY)
    values = np.where(status == 0, rng.normal(size=(n, 2)), np.nan)
    messages = tuple("segmentation fault, ünd \ud800 so\0 on" if row[0] else "" for row in status)
    levels = rng.integers(-1, 4, size=(n, 1))
    return rng.normal(size=(n, 3)), Evaluations(values, status, levels, rng.random(n), messages)


def assert_same(found: Evaluations, wanted: Evaluations) -> None:
    for name in ("values", "status", "levels", "seconds"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
        assert getattr(found, name).dtype == getattr(wanted, name).dtype


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "campaign.sqlite"


class TestLookup:
    def test_everything_comes_back_to_the_last_bit_after_closing(self, path: Path) -> None:
        points, given = answers(50)
        with opened(path) as store:
            store.add(points, given)
        with opened(path) as store:
            found, back = store.lookup(points)
        assert found.all()
        assert_same(back, given)
        assert back.values.tobytes() == given.values.tobytes()
        assert back.messages[3] == "segmentation fault, ünd ? so\ufffd on"
        assert [text for i, text in enumerate(back.messages) if not given.status[i, 0]] == [""] * int(
            (given.status[:, 0] == 0).sum()
        )

    def test_the_found_come_in_the_order_of_the_points_and_may_repeat(self, path: Path) -> None:
        points, given = answers(10)
        with opened(path) as store:
            store.add(points[:6], given.select(slice(0, 6)))
            order = np.array([8, 4, 0, 4, 9])
            found, back = store.lookup(points[order])
        assert found.tolist() == [False, True, True, True, False]
        assert_same(back, given.select([4, 0, 4]))

    def test_few_points_in_a_large_store_are_found_as_well(self, path: Path) -> None:
        points, given = answers(3000)
        with opened(path) as store:
            store.add(points, given)
            found, back = store.lookup(points[5::1000])
            many, whole = store.lookup(points[::2])
        assert found.all()
        assert many.all()
        assert_same(back, given.select(slice(5, None, 1000)))
        assert_same(whole, given.select(slice(0, None, 2)))

    def test_the_two_zeros_are_one_point_and_a_neighbouring_number_is_another(self, path: Path) -> None:
        points, given = np.array([[0.0, -0.0, 1.0]]), answers(1)[1]
        with opened(path) as store:
            store.add(points, given)
            assert store.lookup(np.array([[-0.0, 0.0, 1.0]]))[0].all()
            assert not store.lookup(np.array([[0.0, 0.0, np.nextafter(1.0, 2.0)]]))[0].any()

    def test_no_points(self, path: Path) -> None:
        none, given = np.zeros((0, 3)), answers(0)[1]
        with opened(path) as store:
            store.add(none, given)
            found, back = store.lookup(none)
            assert store.counts() == {}
        assert found.shape == (0,)
        assert_same(back, given)

    @pytest.mark.parametrize("change", ["version", "names", "units", "judged", "factors"])
    def test_whatever_decides_a_value_makes_another_model(self, path: Path, change: str) -> None:
        points, given = answers(4)
        with opened(path) as store:
            store.add(points, given)
        said: dict[str, Any] = {"model_key": KEY, "names": NAMES, "units": UNITS, "judged": JUDGED, "factors": FACTORS}
        said |= {"model_key": KEY | {"version": 3}} if change == "version" else {change: tuple(reversed(said[change]))}
        if change == "judged":
            said["judged"] = ("other",)
        with EvaluationStore.open(path, **said, study_hash="s1") as store:
            assert not store.lookup(points)[0].any()
            store.add(points, given)
        with closing(open_to_read(path)) as connection:
            assert len(stored_models(connection, path)) == 2

    def test_another_study_finds_what_the_first_evaluated(self, path: Path) -> None:
        points, given = answers(6)
        with opened(path, study="s1") as store:
            store.add(points[:4], given.select(slice(0, 4)))
        with opened(path, dict(reversed(KEY.items())), study="s2") as store:
            assert store.lookup(points)[0].tolist() == [True] * 4 + [False] * 2
            store.add(points[4:], given.select(slice(4, 6)))
        with closing(open_to_read(path)) as connection:
            (model,) = stored_models(connection, path)
            stored = read_stored(connection, path, model)
        rows = {tuple(point): study for point, study in zip(stored.points.tolist(), stored.studies, strict=True)}
        assert [rows[tuple(point)] for point in points.tolist()] == ["s1"] * 4 + ["s2"] * 2
        assert model.key == KEY
        assert (model.names, model.units, model.judged, model.factors) == (NAMES, UNITS, JUDGED, FACTORS)

    @pytest.mark.parametrize("value", [np.nan, np.inf])
    def test_a_point_that_is_not_finite_is_refused(self, path: Path, value: float) -> None:
        with opened(path) as store, pytest.raises(InputError, match=r"point 1 is .*finite"):
            store.lookup(np.array([[1.0, 2.0, 3.0], [1.0, value, 3.0]]))

    def test_a_point_of_another_size_is_refused(self, path: Path) -> None:
        with opened(path) as store, pytest.raises(InputError, match=r"\[n, 3\]"):
            store.lookup(np.zeros((2, 4)))


class TestRetry:
    def test_only_what_the_model_did_not_answer_is_run_again(self, path: Path) -> None:
        points, given = answers(10)
        with opened(path) as store:
            store.add(points, given)
            found, back = store.lookup(points, retry_failed=True)
        assert np.flatnonzero(~found).tolist() == [3]
        assert_same(back, given.select(found))
        assert given.status[2, 1] == Status.NO_VALLEY

    def test_a_new_answer_takes_the_place_of_none_and_the_attempts_add_up(self, path: Path) -> None:
        points, given = answers(10)
        better = Evaluations(np.array([[1.0, 2.0]]), np.zeros((1, 2), dtype=np.int64), np.array([[1]]), np.array([0.5]), ("",))
        with opened(path) as store:
            store.add(points, given, np.arange(1, 11))
            store.add(points[3:4], better, 2, replace_failed=True)
            assert_same(store.lookup(points[3:4])[1], better)
            assert_same(store.lookup(points[:3])[1], given.select(slice(0, 3)))
        with closing(open_to_read(path)) as connection:
            stored = read_stored(connection, path, stored_models(connection, path)[0])
        assert stored.attempts[(stored.points == points[3]).all(axis=1)] == 4 + 2
        assert stored.attempts.sum() == 55 + 2

    def test_an_evaluation_of_which_one_run_timed_out_can_be_mended_as_a_whole(self, path: Path) -> None:
        points = np.array([[1.0, 2.0, 3.0]])
        late = Evaluations(
            np.array([[0.5, np.nan]]), np.array([[0, int(Status.TIMED_OUT)]]), np.array([[1]]), np.array([60.0]), ("late",)
        )
        whole = Evaluations(np.array([[0.25, 2.0]]), np.zeros((1, 2), dtype=np.int64), np.array([[2]]), np.array([1.0]), ("",))
        with opened(path) as store:
            store.add(points, late)
            assert not store.lookup(points, retry_failed=True)[0].any()
            with pytest.raises(ValueError, match="already held"):
                store.add(points, whole)
            store.add(points, whole, replace_failed=True)
            found, back = store.lookup(points, retry_failed=True)
        assert found.all()
        assert_same(back, whole)

    def test_an_answer_is_never_replaced(self, path: Path) -> None:
        points, given = answers(3)
        other = Evaluations(given.values + 1.0, *(getattr(given, name) for name in ("status", "levels", "seconds", "messages")))
        with opened(path) as store:
            store.add(points, given)
            for replace in (False, True):
                with pytest.raises(ValueError, match="already held"):
                    store.add(points, other, replace_failed=replace)
            assert_same(store.lookup(points)[1], given)

    def test_the_same_answer_twice_is_kept_once(self, path: Path) -> None:
        points, given = answers(5)
        with opened(path) as store:
            store.add(points[:3], given.select(slice(0, 3)))
            store.add(points, given)
            assert sum(store.counts().values()) == 5
            assert_same(store.lookup(points)[1], given)

    def test_sizes_that_do_not_fit_are_refused(self, path: Path) -> None:
        points, given = answers(5)
        with opened(path) as store:
            with pytest.raises(ValueError, match="do not fit"):
                store.add(points[:4], given)
            assert store.counts() == {}


class TestPlan:
    def planned(self, path: Path) -> Plan | None:
        with closing(open_to_read(path)) as connection:
            return read_plan(connection, path)

    def test_counts_what_this_study_needs_whoever_asked_for_it_first(self, path: Path) -> None:
        points, given = answers(30)
        with opened(path, study="s1", study_title="first") as store:
            store.add(points[:20], given.select(slice(0, 20)))
            store.plan(points[:3])
        with opened(path, study="s2", study_title="second") as store:
            store.plan(points[[15, 16, 17, 25, 26, 25]])
            assert self.planned(path) == Plan(store._model, "second", 5, 3)
            store.add(points[25:26], given.select(slice(25, 26)))
        assert self.planned(path).held == 4
        with closing(open_to_read(path)) as connection:
            (model,) = stored_models(connection, path)
            stored = read_stored(connection, path, model, planned=True)
        assert {tuple(point) for point in stored.points} == {tuple(points[i]) for i in (15, 16, 17, 25)}

    def test_no_study_has_said_what_it_needs(self, path: Path) -> None:
        with opened(path) as store:
            store.add(*answers(4))
            assert self.planned(path) is None
            store.plan(np.zeros((0, 3)))
        assert self.planned(path) is None

    def test_a_plan_that_is_refused_leaves_the_earlier_one(self, path: Path) -> None:
        with opened(path) as store:
            store.plan(answers(4)[0])
            with pytest.raises(InputError, match="finite"):
                store.plan(np.array([[1.0, 2.0, np.nan]]))
        assert self.planned(path).planned == 4


class TestOutcomes:
    def test_the_first_cause_counts(self) -> None:
        crashed, valley, caution = int(Status.CRASHED), int(Status.NO_VALLEY), int(Status.PIO_CAUTION)
        status = np.array([[0, 0], [caution, 0], [valley, crashed], [0, valley], [crashed, crashed]])
        assert outcomes(status).tolist() == [0, 0, crashed, valley, crashed]
        assert unanswered(status).tolist() == [False, False, True, False, True]

    def test_without_responses_nothing_failed(self) -> None:
        assert outcomes(np.zeros((2, 0), dtype=np.int64)).tolist() == [0, 0]
        assert unanswered(np.zeros((2, 0), dtype=np.int64)).tolist() == [False, False]

    def test_counts_are_in_words(self, path: Path) -> None:
        points, given = answers(10)
        with opened(path) as store:
            store.add(points, given)
            assert store.counts() == {"ok": 7, Status.CRASHED.text: 1, Status.NO_VALLEY.text: 2}

    def test_a_code_of_another_version_is_a_number(self) -> None:
        assert "999" in status_text(999)
        assert status_name(999) == "status 999"
        assert status_name(int(Status.TIMED_OUT)) == "timed out"


class TestOneWriter:
    def test_a_second_writer_is_refused_and_a_reader_is_not(self, path: Path) -> None:
        points, given = answers(4)
        with opened(path) as store:
            store.add(points, given)
            with pytest.raises(InputError, match=r"campaign\.sqlite: another process"):
                opened(path)
            assert is_written(path)
            with closing(open_to_read(path)) as connection:
                assert len(read_stored(connection, path, stored_models(connection, path)[0]).points) == 4
        assert not is_written(path)
        with opened(path) as store:
            assert store.lookup(points)[0].all()

    def test_a_reader_writes_nothing(self, path: Path) -> None:
        opened(path).close()
        with closing(open_to_read(path)) as connection, pytest.raises(sqlite3.OperationalError, match="readonly"):
            connection.execute("DELETE FROM study")

    @pytest.mark.parametrize("name", ["a b", "50%", "what?mode=memory", "#1", "ünder", "file:x"])
    def test_odd_names_of_folders_are_names(self, tmp_path: Path, name: str) -> None:
        folder = tmp_path / name
        folder.mkdir()
        points, given = answers(2)
        with opened(folder / "campaign.sqlite") as store:
            store.add(points, given)
        assert (folder / "campaign.sqlite").stat().st_size > 0
        assert [each.name for each in tmp_path.iterdir()] == [name]

    def test_settings_are_those_that_hold_through_a_loss_of_power(self, path: Path) -> None:
        with opened(path) as store:
            settings_ = {
                name: store._connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("journal_mode", "synchronous")
            }
        assert settings_ == {"journal_mode": "truncate", "synchronous": 2}


CHILD = """
import os, sys, numpy as np
sys.path.insert(0, {here!r})
from test_evaluation_store import answers, opened
from pathlib import Path
points, given = answers(4000)
store = opened(Path({path!r}))
for i in range(0, 4000, 10):
    store.add(points[i:i + 10], given.select(slice(i, i + 10)))
    os.write(1, b"%d\\n" % (i + 10))
"""

TORN = """
import os, signal, sys
sys.path.insert(0, {here!r})
from test_evaluation_store import opened
from levelone.campaign.store_schema import transaction
from pathlib import Path
store = opened(Path({path!r}))
with transaction(store._connection, Path({path!r})):
    store._connection.execute("PRAGMA cache_size = 5")
    rows = [(str(i), "x" * 500) for i in range(2000)]
    store._connection.executemany("INSERT INTO study (hash, title, first_seen) VALUES (?, ?, '')", rows)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def interrupted(store: EvaluationStore, path: Path) -> None:
    with transaction(store._connection, path):
        store._connection.execute("INSERT INTO study (hash, title, first_seen) VALUES ('x', '', '')")
        raise KeyboardInterrupt


class TestKilled:
    @pytest.mark.parametrize("after", [0.0, 0.11])
    def test_what_was_committed_before_a_kill_is_there(self, path: Path, after: float) -> None:
        code = CHILD.format(here=str(Path(__file__).parent), path=str(path))
        with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            said = int(child.stdout.readline())
            time.sleep(after)
            child.send_signal(signal.SIGKILL)
            said = max([said, *map(int, child.stdout.read().split("\n")[:-1])])
        points, given = answers(4000)
        with opened(path) as store:
            found, back = store.lookup(points)
        n = int(found.sum())
        assert n in (said, said + 10)
        assert found[:n].all()
        assert_same(back, given.select(slice(0, n)))

    def test_a_transaction_torn_in_the_middle_is_undone_by_the_next_reader(self, path: Path) -> None:
        points, given = answers(30)
        with opened(path) as store:
            store.add(points, given)
        size = path.stat().st_size
        code = TORN.format(here=str(Path(__file__).parent), path=str(path))
        child = subprocess.run([sys.executable, "-c", code], check=False)
        assert child.returncode == -signal.SIGKILL
        assert path.stat().st_size > size  # half of the transaction is in the file
        with closing(open_to_read(path)) as connection:
            assert connection.execute("SELECT count(*) FROM study").fetchone() == (1,)
        assert path.stat().st_size == size
        with opened(path) as store:
            assert_same(store.lookup(points)[1], given)

    def test_an_interrupt_inside_a_transaction_leaves_nothing_of_it(self, path: Path) -> None:
        with opened(path) as store:
            with pytest.raises(KeyboardInterrupt):
                interrupted(store, path)
            assert store._connection.execute("SELECT count(*) FROM study").fetchone() == (1,)


def test_a_full_disk_is_said_in_words_and_costs_only_what_was_not_committed(path: Path) -> None:
    points, given = answers(2000)
    with opened(path) as store:
        store.add(points[:100], given.select(slice(0, 100)))
        pages = store._connection.execute("PRAGMA page_count").fetchone()[0]
        store._connection.execute(f"PRAGMA max_page_count = {pages + 2}")
        with pytest.raises(StoreError, match=r"disk is full.*--resume"):
            store.add(points[100:], given.select(slice(100, None)))
        found, back = store.lookup(points)
        assert found.sum() == 100
        assert_same(back, given.select(slice(0, 100)))
        store._connection.execute("PRAGMA max_page_count = 100000")
        store.add(points[100:], given.select(slice(100, None)))
    with opened(path) as store:
        assert_same(store.lookup(points)[1], given)


class TestRefused:
    @staticmethod
    def filled(path: Path) -> None:
        with opened(path) as store:
            store.add(*answers(200))

    @staticmethod
    def altered(path: Path, change: str) -> None:
        with closing(sqlite3.connect(path, isolation_level=None)) as connection:
            connection.execute(change)

    def refused(self, path: Path, pattern: str) -> None:
        """By the writer and by the reader, in one line, and the file stays what it was."""
        before = path.read_bytes()
        doors: list[Callable[[Path], Any]] = [opened, open_to_read]
        for door in doors:
            with pytest.raises(InputError, match=pattern) as caught:
                door(path)
            assert str(path) in str(caught.value)
        assert path.read_bytes() == before
        assert not is_written(path)

    def test_something_that_is_no_database(self, path: Path) -> None:
        path.write_text("mass,gain\n" * 1000)
        self.refused(path, "no store of a campaign")

    def test_a_truncated_file(self, path: Path) -> None:
        self.filled(path)
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        self.refused(path, "damaged")

    def test_a_file_of_which_a_page_is_overwritten(self, path: Path) -> None:
        self.filled(path)
        content = bytearray(path.read_bytes())
        content[8 * 4096 : 9 * 4096] = b"\xa5" * 4096
        path.write_bytes(content)
        self.refused(path, "damaged")

    def test_a_newer_format(self, path: Path) -> None:
        self.filled(path)
        self.altered(path, f"PRAGMA user_version = {FORMAT + 1}")
        self.refused(path, f"format {FORMAT + 1}.*newer")

    def test_an_older_format(self, path: Path) -> None:
        self.filled(path)
        self.altered(path, f"PRAGMA user_version = {FORMAT - 1}")
        self.refused(path, f"format {FORMAT - 1}.*another folder")

    def test_the_database_of_another_application(self, path: Path) -> None:
        self.altered(path, "CREATE TABLE t (x)")
        self.refused(path, "another application")

    def test_a_store_with_a_trigger_in_it(self, path: Path) -> None:
        self.filled(path)
        self.altered(path, "CREATE TRIGGER t AFTER INSERT ON evaluation BEGIN DELETE FROM model; END")
        self.refused(path, "other tables")

    def test_a_folder(self, path: Path) -> None:
        path.mkdir()
        with pytest.raises(InputError, match="cannot be opened"):
            opened(path)

    def test_a_folder_that_is_missing(self, path: Path) -> None:
        with pytest.raises(InputError, match="cannot be opened"):
            opened(path.parent / "none" / path.name)
        with pytest.raises(InputError, match="no campaign"):
            open_to_read(path)

    def test_an_empty_file_is_a_new_store(self, path: Path) -> None:
        path.touch()
        with pytest.raises(InputError, match="empty"):
            open_to_read(path)
        self.filled(path)
        assert struct.unpack(">I", path.read_bytes()[68:72]) == (APPLICATION_ID,)

    def test_a_lock_that_is_no_lock(self, path: Path) -> None:
        path.with_suffix(".lock").write_text("mine\n" * 100)
        with pytest.raises(InputError, match=r"campaign\.lock"):
            opened(path)
        assert path.with_suffix(".lock").read_text() == "mine\n" * 100

    @pytest.mark.parametrize("column", ["point", "response", "status", "level"])
    def test_a_bit_that_changed_in_a_row(self, path: Path, column: str) -> None:
        self.filled(path)
        self.altered(path, f"UPDATE evaluation SET {column} = CAST(substr({column}, 2) || x'01' AS BLOB) WHERE id = 7")
        with opened(path) as store, pytest.raises(InputError, match="not as it was written"):
            store.lookup(answers(200)[0])
        with closing(open_to_read(path)) as connection, pytest.raises(InputError, match="not as it was written"):
            read_stored(connection, path, stored_models(connection, path)[0])

    def test_a_model_whose_description_changed(self, path: Path) -> None:
        self.filled(path)
        self.altered(path, 'UPDATE model SET units = \'["deg", "rad/s"]\'')
        with closing(open_to_read(path)) as connection, pytest.raises(InputError, match="description of a model"):
            stored_models(connection, path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "campaign.sqlite"
    with opened(path) as store:
        store.add(*answers(60))
    return path


def read_back(path: Path, points: np.ndarray) -> tuple[Any, Any, Any, str]:
    """What both doors give, or the error of the first that refuses."""
    try:
        with opened(path) as store:
            found, back = store.lookup(points)
        with closing(open_to_read(path)) as connection:
            return back, found, [read_stored(connection, path, model) for model in stored_models(connection, path)], ""
    except LeveloneError as error:
        return None, None, None, str(error)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_file_is_refused_or_gives_nothing_but_the_truth(whole: Path, data: st.DataObject) -> None:
    content = bytearray(whole.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    content = content[: data.draw(st.one_of(st.just(len(content)), st.integers(0, len(content))))]
    copy = whole.parent / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir()
    (copy / whole.name).write_bytes(content)
    points, given = answers(60)
    back, found, stored, said = read_back(copy / whole.name, points)
    assert len(said.splitlines()) <= 1
    if said:
        return
    np.testing.assert_array_equal(back.values, given.values[found])
    np.testing.assert_array_equal(back.status, given.status[found])
    for each in stored:
        rows = {point.tobytes(): i for i, point in enumerate(points)}
        at = [rows[point.tobytes()] for point in each.points]
        np.testing.assert_array_equal(each.evaluations.values, given.values[at])
