"""The page of a study of a model of one's own: what was mapped, flown, read, assumed and lost is all on it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from levelone.campaign.model_records import programme_test, read_records, read_responses, results_of
from levelone.campaign.model_study import run_model_study
from levelone.campaign.models.readings import Spectral
from levelone.campaign.nominal_check import check_nominal
from levelone.config.model_study import load_model_study
from levelone.errors import InputError
from levelone.report import symbols
from levelone.report.model_study import is_model_study, namings, render_model_study
from levelone.report.results import read_summary

OWN = Path(__file__).parents[2] / "studies" / "own-model" / "study.toml"


@pytest.fixture(scope="module")
def study():
    given = load_model_study(OWN)
    few = replace(given.method, trajectories=2, samples=8, base_points=64, bootstrap=20)
    return replace(given, method=few, read=("zeta", "omega_bw"))


@pytest.fixture(scope="module")
def folder(study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("own")
    run_model_study(study, out)
    return out


def test_page_shows_model_tests_and_what_was_read(study, folder: Path) -> None:
    page = render_model_study(folder).read_text(encoding="utf-8")
    assert "pitch_axis:fly" in page
    for test in study.tests:
        assert f'<section id="{test.name}">' in page
    assert "Bandwidth of theta / delta_lon" in page
    assert "V_lon" not in page  # that of the built-in vehicle
    assert page.count("<figure") == len(list((folder / "figures").glob("*.png")))
    assert not re.search(r">\s*(None|nan|\{\})\s*<", page)
    assert is_model_study(folder)


def test_records_come_back_as_they_were_read(study, folder: Path) -> None:
    """The report draws from the folder what the check drew from memory."""
    check = check_nominal(study)
    summary = read_summary(folder, ["study"])
    tests = tuple(programme_test(each) for each in summary["study"]["tests"].values())
    assert tests == study.tests
    records = read_records(folder)
    assert {name: record.channels.keys() for name, record in records.items()} == {
        name: record.channels.keys() for name, record in check.histories.items()
    }
    for name, record in records.items():
        assert (record.channels["theta"] == check.histories[name].channels["theta"]).all()
    found = results_of(tests, records, read_responses(folder), study.boundaries)
    assert found.keys() == check.results.keys()
    assert float(found["free"].zeta[0]) == float(check.results["free"].zeta[0])
    assert isinstance(found["sweep"], Spectral)
    assert float(found["sweep"].reading.tau_p) == float(check.results["sweep"].reading.tau_p)


def test_responses_are_named_by_what_their_test_reads(folder: Path) -> None:
    summary = read_summary(folder, ["study"])
    with symbols.naming(namings(summary)):
        assert symbols.axis_label("omega_bw", "rad/s") == r"$\omega_{\mathrm{BW}}$, rad/s"
        assert symbols.title("omega_bw") == "Bandwidth of theta / delta_lon"
    assert symbols.title("omega_bw") == "Bandwidth of q / V_lon"


def test_a_response_of_one_test_among_several_names_the_test() -> None:
    made = symbols.Naming("Bandwidth of theta / delta_lon (slow)", "omega_bw", "slow")
    with symbols.naming({"omega_bw_slow": made}):
        assert symbols.mathtext("omega_bw_slow") == r"$\omega_{\mathrm{BW}}$ (slow)"
        assert symbols.html("omega_bw_slow") == "<i>ω</i><sub>BW</sub> (slow)"


def test_results_without_a_block_are_refused(folder: Path, tmp_path: Path) -> None:
    content = json.loads((folder / "results.json").read_text())
    del content["failure_map"]
    (tmp_path / "results.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="failure_map: missing"):
        render_model_study(tmp_path)
