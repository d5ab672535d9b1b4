"""Coefficients of a vehicle from a geometry and from other codes: which part goes where, in which frame, with which origin."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.derivatives import Derivatives, dynamic, static
from levelone.campaign import coefficient_table
from levelone.campaign.coefficient_table import LAGS, RATES, STATIC, geometry_table, other_table
from levelone.config.geometry_file import load_geometry
from levelone.config.other_codes import OtherCode, read_st, read_stab
from levelone.config.table_writer import CoefficientTable, write_table
from levelone.config.vehicle_file import library, load_vehicle
from levelone.errors import InputError
from levelone.vehicle import COEFFICIENTS

OTHER = Path(__file__).parents[1] / "reference" / "other-codes"
NEEDED = [name for name in COEFFICIENTS if "delta" not in name]
COARSE = """
[geometry]
name = "coarse"
[geometry.reference]
area = { value = 0.75, unit = "m^2", assumed = "rounded" }
chord = 0.26
span = 3.0
point = [0.01, 0.0, 0.0]
[[surface]]
name = "wing"
position = [0.0, 0.0, 0.0]
span = 3.0
chord = 0.26
incidence = { value = 4.0, unit = "deg" }
dihedral = { value = 3.0, unit = "deg", assumed = "as on the photograph" }
panels = [2, 4]
[[surface]]
name = "fin"
position = [1.1, 0.0, 0.1]
span = 0.3
chord = 0.15
dihedral = { value = 90, unit = "deg" }
mirrored = false
panels = [2, 3]
"""


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("geometry") / "coarse.toml"
    path.write_text(COARSE)
    return path


@pytest.fixture(scope="module")
def slow(coarse: Path) -> CoefficientTable:
    return geometry_table(coarse)


@pytest.fixture(scope="module")
def scheduled(coarse: Path) -> CoefficientTable:
    return geometry_table(coarse, omega=5.0, speeds=(2.5, 6.5))


def value(table: CoefficientTable, name: str) -> float:
    (single,) = table.coefficients[name].value
    return single


def test_every_coefficient_that_a_vehicle_needs_is_given(slow: CoefficientTable) -> None:
    assert set(slow.coefficients) == set(NEEDED)
    assert slow.missing == ()


def test_static_values_are_those_of_the_steady_lattice(coarse: Path, slow: CoefficientTable) -> None:
    steady = static(load_geometry(coarse))
    for name, motion, coefficient in (
        ("C_malpha", "alpha", "C_m"),
        ("C_lbeta", "beta", "C_l"),
        ("C_nr", "r", "C_n"),
        ("C_Dq", "q", "C_D"),
    ):
        assert value(slow, name) == steady.value[steady.motions.index(motion), NAMES.index(coefficient)]
    assert value(slow, "C_L0") == steady.rest[NAMES.index("C_L")]


@pytest.mark.theory
def test_wing_at_incidence_has_the_lift_of_its_slope(slow: CoefficientTable) -> None:
    """Flat wing: lift at rest is that of the incidence, some per cent less for the finite angle."""
    assert value(slow, "C_L0") == pytest.approx(value(slow, "C_Lalpha") * math.radians(4.0), rel=0.03)


@pytest.mark.theory
def test_signs_are_those_of_a_stable_aircraft(slow: CoefficientTable) -> None:
    """A fin aft and above, dihedral, a moment point ahead of the wing's neutral point by the lattice's own lift."""
    for name in ("C_Ybeta", "C_lbeta", "C_lp", "C_nr", "C_mq"):
        assert value(slow, name) < 0.0
    for name in ("C_Lalpha", "C_nbeta", "C_Yr", "C_lr"):
        assert value(slow, name) > 0.0


def test_side_force_is_without_the_drag_that_the_flight_model_adds(coarse: Path, slow: CoefficientTable) -> None:
    steady = static(load_geometry(coarse))
    whole = steady.value[steady.motions.index("beta"), NAMES.index("C_Y")]
    assert value(slow, "C_Ybeta") - value(slow, "C_D0") == pytest.approx(whole, rel=1e-12)
    assert value(slow, "C_D0") > 0.002


def test_slow_motion_is_the_limit_of_small_k(coarse: Path, slow: CoefficientTable) -> None:
    at = geometry_table(coarse, k=0.01)
    for name in (*RATES, *LAGS):
        assert value(at, name) == pytest.approx(value(slow, name), rel=0.1, abs=2e-3)
    near = geometry_table(coarse, k=1e-4)
    for name in LAGS:
        assert abs(value(near, name) - value(slow, name)) < slow.coefficients[name].error[0]


def test_parts_at_k_add_up_to_the_pitch_oscillation(coarse: Path) -> None:
    at, pitch = geometry_table(coarse, k=0.2), dynamic(load_geometry(coarse), np.array([0.2]), ("pitch",))
    for coefficient in ("C_L", "C_m"):
        both = value(at, f"{coefficient}q") + value(at, f"{coefficient}alphadot")
        assert both == pytest.approx(pitch.at("pitch", coefficient)[0][0], rel=1e-9)


def test_frequency_does_not_touch_static_values(slow: CoefficientTable, scheduled: CoefficientTable) -> None:
    for name in (*STATIC, "C_L0", "C_D0", "C_m0"):
        assert scheduled.coefficients[name] == slow.coefficients[name]


def test_each_airspeed_has_its_own_k(coarse: Path, scheduled: CoefficientTable) -> None:
    assert scheduled.k == pytest.approx((5.0 * 0.26 / 5.0, 5.0 * 0.26 / 13.0))
    at = geometry_table(coarse, k=0.1)
    for name in (*RATES, *LAGS):
        assert scheduled.coefficients[name].value[1] == pytest.approx(value(at, name), rel=1e-9)
    assert scheduled.coefficients["C_Lalphadot"].value[0] != scheduled.coefficients["C_Lalphadot"].value[1]


def test_vehicle_with_the_table_has_its_coefficients(tmp_path: Path, scheduled: CoefficientTable) -> None:
    for file in library()["reference-evtol"].parent.glob("reference-evtol*"):
        shutil.copy(file, tmp_path)
    path = tmp_path / "reference-evtol.toml"
    text = write_table(scheduled, path)
    vehicle = load_vehicle(path)
    for i, speed in enumerate(scheduled.airspeed):
        for name, given in scheduled.coefficients.items():
            expected = given.value[i % len(given.value)]
            assert vehicle.airframe.aerodynamics.value(name, speed) == pytest.approx(expected, rel=1e-5, abs=1e-8)
    assert "heave oscillation at k = 0.1 to 0.26" in text
    assert "# assumed in the geometry, surface.wing.dihedral: as on the photograph" in text
    assumed = dict(vehicle.assumed)
    assert assumed["aerodynamics.area"] == "geometry coarse: rounded"
    assert "friction" in assumed["aerodynamics.C_D0"]
    assert "aerodynamics.C_mq" not in assumed


def test_zero_for_want_of_a_surface_is_an_assumption(tmp_path: Path) -> None:
    path = tmp_path / "wing.toml"
    path.write_text(
        COARSE[: COARSE.index('[[surface]]\nname = "fin"')]
        .replace("value = 3.0", "value = 0.0")
        .replace("value = 4.0", "value = 0.0")
    )
    table = geometry_table(path)
    for name in ("C_L0", "C_m0", "C_Ybeta", "C_nbeta"):
        assert table.coefficients[name].source is None
        assert "nothing that gives it" in str(table.coefficients[name].assumed)
    assert table.coefficients["C_Lalpha"].assumed is None


def test_value_that_is_not_finite_is_missing(coarse: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*args) -> Derivatives:
        found = dynamic(*args)
        found.quadrature[:, :, NAMES.index("C_m")] = math.nan
        return found

    monkeypatch.setattr(coefficient_table, "dynamic", broken)
    table = geometry_table(coarse)
    assert table.missing == (("C_malphadot", "the computation gives no finite number"),)
    assert "C_malphadot" not in table.coefficients


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"k": 0.1, "omega": 5.0, "speeds": (5.0,)}, "omega: give k or omega, not both"),
        ({"omega": 5.0}, "speeds: omega needs airspeeds"),
        ({"k": 0.1, "speeds": (5.0,)}, "speeds: without omega no coefficient changes with airspeed"),
        ({"omega": 5.0, "speeds": (5.0, 5.0)}, "speeds: must increase, got 5, 5 m/s"),
        ({"omega": 5.0, "speeds": (0.0, 5.0)}, "speeds: 0 is not a positive number"),
        ({"omega": -1.0, "speeds": (5.0,)}, "omega: -1 is not a positive number"),
        ({"k": 0.0}, "k: 0 is not a positive number"),
    ],
)
def test_bad_input_is_named(coarse: Path, given: dict, words: str) -> None:
    with pytest.raises(InputError) as caught:
        geometry_table(coarse, **given)
    assert words in str(caught.value)


@pytest.fixture
def other() -> OtherCode:
    return read_stab(OTHER / "one-condition.stab")


def test_other_code_is_carried_to_zero_incidence(other: OtherCode) -> None:
    table = other_table(other, "m")
    for name in ("C_L", "C_D", "C_m"):
        carried = value(table, f"{name}0") + other.alpha * other.derivatives[f"{name}alpha"]
        assert carried == pytest.approx(other.coefficients[name], rel=1e-12)
    assert other.alpha > 0.01


def test_side_force_of_another_code_is_whole_in_the_flight_model(other: OtherCode) -> None:
    """The model's side force at a small sideslip, (C_Ybeta - C_D) beta, is what the code printed."""
    table = other_table(other, "m")
    drag = value(table, "C_D0") + value(table, "C_Dalpha") * other.alpha
    assert value(table, "C_Ybeta") - drag == pytest.approx(other.derivatives["C_Ybeta"], rel=1e-12)
    assert drag > 0.0


def test_other_codes_have_no_part_in_alphadot(other: OtherCode) -> None:
    for found in (other, replace(read_st(OTHER / "swept-wing.st"), beta=0.0)):
        table = other_table(found, "m")
        for name in LAGS:
            assert value(table, name) == 0.0
            assert "quasi-steady" in str(table.coefficients[name].assumed)
        assert value(table, "C_mq") == found.derivatives["C_mq"]


def test_lengths_of_another_code_need_their_unit(other: OtherCode) -> None:
    in_feet = other_table(other, "ft")
    assert in_feet.area.value[0] == pytest.approx(other.area * 0.3048**2, rel=1e-12)
    assert in_feet.span.value[0] == pytest.approx(other.span * 0.3048, rel=1e-12)
    assert in_feet.coefficients == other_table(other, "m").coefficients
    with pytest.raises(InputError, match="unit"):
        other_table(other, "kg")


def test_what_another_code_does_not_print_is_missing(other: OtherCode, tmp_path: Path) -> None:
    without = replace(other, coefficients={**other.coefficients, "C_D": math.nan})
    table = other_table(without, "m")
    assert [name for name, _ in table.missing] == ["C_Ybeta", "C_D0"]
    for file in library()["reference-evtol"].parent.glob("reference-evtol*"):
        shutil.copy(file, tmp_path)
    text = write_table(table, tmp_path / "reference-evtol.toml")
    assert f"# C_D0 is missing: not in {other.source}" in text
    aero = load_vehicle(tmp_path / "reference-evtol.toml").airframe.aerodynamics
    assert aero.value("C_D0", 5.0) == 0.0183  # the vehicle's own stays
    assert aero.value("C_mq", 5.0) == pytest.approx(other.derivatives["C_mq"], rel=1e-5)


def test_condition_with_sideslip_is_refused() -> None:
    with pytest.raises(InputError, match=r"^swept-wing\.st: beta is 3 deg"):
        other_table(read_st(OTHER / "swept-wing.st"), "m")


def test_drag_derivatives_that_avl_does_not_print_are_missing() -> None:
    table = other_table(replace(read_st(OTHER / "swept-wing.st"), beta=0.0), "m")
    assert {name for name, _ in table.missing} == {"C_Dalpha", "C_Dq", "C_D0"}
