"""Pairs of cases in the report: under each case the same with other coefficients."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from synthetic_sections import alter, extend, section

from levelone.report import cases
from levelone.report.results import Results


@pytest.fixture(scope="module")
def paired(results: Results, tmp_path_factory: pytest.TempPathFactory) -> Results:
    def add(summary: dict) -> None:
        for block in summary["cases"].values():
            values = {name: [1.1 * value for value in column] for name, column in block["values"].items()}
            rows = [[row[0], row[1] - 1.0] for row in block["rows"]]
            block["beside"] = {**block, "name": "mine", "source": "by hand", "rows": rows, "values": values}

    return alter(extend(results, tmp_path_factory.mktemp("paired")), add)


def test_each_case_is_followed_by_its_pair(paired: Results) -> None:
    rows = cases.context(paired)["blocks"][0]["rows"]
    assert [row["number"] for row in rows] == ["1", "1, mine", "2", "2, mine", "3", "3, mine"]
    first = [row["values"][0] for row in rows]
    assert first[::2] == ["3", "3.06 (+2.0 %)", "2.94 (−2.0 %)"]
    assert first[1::2] == ["3.3 (+10.0 %)", "3.366 (+10.0 %)", "3.234 (+10.0 %)"]


def test_coefficients_of_a_pair_are_marked_against_the_case_above(paired: Results) -> None:
    rows = cases.context(paired)["blocks"][0]["rows"]
    marks = [[item["changed"] for item in row["coefficients"]] for row in rows]
    assert marks == [[False, False], [False, True], [True, False], [False, True], [False, True], [False, True]]


def test_text_tells_both_origins_and_how_to_read_the_pairs(paired: Results) -> None:
    text = section(paired, "cases").text
    assert "Under each case stands the same with the coefficients of mine" in text
    assert "Source of the coefficients: Table 9. Of those of mine: by hand." in text


def test_report_without_pairs_does_not_speak_of_them(results: Results, tmp_path: Path) -> None:
    assert "stands the same" not in section(extend(results, tmp_path), "cases").text


@pytest.mark.usefixtures("paper")
def test_both_are_drawn_and_numbered(paired: Results) -> None:
    figure = next(plan for plan in cases.pictures(paired) if plan.name == "cases_attitude_quickness").draw()
    block = paired.summary["cases"]["attitude_quickness"]
    for panel in figure.axes:
        squares = next(line for line in panel.lines if line.get_marker() == "s")
        np.testing.assert_allclose(squares.get_ydata(), block["beside"]["values"]["quickness"])
        np.testing.assert_allclose(squares.get_xdata(), np.degrees(block["beside"]["values"]["delta_theta_min"]))
    assert sorted(text.get_text() for text in figure.axes[1].texts if text.get_text()) == ["1", "1", "2", "2", "3", "3"]
    assert "case, mine" in [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.mark.usefixtures("paper")
def test_pair_that_is_undefined_is_named(paired: Results) -> None:
    def lose(summary: dict) -> None:
        summary["cases"]["attitude_quickness"]["beside"]["values"]["quickness"][1] = math.nan

    figure = next(plan for plan in cases.pictures(alter(paired, lose)) if plan.name == "cases_attitude_quickness").draw()
    assert "Undefined and not drawn: case 2 (mine)." in figure.texts[-1].get_text()
