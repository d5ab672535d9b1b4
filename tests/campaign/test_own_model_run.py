"""A study of a model of one's own from its file to its results and page: nothing is run twice, and nothing that fails is lost."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from levelone.campaign.model_study import run_model_study
from levelone.campaign.store_schema import FILE_NAME
from levelone.config.campaign_table import CampaignOptions
from levelone.config.model_study import ModelStudy, load_model_study
from levelone.errors import InputError

OWN = Path(__file__).parents[2] / "studies" / "own-model"
STUDY = """
[study]
name = "closed-form"
title = "A closed form"
seed = 7
intended_use = "A test."
failures = "bound"
not_validated = ["nothing"]
validity_domain = ["the unit square"]

[model]
kind = "python"
function = "closed_form:answer"
folder = "."
gives = "responses"

[[response]]
name = "linear"
unit = "1"

[[response]]
name = "product"
unit = "rad"

[[factor]]
name = "x"
value = 0.5
unit = "1"
range = [-0.5, 0.5]
kind = "absolute"
assumed = "test"

[[factor]]
name = "y"
value = 0.5
unit = "1"
range = [-0.5, 0.5]
kind = "absolute"
assumed = "test"

[method]
trajectories = 3
levels = 4
samples = 24
base_points = 256
bootstrap = 50
kernel = "matern52"
trend = "constant"
"""
MODEL = """
from pathlib import Path

def answer(point):
    with open(Path(__file__).with_name("log.txt"), "a") as log:
        log.write(f"{point['x']!r} {point['y']!r}\\n")
    if point["x"] > 0.9:
        raise RuntimeError(f"x is {point['x']:.3f}")
    return {"linear": 3.0 * point["x"] + point["y"], "product": point["x"] * point["y"]}
"""


@pytest.fixture
def study(tmp_path: Path) -> ModelStudy:
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "closed_form.py").write_text(MODEL, encoding="utf-8")
    return load_model_study(tmp_path / "study.toml")


def evaluated(tmp_path: Path) -> list[str]:
    log = tmp_path / "log.txt"
    lines = log.read_text().splitlines() if log.is_file() else []
    log.unlink(missing_ok=True)
    return lines


def comparable(folder: Path) -> dict:
    content = json.loads((folder / "results.json").read_text())
    content["campaign"].pop("evaluated")
    content["campaign"].pop("reused")
    return {name: value for name, value in content.items() if name != "provenance"}


def same(a: object, b: object) -> bool:
    return json.dumps(a, sort_keys=True) == json.dumps(b, sort_keys=True)


def test_a_study_comes_to_its_results_and_nothing_runs_twice(study: ModelStudy, tmp_path: Path) -> None:
    run_model_study(study, tmp_path / "out")
    first = evaluated(tmp_path)
    results = comparable(tmp_path / "out")
    assert len(first) == len(set(first))
    assert sum(results["campaign"]["outcomes"].values()) == len(first)

    run_model_study(study, tmp_path / "out")
    assert len(evaluated(tmp_path)) == 1  # the nominal case
    assert same(comparable(tmp_path / "out"), results)
    again = json.loads((tmp_path / "out" / "results.json").read_text())["campaign"]
    assert again["evaluated"] == 0

    longer = replace(study, method=replace(study.method, trajectories=4))
    run_model_study(longer, tmp_path / "out")
    assert 1 < len(evaluated(tmp_path)) <= 1 + 4 * 3  # the hypercube is the same


def test_failures_are_counted_bounded_and_mapped(study: ModelStudy, tmp_path: Path) -> None:
    run_model_study(study, tmp_path / "out")
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    with (tmp_path / "out" / "monte_carlo.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    beyond = sum(float(row["x"]) > 0.9 for row in rows)
    assert beyond > 0
    for name in ("linear", "product"):
        block = results["responses"][name]
        assert block["monte_carlo"]["failed"] == beyond
        assert block["failures"] == {"the model returned no value": beyond}
        assert set(block["sobol_bounded"]) == {"low", "high"}
    assert results["failure_map"]["failed"] == beyond
    assert all(np.isnan(float(row["linear"])) == (float(row["x"]) > 0.9) for row in rows)
    kept = [row for row in rows if float(row["x"]) <= 0.9]
    assert all(float(row["linear"]) == 3.0 * float(row["x"]) + float(row["y"]) for row in kept)


def test_processes_give_the_results_of_this_process(study: ModelStudy, tmp_path: Path) -> None:
    run_model_study(study, tmp_path / "here")
    run_model_study(study, tmp_path / "there", options=CampaignOptions("processes", workers=2, chunk=3))
    here, there = comparable(tmp_path / "here"), comparable(tmp_path / "there")
    for results in (here, there):
        results.pop("campaign")
    assert same(here, there)
    assert (tmp_path / "here" / "monte_carlo.csv").read_bytes() == (tmp_path / "there" / "monte_carlo.csv").read_bytes()


def test_nothing_is_kept_of_another_model(study: ModelStudy, tmp_path: Path) -> None:
    run_model_study(study, tmp_path / "out")
    evaluated(tmp_path)
    (tmp_path / "closed_form.py").write_text(MODEL.replace("3.0", "2.0"), encoding="utf-8")
    other = load_model_study(tmp_path / "study.toml")
    run_model_study(other, tmp_path / "out")
    assert len(set(evaluated(tmp_path))) > 24
    assert (tmp_path / "out" / FILE_NAME).is_file()


def test_data_that_changed_behind_the_model_is_noticed(study: ModelStudy, tmp_path: Path) -> None:
    """The key of a model knows its code, not what the code opens: the nominal case shows it."""
    (tmp_path / "closed_form.py").write_text(
        MODEL + "\nFACTOR = float(Path(__file__).with_name('factor.txt').read_text())\n"
        "def scaled(point):\n    found = answer(point)\n    return {**found, 'linear': FACTOR * found['linear']}\n"
    )
    (tmp_path / "study.toml").write_text(STUDY.replace("closed_form:answer", "closed_form:scaled"), encoding="utf-8")
    (tmp_path / "factor.txt").write_text("1.0")
    given = load_model_study(tmp_path / "study.toml")
    options = CampaignOptions("processes", workers=1)
    run_model_study(given, tmp_path / "out", options=options)
    (tmp_path / "factor.txt").write_text("2.0")
    with pytest.raises(InputError, match=r"answers differently at the nominal point.*linear is 4 and was 2"):
        run_model_study(given, tmp_path / "out", options=options)


def test_files_that_change_while_a_campaign_runs_end_it(study: ModelStudy, tmp_path: Path) -> None:
    def edited(tally: object) -> None:
        (tmp_path / "closed_form.py").write_text(MODEL.replace("3.0", "2.0"), encoding="utf-8")

    with pytest.raises(InputError, match="files have changed since the campaign began"):
        run_model_study(study, tmp_path / "out", on_tally=edited)


def test_progress_reaches_the_size_of_the_design(study: ModelStudy, tmp_path: Path) -> None:
    """Points that a screening visits twice are evaluated once, and counted as often as they come."""
    last: dict[str, tuple[int, int]] = {}
    run_model_study(study, tmp_path / "out", progress=lambda stage, done, total: last.update({stage: (done, total)}))
    assert last["screening (Morris)"] == (9, 9)
    assert last["Monte Carlo"] == (24, 24)
