"""Calibration: least squares against closed forms, undefined responses, and a small calibration flown for real."""

from __future__ import annotations

import json
import math
import shutil
import tomllib
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.campaign import calibration as fitting
from levelone.campaign.calibration import Fit, differentiate, fit, fly, from_sigmas, rounded, sigmas, starts_of
from levelone.campaign.calibration_run import run_calibration
from levelone.campaign.models.builtin import RESPONSES
from levelone.campaign.study import build_model
from levelone.campaign.tradeoff import ORDINARY, cases_of
from levelone.config.calibration_file import Calibration, load_calibration
from levelone.config.calibration_sections import Checks, Parameter, Target
from levelone.config.vehicle_file import library, load_vehicle
from levelone.errors import InputError
from levelone.status import Status
from levelone.uncertainty import Responses

FOLDER = Path(__file__).parents[2] / "studies" / "reference"
UNITS = {name: unit for name, (unit, _) in RESPONSES.items()}
WORDS = {"unit": "1", "ties": (), "role": "fit", "assumed": "test"}


@pytest.fixture(scope="module")
def reference() -> Calibration:
    return load_calibration(FOLDER / "calibration.toml", UNITS)


def parameter(path: str, prior: float, low: float, high: float, spread: float, scale: Any = "log", **other: Any) -> Parameter:
    return Parameter(path=path, prior=prior, low=low, high=high, spread=spread, scale=scale, **WORDS | other)


def problem(reference: Calibration, parameters: list[Parameter], targets: dict[str, tuple[float, float]]) -> Calibration:
    aims = tuple(
        Target(name, UNITS[name], value, tolerance, (-math.inf, math.inf), "test") for name, (value, tolerance) in targets.items()
    )
    return replace(reference, parameters=tuple(parameters), targets=aims, tradeoff=None)


def answer(monkeypatch: pytest.MonkeyPatch, law: Any) -> list[np.ndarray]:
    """Put ``law`` [n, p] -> [n, targets] in place of flights; gives the list of what was asked for."""
    asked: list[np.ndarray] = []

    def flown(model: Any, calibration: Calibration, values: np.ndarray) -> Responses:
        asked.append(values)
        found = law(values)
        status = np.where(np.isnan(found), int(Status.NO_VALLEY), int(Status.OK))
        names = [target.response for target in calibration.targets]
        return Responses(found, status, tuple(names), tuple(UNITS[name] for name in names))

    monkeypatch.setattr(fitting, "fly", flown)
    return asked


@pytest.mark.theory
def test_a_linear_model_is_fitted_as_its_normal_equations_say(reference: Calibration, monkeypatch: pytest.MonkeyPatch) -> None:
    """Targets linear in ln p: (J^T J + I) (x - x0) = J^T r, with J in tolerances for one sigma."""
    parameters = [
        parameter("a", 2.0, 0.01, 100.0, 1.5),
        parameter("b", 0.3, 0.01, 10.0, 2.0),
        parameter("c", 0.0, -9.0, 9.0, 0.5, "linear"),
    ]
    slopes, offset = np.array([[3.0, -1.0, 2.0], [0.5, 4.0, -1.0]]), np.array([1.0, -2.0])

    def law(values: np.ndarray) -> np.ndarray:
        return np.column_stack([np.log(values[:, 0]), np.log(values[:, 1]), values[:, 2]]) @ slopes.T + offset

    asked = answer(monkeypatch, law)
    aim, tolerance = np.array([2.5, -4.5]), np.array([0.1, 0.4])
    task = problem(reference, parameters, dict(zip(("omega_n", "zeta"), zip(aim, tolerance, strict=True), strict=True)))
    start = np.array([2.0, 0.3, 0.0])
    found = fit(None, task, start, start)
    J = slopes * np.array([math.log(1.5), math.log(2.0), 0.5]) / tolerance[:, None]
    r = (aim - law(start[None])[0]) / tolerance
    step = np.linalg.solve(J.T @ J + np.eye(3), J.T @ r)
    np.testing.assert_allclose(sigmas(parameters, found.values) - sigmas(parameters, start), step, atol=1e-6)
    left = r - J @ step
    assert found.target_cost == pytest.approx(0.5 * left @ left, rel=1e-6)
    assert found.prior_cost == pytest.approx(0.5 * step @ step, rel=1e-6)
    assert found.outcome == "converged"
    assert {len(values) for values in asked} == {7}  # every step is one batch of 2 p + 1
    assert len(asked) == found.evaluations <= 4


@pytest.mark.theory
def test_a_bound_holds_and_the_rest_is_fitted_without_it(reference: Calibration, monkeypatch: pytest.MonkeyPatch) -> None:
    """Started on a bound that the target pulls against, the parameter stays; the other one takes all."""
    answer(monkeypatch, lambda values: np.log(values[:, :1]) - 5.0 * values[:, 1:])
    parameters = [parameter("a", 1.0, 0.01, 100.0, math.e), parameter("lag", 0.0, 0.0, 0.3, 0.05, "linear")]
    task = problem(reference, parameters, {"omega_n": (2.0, 0.5)})
    found = fit(None, task, np.array([1.0, 0.0]), np.array([1.0, 0.0]))
    assert found.values[1] == 0.0
    # minimum of ((x - 2) / 0.5)^2 + x^2
    assert math.log(found.values[0]) == pytest.approx(8.0 / 5.0, abs=1e-6)


def test_a_start_on_a_bound_may_leave_it(reference: Calibration, monkeypatch: pytest.MonkeyPatch) -> None:
    answer(monkeypatch, lambda values: values[:, :1])
    task = problem(reference, [parameter("lag", 0.0, 0.0, 0.3, 0.1, "linear")], {"omega_n": (0.2, 0.001)})
    assert fit(None, task, np.zeros(1), np.zeros(1)).values[0] == pytest.approx(0.2, abs=1e-4)


@pytest.mark.parametrize("x", [0.0, 0.03, 0.5, 0.97, 1.0])
def test_differences_are_exact_for_a_parabola_wherever_the_bounds_lie(
    reference: Calibration, monkeypatch: pytest.MonkeyPatch, x: float
) -> None:
    asked = answer(monkeypatch, lambda values: 1.0 + 2.0 * values[:, :1] - 3.0 * values[:, :1] ** 2)
    task = problem(reference, [parameter("a", 0.5, 0.0, 1.0, 1.0, "linear")], {"omega_n": (1.0, 1.0)})
    found = differentiate(None, task, np.array([x]), [0])
    assert found.jacobian[0, 0] == pytest.approx(2.0 - 6.0 * x, abs=1e-12)
    assert asked[0].min() >= 0.0
    assert asked[0].max() <= 1.0


def test_differences_beside_an_undefined_region_use_the_other_side(reference: Calibration, monkeypatch: pytest.MonkeyPatch) -> None:
    answer(monkeypatch, lambda values: np.where(values[:, :1] > 0.55, np.nan, 4.0 * values[:, :1]))
    task = problem(reference, [parameter("a", 0.5, 0.0, 1.0, 1.0, "linear")], {"omega_n": (1.0, 1.0)})
    found = differentiate(None, task, np.array([0.5]), [0])
    assert found.jacobian[0, 0] == pytest.approx(4.0)
    assert found.undefined == 1


def test_an_undefined_region_is_not_entered(reference: Calibration, monkeypatch: pytest.MonkeyPatch) -> None:
    """The target would be met where it is undefined: the fit stops before, says how often it looked beyond, and never raises."""
    answer(monkeypatch, lambda values: np.where(values[:, :1] > 2.0, np.nan, np.log(values[:, :1])))
    task = problem(reference, [parameter("a", 1.0, 0.01, 100.0, math.e)], {"zeta": (3.0, 0.1)})
    found = fit(None, task, np.ones(1), np.ones(1))
    assert 1.0 < found.values[0] <= 2.0
    assert found.undefined > 0


def test_a_start_without_a_response_stays_and_says_so(reference: Calibration, monkeypatch: pytest.MonkeyPatch) -> None:
    answer(monkeypatch, lambda values: np.full((len(values), 1), np.nan))
    task = problem(reference, [parameter("a", 1.0, 0.01, 100.0, math.e)], {"zeta": (3.0, 0.1)})
    found = fit(None, task, np.array([1.7]), np.array([1.7]))
    assert found.values == pytest.approx([1.7])
    assert "undefined where the fit ended" in found.outcome
    assert found.target_cost == 0.5 * fitting.UNDEFINED**2


@given(st.floats(0.011, 99.0), st.floats(-8.9, 8.9))
def test_sigmas_and_back(a: float, c: float) -> None:
    parameters = [parameter("a", 2.0, 0.01, 100.0, 1.5), parameter("c", 0.0, -9.0, 9.0, 0.5, "linear")]
    values = np.array([a, c])
    assert from_sigmas(parameters, sigmas(parameters, values)) == pytest.approx(values, rel=1e-12, abs=1e-12)
    beyond = from_sigmas(parameters, np.array([[1e3, -1e3], [-1e3, 1e3]]))
    assert beyond.tolist() == [[100.0, -9.0], [0.01, 9.0]]


def test_starts_are_drawn_about_the_priors(reference: Calibration) -> None:
    many = replace(reference, starts=4000)
    starts = starts_of(many)
    assert starts[0].tolist() == [each.prior for each in many.parameters]
    np.testing.assert_array_equal(starts, starts_of(many))
    np.testing.assert_array_equal(starts[:11], starts_of(reference))
    for each, column in zip(many.parameters, starts.T, strict=True):
        assert column.min() >= each.low
        assert column.max() <= each.high
        if each.role == "hold":
            assert set(column) == {each.prior}
        elif each.path == "controller.horizontal.Kp":  # its bounds lie beyond two sigma
            middle = np.log(column[(column > each.low) & (column < each.high)] / each.prior)
            assert np.std(middle) == pytest.approx(math.log(1.4), rel=0.05)
            assert np.mean(middle) == pytest.approx(0.0, abs=0.03)
    assert not np.array_equal(starts_of(replace(reference, seed=reference.seed + 1))[1:], starts_of(reference)[1:])


def test_rounding_keeps_digits_and_bounds(reference: Calibration) -> None:
    parameters = (
        parameter("a", 2.0, 0.1, 5.00049, 1.5),
        parameter("b", 2.0, 0.001, 5.0, 1.5),
        parameter("c", 0.0, 0.0, 0.3, 0.05, "linear"),
        parameter("d", 0.0, 0.0, 0.3, 0.05, "linear"),
    )
    task = replace(reference, parameters=parameters, digits=4)
    once = rounded(task, np.array([5.0004901, 0.00123456, 1e-9, 0.0123456]))
    assert once.tolist() == [5.0, 0.001235, 0.0, 0.01235]
    np.testing.assert_array_equal(rounded(task, once), once)


def test_a_vehicle_that_cannot_be_designed_is_a_status_among_the_others(reference: Calibration) -> None:
    weight = (parameter("mass.mass", 7.0, 1.0, 100.0, 1.5),)
    found = fly(build_model(reference.study, threads=1), replace(reference, parameters=weight), np.array([[7.0], [60.0], [7.1]]))
    assert found.failed("quickness").tolist() == [False, True, False]
    assert {Status(int(code)) for code in found.status[1]} == {Status.TRIM_FAILED}


def test_a_trade_off_is_a_fit_for_each_point_of_each_curve(reference: Calibration) -> None:
    solution = np.array([each.prior * 1.1 for each in reference.parameters])
    cases = cases_of(reference, solution)
    tradeoff = reference.tradeoff
    assert [case.asked for case in cases] == [*tradeoff.values] * 2
    assert [case.curve for case in cases] == [ORDINARY] * len(tradeoff.values) + ["strong rate derivative"] * len(tradeoff.values)
    changed = [each.path in ("controller.pitch_rate.Kd", "controller.pitch_rate.Kp") for each in reference.parameters]
    for case in cases:
        forced = case.calibration.targets[tradeoff.index]
        assert (forced.value, forced.tolerance) == (case.asked, tradeoff.tolerance)
        others = [each for i, each in enumerate(case.calibration.targets) if i != tradeoff.index]
        assert others == [each for i, each in enumerate(reference.targets) if i != tradeoff.index]
        own = np.array(changed) & (case.curve != ORDINARY)
        np.testing.assert_array_equal(case.start, np.where(own, case.centre, solution))
        assert ((case.centre == [each.prior for each in reference.parameters]) == ~own).all()
    assert cases_of(replace(reference, tradeoff=None), solution) == []


@pytest.fixture(scope="module")
def fitted(reference: Calibration) -> Fit:
    """The fit from the priors."""
    start = starts_of(reference)[0]
    return fit(build_model(reference.study), reference, start, start)


@pytest.mark.paper
def test_the_reference_calibration_meets_every_nominal_figure_of_the_study(reference: Calibration, fitted: Fit) -> None:
    """omega_n within 5 %, 0.33 <= zeta <= 0.42, omega_bw in 4 to 5 rad/s, quickness in 2.5 to 3.25 1/s."""
    flown = fly(build_model(reference.study), reference, rounded(reference, fitted.values)[None])
    values, status = fitting.targets_of(reference, flown)
    reached = dict(zip(("omega_n", "zeta", "omega_bw", "quickness"), values[0], strict=True))
    assert reached["omega_n"] == pytest.approx(5.61, rel=0.05)
    assert 0.33 <= reached["zeta"] <= 0.42
    assert 4.0 <= reached["omega_bw"] <= 5.0
    assert 2.5 <= reached["quickness"] <= 3.25
    assert not any(Status(int(code)).failed for code in status[0])
    assert fitted.outcome == "converged"


def test_the_shipped_vehicle_is_the_result_of_the_calibration(reference: Calibration, fitted: Fit) -> None:
    """Every fitted number of the file is that of the fit, rounded; a last digit may fall otherwise on another processor."""
    content = tomllib.loads(library()["reference-evtol"].read_text(encoding="utf-8"))
    for parameter, value in zip(reference.parameters, rounded(reference, fitted.values), strict=True):
        for path in (parameter.path, *parameter.ties):
            if path.startswith("rotors.position"):
                continue  # a factor on the shipped positions, which are those of the file
            entry = reduce(lambda table, key: table[key], path.split("."), content)
            assert entry["value"] == pytest.approx(value, rel=1e-3, abs=1e-6), path
            assert parameter.role != "fit" or "calibrated by calibration.toml" in entry["assumed"], path


@pytest.fixture(scope="module")
def small(reference: Calibration) -> Calibration:
    """Two gains and the arms, two targets, two perturbed starts and a trade-off of two points."""
    keep = ("controller.pitch", "controller.command_lag", "rotors.position.x")
    targets = [each for each in reference.targets if each.response in ("omega_n", "quickness")]
    study = replace(reference.study, method=replace(reference.study.method, samples=20))
    return replace(
        reference,
        study=study,
        starts=2,
        targets=tuple(targets),
        parameters=tuple(each for each in reference.parameters if each.path in keep),
        tradeoff=replace(reference.tradeoff, index=1, values=(2.8, 3.0), families=()),
        checks=Checks((0.0, 5.0), reference.checks.inactive[:1], reference.checks.limits),
    )


@pytest.fixture(scope="module")
def folder(small: Calibration, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("calibrated")
    stages: dict[str, tuple[int, int]] = {}
    run_calibration(small, out, threads=2, progress=lambda stage, done, total: stages.__setitem__(stage, (done, total)))
    assert stages == {"fits": (3, 3), "trade-off": (2, 2), "checks": (22, 22)}
    return out


def content(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "calibration.json").read_text())


def without_provenance(folder: Path) -> str:
    return json.dumps({key: value for key, value in content(folder).items() if key != "provenance"})


def test_what_is_reported_is_what_the_written_vehicle_gives(small: Calibration, folder: Path) -> None:
    vehicle = load_vehicle(folder / "reference-evtol.toml")
    run = content(folder)["starts"][0]
    assert vehicle.controller.pitch == vehicle.controller.roll == run["values"]["controller.pitch"]
    flown = replace(build_model(small.study), vehicle=vehicle).nominal().responses
    assert {name: float(flown.column(name)[0]) for name in RESPONSES} == run["reached"]
    # and the changes that experiments take make the same aircraft
    changed = fly(build_model(small.study), small, np.array([list(run["values"].values())]))
    assert dict(zip(changed.names, changed.values[0].tolist(), strict=True)) == run["reached"]


def test_starts_draws_and_verdicts(small: Calibration, folder: Path) -> None:
    found = content(folder)
    assert [run["name"] for run in found["starts"]] == ["priors", "start 1", "start 2"]
    for run in found["starts"]:
        assert run["values"]["rotors.position.x"] == pytest.approx(run["start"]["rotors.position.x"], rel=1e-3)  # drawn, not fitted
        assert run["accepted"] == (run["missed"] == [])
        assert run["values"]["controller.pitch"] == float(f"{run['values']['controller.pitch']:.4g}")
    assert json.loads((folder / "calibrations.json").read_text()) == found["calibrations"]
    assert [entry["name"] for entry in found["calibrations"]] == [run["name"] for run in found["starts"][1:] if run["accepted"]]
    known = found["identifiability"]["parameters"]
    assert known["controller.pitch"]["identified"]
    assert not known["rotors.position.x"]["identified"]
    assert known["rotors.position.x"]["removed"] == pytest.approx(0.0, abs=1e-4)
    assert found["identifiability"]["sensitivity"]["rotors.position.x"]["omega_n"] == pytest.approx(0.0, abs=1e-4)
    assert found["identifiability"]["sensitivity"]["controller.pitch"]["omega_n"] > 0.3


def test_trade_off_and_checks(folder: Path) -> None:
    found = content(folder)
    points = found["tradeoff"]["curves"][ORDINARY]
    assert [point["reached"]["quickness"] for point in points] == pytest.approx([2.8, 3.0], abs=0.03)
    assert points[0]["reached"]["omega_n"] < points[1]["reached"]["omega_n"]
    assert [pole["stable"] for pole in found["checks"]["stability"]] == [True, True]
    assert [each["largest_change"] for each in found["checks"]["inactive"]] == [0.0]
    for limit in found["checks"]["limits"]:
        assert limit["n"] == 20
        assert limit["above"] == (limit["largest"] > limit["high"])


def test_the_calibrated_vehicle_calibrates_to_the_same_numbers_on_any_number_of_threads(
    small: Calibration, folder: Path, tmp_path: Path
) -> None:
    path = folder / "reference-evtol.toml"
    again = replace(small, study=replace(small.study, vehicle=load_vehicle(path), vehicle_path=path))
    run_calibration(again, tmp_path, threads=1)
    assert without_provenance(tmp_path) == without_provenance(folder)
    assert (tmp_path / "reference-evtol.toml").read_text() == path.read_text()


def test_no_null_anywhere(folder: Path) -> None:
    assert "null" not in (folder / "calibration.json").read_text()


def test_the_vehicle_itself_is_not_overwritten(small: Calibration, folder: Path, tmp_path: Path) -> None:
    for path in folder.glob("reference-evtol*"):
        shutil.copy(path, tmp_path)
    at_home = replace(small, study=replace(small.study, vehicle_path=tmp_path / "reference-evtol.toml"))
    before = (tmp_path / "reference-evtol.toml").read_text()
    with pytest.raises(InputError, match="choose another folder"):
        run_calibration(at_home, tmp_path)
    assert (tmp_path / "reference-evtol.toml").read_text() == before
