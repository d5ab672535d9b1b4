"""The section of the map of failures: what it says in words, and what it draws."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from markupsafe import Markup

from levelone.campaign.failure_map import failure_map
from levelone.report import style
from levelone.report.failure_map import context, draw, pictures
from levelone.report.page import environment
from levelone.report.results import Results
from levelone.status import Status

HOSTILE = "<script>$x"
FACTORS = ["mass", "tau_d", "K_T", HOSTILE]
UNITS = ["kg", "s", "1", "N$m^2"]


def found(kinds: int = 3, n: int = 300, k: int = 4, gathered: bool = True) -> dict[str, Any]:
    """A map of failures in one corner, or anywhere."""
    rng = np.random.default_rng(2)
    unit = rng.random((n, k))
    failed = (unit[:, 0] > 0.7) & (unit[:, min(1, k - 1)] > 0.6) if gathered else rng.random(n) < 0.04
    codes = [
        Status.TIMED_OUT,
        Status.CRASHED,
        Status.NO_VALLEY,
        Status.DIVERGED,
        Status.NO_OMEGA_180,
        Status.TRIM_FAILED,
        Status.LOW_COHERENCE,
    ]
    status = np.zeros((n, 2), dtype=np.int64)
    status[failed] = np.array([int(code) for code in codes[:kinds]])[np.arange(failed.sum()) % kinds][:, None]
    return failure_map(unit, unit * [2.0, 0.1, 3.0, 4.0][:k], status, FACTORS[:k], UNITS[:k], ["zeta", "omega_n"], 1)


def with_map(results: Results, block: dict[str, Any]) -> Results:
    return replace(results, summary={**results.summary, "failure_map": block})


def page(results: Results) -> str:
    drawing = {"number": 1, "name": "x", "caption": "A caption.", "wide": False, "svg": Markup("<svg></svg>")}
    template = environment().from_string('{% from "macros.html" import table %}{% include "failure_map.html" %}')
    return template.render(failure_map=context(results), drawings={"failure_map": [drawing]})


def rows(text: str) -> list[list[str]]:
    cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", text, re.DOTALL)]
    return [[re.sub(r"<[^>]+>", "", cell) for cell in row] for row in cells]


class TestWords:
    def test_a_study_without_the_map_has_no_section(self, results: Results) -> None:
        assert context(results) is None
        assert pictures(results) == []
        assert page(results).strip() == ""

    def test_no_failures_are_one_line_and_no_picture(self, results: Results) -> None:
        none = with_map(results, {"runs": 42, "failed": 0, "outcomes": []})
        assert "None of the 42 evaluations failed" in page(none)
        assert pictures(none) == []
        assert "<table" not in page(none)

    def test_counts_by_outcome_add_up(self, results: Results) -> None:
        block = found()
        text = page(with_map(results, block))
        table = [row for row in rows(text) if row[0] in ("timed out", "crashed", "no valley")]
        assert sum(int(row[3]) for row in table) == block["failed"]
        assert [row[1] for row in table] == [Status.TIMED_OUT.text, Status.CRASHED.text, Status.NO_VALLEY.text]
        assert {row[2] for row in table} == {"all"}
        assert f"{block['failed']} of 300 evaluations" in text

    def test_the_pair_and_its_worst_cells_are_named(self, results: Results) -> None:
        block = found()
        text = page(with_map(results, block))
        assert "Of all pairs of factors, mass and <i>τ</i><sub><i>d</i></sub> tell most" in text
        worst = next(row for row in rows(text) if row[0] == "highest quarter")
        assert worst[:2] == ["highest quarter", "highest quarter"]
        assert worst[2:4] == [str(block["pair"]["failed"][3][3]), str(block["pair"]["runs"][3][3])]

    def test_scattered_failures_are_called_so(self, results: Results) -> None:
        assert "No pair of factors separates the failures better than chance" in page(with_map(results, found(gathered=False)))

    def test_every_factor_has_its_row_and_its_quarters_add_up(self, results: Results) -> None:
        block = found()
        table = [row for row in rows(page(with_map(results, block))) if len(row) == 8 and " of " in row[-1]]
        assert len(table) == 4
        for row in table:
            assert sum(int(cell.split(" of ")[0]) for cell in row[4:]) == block["failed"]
            assert sum(int(cell.split(" of ")[1]) for cell in row[4:]) == 300

    def test_every_row_is_as_wide_as_its_head(self, results: Results) -> None:
        for table in re.findall(r"<table>(.*?)</table>", page(with_map(results, found())), re.DOTALL):
            assert len({len(row) for row in rows(table)}) == 1

    def test_names_of_factors_are_escaped(self, results: Results) -> None:
        assert "<script>" not in page(with_map(results, found()))

    def test_all_failed(self, results: Results) -> None:
        status = np.full((5, 1), int(Status.CRASHED))
        unit = np.random.default_rng(0).random((5, 2))
        block = failure_map(unit, unit, status, ["mass", "tau_d"], ["kg", "s"], ["zeta"], 0)
        text = page(with_map(results, block))
        assert "5 of 5 evaluations (100.0 %)" in text
        assert "pairs of factors" not in text
        assert "undefined" in text  # the rank test has nothing to compare with


@pytest.mark.usefixtures("paper")
class TestPicture:
    def test_failures_lie_where_they_ran_each_outcome_with_a_mark_of_its_own(self) -> None:
        block = found()
        plane, strips = draw(block).axes
        shown = block["shown"]
        lines = {line.get_marker(): line for line in plane.lines}
        assert len(lines) == 4
        for name, mark in (("ok", "."), ("timed out", "X"), ("crashed", "^"), ("no valley", "s")):
            at = [i for i, each in enumerate(shown["outcome"]) if each == name]
            np.testing.assert_array_equal(lines[mark].get_xdata(), np.array(shown["x"])[at])
            np.testing.assert_array_equal(lines[mark].get_ydata(), np.array(shown["y"])[at])
        assert plane.get_xlabel() == "mass, kg"
        drawn = np.concatenate([line.get_xdata() for line in strips.lines if line.get_ydata().round()[0] == 0])
        j = FACTORS.index(block["factors"][0]["factor"])
        np.testing.assert_allclose(np.sort(drawn), np.sort(np.array(shown["positions"])[:, j]))

    @pytest.mark.parametrize(("kinds", "k"), [(1, 1), (7, 4), (2, 2)])
    def test_any_number_of_outcomes_and_factors_can_be_drawn(self, kinds: int, k: int) -> None:
        figure = draw(found(kinds, k=k))
        figure.draw(style.renderer(figure))
        assert len(figure.axes) == (1 if k == 1 else 2)
        for panel in figure.axes:
            assert np.isfinite([*panel.get_xlim(), *panel.get_ylim()]).all()
        (legend,) = figure.legends
        assert len(legend.get_texts()) == kinds + (k > 1)
        assert legend.get_window_extent(style.renderer(figure)).y0 >= max(panel.get_window_extent().y1 for panel in figure.axes)

    def test_names_of_strips_stay_clear_of_the_plane(self) -> None:
        block = found()
        long = "propulsion/engine[0]/thrust-gain"
        block["shown"]["order"] = [long if name == "mass" else name for name in block["shown"]["order"]]
        for row in block["factors"]:
            row["factor"] = long if row["factor"] == "mass" else row["factor"]
        figure = draw(block)
        figure.draw(style.renderer(figure))
        plane, strips = figure.axes
        left = min(label.get_window_extent(style.renderer(figure)).x0 for label in strips.get_yticklabels())
        assert left > plane.get_window_extent().x1
        assert "…ne[0]/thrust-gain" in [label.get_text() for label in strips.get_yticklabels()]

    def test_the_picture_belongs_to_its_section_and_says_when_it_shows_a_part(self, results: Results) -> None:
        (plan,) = pictures(with_map(results, found()))
        assert (plan.name, plan.criterion, plan.wide) == ("failure_map", "failure_map", True)
        assert "Shown:" not in plan.caption
        block = found()
        block["shown"]["of"] = [block["failed"], 9000]
        (plan,) = pictures(with_map(results, block))
        assert f"Shown: {block['failed']} of {block['failed']} failed, {300 - block['failed']} of 9000 others." in plan.caption
