from __future__ import annotations

import hashlib
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.config.extends import read_study
from levelone.config.study_file import load_study
from levelone.config.vehicle_file import library
from levelone.errors import InputError
from levelone.uncertainty import TruncatedNormal, Uniform

STUDIES = Path(__file__).parents[2] / "studies"
REFERENCE = STUDIES / "reference" / "study.toml"
BASE = 'extends = "../base/study.toml"'
Child = Callable[..., Path]


@pytest.fixture(scope="module")
def reference():
    return load_study(REFERENCE)


@pytest.fixture
def child(tmp_path: Path) -> Child:
    """A copy of the reference study with its claims in base/, and a study in own/ that extends it."""
    folder = tmp_path / "base"
    folder.mkdir()
    for name in ("study.toml", "findings.toml"):
        shutil.copy(REFERENCE.parent / name, folder)

    def write(text: str = "", general: str = "", extends: str = BASE, name: str = "child", file: str = "own/study.toml") -> Path:
        path = tmp_path / file
        path.parent.mkdir(exist_ok=True)
        path.write_text(f'[study]\n{extends}\nname = "{name}"\n{general}\n{text}', encoding="utf-8")
        return path

    return write


def changed(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def sha256(*paths: Path) -> str:
    each = [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]
    return hashlib.sha256("".join(each).encode("ascii")).hexdigest()


def refused(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        load_study(path)
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_what_is_not_given_comes_from_the_other_file(child, reference):
    path = child()
    study = load_study(path)
    assert (study.name, study.path) == ("child", path)
    plain = ("title", "seed", "notes", "quickness", "stability", "sweep", "windows", "method", "targets", "amplitudes", "assumed")
    for same in (*plain, "froude", "deceleration"):
        assert getattr(study, same) == getattr(reference, same), same
    assert study.space == reference.space
    assert [case.name for case in study.cases] == [case.name for case in reference.cases]


def test_tables_merge_key_by_key_and_lists_replace(child, reference):
    text = "[method]\nsamples = 77\n[manoeuvre.bandwidth.sweep]\nwindows = [30.0]\n[condition]\ntrim_speed = 8.0"
    study = load_study(child(text, 'notes = ["one"]'))
    assert study.method.samples == 77
    assert (study.method.trajectories, study.method.kernel) == (reference.method.trajectories, reference.method.kernel)
    assert (study.windows, study.notes, study.trim_speed) == ((30.0,), ("one",), 8.0)
    assert study.sweep.omega_max == reference.sweep.omega_max
    assert {study.quickness.trim_speed, study.stability.trim_speed, study.sweep.trim_speed} == {8.0}


def test_factors_merge_by_name_and_new_ones_follow(child, reference):
    new = '[[factor]]\nname = "rho"\nvalue = 1.225\nunit = "kg/m^3"\nrange = [-0.1, 0.1]\nkind = "absolute"\nassumed = "a guess"\n'
    study = load_study(child(new + '[[factor]]\nname = "C_L0"\nrange = [-0.4, -0.1]\nsource = "refined"'))
    assert study.space.names == (*reference.space.names, "rho")
    assert study.space["C_L0"].distribution.support == pytest.approx((0.7745 * 0.6, 0.7745 * 0.9), rel=1e-12)
    assert (study.space["C_L0"].source, study.space["C_L0"].unit) == ("refined", "1")
    assert study.space["C_D0"] == reference.space["C_D0"]
    assert ("factor.rho", "a guess") in study.assumed


NORMAL = 'name = "M"\ndistribution = "truncated_normal"\ncentre = 7.0\nstd = 0.2\nlow = 6.5\nhigh = 7.5\n'


def test_another_distribution_drops_the_range(child):
    study = load_study(child(f'[[factor]]\n{NORMAL}assumed = "weighed"'))
    assert study.space["M"].distribution == TruncatedNormal(7.0, 0.2, 6.5, 7.5)
    assert study.space["M"].source == "assumed: weighed"
    assert study.nominal[0] == 7.0


def test_the_same_distribution_keeps_the_rest(child):
    study = load_study(child('[[factor]]\nname = "M"\ndistribution = "uniform"\nrange = [-0.1, 0.2]\nsource = "weighed"'))
    assert study.space["M"].distribution == Uniform(6.9, 7.2)


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ("range = [-0.1, 0.1]", "factor.M: neither source nor assumed"),
        (NORMAL.partition("\n")[2], "factor.M: neither source nor assumed"),
        ('value = 7000\nunit = "g"\nsource = "scales"', "factor.M.range: missing: a uniform distribution takes range, kind"),
    ],
)
def test_a_factor_keeps_no_origin_or_range_of_what_it_no_longer_is(child, keys, problem):
    text = refused(child(f'[[factor]]\nname = "M"\n{keys}'))
    assert text.startswith(f"study.toml: {problem}")


def test_a_quantity_is_replaced_with_its_unit_and_origin(child):
    assert load_study(child('[condition]\ntrim_speed = { value = 18.0, unit = "km/h" }')).trim_speed == pytest.approx(
        5.0, rel=1e-12
    )
    assert "condition.trim_speed: is {'value': 2.0}; must be a number in m/s" in refused(
        child("[condition.trim_speed]\nvalue = 2.0")
    )
    text = refused(child('[levels.froude]\nlength = { value = 2.0, unit = "m" }'))
    assert text.startswith("study.toml: levels.froude.length: neither source nor assumed")


def test_factors_are_kept_in_their_order(child, reference):
    study = load_study(child(general='factors = ["C_mq", "M"]'))
    assert study.space.names == ("M", "C_mq")
    assert study.targets == ("M", "C_mq")
    assert list(study.nominal) == [7.0, -16.169]
    assert load_study(REFERENCE).space.names == reference.space.names


def test_without_leaves_out_sections_and_single_entries(child, reference):
    names = '["cases", "coupling", "study.findings", "levels.froude", "manoeuvre.bandwidth.sweep.amplitudes"]'
    study = load_study(child(general=f"without = {names}"))
    assert (study.cases, study.coupling, study.findings, study.froude, study.amplitudes) == ((), None, None, None, ())
    assert study.deceleration == reference.deceleration
    assert study.sweep == reference.sweep
    own = '[levels.froude]\nassumed = "mine"\nlength = { value = 1, unit = "m" }\nreference_length = { value = 16, unit = "m" }'
    again = load_study(child(own, 'without = ["levels.froude"]')).froude
    assert (again.length, again.basis) == (1.0, "length 1 m: assumed: mine; reference length 16 m: assumed: mine")


def test_a_chain_of_three_files(child, reference):
    child(
        "[method]\nsamples = 50\nbootstrap = 50", 'factors = ["M", "I_y"]\nwithout = ["cases"]', name="middle", file="middle/a.toml"
    )
    path = child("[method]\nsamples = 60", 'title = "third"', extends='extends = "../middle/a.toml"')
    study = load_study(path)
    assert study.space.names == ("M", "I_y")
    assert (study.name, study.title, study.cases) == ("child", "third", ())
    assert (study.method.samples, study.method.bootstrap, study.method.levels) == (60, 50, reference.method.levels)
    files = [path, path.parents[1] / "middle" / "a.toml", path.parents[1] / "base" / "study.toml"]
    assert study.hash == sha256(*files)


def test_the_hash_follows_every_file(child):
    path = child()
    base = path.parents[1] / "base" / "study.toml"
    before = load_study(path).hash
    assert before == sha256(path, base)
    changed(base, "# m/s", "# metre a second")
    after = load_study(path).hash
    assert after != before
    assert load_study(base).hash == hashlib.sha256(base.read_bytes()).hexdigest()


def test_paths_belong_to_the_file_that_gives_them(child, tmp_path):
    base = tmp_path / "base"
    source = library()["reference-evtol"]
    for name in (source.name, "reference-evtol-rotor.csv"):
        shutil.copy(source.parent / name, base)
    shutil.copy(STUDIES.parent / "src" / "levelone" / "handling" / "library" / "ads33-levels.toml", base / "limits.toml")
    changed(base / "study.toml", 'vehicle = "reference-evtol"', f'vehicle = "{source.name}"')
    changed(base / "study.toml", '"ads33-levels"', '"limits.toml"')
    inherited = load_study(child())
    assert inherited.vehicle_path.resolve() == (base / source.name).resolve()
    assert inherited.findings.resolve() == (base / "findings.toml").resolve()
    assert Path(inherited.boundaries_source) == (base / "limits.toml").resolve()
    own = child(general='findings = "mine.toml"\nvehicle = "reference-evtol"')
    assert refused(own).startswith("study.toml: study.findings: no such file: ")
    (own.parent / "mine.toml").write_text("", encoding="utf-8")
    assert load_study(own).findings.resolve() == (own.parent / "mine.toml").resolve()
    assert load_study(own).vehicle_path == source


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("samples = 500", "samples = 1", "../base/study.toml: method.samples: is 1"),
        ("windows = [57.6", "windows = [576", "../base/study.toml: manoeuvre.bandwidth.sweep.windows.1: is 576 s"),
        ("points = 400", "pionts = 400", "../base/study.toml: manoeuvre.bandwidth: unknown name 'pionts'; did you mean 'points'?"),
        ("range = [-0.5, 0.5]", "range = [0.5, -0.5]", "../base/study.toml: factor.M.range: range reversed or empty"),
        ('source = "study, Table 2"\n', "", "../base/study.toml: factor.M: neither source nor assumed"),
        ("value = 7.0", "value = 7.1", "../base/study.toml: factor.M.value: is 7.1 kg, and the vehicle 'reference-evtol' has 7 kg"),
        ('vehicle = "reference-evtol"', 'vehicle = "reference"', "../base/study.toml: study.vehicle: unknown name 'reference'"),
        ("[study]", "[study", "../base/study.toml: is not a TOML file"),
        ("amplitude = 0.7", "amplitude = 0.0", "../base/study.toml: manoeuvre.dynamic_stability.amplitude: is 0"),
        ("distances = [34.0", "distances = [-34.0", "../base/study.toml: deceleration.distances.1: is -34 m, must be positive"),
    ],
)
def test_a_fault_of_the_other_file_names_that_file(child, tmp_path, old, new, problem):
    changed(tmp_path / "base" / "study.toml", old, new)
    assert refused(child("[method]\nlevels = 6")).startswith(problem)


@pytest.mark.parametrize(
    ("general", "text", "problem"),
    [
        ("", "[method]\nsamples = 1", "method.samples: is 1"),
        ("", "[condition]\ntrim_speed = 25.0", "manoeuvre.trim_speed: airspeed 25 m/s exceeds the rotor table's 20 m/s"),
        ("", '[[factor]]\nname = "M"\nvalue = 7.1', "factor.M.value: is 7.1 kg"),
        ("", '[[factor]]\nname = "M"\n[[factor]]\nname = "M"', "factor.M: given twice in this file"),
        ("", "[methods]", "unknown name 'methods'; did you mean 'method'?"),
        ('factors = ["M", "C_Lalfa"]', "", "study.factors.2: unknown name 'C_Lalfa'; did you mean 'C_Lalpha'?"),
        ("factors = []", "", "study.factors: is []; list should have at least 1 item"),
        ('without = ["couplings"]', "", "study.without.1: unknown name 'couplings'; did you mean 'coupling'?"),
        ('without = ["cases", "levels.frude"]', "", "study.without.2: unknown name 'levels.frude'; did you mean 'levels.froude'?"),
        ('without = ["factor.M"]', "", "study.without.1: unknown name 'factor.M'"),
        ('without = ["study.title"]', "", "study.title: missing"),
        ('without = "cases"', "", "study.without: is 'cases'; input should be a valid list"),
    ],
)
def test_a_fault_of_the_own_file_names_it(child, general, text, problem):
    assert refused(child(text, general)).startswith(f"study.toml: {problem}")


@pytest.mark.parametrize(
    ("extends", "problem"),
    [
        ('extends = "../base/none.toml"', "study.extends: no such file: "),
        ('extends = "../base"', "study.extends: is '../base'; string should match pattern"),
        ("extends = 3", "study.extends: is 3; input should be a valid string"),
        (
            'extends = "study.toml"',
            "study.extends: 'study.toml' leads back to a file that extends it: own/study.toml -> own/study.toml",
        ),
        ('without = ["cases"]', "study.without: there is nothing to leave out: this file extends no other"),
        ('extend = "../base/study.toml"', "study: unknown name 'extend'; did you mean 'extends'?"),
    ],
)
def test_a_file_that_cannot_be_extended(child, extends, problem):
    assert refused(child(extends=extends)).startswith(f"study.toml: {problem}")


def test_a_circle_is_refused_with_its_files(child):
    child(extends='extends = "../own/study.toml"', name="other", file="middle/a.toml")
    text = refused(child(extends='extends = "../middle/a.toml"'))
    assert text.startswith("../middle/a.toml: study.extends: '../own/study.toml' leads back to a file that extends it: ")
    assert text.endswith("own/study.toml -> middle/a.toml -> own/study.toml")


@pytest.mark.parametrize("name", ["reference", None])
def test_a_study_needs_a_name_of_its_own(child, name):
    path = child(name="reference")
    if name is None:
        changed(path, 'name = "reference"', "")
    assert refused(path).startswith("study.toml: study.name: a study that extends another needs a name of its own")


LEAVES = {
    ("method", "samples"): 500, ("method", "levels"): 4, ("manoeuvre", "dynamic_stability", "amplitude"): 0.7,
    ("manoeuvre", "bandwidth", "points"): 400, ("manoeuvre", "bandwidth", "sweep", "length"): 90.0, ("levels", "task"): "all_other",
}  # fmt: skip


@given(st.dictionaries(st.sampled_from(sorted(LEAVES)), st.integers(2, 9)))
def test_any_choice_of_entries_replaces_those_and_no_others(tmp_path_factory, chosen):
    path = tmp_path_factory.mktemp("own") / "study.toml"
    lines = [f"{'.'.join(leaf)} = {value}" for leaf, value in chosen.items()]
    path.write_text("\n".join([*lines, "[study]", f'extends = "{REFERENCE.as_posix()}"', 'name = "child"']), encoding="utf-8")
    source = read_study(path)
    base = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))
    for leaf, value in LEAVES.items():
        found, old = source.content, base
        for key in leaf:
            found, old = found[key], old[key]
        assert old == value
        assert found == chosen.get(leaf, value)
        assert (source.file_of(".".join(leaf)) == "study.toml") == (leaf in chosen)
    assert source.content["factor"] == base["factor"]


def section(path):
    """[study] of a study of the built-in vehicle; files of calibrations and experiments have none."""
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    found = content.get("study", {})
    return found if isinstance(found, dict) and "model" not in content else {}


def shipped() -> list[Path]:
    return [path for path in sorted(STUDIES.rglob("*.toml")) if "name" in section(path)]


@pytest.fixture(scope="module")
def studies():
    return {path.relative_to(STUDIES).as_posix(): load_study(path) for path in shipped()}


def test_every_shipped_study_loads_under_a_name_of_its_own(studies):
    assert {"reference/study.toml", "aerodynamics-only/study.toml", "normal-mass/study.toml", *(f"speeds/{v}.toml" for v in
            ("02", "05", "08", "10"))} <= set(studies)  # fmt: skip
    names = [study.name for study in studies.values()]
    assert len(set(names)) == len(names)
    for path, study in studies.items():
        assert study.name == path.removesuffix("/study.toml").removesuffix(".toml").replace("/", "-")


def test_shipped_studies_say_at_which_speed_they_hold(studies):
    for study in studies.values():
        assert study.validity_domain[0].startswith(f"level flight at {study.trim_speed:g} m/s in still air")


def test_shipped_studies_change_what_they_say(studies, reference):
    aerodynamic = studies["aerodynamics-only/study.toml"]
    assert aerodynamic.space.factors == tuple(factor for factor in reference.space.factors if factor.name.startswith("C_"))
    assert len(aerodynamic.space) == 9
    for speed in (2, 5, 8, 10):
        study = studies[f"speeds/{speed:02d}.toml"]
        assert (study.trim_speed, study.space, study.seed, study.method) == (
            speed,
            reference.space,
            reference.seed,
            reference.method,
        )
    normal = studies["normal-mass/study.toml"]
    for factor, old in zip(normal.space.factors, reference.space.factors, strict=True):
        if factor.name not in ("M", "I_y"):
            assert factor == old
            continue
        low, high = old.distribution.support
        assert factor.distribution.support == pytest.approx((low, high), rel=1e-12)
        assert factor.distribution.mean == pytest.approx(old.distribution.mean, rel=1e-12)
        assert factor.distribution.std == pytest.approx((high - low) / 4, rel=1e-12)
    for path, study in studies.items():
        if path != "reference/study.toml":
            assert (study.findings, study.coupling, study.deceleration) == (None, None, None)
            assert (study.cases == ()) == (path != "k-dependent/study.toml")
