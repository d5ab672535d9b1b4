from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from levelone.cli import app
from levelone.decompose_command import groups_of
from levelone.errors import InputError

REFERENCE = Path(__file__).parents[1] / "studies" / "reference" / "study.toml"


def call(*arguments):
    return CliRunner().invoke(app, ["decompose", *map(str, arguments)])


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("mine") / "study.toml"
    lines = [
        f'extends = "{REFERENCE}"',
        'name = "mine"',
        'factors = ["K_T", "tau_d"]',
        'without = ["cases", "coupling", "deceleration"]',
    ]
    path.write_text("\n".join(["[study]", *lines]), encoding="utf-8")
    return path


def test_prints_indices_and_writes_them(study, tmp_path):
    result = call(study, "--out", tmp_path, "--base-points", 32, "--scramblings", 4, "--second-order")
    assert result.exit_code == 0, result.output
    found = json.loads((tmp_path / "direct.json").read_text(encoding="utf-8"))
    assert set(found["responses"]) == {"quickness", "delta_theta_min", "zeta", "omega_n", "omega_bw", "tau_p"}
    assert result.stdout.count("0 runs failed") == 6
    assert "192 runs, 4 scramblings" in result.stderr
    assert "S2 of K_T and tau_d" in result.stderr
    assert f"decomposition: {tmp_path / 'direct.json'}" in result.stderr


def test_says_when_the_width_was_not_reached(study, tmp_path):
    result = call(study, "--out", tmp_path, "--base-points", 8, "--scramblings", 4, "--until-width", 1e-9, "--most-base-points", 8)
    assert "1e-09 was asked for: not reached, raise --most-base-points" in result.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--group", "K_T"], "--group: 'K_T' is no group; write NAME=A,B"),
        (["--base-points", "100"], "--base-points: is 100; needs a power of two for each of 8 scramblings"),
        (["--group", "a=K_T,KT"], "KT"),
    ],
)
def test_a_wrong_option_is_one_line(study, tmp_path, options, words):
    result = call(study, "--out", tmp_path / "none", *options)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert words in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "none").exists()


def test_groups_are_read_as_they_are_written():
    assert groups_of(["aero=C_L0, C_D0", "rotor=K_T"]) == {"aero": ["C_L0", "C_D0"], "rotor": ["K_T"]}
    with pytest.raises(InputError, match="given twice"):
        groups_of(["a=x", "a=y"])
