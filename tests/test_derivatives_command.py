"""The command ``levelone derivatives``, as a user calls it."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from levelone.aerodynamics.derivatives import dynamic
from levelone.cli import app
from levelone.config.geometry_file import load_geometry

GEOMETRY = """
[geometry]
name = "small"
reference = { area = 0.78, chord = 0.26, span = 3.0, point = [0.0, 0.0, 0.0] }
[[surface]]
name = "wing"
position = [0.0, 0.0, 0.0]
span = 3.0
chord = 0.26
incidence = 0.05
panels = [2, 4]
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(GEOMETRY)
    return path


def call(*words: object):
    return CliRunner().invoke(app, ["derivatives", *map(str, words)])


def test_columns_and_rows(small, tmp_path):
    out = tmp_path / "found.csv"
    done = call(small, "--k", "0.1,0.3", "--speed", "6,8", "--out", out)
    assert done.exit_code == 0, done.output
    rows = list(csv.DictReader(out.read_text().splitlines()))
    values = ["C_L_in_phase", "C_L_quadrature", "C_m_in_phase", "C_m_quadrature"]
    assert {"motion", "k", "speed", *values, *(f"{name}_error" for name in values)} <= set(rows[0])
    assert [(row["motion"], float(row["k"]), float(row["speed"])) for row in rows] == [
        (motion, k, speed) for motion in ("pitch", "heave", "rate") for k in (0.1, 0.3) for speed in (6.0, 8.0)
    ]
    expected = dynamic(load_geometry(str(small)), np.array([0.1, 0.3])).at("heave", "C_L")
    heave = [row for row in rows if row["motion"] == "heave" and row["speed"] == "8.0"]
    np.testing.assert_array_equal([float(row["C_L_quadrature"]) for row in heave], expected[0])
    np.testing.assert_array_equal([float(row["C_L_quadrature_error"]) for row in heave], expected[1])


def test_what_is_printed(small):
    shown = call(small, "--k", "0.2", "--axis", "lateral").output
    assert "C_lp" in shown
    assert "yaw_rate" in shown
    assert "ordinary grid off by" in shown


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["--k", "0"], "k: 0 is no reduced frequency"),
        (["--k", "0.1:0.5:1"], "--k: '0.1:0.5:1' is no list"),
        (["--k", "9"], "too high for panels"),
        (["--speed", "0"], "--speed: 0 m/s is no airspeed"),
        (["--out", "/no/such/folder/x.csv"], "--out: cannot write"),
        (["--omega", "3"], "--omega: belongs to --table"),
        (["--method", "time", "--study", "x.toml"], "--study: takes the frequency domain"),
    ],
)
def test_bad_input_ends_in_one_line(small, words, problem):
    done = call(small, *words)
    assert done.exit_code == 2
    assert problem in done.output
    assert "Traceback" not in done.output


def test_an_unknown_geometry_names_the_nearest():
    done = call("reference-wng")
    assert done.exit_code == 2
    assert "did you mean 'reference-wing'?" in done.output


def test_a_section_of_a_vehicle_file(small, tmp_path):
    table = tmp_path / "table.toml"
    done = call(small, "--k", "0.2", "--table", table)
    assert done.exit_code == 0, done.output
    section = tomllib.loads(table.read_text())["aerodynamics"]
    assert section["C_Lalpha"]["value"] == pytest.approx(4.98, abs=0.05)
    assert "geometry small" in section["C_mq"]["source"]


def test_ranges_of_a_study(small, tmp_path):
    study = tmp_path / "mine.toml"
    reference = Path(__file__).parents[1] / "studies" / "reference" / "study.toml"
    done = call(small, "--k", "0.1,0.3", "--study", study, "--extends", reference, "--lumped")
    assert done.exit_code == 0, done.output
    factors = {factor["name"] for factor in tomllib.loads(study.read_text())["factor"]}
    assert {"C_Lq", "C_mq"} <= factors


def test_another_codes_file_needs_no_lattice(tmp_path):
    missing = call(tmp_path / "no.st", "--table", tmp_path / "t.toml")
    assert missing.exit_code == 2
    assert "no.st" in missing.output


def test_what_another_codes_file_cannot_give_is_refused(tmp_path):
    done = call("some.stab", "--out", tmp_path / "x.csv")
    assert done.exit_code == 2
    assert "--out: an AVL or VSPAERO file gives a --table only" in done.output


def test_the_page(small, tmp_path):
    done = call(small, "--k", "0.1,0.3", "--report", tmp_path / "page")
    assert done.exit_code == 0, done.output
    assert "small" in (tmp_path / "page" / "derivatives.html").read_text()
