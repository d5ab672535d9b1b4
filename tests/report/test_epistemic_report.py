"""Probability boxes and Level shares as intervals in the report, from a block made by hand: nothing here is a reference."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from synthetic_sections import Walk, alter

from levelone.report import epistemic, page, style
from levelone.report.results import Results
from levelone.report.sections import contexts, further_pictures

CUTS = np.linspace(0.2, 0.5, 7)
LOWER = np.array([0.0, 0.0, 0.0, 0.25, 0.5, 1.0, 1.0])
UPPER = np.array([0.0, 0.25, 0.75, 1.0, 1.0, 1.0, 1.0])


def response(unit: str = "1", **more: Any) -> dict[str, Any]:
    return {
        "unit": unit, "thresholds": CUTS.tolist(), "lower": LOWER.tolist(), "upper": UPPER.tolist(),
        "plain": (0.5 * (LOWER + UPPER)).tolist(), "sample": (0.5 * (LOWER + UPPER)).tolist(),
        "lower_flown": LOWER.tolist(), "upper_flown": (0.9 * UPPER).tolist(),
        "mean": [0.30, 0.38], "mean_flown": [0.31, 0.37], "mean_plain": 0.34, "range": [0.22, 0.45], "range_flown": [0.23, 0.44],
        "quantiles": {"p05": [0.2, 0.3], "p50": [0.25, 0.4], "p95": [0.3, math.nan]}, "failed_flown": [0.0, 0.125],
        "difference": 0.03125, "q2": 0.9876, "status": "ok", **more,
    }  # fmt: skip


def share(lower: float, upper: float, sample: float) -> dict[str, float]:
    return {"lower": lower, "upper": upper, "lower_flown": lower, "upper_flown": upper, "plain": sample, "sample": sample}


def shares(lower: float, upper: float, sample: float) -> dict[str, Any]:
    none = dict.fromkeys(("level_3", "outside", "failed"), share(0.0, 0.0, 0.0))
    return {"level_1": share(lower, upper, sample), "level_2": share(1.0 - upper, 1.0 - lower, 1.0 - sample), **none}


def block(**more: Any) -> dict[str, Any]:
    low, high = {"C_L0": 0.6, "C_mq": -19.0}, {"C_L0": 0.9, "C_mq": -13.0}
    second = {"mass": 0.25, "low": low | {"C_mq": -8.0}, "high": high | {"C_mq": -7.0}}
    point = {"box": 0, "origin": "corner", "values": {"C_L0": 0.6, "C_mq": -13.0}, "failed": 0.0, "level_difference": 0.0}
    inside = {"box": 1, "origin": "refinement", "values": {"C_L0": 0.675, "C_mq": -7.0}, "failed": 0.125, "level_difference": 0.05}
    return {
        "factors": ["C_L0", "C_mq"], "aleatory": ["M", "tau_d"], "basis": "assumed: nobody has measured them",
        "outer": 16, "inner": 64, "boxes": [{"mass": 0.75, "low": low, "high": high}, second],
        "points": {"corner": 8, "latin hypercube": 32, "refinement": 60},
        "extremes_by": {"corner": 0.9, "latin hypercube": 0.0, "refinement": 0.1}, "flown": [point, inside], "flown_runs": 128,
        "responses": {"zeta": response(), "delta_theta_pk": response("rad"),
                      "quickness": response(status="too few runs", q2=math.nan)},
        "levels": {"dynamic_stability": shares(0.1, 0.6, 0.35), "worst": shares(0.0, 0.6, 0.3)}, **more,
    }  # fmt: skip


def extended(results: Results, **more: Any) -> Results:
    return alter(results, lambda summary: summary.update(epistemic=block(**more)))


def walk(results: Results) -> Walk:
    template = page.environment().from_string('{% from "macros.html" import table %}{% include "epistemic.html" %}')
    found = Walk(template.render(epistemic=epistemic.context(results), drawings={"epistemic": []}))
    assert found.open == []
    return found


def figure(results: Results, name: str) -> Figure:
    found = next(plan for plan in epistemic.pictures(results) if plan.name == name).draw()
    found.draw(style.renderer(found))
    return found


class TestPage:
    def test_nothing_is_shown_of_a_study_without_the_section(self, results: Results) -> None:
        assert epistemic.context(results) is None
        assert epistemic.pictures(results) == []
        assert walk(results).text == ""

    def test_section_takes_part_in_the_report(self, results: Results) -> None:
        assert contexts(extended(results))["further"].count(("epistemic", "Unknown and varying")) == 1
        names = [picture.name for picture in further_pictures(extended(results)) if picture.criterion == "epistemic"]
        assert names == ["epistemic_levels", "epistemic_boxes"]

    def test_shares_stand_as_intervals_beside_the_plain_ones(self, results: Results) -> None:
        rows = epistemic.context(extended(results))["levels"]
        assert [(row["title"], row["level"], row["plain"], row["bounds"]) for row in rows] == [
            ("Dynamic stability", "Level 1", "35.0 %", "10.0 to 60.0 %"),
            ("", "Level 2", "65.0 %", "40.0 to 90.0 %"),
            ("Worst of the three", "Level 1", "30.0 %", "0.0 to 60.0 %"),
            ("", "Level 2", "70.0 %", "40.0 to 100.0 %"),
        ]

    def test_angles_are_in_degrees_and_a_missing_surrogate_says_why(self, results: Results) -> None:
        rows = {row["title"]: row for row in epistemic.context(extended(results))["rows"]}
        assert rows["Damping ratio"]["mean"] == "0.3 to 0.38"
        assert rows["Peak attitude change"]["mean"] == "17.19 to 21.77"
        assert "undefined (too few runs)" in walk(extended(results)).text

    def test_evidence_names_what_differs_between_its_boxes(self, results: Results) -> None:
        boxes = epistemic.context(extended(results))["boxes"]
        assert [box["mass"] for box in boxes] == ["0.75", "0.25"]
        assert [[ends for _, ends in box["parts"]] for box in boxes] == [["−19 to −13"], ["−8 to −7"]]

    def test_places_of_the_flown_points(self, results: Results) -> None:
        flown = epistemic.context(extended(results))["flown"]
        assert [point["places"] for point in flown] == [["low", "high"], ["0.25", "high"]]
        assert [point["box"] for point in flown] == [1, 2]

    def test_limits_of_a_search_are_said(self, results: Results) -> None:
        text = walk(extended(results)).text
        assert "the true ones may lie further out" in text
        assert "100 points were visited" in text
        assert "standard error is at most 6.2 %" in text
        assert "Nobody" not in text
        assert "Assumed: nobody has measured them" in text

    def test_with_nothing_that_varies_the_page_says_so(self, results: Results) -> None:
        text = walk(extended(results, aleatory=[], inner=1)).text
        assert "Nothing varies" in text
        assert "standard error" not in text

    def test_tables_are_as_wide_as_their_heads_and_symbols_are_not_escaped(self, results: Results) -> None:
        found = walk(extended(results))
        assert len(found.tables) == 4
        for widths in found.tables:
            assert set(widths) == {widths[0]}
        assert not re.search(r"<|>|&[a-z]+;", found.text)


@pytest.mark.usefixtures("paper")
class TestPictures:
    def test_curves_are_the_bounds_and_steps_never_narrow_the_box(self, results: Results) -> None:
        panel = figure(extended(results), "epistemic_boxes").axes[0]
        lower, upper = panel.lines[:2]
        np.testing.assert_allclose(lower.get_xdata(), CUTS)
        np.testing.assert_allclose(lower.get_ydata(), LOWER)
        np.testing.assert_allclose(upper.get_ydata(), UPPER)
        # between two thresholds nothing is known: the lower curve stays behind and the upper one goes ahead
        assert (lower.get_drawstyle(), upper.get_drawstyle()) == ("steps-post", "steps-pre")
        (shaded,) = panel.collections
        corners = shaded.get_paths()[0].vertices
        inside = corners[np.isclose(corners[:, 0], CUTS[2])]
        assert inside[:, 1].min() == 0.0
        assert inside[:, 1].max() == 1.0  # the upper bound of the next threshold holds right of this one

    def test_axes_hold_the_box_and_the_nominal_value_in_the_unit_of_the_field(self, results: Results) -> None:
        changed = alter(extended(results), lambda summary: summary["responses"]["delta_theta_pk"].update(nominal=0.6))
        panel = figure(changed, "epistemic_boxes").axes[1]
        low, high = panel.get_xlim()
        assert low <= math.degrees(0.2) + 1e-9
        assert high >= math.degrees(0.6)
        assert panel.get_title().endswith("deg")

    def test_bars_run_from_lower_to_upper_share(self, results: Results) -> None:
        axes = figure(extended(results), "epistemic_levels").axes
        assert [panel.get_title() for panel in axes] == ["Level 1", "Level 2"]
        bars = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in axes[0].patches]
        np.testing.assert_allclose(bars, [(10.0, 60.0), (0.0, 60.0)])
        np.testing.assert_allclose(axes[0].lines[-1].get_xdata(), [35.0, 30.0])

    def test_bound_without_width_can_still_be_seen(self, results: Results) -> None:
        sure = {"worst": shares(1.0, 1.0, 1.0)}
        (panel,) = figure(extended(results, levels=sure), "epistemic_levels").axes[:1]
        (bar,) = panel.patches
        assert bar.get_width() > 0.0
        assert bar.get_x() + bar.get_width() == 100.0

    def test_nothing_but_undefined_values_can_be_drawn(self, results: Results) -> None:
        lost = [math.nan] * len(CUTS)
        entry = response(sample=lost, lower_flown=lost, upper_flown=lost, lower=[0.0] * 7, upper=[1.0] * 7, status="refused")
        found = figure(extended(results, responses={"zeta": entry}), "epistemic_boxes")
        assert np.isfinite([*found.axes[0].get_xlim(), *found.axes[0].get_ylim()]).all()
        assert "no surrogate to be trusted" in [text.get_text() for text in found.axes[0].texts]

    def test_widths_are_those_of_the_report(self, results: Results) -> None:
        for plan in epistemic.pictures(extended(results)):
            assert plan.wide
            assert plan.draw().get_figwidth() == style.PAGE
