"""Every example of the page on kinds of models is a study that loads, and runs where nothing beside it is needed."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from linear_fixtures import reference_system, write_reference
from scipy.optimize import brentq

from levelone.campaign.models.build import build
from levelone.config.model_study import ModelStudy, load_model_study

PAGE = (Path(__file__).parents[3] / "docs" / "reference" / "models.md").read_text(encoding="utf-8")
BLOCKS = {language: re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.M | re.S) for language in ("toml", "python", "sh")}
COMMON, EXAMPLES = BLOCKS["toml"][0], BLOCKS["toml"][1:]
KINDS = ["python", "python", "command", "fmu", "jsbsim", "state-space", "built-in"]


@pytest.fixture
def study(tmp_path, monkeypatch):
    """Loads one of the examples among the files that it names."""
    monkeypatch.delitem(sys.modules, "short_period", raising=False)
    (tmp_path / "short_period.py").write_text("\n".join(BLOCKS["python"]))
    (tmp_path / "quadratic.sh").write_text(BLOCKS["sh"][0])
    (tmp_path / "quadratic.sh").chmod(0o755)
    (tmp_path / "pitch.fmu").touch()
    write_reference(tmp_path / "pitch.toml")

    def load(place: int) -> ModelStudy:
        (tmp_path / "study.toml").write_text(f"{COMMON}\n{EXAMPLES[place]}")
        return load_model_study(tmp_path / "study.toml")

    return load


def real_and_negative(low: float, high: float) -> float:
    """Frequency, rad/s, at which q / V_ref of the reference system crosses the negative real axis."""
    A, B, C, _, _ = reference_system()

    def value(omega: float) -> complex:
        return complex((C[1] @ np.linalg.solve(1j * omega * np.eye(5) - A, B))[0])

    found = brentq(lambda omega: value(omega).imag, low, high)
    assert value(found).real < 0.0
    return found


@pytest.mark.parametrize(("place", "kind"), list(enumerate(KINDS)))
def test_examples_load(study, place, kind):
    assert study(place).model.kind == kind
    assert len(EXAMPLES) == len(KINDS)


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        (0, {"zeta": 0.35, "omega_n": 5.0}),
        (1, {"zeta": 0.35, "omega_n": 5.0}),
        (2, {"rise_time": 2.0}),
        (5, {"omega_180": real_and_negative(5.0, 6.0)}),
    ],
)
def test_examples_run(study, place, expected):
    loaded = study(place)
    model = build(loaded)
    answer = model.evaluate(loaded.nominal[None])
    assert answer.messages == ("",)
    found = dict(zip(model.names, answer.values[0], strict=True))
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-5)


def test_the_jsbsim_example_names_properties_that_there_are(study):
    pytest.importorskip("jsbsim", reason="the example is an aircraft of JSBSim: pip install levelone[jsbsim]")
    assert build(study(4)).names[0] == "omega_bw"
