"""``levelone status`` and ``levelone export`` on folders of campaigns: finished, running, killed, damaged."""

from __future__ import annotations

import json
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
    return EvaluationStore.open(folder / "campaign.sqlite", *said)


def fill(store: EvaluationStore, n: int = N) -> int:
    """Keep n evaluations, and say how many timed out."""
    points = np.random.default_rng(4).random((n, 3)) * [1.0, 5.0, 0.1]
    failed = (points[:, 1] > 4.0) & (points[:, 2] < 0.04)
    code = np.where(failed, int(Status.TIMED_OUT), 0)[:, None]
    seconds = np.linspace(1.0, 3.0, n)
    none = np.zeros((n, 0), dtype=np.int64)
    store.add(points, Evaluations(np.where(code == 0, 1.0, np.nan), code, none, seconds, ("",) * n))
    return int(failed.sum())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    with opened(tmp_path) as store:
        fill(store)
    return tmp_path


def plan(folder: Path, **content: object) -> None:
    (folder / "campaign.json").write_text(json.dumps(content), encoding="utf-8")


class TestStatus:
    def test_says_what_is_done_what_failed_where_and_how_to_go_on(self, tmp_path: Path) -> None:
        folder = tmp_path
        with opened(folder) as store:
            lost = fill(store)
        plan(folder, planned=400, study="A quadrotor", hash="x", seed=1)
        said = invoke("status", folder)
        assert said.exit_code == 0
        assert "study: A quadrotor" in said.stderr
        assert "evaluations: 200, planned: 400 (50 %)" in said.stderr
        assert "an evaluation takes 2 s (median), 2.9 s (95 %)" in said.stderr
        assert "failures gather in the plane of gain and delay (p = 0.005)" in said.stderr
        assert "failures lie high in gain" in said.stderr
        assert "failures lie low in delay" in said.stderr
        assert f"levelone run STUDY.toml --out {folder} --resume" in said.stderr
        rows = [line.split() for line in said.stdout.splitlines() if line.strip()]
        failed = next(row for row in rows if row[:2] == ["timed", "out"])
        whole = next(row for row in rows if row[:2] == ["every", "response"])
        assert (int(failed[-1]), int(whole[-1])) == (lost, N - lost)

    def test_while_it_runs_nobody_is_told_to_start_it_again(self, tmp_path: Path) -> None:
        plan(tmp_path, planned=400)
        with opened(tmp_path) as store:
            fill(store)
            said = invoke("status", tmp_path)
        assert said.exit_code == 0
        assert "running this campaign now" in said.stderr
        assert "--resume" not in said.stderr

    def test_a_whole_campaign_needs_no_resuming(self, folder: Path) -> None:
        plan(folder, planned=N)
        said = invoke("status", folder).stderr
        assert "evaluations: 200, planned: 200 (100 %)" in said
        assert "--resume" not in said

    def test_more_than_planned_and_no_plan_are_numbers_without_a_share(self, folder: Path) -> None:
        assert "evaluations: 200\n" in invoke("status", folder).stderr
        plan(folder, planned=50)
        assert "evaluations: 200, planned: 50\n" in invoke("status", folder).stderr

    def test_before_the_first_evaluation(self, tmp_path: Path) -> None:
        opened(tmp_path).close()
        plan(tmp_path, planned=7)
        said = invoke("status", tmp_path)
        assert said.exit_code == 0
        assert "evaluations: 0, planned: 7\n" in said.stderr
        assert said.stdout == ""

    def test_other_models_are_named_and_can_be_asked_for(self, folder: Path) -> None:
        with opened(folder, 2) as store:
            fill(store, 20)
        said = invoke("status", folder).stderr
        assert "evaluations: 20\n" in said
        other = said.split("evaluations of ")[1].split(" ")[0]
        assert "evaluations: 200\n" in invoke("status", folder, "--model", other).stderr

    @pytest.mark.parametrize("text", ["{", "[]", '{"planned": "many"}', '{"planned": null}', "[" * 100_000])
    def test_a_damaged_plan_is_one_line(self, folder: Path, text: str) -> None:
        (folder / "campaign.json").write_text(text)
        said = invoke("status", folder)
        assert said.exit_code == 2
        assert said.stderr.startswith(f"error: {folder / 'campaign.json'}: is damaged")
        assert len(said.stderr.splitlines()) == 1

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
