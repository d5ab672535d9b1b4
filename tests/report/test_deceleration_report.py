"""The manoeuvre's section: what the tables say, in which units, and what the figures draw; nothing here is a reference."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from levelone.campaign.store import write_groups
from levelone.errors import InputError
from levelone.report import style
from levelone.report.deceleration import MEASURES, context, pictures
from levelone.report.deceleration_figures import draw_histories, draw_plane, to_go
from levelone.report.page import environment
from levelone.report.results import Results
from levelone.status import Status

DEG = 180.0 / math.pi
NAN = math.nan
UNITS = {"overshoot": "m", "position": "m", "height": "m", "lateral": "m", "heading": "rad", "time": "s", "theta": "rad"}
TOLERANCES = {
    "desired": {"overshoot": 1.0, "position": 0.5, "height": 0.5, "lateral": 0.5, "heading": 0.1, "time": 20.0, "theta": 0.25},
    "adequate": {"overshoot": 2.0, "position": 1.0, "height": 1.0, "lateral": 1.0, "heading": 0.2, "time": 30.0, "theta": 0.5},
}
LABELS = ("nominal", "5 %", "median", "95 %", "worst")
HOSTILE = "<b>bold</b> & {{ 7 * 7 }}"


def shares(*runs: int) -> dict[str, Any]:
    names = ("desired", "adequate", "not_adequate", "failed")
    parts = {name: {"share": k / sum(runs), "runs": k, "ci": [0.9 * k / sum(runs), min(1.0, 1.1 * k / sum(runs) + 0.01)]}
             for name, k in zip(names, runs, strict=True)}  # fmt: skip
    return {"n": sum(runs)} | parts


def measure(name: str, value: float, factors: list[str]) -> dict[str, Any]:
    spread = {"n": 500, "failed": 7 if name in ("time", "position") else 0, "mean": value, "std": 0.1 * value, "min": 0.8 * value,
              "max": 1.4 * value, "p05": 0.85 * value, "p50": value, "p95": 1.2 * value}  # fmt: skip
    entry: dict[str, Any] = {
        "unit": UNITS[name], "nominal": value, "status": "ok", "monte_carlo": spread,
        "failures": {Status.NOT_CAPTURED.text: 7} if spread["failed"] else {},
        "cautions": {Status.INCIDENCE_OUTSIDE.text: 30},
    }  # fmt: skip
    if name in ("time", "overshoot", "theta", "height"):
        still = name == "overshoot"
        entry["surrogate"] = {
            "q2": NAN if still else 0.97,
            "status": "the response does not vary over the design" if still else "ok",
        }
        entry["sobol"] = {f: {"S1": NAN if still else 0.1, "ST": NAN if still else 0.6 / (k + 1), "S1_ci": [0.0, 0.1],
                              "ST_ci": [0.5 / (k + 1), 0.7 / (k + 1)]} for k, f in enumerate(factors)}  # fmt: skip
    return entry


def block(results: Results) -> dict[str, Any]:
    factors = [factor["name"] for factor in results.summary["study"]["factors"]]
    values = dict(zip(MEASURES, (0.0, 0.4, 0.7, 2e-15, 0.0, 21.5, 0.15), strict=True))
    rho = {m: {r: NAN if values[m] < 1e-9 else (-0.73 if (m, r) == ("time", "zeta") else 0.12) for r in results.responses}
           for m in MEASURES}  # fmt: skip
    counts = {"level_1": {"desired": 3, "adequate": 150, "not_adequate": 20, "failed": 0},
              "level_2": {"desired": 0, "adequate": 300, "not_adequate": 27, "failed": 0},
              "failed": {"desired": 0, "adequate": 0, "not_adequate": 0, "failed": 0}}  # fmt: skip
    run = {
        "speed": 10.0, "distance": 125.0, "group": "speed_10", "performance": "adequate",
        "responses": {name: measure(name, value, factors) for name, value in values.items()},
        "measure_performance": dict.fromkeys(MEASURES, "desired") | {"height": "adequate", "time": "adequate"},
        "shares": shares(3, 450, 47, 0), "measure_shares": {name: shares(400, 93, 7, 0) for name in MEASURES},
        "rank_correlation": rho, "rank_pairs": {m: dict.fromkeys(results.responses, 400) for m in MEASURES},
        "levels": {"worst": counts},
        "reach": {"alpha_min_deg": -16.6, "alpha_max_deg": 23.04, "C_D_min": -0.045, "saturated_runs": 2},
    }  # fmt: skip
    return {
        "pilot": {"gain": 0.35, "lead": 0.5, "delay": 0.25, "deceleration": 0.5, "reverse": 1.0}, "tolerances": TOLERANCES,
        "hover_speed": 0.1, "hold": 5.0, "duration": 36.0, "runs": [run],
        "assumed": [{"field": "deceleration.pilot", "why": f"no pilot has flown this: {HOSTILE}"}],
    }  # fmt: skip


def histories(captured: bool = True) -> xr.Dataset:
    """Constant deceleration to 2 m/s, then an exponential; later runs pass the point."""
    time = np.arange(0.0, 36.0, 0.02)
    since = np.maximum(time - 2.0, 0.0)
    speed = np.where(since < 16.0, 10.0 - 0.5 * since, 2.0 * np.exp(-np.maximum(since - 16.0, 0.0) / 2.0))
    x = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 0.02)])
    scale = 1.0 + np.array([0.0, -0.005, 0.0, 0.01, 0.02])[:, None]
    shape = np.sin(np.clip(since / 18.0, 0.0, 1.0) * 2.0 * np.pi)
    channels = {
        "x_north": scale * x, "V_lon": scale * speed, "V_lon_ref": np.tile(np.maximum(speed - 0.2, 0.0), (5, 1)),
        "theta": -0.02 + 0.14 * scale * np.abs(shape), "altitude": 30.0 + 0.7 * scale * shape,
    }  # fmt: skip
    return xr.Dataset(
        {name: (("run", "time"), values) for name, values in channels.items()}
        | {"start": ("run", np.full(5, 2.0)), "captured": ("run", np.full(5, 27.5 if captured else NAN))},
        coords={"time": time, "label": ("run", list(LABELS))},
        attrs={"speed": 10.0, "distance": float(x[-1])},
    )


@pytest.fixture(scope="module")
def flown(results: Results, tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("flown")
    write_groups(folder / "deceleration_histories.nc", {"speed_10": histories()})
    return replace(results, directory=folder, summary={**results.summary, "deceleration": block(results)})


def partial_page(results: Results) -> str:
    """The section alone, with the macros that the page gives it and one figure."""
    made = environment()
    drawing = {"number": 1, "name": "x", "caption": "A caption.", "wide": False, "svg": Markup("<svg></svg>")}
    template = made.from_string('{% from "macros.html" import table %}{% include "deceleration.html" %}')
    return template.render(deceleration=context(results), drawings={"deceleration": [drawing]})


class Walk(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.wrong: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("th", "td"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data: str) -> None:
        if {"th", "td"} & set(self.open):
            self.rows[-1][-1] += " ".join(data.split())

    def row(self, first: str) -> list[str]:
        return next(row for row in self.rows if row and row[0] == first)


@pytest.fixture(scope="module")
def walk(flown: Results) -> Walk:
    return Walk(partial_page(flown))


def test_a_study_without_the_manoeuvre_has_no_section(results: Results) -> None:
    assert context(results) is None
    assert pictures(results) == []
    assert partial_page(results).strip() == ""


def test_the_section_is_well_formed_and_escapes_what_it_was_given(flown: Results, walk: Walk) -> None:
    assert walk.wrong == []
    assert walk.open == []
    page = partial_page(flown)
    assert HOSTILE not in page
    assert "Predicted at 5 m/s." in page
    assert "&lt;b&gt;bold&lt;/b&gt; &amp; {{ 7 * 7 }}" in page


def test_every_row_has_as_many_cells_as_its_head(walk: Walk) -> None:
    heads = [
        i for i, row in enumerate(walk.rows) if row[0] in ("From", "Measure", "Outcome", "Predicted quality", "Pilot", "Assumed")
    ]
    for begin, end in zip(heads, [*heads[1:], len(walk.rows)], strict=True):
        assert {len(row) for row in walk.rows[begin:end]} == {len(walk.rows[begin])}


def test_shares_stand_with_their_intervals_and_the_number_of_runs(walk: Walk) -> None:
    assert walk.row("10 m/s") == [
        "10 m/s", "125 m", "adequate", "0.6 %", "0.5 to 1.7 %", "90.0 %", "81.0 to 100.0 %", "9.4 %", "8.5 to 11.3 %", "0.0 %",
        "500",
    ]  # fmt: skip


def test_measures_are_in_the_units_of_the_field(walk: Walk) -> None:
    row = walk.row("Pitch attitude change")
    assert row[1:6] == ["deg", f"{0.25 * DEG:.3g}", f"{0.5 * DEG:.3g}", f"{0.15 * DEG:.3g}", "desired"]
    assert walk.row("Time to capture")[1:6] == ["s", "20", "30", "21.5", "adequate"]
    assert walk.row("Lateral track")[4:8] == ["0", "desired", "0 to 0", "0"]  # rounding of a symmetric aircraft
    assert walk.row("Height change")[6] == f"{0.85 * 0.7:.3g} to {1.2 * 0.7:.3g}"


def test_failures_and_cautions_are_words_with_their_number(walk: Walk) -> None:
    outcomes = [row for row in walk.rows if Status.NOT_CAPTURED.text in row]
    assert outcomes == [["undefined", Status.NOT_CAPTURED.text, "distance from it during the hold, time to capture", "7"]]
    assert ["caution: the value stands", Status.INCIDENCE_OUTSIDE.text, "all measures", "30"] in walk.rows


def test_predicted_qualities_and_performance_stand_side_by_side(flown: Results, walk: Walk) -> None:
    (run,) = context(flown)["runs"]  # type: ignore[index]
    assert [head["title"] for head in run["beside"]["measures"]] == [
        "Position, m", "Height, m", "Time, s", "Attitude, deg",
    ]  # fmt: skip
    assert run["beside"]["still"] == ["overshoot past the hover point", "lateral track", "heading change"]
    assert run["beside"]["chance"] == "0.1"
    assert walk.row("Damping ratio")[-4:] == ["0.12", "0.12", "−0.73", "0.12"]
    strong = [item["text"] for row in run["beside"]["rows"] for item in row["rho"] if item["strong"]]
    assert strong == ["−0.73"]
    assert len(run["beside"]["rows"]) == len(flown.responses)


def test_levels_by_performance_leave_out_what_no_run_has(walk: Walk) -> None:
    begin = next(i for i, row in enumerate(walk.rows) if row[:2] == ["Predicted quality", "Its Level"])
    assert walk.rows[begin + 1 : begin + 3] == [
        ["Worst of the three", "Level 1", "3", "150", "20", "0"],
        ["", "Level 2", "0", "300", "27", "0"],
    ]
    assert walk.rows[begin + 3][0] == "Measure"


def test_factors_are_ranked_and_a_constant_measure_says_so(flown: Results, walk: Walk) -> None:
    (run,) = context(flown)["runs"]  # type: ignore[index]
    time = next(row for row in run["factors"] if row["title"] == "Time to capture")
    assert [factor["ST"] for factor in time["factors"]] == ["0.6", "0.3", "0.2", "0.15"]
    row = next(row for row in walk.rows if row[0] == "Overshoot past the hover point" and len(row) == 3)
    assert row[1:] == ["undefined", "the response does not vary over the design"]


def test_undefined_nominal_values_are_words(flown: Results) -> None:
    summary = copy.deepcopy(dict(flown.summary))
    summary["deceleration"]["runs"][0]["responses"]["time"]["nominal"] = NAN
    summary["deceleration"]["runs"][0]["measure_performance"]["time"] = "not_adequate"
    row = Walk(partial_page(replace(flown, summary=summary))).row("Time to capture")
    assert row[4:6] == ["undefined", "not adequate"]


def test_two_pictures_a_speed(flown: Results) -> None:
    plans = pictures(flown)
    assert [(plan.name, plan.criterion, plan.wide) for plan in plans] == [
        ("deceleration_history_speed_10", "deceleration", False), ("deceleration_plane_speed_10", "deceleration", True),
    ]  # fmt: skip
    with style.paper():
        for plan in plans:
            assert isinstance(plan.draw(), Figure)


def test_missing_histories_are_named(flown: Results, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"deceleration_histories\.nc"):
        pictures(replace(flown, directory=tmp_path))


@pytest.mark.usefixtures("paper")
class TestFigures:
    def test_the_history_draws_every_run_the_command_and_the_moments(self) -> None:
        data = histories()
        top, attitude, height, near = draw_histories(data, TOLERANCES).axes
        for panel, wanted in (
            (top, data["V_lon"].values), (attitude, DEG * data["theta"].values), (height, data["altitude"].values - 30.0),
            (near, to_go(data)),
        ):  # fmt: skip
            drawn = {str(line.get_label()).split()[0]: line.get_ydata() for line in panel.lines}
            for label, values in zip(("nominal", "5", "median", "95", "worst"), wanted, strict=True):
                np.testing.assert_allclose(drawn[label], values, atol=1e-9)
        assert [line for line in top.lines if str(line.get_label()).startswith("command")]
        for panel in (top, attitude, height, near):
            upright = {
                line.get_xdata()[0] for line in panel.lines if len(line.get_xdata()) == 2 and len(set(line.get_xdata())) == 1
            }
            assert upright == {2.0, 27.5}

    def test_bands_are_the_tolerances_about_trim(self) -> None:
        _, attitude, height, near = draw_histories(histories(), TOLERANCES).axes
        for panel, name, scale, middle in ((attitude, "theta", DEG, -0.02 * DEG), (height, "height", 1.0, 0.0),
                                           (near, "position", 1.0, 0.0)):  # fmt: skip
            bands = [patch.get_bbox() for patch in panel.patches if isinstance(patch, Rectangle)]
            found = [(band.y0, band.y1) for band in bands]
            for standard, ends in zip(("adequate", "desired"), found, strict=True):
                half = scale * TOLERANCES[standard][name]
                assert ends == pytest.approx((middle - half, middle + half))

    def test_the_plane_is_flown_from_left_to_right_into_the_boxes(self) -> None:
        data = histories()
        whole, near = draw_plane(data, TOLERANCES, 0.1).axes
        for panel in (whole, near):
            left, right = panel.get_xlim()
            assert left > 0.0 > right
            np.testing.assert_allclose(panel.lines[0].get_xdata(), to_go(data)[0])
            boxes = [(p.get_x(), p.get_y(), p.get_width(), p.get_height()) for p in panel.patches if isinstance(p, Rectangle)]
            assert boxes == [pytest.approx((-1.0, -0.1, 2.0, 0.2)), pytest.approx((-0.5, -0.1, 1.0, 0.2))]
        assert whole.get_xlim()[0] == pytest.approx(float(data.attrs["distance"]))
        assert whole.get_xlim()[1] < to_go(data).min()
        assert near.get_ylim()[1] < 1.7  # a fast pass leaves the panel: the boxes must show

    def test_a_nominal_run_that_was_not_captured_or_did_not_fly_draws_without_a_mark(self) -> None:
        lost = histories(captured=False)
        for name in ("x_north", "V_lon", "V_lon_ref", "theta", "altitude"):
            lost[name].values[:] = NAN
        for data in (histories(captured=False), lost):
            for figure in (draw_histories(data, TOLERANCES), draw_plane(data, TOLERANCES, 0.1)):
                figure.draw(style.renderer(figure))
                assert "captured" not in [text.get_text() for panel in figure.axes for text in panel.texts]
