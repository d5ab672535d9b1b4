"""The table and the matrix of verdicts on the page."""

from __future__ import annotations

import json
import re
import shutil
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import synthetic
from markupsafe import Markup
from matplotlib.patches import Rectangle

from levelone.campaign.claims.causes import NOT_RECORDED, OTHER_STUDY
from levelone.report import comparison, style
from levelone.report.page import environment
from levelone.report.results import Results, load_results

FINDINGS = Path(__file__).parents[2] / "studies" / "reference" / "findings.toml"


def trial(name: str, kind: str, verdicts: dict[str, str]) -> dict[str, Any]:
    """A trial in which every claim differs, save those given."""
    claims = re.findall(r'id = "([^"]+)"', FINDINGS.read_text(encoding="utf-8"))
    found = {claim: verdicts.get(claim, "differs") for claim in claims}
    return {
        "name": name, "kind": kind, "question": f"What of {name}?", "nominal": {},
        "changes": {"rotors.motor_lag": 0.03, "rotors.velocity": "local"},
        "verdicts": {claim: {"verdict": v, "here": f"in {name}", "gap": 0.5} for claim, v in found.items()},
    }  # fmt: skip


def record(verdicts: dict[str, str], study: str = "ab" * 32) -> dict[str, Any]:
    """Two experiments, of which the second makes a claim agree, and a calibration; with the hashes of the synthetic study."""
    trials = [
        trial("one", "cause", {}),
        trial("two", "cause", {"zeta-boundary": "agrees"}),
        trial("start 1", "calibration", verdicts),
    ]
    return {
        "levelone": "0", "study_sha256": study, "vehicle_sha256": "cd" * 32, "findings_sha256": "0", "seed": 20,
        "targets": ["quickness-median", "omega-n-nominal"], "baseline": trial("as it is", "cause", verdicts), "experiments": trials,
        "explanations": [],
    }  # fmt: skip


def add(folder: Path, name: str = "findings.toml") -> Path:
    """Name findings in a results folder, and put them there."""
    shutil.copyfile(FINDINGS, folder / name)
    return synthetic.rewrite(folder, lambda document: document.update(findings=name))


@pytest.fixture(scope="module")
def compared(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Results:
    """A study with findings, and no experiments."""
    copied = tmp_path_factory.mktemp("compared") / "study"
    shutil.copytree(folder, copied)
    return load_results(add(copied))


@pytest.fixture
def tried(compared: Results, tmp_path: Path) -> Results:
    """The same with experiments, recorded with the verdicts of the study itself."""
    copied = tmp_path / "study"
    shutil.copytree(compared.directory, copied)
    here = {row["id"]: row["verdict"] for row in shown(compared)["rows"]}
    (copied / "experiments.json").write_text(json.dumps(record(here)))
    return load_results(copied)


def shown(results: Results) -> dict[str, Any]:
    return comparison.context(results)


def test_nothing_is_shown_without_findings(results: Results) -> None:
    assert comparison.context(results) is None
    assert comparison.pictures(results) == []


def test_every_claim_has_a_row_with_its_verdict_in_words_and_colour(compared: Results) -> None:
    found = shown(compared)
    assert len(found["rows"]) == 34
    assert [row["id"] for row in found["rows"] if row["calibrated"]] == ["quickness-median", "omega-n-nominal"]
    assert sum(found["counts"].values()) == 32
    rows = {row["id"]: row for row in found["rows"]}
    # the synthetic study: quickness about 2.88 1/s, no cases flown
    assert (rows["quickness-median"]["verdict"], rows["quickness-median"]["colour"]) == ("agrees", comparison.COLOURS["agrees"])
    assert rows["table-4-C_L0"]["verdict"] == "undecidable"
    assert "'cases'" in rows["table-4-C_L0"]["cause"]
    assert len(set(comparison.COLOURS.values())) == 3


def test_without_experiments_there_is_a_table_and_no_matrix(compared: Results) -> None:
    assert shown(compared)["recorded"] == NOT_RECORDED
    assert shown(compared)["experiments"] == []
    assert comparison.pictures(compared) == []


def test_experiments_of_another_study_are_not_drawn(tried: Results) -> None:
    (tried.directory / "experiments.json").write_text(json.dumps(record({}, study="12" * 32)))
    assert shown(tried)["recorded"] == OTHER_STUDY
    assert comparison.pictures(tried) == []


def test_experiments_are_listed_with_what_they_change(tried: Results) -> None:
    one, two, start = shown(tried)["experiments"]
    assert one["changes"] == ["rotors.motor_lag = 0.03", "rotors.velocity = local"]
    assert (one["agrees"], one["differs"], two["agrees"], start["kind"]) == (0, 34, 1, "calibration")
    cause = next(row["cause"] for row in shown(tried)["rows"] if row["id"] == "zeta-boundary")
    assert cause.startswith("flipped by 1 of 2 experiments: 'two' (in two; misses the target")


@pytest.mark.usefixtures("paper")
def test_the_matrix_marks_every_claim_on_every_vehicle(tried: Results) -> None:
    (plan,) = comparison.pictures(tried)
    assert (plan.criterion, plan.wide) == ("comparison", True)
    figure = plan.draw()
    figure.draw(style.renderer(figure))
    panel = figure.axes[0]
    assert [label.get_text() for label in panel.get_xticklabels()] == ["this study", "one", "two", "start 1"]
    rows = [label.get_text() for label in panel.get_yticklabels()]
    assert len(rows) == 34
    assert "(omega-n-nominal)" in rows
    marks = [(x, y) for line in panel.lines if line.get_linestyle() == "None" for x, y in zip(*line.get_data(), strict=True)]
    assert sorted(marks) == [(x, y) for x in range(4) for y in range(34)]
    # shaded: another verdict than on this study; in the calibration none, in the experiments each that does not differ here
    here = [row["verdict"] for row in shown(tried)["rows"]]
    turned = [
        (patch.get_x(), patch.get_y()) for patch in panel.patches if isinstance(patch, Rectangle) and patch.get_width() == 1.0
    ]
    assert {y for x, y in turned if x == 0.5} == {i - 0.5 for i, verdict in enumerate(here) if verdict != "differs"}
    assert not [x for x, _ in turned if x in (-0.5, 2.5)]


@pytest.mark.usefixtures("paper")
def test_labels_of_many_experiments_do_not_touch(tried: Results) -> None:
    content = record({})
    content["experiments"] = [trial(f"an experiment with a long name, no {i:02d}", "cause", {}) for i in range(50)]
    (tried.directory / "experiments.json").write_text(json.dumps(content))
    figure = comparison.pictures(tried)[0].draw()
    renderer = style.renderer(figure)
    figure.draw(renderer)
    panel = figure.axes[0]
    for labels, low, high in ((panel.get_xticklabels(), "x0", "x1"), (panel.get_yticklabels(), "y0", "y1")):
        boxes = sorted((label.get_window_extent(renderer) for label in labels), key=lambda box, low=low: getattr(box, low))
        assert all(getattr(b, low) >= getattr(a, high) for a, b in pairwise(boxes))
        assert all(box.x0 >= 0.0 and box.y1 <= figure.bbox.height for box in boxes)


def section(results: Results) -> str:
    """The section as the page has it, with a text in place of the picture."""
    made = environment()
    drawing = {"number": 1, "name": "comparison", "caption": "matrix", "wide": True, "svg": Markup("<svg></svg>")}
    page = made.from_string('{% from "macros.html" import table %}{% include "comparison.html" %}')
    return page.render(comparison=comparison.context(results), drawings={"comparison": [drawing]})


def test_the_page_shows_the_verdicts(tried: Results) -> None:
    page = section(tried)
    assert page.count('<tr id="claim-') == 34
    assert "standard deviation of zeta between 0.01 and 0.06" in page
    assert "<svg" in page
    assert "What of start 1?" in page
    for word, colour in comparison.COLOURS.items():
        assert f'<td style="color: {colour}; font-weight: 600">{word}</td>' in page


def test_the_page_says_what_is_not_recorded(compared: Results, results: Results) -> None:
    page = section(compared)
    assert f"Causes and robustness: {NOT_RECORDED}." in page
    assert "<svg" not in page
    assert section(results).strip() == ""
