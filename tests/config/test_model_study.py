from __future__ import annotations

import math
import pickle
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from levelone.config.campaign_table import CampaignOptions, Cluster
from levelone.config.model_schema import SECTIONS, CampaignSection, ClusterTable, TestTable
from levelone.config.model_study import is_model_study, load_model_study
from levelone.config.model_table import (
    BuiltInTable,
    CommandTable,
    FmuTable,
    JsbsimTable,
    PythonTable,
    StateSpaceTable,
    Test,
    response_names,
)
from levelone.config.study_file import load_study
from levelone.errors import InputError
from levelone.handling.manoeuvres import Manoeuvre

ROOT = Path(__file__).parents[2]
OWN = ROOT / "studies" / "own-model" / "study.toml"
TEXT = OWN.read_text(encoding="utf-8")
MODEL = re.compile(r"\[model\].*?(?=\[\[test\]\])", re.DOTALL)
TESTS = re.compile(r"\[\[test\]\].*?(?=\[\[factor\]\])", re.DOTALL)
CHANNELS = """
[model.inputs.delta_lon]
name = "stick"
unit = "1"
[model.outputs.theta]
name = "pitch_deg"
unit = "deg"
[model.outputs.q]
name = "pitch_rate"
unit = "deg/s"
"""
RESPONSES = '[[response]]\nname = "zeta"\nunit = "1"\n[[response]]\nname = "range_km"\nunit = "km"\n\n'


@pytest.fixture
def write(tmp_path):
    """Write the example with parts of its text changed; an old part may be a pattern."""

    def written(*changes):
        text = TEXT
        for old, new in changes:
            pattern = old if isinstance(old, re.Pattern) else re.compile(re.escape(old))
            text, count = pattern.subn(lambda match, new=new: new, text, count=1)
            assert count == 1, f"the example no longer holds {old!r}"
        path = tmp_path / "study.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written


@pytest.fixture
def of_kind(write):
    """Write the example with another [model] section."""

    def written(section, *changes, channels=CHANNELS):
        return write((MODEL, f"[model]\n{section}\n{channels}\n"), *changes)

    return written


def refused(path):
    with pytest.raises(InputError) as caught:
        load_model_study(path)
    return caught.value


def test_the_example_says_what_its_file_says():
    study, given = load_model_study(OWN), tomllib.loads(TEXT)
    assert (study.name, study.seed, study.policy) == (given["study"]["name"], given["study"]["seed"], given["study"]["failures"])
    assert study.space.names == tuple(each["name"] for each in given["factor"])
    assert study.nominal.tolist() == [each["value"] for each in given["factor"]]
    assert study.targets == study.space.names
    assert isinstance(study.model, PythonTable)
    assert study.model.folder == OWN.parent.resolve()
    assert study.read == tuple(given["responses"]["read"])
    assert [test.criterion for test in study.tests] == ["attitude_quickness", "dynamic_stability", "bandwidth"]
    assert study.campaign == CampaignOptions(executor="batch")
    assert study.assumed == tuple((f"factor.{each['name']}", each["assumed"]) for each in given["factor"])


def test_the_study_and_all_that_travels_with_it_can_be_pickled():
    study = load_model_study(OWN)
    for part in (study.model, study.tests, study.campaign):
        assert pickle.loads(pickle.dumps(part)) == part  # noqa: S301 - written just now


def test_a_study_of_a_vehicle_is_none_of_a_model():
    assert is_model_study(OWN)
    assert not is_model_study(ROOT / "studies" / "reference" / "study.toml")


def test_units_signs_and_trim_are_those_of_the_mapping(write):
    path = write(('name = "stick"\nunit = "1"', 'name = "stick"\nunit = "percent"\nsign = -1\ntrim = 12'))
    (stick,) = load_model_study(path).model.inputs
    assert (stick.scale, stick.sign, stick.trim) == (0.01, -1, 12.0)
    theta, q = load_model_study(OWN).model.outputs
    assert theta.scale == pytest.approx(math.pi / 180.0, rel=1e-15)
    assert (theta.levelone, q.levelone, theta.sign, theta.trim) == ("theta", "q", 1, None)


def test_manoeuvres_have_the_shape_of_their_criterion_and_the_times_of_the_file():
    step, pulse, sweep = (test.manoeuvre for test in load_model_study(OWN).tests)
    assert [step.shape, pulse.shape, sweep.shape] == ["step", "pulse", "sweep"]
    assert (pulse.on, pulse.off, pulse.duration) == (1.0, 1.4, 8.0)
    assert (sweep.omega_min, sweep.omega_max, sweep.dt, sweep.duration) == (0.5, 40.0, 0.01, 66.0)
    assert sweep.steps_per_tick == 1


def test_an_amplitude_has_the_unit_of_its_command(write):
    mapped = '[model.inputs.theta]\nname = "c"\nunit = "deg"\n'
    path = write(
        ("[model.outputs.theta]", f"{mapped}[model.outputs.theta]"),
        ('command = "delta_lon"\namplitude = 0.2', 'command = "theta"\namplitude = {value = 5.0, unit = "deg"}'),
    )
    step = load_model_study(path).tests[0].manoeuvre
    assert (step.axis, step.flight_mode) == ("theta", "attitude")
    assert step.amplitude == pytest.approx(math.radians(5.0), rel=1e-15)


def test_every_kind_becomes_its_description(of_kind, tmp_path):
    for name in ("craft.fmu", "craft.toml"):
        (tmp_path / name).touch()
    (tmp_path / "template").mkdir()
    command = load_model_study(
        of_kind('kind = "command"\narguments = ["./fly.sh", "{parameters}", "{results}"]\nformat = "json"\nfolder = "template"')
    ).model
    assert isinstance(command, CommandTable)
    assert (command.folder, command.base, command.time_limit, command.keep) == (tmp_path / "template", tmp_path, math.inf, "failed")
    fmu = load_model_study(of_kind('kind = "fmu"\nfile = "craft.fmu"\nstep = 0.002', ("dt = 0.01", "dt = 0.004")))
    assert isinstance(fmu.model, FmuTable)
    assert (fmu.model.file, fmu.model.mode, fmu.model.step) == (tmp_path / "craft.fmu", "co-simulation", 0.002)
    assert [test.manoeuvre.dt for test in fmu.tests] == [0.002, 0.002, 0.004]
    assert fmu.campaign.executor == "processes"
    jsbsim = load_model_study(
        of_kind(
            'kind = "jsbsim"\naircraft = "F450"\nstep = 0.002\ninitial = {"ic/h-sl-ft" = 100}\nset = {"a/b" = 1.5}',
            ("dt = 0.01", "dt = 0.01"),
        )
    ).model
    assert isinstance(jsbsim, JsbsimTable)
    assert (jsbsim.initial, jsbsim.set, jsbsim.folder) == ((("ic/h-sl-ft", 100.0),), (("a/b", 1.5),), None)
    linear = load_model_study(of_kind('kind = "state-space"\nfile = "craft.toml"')).model
    assert isinstance(linear, StateSpaceTable)


def test_a_built_in_vehicle_goes_through_the_same_door(of_kind):
    """Its study's numbers are those of the shipped study on the same vehicle, from another reader."""
    reference = load_study(ROOT / "studies" / "reference" / "study.toml")
    section = 'kind = "built-in"\nvehicle = "reference-evtol"\ntrim_speed = {value = 18, unit = "km/h"}\nflight_mode = "velocity"'
    tests = """
[[test]]
name = "step"
criterion = "attitude_quickness"
axis = "pitch"
command = "V_lon"
amplitude = 1.0
duration = 10.0
[[test]]
name = "exact"
criterion = "bandwidth"
method = "linear"
axis = "pitch"
command = "V_lon"
output = "theta"
sign = -1
response_type = "attitude_command"
omega_min = 0.1
omega_max = 300.0
points = 400

"""
    factor = '[[factor]]\nname = "M"\nvalue = 4.0\nunit = "kg"\nrange = [-0.1, 0.1]\nkind = "relative"\nassumed = "example"\n\n'
    mass = reference.nominal[reference.targets.index("M")] if "M" in reference.targets else 4.0
    path = of_kind(
        section,
        (TESTS, tests),
        (re.compile(r"\[\[factor\]\].*?(?=\[method\])", re.DOTALL), factor.replace("4.0", repr(float(mass)))),
        ('["quickness", "zeta", "omega_bw", "tau_p"]', '["quickness", "tau_p"]'),
        channels="",
    )
    study = load_model_study(path)
    assert isinstance(study.model, BuiltInTable)
    assert study.model.trim_speed == reference.trim_speed
    step, exact = study.tests
    for name in ("axis", "amplitude", "on", "off", "duration", "dt", "controller_rate", "trim_speed", "flight_mode", "shape"):
        assert getattr(step.manoeuvre, name) == getattr(reference.quickness, name)
    assert exact.omega is not None
    np.testing.assert_allclose(exact.omega, np.geomspace(0.1, 300.0, 400), rtol=1e-14)
    assert (exact.method, exact.sign, exact.manoeuvre.shape) == ("linear", -1, "none")


def test_a_model_that_answers_responses_itself_has_no_tests(of_kind):
    section = 'kind = "python"\nfunction = "a.b:c"\ngives = "responses"\nvectorised = true'
    path = of_kind(section, (TESTS, RESPONSES), ('["quickness", "zeta", "omega_bw", "tau_p"]', '["zeta"]'), channels="")
    study = load_model_study(path)
    assert study.tests == ()
    assert [(each.name, each.unit) for each in study.model.responses] == [("zeta", "1"), ("range_km", "km")]
    assert study.read == ("zeta",)


def test_responses_of_several_tests_go_by_test():
    flown = Manoeuvre("m", "direct", "delta_lon", 0.0, amplitude=1.0)
    one = Test("a", "bandwidth", "pitch", flown, "q", method="sweep")
    other = Test("b", "bandwidth", "roll", flown, "p", method="linear")
    quick = Test("c", "attitude_quickness", "roll", flown)
    assert [name for name, _, _ in response_names((one, other, quick))] == [
        *(f"{name}_a" for name in ("omega_bw", "omega_bw_phase", "omega_bw_gain", "omega_180", "tau_p")), "coherence",
        *(f"{name}_b" for name in ("omega_bw", "omega_bw_phase", "omega_bw_gain", "omega_180", "tau_p")),
        "quickness", "delta_phi_min", "delta_phi_pk",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ([('kind = "python"', 'kind = "pyhton"')], "model.kind", "did you mean 'python'?"),
        ([('kind = "python"\n', "")], "model.kind", "missing; allowed: built-in, command, fmu"),
        ([('folder = "."', "step = 0.01")], "model.step", 'kind = "python" takes gives, fixed, inputs, outputs, function'),
        ([('folder = "."', 'foldr = "."')], "model", "did you mean 'folder'?"),
        ([('folder = "."', 'folder = "nowhere"')], "model.folder", "no such folder"),
        ([('function = "pitch_axis:fly"', 'function = "import os; os"')], "model.function", "write it like 'package.module:name'"),
        ([('unit = "deg/s"', 'unit = "deg"')], "model.outputs.q.unit", "expected rad/s"),
        ([('unit = "deg"\n', 'unit = "degre"\n')], "model.outputs.theta.unit", "did you mean 'deg'?"),
        ([("[model.outputs.q]", "[model.outputs.qq]")], "model.outputs", "unknown name 'qq'; did you mean 'q'?"),
        ([('name = "pitch_rate"', 'name = "pitch_deg"')], "model.outputs.q.name", "'pitch_deg' is mapped as theta already"),
        ([('name = "pitch_rate"', 'name = "pitch_rate"\nsgn = 1')], "model.outputs.q", "did you mean 'sign'?"),
        ([('name = "pitch_rate"', 'name = "pitch_rate"\nsign = 2')], "model.outputs.q.sign",
         "not among the choices; allowed: -1, 1"),
        ([("[model.inputs.delta_lon]", "[model.inputs.delta_lng]")], "model.inputs", "did you mean 'delta_lon'?"),
        ([("[model.outputs.q]", "[model.outputs.r]")], "model.outputs.q",
         "missing: test.step (attitude_quickness on pitch) reads q and theta"),
        ([('command = "delta_lon"', 'command = "delta_lat"')], "test.step.command",
         "unknown name 'delta_lat'; did you mean 'delta_lon'?"),
        ([('criterion = "attitude_quickness"', 'criterion = "quickness"')], "test.step.criterion",
         "did you mean 'attitude_quickness'?"),
        ([('axis = "pitch"', 'axis = "ptch"')], "test.step.axis", "did you mean 'pitch'?"),
        ([('axis = "pitch"\n', "")], "test.step.axis", "missing: attitude_quickness with a step takes axis, amplitude, duration"),
        ([("amplitude = 0.2", "amplitude = 0.0")], "test.step.amplitude", "is 0"),
        ([("amplitude = 0.2", 'amplitude = {value = 2, unit = "deg"}')], "test.step.amplitude",
         "unit 'deg' does not fit, expected 1"),
        ([("amplitude = 0.2", 'amplitude = "large"')], "test.step.amplitude", "must be a number"),
        ([("length = 0.4", "length = 9.0")], "test.free.length", "must lie within the record of 8.0 s"),
        ([("length = 0.4\n", "")], "test.free.length", "missing"),
        ([("length = 0.4", "length = 0.4\nwindows = [1.0]")], "test.free.windows",
         "has no place here: dynamic_stability with a pulse takes"),
        ([("duration = 8.0", "duration = 8.0\non = 0.5")], "test.step.on", "must be 1 s or later"),
        ([("windows = [20.0, 10.0]", "windows = [20.0, 100.0]")], "test.sweep.windows.2", "must lie within the record of 66 s"),
        ([("dt = 0.01", "dt = 1e-6")], "test.sweep.length", "record of 6.6e+07 samples; at most 5000000"),
        ([("dt = 0.01", "dt = 0.1")], "test.sweep.omega_max", "reaches the Nyquist frequency of samples 0.1 s apart, 31.42 rad/s"),
        ([("dt = 0.01", "settle = -1.0")], "test.sweep.settle", "must not be negative"),
        ([('output = "theta"', 'output = "phi"')], "test.sweep.output", "unknown name 'phi'; allowed: q, theta"),
        ([('output = "theta"', 'output = "theta"\nintegrate = true')], "test.sweep.integrate", "it takes a rate"),
        ([('output = "theta"', 'output = "theta"\nmethod = "linear"')], "test.sweep.method",
         'is "linear", which takes a model of kind'),
        ([('output = "theta"', 'output = "theta"\ntask = "hovering"')], "test.sweep.task",
         "unknown name 'hovering'; allowed: all_other"),
        ([('name = "free"', 'name = "step"')], "test.step", "is the name of two tests"),
        ([('name = "free"', 'name = "a b"')], "test.a b.name", "pattern"),
        ([('"quickness", "zeta"', '"quicknes", "zeta"')], "responses.read.1", "did you mean 'quickness'?"),
        ([('"quickness", "zeta"', '"zeta", "zeta"')], "responses.read.2", "'zeta' is given twice"),
        ([('name = "zeta"\nvalue', 'name = "zeta"\ntarget = "omega"\nvalue')], "factor.zeta",
         "sets omega as the factor omega does"),
        ([('name = "zeta"\nvalue', 'name = "zeta"\ntarget = "gain"\nvalue')], "factor.zeta", "sets 'gain' as model.fixed does"),
        ([('name = "zeta"\nvalue', 'name = "zeta"\ntarget = "stick"\nvalue')], "factor.zeta",
         "sets 'stick' as model.inputs.delta_lon does"),
        ([('assumed = "example"', "")], "factor.omega", "neither source nor assumed"),
        ([("samples = 24", "samples = 10000000")], "method.samples", "must be at most 1000000"),
        ([("base_points = 256", "base_points = 33554432")], "method.base_points", "must be at most 16777216"),
        ([("base_points = 256", "base_points = 250")], "method.base_points", "not a power of two"),
        ([('name = "own-model"', 'name = "../../tmp/x"')], "study.name", "pattern"),
        ([("[responses]", '[levels]\nboundaries = "mine.toml"\n[responses]')], "mine.toml", "no such file"),
        ([("[responses]", '[levels]\nboundaries = "ads33-level"\n[responses]')], "levels.boundaries",
         "did you mean 'ads33-levels'?"),
        ([("[responses]",
         "[[correlation]]\nfactors = ['omega', 'zet']\nrank = 0.5\nassumed = 'e'\n[responses]")], "correlation.1.factors",
         "did you mean 'zeta'?"),
    ],
)  # fmt: skip
def test_a_fault_is_one_line_that_names_the_field_and_what_is_allowed(write, changes, field, words):
    error = refused(write(*changes))
    assert error.field in (field, f"study.toml: {field}")
    assert words in error.problem
    assert "\n" not in str(error)


def test_models_that_answer_themselves_map_nothing_and_fly_nothing(of_kind):
    answers = 'kind = "python"\nfunction = "a:b"\ngives = "responses"'
    assert refused(of_kind(answers, channels="")).field == "study.toml: test.step"
    assert refused(of_kind(answers, (TESTS, RESPONSES))).field == "study.toml: model.inputs"
    assert refused(of_kind(answers, (TESTS, ""), channels="")).field == "study.toml: response"
    assert refused(of_kind('kind = "python"\nfunction = "a:b"', (TESTS, ""))).field == "study.toml: test"
    both = refused(of_kind('kind = "python"\nfunction = "a:b"', ("[[factor]]", f"{RESPONSES}[[factor]]")))
    assert both.field == "study.toml: response.zeta"


def test_a_missing_file_is_answered_with_the_closest_name(of_kind, tmp_path):
    (tmp_path / "vehicle_v2.fmu").touch()
    error = refused(of_kind('kind = "fmu"\nfile = "vehicle_v3.fmu"'))
    assert error.field == "study.toml: model.file"
    assert "did you mean 'vehicle_v2.fmu'?" in error.problem


@pytest.mark.parametrize(
    ("section", "channels", "field", "words"),
    [
        ('kind = "fmu"\nfile = "craft.fmu"\ntolerance = 1e-6', None, "model.tolerance", 'mode = "co-simulation"'),
        (
            'kind = "state-space"\nfile = "craft.fmu"',
            ('unit = "1"', 'unit = "1"\ntrim = 0.5'),
            "model.inputs.delta_lon.trim",
            "changes from trim only",
        ),
    ],
)
def test_keys_that_would_have_no_effect(of_kind, tmp_path, section, channels, field, words):
    (tmp_path / "craft.fmu").touch()
    error = refused(of_kind(section, channels=CHANNELS if channels is None else CHANNELS.replace(*channels, 1)))
    assert error.field == f"study.toml: {field}"
    assert words in error.problem


def test_records_are_whole_steps_of_the_model(of_kind, tmp_path):
    (tmp_path / "craft.fmu").touch()
    error = refused(of_kind('kind = "fmu"\nfile = "craft.fmu"\nstep = 0.003'))
    assert error.field == "study.toml: test.sweep.dt"
    assert "whole number of steps of the model, 0.003 s" in error.problem


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        ('executor = "proceses"', "executor", "did you mean 'processes'?"),
        ('executor = "dask://cluster"', "executor", "write it like dask://127.0.0.1:8786"),
        ('executor = "dask://127.0.0.1:0"', "executor", "between 1 and 65535"),
        ('executor = "dask://127.0.0.1:65536"', "executor", "between 1 and 65535"),
        ('executor = "dask://a;rm -rf x:80"', "executor", "not an address"),
        ('executor = "processes"\nworkers = 0', "workers", "between 1 and 10000"),
        ("workers = 2", "workers", "has no place here"),
        ('executor = "dask://127.0.0.1:8786"\nworkers = 2', "workers", "has no place here"),
        ('executor = "cluster"\nworkers = 2\n[campaign.cluster]\nkind = "local"\nworkers = 2', "workers", "has no place here"),
        ('executor = "processes"\ntime_limit = 0.0', "time_limit", "must be positive"),
        ("time_limit = 5.0", "time_limit", "batch"),
        ("retries = 1000", "retries", "between 0 and 100"),
        ('executor = "cluster"', "cluster", "missing"),
        ('[campaign.cluster]\nkind = "local"\nworkers = 2', "cluster", "has no place here"),
        ('executor = "cluster"\n[campaign.cluster]\nkind = "slrm"\nworkers = 2', "cluster.kind", "did you mean 'slurm'?"),
        ('executor = "cluster"\n[campaign.cluster]\nkind = "local"\nworkers = 2\nqueue = "q"', "cluster.queue", "no queue"),
        (
            'executor = "cluster"\n[campaign.cluster]\nkind = "slurm"\nworkers = 2\nqueue = "q\\n#SBATCH x"',
            "cluster.queue",
            "letters",
        ),
        ('executor = "cluster"\n[campaign.cluster]\nkind = "slurm"\nworkers = 2\nwalltime = "1h"', "cluster.walltime", "01:00:00"),
        ('executor = "cluster"\n[campaign.cluster]\nkind = "slurm"\nworkers = 2\nmemory = "$(x)"', "cluster.memory", "4 GB"),
    ],
)
def test_a_campaign_that_cannot_run_is_refused(write, text, field, words):
    error = refused(write(("[responses]", f"[campaign]\n{text}\n[responses]")))
    assert error.field == f"study.toml: campaign.{field}"
    assert words in error.problem


def test_a_campaign_is_what_its_table_says(write):
    text = '[campaign]\nexecutor = "cluster"\nretries = 2\nhistories = true\ntime_limit = {value = 2, unit = "min"}\n'
    cluster = (
        '[campaign.cluster]\nkind = "slurm"\nworkers = 8\ncores = 2\nmemory = "4 GB"\nwalltime = "1-02:00:00"\nqueue = "short"\n'
    )
    campaign = load_model_study(write(("[responses]", f"{text}{cluster}[responses]"))).campaign
    described = Cluster("slurm", 8, 2, "4 GB", "1-02:00:00", "short", None)
    assert campaign == CampaignOptions("cluster", None, 120.0, 2, None, True, described)
    for address in ("dask://127.0.0.1:8786", "dask://[::1]:8786", "dask://head-1.cluster:1"):
        assert (
            load_model_study(write(("[responses]", f'[campaign]\nexecutor = "{address}"\n[responses]'))).campaign.executor
            == address
        )


def examples() -> list[str]:
    """Studies in the page of the kinds: each example below the sections that are common to all."""
    page = (ROOT / "docs" / "reference" / "models.md").read_text(encoding="utf-8")
    common, *blocks = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    return [f"{common}\n{block}" for block in blocks if "[model]" in block]


@pytest.mark.parametrize("text", examples(), ids=lambda text: tomllib.loads(text)["model"]["kind"])
def test_examples_of_the_documentation_are_read(text, tmp_path):
    model = tomllib.loads(text)["model"]
    if "file" in model:
        (tmp_path / model["file"]).touch()
    if model.get("folder", ".") != ".":
        (tmp_path / model["folder"]).mkdir()
    path = tmp_path / "study.toml"
    path.write_text(text, encoding="utf-8")
    assert load_model_study(path).model.kind == model["kind"]


def test_every_key_of_the_file_is_in_its_documentation():
    page = (ROOT / "docs" / "reference" / "model-study.md").read_text(encoding="utf-8")
    keys = {key for section in (*SECTIONS.values(), TestTable, CampaignSection, ClusterTable) for key in section.model_fields}
    missing = {key for key in keys if not re.search(rf"`{key}`|`{key} =|(model|campaign)\.{key}", page)}
    assert missing == set()
