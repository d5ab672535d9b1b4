from __future__ import annotations

import math
import re
import shutil
import textwrap
import tomllib
from collections.abc import Callable
from dataclasses import FrozenInstanceError, asdict
from pathlib import Path

import numpy as np
import pytest

from levelone.config.study_file import load_study
from levelone.errors import InputError
from levelone.vehicle import TARGETS, nominal_value

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "studies" / "reference" / "study.toml"
PRINTED = tomllib.loads((ROOT / "tests" / "reference" / "refined_coefficients.toml").read_text(encoding="utf-8"))
Changed = Callable[..., Path]


@pytest.fixture(scope="module")
def reference():
    return load_study(REFERENCE)


@pytest.fixture
def edited(tmp_path: Path) -> Changed:
    """Write a copy of the reference study and its claims, each old text replaced where it first follows a section's start."""
    shutil.copy(REFERENCE.parent / "findings.toml", tmp_path)

    def write(section: str, *changes: tuple[str, str]) -> Path:
        text = REFERENCE.read_text(encoding="utf-8")
        at = text.index(f"\n{section}")
        head, tail = text[:at], text[at:]
        for old, new in changes:
            assert old in tail
            tail = tail.replace(old, new, 1)
        path = tmp_path / "study.toml"
        path.write_text(head + tail, encoding="utf-8")
        return path

    return write


@pytest.mark.paper
def test_cases_of_the_reference_study_are_those_of_tables_3_to_5(reference):
    for number, cases in zip((3, 4, 5), reference.cases, strict=True):
        assert (cases.name, cases.source) == (f"Table {number}", f"study, Table {number}")
        assert list(cases.columns) == PRINTED["columns"]
        assert cases.rows.tolist() == PRINTED[cases.criterion]["rows"]
    assert [cases.criterion for cases in reference.cases] == ["attitude_quickness", "dynamic_stability", "bandwidth"]
    assert nominal_value(reference.vehicle, "tau_d", 5.0) == 0.0


def test_coupling_adds_roll_factors_to_those_of_the_study(reference):
    coupling, n = reference.coupling, len(reference.space)
    assert coupling.space.factors[:n] == reference.space.factors
    assert coupling.targets[:n] == reference.targets
    assert coupling.nominal[:n].tolist() == reference.nominal.tolist()
    assert coupling.space.names[n:] == coupling.added
    assert {"C_Ybeta", "C_lbeta", "C_lp", "C_lr", "I_x", "I_z"} <= set(coupling.added)
    assert set(coupling.targets) <= set(TARGETS)
    assert len(set(coupling.targets)) == len(coupling.space) == len(coupling.nominal)
    for name in coupling.added:
        low, high = coupling.space[name].distribution.support
        value = nominal_value(reference.vehicle, name, 5.0)
        half = 0.1 if name.startswith("I_") else 0.2
        assert (low, high) == pytest.approx(sorted((value * (1 - half), value * (1 + half))), rel=1e-12)
        assert coupling.space[name].source.startswith("assumed: ")


def test_froude_lengths_say_where_they_come_from(reference):
    froude = reference.froude
    assert (froude.length, froude.reference_length) == (3.0, 16.36)
    assert froude.length == reference.vehicle.airframe.aerodynamics.span
    assert froude.basis.startswith(
        "length 3 m: study, Table 1: wing span; reference length 16.36 m: assumed: rotor diameter of the UH-60A"
    )


def test_deceleration_is_in_si(reference):
    made = reference.deceleration
    assert (made.speeds, made.distances, made.duration, made.hold) == ((5.0, 10.0), (34.0, 109.0), 33.0, 5.0)
    assert asdict(made.pilot) == {"gain": 0.6, "lead": 0.5, "delay": 0.25, "deceleration": 0.55, "reverse": 1.0, "distance": 34.0}
    assert asdict(made.desired) == pytest.approx(
        {
            "overshoot": 1.0,
            "position": 0.5,
            "height": 0.5,
            "lateral": 0.5,
            "heading": math.pi / 36,
            "time": 20.0,
            "theta": math.pi / 12,
        }
    )
    assert asdict(made.adequate) == pytest.approx(
        {"overshoot": 2.0, "position": 1.0, "height": 1.0, "lateral": 1.0, "heading": math.pi / 18, "time": 26.0,
         "theta": math.radians(25.0)}
    )  # fmt: skip


def test_everything_assumed_is_listed_with_its_reason(reference):
    assumed = dict(reference.assumed)
    assert len(assumed) == len(reference.assumed)
    assert set(assumed) == {
        "levels.froude.reference_length", "deceleration.pilot", "deceleration.pilot.delay", "deceleration.desired",
        "deceleration.adequate", *(f"coupling.factor.{name}" for name in reference.coupling.added),
    }  # fmt: skip
    assert all("not public" in assumed[f"deceleration.{name}"] for name in ("desired", "adequate"))


def test_assumed_factors_and_cases_are_listed_too(edited):
    study = load_study(edited("[[cases]]", ('source = "study, Table 3"', 'assumed = "my own"')))
    assert ("cases.Table 3", "my own") in study.assumed
    assert study.cases[0].source == "assumed: my own"
    study = load_study(edited("[[factor]]", ('source = "study, Table 2"', 'assumed = "a guess"')))
    assert ("factor.M", "a guess") in study.assumed


def test_sections_cannot_be_changed(reference):
    for section, field in ((reference.coupling, "trajectories"), (reference.cases[0], "name"), (reference.froude, "length"),
                           (reference.deceleration, "hold")):  # fmt: skip
        with pytest.raises(FrozenInstanceError):
            setattr(section, field, 1)
    for numbers in (reference.cases[0].rows[0], reference.coupling.nominal):
        with pytest.raises(ValueError, match="read-only"):
            numbers[0] = 0.0


def test_a_study_without_the_optional_sections(tmp_path):
    text = REFERENCE.read_text(encoding="utf-8")
    text = re.sub(r"^(findings|amplitudes) = .*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"\[levels\.froude\].*?(?=\n# Uncertain)", "", text, flags=re.DOTALL)
    path = tmp_path / "study.toml"
    path.write_text(text[: text.index("\n[coupling]")], encoding="utf-8")
    study = load_study(path)
    assert (study.findings, study.coupling, study.cases, study.amplitudes) == (None, None, (), ())
    assert (study.froude, study.deceleration, study.assumed) == (None, None, ())


def test_quantities_are_converted(edited):
    made = load_study(
        edited(
            "[deceleration]",
            ("speeds = [5.0, 10.0]", 'speeds = [{ value = 18.0, unit = "km/h" }, 10.0]'),
            ("duration = 33.0", 'duration = { value = 40e3, unit = "ms" }'),
            ('lead = { value = 0.5, unit = "s" }', 'lead = { value = 500, unit = "ms" }'),
            ('height = { value = 0.5, unit = "m" }', 'height = { value = 50, unit = "cm" }'),
        )
    ).deceleration
    assert (made.speeds[0], made.duration, made.pilot.lead, made.desired.height) == pytest.approx((5.0, 40.0, 0.5, 0.5), rel=1e-12)


def test_a_case_may_set_anything_that_a_factor_may(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(
        f'[study]\nextends = "{REFERENCE.as_posix()}"\nname = "mine"\n[[cases]]\nname = "heavy and late"\ncriterion = "bandwidth"\n'
        'columns = ["M", "tau_d"]\nrows = [[7.2, 0.02], [7.4, 0]]\nassumed = "a loading"',
        encoding="utf-8",
    )
    (cases,) = load_study(path).cases
    assert (cases.name, cases.columns, cases.rows.tolist()) == ("heavy and late", ("M", "tau_d"), [[7.2, 0.02], [7.4, 0.0]])


FIRST = "[0.4524, -0.0240, 5.115, -0.5402, 5.9649, -6.9263]"
FAULTS = [
    ("[study]", '"findings.toml"', '"claims.toml"', "study.findings: no such file: "),
    ("[study]", '"findings.toml"', '"findings"', "study.findings: is 'findings'; string should match pattern"),
    (
        "[manoeuvre.bandwidth.sweep]",
        "amplitudes = [0.1, 0.25",
        "amplitudes = [0.0, 0.25",
        "sweep.amplitudes.1: is 0 m/s, must be positive",
    ),
    (
        "[manoeuvre.bandwidth.sweep]",
        "amplitudes = [0.1, 0.25",
        "amplitudes = [0.25, 0.1",
        "amplitudes.2: is 0.1 m/s, must exceed 0.25 m/s",
    ),
    (
        "[manoeuvre.bandwidth.sweep]",
        "amplitudes = [0.1, 0.25",
        "amplitudes = [0.1, nan",
        "manoeuvre.bandwidth.sweep.amplitudes.2: is nan",
    ),
    # Froude scaling
    ("[levels.froude]", "value = 3.0", "value = 0.0", "levels.froude.length: must be positive, got 0.0"),
    ("[levels.froude]", ', source = "study, Table 1: wing span"', "", "levels.froude.length: neither source nor assumed"),
    (
        "[levels.froude]",
        "reference_length",
        "reference",
        "levels.froude: unknown name 'reference'; did you mean 'reference_length'?",
    ),
    # coupling
    ("[coupling]", "trajectories = 10", "trajectories = 1", "coupling.trajectories: is 1"),
    ("[coupling]", 'name = "C_lp"', 'name = "C_lP"', "coupling.factor.C_lP.name: unknown name 'C_lP'; did you mean 'C_l"),
    (
        "[coupling]",
        'name = "C_Ybeta"\nvalue = -0.30',
        'name = "C_mq"\nvalue = -16.169',
        "coupling.factor.C_mq: sets C_mq as the factor",
    ),
    (
        "[coupling]",
        'name = "C_Ybeta"\nvalue = -0.30',
        'name = "other"\ntarget = "C_mq"\nvalue = -16.169',
        "coupling.factor.other: sets C_mq as the factor C_mq does",
    ),
    ("[coupling]", "value = -0.30", "value = -0.31", "coupling.factor.C_Ybeta.value: is -0.31 1/rad, and the vehicle"),
    ("[coupling]", "range = [-0.20, 0.20]", "range = [0.20, -0.20]", "coupling.factor.C_Ybeta.range: range reversed"),
    ("[coupling]", "range = [-0.10, 0.10]", "range = [-1.10, 0.10]", "coupling.factor.I_x.range: must be positive, got -0.12"),
    ("[coupling]", "range = [-0.20, 0.20]", "std = 1.0", "coupling.factor.C_Ybeta.std: has no place here"),
    # cases
    (
        "[[cases]]",
        'criterion = "attitude_quickness"',
        'criterion = "quickness"',
        "cases.Table 3.criterion: 'quickness' is not among",
    ),
    (
        "[[cases]]",
        'criterion = "dynamic_stability"',
        'criterion = "attitude_quickness"',
        "cases.Table 4.criterion: 'attitude_quickness' has cases already",
    ),
    ("[[cases]]", '"C_m0"', '"C_M0"', "cases.Table 3.columns.2: unknown name 'C_M0'; did you mean 'C_m0'?"),
    ("[[cases]]", '"C_m0"', '"C_L0"', "cases.Table 3.columns.2: 'C_L0' is given twice"),
    ("[[cases]]", FIRST, "[0.4524, -0.0240]", "cases.Table 3.rows.1: holds 2 numbers for 6 columns"),
    ("[[cases]]", FIRST, FIRST.replace("0.4524", "inf"), "cases.Table 3.rows.1.1: is inf; input should be a finite number"),
    ("[[cases]]", '"C_m0"', '"I_y"', "cases.Table 3.rows: I_y must be positive, got -0.024"),
    ("[[cases]]", 'source = "study, Table 3"', "", "cases.Table 3: neither source nor assumed"),
    # deceleration
    ("[deceleration]", "speeds = [5.0, 10.0]", "speeds = [5.0]", "deceleration.distances: holds 2 distances for 1 speeds"),
    ("[deceleration]", "speeds = [5.0, 10.0]", "speeds = [5.0, 5.0]", "deceleration.speeds.2: 5 m/s is given twice"),
    ("[deceleration]", "speeds = [5.0", "speeds = [-5.0", "deceleration.speeds.1: is -5 m/s, must be positive"),
    (
        "[deceleration]",
        "speeds = [5.0, 10.0]",
        "speeds = [5.0, 16.0]",
        "speeds.2: is 16 m/s, and the controller's trim table ends at 15 m/s",
    ),
    ("[deceleration]", "distances = [34.0", "distances = [0.0", "deceleration.distances.1: is 0 m, must be positive"),
    (
        "[deceleration]",
        "duration = 33.0",
        "duration = 10.0",
        "deceleration.duration: is 10 s: too short for 34 m at 5 m/s and a hold of 5 s",
    ),
    ("[deceleration]", "hold = 5.0", "hold = 0.0", "deceleration.hold: is 0 s, must be positive"),
    ("[deceleration]", "gain = { value = 0.6", "gain = { value = 0.0", "deceleration.pilot.gain: must be positive, got 0.0"),
    (
        "[deceleration]",
        "delay = { value = 0.25",
        "delay = { value = -0.25",
        "deceleration.pilot.delay: must not be negative, got -0.25",
    ),
    (
        "[deceleration]",
        "reverse = { value = 1.0",
        "reverse = { value = 6.0",
        "pilot.reverse: is 6 m/s, and the trim table begins at -5 m/s",
    ),
    (
        "[deceleration]",
        'lead = { value = 0.5, unit = "s" }',
        'lead = { value = 0.5, unit = "m" }',
        "deceleration.pilot.lead: unit 'm' does",
    ),
    ("[deceleration]", 'lead = { value = 0.5, unit = "s" }', "lead = 0.5", "deceleration.pilot.lead: is 0.5"),
    (
        "[deceleration.adequate]",
        "time = { value = 26.0",
        "time = { value = 19.0",
        "adequate.time: is 19, tighter than the desired 20",
    ),
    ("[deceleration.desired]", 'unit = "deg"', 'unit = "m"', "deceleration.desired.heading: unit 'm' does not fit, expected rad"),
]


@pytest.mark.parametrize(("section", "old", "new", "problem"), FAULTS, ids=[f"{fault[0]} {fault[2][:30]}" for fault in FAULTS])
def test_a_bad_section_is_refused_on_one_line_that_names_the_field(edited, section, old, new, problem):
    path = edited(section, (old, new))
    with pytest.raises(InputError) as caught:
        load_study(path)
    text = str(caught.value)
    assert text.startswith("study.toml: ")
    assert problem in text
    assert "\n" not in text


def test_a_speed_beyond_the_rotor_table_names_the_speed(edited):
    path = edited("[deceleration]", ("speeds = [5.0, 10.0]", "speeds = [5.0, 14.0]"))
    text = path.read_text(encoding="utf-8").replace('name = "T_u"', 'name = "T_u" ', 1)
    text = re.sub(r'(name = "T_u".*?range = )\[-0.05, 0.05\]', r"\1[-0.05, 0.5]", text, count=1, flags=re.DOTALL)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"deceleration\.speeds\.2: airspeed 14 m/s exceeds the rotor table's 20 m/s"):
        load_study(path)


def test_amplitudes_are_those_given(reference):
    assert reference.amplitudes == (0.1, 0.25, 0.5, 1.0)
    assert reference.sweep.amplitude == reference.amplitudes[0]
    assert np.all(np.diff(reference.amplitudes) > 0)


def blocks(text: str) -> list[str]:
    """Indented examples of the page that are TOML tables."""
    found = re.findall(r"(?:^    .*\n|^\n(?=    ))+", text, flags=re.MULTILINE)
    return [plain for block in found if (plain := textwrap.dedent(block).strip()).startswith("[")]


def test_examples_of_sections_on_the_page_are_studies(tmp_path):
    """Every indented example extends the reference study, or is put behind one that does."""
    page = (ROOT / "docs" / "reference" / "study-file.md").read_text(encoding="utf-8")
    examples = blocks(page)
    assert len(examples) >= 3
    shutil.copytree(REFERENCE.parent, tmp_path / "reference")
    header = '[study]\nextends = "../reference/study.toml"\nname = "mine"\n'
    (tmp_path / "mine").mkdir()
    for example in examples:
        path = tmp_path / "mine" / "study.toml"
        own = "" if example.startswith("[study]") else header + 'without = ["coupling", "cases", "deceleration", "levels.froude"]\n'
        path.write_text(own + example, encoding="utf-8")
        given = tomllib.loads(example)
        study = load_study(path)
        for key, section in (("coupling", study.coupling), ("cases", study.cases), ("deceleration", study.deceleration)):
            assert key not in given or section
