"""A changed vehicle file is the old one but for what was changed, and loads as the changed vehicle."""

from __future__ import annotations

import difflib
import shutil
import tomllib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from levelone.config.vehicle_file import library, load_fine_table, load_vehicle
from levelone.config.vehicle_writer import write_vehicle
from levelone.errors import InputError

LIBRARY = library()["reference-evtol"]
CHANGES = {
    "controller.pitch_rate.Kp": 4.125,
    "controller.command_lag": 0.0125,
    "controller.pitch": 8.25,
    "rotors.motor_lag": 0.004,
    "rotors.throttle_exponent": 1.25,
    "rotors.position.x": 0.75,
}
WHY = {path: f'because of "{path}"; calibrated by x.toml' for path in CHANGES}


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """The reference vehicle, without the optional exponent."""
    folder = tmp_path_factory.mktemp("source")
    for table in LIBRARY.parent.glob("*.csv"):
        shutil.copy(table, folder)
    lines = LIBRARY.read_text().splitlines(keepends=True)
    path = folder / LIBRARY.name
    path.write_text("".join(line for line in lines if not line.startswith("throttle_exponent")))
    return path


@pytest.fixture(scope="module")
def written(source, tmp_path_factory):
    return write_vehicle(source, tmp_path_factory.mktemp("written"), CHANGES, WHY)


def test_it_loads_as_the_changed_vehicle(source, written):
    path, vehicle = written
    expected = load_vehicle(source, CHANGES)
    assert vehicle.controller.pitch_rate == expected.controller.pitch_rate
    assert [getattr(vehicle.controller, f.name) for f in fields(vehicle.controller) if f.name != "design"] == [
        getattr(expected.controller, f.name) for f in fields(expected.controller) if f.name != "design"
    ]
    for name in ("position", "spin", "motor_lag", "throttle_exponent", "K_T"):
        np.testing.assert_array_equal(getattr(vehicle.airframe.rotors, name), getattr(expected.airframe.rotors, name))
    np.testing.assert_array_equal(vehicle.airframe.rotors.table.values, expected.airframe.rotors.table.values)
    assert vehicle.airframe.mass == expected.airframe.mass
    assert load_vehicle(path).assumed == vehicle.assumed


def test_its_tables_come_along(source, written):
    for name in ("reference-evtol-rotor.csv", "reference-evtol-rotor-fine.csv"):
        assert (written[0].parent / name).read_bytes() == (source.parent / name).read_bytes()
    assert load_fine_table(written[0]).values.shape == load_fine_table(source).values.shape


def test_every_line_that_was_not_changed_is_the_same(source, written):
    before, after = source.read_text().splitlines(), written[0].read_text().splitlines()
    lines = [line for line in difflib.unified_diff(before, after, n=0, lineterm="") if not line.startswith(("---", "+++", "@@"))]
    gone = [line[1:] for line in lines if line.startswith("-")]
    came = [line[1:] for line in lines if line.startswith("+")]
    assert sorted({line.split(" = ")[0].strip() for line in gone if " = " in line and not line.startswith("]")}) == [
        "Kp",
        "command_lag",
        "motor_lag",
        "pitch",
    ]
    assert len([line for line in gone if "Kp" in line]) == 1
    assert len(came) == len(gone) + 1  # throttle_exponent, which was not there
    assert [line.partition("#")[2] for line in after if "#" in line] == [line.partition("#")[2] for line in before if "#" in line]


def test_changed_entries_say_why(written):
    content = tomllib.loads(written[0].read_text())
    for path, why in WHY.items():
        entry = content
        for key in path.removesuffix(".x").split("."):
            entry = entry[key]
        assert entry["assumed"] == why
        assert "source" not in entry
    assert set(WHY.values()) <= {why for _, why in load_vehicle(written[0]).assumed}


def test_writing_the_same_numbers_again_changes_nothing(written, tmp_path):
    once = {path: value for path, value in CHANGES.items() if not path.endswith(".x")}
    again, _ = write_vehicle(written[0], tmp_path, once, WHY)
    assert again.read_text() == written[0].read_text()


def test_tables_in_a_folder_below_stay_there(vehicle_file, tmp_path):
    moved = vehicle_file(
        ('file = "reference-evtol-rotor.csv", fine_file = "reference-evtol-rotor-fine.csv"', 'file = "tables/r.csv"')
    )
    (tmp_path / "tables").mkdir()
    shutil.move(tmp_path / "reference-evtol-rotor.csv", tmp_path / "tables" / "r.csv")
    out = tmp_path / "out"
    out.mkdir()
    path, vehicle = write_vehicle(moved, out, {"controller.pitch": 7.0}, {"controller.pitch": "fitted"})
    assert path == out / "craft.toml"
    assert (out / "tables" / "r.csv").exists()
    assert vehicle.controller.pitch == 7.0


def test_the_vehicle_itself_is_never_overwritten(vehicle_file, tmp_path):
    craft = vehicle_file()
    before = craft.read_text()
    with pytest.raises(InputError, match=r"craft\.toml is the vehicle itself"):
        write_vehicle(craft, tmp_path, {"controller.pitch": 7.0}, {"controller.pitch": "fitted"})
    assert craft.read_text() == before


def test_a_path_that_leads_nowhere_writes_nothing(tmp_path):
    with pytest.raises(InputError, match="did you mean 'pitch_rate'"):
        write_vehicle(LIBRARY, tmp_path, {"controller.pich_rate.Kp": 5.0}, {"controller.pich_rate.Kp": "fitted"})
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_there_is_said(tmp_path: Path):
    with pytest.raises(InputError, match="cannot be written: No such file"):
        write_vehicle(LIBRARY, tmp_path / "missing", {"controller.pitch": 7.0}, {"controller.pitch": "fitted"})
