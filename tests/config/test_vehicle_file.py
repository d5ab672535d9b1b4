from __future__ import annotations

import hashlib
import math
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from levelone.config.vehicle_file import library, load_fine_table, load_vehicle, table_hash, vehicle_hash, with_table
from levelone.config.vehicle_schema import VehicleFile
from levelone.errors import InputError
from levelone.vehicle import COEFFICIENTS, SENSOR_CHANNELS

PAPER = tomllib.loads((Path(__file__).parents[1] / "reference" / "paper.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def reference():
    return load_vehicle("reference-evtol")


@pytest.mark.paper
def test_reference_vehicle_holds_what_the_study_prints(reference):
    airframe, printed = reference.airframe, PAPER["vehicle"]
    table_2 = {factor["name"]: factor["value"] for factor in PAPER["factor"]}
    assert airframe.mass.mass == printed["mass"]
    assert (airframe.aerodynamics.chord, airframe.aerodynamics.span) == (printed["chord"], printed["span"])
    assert len(airframe.rotors.spin) == printed["lift_rotors"]
    assert len(airframe.pushers.position) == printed["pushers"]
    assert airframe.mass.I_yy == table_2["I_y"]
    assert (airframe.rotors.K_T, airframe.rotors.T_u, airframe.rotors.tau_d) == (table_2["K_T"], table_2["T_u"], table_2["tau_d"])
    for name in set(table_2) & set(COEFFICIENTS):
        assert airframe.aerodynamics.value(name, PAPER["condition"]["trim_speed"]) == table_2[name]
    assert reference.validity.alpha[1] == pytest.approx(math.radians(PAPER["condition"]["incidence_max_deg"]), rel=1e-15)


def test_angles_are_kept_in_radians(reference):
    assert reference.validity.beta == pytest.approx((-math.pi / 9, math.pi / 9), rel=1e-15)
    assert 0.0 < reference.controller.attitude_limit < math.pi / 2


def test_rotor_layout_is_mirror_symmetric_and_free_of_torque(reference):
    rotors = reference.airframe.rotors
    here = {(*position, spin) for position, spin in zip(rotors.position.tolist(), rotors.spin.tolist(), strict=True)}
    assert here == {(x, -y, z, -spin) for x, y, z, spin in here}
    assert rotors.spin.sum() == 0.0
    np.testing.assert_array_equal(rotors.position.T @ rotors.spin, np.zeros(3))  # no yaw under a pitch or roll command


def test_the_design_of_the_controller_is_the_vehicle_itself(reference):
    assert reference.controller.design is reference.airframe


def test_everything_assumed_is_listed_with_its_reason(reference):
    assumed = dict(reference.assumed)
    assert {"mass.I_xx", "mass.I_zz", "aerodynamics.C_Ybeta", "rotors.table", "rotors.spin", "controller", "validity.alpha"} <= set(
        assumed
    )
    assert "mass.mass" not in assumed
    assert "aerodynamics.C_mq" not in assumed
    assert any("C_Ldelta_e" in field for field in assumed)
    assert all(len(why) > 10 for why in assumed.values())


def test_copy_with_changed_units_is_the_same_vehicle(vehicle_file, reference):
    copy = load_vehicle(
        vehicle_file(
            ('value = 7.0, unit = "kg"', 'value = 7000, unit = "g"'),
            ('value = 5.1270, unit = "1/rad"', 'value = 0.0894830307479, unit = "1/deg"'),
            ('value = [-13.0, 13.0], unit = "deg"', 'value = [-0.2268928027592628, 0.2268928027592628], unit = "rad"'),
        )
    )
    assert copy.airframe.mass.mass == reference.airframe.mass.mass
    assert copy.airframe.aerodynamics.value("C_Lalpha", 5.0) == pytest.approx(0.0894830307479 * 180 / math.pi, rel=1e-15)
    assert copy.validity.alpha == pytest.approx(reference.validity.alpha, rel=1e-15)


def test_coefficients_over_airspeed_pass_through_their_knots(vehicle_file):
    path = vehicle_file(
        (
            "C_L0 = { value = 0.7745",
            'airspeed = { value = [0, 5, 10], unit = "m/s", source = "test" }\nC_L0 = { value = [0.7, 0.8, 1.0]',
        ),
    )
    aerodynamics = load_vehicle(path).airframe.aerodynamics
    assert [aerodynamics.value("C_L0", v) for v in (0.0, 5.0, 10.0, 30.0)] == pytest.approx([0.7, 0.8, 1.0, 1.0], rel=1e-15)
    assert [aerodynamics.value("C_mq", v) for v in (0.0, 7.0)] == [-16.169, -16.169]


def test_optional_parts_have_the_documented_defaults(vehicle_file):
    text = library()["reference-evtol"].read_text(encoding="utf-8")
    pushers = text[text.index("[pushers]") : text.index("[controller]\n")]
    vehicle = load_vehicle(
        vehicle_file(
            (pushers, ""),
            (
                'velocity = "centre',
                "axis = { value = [" + "[0, 0, -1]," * 8 + '], unit = "1", source = "test" }\nvelocity = "centre',
            ),
        )
    )
    assert vehicle.airframe.pushers.position.shape == (0, 3)
    np.testing.assert_array_equal(vehicle.airframe.rotors.effectiveness, np.ones(8))
    np.testing.assert_array_equal(vehicle.airframe.rotors.axis, np.tile([0.0, 0.0, -1.0], (8, 1)))
    np.testing.assert_array_equal(vehicle.sensors.delay, np.zeros(len(SENSOR_CHANNELS)))


def test_sensors_take_lag_and_whole_periods_of_delay(vehicle_file):
    lag, delay = (f'{{ value = {ms}, unit = "ms", source = "test" }}' for ms in (5, 8))
    sensor = f"[sensors.q]\nlag = {lag}\ndelay = {delay}\n\n[validity]"
    sensors = load_vehicle(vehicle_file(("[validity]", sensor))).sensors
    place = SENSOR_CHANNELS.index("q")
    assert sensors.lag[place] == pytest.approx(0.005, rel=1e-15)
    assert sensors.delay[place] == 2
    assert np.count_nonzero(sensors.lag) == np.count_nonzero(sensors.delay) == 1


SENSOR = '[sensors.q]\ndelay = { value = 5, unit = "ms", source = "test" }\n\n[validity]'
ORIGIN = 'source = "study, Table 1 (maximum gross)"'
FAULTS = [
    # sections and keys
    (("[mass]\nmass", "[mass]\nmas"), "mass: unknown name 'mas'; did you mean 'mass'?"),
    (("C_Lalpha =", "C_Lalfa ="), "aerodynamics: unknown name 'C_Lalfa'; did you mean 'C_Lalpha'?"),
    (("[environment]", "[enviroment]"), "unknown name 'enviroment'; did you mean 'environment'?"),
    (("[validity]", "[sensors.qq]\n\n[validity]"), "sensors: unknown name 'qq'"),
    (("[controller.roll_rate]\nKp", "[controller.roll_rate]\nKP"), "controller.roll_rate: unknown name 'KP'; did you mean 'Kp'?"),
    (("gravity = {", "#"), "environment.gravity: missing"),
    (("moment_reference =", "#"), "aerodynamics.moment_reference: missing"),
    (
        ('velocity = "centre of gravity"', 'velocity = "center of gravity"'),
        "rotors.velocity: 'center of gravity' is not among the choices; did you mean 'c",
    ),
    # the form of a number
    (("value = 7.0, ", "value = 7.0, unt = 1, "), "mass.mass: unknown name 'unt'; did you mean 'unit'?"),
    (("value = 7.0, ", ""), "mass.mass.value: missing"),
    (('value = 7.0, unit = "kg", ', "value = 7.0, "), "mass.mass.unit: missing"),
    (("{ value = 7.0", '{ value = "7.0"'), "mass.mass: is '7.0'; must be a number"),
    (("{ value = 7.0", "{ value = true"), "mass.mass: is True; must be a number"),
    (("{ value = 7.0", "{ value = [7.0]"), "mass.mass: is [7.0]; must be a number"),
    (("{ value = 7.0", "{ value = nan"), "mass.mass: is nan; must be a number, finite"),
    (("{ value = 7.0", "{ value = inf"), "mass.mass: is inf; must be a number, finite"),
    (("{ value = 7.0", "{ value = []"), "mass.mass: is []; must be a number"),
    (("mass = { value = 7.0", "mass = 7.0 #"), "mass.mass: is 7.0; "),
    # origin
    ((ORIGIN, ORIGIN + ', assumed = "no"'), "mass.mass: either source or assumed, not both"),
    ((", " + ORIGIN, ""), "mass.mass: neither source nor assumed"),
    ((ORIGIN, 'source = ""'), "mass.mass.source: is ''"),
    (("unpublished.\nassumed =", "\n#"), "controller.rate: neither source nor assumed"),
    (
        ('fine_file = "reference-evtol-rotor-fine.csv", assumed = "blade', 'fine_file = "x.csv" } # "blade'),
        "rotors.table: neither source nor assumed",
    ),
    # units
    (('value = 7.0, unit = "kg"', 'value = 7.0, unit = "kgg"'), "mass.mass: unknown unit 'kgg', expected kg; did you mean 'kg'?"),
    (('value = 7.0, unit = "kg"', 'value = 7.0, unit = "N"'), "mass.mass: unit 'N' does not fit, expected kg"),
    (
        ('value = 5.1270, unit = "1/rad"', 'value = 5.1270, unit = "1"'),
        "aerodynamics.C_Lalpha: unit '1' does not fit, expected 1/rad",
    ),
    (
        ("[controller.roll_rate]\nKp = {", '[controller.roll_rate]\nKp = { value = 8.0, unit = "1/s^2" } #'),
        "controller.roll_rate.Kp: unit '1/s^2' does not fit, expected 1/s",
    ),
    # values
    (("{ value = 7.0", "{ value = 0.0"), "mass.mass: must be positive, got 0.0"),
    (('{ value = 1.2, unit = "kg m^2"', '{ value = -1.2, unit = "kg m^2"'), "mass.I_xx: must be positive, got -1.2"),
    (("I_xz = { value = 0.0", "I_xz = { value = 3.0"), "mass.I_xz: 3.0 makes the inertia matrix indefinite"),
    (("tau_d = { value = 0.0", "tau_d = { value = -0.1"), "rotors.tau_d: must not be negative, got -0.1"),
    (("value = 1.225", "value = 0"), "environment.air_density: must be positive, got 0"),
    (("value = 250.0", "value = 0.0"), "controller.rate: must be positive"),
    (("throttle_max = { value = 1.0", "throttle_max = { value = 1.5"), "controller.throttle: needs 0 <= min < max <= 1"),
    (("value = [-13.0, 13.0]", "value = [13.0, -13.0]"), "validity.alpha: range reversed or empty"),
    (("value = [-13.0, 13.0]", "value = [-13.0]"), "validity.alpha: is [-13.0]; must be a list of 2 numbers"),
    (("value = [-5.0, 15.0, 1.0]", "value = [-5.0, 15.0, 3.0]"), "controller.trim_speeds: needs [first, last, step]"),
    (("value = [-5.0, 15.0, 1.0]", "value = [-5.0, 15.0, 0.0]"), "controller.trim_speeds: needs [first, last, step]"),
    # arrays
    (("[1, -1, -1, 1, -1, 1, 1, -1]", "[1, -1, -1, 1, -1, 1, 1]"), "rotors.spin: has 7 entries, and position has 8"),
    (("[1, -1, -1, 1, -1, 1, 1, -1]", "[1, -1, -1, 1, -1, 1, 1, 0]"), "rotors.spin: must be +1 or -1"),
    (("[ 0.40,  0.45, 0.0]", "[ 0.40,  0.45]"), "rows differ in length, must be a list of rows of 3 numbers"),
    (
        ("C_L0 = { value = 0.7745", "C_L0 = { value = [0.7, 0.8]"),
        "aerodynamics.C_L0: has 2 values, and aerodynamics.airspeed gives no speeds",
    ),
    (
        ("C_L0 = { value = 0.7745", 'airspeed = { value = [0, 5, 9], unit = "m/s", source = "t" }\nC_L0 = { value = [0.7, 0.8]'),
        "aerodynamics.C_L0: has 2 values for the 3 speeds",
    ),
    (
        ("C_L0 = {", 'airspeed = { value = [5, 0], unit = "m/s", source = "t" }\nC_L0 = {'),
        "aerodynamics.schedule: knots must increase",
    ),
    (
        ("max_thrust", 'axis = { value = [[2, 0, 0], [1, 0, 0]], unit = "1", source = "t" }\nmax_thrust'),
        "pushers.axis: must be unit vectors",
    ),
    # sensors
    (("[validity]", SENSOR), "sensors.q.delay: 0.005 s is no whole number of control periods of 0.004 s; the nearest is 0.004 s"),
    # tables
    (('file = "reference-evtol-rotor.csv"', 'file = "none.csv"'), "rotors.table.file: no such file"),
    (
        ('file = "reference-evtol-rotor.csv"', 'file = "../rotor.csv"'),
        "rotors.table.file: '../rotor.csv' must be a path relative to craft.toml that stays in its folder",
    ),
    (
        ('file = "reference-evtol-rotor.csv"', 'file = "/etc/hostname"'),
        "rotors.table.file: '/etc/hostname' must be a path relative",
    ),
    (('file = "reference-evtol-rotor.csv"', "file = 'C:\\rotor.csv'"), "must be a path relative"),
    (("[mass]\n", "[mass\n"), "craft.toml: is not a TOML file: "),
]


@pytest.mark.parametrize(("change", "problem"), FAULTS, ids=[problem[:40] for _, problem in FAULTS])
def test_a_bad_file_is_refused_on_one_line_that_names_the_field(vehicle_file, change, problem):
    path = vehicle_file(change)
    with pytest.raises(InputError) as caught:
        load_vehicle(path)
    text = str(caught.value)
    assert text.startswith("craft.toml: ")
    assert problem in text
    assert "\n" not in text
    assert "pydantic" not in text


def test_a_table_behind_a_link_out_of_the_folder_is_refused(vehicle_file, tmp_path):
    path = vehicle_file(('file = "reference-evtol-rotor.csv"', 'file = "link.csv"'))
    (tmp_path / "link.csv").symlink_to("/etc/hostname")
    with pytest.raises(InputError, match="stays in its folder"):
        load_vehicle(path)


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("reference-evto", "did you mean 'reference-evtol'?"),
        ("craft", "allowed: "),
        ("none.toml", "no such file"),
        (".", "unknown name '.'"),
    ],
)
def test_unknown_names_and_paths_are_refused(name, problem):
    with pytest.raises(InputError) as caught:
        load_vehicle(name)
    assert problem in str(caught.value)


def test_fine_table_holds_the_coarse_one(reference):
    fine, coarse = load_fine_table("reference-evtol"), reference.airframe.rotors.table
    np.testing.assert_array_equal(fine.values[::2, ::2, ::2], coarse.values)


def test_a_vehicle_flies_with_another_table(reference):
    fine = load_fine_table("reference-evtol")
    other = with_table(reference, fine)
    assert other.airframe.rotors.table is fine
    assert other.controller.design.rotors.table is fine
    assert other.airframe.mass == reference.airframe.mass
    assert reference.airframe.rotors.table is not fine


def test_a_file_without_a_fine_table_has_none(vehicle_file):
    assert load_fine_table(vehicle_file(('fine_file = "reference-evtol-rotor-fine.csv", ', ""))) is None


def test_hashes_change_with_the_file_and_with_each_table(vehicle_file, tmp_path):
    shutil.copy(library()["reference-evtol"].parent / "reference-evtol-rotor-fine.csv", tmp_path)
    path, table = vehicle_file(), tmp_path / "reference-evtol-rotor.csv"
    assert table_hash(path) == hashlib.sha256(table.read_bytes()).hexdigest()
    seen = {vehicle_hash(path), vehicle_hash("reference-evtol")}
    assert len(seen) == 1  # the same contents at another place
    for changed in (path, table, tmp_path / "reference-evtol-rotor-fine.csv"):
        changed.write_bytes(changed.read_bytes() + b"\n")
        seen.add(vehicle_hash(path))
    assert len(seen) == 4


def test_every_number_of_the_library_has_an_origin_and_a_unit():
    for path in library().values():
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        VehicleFile.model_validate(content)
        assert load_vehicle(path).name == path.stem
