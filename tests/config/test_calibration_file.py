"""Calibration files: what is read, in which unit, and one line for everything that is wrong."""

from __future__ import annotations

import hashlib
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from levelone.campaign.models.builtin import RESPONSES
from levelone.config.calibration_file import load_calibration
from levelone.config.calibration_schema import CalibrationFile
from levelone.config.schema import Strict
from levelone.errors import InputError

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "studies" / "reference"
UNITS = {name: unit for name, (unit, _) in RESPONSES.items()}
PAPER = tomllib.loads((ROOT / "tests" / "reference" / "paper.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def reference():
    return load_calibration(FOLDER / "calibration.toml", UNITS)


@pytest.fixture
def changed(tmp_path):
    """Write a copy of the reference calibration beside its study, its text changed by pairs of old and new."""
    for path in FOLDER.glob("*.toml"):
        shutil.copy(path, tmp_path)

    def write(*changes: tuple[str, str]) -> Path:
        path = tmp_path / "calibration.toml"
        text = path.read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text, f"the shipped file no longer holds {old!r}"
            text = text.replace(old, new, 1)
        path.write_text(text, encoding="utf-8")
        return path

    return write


def fault(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        load_calibration(path, UNITS)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.paper
def test_the_reference_aims_at_nominal_values_only(reference):
    assert [target.response for target in reference.targets] == ["omega_n", "zeta", "omega_bw", "quickness"]
    natural = reference.targets[0]
    assert natural.value == 5.61
    assert natural.accept == pytest.approx((0.95 * 5.61, 1.05 * 5.61), abs=0.005)
    for target in reference.targets:
        assert target.accept[0] < target.value - target.tolerance < target.value + target.tolerance < target.accept[1]


def test_the_reference_fits_nothing_that_the_study_prints_or_varies(reference):
    fitted = [path for each in reference.parameters for path in (each.path, *each.ties)]
    varied = {factor["name"] for factor in PAPER["factor"]}
    assert {path.rpartition(".")[2] for path in fitted}.isdisjoint(varied)
    assert not [path for path in fitted if path.startswith(("aerodynamics.", "mass.", "environment."))]


def test_roll_follows_pitch_in_the_reference(reference):
    tied = {tie: each.path for each in reference.parameters for tie in each.ties}
    assert tied["controller.roll"] == "controller.pitch"
    for name in ("Kp", "Ki", "Kd", "tau_f"):
        assert tied[f"controller.roll_rate.{name}"] == f"controller.pitch_rate.{name}"


def test_values_become_changes_with_their_ties(reference):
    values = [float(i) for i in range(len(reference.parameters))]
    changes = reference.changes(values)
    index = [each.path for each in reference.parameters].index("controller.pitch")
    assert changes["controller.pitch"] == changes["controller.roll"] == values[index]
    assert len(changes) == sum(1 + len(each.ties) for each in reference.parameters)


def test_the_file_is_known_by_its_hash(reference):
    assert reference.hash == hashlib.sha256((FOLDER / "calibration.toml").read_bytes()).hexdigest()


def test_targets_and_bounds_are_kept_in_si(changed):
    found = load_calibration(
        changed(
            (
                'value = 5.61\nunit = "rad/s"\ntolerance = 0.1\naccept = [5.33, 5.89]',
                'value = 320.0\nunit = "deg/s"\ntolerance = 6\naccept = [300, 340]',
            ),
            ('tolerance = 0.01\nunit = "1/s"', 'tolerance = 0.6\nunit = "1/min"'),
        ),
        UNITS,
    )
    target = found.targets[0]
    assert (target.unit, target.value, target.tolerance) == ("rad/s", pytest.approx(np.radians(320)), pytest.approx(np.radians(6)))
    assert target.accept == pytest.approx(tuple(np.radians([300, 340])))
    assert found.tradeoff.tolerance == pytest.approx(0.01)
    assert found.tradeoff.values[0] == pytest.approx(2.5 / 60)
    assert {limit.response: limit.high for limit in found.checks.limits}["delta_theta_pk"] == pytest.approx(np.radians(13))


def test_a_family_changes_priors_and_bounds_of_its_curve_alone(reference):
    family = reference.tradeoff.families[0]
    moved = {b.path: (b.prior, b.high) for a, b in zip(reference.parameters, family.parameters, strict=True) if a != b}
    assert moved["controller.pitch_rate.Kd"] == (2.5, 3.0)
    assert set(moved) == {"controller.pitch_rate.Kd", "controller.pitch_rate.Kp"}


@pytest.mark.parametrize(
    ("old", "new", "field", "problem"),
    [
        ('response = "zeta"', 'response = "zta"', "target.response", "did you mean 'zeta'?"),
        ('"zeta"\nvalue = 0.37\nunit = "1"', '"omega_n"\nvalue = 0.37\nunit = "rad/s"', "target.omega_n", "more than once"),
        ("accept = [0.33, 0.42]", "accept = [0.38, 0.42]", "target.zeta.accept", "the value 0.37 must lie in it"),
        ('value = 0.37\nunit = "1"', 'value = 0.37\nunit = "s"', "target.zeta.unit", "expected 1"),
        ("tolerance = 0.015", "tolerance = 0.0", "target.2.tolerance", "greater than 0"),
        ('source = "study, printed for its nominal case"', "", "target.omega_n", "neither source nor assumed"),
        ("perturbation = 1.4", "perturbation = 1.0", "calibration.perturbation", "greater than 1"),
        ("seed = 20240501", "sed = 20240501", "calibration", "did you mean 'seed'?"),
        ('"controller.horizontal.Kp"', '"controller.horizntal.Kp"', "parameter.controller", "did you mean 'horizontal'?"),
        ('"controller.horizontal.Kp"', '"aerodynamics.C_L0"', "aerodynamics.C_L0", "uncertain input C_L0 of the study"),
        ('"controller.horizontal.Kp"', '"mass.mass"', "mass.mass", "uncertain input M of the study"),
        ('"controller.horizontal.Kp"', '"rotors.tau_d"', "rotors.tau_d", "uncertain input tau_d of the study"),
        ('"controller.horizontal.Kp"', '"rotors.K_T_table"', "rotors.K_T_table", "has a source in the vehicle's file"),
        ('"controller.horizontal.Kp"', '"aerodynamics.chord"', "aerodynamics.chord", "has a source in the vehicle's file"),
        ('"controller.horizontal.Kp"', '"controller.pitch"', "parameter.controller.pitch", "more than once"),
        ('"controller.horizontal.Kp"', '"rotors.velocity"', "parameter.rotors.velocity", "is a text"),
        ('ties = ["controller.roll"]', 'ties = ["controller.pitch"]', "parameter.controller.pitch", "more than once"),
        ('unit = "1/s^2"\nprior = 0.27', 'unit = "1/s"\nprior = 0.27', "controller.horizontal.Ki.unit", "in '1/s^2'"),
        ("prior = 0.9\n", "prior = 9.0\n", "controller.horizontal.Kp.prior", "low <= prior <= high"),
        ('scale = "linear"\nassumed = "the study mentions', 'assumed = "the study mentions', "command_lag", "on a log scale"),
        ('scale = "linear"\nassumed = "the study mentions', 'scale = "cubic"\nassumed = "the', "scale", "allowed: linear, log"),
        ("low = 3.0\n", "low = 0.0\n", "parameter.controller.pitch", "low must be positive"),
        ('role = "draw"', 'role = "drawn"', "role", "did you mean 'draw'?"),
        ("low = 0.7\nhigh = 1.4", "low = 0.0\nhigh = 1.4", "rotors.position.x", "low must be positive"),
        ('response = "quickness"\nvalues', 'response = "tau_p"\nvalues', "tradeoff.response", "allowed: omega_bw, omega_n"),
        ('{ "controller.pitch_rate.Kd" = 2.5', '{ "rotors.position.x" = 1.2', "family.strong rate derivative.prior", "unknown"),
        ('{ "controller.pitch_rate.Kd" = 3.0', '{ "controller.pitch_rate.Kd" = 2.0', "prior.controller.pitch_rate.Kd", "2 (high)"),
        ('"controller.velocity_limit"', '"controller.velocity"', "checks.inactive", "no single number"),
        ('response = "delta_theta_pk"', 'response = "theta_pk"', "checks.limit.response", "delta_theta_pk"),
        ('study = "study.toml"', 'study = "other.toml"', "other.toml", "no such file"),
    ],
)  # fmt: skip
def test_faults_are_named_in_one_line(changed, old, new, field, problem):
    text = fault(changed((old, new)))
    assert field in text
    assert problem in text


def test_a_calibration_that_fits_nothing_is_refused(changed):
    path = changed()
    text = path.read_text()
    head, *blocks = text.split("[[parameter]]\n")
    drawn = [re.sub(r"(assumed = )", r'role = "draw"\n\1', b, count=1) if "role" not in b else b for b in blocks]
    path.write_text("[[parameter]]\n".join([head, *drawn]))
    assert "nothing to calibrate" in fault(path)


def test_a_bound_without_a_vehicle_names_the_bound(changed):
    text = fault(changed(("low = 0.6\nhigh = 1.4", "low = 0.6\nhigh = 1e300")))
    assert "parameter.rotors.throttle_exponent.high" in text


def keys_of(model):
    for name, field in model.model_fields.items():
        yield name
        for part in tables_in(field.annotation):
            yield from keys_of(part)


def tables_in(annotation):
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        yield annotation
    for part in getattr(annotation, "__args__", ()):
        yield from tables_in(part)


def test_the_page_names_every_key():
    page = (ROOT / "docs" / "reference" / "calibration-file.md").read_text(encoding="utf-8")
    assert sorted(set(keys_of(CalibrationFile)) - set(re.findall(r"[A-Za-z_0-9]+", page))) == []
