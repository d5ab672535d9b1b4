"""Dakota really run: its indices and ours on identical points, failures among the runs, an interrupted run, other outcomes."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from dakota_cases import ISHIGAMI, MIXED, driver, exported, ishigami, needs_dakota

from levelone.campaign.dakota import execute
from levelone.campaign.dakota.execute import find_dakota, run_dakota
from levelone.campaign.dakota.hdf5 import read_hdf5
from levelone.campaign.dakota.importing import import_results, write_import
from levelone.campaign.dakota.printed import read_moat, read_sobol
from levelone.errors import InputError
from levelone.uncertainty import Discrete, Factor, FactorSpace, sobol, sobol_design

pytestmark = needs_dakota
REAL_DRIVER = f"""
import sys
from pathlib import Path
sys.path.insert(0, {str(Path(__file__).parent)!r})
import numpy as np
from dakota_cases import ISHIGAMI, ishigami
from levelone.campaign.dakota.drive import drive
from levelone.uncertainty import Responses

class Model:
    names = ("zeta", "tau_p")
    def evaluate(self, x):
        zeta = np.where(x[:, 1] > 0.0, np.nan, ishigami(x))
        return Responses.from_values(np.column_stack([zeta, x @ [100.0, 10.0, 1.0]]), self.names)

drive(ISHIGAMI, Model(), *map(Path, sys.argv[-2:]))
"""


def imported(path: Path, space=ISHIGAMI, policy="bound"):
    return import_results(path, space, policy, 1, 200).results


def column(block: dict, key: str) -> np.ndarray:
    return np.array([row[key] for row in block.values()])


@pytest.mark.oracle
def test_sobol_indices_equal_dakotas_on_its_own_points(tmp_path: Path) -> None:
    exported(tmp_path, direct_points=128)
    run_dakota(tmp_path / "direct.in")
    for name in ("direct.h5", "direct.dat"):
        found = imported(tmp_path / name)
        assert (found["layout"], found["runs"]) == ("sobol", 128 * 5)
        for row in found["responses"].values():
            for index in ("S1", "ST"):
                np.testing.assert_allclose(column(row["sobol"], index), column(row["dakota"], index), rtol=1e-9, atol=1e-12)


@pytest.mark.oracle
def test_indices_from_dakotas_runs_agree_with_our_own_within_their_intervals(tmp_path: Path) -> None:
    exported(tmp_path, direct_points=512)
    run_dakota(tmp_path / "direct.in")
    row = imported(tmp_path / "direct.h5")["responses"]["zeta"]["sobol"]
    design = sobol_design(ISHIGAMI, 512, 3)
    ours = sobol(design, ishigami(design.points), bootstrap=200)
    for index, ci in (("S1", ours.S1_ci), ("ST", ours.ST_ci)):
        theirs = column(row, f"{index}_ci")
        assert (np.maximum(ci[:, 0], theirs[:, 0]) <= np.minimum(ci[:, 1], theirs[:, 1])).all(), index
        assert np.abs(column(row, index) - getattr(ours, index)).max() < 0.15


@pytest.mark.oracle
def test_morris_indices_equal_what_psuade_prints(tmp_path: Path) -> None:
    exported(tmp_path, trajectories=100)
    run_dakota(tmp_path / "morris.in")
    found = imported(tmp_path / "morris.dat")
    assert (found["layout"], found["runs"]) == ("morris", 400)
    for row in found["responses"].values():
        scale = column(row["morris"], "mu_star").max()
        for index in ("mu_star", "sigma"):
            # psuade prints five digits
            np.testing.assert_allclose(column(row["morris"], index), column(row["dakota"], index), rtol=6e-5, atol=1e-12 * scale)
    # Over four levels sin x1 changes by sin(pi/3) in any step of 2/3, times 1 + 0.1 x3^4 with x3 at -pi, -pi/3, pi/3 or pi; psuade
    # favours trajectories at the ends of x3, and the result must say so.
    exact = 1.5 * np.sin(np.pi / 3.0) * (1.0 + 0.05 * (np.pi**4 + (np.pi / 3.0) ** 4))
    row = found["responses"]["zeta"]
    assert row["morris"]["x1"]["mu_star_ci"][0] > exact
    assert "no random draw" in row["status"]


@pytest.mark.oracle
def test_surfpack_on_imported_runs_gives_indices_near_the_true_ones(tmp_path: Path) -> None:
    exported(tmp_path, samples=120, surrogate_points=1024)
    run_dakota(tmp_path / "lhs.in")
    run_dakota(tmp_path / "surrogate.in")
    found = imported(tmp_path / "surrogate.h5")
    assert found["runs"] == 0
    # Saltelli et al., Global Sensitivity Analysis: The Primer, 2008, equation 4.34 with a = 7, b = 0.1
    np.testing.assert_allclose(column(found["responses"]["zeta"]["dakota"], "ST"), [0.5576, 0.4424, 0.2437], atol=0.06)
    text = read_sobol((tmp_path / "surrogate.out").read_text(), ISHIGAMI.names)
    binary = read_hdf5(tmp_path / "surrogate.h5", ISHIGAMI).printed
    for name in ("zeta", "tau_p"):
        np.testing.assert_allclose(text[name].first, binary[name].first, rtol=1e-5)
        np.testing.assert_allclose(text[name].second, binary[name].second, rtol=1e-5)


def test_surfpack_leaves_out_failed_runs_without_a_word(tmp_path: Path) -> None:
    exported(tmp_path, limit=2.5, samples=80)
    run_dakota(tmp_path / "lhs.in")
    run_dakota(tmp_path / "surrogate.in")
    with_failures = read_sobol((tmp_path / "surrogate.out").read_text(), ISHIGAMI.names)["zeta"]
    assert "80 reused points" in (tmp_path / "surrogate.out").read_text()
    lines = (tmp_path / "lhs.dat").read_text().splitlines(keepends=True)
    kept = [line for line in lines if " nan " not in line]
    assert len(kept) < len(lines)
    (tmp_path / "lhs.dat").write_text("".join(kept))
    run_dakota(tmp_path / "surrogate.in")
    without = read_sobol((tmp_path / "surrogate.out").read_text(), ISHIGAMI.names)["zeta"]
    np.testing.assert_array_equal(with_failures.second, without.second)


@pytest.mark.parametrize("form", ["json", "aprepro"])
def test_dakota_takes_our_results_for_each_format_of_parameters(tmp_path: Path, form: str) -> None:
    exported(tmp_path, samples=9)
    (tmp_path / "drive.py").write_text(REAL_DRIVER)
    text = (tmp_path / "lhs.in").read_text()
    line = next(line for line in text.splitlines() if "analysis_drivers" in line)
    text = text.replace(line, f'  analysis_drivers = "{sys.executable} {tmp_path / "drive.py"}"')
    text = text.replace("    fork\n", f"    fork\n      parameters_format {form}\n")
    (tmp_path / "lhs.in").write_text(text)
    run_dakota(tmp_path / "lhs.in")
    found = read_hdf5(tmp_path / "lhs.h5", ISHIGAMI)
    assert len(found.points) == 9
    expected = ishigami(found.points)
    expected[found.points[:, 1] > 0.0] = np.nan
    np.testing.assert_allclose(found.responses.column("zeta"), expected, rtol=1e-12)
    np.testing.assert_allclose(found.responses.column("tau_p"), found.points @ [100.0, 10.0, 1.0], rtol=1e-12)


def test_discrete_and_truncated_factors_go_through_all_files(tmp_path: Path) -> None:
    exported(tmp_path, MIXED, samples=60, direct_points=32)
    for name in ("lhs", "surrogate", "direct"):
        run_dakota(tmp_path / f"{name}.in")
    assert imported(tmp_path / "lhs.dat", MIXED)["layout"] == "sample"
    found = imported(tmp_path / "direct.dat", MIXED)
    assert found["layout"] == "sobol"
    row = found["responses"]["tau_p"]
    np.testing.assert_allclose(column(row["sobol"], "ST"), column(row["dakota"], "ST"), rtol=1e-9)
    assert set(imported(tmp_path / "surrogate.h5", MIXED)["responses"]) == {"zeta", "tau_p"}


def test_failed_runs_leave_dakota_without_indices_and_us_with_doubt_or_bounds(tmp_path: Path) -> None:
    """x2 above 2.8 fails: five per cent of the runs, in a corner."""
    exported(tmp_path, limit=2.8, direct_points=256, trajectories=20)
    for name in ("direct", "morris", "lhs"):
        run_dakota(tmp_path / f"{name}.in")
    found = imported(tmp_path / "direct.dat")
    row = found["responses"]["zeta"]
    assert row["failed"] == sum(row["failures"].values()) > 0
    assert "dakota" not in row
    assert row["used"] < 256
    assert np.isfinite(column(row["sobol"], "ST")).all()
    assert set(row["sobol_bounded"]) == {"low", "high"}
    assert np.isfinite(column(found["responses"]["tau_p"]["sobol"], "ST")).all()
    refused = imported(tmp_path / "direct.dat", policy="refuse")["responses"]["zeta"]
    assert np.isnan(column(refused["sobol"], "ST")).all()
    assert "policy is 'refuse'" in refused["status"]
    screened = imported(tmp_path / "morris.dat")["responses"]["zeta"]
    assert screened["failed"] > 0
    assert np.isnan(column(screened["dakota"], "mu_star")).all()
    assert np.isfinite(column(screened["morris"], "mu_star")).all()
    sample = imported(tmp_path / "lhs.dat", policy="drop")["responses"]["zeta"]
    assert sample["monte_carlo"]["failed"] == sample["failed"] > 0
    assert np.isfinite(column(sample["given_data"], "S1")).all()


def test_an_interrupted_run_goes_on_where_it_was(tmp_path: Path) -> None:
    """Killed between batches and restarted: the same file as that of a run that was not disturbed, and kept batches."""
    whole, halved = tmp_path / "whole", tmp_path / "halved"
    for folder, pause in ((whole, 0.0), (halved, 0.25)):
        folder.mkdir()
        exported(folder, pause=pause, direct_points=16)
        text = (folder / "direct.in").read_text()
        assert "batch size = 4096" in text
        (folder / "direct.in").write_text(text.replace("batch size = 4096", "batch size = 10"))
    run_dakota(whole / "direct.in")
    command = [str(find_dakota()), "-input", "direct.in"]
    with subprocess.Popen(command, cwd=halved, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        restart = halved / "direct.rst"
        while process.poll() is None and not (restart.exists() and restart.stat().st_size > 1500):
            time.sleep(0.02)
        process.kill()
    assert process.returncode != 0
    (halved / "direct-results.out").unlink(missing_ok=True)
    done = run_dakota(halved / "direct.in", options=("-read_restart", "direct.rst"))
    summary = next(line for line in (done.log + (halved / "direct.out").read_text()).splitlines() if "evaluation summary" in line)
    new, duplicates = (int(word) for word in summary.replace("(", "").split() if word.isdigit() and word != "80")
    assert new + duplicates == 80
    assert duplicates >= 10
    assert (halved / "direct.dat").read_text() == (whole / "direct.dat").read_text()
    assert imported(halved / "direct.h5") == imported(whole / "direct.h5")


def test_an_interrupted_file_is_not_taken_for_a_sample(tmp_path: Path) -> None:
    exported(tmp_path, direct_points=16)
    run_dakota(tmp_path / "direct.in")
    lines = (tmp_path / "direct.dat").read_text().splitlines(keepends=True)
    (tmp_path / "part.dat").write_text("".join(lines[:50]))
    found = imported(tmp_path / "part.dat")
    assert found["layout"] == "other"
    assert "coordinates repeat" in found["status"]
    assert all(set(row) == {"unit", "failed", "failures", "status"} for row in found["responses"].values())


def test_a_file_without_runs_is_refused(tmp_path: Path) -> None:
    """What a Dakota that was killed leaves: a header, and the rest after the last evaluation."""
    (tmp_path / "direct.dat").write_text("%eval_id interface x1 x2 x3 zeta\n")
    with pytest.raises(InputError, match="holds no run"):
        imported(tmp_path / "direct.dat")


def test_an_input_that_never_varies_leaves_the_statistics(tmp_path: Path) -> None:
    rows = "".join(f"{i} NO_ID {0.01 * i!r} {0.02 * i!r} 1.0 {0.1 * i!r}\n" for i in range(1, 41))
    fixed = FactorSpace([*ISHIGAMI.factors[:2], Factor("x3", Discrete((1.0, 2.0)))])
    (tmp_path / "runs.dat").write_text(f"%eval_id interface x1 x2 x3 zeta\n{rows}")
    row = imported(tmp_path / "runs.dat", fixed)["responses"]["zeta"]
    assert row["monte_carlo"]["mean"] == pytest.approx(2.05)
    assert "x3" in row["status"]
    assert "given_data" not in row


def test_files_of_an_import(tmp_path: Path) -> None:
    exported(tmp_path, limit=2.5)
    run_dakota(tmp_path / "lhs.in")
    done = import_results(tmp_path / "lhs.dat", ISHIGAMI, "drop", 1, 50)
    out = tmp_path / "out"
    out.mkdir()
    assert [path.name for path in write_import(done, out)] == ["lhs.json", "lhs.csv", "lhs.nc"]
    text = (out / "lhs.json").read_text()
    assert "null" not in text
    assert json.loads(text)["responses"]["tau_p"] == done.results["responses"]["tau_p"]
    rows = [line.split(",") for line in (out / "lhs.csv").read_text().splitlines()]
    assert rows[0] == ["x1", "x2", "x3", "zeta", "tau_p", "zeta_status", "tau_p_status"]
    assert {row[5] for row in rows[1:]} == {"ok", "model_failed"}
    with xr.open_dataset(out / "lhs.nc", engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["values"], done.imported.responses.values)
        np.testing.assert_array_equal(data["values"].sel(response="zeta"), [float(row[3]) for row in rows[1:]])


def test_a_driver_that_fails_ends_dakota_and_its_words_come_through(tmp_path: Path) -> None:
    exported(tmp_path)
    (tmp_path / "driver.py").write_text("raise SystemExit('no such study')")
    with pytest.raises(InputError, match=r"lhs\.in ended with exit code.*results file") as refused:
        run_dakota(tmp_path / "lhs.in")
    assert "lhs.log" in str(refused.value)
    assert "no such study" in (tmp_path / "lhs.log").read_text()


def test_without_dakota_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(execute.sys, "executable", str(tmp_path / "python"))
    with pytest.raises(InputError, match=r"pip install 'levelone\[dakota\]'"):
        find_dakota()


def test_no_tables_are_made_up() -> None:
    assert read_sobol("nothing\n", ISHIGAMI.names) == {}
    assert read_moat("nothing\n", ISHIGAMI.names, ["zeta"], ISHIGAMI.names) == {}
    with pytest.raises(InputError, match="1 tables"):
        read_moat(
            "*** MOAT Analysis ***\nInput   1 (mod. mean & std) =   1.0e+00   2.0e+00\n", ISHIGAMI.names, ["zeta"], ISHIGAMI.names
        )


def test_processor_time_counts_the_drivers(tmp_path: Path) -> None:
    exported(tmp_path)
    line = driver(tmp_path)
    (tmp_path / "driver.py").write_text(
        "import time\nend = time.process_time() + 1.0\nwhile time.process_time() < end: pass\n"
        + (tmp_path / "driver.py").read_text()
    )
    assert line in (tmp_path / "lhs.in").read_text()
    assert run_dakota(tmp_path / "lhs.in").cpu >= 1.0
