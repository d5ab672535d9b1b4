from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from levelone.aerodynamics.geometry import Surface, mean_line, mean_slope
from levelone.config.geometry_file import geometries, load_geometry
from levelone.config.geometry_schema import GeometryFile, naca_mean_line
from levelone.config.quantities import Quantity
from levelone.config.schema import Strict
from levelone.errors import InputError

ROOT = Path(__file__).parents[2]
PRINTED = tomllib.loads((ROOT / "tests" / "reference" / "paper.toml").read_text(encoding="utf-8"))["vehicle"] | {
    "wing_incidence_deg": 4.5, "tail_span": 0.721, "tail_chord": 0.13, "tail_arm": 1.08, "tail_incidence_deg": 0.0,
}  # fmt: skip
"""The study's Table 1."""
PAGE = (ROOT / "docs" / "reference" / "geometry-file.md").read_text(encoding="utf-8")
PLAIN = """
[geometry]
name = "plain"
reference = { area = 0.78, chord = 0.26, span = 3.0, point = [0.0, 0.0, 0.0] }

[[surface]]
name = "wing"
position = [0.0, 0.0, 0.0]
span = 3.0
chord = 0.26
"""


@pytest.fixture
def geometry_file(tmp_path):
    def write(text: str, *changes: tuple[str, str]) -> Path:
        for old, new in changes:
            assert text.count(old) == 1
            text = text.replace(old, new)
        path = tmp_path / "craft.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.paper
def test_the_shipped_geometries_hold_what_the_study_prints():
    wing, pair, whole = (load_geometry(name) for name in ("reference-wing", "reference-wing-tail", "reference-evtol"))
    assert pair.surfaces[0] == wing.surfaces[0]
    assert replace(whole.surfaces[1], strips=4) == pair.surfaces[1]
    for geometry in (wing, pair, whole):
        assert (geometry.area, geometry.chord, geometry.span) == (0.78, PRINTED["chord"], PRINTED["span"])
        assert geometry.reference_point == (0.0, 0.0, 0.0)
        main = geometry.surfaces[0]
        assert (2.0 * main.span, main.root_chord, main.tip_chord, main.twist) == (
            PRINTED["span"],
            PRINTED["chord"],
            PRINTED["chord"],
            0,
        )
    tail = pair.surfaces[1]
    assert (2.0 * tail.span, tail.root_chord, tail.tip_chord) == (
        PRINTED["tail_span"],
        PRINTED["tail_chord"],
        PRINTED["tail_chord"],
    )
    assert tail.position == (PRINTED["tail_arm"], 0.0, 0.0)
    assert [surface.incidence for surface in pair.surfaces] == [0.0, 0.0]
    assert whole.surfaces[0].incidence == pytest.approx(math.radians(PRINTED["wing_incidence_deg"]), rel=1e-15)
    assert tail.incidence == PRINTED["tail_incidence_deg"]


def test_panels_of_wing_and_tail_are_equally_long():
    wing, tail, plate = load_geometry("reference-evtol").surfaces
    assert {surface.root_chord / surface.chordwise for surface in (wing, tail, plate)} == {0.0325}
    assert [(surface.chordwise, surface.strips) for surface in (wing, tail, plate)] == [(8, 15), (4, 6), (4, 8)]


def test_end_plates_stand_on_the_tips_of_the_tail():
    tail, plate = load_geometry("reference-evtol").surfaces[1:]
    assert plate.mirrored
    assert plate.position == (tail.position[0], tail.span, -0.5 * plate.span)
    assert plate.dihedral == pytest.approx(math.pi / 2, rel=1e-15)


def test_everything_assumed_is_listed_with_its_reason():
    assumed = dict(load_geometry("reference-evtol").assumed)
    assert {"geometry.reference.area", "surface.tail.position", "surface.end plate.span", "surface.end plate.chord"} <= set(assumed)
    assert not {"surface.wing.span", "surface.wing.incidence", "geometry.reference.chord"} & set(assumed)
    assert all(len(why) > 10 for why in assumed.values())


@pytest.mark.parametrize("name", geometries())
def test_shipped_geometries_are_called_as_their_files(name):
    assert load_geometry(name).name == name


def test_a_plain_file_and_one_in_other_units_are_the_same(geometry_file):
    plain = load_geometry(geometry_file(PLAIN))
    units = geometry_file(
        PLAIN,
        ("chord = 0.26\n", 'chord = { value = 26, unit = "cm" }\nincidence = { value = 0, unit = "deg", source = "level" }\n'),
        ("area = 0.78", 'area = { value = 7800, unit = "cm^2" }'),
        ("position = [0.0, 0.0, 0.0]", 'position = { value = [0, 0, 0], unit = "ft" }'),
    )
    assert load_geometry(units) == plain
    assert plain.surfaces == (Surface("wing", (0.0, 0.0, 0.0), 1.5, 0.26, 0.26),)
    assert plain.assumed == ()


def test_span_is_tip_to_tip_only_where_the_halves_join(geometry_file):
    def span(*changes):
        return load_geometry(geometry_file(PLAIN, *changes)).surfaces[0].span

    at = "position = [0.0, 0.0, 0.0]"
    assert span() == 1.5
    assert span((at, "position = [0.0, 0.1, 0.0]")) == 3.0
    assert span(("chord = 0.26\n", "chord = 0.26\nmirrored = false\n")) == 3.0


def test_reference_values_left_out_are_those_of_the_first_surface_and_assumed(geometry_file):
    taken = load_geometry(
        geometry_file(PLAIN, (", span = 3.0, point = [0.0, 0.0, 0.0]", ""), ("area = 0.78, chord = 0.26", "area = 0.7"),
                      ("chord = 0.26\n", "root_chord = 0.3\ntip_chord = 0.15\n"), ("n = [0.0, 0", "n = [0.4, 0"))
    )  # fmt: skip
    assert (taken.area, taken.span, taken.reference_point) == (0.7, 3.0, (0.4, 0.0, 0.0))
    assert taken.chord == pytest.approx(0.7 / 3.0, rel=1e-15)  # 2/3 0.3 (1 + 1/2 + 1/4) / (1 + 1/2)
    assert [name for name, _ in taken.assumed] == [f"geometry.reference.{name}" for name in ("chord", "span", "point")]
    whole = load_geometry(
        geometry_file(PLAIN, ("reference = { area = 0.78, chord = 0.26, span = 3.0, point = [0.0, 0.0, 0.0] }", ""))
    )
    assert whole.area == pytest.approx(0.78, rel=1e-15)
    with pytest.raises(InputError, match=r"geometry\.reference\.area: missing: the first surface, 'wing', has two separate halves"):
        load_geometry(geometry_file(PLAIN, ("area = 0.78, ", ""), ("position = [0.0, 0.0", "position = [0.0, 0.5")))


def test_an_origin_of_a_whole_surface_is_listed_once(geometry_file):
    assumed = load_geometry(geometry_file(PLAIN, ('name = "wing"', 'name = "wing"\nassumed = "from a photograph"'))).assumed
    assert assumed == (("surface.wing", "from a photograph"),)


@pytest.mark.theory
@pytest.mark.parametrize(("name", "height", "place"), [("NACA 4412", 0.04, 0.4), ("naca2515", 0.02, 0.5), ("NACA-6109", 0.06, 0.1)])
def test_naca_mean_lines(geometry_file, name, height, place):
    """Height, and zero-lift angle of thin-aerofoil theory with the slope as the equations of the section give it."""
    surface = load_geometry(geometry_file(PLAIN, ("chord = 0.26\n", f'chord = 0.26\ncamber = "{name}"\n'))).surfaces[0]

    def slope(x):
        return 2.0 * height * (place - x) / (place if x < place else 1.0 - place) ** 2

    def zero_lift(gradient):
        """Anderson, Fundamentals of Aerodynamics, equation 4.61."""

        def share(theta):
            return gradient(0.5 * (1.0 - math.cos(theta))) * (math.cos(theta) - 1.0)

        return -quad(share, 0.0, math.pi, points=[math.acos(1.0 - 2.0 * place)], limit=500)[0] / math.pi

    assert float(mean_line(surface, place)) == pytest.approx(height, abs=1e-12)
    assert zero_lift(lambda x: float(mean_slope(surface, x))) == pytest.approx(zero_lift(slope), rel=2e-3)
    if name == "NACA 4412":
        assert math.degrees(zero_lift(slope)) == pytest.approx(-4.15, abs=0.01)


def test_symmetric_sections_and_flat_are_no_camber(geometry_file):
    for name in ("NACA 0012", "flat"):
        path = geometry_file(PLAIN, ("chord = 0.26\n", f'chord = 0.26\ncamber = {{ value = "{name}", source = "drawing" }}\n'))
        assert load_geometry(path).surfaces[0].camber == ()
    assert naca_mean_line(0.0, 0.0) == ()


WING = "chord = 0.26\n"
BAD = [
    ((WING, "chord = 0.0\n"), "surface.wing.chord: must be positive, got 0.0"),
    ((WING, "chord = -1\n"), "surface.wing.chord: must be positive, got -1"),
    ((WING, ""), "surface.wing.chord: either chord, or root_chord and tip_chord; neither is there"),
    ((WING, "root_chord = 0.3\n"), "surface.wing.chord: either chord, or root_chord and tip_chord; got root_chord"),
    ((WING, WING + "tip_chord = 0.1\n"), "surface.wing.chord: either .*; got chord and tip_chord"),
    (("span = 3.0\n", "span = 0\n"), "surface.wing.span: must be positive, got 0"),
    (("span = 3.0\n", ""), "surface.wing.span: missing"),
    (("span = 3.0\n", 'span = "three"\n'), "surface.wing.span: is 'three'; must be a number"),
    (("span = 3.0\n", "span = nan\n"), "surface.wing.span: is nan; must be a number, finite"),
    (("span = 3.0\n", 'span = { value = 3, unit = "deg" }\n'), "surface.wing.span: unit 'deg' does not fit, expected m"),
    (("span = 3.0\n", "span = { value = 3 }\n"), "surface.wing.span.unit: missing"),
    (("span = 3.0\n", 'span = { value = 3, unit = "m", source = "a", assumed = "b" }\n'), "surface.wing.span.*either source or a"),
    (("position = [0.0, 0.0, 0.0]", "position = [0.0, 0.0]"), "surface.wing.position: is .*; must be a list of 3 numbers"),
    (("position = [0.0, 0.0, 0.0]", "position = [0.0, -0.5, 0.0]"), "surface.wing.position: y = -0.5 m: a mirrored surface"),
    ((WING, WING + "dihedrel = 0.1\n"), "surface.wing: unknown name 'dihedrel'; did you mean 'dihedral'"),
    ((WING, WING + "incidence = 4.5\n"), "surface.wing.incidence: 4.5 rad .*outside -45 to 45 deg"),
    ((WING, WING + "panels = [8]\n"), r"surface.wing.panels: is \[8\]"),
    ((WING, WING + "panels = [8, 0]\n"), "surface.wing.panels.2: is 0; "),
    ((WING, WING + "panels = [8.0, 10]\n"), "surface.wing.panels.1: is 8.0; "),
    ((WING, WING + 'spacing = ["uniform", "cosin"]\n'), "surface.wing.spacing.2: 'cosin' is not .*; did you mean 'cosine'"),
    ((WING, WING + "mirrored = 1\n"), "surface.wing.mirrored: is 1; "),
    ((WING, WING + 'camber = "NACA 23012"\n'), "surface.wing.camber: is 'NACA 23012'; must be .*4-digit"),
    ((WING, WING + 'camber = "NACA 4012"\n'), "surface.wing.camber: is 'NACA 4012'"),
    ((WING, WING + "camber = [[0, 0], [1]]\n"), "surface.wing.camber: is .*rows of 2 numbers"),
    ((WING, WING + "camber = [[0, 0], [0.5, nan], [1, 0]]\n"), "surface.wing.camber: is .*rows of 2 numbers"),
    ((WING, WING + "camber = [[0, 0], [0.5, 0.02]]\n"), r"surface.wing.camber: must run from \(0, 0\) to \(1, 0\)"),
    (("area = 0.78", "area = -0.78"), "geometry.reference.area: must be positive"),
    (("area = 0.78", "surface = 0.78"), "geometry.reference: unknown name 'surface'"),
    (('name = "plain"', ""), "geometry.name: missing"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "words"), BAD)
def test_bad_files_are_refused_with_the_path_of_the_value(geometry_file, change, words):
    with pytest.raises(InputError, match=f"^craft.toml: {words}") as error:
        load_geometry(geometry_file(PLAIN, change))
    assert "\n" not in str(error.value)


def test_surfaces_that_intersect_are_refused_by_name(geometry_file):
    tail = '\n[[surface]]\nname = "tail"\nposition = [0.05, 0.0, 0.0]\nspan = 0.7\nchord = 0.13\n'
    with pytest.raises(InputError, match=r"^craft\.toml: surface: 'wing' and 'tail' intersect near"):
        load_geometry(geometry_file(PLAIN + tail))
    with pytest.raises(InputError, match=r"^craft\.toml: surface: two surfaces are called 'wing'"):
        load_geometry(geometry_file(PLAIN + tail.replace("tail", "wing").replace("0.05", "1.0")))


def test_files_without_surfaces_or_of_another_kind_are_refused(geometry_file, tmp_path):
    with pytest.raises(InputError, match=r"craft\.toml: surface: missing"):
        load_geometry(geometry_file('[geometry]\nname = "empty"\n'))
    with pytest.raises(InputError, match=r"craft\.toml: is not a TOML file"):
        load_geometry(geometry_file("[geometry"))
    with pytest.raises(InputError, match="no such file"):
        load_geometry(tmp_path / "none.toml")


def test_an_unknown_name_is_answered_with_the_closest():
    with pytest.raises(InputError, match="geometry: unknown name 'reference-wings'; did you mean 'reference-wing'"):
        load_geometry("reference-wings")


def keys_of(model):
    for name, field in model.model_fields.items():
        yield name
        parts = [field.annotation, *getattr(field.annotation, "__args__", ())]
        for part in parts:
            if isinstance(part, type) and issubclass(part, Strict) and not issubclass(part, Quantity):
                yield from keys_of(part)


def test_the_page_names_every_key_and_every_shipped_geometry():
    words = {f"`{key}`" for key in keys_of(GeometryFile)} - {"`geometry`", "`surface`", "`value`"}
    assert len(words) >= 20
    assert sorted(word for word in [*words, *(f"`{name}`" for name in geometries())] if word not in PAGE) == []


def test_the_example_of_the_page_is_what_the_page_says(geometry_file):
    (example,) = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
    geometry = load_geometry(geometry_file(example))
    wing, tail, plate = geometry.surfaces
    assert (wing.span, wing.root_chord, wing.tip_chord, wing.chordwise, wing.strips) == (1.25, 0.3, 0.21, 8, 20)
    angles = [wing.sweep, wing.dihedral, wing.twist, wing.incidence]
    np.testing.assert_allclose(np.degrees(angles), [2.0, 3.0, -2.0, 4.0], rtol=1e-14)
    assert mean_line(wing, 0.4) == pytest.approx(0.02, abs=1e-15)
    assert (tail.span, tail.camber[1], plate.span, plate.position[1]) == (0.35, (0.25, -0.01), 0.2, 0.35)
    assert (geometry.chord, geometry.reference_point) == (0.26, (0.02, 0.0, 0.0))
    assert [name for name, _ in geometry.assumed] == ["geometry.reference.point", "surface.wing.twist", "surface.end plate"]
