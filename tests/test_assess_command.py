"""The command ``levelone assess``, as a user calls it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from levelone.assess_command import assess
from levelone.console import Commands

app = typer.Typer(cls=Commands, pretty_exceptions_enable=False)
app.command()(assess)
app.callback()(lambda: None)

ZETA, OMEGA_N = 0.25, 3.0
COLUMNS = "theta=pitch[deg], q=rate[deg/s], delta_lon=stick[in]/5"


def call(*words: object):
    return CliRunner().invoke(app, ["assess", *map(str, words)])


@pytest.fixture
def pulse(tmp_path: Path) -> Path:
    """Free response after a pulse from 1 to 1.2 s: a decaying sine and its integral."""
    time = np.arange(1200) * 0.01
    root, since = OMEGA_N * math.sqrt(1.0 - ZETA**2), np.maximum(time - 1.05, 0.0)
    rate = np.exp(-OMEGA_N * ZETA * since) * np.sin(root * since)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.01)])
    stick = np.where((time >= 1.0) & (time < 1.2), 1.5, 0.0)
    path = tmp_path / "pulse.csv"
    np.savetxt(path, np.column_stack([time, stick, rate, angle]), delimiter=",", header="time,stick,rate,pitch", comments="")
    return path


def result(folder: Path) -> dict:
    return json.loads((folder / "assessment.json").read_text())


def test_a_record_becomes_numbers_and_a_page(pulse, tmp_path):
    done = call(pulse, "--columns", COLUMNS, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert "pulse: pulse of delta_lon (pitch) from 1.000 s to 1.200 s" in done.output
    assert "not read: bandwidth: needs a frequency sweep" in done.output
    found = result(tmp_path / "out")
    damped = next(each for each in found["readings"] if each["criterion"] == "dynamic_stability")
    assert damped["values"]["zeta"]["value"] == pytest.approx(ZETA, abs=2e-3)
    assert damped["values"]["omega_n"]["value"] == pytest.approx(OMEGA_N, rel=2e-3)
    assert damped["level_text"] == "Level 2"
    assert found["data"][0]["columns"]["delta_lon"] == {"column": "stick[in]", "unit": "in", "factor": 0.2, "offset": 0.0}
    assert len(found["data"][0]["sha256"]) == 64
    assert (tmp_path / "out" / "assessment.html").read_text().startswith("<!DOCTYPE html>")


def test_no_null_in_what_is_written(pulse, tmp_path):
    call(pulse, "--columns", COLUMNS, "--out", tmp_path)
    text = (tmp_path / "assessment.json").read_text()
    assert ": null" not in text
    values = [value for each in result(tmp_path)["readings"] for value in each["values"].values()]
    assert all(value["status"] for value in values)


def test_a_mapping_file_does_what_the_line_does(pulse, tmp_path):
    mapping = tmp_path / "map.toml"
    mapping.write_text(
        '[columns.theta]\nname = "pitch"\nunit = "deg"\n[columns.q]\nname = "rate"\nunit = "deg/s"\n'
        '[columns.delta_lon]\nname = "stick"\nunit = "in"\nscale = 0.2\n'
    )
    for name, options in (("a", ("--columns", COLUMNS)), ("b", ("--mapping", mapping))):
        assert call(pulse, *options, "--out", tmp_path / name).exit_code == 0
    assert result(tmp_path / "a")["readings"] == result(tmp_path / "b")["readings"]


def test_flight_with_names_of_its_own_and_tolerances(pulse, tmp_path):
    other = tmp_path / "flight.csv"
    header, _, body = pulse.read_text().partition("\n")
    other.write_text(header.replace("rate", "gyro") + "\n# another day\n" + body)
    done = call(
        pulse, "--columns", COLUMNS, "--reference", other, "--reference-columns", COLUMNS.replace("rate", "gyro"), "--out", tmp_path
    )
    assert done.exit_code == 0, done.output
    rows = {row["name"]: row for row in result(tmp_path)["comparison"]["metrics"]}
    assert rows["zeta"]["difference"] == 0.0
    assert rows["zeta"]["verdict"] == "within"
    assert rows["zeta"]["allowed"] == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--columns", "tehta=pitch"), "did you mean 'theta'"),
        ((), "no column called like a channel"),
        (("--columns", COLUMNS, "--mapping", "map.toml"), "give one of them"),
        (("--columns", COLUMNS, "--omega", "5"), "write LOW,HIGH"),
        (("--columns", COLUMNS, "--input", "q", "--axis", "heave", "--from", "11.99"), "holds 1 samples"),
        (("--columns", COLUMNS, "--reference-columns", "theta=a"), "belongs to --reference"),
        (("--columns", COLUMNS, "--boundaries", "ads34"), "did you mean 'ads33"),
    ],
)
def test_mistakes_are_one_line(pulse, tmp_path, options, words):
    done = call(pulse, *options, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert words in " ".join(done.output.split())
    assert "Traceback" not in done.output
    assert not (tmp_path / "out" / "assessment.json").exists()


def shifted(pulse: Path, name: str, by: float) -> Path:
    """The same record on a clock that began earlier."""
    table = np.loadtxt(pulse, delimiter=",", skiprows=1)
    table[:, 0] += by
    path = pulse.with_name(name)
    np.savetxt(path, table, delimiter=",", header="time,stick,rate,pitch", comments="")
    return path


def test_times_of_the_data_are_not_taken_for_those_of_the_reference(pulse, tmp_path):
    other = shifted(pulse, "flight.csv", 100.0)
    done = call(
        pulse, "--columns", COLUMNS, "--reference", other, "--on", "1.0", "--off", "1.2", "--delay", "0.05", "--from", "0.2",
        "--to", "11.5", "--out", tmp_path / "out",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    found = result(tmp_path / "out")
    assert (found["data"][0]["from"], found["data"][0]["to"]) == pytest.approx((0.2, 11.5))
    assert found["reference"]["data"][0]["from"] == pytest.approx(100.0)
    assert found["reference"]["data"][0]["input"]["on"] == pytest.approx(101.0)
    rows = {row["name"]: row for row in found["comparison"]["metrics"]}
    assert rows["zeta"]["difference"] == pytest.approx(0.0, abs=2e-3)
    assert rows["zeta"]["confidence"] == "low"


def test_times_of_one_input_for_several_records(pulse, tmp_path):
    done = call(pulse, shifted(pulse, "b.csv", 3.0), "--columns", COLUMNS, "--on", "1.0", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "--on: holds for one record, 2 are given" in " ".join(done.output.split())


def test_a_clock_without_a_unit_is_named_everywhere(pulse, tmp_path):
    done = call(pulse, "--columns", COLUMNS, "--out", tmp_path / "out")
    assert "no unit stated, taken as SI and rad: time" in done.output
    data = result(tmp_path / "out")["data"][0]
    assert data["assumed_si"] == ["time"]
    assert data["columns"]["time"] == {"column": "time", "unit": "", "factor": 1.0, "offset": 0.0}
    page = (tmp_path / "out" / "assessment.html").read_text()
    assert '<th scope="row">time</th><td class="code">time</td><td>SI taken</td>' in page


def test_a_clock_in_microseconds_ends_in_one_line(pulse, tmp_path):
    table = np.loadtxt(pulse, delimiter=",", skiprows=1)
    table[:, 0] *= 1e6
    path = tmp_path / "us.csv"
    np.savetxt(path, table, delimiter=",", header="timestamp,stick,rate,pitch", comments="")
    done = call(path, "--columns", COLUMNS, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "state its unit: time=timestamp[us]" in " ".join(done.output.split())
    assert call(path, "--columns", f"time=timestamp[us], {COLUMNS}", "--out", tmp_path / "out").exit_code == 0


def test_tolerances_that_are_no_file_of_tolerances(pulse, tmp_path):
    (tmp_path / "deep.toml").write_text("name = " + "[" * 5000 + "]" * 5000)
    other = shifted(pulse, "flight.csv", 0.5)
    done = call(
        pulse, "--columns", COLUMNS, "--reference", other, "--tolerances", tmp_path / "deep.toml", "--out", tmp_path / "out"
    )
    assert done.exit_code == 2
    assert "nested too deep" in " ".join(done.output.split())


def test_one_record_given_twice(pulse, tmp_path):
    done = call(pulse, pulse, "--columns", COLUMNS, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "same content" in done.output
