from __future__ import annotations

import csv
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import levelone
from levelone.cli import app
from levelone.config.vehicle_file import library
from levelone.console import numbers, stage_bars
from levelone.errors import InputError

STUDY = Path(__file__).parents[1] / "studies" / "reference" / "study.toml"
COMMANDS = (
    "run",
    "check",
    "status",
    "export",
    "assess",
    "compare",
    "decompose",
    "experiments",
    "calibrate",
    "report",
    "trim",
    "simulate",
    "linearize",
    "derivatives",
    "dakota",
)


def call(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def refused(result) -> str:
    """The single line of a refusal: exit code 2, nothing on stdout, no traceback."""
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("error: ")
    return result.stderr


@pytest.fixture
def files(tmp_path):
    """Copies of the reference study and vehicle in one folder; returns a function that changes them and gives the study's path."""
    folder = tmp_path / "mine"
    folder.mkdir()
    source = library()["reference-evtol"]
    for name in (source.name, "reference-evtol-rotor.csv"):
        shutil.copy(source.parent / name, folder)
    text = STUDY.read_text(encoding="utf-8").replace('vehicle = "reference-evtol"', f'vehicle = "{source.name}"')
    (folder / "study.toml").write_text(text, encoding="utf-8")
    shutil.copy(STUDY.parent / "findings.toml", folder)

    def change(name="study.toml", old="", new=""):
        content = (folder / name).read_text(encoding="utf-8")
        assert old in content
        (folder / name).write_text(content.replace(old, new, 1), encoding="utf-8")
        return folder / "study.toml"

    return change


@pytest.fixture
def finished(monkeypatch):
    """Stand-ins for the study and the report, which keep what they were called with."""
    calls = []

    def run_study(study, out, *, seed, threads, progress):
        calls.append((study.name, out, seed, threads))
        for stage, total in (("morris", 3), ("monte carlo", 2)):
            for done in range(total + 1):
                progress(stage, done, total)
        (out / "results.json").write_text("{}")
        return out / "results.json"

    def render_report(out, *, workers):
        calls.append(("report", out))
        return out / "report.html"

    def compare(out):
        calls.append(("compare", out))
        return []

    monkeypatch.setattr("levelone.campaign.run_study", run_study)
    monkeypatch.setattr("levelone.campaign.compare.compare", compare)
    monkeypatch.setattr("levelone.report.render_report", render_report)
    return calls


VEHICLE, TABLE = "reference-evtol.toml", "reference-evtol-rotor.csv"
BAD = {
    "unknown factor": (
        "study.toml",
        'name = "C_Lalpha"',
        'name = "C_Lalfa"',
        r"factor\.C_Lalfa\.name: unknown name 'C_Lalfa'; did you mean 'C_Lalpha'\?",
    ),
    "wrong unit": ("study.toml", 'unit = "kg"', 'unit = "N"', r"factor\.M\.unit: unit 'N' does not fit, expected kg"),
    "range reversed": ("study.toml", "[-0.5, 0.5]", "[0.5, -0.5]", r"factor\.M\.range: range reversed or empty"),
    "NaN": ("study.toml", "value = 7.0", "value = nan", r"factor\.M\.value: is nan; input should be a finite number"),
    "unknown key": ("study.toml", "range =", "rnage =", r"factor\.M: unknown name 'rnage'; did you mean 'range'\?"),
    "not the vehicle's value": (
        "study.toml",
        "value = 7.0",
        "value = 7.2",
        r"factor\.M\.value: is 7\.2 kg, and the vehicle .* has 7 kg",
    ),
    "no such vehicle": ("study.toml", VEHICLE, "none.toml", r"none\.toml: no such file"),
    "missing table": (VEHICLE, TABLE, "none.csv", r"rotors\.table\.file: no such file"),
    "zero mass": (VEHICLE, "{ value = 7.0", "{ value = 0.0", r"mass\.mass: must be positive, got 0\.0"),
    "NaN in the table": (TABLE, "\n0.05,2,15,", "\n0.05,2,nan,", r"line \d+ holds a value that is not a finite number"),
    "rotor table exceeded": (
        "study.toml",
        "value = 5.0",
        "value = 22.0",
        r"trim_speed: airspeed 22 m/s exceeds the rotor table's 20 m/s",
    ),
    "no TOML": ("study.toml", "[study]", "[study", r"study\.toml: is not a TOML file"),
}


@pytest.mark.parametrize("fault", BAD)
def test_bad_input_ends_with_one_line_and_code_2_before_any_work(files, finished, tmp_path, fault):
    name, old, new, problem = BAD[fault]
    study = files(name, old, new)
    assert re.search(problem, refused(call("run", study, "--out", tmp_path / "out")))
    assert not (tmp_path / "out").exists()
    assert finished == []


def test_a_missing_study_is_refused(tmp_path):
    assert "none.toml: no such file" in refused(call("run", tmp_path / "none.toml"))


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_an_output_folder_that_cannot_be_is_refused_before_any_work(finished, tmp_path, place):
    (tmp_path / "file").write_text("mine")
    assert "--out: " in refused(call("run", STUDY, "--out", tmp_path / place))
    assert (tmp_path / "file").read_text() == "mine"
    assert finished == []


def test_run_calls_the_study_then_the_report(finished, tmp_path):
    done = call("run", STUDY, "--out", tmp_path / "out", "--seed", 7, "--threads", 1)
    assert done.exit_code == 0, done.output
    out = tmp_path / "out"
    assert finished == [("reference", out, 7, 1), ("compare", out), ("report", out)]
    assert str(tmp_path / "out" / "report.html") in done.stderr


def test_results_go_to_a_folder_of_the_studys_name_by_default(finished, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert call("run", STUDY).exit_code == 0
    assert finished[0] == ("reference", Path("results/reference"), None, None)
    assert (tmp_path / "results" / "reference" / "results.json").exists()


@pytest.mark.parametrize(
    ("error", "code", "text"), [(KeyboardInterrupt, 130, "interrupted"), (InputError("a", "b"), 2, "error: a: b")]
)
def test_ctrl_c_and_errors_inside_the_study_end_with_one_line(monkeypatch, finished, tmp_path, error, code, text):
    def run_study(*_, **__):
        raise error

    monkeypatch.setattr("levelone.campaign.run_study", run_study)
    monkeypatch.setattr("levelone.run_command.announce_compilation", lambda: None)
    done = call("run", STUDY, "--out", tmp_path / "out")
    assert done.exit_code == code
    assert done.stderr.strip().splitlines()[-1].startswith(text)
    assert "Traceback" not in done.output
    assert finished == []


def test_an_interrupted_campaign_says_once_how_to_go_on(monkeypatch, tmp_path):
    from levelone.campaign.evaluate import CampaignInterrupted

    def run_model_study(*_, **__):
        raise CampaignInterrupted(3, 10)

    monkeypatch.setattr("levelone.campaign.model_study.run_model_study", run_model_study)
    done = call("run", STUDY.parents[1] / "own-model" / "study.toml", "--out", tmp_path / "out")
    assert done.exit_code == 130
    assert done.stderr.strip().splitlines()[-1].startswith("interrupted after 3 of 10 evaluations; those are kept")


def test_report_needs_the_folder_of_a_finished_study(tmp_path):
    assert "results" in refused(call("report", tmp_path))


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("trim", "reference-evto"), "did you mean 'reference-evtol'?"),
        (("trim", "reference-evtol", "--speed", "0:15"), "--speed: '0:15' is no list"),
        (("trim", "reference-evtol", "--speed", "5,25"), "airspeed 25 m/s exceeds the rotor table's 20 m/s"),
        (("simulate", "reference-evtol", "--mode", "rate"), "'V_lon' cannot be commanded in mode 'rate'"),
        (("simulate", "reference-evtol", "--amplitude", "nan"), "manoeuvre.amplitude: is nan, must be finite"),
        (("simulate", "reference-evtol", "--duration", "0.5"), "manoeuvre.duration: 0.5 s ends before the input"),
        (("linearize", "reference-evtol", "--omega", "0:nan:3"), "--omega: '0:nan:3' is no list"),
        (("linearize", "reference-evtol", "--omega", "900", "--csv", "x.csv"), "900 rad/s reaches the Nyquist frequency"),
        (("linearize", "reference-evtol", "--input", "V_lo"), "--input: unknown name 'V_lo'; did you mean 'V_lon'?"),
        (("linearize", "reference-evtol", "--speed", "19"), "--speed: no trim found"),
    ],
)
def test_bad_options_end_with_one_line_and_code_2(arguments, problem, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("levelone.cli.announce_compilation", lambda: None)
    assert problem in refused(call(*arguments))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["trim", "simulate", "linearize"])
def test_a_csv_file_that_cannot_be_is_refused(command, tmp_path, monkeypatch):
    monkeypatch.setattr("levelone.cli.announce_compilation", lambda: None)
    assert "--csv: cannot write" in refused(call(command, "reference-evtol", "--csv", tmp_path))
    assert "--csv: cannot write" in refused(call(command, "reference-evtol", "--csv", tmp_path / "none" / "x.csv"))
    assert list(tmp_path.iterdir()) == []


def columns_of(path):
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


def test_trim_writes_one_row_for_each_speed(tmp_path):
    path = tmp_path / "trim.csv"
    assert call("trim", "reference-evtol", "--speed", "0:10:3", "--climb", 0.5, "--csv", path).exit_code == 0
    written = columns_of(path)
    assert [float(v) for v in written["speed[m/s]"]] == [0.0, 5.0, 10.0]
    expected = levelone.trim(levelone.load_vehicle("reference-evtol"), 5.0, 0.5)
    assert float(written["theta[rad]"][1]) == expected.attitude[0, 0]
    assert [float(written[f"throttle_{i + 1}"][1]) for i in range(8)] == expected.throttle[0].tolist()
    assert max(abs(float(v)) for name, column in written.items() if name.startswith("residual") for v in column) < 1e-9
    assert written["status"] == ["ok"] * 3


def test_a_failed_trim_is_nan_and_says_why(tmp_path):
    path = tmp_path / "trim.csv"
    assert call("trim", "reference-evtol", "--speed", "5,19", "--csv", path).exit_code == 0
    written = columns_of(path)
    assert written["theta[rad]"][1] == written["throttle_1"][1] == "nan"
    assert abs(float(written["residual_Z"][1])) > 1e-9 or abs(float(written["residual_M"][1])) > 1e-9
    assert written["status"][1].startswith("no trim found")


def test_simulation_as_csv_gives_the_metrics_of_the_simulation(tmp_path):
    path = tmp_path / "record.csv"
    assert call("simulate", "reference-evtol", "--amplitude", 0.8, "--duration", 6, "--csv", path).exit_code == 0
    vehicle = levelone.load_vehicle("reference-evtol")
    direct = levelone.simulate(vehicle, levelone.step("V_lon", 0.8, trim_speed=5.0, duration=6.0))
    recorded = levelone.TimeHistory.from_csv(path)
    np.testing.assert_array_equal(recorded.channels["q"], direct.channels["q"])
    assert levelone.attitude_quickness(recorded).quickness == levelone.attitude_quickness(direct).quickness


def test_linearize_writes_the_response_of_the_linear_model(tmp_path):
    path = tmp_path / "response.csv"
    assert call("linearize", "reference-evtol", "--omega", "1,4,9", "--csv", path).exit_code == 0
    written = {name: np.array(column, dtype=float) for name, column in columns_of(path).items()}
    model = levelone.linearize(levelone.load_vehicle("reference-evtol"), 5.0)
    expected = model.frequency_response("V_lon", "q", np.array([1.0, 4.0, 9.0])).value[0]
    np.testing.assert_array_equal(written["real"] + 1j * written["imag"], expected)
    np.testing.assert_allclose(
        10 ** (written["gain[dB]"] / 20) * np.exp(1j * np.radians(written["phase[deg]"])), expected, rtol=1e-12
    )


def test_tables_show_status_units_and_the_dominant_pole():
    trimmed = call("trim", "reference-evtol", "--speed", "0,5,19")
    assert trimmed.exit_code == 0
    rows = trimmed.stdout.splitlines()
    assert sum(" ok" in row for row in rows) == 2
    assert any("nan" in row and "no trim found" in row for row in rows)
    flown = call("simulate", "reference-evtol", "--shape", "pulse", "--amplitude", 0.7, "--duration", 6)
    assert flown.exit_code == 0
    assert {"zeta", "omega_n", "Level"} <= set(flown.stdout.split())
    stepped = call("simulate", "reference-evtol", "--duration", 6)
    assert {"quickness", "delta_theta_min", "1/s", "deg"} <= set(stepped.stdout.split())
    climbing = call("simulate", "reference-evtol", "--axis", "V_vert", "--duration", 3)
    assert climbing.exit_code == 0
    poles = call("linearize", "reference-evtol")
    assert sum("dominates q/V_lon" in row for row in poles.stdout.splitlines()) == 1


@pytest.mark.parametrize(
    ("text", "expected"), [("5", [5.0]), ("0,2.5,-1", [0.0, 2.5, -1.0]), ("0:15:4", [0.0, 5.0, 10.0, 15.0]), ("1:0:2", [1.0, 0.0])]
)
def test_lists_of_numbers(text, expected):
    assert numbers(text, "--speed") == expected


@pytest.mark.parametrize("text", ["", ",", "a", "0:1", "0:1:1", "0:1:0", "0:1:x", "nan", "inf", "0:inf:3", "1;2", "1:2:3:4"])
def test_what_is_no_list_of_numbers_is_refused(text):
    with pytest.raises(InputError, match="is no list"):
        numbers(text, "--speed")


def test_each_stage_has_one_progress_bar(capsys):
    with stage_bars() as progress:
        for stage in ("morris", "monte carlo"):
            for done in range(4):
                progress(stage, done, 3)
    shown = capsys.readouterr().err
    assert shown.count("morris") == shown.count("monte carlo") == 1
    assert shown.count("3/3") == 2


def test_the_first_run_says_that_it_compiles(monkeypatch, tmp_path, capsys):
    from levelone.console import announce_compilation

    monkeypatch.setattr("levelone.compiled.cache_folder", lambda folders: str(tmp_path))
    announce_compilation()
    assert "compiling the kernels (first run only" in capsys.readouterr().err
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "kernel.nbc").touch()
    announce_compilation()
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("levelone.compiled.cache_folder", lambda folders: None)
    announce_compilation()
    assert "every run" in capsys.readouterr().err


def test_help_tells_a_newcomer_what_to_do_next():
    done = subprocess.run([sys.executable, "-m", "levelone.cli", "--help"], capture_output=True, text=True, check=True)
    shown = [line.split() for line in done.stdout.splitlines()]
    examples = [words for words in shown if words[:1] == ["levelone"]]
    assert {words[1] for words in examples} == {
        "trim",
        "simulate",
        "linearize",
        "run",
        "compare",
        "decompose",
        "calibrate",
        "derivatives",
        "check",
        "assess",
    }
    assert set(COMMANDS) <= {words[0] for words in shown if words}
    folder = next(words[0] for words in shown if words and words[0].endswith("library"))
    assert (Path(folder) / "reference-evtol.toml").is_file()


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command):
    done = call(command, "--help")
    assert done.exit_code == 0
    assert all(len(line) <= 110 for line in done.stdout.splitlines())


def test_version_is_printed():
    assert call("--version").stdout.strip() == f"levelone {levelone.__version__}"


def test_without_a_command_the_help_is_shown():
    assert "What to do next" in call().output
