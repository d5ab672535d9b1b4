"""Evaluations of a campaign as CSV, Parquet and NetCDF, read back by other readers than the writer's."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.models.protocol import Evaluations
from levelone.campaign.store_export import _LEVELS, export
from levelone.errors import InputError
from levelone.handling.levels import Level
from levelone.status import Status

CRASHED, VALLEY = int(Status.CRASHED), int(Status.NO_VALLEY)
STATUS = np.array([[0, 0], [CRASHED, CRASHED], [0, VALLEY], [0, 0]])
VALUES = np.array([[0.1, 2.0], [np.nan, np.nan], [1.0 / 3.0, np.nan], [0.3, 4.0]])
POINTS = np.array([[3.0, 1.0], [1.0, 2.0], [1.0, 0.0], [2.0, 5.0]])
LEVELS = np.array([[1], [-1], [0], [3]])
MESSAGES = ("", 'line, "quoted"\nand ünd', "", "")
#: order of the points
ORDER = [2, 1, 3, 0]


def fill(path: Path, factors: tuple[str, ...] = ("mass", "gain"), version: int = 1, rows: slice = slice(None)) -> None:
    given = Evaluations(VALUES, STATUS, LEVELS, np.array([0.5, np.nan, 0.25, 1.0]), MESSAGES)
    said = ({"version": version}, ("zeta", "omega_n"), ("1", "rad/s"), ("pulse",), factors, "study-hash")
    with EvaluationStore.open(path, *said) as store:
        store.add(POINTS[rows], given.select(rows), np.arange(1, 5)[rows])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    fill(tmp_path / "campaign.sqlite")
    return tmp_path / "campaign.sqlite"


def test_csv_holds_every_bit_and_words(path: Path) -> None:
    target = path.with_name("out.csv")
    export(path, target)
    with target.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "mass", "gain", "zeta", "omega_n", "zeta_status", "omega_n_status", "level_pulse",
        "seconds", "attempts", "finished", "study", "message",
    ]  # fmt: skip
    for row, i in zip(rows, ORDER, strict=True):
        assert [float(row["mass"]), float(row["gain"])] == POINTS[i].tolist()
        np.testing.assert_array_equal([float(row["zeta"]), float(row["omega_n"])], VALUES[i])
        assert [row["zeta_status"], row["omega_n_status"]] == [Status(int(code)).text for code in STATUS[i]]
        assert row["message"] == MESSAGES[i]
        assert row["attempts"] == str(i + 1)
        assert row["study"] == "study-hash"
    assert [row["level_pulse"] for row in rows] == ["outside the requirement", "undefined", "Level 3", "Level 1"]
    assert [row["seconds"] for row in rows] == ["0.25", "nan", "1.0", "0.5"]
    assert all(row["finished"].endswith("+00:00") for row in rows)


def test_parquet_holds_numbers_with_units_and_no_nulls(path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra 'records' brings pyarrow")
    target = path.with_name("out.parquet")
    stored = export(path, target)
    table = parquet.read_table(target)
    np.testing.assert_array_equal(table["omega_n"].to_numpy(), VALUES[ORDER, 1])
    np.testing.assert_array_equal(table["attempts"].to_numpy(), np.arange(1, 5)[ORDER])
    assert table["message"].to_pylist() == [MESSAGES[i] for i in ORDER]
    assert sum(column.null_count for column in table.columns) == 0
    assert table.schema.field("omega_n").metadata == {b"unit": b"rad/s"}
    assert table.schema.metadata[b"model"].decode() == stored.model.hash


def test_parquet_without_its_library_names_the_extra(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install levelone\[records\]"):
        export(path, path.with_name("out.parquet"))
    assert sorted(each.suffix for each in path.parent.iterdir()) == [".lock", ".sqlite", ".sqlite-journal"]


def test_netcdf_has_the_layout_of_a_sample(path: Path) -> None:
    target = path.with_name("out.nc")
    export(path, target)
    with xr.open_dataset(target, engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["points"].sel(factor="gain").values, POINTS[ORDER, 1])
        np.testing.assert_array_equal(data["values"].values, VALUES[ORDER])
        np.testing.assert_array_equal(data["status"].sel(response="zeta").values, STATUS[ORDER, 0])
        np.testing.assert_array_equal(data["level"].values, LEVELS[ORDER])
        assert data["message"].values.tolist() == [MESSAGES[i] for i in ORDER]
        assert data["response_unit"].values.tolist() == ["1", "rad/s"]
        assert f"{CRASHED}: {Status.CRASHED.text}" in data.attrs["status_codes"]


def test_the_order_in_which_evaluations_were_finished_does_not_show(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "campaign.sqlite"
    other.parent.mkdir()
    for i in (3, 1, 0, 2):
        fill(other, rows=slice(i, i + 1))
    one, two = (export(store, tmp_path / f"{n}.csv") for n, store in enumerate((path, other)))
    np.testing.assert_array_equal(one.points, two.points)
    np.testing.assert_array_equal(one.evaluations.values, two.evaluations.values)


def test_every_level_has_its_words() -> None:
    assert set(_LEVELS) == {int(level) for level in Level}


def test_columns_of_one_name_are_told_apart(tmp_path: Path) -> None:
    fill(tmp_path / "campaign.sqlite", ("zeta", "seconds"))
    export(tmp_path / "campaign.sqlite", tmp_path / "out.csv")
    header = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert header[:4] == ["zeta", "seconds", "zeta_", "omega_n"]
    assert len(set(header)) == len(header)


class TestSeveralModels:
    def test_the_last_is_taken_unless_another_is_named(self, path: Path) -> None:
        first = export(path, path.with_name("1.csv"))
        fill(path, version=2, rows=slice(0, 2))
        last = export(path, path.with_name("2.csv"))
        assert (len(first.points), len(last.points)) == (4, 2)
        assert last.model.key == {"version": 2}
        named = export(path, path.with_name("3.csv"), model=first.model.hash[:8])
        assert named.model == first.model

    @pytest.mark.parametrize("prefix", ["zz", "0" * 64])
    def test_one_that_is_not_there(self, path: Path, prefix: str) -> None:
        with pytest.raises(InputError, match=r"--model: .* begins no of the models' hashes; .*allowed"):
            export(path, path.with_name("out.csv"), model=prefix)


class TestRefused:
    def test_a_file_that_is_there_unless_forced(self, path: Path) -> None:
        target = path.with_name("out.csv")
        target.write_text("mine")
        with pytest.raises(InputError, match=r"there already.*--force"):
            export(path, target)
        assert target.read_text() == "mine"
        export(path, target, force=True)
        assert target.read_text(encoding="utf-8").startswith("mass,gain")

    @pytest.mark.parametrize(
        ("name", "near"), [("out.cvs", "'.csv'"), ("out.parqet", "'.parquet'"), ("out", "allowed"), ("out.sqlite", "")]
    )
    def test_another_ending(self, path: Path, name: str, near: str) -> None:
        with pytest.raises(InputError, match=f"ending.*{near}"):
            export(path, path.with_name(name))

    def test_a_folder_and_one_that_is_missing(self, path: Path) -> None:
        (path.parent / "x.csv").mkdir()
        with pytest.raises(InputError, match="is a folder"):
            export(path, path.parent / "x.csv", force=True)
        with pytest.raises(InputError, match="cannot be written"):
            export(path, path.parent / "none" / "x.csv")

    def test_a_store_without_evaluations(self, tmp_path: Path) -> None:
        fill(tmp_path / "campaign.sqlite", rows=slice(0, 0))
        with pytest.raises(InputError, match="no evaluations yet"):
            export(tmp_path / "campaign.sqlite", tmp_path / "out.csv")

    def test_a_write_that_fails_leaves_the_old_file(self, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        target = path.with_name("out.csv")
        export(path, target)
        before = target.read_bytes()

        def full(*_: object, **__: object) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(csv, "writer", full)
        with pytest.raises(InputError, match="No space left"):
            export(path, target, force=True)
        assert target.read_bytes() == before
        assert not list(path.parent.glob("*.part"))
