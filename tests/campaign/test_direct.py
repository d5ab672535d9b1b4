"""Direct decomposition: short records read like whole ones, runs are kept and reused, and failures show."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from levelone.campaign import build_model
from levelone.campaign.brief import READ, BriefModel, brief_model, check_against_whole
from levelone.campaign.direct import FOLDER, Plan, decompose_study
from levelone.config.study_file import Study
from levelone.errors import InputError
from levelone.status import Status
from levelone.uncertainty import FactorSpace, Responses, latin_hypercube, sobol, sobol_design, stage_seed

SMALL = Plan(base_points=32, scramblings=4)


@pytest.fixture(scope="module")
def three(study: Study) -> Study:
    """The reference study with three factors."""
    kept = [study.space.index(name) for name in ("K_T", "I_y", "tau_d")]
    space = FactorSpace([study.space.factors[j] for j in kept])
    return replace(study, space=space, targets=tuple(study.targets[j] for j in kept), nominal=study.nominal[kept])


@pytest.fixture(scope="module")
def brief(study: Study) -> BriefModel:
    return brief_model(build_model(study, 2))


@pytest.fixture(scope="module")
def found(three: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("direct")
    decompose_study(three, out, SMALL)
    return out


def content(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "direct.json").read_text(encoding="utf-8"))


def lasting(folder: Path) -> dict[str, Any]:
    """What does not change from run to run."""
    return {key: value for key, value in content(folder).items() if key != "cost"}


def test_short_records_read_like_whole_ones(study: Study, brief: BriefModel) -> None:
    points = latin_hypercube(study.space, 48, 3).points
    whole, short = build_model(study, 2).evaluate(points), brief.evaluate(points, 2)
    assert brief.step.duration < 0.5 * study.quickness.duration
    assert short.names == READ
    for name in READ:
        np.testing.assert_array_equal(short.column(name), whole.column(name))


def test_a_record_too_short_is_flown_again(study: Study, brief: BriefModel) -> None:
    points = latin_hypercube(study.space, 6, 4).points
    cut = replace(brief, step=replace(brief.step, duration=1.4), pulse=replace(brief.pulse, duration=1.9), omega=brief.omega[:150])
    np.testing.assert_array_equal(cut.evaluate(points).values, brief.evaluate(points).values)
    assert check_against_whole(cut, points) == {"runs": 6, "largest_difference": 0.0, "statuses_differ": 0}


def test_chunks_and_threads_change_no_digit(study: Study, brief: BriefModel, monkeypatch: pytest.MonkeyPatch) -> None:
    points = latin_hypercube(study.space, 9, 5).points
    plain = brief.evaluate(points, 1)
    monkeypatch.setattr("levelone.campaign.brief.CHUNK", 4)
    np.testing.assert_array_equal(brief.evaluate(points, 2).values, plain.values)


def test_a_run_that_fails_is_nan_with_its_reason(study: Study, brief: BriefModel) -> None:
    points = np.array([study.nominal, study.nominal])
    points[1, study.space.index("M")] = 40.0
    values = brief.evaluate(points)
    assert np.isfinite(values.values[0]).all()
    assert np.isnan(values.values[1]).all()
    assert set(values.status[1].tolist()) == {int(Status.TRIM_FAILED)}


def test_indices_are_those_of_the_model_at_the_design(three: Study, found: Path) -> None:
    design = sobol_design(three.space, 8, stage_seed(three.seed, "direct"), scramblings=4)
    values = build_model(three, 2).evaluate(design.points)
    for name, entry in content(found)["responses"].items():
        expected = sobol(design, values.column(name))
        rows = [entry["sobol"][factor] for factor in three.space.names]
        np.testing.assert_allclose([row["ST"] for row in rows], expected.ST, rtol=1e-12)
        np.testing.assert_allclose([row["S1_ci"] for row in rows], expected.S1_ci, rtol=1e-12)
        assert (entry["failed"], entry["doubt"], entry["base_points_used"]) == (0, "", 32)
    assert content(found)["runs"] == design.runs == 160


def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Runs of each evaluation that is flown from now on."""
    flown: list[int] = []
    fly = BriefModel.evaluate

    def evaluate(self: BriefModel, points: np.ndarray, *rest: Any) -> Responses:
        flown.append(len(points))
        return fly(self, points, *rest)

    monkeypatch.setattr(BriefModel, "evaluate", evaluate)
    monkeypatch.setattr("levelone.campaign.direct.check_against_whole", lambda model, points: {})
    return flown


def test_an_interrupted_decomposition_goes_on(three: Study, found: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flown = counted(monkeypatch)
    whole = BriefModel.evaluate

    def interrupted(self: BriefModel, points: np.ndarray, *rest: Any) -> Responses:
        if len(flown) == 2:
            raise KeyboardInterrupt
        return whole(self, points, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(BriefModel, "evaluate", interrupted)
        with pytest.raises(KeyboardInterrupt):
            decompose_study(three, tmp_path, SMALL)
    assert not (tmp_path / "direct.json").exists()
    assert flown == [40, 40]
    decompose_study(three, tmp_path, SMALL)
    assert flown == [40] * 4
    assert content(tmp_path)["responses"] == content(found)["responses"]


def test_scramblings_are_added_until_intervals_are_narrow(three: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decompose_study(three, tmp_path, SMALL)
    flown = counted(monkeypatch)
    width = content(tmp_path)["widest"]
    decompose_study(three, tmp_path, replace(SMALL, until_width=0.6 * width, most_base_points=1000))
    reached = content(tmp_path)
    assert reached["widest"] <= 0.6 * width
    assert reached["base_points"] > 32
    assert sum(flown) == reached["runs"] - 160
    flown.clear()
    decompose_study(three, tmp_path, replace(SMALL, until_width=1e-6, most_base_points=reached["base_points"]))
    assert flown == []
    assert content(tmp_path)["widest"] > 1e-6


def test_a_response_without_indices_is_not_waited_for(three: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fly = BriefModel.evaluate

    def constant(self: BriefModel, points: np.ndarray, *rest: Any) -> Responses:
        r = fly(self, points, *rest)
        values, status = r.values.copy(), r.status.copy()
        values[:, 0] = 3.0
        values[:, 1], status[:, 1] = np.nan, Status.DIVERGED
        return Responses(values, status, r.names, r.units)

    monkeypatch.setattr(BriefModel, "evaluate", constant)
    decompose_study(three, tmp_path, replace(SMALL, until_width=100.0, most_base_points=2000))
    found = content(tmp_path)
    assert found["base_points"] == 64
    assert np.isfinite(found["widest"])
    assert found["against_whole_records"]["largest_difference"] == 0.0
    assert all(found["responses"][name]["doubt"] for name in READ[:2])


def test_runs_of_another_study_are_not_taken(three: Study, found: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decompose_study(three, tmp_path, SMALL)
    flown = counted(monkeypatch)
    decompose_study(three, tmp_path, SMALL, seed=three.seed + 1)
    assert flown == [40] * 4
    assert content(tmp_path)["responses"] != content(found)["responses"]


def test_a_damaged_file_of_runs_is_named(three: Study, tmp_path: Path) -> None:
    (tmp_path / FOLDER).mkdir()
    (tmp_path / FOLDER / "scrambling-000.nc").write_text("not a dataset")
    with pytest.raises(InputError, match=r"scrambling-000\.nc: cannot be read.*remove it"):
        decompose_study(three, tmp_path, SMALL)


def test_groups_and_pairs(three: Study, tmp_path: Path) -> None:
    decompose_study(three, tmp_path, replace(SMALL, groups={"vehicle": ["K_T", "I_y"]}, second_order=True))
    entry = content(tmp_path)["responses"]["tau_p"]
    assert set(entry["sobol"]) == {"vehicle", "tau_d"}
    assert [row["pair"] for row in entry["S2"]] == [["vehicle", "tau_d"]]
    assert entry["sobol"]["tau_d"]["ST"] > 0.4


def test_failed_runs_are_counted_and_doubted(three: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, study: Study) -> None:
    fly = BriefModel.evaluate

    def failing(self: BriefModel, points: np.ndarray, *rest: Any) -> Responses:
        r = fly(self, points, *rest)
        lost = points[:, 0] > np.quantile(three.space.transform(np.full((1, 3), 0.9))[:, 0], 0.5)
        values, status = r.values.copy(), r.status.copy()
        values[lost], status[lost] = np.nan, Status.DIVERGED
        return Responses(values, status, r.names, r.units)

    monkeypatch.setattr(BriefModel, "evaluate", failing)
    decompose_study(three, tmp_path, SMALL)
    entry = content(tmp_path)["responses"]["quickness"]
    assert entry["failed"] == sum(entry["failures"].values()) > 0
    assert entry["doubt"]
    assert set(entry["bounded"]) == {"low", "high"}
    decompose_study(replace(three, policy="refuse"), tmp_path, SMALL)
    entry = content(tmp_path)["responses"]["quickness"]
    assert "refused" in entry["status"]
    assert all(math.isnan(row["ST"]) for row in entry["sobol"].values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"scramblings": 3}, r"--scramblings: is 3; an interval needs 4 or more"),
        ({"base_points": 100}, r"--base-points: is 100; needs a power of two for each of 4 scramblings"),
        ({"until_width": 0.0}, r"--until-width: is 0\.0; a positive width"),
    ],
)
def test_a_plan_that_cannot_be_is_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        replace(SMALL, **change)


def test_an_unknown_factor_in_a_group_is_named(three: Study, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="K_T"):
        decompose_study(three, tmp_path, replace(SMALL, groups={"a": ["KT"]}))
    assert not (tmp_path / "direct").exists()
