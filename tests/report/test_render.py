"""The page: complete, self-contained, escaped, the same whenever it is written, and plain about what is undefined."""

from __future__ import annotations

import copy
import math
import re
import shutil
from collections import defaultdict
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
import synthetic

from levelone.errors import InputError
from levelone.report import assumptions, render, style, svg, tables
from levelone.report.charts import charts_of
from levelone.report.page import environment
from levelone.report.pictures import file_name, pictures
from levelone.report.results import Results
from levelone.report.screening import draw_screening
from levelone.status import Status

HOSTILE = "<script>alert('x')</script> & \"quoted\" </td> $\\frac{1}{ {{ 7 * 7 }}"


class Walk(HTMLParser):
    """Nesting, identifiers, links and text of a page."""

    VOID = ("meta", "br")

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.wrong: list[tuple[str, tuple[int, int]]] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.words: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append((tag, self.getpos()))

    def handle_data(self, data: str) -> None:
        if "style" not in self.open and data.strip():
            self.words.append(" ".join(data.split()))

    @property
    def text(self) -> str:
        return " ".join(self.words)

    def values(self, name: str) -> list[str]:
        return [value for _, attribute, value in self.attributes if attribute == name]


@pytest.fixture(scope="module")
def walk(page: str) -> Walk:
    return Walk(page)


def page_without_pictures(results: Results) -> str:
    """The template alone: quick, for what does not concern figures."""
    context = render._context(results, charts_of(results.summary["study"]))
    drawings: dict[str, list[Any]] = defaultdict(list)
    return environment().get_template("report.html").render(**context, drawings=drawings)


def alter(results: Results, change: Any) -> Results:
    summary = copy.deepcopy(dict(results.summary))
    change(summary)
    return replace(results, summary=summary)


def test_page_is_well_formed_with_unique_identifiers(walk: Walk) -> None:
    assert walk.wrong == []
    assert walk.open == []
    identifiers = walk.values("id")
    assert len(identifiers) == len(set(identifiers))
    inside = [link.removeprefix("#") for link in walk.values("href")]
    assert set(inside) <= set(identifiers)


def test_page_needs_nothing_else(page: str, walk: Walk) -> None:
    assert not re.search(r"https?:|//[a-z]|@import|url\((?!#)", page)
    tags = {tag for tag, _, _ in walk.attributes}
    assert not tags & {"script", "link", "img", "iframe", "object", "base"}
    assert all(link.startswith("#") for link in walk.values("href"))
    assert walk.values("src") == []
    assert not any(name.startswith("on") for _, name, _ in walk.attributes)


def test_sections_come_in_order(page: str) -> None:
    ids = ["intended-use", "validity-domain", "assumptions", "not-validated", "summary", "levels", "attitude_quickness",
           "dynamic_stability", "bandwidth", "values", "numerics", "provenance"]  # fmt: skip
    assert re.findall(r'<section id="([^"]+)">', page) == ids


def test_each_picture_is_in_the_page_and_in_the_folder(folder: Path, page: str, results: Results) -> None:
    plans = pictures(results, charts_of(results.summary["study"]))
    assert len(plans) == 3 + 1 + len(results.responses) + 3 + 3
    for plan in plans:
        assert f'<figure id="{plan.name}"' in page
        for ending, magic in (("svg", b"<?xml"), ("png", b"\x89PNG")):
            assert (folder / "figures" / f"{plan.name}.{ending}").read_bytes().startswith(magic)
    assert page.count("<svg ") == len(plans)
    numbers = [int(number) for number in re.findall(r"<b>Figure (\d+)\.</b>", page)]
    assert numbers == list(range(1, len(plans) + 1))


def test_angles_are_shown_in_degrees(walk: Walk) -> None:
    row = walk.text[walk.text.index("Minimum attitude change") :][:120]
    assert f"deg {math.degrees(0.069):.4g}" in row


def test_undefined_values_are_words_with_their_status(results: Results) -> None:
    def change(summary: dict[str, Any]) -> None:
        entry = summary["responses"]["tau_p"]
        entry |= {"nominal": math.nan, "status": Status.RANGE_TOO_SHORT.text, "rank_agreement": math.nan}
        entry["monte_carlo"] |= {"failed": 500, **dict.fromkeys(("mean", "std", "min", "max", "p05", "p50", "p95"), math.nan)}
        entry["surrogate"] |= {"q2": math.nan, "status": "too few runs"}
        for index in entry["sobol"].values():
            index |= {"S1": math.nan, "ST": math.nan, "S1_ci": [math.nan] * 2, "ST_ci": [math.nan] * 2}
        summary["levels"]["bandwidth"]["level_1_ci"] = [math.nan, math.nan]
        summary["numerics"]["tau_p"]["half_step"] = math.nan

    page = page_without_pictures(alter(results, change))
    text = Walk(page).text
    row = text[text.index("Phase delay of q / V_lon") :][:400]
    assert f"undefined {Status.RANGE_TOO_SHORT.text}" in row
    assert "500 of 500 0 undefined (too few runs) undefined" in row
    assert not re.search(r"\bnan\b", page, re.IGNORECASE)


def test_synthetic_page_shows_no_bare_nan(page: str, walk: Walk) -> None:
    assert not re.search(r"\bnan\b", walk.text, re.IGNORECASE)
    assert "does not use spectra" in walk.text


def test_failures_name_cause_and_corner(walk: Walk, results: Results) -> None:
    start = walk.text.index("Runs that failed, and where")
    failures = walk.text[start : walk.text.index("Validity of the runs")]
    count = results.responses["omega_n"]["failures"][Status.NO_SECOND_PEAK.text]
    assert f"{count}: {Status.NO_SECOND_PEAK.text}" in failures
    assert Status.PIO_CAUTION.text in failures
    assert "of its range in undefined runs" in failures


def test_outside_range_is_counted_apart_from_the_extension(walk: Walk) -> None:
    levels = walk.text[walk.text.index("Shares of Levels") :]
    assert "counted apart, by the extended boundary 97.4 % 0.0 % 0.0 %" in levels
    assert "not probabilities" in levels


def test_hostile_text_is_escaped_everywhere(results: Results) -> None:
    def change(summary: dict[str, Any]) -> None:
        study = summary["study"]
        study |= {"title": HOSTILE, "intended_use": HOSTILE, "name": HOSTILE, "vehicle": HOSTILE}
        study["factors"][0] |= {"name": HOSTILE, "source": HOSTILE, "target": HOSTILE, "unit": HOSTILE}
        summary |= {"not_validated": [HOSTILE], "validity_domain": [HOSTILE]}
        summary["assumed"] += [{"field": HOSTILE, "why": HOSTILE}]
        summary["provenance"]["platform"] = HOSTILE
        summary["levels"]["confidence"]["bandwidth"] = HOSTILE
        for entry in summary["responses"].values():
            entry["status"] = HOSTILE
            entry["failures"] = {HOSTILE: 3}
            for table in ("morris", "sobol"):
                entry[table][HOSTILE] = entry[table].pop("M")
            for end in entry["sobol_bounded"].values():
                end[HOSTILE] = end.pop("M")
            entry["failure_corner"][0]["factor"] = HOSTILE

    page = page_without_pictures(alter(results, change))
    walk = Walk(page)
    assert walk.wrong == []
    assert "<script" not in page
    assert walk.text.count("alert('x')") > 30
    assert "{{ 7 * 7 }}" in walk.text


@pytest.mark.usefixtures("paper")
def test_hostile_factor_name_is_drawn_as_text(results: Results, tmp_path: Path) -> None:
    entry = copy.deepcopy(results.responses["zeta"])
    entry["morris"] = {HOSTILE + " -->": entry["morris"]["M"]}
    figure = draw_screening("zeta", entry)
    (tmp_path / "a.svg").write_bytes(style.svg_of(figure))
    walk = Walk(svg.inline((tmp_path / "a.svg").read_text(encoding="utf-8"), "a"))
    assert walk.wrong == []
    assert not {tag for tag, _, _ in walk.attributes} & {"script", "td"}
    assert any("alert" in text.get_text() for text in figure.axes[0].texts)


def test_response_names_cannot_leave_the_folder() -> None:
    assert file_name("../../etc/passwd") == "______etc_passwd"


def test_same_results_give_the_same_bytes(folder: Path, page: str, tmp_path: Path) -> None:
    again = tmp_path / "again"
    shutil.copytree(folder, again, ignore=shutil.ignore_patterns("figures", "report.html"))
    steps: list[tuple[str, int, int]] = []
    path = render.render_report(again, lambda *step: steps.append(step))
    assert path == again / "report.html"
    assert path.read_bytes() == page.encode()
    names = sorted(item.name for item in (folder / "figures").iterdir())
    assert names == sorted(item.name for item in (again / "figures").iterdir())
    for name in names:
        assert (folder / "figures" / name).read_bytes() == (again / "figures" / name).read_bytes(), name
    assert steps == [("report", done, len(steps)) for done in range(1, len(steps) + 1)]


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_the_number_of_processes_changes_nothing(folder: Path, page: str, tmp_path: Path) -> None:
    again = tmp_path / "again"
    shutil.copytree(folder, again, ignore=shutil.ignore_patterns("figures", "report.html"))
    assert render.render_report(again, workers=3).read_bytes() == page.encode()
    names = sorted(item.name for item in (folder / "figures").iterdir())
    assert all((folder / "figures" / name).read_bytes() == (again / "figures" / name).read_bytes() for name in names)


def test_nothing_is_written_for_a_bad_folder(folder: Path, tmp_path: Path) -> None:
    for item in folder.iterdir():
        if item.is_file() and item.name != "report.html":
            shutil.copy(item, tmp_path)
    synthetic.rewrite(tmp_path, lambda document: document["study"].update(boundaries="ads34-levels"))
    with pytest.raises(InputError, match="did you mean 'ads33-levels'"):
        render.render_report(tmp_path)
    synthetic.rewrite(tmp_path, lambda document: document["study"].pop("boundaries"))
    synthetic.rewrite(tmp_path, lambda document: document["responses"].pop("zeta"))
    with pytest.raises(InputError, match="the results miss 'zeta'"):
        render.render_report(tmp_path)
    assert not (tmp_path / "figures").exists()
    assert not (tmp_path / "report.html").exists()


class TestAssumptions:
    def test_ranked_by_the_largest_total_index(self, results: Results) -> None:
        varied, fixed = assumptions.ranked(results.summary)
        assert [(item.factor, item.response) for item in varied] == [("tau_d", "tau_p_attitude"), ("C_L0", "zeta")]
        for item in varied:
            totals = [entry["sobol"][item.factor]["ST"] for entry in results.responses.values()]
            assert item.influence == max(totals)
        assert [item.field for item in fixed] == ["airframe.mass.I_xx", "controller"]

    def test_sections_are_ranked_by_their_strongest_factor(self, results: Results) -> None:
        def change(summary: dict[str, Any]) -> None:
            summary["assumed"] = [
                {"field": "aerodynamics", "why": "a"},
                {"field": "rotors.table", "why": "b"},
                {"field": "rotors", "why": "c"},
            ]

        varied, fixed = assumptions.ranked(alter(results, change).summary)
        found = [(item.field, item.factor, item.several, item.response) for item in varied]
        assert found == [("rotors.table", "K_T", 2, "omega_bw"), ("aerodynamics", "C_L0", 9, "zeta")]
        assert [item.field for item in fixed] == ["rotors"]

    def test_assumed_ranges_of_factors_are_listed_too(self, results: Results) -> None:
        def change(summary: dict[str, Any]) -> None:
            summary["assumed"] = []
            summary["study"]["factors"][3]["source"] = "assumed: not printed"

        varied, _ = assumptions.ranked(alter(results, change).summary)
        assert [(item.field, item.factor, item.why) for item in varied] == [("range of T_u", "T_u", "not printed")]

    def test_undefined_influence_comes_last_and_is_not_zero(self, results: Results) -> None:
        def change(summary: dict[str, Any]) -> None:
            for entry in summary["responses"].values():
                entry["sobol"]["tau_d"]["ST"] = math.nan

        altered = alter(results, change)
        varied, _ = assumptions.ranked(altered.summary)
        assert [item.factor for item in varied] == ["C_L0", "tau_d"]
        assert math.isnan(varied[1].influence)
        assert "no index is defined undefined" in Walk(page_without_pictures(altered)).text


class TestTables:
    @pytest.mark.parametrize(
        ("changes", "criterion", "words"),
        [
            ({"zeta": 0.34}, "dynamic_stability", "Level 2"),
            ({"zeta": -0.2}, "dynamic_stability", "Level 3"),
            ({"omega_n": math.nan}, "dynamic_stability", "Level 1"),
            ({"zeta": math.nan}, "dynamic_stability", "undefined"),
            ({"delta_theta_min": math.radians(8.0)}, "attitude_quickness", "Level 1"),
            ({"quickness": 1.0}, "attitude_quickness", "outside the requirement's range (Level 2 by the extended boundary)"),
            ({"omega_bw_attitude": 0.7}, "bandwidth", "Level 2"),
            ({"tau_p_attitude": 0.15}, "bandwidth", "outside the requirement's range (Level 1 by the extended boundary)"),
            ({"omega_bw": 0.1}, "bandwidth", "Level 1"),
        ],
    )
    def test_level_of_the_nominal_vehicle(self, results: Results, changes: dict[str, float], criterion: str, words: str) -> None:
        def change(summary: dict[str, Any]) -> None:
            for name, value in changes.items():
                summary["responses"][name]["nominal"] = value

        charts = charts_of(results.summary["study"])
        assert tables.nominal_levels(alter(results, change), charts)[criterion] == words

    def test_numerics_are_in_field_units_with_their_part(self, results: Results) -> None:
        rows = {row["title"]: row for row in tables.numerics_rows(results)}
        row = rows["Minimum attitude change"]
        assert row["half_step"] == f"{math.degrees(2e-5 * 0.069):.2g}".replace("e-05", "·10⁻⁵") + " (0.002 %)"
        assert row["window"] == "does not use spectra"

    def test_pole_keeps_its_sign(self) -> None:
        nominal = {
            "dominant_pole": {"real": 0.5, "imag": -2.0, "omega_n": 2.06, "zeta": -0.24},
            "trim": {"theta": 0.1, "throttle": [0.5]},
        }
        assert tables.nominal_rows(nominal)[0][1] == "0.5 − 2 i"


def test_boundaries_axis_and_task_are_those_of_the_study(results: Results) -> None:
    study = copy.deepcopy(results.summary["study"])
    assert charts_of(study).attitude_quickness.name == "attitude_quickness.pitch"
    study["manoeuvres"]["attitude_quickness"]["axis"] = "V_lat"
    study["task"] = "target_acquisition"
    charts = charts_of(study)
    assert (charts.attitude_quickness.name, charts.bandwidth.name) == ("attitude_quickness.roll", "bandwidth.target_acquisition")
    study["task"] = "landing"
    with pytest.raises(InputError, match="unknown name 'landing'"):
        charts_of(study)


def test_notes_of_the_study_are_shown(results: Results) -> None:
    altered = alter(results, lambda summary: summary["study"].update(notes=["The delay lies on the edge of its range."]))
    assert "Notes on the sources The delay lies on the edge of its range." in Walk(page_without_pictures(altered)).text
    assert "Notes on the sources" not in Walk(page_without_pictures(results)).text
