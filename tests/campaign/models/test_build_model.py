"""A study of a model of one's own becomes the model that its kind says, and says early what is missing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from levelone.campaign.models.build import build
from levelone.campaign.models.command import CommandHistories, CommandResponses
from levelone.campaign.models.programme import HistoryModel
from levelone.campaign.models.python_function import PythonResponses
from levelone.config.model_study import load_model_study
from levelone.errors import InputError

RESPONSE = '[[response]]\nname = "zeta"\nunit = "1"\n'
FLOWN = """
[model.inputs.delta_lon]
name = "stick"
unit = "1"
[model.outputs.theta]
name = "theta"
unit = "rad"
[model.outputs.q]
name = "q"
unit = "rad/s"
[[test]]
name = "free"
criterion = "dynamic_stability"
axis = "pitch"
command = "delta_lon"
amplitude = 0.1
length = 0.5
duration = 8.0
"""
COMMAND = 'kind = "command"\narguments = ["./fly", "{parameters}", "{results}"]\nformat = "json"\n'


OWN = (Path(__file__).parents[3] / "studies" / "own-model" / "study.toml").read_text(encoding="utf-8")


def study(folder: Path, model: str, rest: str, target: str = ""):
    """The example's study with another model; its factors are omega, zeta and delay, behind a height in metres for a ``target``."""
    head, tail = OWN[: OWN.index("[model]")], OWN[OWN.index("[[factor]]") : OWN.index("[responses]")]
    if target:
        height = 'name = "height"\nvalue = 30.0\nunit = "m"\nrange = [-1.0, 1.0]\nkind = "absolute"\nassumed = "example"'
        tail = f'[[factor]]\n{height}\ntarget = "{target}"\n{tail}'
    path = folder / "study.toml"
    path.write_text(f"{head}\n[model]\n{model}\n{rest}\n{tail}", encoding="utf-8")
    return load_model_study(path)


def test_a_function_that_answers_records():
    loaded = load_model_study(Path(__file__).parents[3] / "studies" / "own-model" / "study.toml")
    model = build(loaded)
    assert isinstance(model, HistoryModel)
    assert model.factors == ("omega", "zeta", "delay")
    assert model.nominal == (5.0, 0.35, 0.06)
    answer = model.evaluate(loaded.nominal[None])
    assert answer.values[0, model.names.index("zeta")] == pytest.approx(0.35, rel=1e-5)
    assert answer.values[0, model.names.index("omega_n")] == pytest.approx(5.0, rel=1e-5)


def test_a_function_that_answers_responses(tmp_path):
    (tmp_path / "answering.py").write_text("def answer(p):\n    return {'zeta': p['zeta'] + p['offset']}\n")
    model = build(
        study(
            tmp_path,
            'kind = "python"\nfunction = "answering:answer"\nfolder = "."\ngives = "responses"\nfixed = {offset = 1.0}',
            RESPONSE,
        )
    )
    assert isinstance(model, PythonResponses)
    assert model.evaluate(np.array([[5.0, 0.35, 0.06]])).values.tolist() == [[1.35]]


@pytest.mark.parametrize(("gives", "kind", "rest"), [("responses", CommandResponses, RESPONSE), ("histories", HistoryModel, FLOWN)])
def test_a_command(tmp_path, gives, kind, rest):
    (tmp_path / "fly").write_text("#!/bin/sh\n")
    (tmp_path / "fly").chmod(0o755)
    loaded = study(tmp_path, f'{COMMAND}gives = "{gives}"\ntime_limit = 5.0', rest)
    model = build(loaded, tmp_path / "results")
    assert isinstance(model, kind)
    source = model.source if isinstance(model, HistoryModel) else model
    assert isinstance(source, CommandHistories | CommandResponses)
    assert (source.targets, source.keep_in) == (("omega", "zeta", "delay"), tmp_path / "results")
    assert build(loaded).key == model.key


@pytest.mark.parametrize(
    ("model", "rest", "problem"),
    [
        (f'{COMMAND}gives = "responses"', RESPONSE, r"model\.arguments\.1: no such file"),
        ('kind = "python"\nfunction = "anwsering:answer"\nfolder = "."\ngives = "responses"', RESPONSE, "did you mean 'answering'"),
        ('kind = "python"\nfunction = "answering:answer"\nfolder = "."', FLOWN, "unknown name 'answer'; did you mean 'answers'"),
    ],
)
def test_what_is_missing_is_said_before_the_first_evaluation(tmp_path, model, rest, problem):
    (tmp_path / "answering.py").write_text("def answers(p):\n    return {}\n")
    with pytest.raises(InputError, match=problem):
        build(study(tmp_path, model, rest))


def test_a_factor_in_another_unit_than_its_property(tmp_path):
    pytest.importorskip("jsbsim", reason="JSBSim flies the aircraft: pip install levelone[jsbsim]")
    mapped = FLOWN.replace('"stick"', '"fcs/elevator-cmd-norm"').replace('"theta"\nunit', '"attitude/theta-rad"\nunit')
    mapped = mapped.replace('"q"\nunit', '"velocities/q-rad_sec"\nunit')
    loaded = study(tmp_path, 'kind = "jsbsim"\naircraft = "F450"\nstep = 0.004', mapped, "ic/h-sl-ft")
    with pytest.raises(InputError, match=r"factor\.unit: is 'm', but the name of property 'ic/h-sl-ft' says 'ft'"):
        build(loaded)


def test_kinds_are_imported_when_they_are_asked_for():
    """A process that evaluates a command's or a function's responses does not load compilers, tables or other kinds."""
    program = (
        "import sys\n"
        "import levelone.campaign.models.python_function, levelone.campaign.models.command\n"
        "print(sorted(n for n in ('numba', 'scipy', 'pydantic', 'pint', 'xarray', 'fmpy', 'jsbsim') if n in sys.modules))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == "[]"
