"""Cases, coupling, amplitudes, scaled Levels, translational rate and the sample without delay, in tables and pictures."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from synthetic_sections import SECTIONS, alter, extend, section, sweeps

from levelone.campaign.coupling import NO_PATH
from levelone.errors import InputError
from levelone.handling.froude import froude_scaled
from levelone.handling.levels import load_boundaries
from levelone.report import amplitudes, cases, coupling, delay, froude, style, symbols, translation
from levelone.report.results import Results
from levelone.status import Status

DEG = 180.0 / math.pi


@pytest.fixture(scope="module")
def extended(results: Results, tmp_path_factory: pytest.TempPathFactory) -> Results:
    return extend(results, tmp_path_factory.mktemp("sections"))


@pytest.mark.parametrize("name", SECTIONS)
def test_nothing_is_shown_of_a_section_that_the_study_lacks(results: Results, name: str) -> None:
    module, _ = SECTIONS[name]
    assert module.context(results) is None
    assert module.pictures(results) == []
    assert section(results, name).text == ""


@pytest.mark.parametrize("name", SECTIONS)
@pytest.mark.usefixtures("paper")
def test_pictures_belong_to_their_section_and_can_be_drawn(extended: Results, name: str) -> None:
    module, key = SECTIONS[name]
    for plan in module.pictures(extended):
        assert plan.criterion == key
        figure = plan.draw()
        figure.draw(style.renderer(figure))
        assert figure.get_figwidth() == (style.PAGE if plan.wide else style.COLUMN)


@pytest.mark.parametrize("name", ["cases", "coupling", "froude", "translation"])
@pytest.mark.usefixtures("paper")
def test_pictures_of_nothing_but_undefined_values_can_be_drawn(extended: Results, name: str) -> None:
    def lose(block: Any) -> Any:
        if isinstance(block, dict):
            return {key: lose(part) for key, part in block.items()}
        if isinstance(block, list):
            return [lose(part) for part in block]
        return math.nan if isinstance(block, float) else block

    def change(summary: dict[str, Any]) -> None:
        for block in summary["cases"].values():
            block["values"] = lose(block["values"])
        summary["coupling"]["mu_star"] = lose(summary["coupling"]["mu_star"])
        for entry in summary["responses"].values():
            entry["nominal"] = math.nan

    nothing = extended.monte_carlo.assign(values=extended.monte_carlo["values"] * math.nan)
    lost = replace(alter(extended, change), monte_carlo=nothing)
    module, _ = SECTIONS[name]
    for plan in module.pictures(lost):
        figure = plan.draw()
        figure.draw(style.renderer(figure))
        for panel in figure.axes:
            assert np.isfinite([*panel.get_xlim(), *panel.get_ylim()]).all()


@pytest.mark.parametrize("name", SECTIONS)
def test_symbols_are_not_escaped_into_the_text(extended: Results, name: str) -> None:
    assert not re.search(r"<|>|&[a-z]+;", section(extended, name).text)


@pytest.mark.parametrize("name", SECTIONS)
def test_rows_of_each_table_are_as_wide_as_its_head(extended: Results, name: str) -> None:
    tables = section(extended, name).tables
    assert tables
    for widths in tables:
        assert len(widths) >= 2
        assert set(widths) == {widths[0]}


class TestCases:
    def test_changes_are_against_the_first_case(self, extended: Results) -> None:
        block = cases.context(extended)["blocks"][0]
        assert [row["values"][0] for row in block["rows"]] == ["3", "3.06 (+2.0 %)", "2.94 (−2.0 %)"]

    def test_angles_are_in_degrees_and_changed_coefficients_marked(self, extended: Results) -> None:
        block = cases.context(extended)["blocks"][0]
        assert block["rows"][0]["values"][1] == f"{DEG * 0.07:.4g}"
        marks = [[item["changed"] for item in row["coefficients"]] for row in block["rows"]]
        assert marks == [[False, False], [True, False], [False, True]]

    def test_undefined_reading_says_why_and_has_no_level(self, extended: Results) -> None:
        text = section(extended, "cases").text
        assert f"undefined: {Status.RANGE_TOO_SHORT.text}" in text
        assert "undefined: no valley" in text
        assert cases.context(extended)["blocks"][1]["rows"][2]["level"] == "undefined"

    def test_readings_of_one_symbol_are_told_apart(self, extended: Results) -> None:
        heads = [str(item["head"]) for item in cases.context(extended)["blocks"][2]["responses"]]
        assert len(set(heads)) == len(heads) == 6

    @pytest.mark.usefixtures("paper")
    def test_points_lie_where_the_values_say_and_carry_the_numbers_of_the_cases(self, extended: Results) -> None:
        figure = self.figure(extended, "cases_attitude_quickness")
        block = extended.summary["cases"]["attitude_quickness"]["values"]
        for panel in figure.axes:
            flown = next(line for line in panel.lines if len(line.get_xdata()) == 3 and line.get_marker() == "o")
            np.testing.assert_allclose(flown.get_xdata(), DEG * np.array(block["delta_theta_min"]))
            np.testing.assert_allclose(flown.get_ydata(), block["quickness"])
        assert [text.get_text() for text in figure.axes[1].texts if text.get_text()] == ["1", "2", "3"]

    @pytest.mark.usefixtures("paper")
    def test_case_without_a_pole_is_named_and_not_drawn(self, extended: Results) -> None:
        figure = self.figure(extended, "cases_dynamic_stability")
        assert [text.get_text() for text in figure.axes[1].texts if text.get_text()] == ["1", "2"]
        assert "Undefined and not drawn: case 3." in figure.texts[-1].get_text()

    @pytest.mark.usefixtures("paper")
    def test_swept_readings_stand_beside_the_linear_ones(self, extended: Results) -> None:
        figure = self.figure(extended, "cases_bandwidth")
        values = extended.summary["cases"]["bandwidth"]["values"]
        points = [line.get_ydata() for line in figure.axes[1].lines if len(line.get_xdata()) == 3]
        np.testing.assert_allclose(points[0], values["tau_p"])
        np.testing.assert_allclose(points[1], values["tau_p_swept"])
        assert "case, swept with 0.5 m/s" in [text.get_text() for text in figure.legends[0].get_texts()]

    @staticmethod
    def figure(results: Results, name: str) -> Figure:
        return next(plan for plan in cases.pictures(results) if plan.name == name).draw()


class TestAmplitudes:
    def test_largest_amplitude_that_agrees(self) -> None:
        assert amplitudes.largest_that_agrees(sweeps()) == 0.5
        assert amplitudes.largest_that_agrees(sweeps()[::-1]) == 0.5
        assert math.isnan(amplitudes.largest_that_agrees(sweeps()[2:]))

    def test_gap_below_an_amplitude_that_agrees_does_not_count(self) -> None:
        middle = sweeps()
        middle[1]["max_phase_difference_deg"] = 5.01
        middle[2] |= {"max_phase_difference_deg": 4.0, "max_gain_difference_db": 1.0}
        assert amplitudes.largest_that_agrees(middle) == 0.1

    def test_undefined_differences_do_not_agree(self) -> None:
        entry = sweeps()[0] | {"max_gain_difference_db": math.nan}
        assert not amplitudes.agrees(entry)

    def test_words_name_the_first_amplitude_that_differs(self, extended: Results) -> None:
        text = section(extended, "amplitudes").text
        assert "holds up to 0.5 m/s" in text
        assert "at 1 m/s the differences reach 2.7 dB and 5.5 deg" in text
        assert f"undefined: {Status.LOW_COHERENCE.text}" in text

    def test_words_where_all_or_none_agree(self, extended: Results) -> None:
        every = alter(extended, lambda summary: summary.update(amplitudes=sweeps()[:2]))
        assert "up to the largest amplitude flown, 0.5 m/s" in section(every, "amplitudes").text
        none = alter(extended, lambda summary: summary.update(amplitudes=sweeps()[2:]))
        assert "does not hold at any of these amplitudes" in section(none, "amplitudes").text

    @pytest.mark.usefixtures("paper")
    def test_difference_drawn_is_that_of_the_file(self, extended: Results) -> None:
        figure = amplitudes.draw_amplitudes(extended)
        curves = [line for line in figure.axes[1].lines if len(line.get_xdata()) == 200]
        assert len(curves) == 3
        for curve, factor in zip(curves, (1.01, 1.02, 1.3), strict=True):
            np.testing.assert_allclose(curve.get_ydata(), 20.0 * math.log10(factor), atol=0.05)  # linear line is interpolated

    @pytest.mark.usefixtures("paper")
    def test_missing_group_is_named(self, results: Results) -> None:
        broken = alter(results, lambda summary: summary.update(amplitudes=sweeps()))
        with pytest.raises(InputError, match="group amplitudes"):
            amplitudes.draw_amplitudes(broken)


class TestCoupling:
    def test_no_path_and_dropped_factors_are_in_words(self, extended: Results) -> None:
        text = section(extended, "coupling").text
        assert NO_PATH[1:] in text
        assert "Below 1.0 % of the largest effect" in text
        assert "100.0 % 92.9 to 100.0 %" in text
        assert f"50: {Status.ON_AXIS_RETURNED.text}" in text

    def test_most_influential_first_and_parts_in_percent(self, extended: Results) -> None:
        rows = coupling.context(extended)["rows"]
        assert [row["symbol"] for row in rows[:2]] == [symbols.html("I_y"), symbols.html("C_Dq")]
        assert [row["parts"][0] for row in rows] == ["100.0 %", "0.4 %", "0", "0"]
        assert [row["added"] for row in rows] == [False, False, True, True]

    def test_undecided_factors_are_not_called_dropped(self, extended: Results) -> None:
        def fail(summary: dict[str, Any]) -> None:
            summary["coupling"] |= {"dropped": [], "undecided": ["I_y"]}
            summary["coupling"]["mu_star"]["zeta"] = dict.fromkeys(summary["coupling"]["mu_star"]["zeta"], math.nan)

        text = section(alter(extended, fail), "coupling").text
        assert "No factor lies below" in text
        assert "Not decided, since runs failed" in text

    @pytest.mark.usefixtures("paper")
    def test_bars_end_at_the_part_and_nothing_is_written_out(self, extended: Results) -> None:
        panel = coupling.draw_coupling(extended.summary["coupling"]).axes[0]
        ends = sorted(patch.get_x() + patch.get_width() for patch in panel.patches if patch.get_height() < 1.0)
        assert ends == pytest.approx([0.004, 1.0])
        assert [text.get_text() for text in panel.texts] == ["none (added)", "none (added)"]


class TestFroude:
    def test_both_sets_of_shares_stand_beside_each_other(self, extended: Results) -> None:
        rows = {row["title"]: row for row in froude.context(extended)["rows"]}
        sets = rows[symbols.CRITERION_TITLES["translational_rate"]]["sets"]
        assert [entry["shares"][0] for entry in sets] == ["2.0 %", "40.0 %"]
        extended_to = rows[symbols.CRITERION_TITLES["attitude_quickness"]]["sets"][1]["extended"]
        assert extended_to == ["0.0 %", "100.0 %", "0.0 %"]
        text = section(extended, "froude").text
        assert "4 m against 16 m" in text
        assert "by hand" in text

    @pytest.mark.usefixtures("paper")
    def test_boundaries_drawn_are_scaled_and_the_full_scale_ones_dotted(self, extended: Results) -> None:
        panel = froude.draw_froude(extended).axes[0]
        scaled = froude_scaled(load_boundaries(), 4.0, 16.0).chart("attitude_quickness", "pitch")
        full = load_boundaries().chart("attitude_quickness", "pitch")
        line = next(line for line in panel.lines if line.get_label() == "_level_1_2")
        np.testing.assert_allclose(line.get_ydata(), scaled.level_1_2[:, 1])
        dotted = [line.get_ydata() for line in panel.lines if line.get_linestyle() == ":"]
        np.testing.assert_allclose(dotted, [full.level_1_2[:, 1], full.level_2_3[:, 1]])


class TestTranslation:
    def test_limits_come_from_the_file_with_their_confidence(self, extended: Results) -> None:
        text = section(extended, "translation").text
        assert "2.5 to 5 s" in text
        assert "confidence low" in text
        assert "Level 1: 2.0 % of the runs (95 % interval 0.0 to 4.0 %)" in text

    @pytest.mark.parametrize(
        ("value", "words"), [(2.5, "Level 1"), (5.0, "Level 1"), (2.4, "Level 2 at best"), (math.nan, "undefined")]
    )
    def test_level_of_the_nominal_vehicle(self, extended: Results, value: float, words: str) -> None:
        changed = alter(extended, lambda summary: summary["responses"]["rise_time"].update(nominal=value))
        assert translation.nominal_level(changed) == words

    @pytest.mark.usefixtures("paper")
    def test_marks_stand_at_the_values(self, extended: Results) -> None:
        history = translation.draw_history(extended).axes[0]
        words = [text.get_text() for text in history.texts]
        assert f"{symbols.mathtext('rise_time')} = 0.9 s" in words
        assert "overshoot 20.0 %" in words
        plane = translation.draw_plane(extended).axes[0]
        places = {round(float(line.get_xdata()[0]), 9) for line in plane.lines if len(line.get_xdata()) == 2}
        assert places == {2.5, 5.0, 1.25}
        runs = next(line for line in plane.lines if line.get_label() == "_runs")
        np.testing.assert_allclose(runs.get_ydata(), 100.0 * extended.sample("overshoot"))

    @pytest.mark.usefixtures("paper")
    def test_undefined_nominal_values_leave_no_mark(self, extended: Results) -> None:
        def lose(summary: dict[str, Any]) -> None:
            for name in ("rise_time", "overshoot"):
                summary["responses"][name]["nominal"] = math.nan

        lost = alter(extended, lose)
        assert [text.get_text() for text in translation.draw_history(lost).axes[0].texts if text.get_text()] == []
        assert np.isfinite(translation.draw_plane(lost).axes[0].get_xlim()).all()


class TestDelay:
    def test_spread_is_relative_to_the_mean(self, extended: Results) -> None:
        rows = delay.context(extended)["rows"]
        assert [row["delay"] for row in rows] == ["varied", "held"]
        assert rows[1]["relative"] == "2.0 %"

    def test_study_without_the_factor_shows_its_note(self, extended: Results) -> None:
        note = {"n": 0, "responses": {}, "note": "nothing was held"}
        text = section(alter(extended, lambda summary: summary.update(without_delay=note)), "delay").text
        assert text.endswith("Nothing was held.")


def test_symbols_of_the_new_responses() -> None:
    assert symbols.mathtext("rise_time") == r"$T_{\mathrm{eq}}$"
    assert str(symbols.html("tau_p_swept")) == str(symbols.html("tau_p_attitude"))
    assert symbols.title("overshoot") == "Overshoot of the ground speed"
    assert symbols.axis_label("rise_time", "s") == r"$T_{\mathrm{eq}}$, s"


def test_group_is_read_back_from_the_file(extended: Results, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"frequency\.nc: missing"):
        amplitudes.draw_amplitudes(replace(extended, directory=tmp_path))
