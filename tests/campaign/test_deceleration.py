"""Deceleration to hover on a small sample: what is measured, that it repeats itself, and that failures stay visible."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.stats import spearmanr

from levelone.campaign import BuiltinModel, build_model
from levelone.campaign.deceleration import DECOMPOSED, deceleration_section, group_name
from levelone.campaign.deceleration_flights import KEPT, PERFORMANCE_KEYS, THINNED, Flights, assess, fly
from levelone.campaign.models.builtin import Assessment
from levelone.campaign.store import write_groups, write_json
from levelone.config.study_file import Study
from levelone.config.study_sections import Deceleration
from levelone.errors import InputError
from levelone.handling.capture import MEASURES, Performance, Tolerances, capture, severity
from levelone.handling.history import TimeHistory
from levelone.handling.pilot import Pilot
from levelone.status import Status
from levelone.uncertainty import Design, FactorSpace, Uniform, latin_hypercube

PILOT = Pilot(gain=0.4, lead=1.0, delay=0.25, deceleration=0.8, reverse=1.0, distance=30.0)
DESIRED = Tolerances(overshoot=1.0, position=0.5, height=0.2, lateral=0.5, heading=0.1, time=15.0, theta=0.3)
ADEQUATE = Tolerances(overshoot=2.0, position=1.0, height=0.5, lateral=1.0, heading=0.2, time=18.0, theta=0.5)
GIVEN = Deceleration((5.0, 3.0), (30.0, 16.0), 25.0, 5.0, PILOT, DESIRED, ADEQUATE)
RUNS = 40


@pytest.fixture(scope="module")
def flown(study: Study) -> Study:
    assumed = (("deceleration.pilot.gain", "a guess"), ("coupling.factor.C_lp", "another"))
    return replace(study, deceleration=GIVEN, assumed=assumed)


@pytest.fixture(scope="module")
def model(flown: Study) -> BuiltinModel:
    return build_model(flown, threads=2)


@pytest.fixture(scope="module")
def sample(flown: Study) -> Design:
    return latin_hypercube(flown.space, RUNS, 5)


@pytest.fixture(scope="module")
def assessed(model: BuiltinModel, sample: Design) -> Assessment:
    return model.assess(sample.points)


@pytest.fixture(scope="module")
def section(flown: Study, model: BuiltinModel, sample: Design, assessed: Assessment) -> tuple[Any, Any]:
    return deceleration_section(flown, model, sample, assessed, flown.seed)


def equal(a: Flights, b: Flights) -> None:
    np.testing.assert_array_equal(a.measures.values, b.measures.values)
    np.testing.assert_array_equal(a.measures.status, b.measures.status)
    for name in ("performance", "verdicts", "severity", "times"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@pytest.mark.theory
@pytest.mark.parametrize("i", [0, 1])
def test_the_pilot_flies_to_the_point_of_his_speed(model: BuiltinModel, flown: Study, i: int) -> None:
    """The command follows from what was seen one delay ago: gain s near the point, a constant deceleration towards it beyond."""
    history = fly(model, GIVEN, i, model.batch(flown.nominal[None]))
    late, on = round(PILOT.delay / history.dt), round(1.0 / history.dt)
    seen = GIVEN.distances[i] - history.channels["x_north"][0] - PILOT.lead * history.channels["V_lon"][0]
    near = PILOT.deceleration / PILOT.gain**2
    beyond = np.sqrt(2.0 * PILOT.deceleration * np.maximum(seen - near / 2.0, 0.0))
    wanted = np.clip(np.where(seen < near, PILOT.gain * seen, beyond), -PILOT.reverse, GIVEN.speeds[i])[: -late or None]
    np.testing.assert_allclose(history.channels["V_lon_ref"][0, late:][on:], wanted[on:], rtol=0.0, atol=1e-9)


def test_the_pilot_commands_from_trim_within_his_limits(model: BuiltinModel, flown: Study) -> None:
    history = fly(model, GIVEN, 0, model.batch(flown.nominal[None]))
    command = history.channels["V_lon_ref"][0]
    assert command[0] == 5.0
    assert command.max() == 5.0
    assert -PILOT.reverse <= command.min() < 0.1


def test_a_symmetric_aircraft_neither_drifts_nor_turns(section: tuple[Any, Any]) -> None:
    block, _ = section
    for run in block["runs"]:
        for measure in ("lateral", "heading"):
            assert run["responses"][measure]["monte_carlo"]["max"] < 1e-9
            assert all(math.isnan(value) for value in run["rank_correlation"][measure].values())  # rounding has no rank


def test_every_block_is_there_and_nothing_is_null(section: tuple[Any, Any], flown: Study, tmp_path: Path) -> None:
    block, files = section
    write_json(tmp_path / "results.json", block)
    assert "null" not in (tmp_path / "results.json").read_text()
    assert json.loads((tmp_path / "results.json").read_text())["tolerances"]["adequate"]["time"] == 18.0
    assert block["assumed"] == [{"field": "deceleration.pilot.gain", "why": "a guess"}]
    assert set(files) == {"deceleration.nc", "deceleration_histories.nc"}
    for run in block["runs"]:
        assert set(run["responses"]) == set(MEASURES)
        for name, entry in run["responses"].items():
            assert ("sobol" in entry) == (name in DECOMPOSED)
            assert entry["unit"] == MEASURES[name]
            assert entry["monte_carlo"]["n"] == RUNS
        assert set(run["responses"]["time"]["sobol"]) == set(flown.space.names)


def test_shares_and_counts_add_up(section: tuple[Any, Any], assessed: Assessment) -> None:
    block, files = section
    for run in block["runs"]:
        codes = files["deceleration.nc"][run["group"]]["performance"].values
        for performance, key in PERFORMANCE_KEYS.items():
            entry = run["shares"][key]
            assert entry["runs"] == (codes == performance).sum()
            assert entry["share"] == entry["runs"] / RUNS
            assert entry["ci"][0] <= entry["share"] <= entry["ci"][1]
        for criterion, rows in run["levels"].items():
            assert sum(sum(counts.values()) for counts in rows.values()) == RUNS
            assert sum(rows["level_2"].values()) == (assessed.levels[criterion] == 2).sum()


def test_a_run_is_as_good_as_its_worst_measure(section: tuple[Any, Any]) -> None:
    _, files = section
    for data in files["deceleration.nc"].values():
        assert (data["measure_performance"].values > 0).all()
        np.testing.assert_array_equal(data["performance"].values, data["measure_performance"].values.max(axis=1))
        # what is at most one adequate tolerance in every measure is adequate, and nothing else is
        np.testing.assert_array_equal(data["severity"].values <= 1.0, data["performance"].values <= Performance.ADEQUATE)


@pytest.mark.oracle
def test_rank_correlations_are_those_of_scipy(section: tuple[Any, Any], assessed: Assessment) -> None:
    block, files = section
    run = block["runs"][0]
    measured = files["deceleration.nc"][run["group"]]["values"]
    for measure in ("time", "height", "theta"):
        for response in ("quickness", "zeta", "omega_bw"):
            wanted = spearmanr(measured.sel(measure=measure).values, assessed.responses.column(response)).statistic
            assert run["rank_correlation"][measure][response] == pytest.approx(wanted, abs=1e-12)
            assert run["rank_pairs"][measure][response] == RUNS
    assert math.isnan(run["rank_correlation"]["overshoot"]["zeta"])  # never past the point: nothing to rank


def test_neither_threads_nor_chunks_nor_neighbours_change_a_run(
    model: BuiltinModel, sample: Design, section: tuple[Any, Any]
) -> None:
    points = sample.points[:5]
    together = assess(model, GIVEN, 1, points)
    equal(together, assess(replace(model, threads=1), GIVEN, 1, points))
    stored = section[1]["deceleration.nc"][group_name(3.0)]
    np.testing.assert_array_equal(together.measures.values, stored["values"].values[:5])
    np.testing.assert_array_equal(together.severity, stored["severity"].values[:5])


def test_same_seed_same_section(flown: Study, model: BuiltinModel, sample: Design, assessed: Assessment, section: Any) -> None:
    few = replace(flown, deceleration=replace(GIVEN, speeds=(3.0,), distances=(16.0,)))
    first = deceleration_section(few, model, sample, assessed, 7)[0]
    again = deceleration_section(few, replace(model, threads=1), sample, assessed, 7)[0]
    assert json.dumps(first) == json.dumps(again)
    assert json.dumps(first["runs"][0]["shares"]) == json.dumps(section[0]["runs"][1]["shares"])


def test_kept_histories_are_those_of_their_runs(section: tuple[Any, Any], tmp_path: Path) -> None:
    _, files = section
    for name, groups in files.items():
        write_groups(tmp_path / name, groups)
    for group in ("speed_5", "speed_3"):
        with xr.open_dataset(tmp_path / "deceleration_histories.nc", group=group, engine="h5netcdf") as data:
            measured = files["deceleration.nc"][group]
            assert data["label"].values.tolist() == ["nominal", *KEPT]
            worst = int(data["sample"].values[-1])
            assert measured["severity"].values[worst] == measured["severity"].values.max()
            assert np.diff(data["time"].values) == pytest.approx(THINNED * 0.004)
            for run, index in enumerate(data["sample"].values[1:], 1):
                height = np.abs(data["altitude"].values[run] - data["altitude"].values[run, 0]).max()
                assert height == pytest.approx(float(measured["values"].sel(measure="height").values[index]), rel=1e-3)
                time = float(data["captured"].values[run] - data["start"].values[run])
                assert time == float(measured["values"].sel(measure="time").values[index])


def test_a_vehicle_too_heavy_to_fly_is_counted_not_hidden(flown: Study, model: BuiltinModel) -> None:
    points = np.tile(flown.nominal, (2, 1))
    points[1, flown.space.index("M")] = 40.0
    found = assess(model, GIVEN, 0, points)
    assert np.isfinite(found.measures.values[0]).all()
    assert np.isnan(found.measures.values[1]).all()
    assert set(found.measures.status[1]) == {int(Status.TRIM_FAILED)}
    assert found.performance.tolist() == [int(found.performance[0]), Performance.UNDEFINED]


@pytest.mark.parametrize("policy", ["bound", "drop", "refuse"])
def test_failed_runs_follow_the_declared_policy(flown: Study, model: BuiltinModel, policy: Any) -> None:
    wide = list(flown.space.factors)
    heavy = flown.space.index("M")
    wide[heavy] = replace(wide[heavy], distribution=Uniform(7.0, 14.5))
    space = FactorSpace(tuple(wide))
    sample = latin_hypercube(space, RUNS, 5)
    short = replace(GIVEN, speeds=(3.0,), distances=(16.0,))
    study = replace(flown, space=space, policy=policy, deceleration=short)
    block, files = deceleration_section(study, model, sample, model.assess(sample.points), 3)
    (run,) = block["runs"]
    failed = run["shares"]["failed"]["runs"]
    assert 0 < failed < RUNS
    entry = run["responses"]["height"]
    assert entry["monte_carlo"]["failed"] == failed == sum(entry["failures"].values())
    assert "no trim found" in next(iter(entry["failures"]))
    assert math.isnan(entry["sobol"]["M"]["ST"]) == (policy == "refuse")
    assert ("sobol_bounded" in entry) == (policy == "bound")
    assert run["rank_pairs"]["height"]["zeta"] <= RUNS - failed
    assert np.isnan(files["deceleration.nc"]["speed_3"]["severity"].values).sum() == failed


def test_a_point_that_cannot_be_captured_is_not_adequate_and_not_failed(flown: Study, model: BuiltinModel) -> None:
    """The point is passed before the pilot may act, and he may not go back."""
    rash = replace(GIVEN, pilot=replace(PILOT, reverse=0.0), distances=(2.0, 10.0))
    found = assess(model, rash, 0, flown.nominal[None])
    assert found.measures.codes("time")[0] == Status.NOT_CAPTURED
    assert found.measures.column("overshoot")[0] > ADEQUATE.overshoot
    assert found.performance[0] == Performance.NOT_ADEQUATE
    assert found.severity[0] == math.inf


def test_a_hover_point_beyond_the_record_decides_nothing(flown: Study, model: BuiltinModel) -> None:
    found = assess(model, replace(GIVEN, distances=(500.0, 10.0)), 0, flown.nominal[None])
    assert set(found.measures.status[0]) == {int(Status.NO_DECELERATION)}
    assert found.performance[0] == Performance.UNDEFINED


def test_runs_outside_the_validity_of_the_aerodynamics_carry_a_caution(flown: Study, model: BuiltinModel) -> None:
    """From 10 m/s the nose comes up so far that the linear lift is not to be believed; the values stand."""
    fast = replace(GIVEN, speeds=(10.0,), distances=(85.0,), duration=32.0)
    history: TimeHistory = fly(model, fast, 0, model.batch(flown.nominal[None]))
    found = assess(model, fast, 0, flown.nominal[None])
    assert history.extremes["alpha_max"][0] > model.vehicle.validity.alpha[1]
    assert found.measures.codes("theta")[0] == Status.INCIDENCE_OUTSIDE
    direct = capture(history, 85.0, 5.0, DESIRED, ADEQUATE)
    assert found.measures.column("theta")[0] == direct.theta[0]
    assert found.severity[0] == severity(direct, ADEQUATE)[0]


def test_a_study_without_the_manoeuvre(flown: Study, model: BuiltinModel, sample: Design, assessed: Assessment) -> None:
    with pytest.raises(InputError, match="deceleration"):
        deceleration_section(replace(flown, deceleration=None), model, sample, assessed, 1)


def test_progress_reaches_the_end(flown: Study, model: BuiltinModel, sample: Design, assessed: Assessment) -> None:
    told: list[tuple[str, int, int]] = []
    few = replace(flown, deceleration=replace(GIVEN, speeds=(3.0,), distances=(16.0,), duration=12.0))
    deceleration_section(few, model, sample, assessed, 1, lambda *step: told.append(step))
    assert ("deceleration", RUNS, RUNS) in told
    assert {stage for stage, _, _ in told} == {"deceleration", "deceleration, surrogates", "deceleration, decomposition"}
