from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from levelone.campaign import nominal_check
from levelone.campaign.models.readings import read
from levelone.campaign.nominal_check import as_model_study, check_nominal
from levelone.campaign.nominal_reading_rules import reading_findings
from levelone.campaign.nominal_rules import EXPECTED, first_answer, record_findings
from levelone.config.model_study import load_model_study
from levelone.config.model_table import PythonTable, Test
from levelone.config.study_file import load_study
from levelone.handling.levels import load_boundaries
from levelone.handling.manoeuvres import MODE_AXES, UNITS, pulse, step, sweep
from levelone.handling.records import CHANNEL_UNITS, record
from levelone.report.nominal_check import render_check
from levelone.status import Status

ROOT = Path(__file__).parents[2]
OWN = ROOT / "studies" / "own-model" / "study.toml"
DEG = math.pi / 180.0
OMEGA, ZETA, GAIN = 5.0, 0.35, 0.5
DIRECT = {"trim_speed": 0.0, "flight_mode": "direct", "dt": 0.005, "controller_rate": 200.0}


def second_order(time, command, omega=OMEGA, zeta=ZETA):
    """Attitude and rate of GAIN omega^2 / (s^2 + 2 zeta omega s + omega^2), the input held between samples."""
    from scipy.linalg import expm

    dt = time[1] - time[0]
    whole = np.zeros((3, 3))
    whole[:2] = [[0.0, 1.0, 0.0], [-(omega**2), -2.0 * zeta * omega, GAIN * omega**2]]
    forward = expm(whole * dt)
    states = np.zeros((time.size, 2))
    for k in range(time.size - 1):
        states[k + 1] = forward[:2, :2] @ states[k] + forward[:2, 2] * command[k]
    return states.T


def flown(test, **changes):
    """A record of the test by the second order, with channels changed by functions of (time, values)."""
    time = test.manoeuvre.ticks()
    command = test.manoeuvre.command(time)
    theta, q = second_order(time, command)
    channels = {"theta": theta, "q": q, "delta_lon": command}
    for name, change in changes.items():
        channels[name] = change(time, channels.get(name, theta))
    off = test.manoeuvre.off
    return record(time, channels, input_name="delta_lon", input_on=1.0, input_off=off if math.isfinite(off) else math.nan,
                  units={name: CHANNEL_UNITS.get(name, "1") for name in channels})  # fmt: skip


STEP = Test("step", "attitude_quickness", "pitch", step("delta_lon", 0.2, duration=6.0, **DIRECT))
PULSE = Test("free", "dynamic_stability", "pitch", pulse("delta_lon", 0.2, length=0.4, duration=6.0, **DIRECT))
SWEEP = Test(
    "sweep", "bandwidth", "pitch", sweep("delta_lon", 0.1, length=40.0, omega_min=0.5, omega_max=20.0, **DIRECT), output="theta",
    method="sweep", windows=(15.0, 8.0), response_type="attitude_command",
)  # fmt: skip


def rules(test, history):
    return {(each.rule, each.wrong) for each in record_findings(test, history)}


@pytest.mark.parametrize("test", [STEP, PULSE, SWEEP], ids=lambda each: each.name)
def test_a_right_record_has_no_finding(test):
    history = flown(test)
    assert record_findings(test, history) == []
    result = read(test, history, load_boundaries())
    assert [each for each in reading_findings(test, result, history) if each.wrong and each.rule != "range"] == []


@pytest.mark.parametrize("test", [STEP, PULSE, SWEEP], ids=lambda each: each.name)
@pytest.mark.parametrize(
    ("changes", "rule", "words"),
    [
        ({"q": lambda t, x: x / DEG}, "units",
         "q is 57.3 times the rate of change of theta; 57.3 would be deg taken for rad, in the first"),
        ({"theta": lambda t, x: x / DEG}, "units", "q is 0.0175 times the rate of change of theta; 0.0175 would be deg"),
        ({"q": lambda t, x: -x}, "sign", "q goes against the change of theta (ratio -1)"),
        ({"q": lambda t, x: np.roll(x, 300)}, "units", "q does not integrate to theta"),
        ({"altitude": lambda t, x: x / 0.3048, "V_vert": lambda t, x: np.gradient(x, t)}, "units", "V_vert is 0.305 times"),
        ({"theta": lambda t, x: -x, "q": lambda t, x: -x}, "sign", "theta first goes negative"),
        ({"theta": lambda t, x: 60.0 * x}, "units", "theta reaches"),
        ({"theta": lambda t, x: 0.0 * x}, "no response", "theta does not answer delta_lon"),
        ({"theta": lambda t, x: x + 0.02 * np.exp(-3.0 * t)}, "unsettled trim", "before the input"),
    ],
)  # fmt: skip
def test_each_mistake_is_found_and_named_with_its_number(test, changes, rule, words):
    found = record_findings(test, flown(test, **changes))
    assert any(each.rule == rule and words in each.text for each in found), found


def test_a_rate_in_deg_is_told_from_a_fast_one():
    assert any("is it in deg/s?" in each.text for each in record_findings(STEP, flown(STEP, q=lambda t, x: 400.0 * x)))
    assert not any("is it in deg/s?" in each.text for each in record_findings(STEP, flown(STEP, q=lambda t, x: 10.0 * x)))


def test_a_limit_shows_as_a_flat_extreme():
    limited = flown(SWEEP, theta=lambda t, x: np.clip(x, -0.04, 0.04))
    assert ("flat", True) in rules(SWEEP, limited)


def test_a_negative_input_turns_the_expectation_round():
    test = replace(STEP, manoeuvre=replace(STEP.manoeuvre, amplitude=-0.2))
    assert record_findings(test, flown(test)) == []


def test_the_first_answer_is_not_that_of_a_small_wrong_start():
    """A non-minimum phase start of a tenth of the response is no wrong sign."""
    history = flown(STEP, theta=lambda t, x: np.where((t > 1.0) & (t < 1.02), -0.1 * x.max(), x))
    assert first_answer(STEP, history, "theta") > 0.0


def test_expectations_name_every_command_and_known_channels_only():
    assert set(EXPECTED) == {axis for axes in MODE_AXES.values() for axis in axes} == set(UNITS)
    assert {name for each in EXPECTED.values() for name in each} <= set(CHANNEL_UNITS)


def test_coarse_sampling_is_found_by_half_cycles():
    fast = Test("step", "attitude_quickness", "pitch", replace(STEP.manoeuvre, dt=0.05, controller_rate=20.0))
    history = flown(fast)
    found = reading_findings(fast, read(fast, history, load_boundaries()), history)
    half_cycle = math.pi / (OMEGA * math.sqrt(1.0 - ZETA**2))
    (finding,) = (each for each in found if each.rule == "sampling")
    assert float(re.search(r"lasts ([0-9.]+) s", finding.text)[1]) == pytest.approx(half_cycle, rel=0.05)


def test_a_sweep_that_ends_too_early_is_found():
    delayed = flown(SWEEP, theta=lambda t, x: np.interp(t - 0.15, t, x))
    short = replace(SWEEP, manoeuvre=replace(SWEEP.manoeuvre, omega_max=9.0))
    history = flown(short, theta=lambda t, x: np.interp(t - 0.15, t, x))
    assert not [each for each in reading_findings(SWEEP, read(SWEEP, delayed, load_boundaries()), delayed) if each.rule == "range"]
    found = reading_findings(short, read(short, history, load_boundaries()), history)
    assert any(each.rule == "range" and "2 omega_180" in each.text for each in found)


def test_noise_lowers_the_coherence_and_is_found():
    noise = np.random.default_rng(3).normal(0.0, 0.05, SWEEP.manoeuvre.ticks().size)
    history = flown(SWEEP, theta=lambda t, x: x + noise)
    found = reading_findings(SWEEP, read(SWEEP, history, load_boundaries()), history)
    assert any(each.rule == "coherence" and each.wrong for each in found)


@pytest.fixture
def here(monkeypatch):
    """Run Python functions in this process: the tests of processes are elsewhere, and one here."""
    monkeypatch.setattr(nominal_check, "OWN", (PythonTable,))


@pytest.fixture
def study(tmp_path):
    """The example with changes of its text, beside its function with changes of its own."""

    def loaded(*changes, function=()):
        for source, pairs in ((OWN, changes), (OWN.with_name("pitch_axis.py"), function)):
            text = source.read_text(encoding="utf-8")
            for old, new in pairs:
                assert old in text
                text = text.replace(old, new)
            (tmp_path / source.name).write_text(text, encoding="utf-8")
        return load_model_study(tmp_path / "study.toml")

    return loaded


@pytest.mark.theory
def test_the_example_has_the_numbers_of_its_transfer_function(here, study):
    """theta / stick = K omega^2 exp(-delay s) / (s^2 + 2 zeta omega s + omega^2): zeta and omega_n exactly, the frequencies at
    which the phase is -135 and -180 deg from its closed form."""
    check = check_nominal(study())
    value = {each.name: each.value for each in check.responses}
    assert {each.status for each in check.responses} == {Status.OK}
    assert check.findings == ()
    assert value["zeta"] == pytest.approx(0.35, abs=1e-6)
    assert value["omega_n"] == pytest.approx(5.0, rel=1e-6)
    held = 0.06 + 0.005  # an input that is held for 0.01 s comes half of it later

    def phase(omega):
        return -math.degrees(math.atan2(2.0 * 0.35 * 5.0 * omega, 25.0 - omega**2) + omega * held)

    assert phase(value["omega_bw"]) == pytest.approx(-135.0, abs=1.5)
    assert phase(value["omega_180"]) == pytest.approx(-180.0, abs=1.5)
    assert value["tau_p"] == pytest.approx(-(phase(2.0 * value["omega_180"]) + 180.0) / (57.3 * 2.0 * value["omega_180"]), rel=0.02)


def test_a_mistake_in_the_mapping_of_the_example_is_found(here, study):
    degrees = check_nominal(study(('unit = "deg/s"', 'unit = "rad/s"')))
    assert {(each.rule, each.wrong) for each in degrees.wrong} >= {("units", True)}
    assert any("57.3 times" in each.text for each in degrees.wrong)
    turned = check_nominal(study(('name = "stick"', 'name = "stick"\nsign = -1')))
    assert {each.rule for each in turned.wrong} == {"sign", "undefined"}  # a phase that begins at 180 deg has no -135


def test_a_failed_flight_is_a_finding_with_what_the_model_said(here, study):
    check = check_nominal(study(function=[("time = manoeuvre.ticks()", 'raise RuntimeError("no fuel")')]))
    assert {each.status for each in check.responses} == {Status.MODEL_FAILED}
    assert all(math.isnan(each.value) for each in check.responses)
    assert "no fuel" in check.message
    assert {each.rule for each in check.wrong} == {"undefined"}
    assert check.histories == {}


def test_a_model_that_crashes_ends_in_a_status(study):
    check = check_nominal(study(function=[("time = manoeuvre.ticks()", "import os; os.abort()")]))
    assert {each.status for each in check.responses} == {Status.CRASHED}
    assert check.wrong


def test_a_model_of_others_runs_in_one_process_under_the_time_limit(study, monkeypatch):
    asked = []

    class Refused(Exception):
        pass

    def executor_of(options):
        asked.append(options)
        raise Refused

    monkeypatch.setattr(nominal_check, "executor_of", executor_of)
    limit = '[campaign]\nexecutor = "dask://127.0.0.1:8786"\ntime_limit = 0.5\n[responses]'
    with pytest.raises(Refused):
        check_nominal(study(("[responses]", limit)))
    (options,) = asked
    assert (options.executor, options.workers, options.time_limit) == ("processes", 1, 0.5)


def test_the_page_holds_findings_numbers_and_the_picked_peaks(here, study, tmp_path):
    check = check_nominal(study(('unit = "deg/s"', 'unit = "rad/s"')))
    page = render_check(tmp_path / "out", check)
    text = page.read_text(encoding="utf-8")
    for words in (
        "looks wrong",
        "57.3 would be deg taken for rad",
        "pitch_rate",
        "first peak of the rate",
        "record_step",
        "response_sweep",
    ):
        assert words in text
    assert {path.name for path in (tmp_path / "out" / "figures").glob("*.svg")} == {
        "record_step.svg", "record_free.svg", "record_sweep.svg", "response_sweep.svg",
    }  # fmt: skip
    again = render_check(tmp_path / "again", replace(check, seconds=check.seconds))
    assert again.read_bytes() == page.read_bytes()


def test_a_study_of_a_vehicle_is_flown_as_its_own_study_flies_it():
    vehicle = load_study(ROOT / "studies" / "reference" / "study.toml")
    study = as_model_study(vehicle)
    assert [test.manoeuvre for test in study.tests] == [
        vehicle.quickness, vehicle.stability, vehicle.sweep, vehicle.sweep, vehicle.sweep, vehicle.quickness,
    ]  # fmt: skip
    assert (study.hash, study.targets, study.model.trim_speed) == (vehicle.hash, vehicle.targets, vehicle.trim_speed)
