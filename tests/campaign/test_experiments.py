"""The file of experiments, what it refuses, and a record that grows without running anything twice."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from claim_cases import spread
from claim_examples import evidence

from levelone.campaign import build_model, experiments
from levelone.campaign.claims import Evidence
from levelone.campaign.claims.evidence import load_evidence
from levelone.campaign.claims.judge import judge
from levelone.campaign.claims.record import read_record
from levelone.campaign.experiments import evaluate, run_experiments
from levelone.config.experiments_file import load_experiments, load_findings
from levelone.config.study_file import Study
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError

SHIPPED = Path(__file__).parents[2] / "studies" / "reference"
HEAD = f'study = "{(SHIPPED / "study.toml").as_posix()}"\n'
LAG = '[[experiment]]\nname = "lag"\nquestion = "Does it?"\nchanges = { "rotors.motor_lag" = 0.03 }\n'
GAIN = '[[experiment]]\nname = "gain"\nquestion = "Does it?"\nscale = { "controller.pitch" = 1.5 }\n'
TOLD = '[[explanation]]\nid = "zeta-spread"\ntext = "the lag damps"\nexperiment = "lag"\n'


class Flights:
    """Stands for the study on a vehicle: zeta spreads beyond its claim unless the motors lag. Counts what was asked of it."""

    def __init__(self) -> None:
        self.lags: list[float] = []

    def __call__(self, study: Study, seed: int, threads: int | None = None) -> Evidence:
        lag = study.vehicle.airframe.rotors.motor_lag
        self.lags.append(lag)
        return evidence(values={"zeta": spread(0.35, 0.03 if lag else 0.07)}, responses={"omega_n": {"nominal": 5.6 + lag}})


@pytest.fixture
def flights(monkeypatch: pytest.MonkeyPatch) -> Flights:
    made = Flights()
    monkeypatch.setattr(experiments, "evaluate", made)
    return made


def write(folder: Path, *parts: str, head: str = HEAD) -> Path:
    path = folder / "experiments.toml"
    path.write_text(head + "".join(parts))
    return path


def test_the_shipped_experiments_are_sound() -> None:
    plan = load_experiments(SHIPPED / "experiments.toml")
    assert {each.kind for each in plan.experiments} == {"cause", "calibration"}
    assert plan.findings == load_findings(SHIPPED / "findings.toml")
    nominal = plan.study.vehicle
    for each in plan.experiments:
        assert each.study.vehicle.airframe.mass == nominal.airframe.mass
        assert each.study.vehicle.controller.rate == nominal.controller.rate


def test_scale_multiplies_the_number_of_the_vehicles_file(tmp_path: Path) -> None:
    plan = load_experiments(write(tmp_path, GAIN))
    base = load_vehicle(plan.study.vehicle_path).controller.pitch
    assert plan.experiments[0].study.vehicle.controller.pitch == pytest.approx(1.5 * base)
    assert plan.experiments[0].changes == {"controller.pitch": 1.5 * base}


def test_a_record_holds_every_verdict_on_every_vehicle(tmp_path: Path, flights: Flights) -> None:
    path = run_experiments(write(tmp_path, LAG, GAIN, TOLD))
    assert path == tmp_path / "experiments.json"
    content = json.loads(path.read_text())
    assert "null" not in path.read_text()
    assert {"study_sha256", "vehicle_sha256", "seed", "baseline", "experiments"} <= set(content)
    assert content["baseline"]["verdicts"]["zeta-spread"]["verdict"] == "differs"
    lag, gain = content["experiments"]
    assert (lag["name"], lag["kind"], lag["changes"]) == ("lag", "cause", {"rotors.motor_lag": 0.03})
    assert lag["verdicts"]["zeta-spread"] == {"verdict": "agrees", "here": "standard deviation 0.03", "gap": 0.0}
    assert gain["verdicts"]["zeta-spread"]["verdict"] == "differs"
    assert lag["nominal"]["omega_n"] == pytest.approx(5.63)
    assert len(lag["verdicts"]) == 34
    assert content["explanations"][0]["text"] == "the lag damps"
    assert content["targets"] == ["quickness-median", "omega-n-nominal"]


def test_nothing_is_run_twice(tmp_path: Path, flights: Flights) -> None:
    path = write(tmp_path, LAG, GAIN)
    first = run_experiments(path).read_text()
    assert len(flights.lags) == 3
    assert run_experiments(path).read_text() == first
    assert len(flights.lags) == 3
    # another number, a new experiment, one left out
    run_experiments(write(tmp_path, LAG.replace("0.03", "0.04"), LAG.replace('"lag"', '"more"').replace("0.03", "0.05")))
    assert flights.lags[3:] == [0.04, 0.05]
    record = read_record(tmp_path / "experiments.json")
    assert [trial.name for trial in record.experiments] == ["lag", "more"]
    # another seed: everything anew
    run_experiments(path, seed=1)
    assert len(flights.lags) == 8


def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path: Path, flights: Flights, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(study: Study, seed: int, threads: int | None = None) -> Evidence:
        if len(flights.lags) == 2:
            raise KeyboardInterrupt
        return flights(study, seed)

    path = write(tmp_path, LAG, GAIN, TOLD.replace('"lag"', '"gain"'))
    monkeypatch.setattr(experiments, "evaluate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_experiments(path)
    part = read_record(tmp_path / "experiments.json")
    assert [trial.name for trial in part.experiments] == ["lag"]
    assert part.explanations == []  # waits for its experiment
    monkeypatch.setattr(experiments, "evaluate", flights)
    run_experiments(path)
    assert flights.lags == [0.0, 0.03, 0.0]
    whole = read_record(tmp_path / "experiments.json")
    assert [trial.name for trial in whole.experiments] == ["lag", "gain"]
    assert len(whole.explanations) == 1


def test_calibrations_are_tried_too(tmp_path: Path, flights: Flights) -> None:
    entries = [{"name": "start 1", "changes": {"controller.pitch": 7.0, "rotors.motor_lag": 0.01}, "cost": 0.1}]
    (tmp_path / "calibration.json").write_text(json.dumps(entries))
    record = read_record(run_experiments(write(tmp_path, LAG, head=HEAD + 'calibrations = "calibration.json"\n')))
    assert [(trial.name, trial.kind) for trial in record.experiments] == [("lag", "cause"), ("start 1", "calibration")]


def test_progress_counts_vehicles(tmp_path: Path, flights: Flights) -> None:
    seen: list[tuple[str, int, int]] = []
    run_experiments(write(tmp_path, LAG, GAIN), progress=lambda *each: seen.append(each))
    assert seen == [("experiments", done, 3) for done in range(4)]


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ((LAG.replace("rotors.motor_lag", "rotors.K_T"),), "experiment.lag.changes: set K_T to 0.03; the study varies it"),
        ((LAG.replace("rotors.motor_lag", "aerodynamics.C_lp"),), "set C_lp to 0.03; the study varies it"),
        ((LAG.replace("rotors.motor_lag", "rotors.motor_lab"),), "did you mean 'motor_lag'"),
        ((LAG.replace("motor_lag", "position"),), "experiment.lag.changes: .*cannot be changed"),
        ((GAIN.replace("controller.pitch", "controller.pitsh"),), "did you mean 'pitch'"),
        ((GAIN.replace("controller.pitch", "rotors.position"),), "no single number"),
        ((LAG, LAG), "experiment.lag: is given more than once"),
        ((LAG.partition("changes")[0],), "changes nothing"),
        ((LAG.replace('"lag"', f'"{"x" * 41}"'),), "at most 40"),
        ((LAG, TOLD.replace('"lag"', '"log"')), "explanation.zeta-spread.experiment: unknown name 'log'; did you mean 'lag'"),
        ((LAG, TOLD, TOLD), "explanation.zeta-spread: is given more than once"),
        ((LAG, TOLD.replace("text", "why")), "why"),
        ((), "experiment: missing"),
    ],
)
def test_faults_of_the_file_are_named(tmp_path: Path, parts: tuple[str, ...], said: str) -> None:
    with pytest.raises(InputError, match=said):
        load_experiments(write(tmp_path, *parts))


def test_an_experiment_may_change_where_runs_begin(tmp_path: Path) -> None:
    begin = '[[experiment]]\nname = "begin"\nquestion = "?"\nchanges = { "condition.start" = "design trim" }\n'
    plan = load_experiments(write(tmp_path, begin))
    assert (plan.study.start, plan.experiments[0].study.start) == ("own trim", "design trim")
    assert build_model(plan.experiments[0].study).start == "design trim"
    with pytest.raises(InputError, match=r"condition\.start: unknown name 'design trm'; did you mean 'design trim'"):
        load_experiments(write(tmp_path, begin.replace("design trim", "design trm")))


def test_a_study_without_findings_has_nothing_to_decide(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="names no findings"):
        load_experiments(write(tmp_path, LAG, head=HEAD.replace("reference/study.toml", "normal-mass/study.toml")))


def test_faulty_calibrations_are_named(tmp_path: Path) -> None:
    path = write(tmp_path, LAG, head=HEAD + 'calibrations = "calibration.json"\n')
    with pytest.raises(InputError, match="no such file"):
        load_experiments(path)
    for text, said in (("[", "not a JSON file"), ('[{"name": "a"}]', "changes: missing"), ("[]", "at least 1")):
        (tmp_path / "calibration.json").write_text(text)
        with pytest.raises(InputError, match=said):
            load_experiments(path)


@pytest.mark.parametrize(
    ("told", "said"),
    [
        (TOLD.replace("zeta-spread", "quickness-level"), "no difference to explain: the verdict is 'agrees'"),
        (TOLD.replace("zeta-spread", "zeta-skew"), "no finding has this name"),
    ],
)
def test_only_a_difference_can_be_explained(tmp_path: Path, flights: Flights, told: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        run_experiments(write(tmp_path, LAG, told))
    assert len(flights.lags) == 1  # known after the first vehicle
    assert not (tmp_path / "experiments.json").exists()


def test_a_vehicle_that_cannot_be_studied_is_refused_before_any_is(tmp_path: Path, flights: Flights) -> None:
    slow = '[[experiment]]\nname = "slow"\nquestion = "?"\nchanges = { "controller.rate" = 125.0 }\n'
    wing = '[[experiment]]\nname = "wing"\nquestion = "?"\nscale = { "aerodynamics.area" = 2.0 }\n'
    for text, said in ((slow, "experiment.slow: .*125.0 Hz"), (wing, "experiment.wing: .*no level trim")):
        with pytest.raises(InputError, match=said):
            run_experiments(write(tmp_path, LAG, text))
    assert flights.lags == []


def test_an_evaluation_decides_as_the_run_of_the_study_does(study: Study, folder: Path) -> None:
    """The same designs, seeds and numbers; sections are compared elsewhere."""
    plain = replace(study, cases=(), coupling=None, amplitudes=())
    stored, found = load_evidence(folder), evaluate(plain, study.seed, 2)
    np.testing.assert_array_equal(found.points, stored.points)
    np.testing.assert_array_equal(found.values, stored.values)
    for finding in load_findings(SHIPPED / "findings.toml"):
        # without_delay, cases and coupling are sections of their own
        if finding.id.startswith(("table", "coupling", "tau-p-spread")):
            continue
        here, there = judge(finding, found), judge(finding, stored)
        assert (here.verdict, here.here, here.reason) == (there.verdict, there.here, there.reason)
        assert dict(here.numbers) == pytest.approx(dict(there.numbers), rel=1e-9, nan_ok=True)


def test_an_evaluation_holds_every_section_that_claims_read(study: Study) -> None:
    few = replace(study, method=replace(study.method, samples=20, trajectories=2, base_points=64))
    found: Any = evaluate(replace(few, coupling=replace(few.coupling, trajectories=2)), study.seed, 2)
    undecided = [finding.id for finding in load_findings(SHIPPED / "findings.toml") if "no section" in judge(finding, found).reason]
    assert undecided == []
    assert [each["amplitude"] for each in found.summary["amplitudes"]] == [min(study.amplitudes)]


def test_the_example_of_the_documentation_can_be_read(tmp_path: Path) -> None:
    page = (SHIPPED.parents[1] / "docs" / "reference" / "comparison.md").read_text(encoding="utf-8")
    example = page.partition("```toml\n")[2].partition("```")[0]
    lines = [line for line in example.splitlines(keepends=True) if not line.startswith(("study =", "calibrations ="))]
    plan = load_experiments(write(tmp_path, *lines))
    assert [each.name for each in plan.experiments] == ["local rotor velocity", "rate gain 30 % higher"]
    assert plan.experiments[0].study.vehicle.airframe.rotors.local_velocity
    assert plan.explanations[0].experiment == "rate gain 30 % higher"


def test_the_documentation_names_every_key_of_the_record(tmp_path: Path, flights: Flights) -> None:
    page = (SHIPPED.parents[1] / "docs" / "reference" / "comparison.md").read_text(encoding="utf-8")
    content = json.loads(run_experiments(write(tmp_path, LAG, TOLD)).read_text())
    trial = content["experiments"][0]
    for key in (*content, *trial, *trial["verdicts"]["zeta-spread"]):
        assert f"`{key}`" in page, key
