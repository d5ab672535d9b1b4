"""A written section is what the table holds, and the vehicle that gets it flies with these numbers."""

from __future__ import annotations

import math
import shutil
import tomllib
from pathlib import Path

import pytest
import tomlkit

from levelone.config.table_writer import Coefficient, CoefficientTable, provenance, rounded, table_text, write_table
from levelone.config.vehicle_file import library, load_vehicle
from levelone.errors import InputError
from levelone.vehicle import COEFFICIENTS

REFERENCE = library()["reference-evtol"]
FROM = "a geometry"
LENGTHS = {"area": 0.64, "chord": 0.25, "span": 2.5}
NAMES = [name for name in COEFFICIENTS if "delta" not in name]


def made(**changes) -> CoefficientTable:
    values = {name: Coefficient((0.1 * i - 1.03,), (0.01,), FROM) for i, name in enumerate(NAMES)}
    given = {name: Coefficient((value,), (0.0,), FROM) for name, value in LENGTHS.items()}
    table = {"moment_reference": 'the "point"', "airspeed": (), "k": (), "coefficients": values, "notes": ("holds for all",)}
    return CoefficientTable(**{**given, **table, **changes})


def with_entry(name: str, *values: float, **changes) -> CoefficientTable:
    entry = Coefficient(values, tuple(0.01 for _ in values), FROM)
    return made(coefficients={**made().coefficients, name: entry}, **changes)


@pytest.fixture
def vehicle_copy(tmp_path: Path) -> Path:
    for file in REFERENCE.parent.glob("reference-evtol*"):
        shutil.copy(file, tmp_path)
    return tmp_path / REFERENCE.name


def test_vehicle_with_the_section_has_its_numbers(vehicle_copy: Path) -> None:
    table = made()
    write_table(table, vehicle_copy)
    aero = load_vehicle(vehicle_copy).airframe.aerodynamics
    assert {name: aero.value(name, 5.0) for name in NAMES} == {name: rounded(table.coefficients[name].value[0]) for name in NAMES}
    assert (aero.area, aero.chord, aero.span) == tuple(LENGTHS.values())


def test_all_but_the_section_stays_as_it_was(vehicle_copy: Path) -> None:
    before = vehicle_copy.read_text()
    write_table(made(), vehicle_copy)
    after = vehicle_copy.read_text()
    old, new = (tomllib.loads(text) for text in (before, after))
    assert {**old, "aerodynamics": 0} == {**new, "aerodynamics": 0}
    assert before[: before.index("[aerodynamics]")] == after[: after.index("[aerodynamics]")]
    assert before[before.index("[rotors]") :] == after[after.index("[rotors]") :]


def test_schedule_over_airspeed_is_read_back_at_its_knots(vehicle_copy: Path) -> None:
    write_table(with_entry("C_mq", -14.0, -16.5, -17.0, airspeed=(2.0, 5.0, 10.0), k=(0.5, 0.2, 0.1)), vehicle_copy)
    aero = load_vehicle(vehicle_copy).airframe.aerodynamics
    assert [aero.value("C_mq", v) for v in (0.0, 2.0, 5.0, 10.0, 20.0)] == pytest.approx([-14.0, -14.0, -16.5, -17.0, -17.0])
    assert aero.value("C_Lq", 2.0) == pytest.approx(aero.value("C_Lq", 10.0), rel=1e-12)


def test_errors_origins_and_notes_are_in_the_text() -> None:
    text = table_text(made())
    assert "# holds for all" in text
    assert 'C_L0 = { value = -1.03, unit = "1", source = "a geometry" } # +- 0.01' in text
    assert 'moment_reference = "the \\"point\\""' in text


def test_text_of_several_lines_stays_one_comment() -> None:
    content = tomllib.loads(table_text(made(notes=("one\nC_L0 = 5\r\ntwo",), missing=(("C_Yp", "lost\n[x]"),))))
    assert list(content) == ["aerodynamics"]
    assert content["aerodynamics"]["C_L0"]["value"] == -1.03


def test_values_without_error_bar_get_none() -> None:
    entry = Coefficient((-0.5,), (math.nan,), assumed="because")
    line = next(line for line in table_text(made(coefficients={"C_lp": entry})).splitlines() if line.startswith("C_lp"))
    assert line == 'C_lp = { value = -0.5, unit = "1/rad", assumed = "because" }'


def test_assumed_values_are_assumptions_of_the_vehicle(vehicle_copy: Path) -> None:
    entry = Coefficient((0.02,), (0.001,), assumed="no friction in it")
    write_table(made(coefficients={**made().coefficients, "C_D0": entry}), vehicle_copy)
    assert ("aerodynamics.C_D0", "no friction in it") in load_vehicle(vehicle_copy).assumed
    assert "aerodynamics" not in dict(load_vehicle(vehicle_copy).assumed)


def test_control_surfaces_of_the_old_section_stay(vehicle_copy: Path) -> None:
    text = vehicle_copy.read_text()
    vehicle_copy.write_text(text.replace("\nC_Ybeta =", '\nC_mdelta_e = { value = -1.25, unit = "1/rad" }\nC_Ybeta =', 1))
    write_table(made(), vehicle_copy)
    vehicle = load_vehicle(vehicle_copy)
    assert vehicle.airframe.aerodynamics.value("C_mdelta_e", 5.0) == -1.25
    assert "aerodynamics" in dict(vehicle.assumed)  # its origin was that of the section


def test_missing_coefficient_of_the_old_section_stays(vehicle_copy: Path) -> None:
    rest = {name: each for name, each in made().coefficients.items() if name != "C_D0"}
    write_table(made(coefficients=rest, missing=(("C_D0", "not in x.st"),)), vehicle_copy)
    assert load_vehicle(vehicle_copy).airframe.aerodynamics.value("C_D0", 5.0) == 0.0183
    assert "# C_D0 is missing: not in x.st" in vehicle_copy.read_text()


def test_schedule_of_the_old_section_must_fit(vehicle_copy: Path) -> None:
    knots = 'airspeed = { value = [1.0, 2.0], unit = "m/s" }\nC_mdelta_e = { value = [-1.0, -2.0], unit = "1/rad" }'
    vehicle_copy.write_text(vehicle_copy.read_text().replace("\nC_Ybeta =", f"\n{knots}\nC_Ybeta =", 1))
    with pytest.raises(InputError, match="C_mdelta_e: is a schedule over other airspeeds"):
        write_table(made(), vehicle_copy)


def test_vehicle_that_would_not_load_stays_as_it_was(vehicle_copy: Path) -> None:
    before = vehicle_copy.read_text()
    with pytest.raises(InputError, match=r"^reference-evtol\.toml: aerodynamics\.schedule: knots must increase"):
        write_table(with_entry("C_mq", -14.0, -16.0, airspeed=(5.0, 2.0), k=(0.2, 0.5)), vehicle_copy)
    assert vehicle_copy.read_text() == before
    assert sorted(file.name for file in vehicle_copy.parent.iterdir()) == sorted(
        file.name for file in REFERENCE.parent.glob("reference-evtol*")
    )


def test_new_file_holds_the_section_alone(tmp_path: Path) -> None:
    text = write_table(made(), tmp_path / "part.toml")
    assert (tmp_path / "part.toml").read_text() == text
    assert list(tomllib.loads(text)) == ["aerodynamics"]


def test_no_other_file_is_touched(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text("[study]\nname = 'x'\n")
    with pytest.raises(InputError, match=r"study\.toml: is no vehicle file"):
        write_table(made(), path)
    assert path.read_text() == "[study]\nname = 'x'\n"


def test_rounding_of_zero_is_zero() -> None:
    assert [rounded(value) for value in (1e-12, -1e-12, 123456.7, -0.0012345678)] == [0.0, 0.0, 123457.0, -0.00123457]


def test_text_is_the_same_after_a_second_round() -> None:
    text = table_text(made())
    assert tomlkit.dumps(tomlkit.parse(text)) == text
    assert [line.split(" ")[0] for line in text.splitlines() if line.startswith("C_")] == NAMES


def test_provenance_names_version_geometry_hash_and_grid() -> None:
    from levelone import __version__
    from levelone.config.files import file_hash
    from levelone.config.geometry_file import geometries, load_geometry

    sha = file_hash(geometries()["reference-wing-tail"])
    text = provenance("reference-wing-tail", load_geometry("reference-wing-tail"))
    assert (
        text == f"levelone {__version__}, geometry reference-wing-tail ({sha[:12]}), 8 x 10 + 4 x 4 panels and finer, extrapolated"
    )
