from __future__ import annotations

import doctest
import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling import tolerances
from levelone.handling.tolerances import Tolerance, compare_metrics, load_tolerances

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "fidelity.toml").read_text(encoding="utf-8"))
SI = {"deg": math.pi / 180.0, "deg/s": math.pi / 180.0}


def test_shipped_tolerances_are_those_of_the_code():
    shipped = load_tolerances()
    assert set(shipped) == set(REFERENCE["part_60"])
    for name, (value, unit, percent) in REFERENCE["part_60"].items():
        found = shipped[name]
        wanted = value * SI.get(unit, 1.0) if value else math.nan
        assert found.absolute == pytest.approx(wanted, nan_ok=True)
        assert found.relative == pytest.approx(percent / 100.0 if percent else math.nan, nan_ok=True)
        assert found.unit == {"deg": "rad", "deg/s": "rad/s"}.get(unit, unit)
        assert found.paragraph
        assert "Part 60" in found.source


@pytest.mark.parametrize(
    ("flight", "simulation", "verdict"),
    [
        (10.0, 11.9, "within"),  # 2 deg/s
        (10.0, 12.1, "outside"),
        (-10.0, -12.1, "outside"),
        (40.0, 43.9, "within"),  # 10 %
        (40.0, 44.0, "within"),
        (40.0, 44.1, "outside"),
        (-40.0, -44.0, "within"),
        (1.0, -0.9, "within"),
    ],
)
def test_the_less_restrictive_of_value_and_percentage_holds(flight, simulation, verdict):
    rad = math.pi / 180.0
    (row,) = compare_metrics({"q_pk": flight * rad}, {"q_pk": simulation * rad})
    assert row.verdict == verdict
    assert row.difference == pytest.approx((simulation - flight) * rad)
    assert row.allowed == pytest.approx(max(2.0, 0.1 * abs(flight)) * rad)


def test_what_could_not_be_read_is_neither_within_nor_outside():
    rows = compare_metrics(
        {"zeta": math.nan, "damped_period": 2.0, "omega_bw": 1.5, "r_pk": 0.2},
        {"zeta": 0.3, "omega_bw": 1.6, "r_pk": math.inf, "p_pk": 0.1},
    )
    assert [(row.name, row.verdict) for row in rows] == [
        ("zeta", "undefined"),
        ("damped_period", "undefined"),
        ("omega_bw", "no tolerance"),
        ("r_pk", "undefined"),
        ("p_pk", "undefined"),
    ]
    assert rows[2].difference == pytest.approx(0.1)
    assert math.isnan(rows[2].allowed)
    assert rows[2].tolerance is None
    assert math.isnan(rows[0].difference)
    assert math.isnan(rows[3].difference)


@given(flight=st.floats(-10.0, 10.0), part=st.floats(-1.0, 1.0))
def test_every_difference_up_to_the_allowed_one_is_within(flight, part):
    tolerance = Tolerance("x", 0.1, 0.05, "1", "", "", "low")
    allowed = tolerance.allowed(flight)
    (row,) = compare_metrics({"x": flight}, {"x": flight + part * allowed}, {"x": tolerance})
    assert row.verdict == "within"
    (row,) = compare_metrics({"x": flight}, {"x": flight + math.copysign(1.001, part) * allowed}, {"x": tolerance})
    assert row.verdict == "outside"


@pytest.mark.parametrize(("axis", "verdict"), [("pitch", "outside"), ("roll", "within"), ("yaw", "within"), ("", "no tolerance")])
def test_a_period_is_judged_by_the_test_of_its_axis(axis, verdict):
    """2.0 against 2.3 s: beyond 10 %, within 0.5 s, which 2.d.3.a allows for roll and yaw."""
    (row,) = compare_metrics({"damped_period": 2.0}, {"damped_period": 2.3}, axis=axis)
    assert row.verdict == verdict


def test_pitch_is_carried_over_from_the_long_term_test_and_says_so():
    shipped = load_tolerances()
    for name in ("zeta", "damped_period"):
        assert shipped[f"pitch.{name}"].confidence == "low"
        assert "long-term" in shipped[f"pitch.{name}"].note
        assert shipped[f"yaw.{name}"].confidence == "high"


@pytest.mark.parametrize("unit", ["ms", "ft/s", "degrees", "", "g"])
def test_a_unit_that_is_not_understood_is_refused(tmp_path, unit):
    path = tmp_path / "own.toml"
    path.write_text(f'schema = 1\n[tolerance.tau_p]\nabsolute = 10.0\nunit = "{unit}"\nconfidence = "low"\n', encoding="utf-8")
    with pytest.raises(InputError, match=rf"tolerance.tau_p.unit: unknown name '{unit}'.*allowed: 1, 1/s, deg"):
        load_tolerances(path)


def test_degrees_become_radians(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text('schema = 1\n[tolerance.roll.phi]\nabsolute = 1.0\nunit = "deg"\nconfidence = "low"\n', encoding="utf-8")
    assert load_tolerances(path)["roll.phi"].absolute == pytest.approx(math.radians(1.0))
    assert load_tolerances(path)["roll.phi"].unit == "rad"


def test_a_file_of_the_user(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text('schema = 1\n[tolerance.tau_p]\nabsolute = 0.02\nunit = "s"\nconfidence = "low"\n', encoding="utf-8")
    (row,) = compare_metrics({"tau_p": 0.1}, {"tau_p": 0.125}, load_tolerances(path))
    assert row.verdict == "outside"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("schema = 2", "schema: is 2, must be 1"),
        ("schema = 1", "tolerance: missing: one table for each metric"),
        ("schema = 1\ntolerance = 3", "is '3', must be a table"),
        ("schema = 1\n[tolerance]\nx = 3", "tolerance.x: is '3', must be a table"),
        ("schema = 1\n[tolerance]\nyaw = 3", "tolerance.yaw: is '3', must be a table"),
        ("schema = 1\ntolerances = 1", "did you mean 'tolerance'"),
        ('schema = 1\n[tolerance.x]\nunit = "s"\nconfidence = "low"', "neither an absolute nor a relative"),
        ('schema = 1\n[tolerance.x]\nabsolute = 1.0\nconfidence = "low"', "unit: missing"),
        ('schema = 1\n[tolerance.x]\nabsolute = -1.0\nunit = "s"\nconfidence = "low"', "must be a positive number"),
        ('schema = 1\n[tolerance.x]\nabsolute = "1"\nunit = "s"\nconfidence = "low"', "must be a positive number"),
        ('schema = 1\n[tolerance.x]\nabsolute = 1.0\nunit = "s"\nconfidence = "lo"', "did you mean 'low'"),
        ('schema = 1\n[tolerance.x]\nabsolut = 1.0\nunit = "s"\nconfidence = "low"', "did you mean 'absolute'"),
        ("schema = ", "is not a TOML file"),
    ],
)
def test_a_bad_file_says_what_is_wrong(tmp_path, text, message):
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_tolerances(path)


def test_a_missing_file_says_so(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load_tolerances(tmp_path / "none.toml")


def test_docstring_examples():
    outcome = doctest.testmod(tolerances)
    assert outcome.attempted > 0
    assert outcome.failed == 0
