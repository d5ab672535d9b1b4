from __future__ import annotations

import hashlib
import math
import re
import tomllib
from dataclasses import FrozenInstanceError
from pathlib import Path

import numpy as np
import pytest

from levelone.config.study_file import load_study
from levelone.errors import InputError
from levelone.handling.levels import load_boundaries
from levelone.uncertainty import Discrete, LogNormal, Normal, Triangular, TruncatedNormal
from levelone.vehicle import TARGET_UNITS

TESTS = Path(__file__).parents[1]
PAPER = tomllib.loads((TESTS / "reference" / "paper.toml").read_text(encoding="utf-8"))
STUDY = TESTS.parent / "studies" / "reference" / "study.toml"


@pytest.fixture(scope="module")
def reference():
    return load_study(STUDY)


@pytest.mark.paper
def test_factors_of_the_reference_study_are_those_of_table_2(reference):
    assert list(reference.space.names) == [printed["name"] for printed in PAPER["factor"]]
    for j, printed in enumerate(PAPER["factor"]):
        factor, value = reference.space.factors[j], printed["value"]
        low, high = printed["range"]
        ends = [value + low, value + high] if printed["kind"] == "absolute" else [value * (1 + low), value * (1 + high)]
        assert factor.distribution.support == pytest.approx(sorted(ends), rel=1e-15)
        assert factor.unit == printed["unit"]
        assert reference.nominal[j] == value
        assert "Table 2" in factor.source


@pytest.mark.paper
def test_manoeuvres_of_the_reference_study_are_those_printed(reference):
    printed, pulse, sweep = PAPER["condition"], reference.stability, reference.sweep
    assert reference.trim_speed == printed["trim_speed"]
    assert {m.trim_speed for m in (reference.quickness, pulse, sweep)} == {printed["trim_speed"]}
    assert (pulse.amplitude, pulse.off - pulse.on) == (printed["pulse"]["amplitude"], printed["pulse"]["length"])
    assert (sweep.omega_min, sweep.omega_max) == (printed["sweep"]["omega_min"], printed["sweep"]["omega_max"])
    assert sweep.off - sweep.on == printed["sweep"]["length"]
    assert reference.method.samples == printed["monte_carlo_samples"]
    assert [m.shape for m in (reference.quickness, pulse, sweep)] == ["step", "pulse", "sweep"]
    assert {m.axis for m in (reference.quickness, pulse, sweep)} == {"V_lon"}


def test_reference_study_names_the_contradictions_of_its_source(reference):
    for word in ("0.02 s", "C_L0", "C_mq", "zeta", "tau_p"):
        assert any(word in note for note in reference.notes)


def test_study_knows_its_file_and_cannot_be_changed(reference):
    assert reference.hash == hashlib.sha256(STUDY.read_bytes()).hexdigest()
    assert reference.path == STUDY
    assert reference.vehicle_path.name == "reference-evtol.toml"
    assert reference.boundaries.name == load_boundaries().name
    with pytest.raises(FrozenInstanceError):
        reference.seed = 1
    with pytest.raises(ValueError, match="read-only"):
        reference.nominal[0] = 0.0


def test_plain_numbers_and_units_mean_the_same(study_file, reference):
    other = load_study(
        study_file(
            ('{ value = 5.0, unit = "m/s" }', "5.0"),
            ("length = 0.5 ", 'length = { value = 500, unit = "ms" } '),
            ("omega_max = 12.0", 'omega_max = { value = 720, unit = "rad/min" }'),
            ('value = 7.0\nunit = "kg"\nrange = [-0.5, 0.5]', 'value = 7000\nunit = "g"\nrange = [-500, 500]'),
        )
    )
    assert other.trim_speed == reference.trim_speed
    assert other.stability == reference.stability
    assert other.sweep.omega_max == pytest.approx(reference.sweep.omega_max, rel=1e-15)
    assert other.space["M"].distribution == reference.space["M"].distribution
    assert other.space["M"].unit == "kg"


def test_linear_frequencies_stand_in_equal_ratios(reference):
    given = tomllib.loads(STUDY.read_text(encoding="utf-8"))["manoeuvre"]["bandwidth"]
    assert reference.omega[[0, -1]] == pytest.approx([given["omega_min"], given["omega_max"]], rel=1e-12)
    ratio = (given["omega_max"] / given["omega_min"]) ** (1 / (given["points"] - 1))
    assert reference.omega[1:] / reference.omega[:-1] == pytest.approx(np.full(given["points"] - 1, ratio), rel=1e-9)


def test_integration_step_divides_the_control_period(study_file, vehicle_file):
    vehicle_file(('value = 250.0, unit = "Hz"', 'value = 100.0, unit = "Hz"'))
    study = load_study(study_file(('vehicle = "reference-evtol"', 'vehicle = "craft.toml"')))
    assert study.quickness.controller_rate == 100.0
    assert study.quickness.dt == pytest.approx(0.01 / 3, rel=1e-15)
    assert study.quickness.steps_per_tick == 3


MASS = 'value = 7.0\nunit = "kg"\nrange = [-0.5, 0.5]\nkind = "absolute"'
GRAMS = 'value = 7000\nunit = "g"\ndistribution = '


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ('"triangular"\nlow = 6500\nmode = 7000\nhigh = 7500', Triangular(6.5, 7.0, 7.5)),
        ('"truncated_normal"\ncentre = 7000\nstd = 150\nlow = 6500\nhigh = 7500', TruncatedNormal(7.0, 0.15, 6.5, 7.5)),
        ('"discrete"\nvalues = [7500, 6500]\nweights = [1, 3]', Discrete((6.5, 7.5), (0.75, 0.25))),
    ],
)
def test_distributions_are_made_in_the_unit_of_their_target(study_file, keys, expected):
    made = load_study(study_file((MASS, GRAMS + keys))).space["M"].distribution
    assert type(made) is type(expected)
    assert made.support == pytest.approx(expected.support, rel=1e-15)
    assert made.mean == pytest.approx(expected.mean, rel=1e-12)
    assert made.ppf([0.1, 0.5, 0.9]) == pytest.approx(expected.ppf([0.1, 0.5, 0.9]), rel=1e-12)


@pytest.mark.parametrize(
    ("keys", "kind", "mean"),
    [
        ({"distribution": "normal", "mean": 7000, "std": 150}, Normal, 7.0),
        ({"distribution": "lognormal", "mu": math.log(7000), "sigma": 0.02}, LogNormal, 7.0 * math.exp(0.5 * 0.02**2)),
    ],
)
def test_unbounded_distributions_are_converted_too(reference, keys, kind, mean):
    from levelone.config.factor_table import factor_of
    from levelone.config.study_schema import FactorTable

    table = FactorTable(name="M", value=7000, unit="g", source="test", **keys)
    factor, target, nominal = factor_of(table, reference.vehicle, 5.0)
    assert isinstance(factor.distribution, kind)
    assert factor.distribution.mean == pytest.approx(mean, rel=1e-12)
    assert (target, nominal, factor.unit) == ("M", 7.0, "kg")


def test_a_factor_may_have_a_name_of_its_own(study_file):
    study = load_study(study_file(('name = "M"\n', 'name = "mass as loaded"\ntarget = "M"\n')))
    assert study.space.names[0] == "mass as loaded"
    assert study.targets[0] == "M"
    assert study.space.factors[0].target == "M"


def test_an_assumed_range_says_so(study_file):
    study = load_study(study_file((MASS + '\nsource = "study, Table 2"', MASS + '\nassumed = "a guess"')))
    assert study.space["M"].source == "assumed: a guess"


NEGATIVE = 'name = "C_mq"\nvalue = -16.169'
FAULTS = [
    # factors
    ('name = "M"', 'name = "Mass"', "factor.Mass.name: unknown name 'Mass'; allowed: C_D0"),
    ('name = "C_Lalpha"', 'name = "C_Lalfa"', "factor.C_Lalfa.name: unknown name 'C_Lalfa'; did you mean 'C_Lalpha'?"),
    ('name = "M"', 'name = "m"\ntarget = "K_t"', "factor.m.target: unknown name 'K_t'; did you mean 'K_T'?"),
    ('unit = "kg"', 'unit = "N"', "factor.M.unit: unit 'N' does not fit, expected kg"),
    ('unit = "kg"', 'unit = "kilo"', "factor.M.unit: unknown unit 'kilo', expected kg"),
    ("value = 7.0", "value = 7.1", "factor.M.value: is 7.1 kg, and the vehicle 'reference-evtol' has 7 kg"),
    ("value = 7.0", "value = 7.00000002", "factor.M.value: is 7.00000002 kg, and the vehicle 'reference-evtol' has 7 kg"),
    ("value = 7.0", "value = nan", "factor.M.value: is nan; input should be a finite number"),
    ("value = 7.0", 'value = "7"', "factor.M.value: is '7'; input should be a valid number"),
    ("range = [-0.5, 0.5]", "range = [0.5, -0.5]", "factor.M.range: range reversed or empty: low = 0.5, high = -0.5"),
    ("range = [-0.5, 0.5]", "range = [0.5, 0.5]", "factor.M.range: range reversed or empty"),
    ("range = [-0.5, 0.5]", "range = [-0.5, inf]", "factor.M.range.2: is inf; input should be a finite number"),
    ("range = [-0.5, 0.5]", "range = [-0.5]", "factor.M.range: is [-0.5]; list should have at least 2 items"),
    ("range = [-0.5, 0.5]", "range = [-8.0, 0.5]", "factor.M.range: must be positive, got -1.0"),
    ("range = [-0.5, 0.5]\n", "", "factor.M.range: missing: a uniform distribution takes range, kind"),
    ("range = [-0.5, 0.5]", "rnage = [-0.5, 0.5]", "factor.M: unknown name 'rnage'; did you mean 'range'?"),
    (
        "range = [-0.5, 0.5]",
        "range = [-0.5, 0.5]\nstd = 1.0",
        "factor.M.std: has no place here: a uniform distribution takes range",
    ),
    (
        'range = [0.0, 0.03]\nkind = "absolute"',
        'range = [0.0, 0.1]\nkind = "relative"',
        "factor.tau_d.range: a relative range of a value",
    ),
    ("range = [0.0, 0.03]", "range = [-0.01, 0.03]", "factor.tau_d.range: must not be negative, got -0.01"),
    ("range = [0.0, 0.03]", "range = [0.0, 3.0]", "rotors.tau_d: 3.0 s is longer than the delay buffer"),
    ("range = [-0.05, 0.05]", "range = [-0.05, 4.0]", "manoeuvre.trim_speed: airspeed 5 m/s exceeds the rotor table's 20 m/s"),
    ('kind = "absolute"', 'kind = "absolut"', "factor.M.kind: 'absolut' is not among the choices; did you mean 'absolute'?"),
    ('name = "M"', 'name = "K_T"', "factor.K_T.unit: unit 'kg' does not fit, expected N/rpm^2"),
    (
        'name = "C_D0"\nvalue = 0.0183',
        'name = "other"\ntarget = "C_L0"\nvalue = 0.7745',
        "factor.other: sets C_L0 as the factor C_L0 does",
    ),
    (MASS, GRAMS + '"normal"\nmean = 7000\nstd = 150', "factor M: a Morris design visits the ends of the range"),
    (MASS, GRAMS + '"triangular"\nlow = 6500\nmode = 8000\nhigh = 7500', "factor.M.mode: 8 lies outside low = 6.5 to high = 7.5"),
    (MASS, GRAMS + '"triangle"\nlow = 6500', "factor.M.distribution: unknown name 'triangle'; did you mean 'triangular'?"),
    (
        MASS,
        GRAMS + '"triangular"\nlow = 6500\nhigh = 7500',
        "factor.M.mode: missing: a triangular distribution takes low, mode, high",
    ),
    ('source = "study, Table 2"\n', "", "factor.M: neither source nor assumed"),
    # sections
    ('name = "reference"', 'name = "a/b"', "study.name: is 'a/b'"),
    ('vehicle = "reference-evtol"', 'vehicle = "reference"', "vehicle: unknown name 'reference'; did you mean 'reference-evtol'?"),
    ('vehicle = "reference-evtol"', 'vehicle = "none.toml"', "none.toml: no such file"),
    ("seed = ", "seed = -", "study.seed: is -"),
    ('failures = "bound"', 'failures = "bind"', "study.failures: 'bind' is not among the choices; did you mean 'bound'?"),
    ("intended_use =", "intendeduse =", "study: unknown name 'intendeduse'; did you mean 'intended_use'?"),
    ('unit = "m/s" }\nflight', 'unit = "m" }\nflight', "condition.trim_speed: unit 'm' does not fit, expected m/s"),
    (
        'value = 5.0, unit = "m/s"',
        'value = 25.0, unit = "m/s"',
        "manoeuvre.trim_speed: airspeed 25 m/s exceeds the rotor table's 20 m/s",
    ),
    (
        'value = 5.0, unit = "m/s"',
        'valu = 5.0, unit = "m/s"',
        "condition.trim_speed: is {'valu': 5.0, 'unit': 'm/s'}; must be a number in m/s",
    ),
    ('flight_mode = "velocity"', 'flight_mode = "rate"', "condition.flight_mode: 'rate' is not among the choices"),
    ("amplitude = 0.7", "amplitude = 0.0", "manoeuvre.dynamic_stability.amplitude: is 0"),
    ("amplitude = 0.7", "amplitude = nan", "manoeuvre.dynamic_stability.amplitude: is nan"),
    ("on = 1.0", "on = 0.5", "manoeuvre.attitude_quickness.on: is 0.5 s, must be 1 s or later"),
    ("length = 0.5", "length = 50.0", "manoeuvre.dynamic_stability.off: is 51.0 s, must lie within the record"),
    ("omega_min = 0.3", "omega_min = 30", "manoeuvre.bandwidth.sweep.omega_max: 12.0 rad/s must exceed omega_min"),
    (
        re.compile(r"windows = \[[\d.]+"),
        "windows = [576",
        "manoeuvre.bandwidth.sweep.windows.1: is 576 s, must lie within the record of 96 s",
    ),
    (
        re.compile(r"omega_max = [\d.]+(?=.*\npoints)"),
        "omega_max = 6000",
        "manoeuvre.bandwidth.omega_max: is 6000 rad/s; needs 0 < omega_min < omega_max < 785.4",
    ),
    (re.compile(r"points = \d+"), "points = 400.0", "manoeuvre.bandwidth.points: is 400.0"),
    ("levels = 4", "levels = 5", "method.levels: is 5; input should be a multiple of 2"),
    (
        "base_points = 16384",
        "base_points = 16000",
        "method.base_points: 16000 is not a power of two; the nearest are 8192 and 16384",
    ),
    ('kernel = "likeliest"', 'kernel = "matern"', "method.kernel: 'matern' is not among the choices; did you mean 'matern52'?"),
    (
        'boundaries = "ads33-levels"',
        'boundaries = "ads33-level"',
        "boundaries: unknown name 'ads33-level'; did you mean 'ads33-levels'?",
    ),
    ('boundaries = "ads33-levels"', 'boundaries = "none.toml"', "none.toml: cannot be read"),
    ('task = "all_other"', 'task = "all_others"', "bandwidth: unknown name 'all_others'; did you mean 'all_other'?"),
    ("[method]", "[methods]", "unknown name 'methods'; did you mean 'method'?"),
    ("[study]", "[study", "is not a TOML file"),
]


@pytest.mark.parametrize(("old", "new", "problem"), FAULTS, ids=[fault[2][:40] for fault in FAULTS])
def test_a_bad_study_is_refused_on_one_line_that_names_the_field(study_file, old, new, problem):
    path = study_file((old, new))
    with pytest.raises(InputError) as caught:
        load_study(path)
    text = str(caught.value)
    assert text.startswith(("study.toml: ", "none.toml: "))
    assert problem in text
    assert "\n" not in text


def test_a_study_without_factors_is_refused(study_file):
    text = STUDY.read_text(encoding="utf-8")
    with pytest.raises(InputError, match="factor: missing"):
        load_study(study_file((text[text.index("[[factor]]") :], "")))


def test_a_fault_of_the_vehicle_names_the_vehicle_file(study_file, vehicle_file):
    vehicle_file(("{ value = 7.0", "{ value = 0.0"))
    with pytest.raises(InputError, match=r"^craft.toml: mass.mass: must be positive"):
        load_study(study_file(('vehicle = "reference-evtol"', 'vehicle = "craft.toml"')))


def test_every_target_can_be_a_factor_at_its_nominal_value(reference):
    from levelone.config.factor_table import factor_of
    from levelone.config.study_schema import FactorTable
    from levelone.vehicle import nominal_value

    for target, unit in TARGET_UNITS.items():
        value = nominal_value(reference.vehicle, target, 5.0)
        table = FactorTable(name=target, value=value, unit=unit, range=[-0.1, 0.1], kind="absolute", assumed="test")
        factor, _, nominal = factor_of(table, reference.vehicle, 5.0)
        assert (factor.unit, nominal) == (unit, value)
