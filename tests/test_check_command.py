from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from levelone.campaign import nominal_check
from levelone.check_command import check
from levelone.config.model_table import PythonTable
from levelone.console import Commands

OWN = Path(__file__).parents[1] / "studies" / "own-model"
app = typer.Typer(cls=Commands, add_completion=False, pretty_exceptions_enable=False)
app.command()(check)


@app.command()
def other() -> None:
    """A second command, so that the first keeps its name."""


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run the command on a copy of the example with changed text; the function is called in this process."""
    monkeypatch.setattr(nominal_check, "OWN", (PythonTable,))
    monkeypatch.chdir(tmp_path)
    shutil.copytree(OWN, tmp_path / "own", ignore=shutil.ignore_patterns("__pycache__"))

    def ran(*changes, arguments=()):
        path = tmp_path / "own" / "study.toml"
        text = path.read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path.write_text(text, encoding="utf-8")
        return CliRunner().invoke(app, ["check", str(path), *arguments])

    return ran


def test_a_sound_study_ends_with_0_and_a_page(run, tmp_path):
    result = run(arguments=["--out", "page"])
    assert result.exit_code == 0
    assert "nothing looks wrong" in result.stderr
    assert "0.35" in result.stdout
    assert (tmp_path / "page" / "check.html").is_file()
    assert not (tmp_path / "results").exists()


def test_a_wrong_unit_ends_with_1_and_says_so(run, tmp_path):
    result = run(('unit = "deg/s"', 'unit = "rad/s"'))
    assert result.exit_code == 1
    assert "looks wrong: units, step: q is 57.3 times the rate of change of theta" in result.stderr
    assert (tmp_path / "results" / "own-model" / "check.html").is_file()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('kind = "python"', 'kind = "fmmu"'), "study.toml: model.kind: unknown name 'fmmu'; did you mean 'fmu'?"),
        (('function = "pitch_axis:fly"', 'function = "pitch_axes:fly"'), "pitch_axis"),
        (('function = "pitch_axis:fly"', 'function = "pitch_axis:fyl"'), "did you mean 'fly'?"),
    ],
)
def test_bad_input_ends_with_2_and_one_line(run, tmp_path, change, words):
    result = run(change)
    assert result.exit_code == 2
    lines = result.stderr.strip().splitlines()
    assert lines[-1].startswith("error: ")
    assert words in lines[-1]
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "results").exists()
