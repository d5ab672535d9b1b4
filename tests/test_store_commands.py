"""``levelone status`` and ``levelone export`` on folders of campaigns: finished, running, killed, damaged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner, Result

from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.models.protocol import Evaluations
from levelone.console import Commands
from levelone.status import Status
from levelone.store_commands import export, status

N = 200
RUNNER = CliRunner()


def invoke(*arguments: object) -> Result:
    app = typer.Typer(cls=Commands)
    app.command()(status)
    app.command()(export)
    return RUNNER.invoke(app, [str(each) for each in arguments])


def opened(folder: Path, version: int = 1) -> EvaluationStore:
    said = ({"version": version}, ("zeta",), ("1",), (), ("mass", "gain", "delay"), "study-hash")
    return EvaluationStore.open(folder / "campaign.sqlite", *said, study_title="A quadrotor")


def outcomes(said: Result) -> dict[str, int]:
    """The table of outcomes: name to number of evaluations."""
    rows = [line.split() for line in said.stdout.splitlines() if line.strip()]
    return {" ".join(row[:2]): int(row[-1]) for row in rows if row[-1].isdecimal()}


def fill(store: EvaluationStore, n: int = N) -> int:
    """Keep n evaluations, and say how many timed out."""
    at = points(n)
    failed = (at[:, 1] > 4.0) & (at[:, 2] < 0.04)
    code = np.where(failed, int(Status.TIMED_OUT), 0)[:, None]
    seconds = np.linspace(1.0, 3.0, n)
    none = np.zeros((n, 0), dtype=np.int64)
    store.add(at, Evaluations(np.where(code == 0, 1.0, np.nan), code, none, seconds, ("",) * n))
    return int(failed.sum())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    with opened(tmp_path) as store:
        fill(store)
    return tmp_path


def points(n: int) -> np.ndarray:
    return np.random.default_rng(4).random((n, 3)) * [1.0, 5.0, 0.1]


class TestStatus:
    def test_says_what_is_done_what_failed_where_and_how_to_go_on(self, tmp_path: Path) -> None:
        folder = tmp_path
        with opened(folder) as store:
            store.plan(points(401))
            lost = fill(store)
        said = invoke("status", folder)
        assert said.exit_code == 0
        assert "study: A quadrotor" in said.stderr
        assert "evaluations: 200, planned: 401 (49 %)" in said.stderr
        assert "an evaluation takes 2 s (median), 2.9 s (95 %)" in said.stderr
        assert "failures gather in the plane of gain and delay (p = 0.005)" in said.stderr
        assert "failures lie high in gain" in said.stderr
        assert "failures lie low in delay" in said.stderr
        assert f"levelone run STUDY.toml --out {folder} --resume" in said.stderr
        assert outcomes(said) == {"timed out": lost, "every response": N - lost}

    def test_while_it_runs_nobody_is_told_to_start_it_again(self, tmp_path: Path) -> None:
        with opened(tmp_path) as store:
            store.plan(points(400))
            fill(store)
            said = invoke("status", tmp_path)
        assert said.exit_code == 0
        assert "running this campaign now" in said.stderr
        assert "--resume" not in said.stderr

    def test_a_whole_campaign_needs_no_resuming(self, folder: Path) -> None:
        with opened(folder) as store:
            store.plan(points(N))
        said = invoke("status", folder).stderr
        assert "evaluations: 200, planned: 200 (100 %)" in said
        assert "--resume" not in said

    def test_what_other_studies_left_is_not_counted(self, folder: Path) -> None:
        with opened(folder) as store:
            store.plan(np.vstack([points(50), 2.0 + points(N)]))
        said = invoke("status", folder)
        assert "evaluations: 50, planned: 250 (20 %)" in said.stderr
        assert sum(outcomes(said).values()) == 50
        assert "--resume" in said.stderr

    def test_one_that_is_missing_is_not_all_of_them(self, folder: Path) -> None:
        with opened(folder) as store:
            store.plan(points(N + 1))
        assert "evaluations: 200, planned: 201 (99 %)" in invoke("status", folder).stderr

    def test_without_a_plan_there_is_a_number_alone(self, folder: Path) -> None:
        said = invoke("status", folder).stderr
        assert "evaluations: 200 (of all studies)\n" in said
        assert "planned" not in said
        assert "--resume" not in said

    def test_before_the_first_evaluation(self, tmp_path: Path) -> None:
        with opened(tmp_path) as store:
            store.plan(points(7))
        said = invoke("status", tmp_path)
        assert said.exit_code == 0
        assert "evaluations: 0, planned: 7\n" in said.stderr
        assert said.stdout == ""

    def test_a_model_that_was_changed_begins_at_zero(self, folder: Path) -> None:
        with opened(folder, 2) as store:
            store.plan(points(7))
        said = invoke("status", folder)
        assert "evaluations: 0, planned: 7\n" in said.stderr
        assert "of this model there is none yet; the store also holds evaluations of" in said.stderr
        assert said.stdout == ""

    def test_other_models_are_named_and_can_be_asked_for(self, folder: Path) -> None:
        with opened(folder, 2) as store:
            store.plan(points(20))
            fill(store, 20)
        said = invoke("status", folder).stderr
        assert "evaluations: 20, planned: 20 (100 %)\n" in said
        other = said.split("evaluations of ")[1].split(" ")[0]
        assert "evaluations: 200 (of all studies)\n" in invoke("status", folder, "--model", other).stderr

    def test_a_folder_without_a_campaign(self, tmp_path: Path) -> None:
        for place in (tmp_path, tmp_path / "none"):
            said = invoke("status", place)
            assert said.exit_code == 2
            assert said.stderr.startswith(f"error: DIR: {place}")
        assert list(tmp_path.iterdir()) == []


class TestExport:
    def test_writes_one_row_an_evaluation_and_says_so(self, folder: Path) -> None:
        said = invoke("export", folder, folder / "runs.csv")
        assert said.exit_code == 0
        assert "200 evaluations of model" in said.stderr
        assert len((folder / "runs.csv").read_text(encoding="utf-8").splitlines()) == N + 1

    def test_writes_over_nothing_unless_told(self, folder: Path) -> None:
        target = folder / "runs.csv"
        target.write_text("mine")
        said = invoke("export", folder, target)
        assert said.exit_code == 2
        assert "--force" in said.stderr
        assert target.read_text() == "mine"
        assert invoke("export", folder, target, "--force").exit_code == 0
        assert target.read_text(encoding="utf-8").startswith("mass,")

    def test_a_wrong_ending_names_the_closest(self, folder: Path) -> None:
        said = invoke("export", folder, folder / "runs.cvs")
        assert said.exit_code == 2
        assert "did you mean '.csv'?" in said.stderr
