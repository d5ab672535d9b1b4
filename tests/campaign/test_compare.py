"""Verdicts of a results folder: what is written, which causes are named, and when a record of experiments no longer speaks."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from claim_cases import spread
from claim_examples import evidence, provenance, ranked, write_folder

from levelone.campaign.claims import causes
from levelone.campaign.claims.decision import Decision
from levelone.campaign.claims.record import Found, Record, Trial, read_record
from levelone.campaign.compare import compare, counts, in_one_line, left_out, take_along, verdict_columns
from levelone.config.study_file import Study
from levelone.errors import InputError

FINDINGS = """
[[claim]]
id = "quickness-median"
rule = "median of quickness within 10 % of 2.875 1/s"
calibrated = true
[[claim]]
id = "zeta-spread"
rule = "standard deviation of zeta between 0.01 and 0.06"
[[claim]]
id = "zeta-leading"
rule = "C_L0 and C_mq in top(6) of mu_star for zeta"
[[claim]]
id = "zeta-mass-total"
rule = "ST - S1 > 0.2 for M on zeta"
"""
NAMES = ("quickness-median", "zeta-spread", "zeta-leading", "zeta-mass-total")
GIVEN = evidence(
    values={"quickness": spread(2.9, 0.1), "zeta": spread(0.35, 0.03)},
    responses={"zeta": {"mu_star": ranked("I_y tau_d C_mq K_T M T_u C_L0")}, "omega_n": {"nominal": 5.6}},
)
DIFFERS = Decision("differs", "places in mu_star: C_L0 7, C_mq 3", gap=0.2)


def found(verdict: str, here: str = "x", gap: float = math.nan) -> Found:
    return Found(verdict=verdict, here=here, gap={"agrees": 0.0, "undecidable": math.nan}.get(verdict, gap))


def trial(name: str, leading: Found, median: str = "agrees", kind: Any = "cause") -> Trial:
    verdicts = {
        "quickness-median": found(median, gap=0.1), "zeta-spread": found("agrees"), "zeta-leading": leading,
        "zeta-mass-total": found("undecidable"),
    }  # fmt: skip
    return Trial(name=name, question="?", kind=kind, changes={"rotors.motor_lag": 0.1}, nominal={"omega_n": 5.6}, verdicts=verdicts)


def record(*trials: Trial, **change: Any) -> Record:
    given: dict[str, Any] = {
        **provenance(), "levelone": "0", "findings_sha256": "c" * 64, "targets": ["quickness-median"],
        "baseline": trial("as it is", found("differs", gap=0.2)), "experiments": list(trials), "explanations": [],
    }  # fmt: skip
    return Record.model_validate(given | change)


def cause(given: Record | None) -> str:
    summary = {"provenance": provenance(), "responses": {"omega_n": {"nominal": 5.6}}}
    return causes.cause_of("zeta-leading", DIFFERS, given, causes.outdated(given, summary))


def robust(given: Record) -> str:
    return causes.robustness("zeta-leading", DIFFERS, given, "")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_folder(tmp_path / "results", GIVEN, FINDINGS)


def test_verdicts_are_returned_and_written(folder: Path) -> None:
    verdicts = compare(folder)
    assert [(each.id, each.verdict) for each in verdicts] == list(
        zip(NAMES, ("agrees", "agrees", "differs", "undecidable"), strict=True)
    )
    text = (folder / "comparison.json").read_text()
    assert "null" not in text
    written = json.loads(text)
    assert [list(each)[:5] for each in written] == [["id", "rule", "here", "verdict", "cause"]] * 4
    assert [each["here"] for each in written] == [each.here for each in verdicts]
    assert written[0]["numbers"]["median"] == pytest.approx(2.9, abs=0.11)
    assert written[3]["cause"] == "the rule was changed"
    assert [each["calibrated"] for each in written] == [True, False, False, False]


def test_calibrated_claims_are_shown_but_not_counted(folder: Path) -> None:
    verdicts = compare(folder)
    assert counts(verdicts) == {"agrees": 1, "differs": 1, "undecidable": 1}
    line = in_one_line(verdicts)
    assert line.startswith("1 agrees, 1 differs, 1 undecidable; not counted, since calibrated: quickness-median (agrees)")
    assert verdict_columns(verdicts)["verdict"] == ["(agrees)", "agrees", "differs", "undecidable"]


def test_the_console_marks_what_hangs_on_the_calibration(folder: Path) -> None:
    assert verdict_columns(compare(folder))["calibrations"] == [""] * 4
    starts = [trial(name, found(verdict), kind="calibration") for name, verdict in (("a", "differs"), ("b", "agrees"))]
    (folder / "experiments.json").write_text(json.dumps(record(*starts).model_dump()))
    assert verdict_columns(compare(folder))["calibrations"] == ["2 of 2", "2 of 2", "1 of 2", "2 of 2"]


def test_claims_that_the_findings_leave_out_are_named(folder: Path) -> None:
    verdicts = compare(folder)
    assert len(left_out(verdicts)) == 30
    assert "omega-n-nominal" in in_one_line(verdicts)


def test_without_experiments_a_difference_has_no_cause_yet(folder: Path) -> None:
    verdicts = {each.id: each for each in compare(folder)}
    assert verdicts["zeta-leading"].cause == causes.NOT_RECORDED
    assert verdicts["zeta-spread"].cause == ""


def test_a_record_beside_the_results_names_the_cause(folder: Path) -> None:
    (folder / "experiments.json").write_text(json.dumps(record(trial("thrust linear", found("agrees", "C_L0 6"))).model_dump()))
    verdicts = {each.id: each for each in compare(folder)}
    assert verdicts["zeta-leading"].cause == "flipped by 1 of 1 experiments: 'thrust linear' (C_L0 6)"
    assert verdicts["zeta-leading"].robust == "no calibrations are recorded"


def test_the_flips_that_keep_the_targets_come_first_and_three_are_named() -> None:
    flips = [trial("a", found("agrees", "1"), median="differs"), *(trial(name, found("agrees", "2")) for name in "bcde")]
    text = cause(record(*flips, trial("f", found("differs", gap=0.1))))
    assert text == "flipped by 5 of 6 experiments: 'b' (2); 'c' (2); 'd' (2); and 2 more"
    assert "'a' (1; misses the target quickness-median)" in cause(record(*flips[:1]))


def test_where_none_flips_the_nearest_is_named() -> None:
    near, far = trial("near", found("differs", "C_L0 7", gap=0.1)), trial("far", found("differs", "C_L0 9", gap=0.15))
    assert cause(record(far, near)) == "none of the 2 experiments tried flips it; nearest: 'near' (C_L0 7)"
    assert (
        cause(record(trial("worse", found("differs", gap=0.3)))) == "none of the 1 experiments tried flips it, or brings it nearer"
    )
    assert cause(record(trial("lost", found("undecidable")))) == "none of the 1 experiments tried flips it"


def test_calibrations_are_no_causes_but_tell_what_is_robust() -> None:
    same = [trial(f"start {i}", found("differs", gap=0.1), kind="calibration") for i in range(3)]
    other = trial("start 4", found("agrees"), kind="calibration")
    assert cause(record(*same, other)) == "none of the 0 experiments tried flips it"
    assert robust(record(*same)) == "same in 3 of 3 calibrations"
    assert robust(record(*same, other)) == "same in 3 of 4 calibrations: depends on what the targets cannot identify"


def test_an_explanation_stands_before_its_numbers() -> None:
    told = [{"id": "zeta-leading", "text": "lift is lost in the table's slope", "experiment": "e"}]
    text = cause(record(trial("e", found("agrees", "C_L0 5")), explanations=told))
    assert text.startswith("lift is lost in the table's slope (experiment 'e': agrees, C_L0 5); flipped by 1 of 1")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"study_sha256": "d" * 64}, causes.OTHER_STUDY),
        ({"vehicle_sha256": "d" * 64}, causes.OTHER_STUDY),
        ({"seed": 6}, causes.OTHER_SEED),
        ({"baseline": trial("as it is", found("agrees"))}, causes.OTHER_VERDICT),
    ],
)
def test_a_record_of_something_else_names_no_cause(change: dict[str, Any], said: str) -> None:
    assert cause(record(trial("e", found("agrees")), **change)) == said


def test_a_record_of_another_version_of_the_model_names_no_cause() -> None:
    flip = record(trial("e", found("agrees")))
    for nominal, said in ((5.6 * (1.0 + 1e-9), ""), (5.6001, causes.OTHER_MODEL), (math.nan, causes.OTHER_MODEL)):
        summary = {"provenance": provenance(), "responses": {"omega_n": {"nominal": nominal}}}
        assert causes.outdated(flip, summary) == said


def test_a_file_that_is_no_record_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "experiments.json"
    assert read_record(path) is None
    path.write_text("{")
    with pytest.raises(InputError, match="not a JSON file"):
        read_record(path)
    path.write_text("{}")
    with pytest.raises(InputError, match="levelone: missing"):
        read_record(path)


def test_folders_that_cannot_be_compared(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not the folder of a finished study"):
        compare(tmp_path)
    summary = json.loads((folder / "results.json").read_text())
    (folder / "results.json").write_text(json.dumps({k: v for k, v in summary.items() if k != "findings"}))
    with pytest.raises(InputError, match="names no findings"):
        compare(folder)
    assert not (folder / "comparison.json").exists()


def test_findings_given_twice_are_refused(folder: Path) -> None:
    (folder / "findings.toml").write_text(FINDINGS + FINDINGS)
    with pytest.raises(InputError, match="quickness-median: is given more than once"):
        compare(folder)


def test_a_run_takes_findings_and_experiments_along(study: Study, tmp_path: Path) -> None:
    source, out = tmp_path / "study", tmp_path / "out"
    source.mkdir()
    out.mkdir()
    (source / "findings.toml").write_text(FINDINGS)
    (source / "experiments.json").write_text("{}")
    given = replace(study, path=source / "study.toml", findings=source / "findings.toml")
    assert take_along(given, out) == {"findings": "findings.toml"}
    assert (out / "findings.toml").read_text() == FINDINGS
    assert (out / "experiments.json").read_text() == "{}"
    assert take_along(replace(given, findings=None), out) == {}
    # results beside the study
    assert take_along(given, source) == {"findings": "findings.toml"}
    assert (source / "findings.toml").read_text() == FINDINGS
