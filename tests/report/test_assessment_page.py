"""The page of an assessment: one file, complete, escaped, the same whenever it is written."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from levelone.campaign.assessment import Request, assess
from levelone.campaign.assessment_compare import compare
from levelone.campaign.assessment_data import load_records
from levelone.config.column_mapping import parse_columns
from levelone.errors import InputError
from levelone.report import style
from levelone.report.assessment import MOST_RUNS, Shown, render_assessment
from levelone.report.assessment_bode import _thinned
from levelone.report.assessment_figures import _envelope, draw_run

HOSTILE = "<script>alert('x')</script> & $\\frac{1}{ {{ 7 * 7 }}"
COLUMNS = parse_columns("theta=theta[deg], q=q[deg/s], delta_lon=stick")


def written(folder: Path, name: str, kind: str = "pulse", zeta: float = 0.3, size: float = 0.3) -> Path:
    """A second order in closed form: rate of a decaying sine that a pulse sets off, and its integral; or a sweep of a pure gain."""
    time = np.arange(1200) * 0.01
    if kind == "sweep":
        stick = size * np.sin(0.5 * (time - 1.0) ** 2) * ((time >= 1.0) & (time < 11.0))
        theta, rate = stick, np.gradient(stick, time)
    else:
        stick = np.where((time >= 1.0) & ((time < 1.2) if kind == "pulse" else True), size, 0.0)
        root, since = 3.0 * np.sqrt(1.0 - zeta**2), np.maximum(time - 1.05, 0.0)
        rate = size * np.exp(-3.0 * zeta * since) * np.sin(root * since)
        theta = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.01)])
    path = folder / f"{name}.csv"
    table = np.column_stack([time, stick, np.degrees(rate), np.degrees(theta)])
    np.savetxt(path, table, delimiter=",", header="time,stick,q,theta", comments="")
    return path


def shown(paths: list[Path], reference: list[Path] | None = None, **options) -> Shown:
    loaded = load_records(paths, COLUMNS)
    found = assess([each.record for each in loaded], Request(**options))
    if reference is None:
        return Shown(found, loaded)
    others = load_records(reference, COLUMNS)
    flown = assess([each.record for each in others], Request(**options))
    return Shown(found, loaded, flown, others, compare(found, flown))


def rendered(folder: Path, *given, **options) -> str:
    path = render_assessment(folder, shown(*given, **options))
    assert path == folder / "assessment.html"
    return path.read_text(encoding="utf-8")


def text_of(page: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<svg.*?</svg>|<style>.*?</style>|<[^>]*>", " ", page, flags=re.DOTALL))


def drawn(page: str) -> list[str]:
    return re.findall(r'<figure id="([a-z_0-9]*)"', page)


def test_a_page_of_pulses_stands_alone(tmp_path):
    page = rendered(tmp_path, [written(tmp_path, "one"), written(tmp_path, "two", size=0.5)])
    assert drawn(page) == ["plane_quickness", "plane_stability", "run_1", "run_2"]
    assert [int(n) for n in re.findall(r"<b>Figure (\d+)\.", page)] == [1, 2, 3, 4]
    assert not re.search(r'(?:src|href)="(?!#)', re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL))
    assert list(tmp_path.glob("*.html")) == [tmp_path / "assessment.html"]
    text = text_of(page)
    for words in (
        "Dynamic stability",
        "Level 2 (unverified boundary)",
        "Bandwidth and phase delay: needs a frequency sweep.",
        "two.csv",
    ):
        assert words in text
    for anchor in re.findall(r'href="#([a-z]+)"', page):
        assert f'id="{anchor}"' in page


def test_a_page_of_sweeps_against_flight(tmp_path):
    page = rendered(tmp_path, [written(tmp_path, "sim", "sweep")], [written(tmp_path, "real", "sweep", size=0.2)])
    assert drawn(page) == ["mismatch", "responses", "sweeps_simulation", "sweeps_flight"]
    text = text_of(page)
    assert "nearly indistinguishable" in text
    assert "the phase never reaches -180 deg" in text
    assert "real (flight)" in text
    assert "40 of 40" in text
    assert "Unverified: formula and limits of J (confidence low:" in text


def test_a_page_of_sweeps_beyond_the_envelopes_says_so(tmp_path):
    paths = [[written(tmp_path, name, "sweep", size=size)] for name, size in (("sim", 0.3), ("real", 0.2))]
    page = rendered(tmp_path, *paths, omega_min=10.2, omega_max=12.0)
    assert "mismatch" not in drawn(page)
    text = text_of(page)
    assert "no frequency from 0.5 to 10 rad/s that both excite" in text
    assert "0 of 40" in text


def test_the_same_assessment_gives_the_same_bytes(tmp_path):
    given = shown([written(tmp_path, "one")])
    assert render_assessment(tmp_path, given).read_bytes() == render_assessment(tmp_path, given).read_bytes()


def test_names_of_files_and_columns_are_shown_as_they_are_and_do_nothing(tmp_path):
    path = written(tmp_path, "one").rename(tmp_path / f"{HOSTILE.replace('/', '!')}.csv")
    page = rendered(tmp_path, [path])
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    assert "{{ 7 * 7 }}" in page


def test_more_runs_than_are_drawn_are_said(tmp_path):
    paths = [written(tmp_path, f"run{k}", size=0.2 + 0.01 * k) for k in range(MOST_RUNS + 1)]
    made = shown(paths)
    assert len([each for each in made.assessment.readings if each.criterion == "dynamic_stability"]) == MOST_RUNS + 1
    text = text_of(render_assessment(tmp_path, made).read_text())
    assert f"The first {MOST_RUNS} of {MOST_RUNS + 1} are drawn." in text


def test_marks_lie_on_the_trace(tmp_path):
    made = shown([written(tmp_path, "one")]).assessment
    with style.paper():
        figure = draw_run(made.histories[0], made.readings, "pitch")
    history = made.histories[0]
    marks = [line for line in figure.axes[1].lines if line.get_marker() == "o"]
    assert len(marks) >= 3
    for line in marks:
        time, value = float(line.get_xdata()[0]), float(line.get_ydata()[0])
        trace = np.degrees(np.interp(time + history.input_on, history.time, history.change("q")[0]))
        assert value == pytest.approx(trace, abs=1e-9)


def test_a_long_trace_keeps_its_peaks():
    time = np.arange(20000) * 0.005
    values = np.sin(time)
    values[12345] = 9.0
    at, kept = _envelope(time, values)
    assert kept.max() == 9.0
    assert kept.size < 1600
    assert np.all(np.diff(at) > 0.0)


def test_thinned_frequencies_keep_both_ends():
    omega = np.linspace(0.4, 16.0, 2000)
    kept = _thinned(omega)
    assert (kept[0], kept[-1]) == (0, 1999)
    assert kept.size <= 160


def test_a_folder_that_cannot_be_written(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        render_assessment(tmp_path / "none", shown([written(tmp_path, "one")]))
