"""Blocks that are written load as factors of the study, with the spans that the derivatives have."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.derivatives import Derivatives
from levelone.config.study_file import Study, load_study
from levelone.config.study_writer import APART, LUMPED, Written, write_study
from levelone.errors import InputError
from levelone.uncertainty import Interval, Uniform
from levelone.vehicle import TARGETS

STUDY = Path(__file__).parents[2] / "studies" / "reference" / "study.toml"
GEOMETRY = "reference-wing-tail"
BARE = '[study]\nextends = "{base}"\nname = "child"\n'


def found(
    motions: tuple[str, ...] = ("pitch", "heave", "rate"), k: tuple[float, ...] = (0.1, 0.3), error: float = 0.0
) -> Derivatives:
    """Values by hand: in phase motion + coefficient / 10, in quadrature the negative; k is added, so that everything has a span."""
    n, c = len(motions), len(NAMES)
    values = np.arange(1.0, n + 1.0)[:, None, None] + np.array(k)[None, :, None] + 0.1 * np.arange(c)
    errors = np.full(values.shape, error)
    return Derivatives(motions, np.array(k), NAMES, values, -values, errors, errors, values, -values)


@pytest.fixture
def child(tmp_path: Path) -> Path:
    path = tmp_path / "study.toml"
    path.write_text(BARE.format(base=STUDY))
    return path


def write(path: Path, *args, **more) -> Written:
    return write_study(path, *(args or (found(),)), GEOMETRY, STUDY, **more)


def ends(study: Study, name: str) -> list[float]:
    distribution = study.space[name].distribution
    assert isinstance(distribution, Uniform)
    return [distribution.low, distribution.high]


def test_factor_has_the_span_of_the_derivative_and_the_vehicles_value(child: Path) -> None:
    write(child, found(("pitch",)), lumped=True, names=["C_Lalpha"])
    study = load_study(child)
    # 1.1 to 1.3 over k; the vehicle's 5.127 lies outside and is taken in
    assert ends(study, "C_Lalpha") == pytest.approx([1.1, 5.127], abs=1e-6)
    assert study.nominal[study.space.index("C_Lalpha")] == 5.127


def test_span_that_holds_the_vehicles_value_is_not_widened(child: Path) -> None:
    wide = found(("rate",))
    wide.quadrature[0, :, NAMES.index("C_m")] = [-18.2, -15.0]
    written = write(child, wide, names=["C_mq"])
    assert ends(load_study(child), "C_mq") == pytest.approx([-18.2, -15.0], abs=1e-6)
    assert not written.spans[0].outside
    assert "lies outside" not in written.text


def test_value_outside_is_told_in_the_source(child: Path) -> None:
    written = write(child, names=["C_mq"])
    assert [(span.name, span.outside) for span in written.spans] == [("C_mq", True)]
    source = load_study(child).space["C_mq"].source
    assert "2 k from 0.1 to 0.3: -3.7 to -3.5; the vehicle's own -16.169 lies outside" in source
    assert source.startswith("levelone ")
    assert f"geometry {GEOMETRY} (" in source


def test_error_bars_widen_the_span_and_rounding_goes_outwards(child: Path) -> None:
    given = found(("rate",), error=0.5)
    given.quadrature[0, :, NAMES.index("C_L")] = [7.12341, 8.0]
    (span,) = write(child, given, names=["C_Lq"]).spans
    assert (span.low, span.high) == (6.623, 8.5)
    given.quadrature_error[:] = math.nan  # other codes print none
    (span,) = write(child, given, names=["C_Lq"]).spans
    assert (span.low, span.high) == (7.123, 8.0)


def test_parts_apart_come_from_rate_and_heave(child: Path) -> None:
    spans = {span.name: span.low for span in write(child).spans}
    assert spans == pytest.approx({"C_Lalpha": 2.1, "C_malpha": 2.5, "C_Lq": -3.3, "C_mq": -3.7, "C_Lalphadot": -2.3,
                                   "C_malphadot": -2.7})  # fmt: skip
    assert set(load_study(child).space.names) >= set(spans)


def test_lumped_parts_come_from_pitch_and_say_so(child: Path) -> None:
    written = write(child, lumped=True)
    assert {span.name: span.low for span in written.spans} == pytest.approx(
        {"C_Lalpha": 1.1, "C_malpha": 1.5, "C_Lq": -1.3, "C_mq": -1.7}
    )
    assert written.text.count("C_q and C_alphadot of a pitch oscillation in one") == 2


def test_lateral_motions_give_lateral_factors(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(BARE.format(base=STUDY) + 'without = ["coupling"]\n')
    written = write(path, found(("sideslip", "roll", "yaw_rate")))
    assert [span.name for span in written.spans] == ["C_lbeta", "C_nbeta", "C_Yp", "C_lp", "C_np", "C_Yr", "C_lr", "C_nr"]
    assert ("C_mq", "needs the motion rate") in written.left_out


def test_what_the_geometry_does_not_have_is_left_out_with_the_reason(child: Path) -> None:
    given = found(("pitch",))
    given.in_phase[0, :, NAMES.index("C_m")] = 0.0
    given.quadrature[0, 0, NAMES.index("C_m")] = math.nan
    written = write(child, given, lumped=True)
    assert dict(written.left_out) == {
        "C_malpha": "is 0 at every k: nothing of the geometry gives it",
        "C_mq": "is not finite at every k",
    }
    with pytest.raises(InputError, match="C_mq is not finite at every k"):
        write(child, given, lumped=True, names=["C_Lq", "C_mq"])


def test_everything_else_of_the_file_stays(study_file) -> None:
    path = study_file()
    before = path.read_text()
    after = write(path, lumped=True, names=["C_Lq", "C_mq"]).text
    assert path.read_text() == after
    changed = [line for line in before.splitlines() if line not in after.splitlines()]
    assert changed == []  # every old line, comments too, is still there somewhere
    head, old = before[: before.index('[[factor]]\nname = "C_Lq"')], before[before.index("# Pitch-roll coupling") :]
    assert after.startswith(head)
    assert after.endswith(old)


def test_second_writing_replaces_the_first(child: Path) -> None:
    write(child)
    first = child.read_text()
    write(child)
    assert child.read_text() == first
    assert first.count("[[factor]]") == 6


def test_factor_under_another_name_and_distribution_is_replaced(study_file) -> None:
    old = 'name = "C_mq"\nvalue = -16.169\nunit = "1/rad"\nrange = [-0.20, 0.20]\nkind = "relative"\nsource = "study, Table 2"\n'
    new = 'name = "damping" # of pitch\ntarget = "C_mq"\nvalue = -16.169\nunit = "1/rad"\ndistribution = "triangular"\n'
    block = (old, new + 'low = -17.0\nmode = -16.0\nhigh = -15.0\nassumed = "a guess"\n')
    path = study_file(block)
    write(path, names=["C_mq"])
    study = load_study(path)
    assert ends(study, "damping") == pytest.approx([-16.169, -3.5], abs=1e-6)
    assert "factor.damping" not in dict(study.assumed)
    assert 'name = "damping" # of pitch' in path.read_text()


@pytest.mark.parametrize("text", ["interval", "evidence"])
def test_a_factor_of_one_unknown_value_stays_one(study_file, text: str) -> None:
    old = 'name = "C_mq"\nvalue = -16.169\nunit = "1/rad"\nrange = [-0.20, 0.20]\nkind = "relative"\n'
    focal = "intervals = [[-19.4, -12.9]]\nmasses = [1.0]\n"
    new = 'name = "C_mq"\nvalue = -16.169\nunit = "1/rad"\ndistribution = "' + text + '"\n'
    path = study_file((old, new + ('range = [-0.2, 0.2]\nkind = "relative"\n' if text == "interval" else focal)))
    write(path, names=["C_mq"])
    study = load_study(path)
    assert isinstance(study.space["C_mq"].distribution, Interval)
    assert ends(study, "C_mq") == pytest.approx([-16.169, -3.5], abs=1e-6)


def test_inherited_distribution_does_not_stay(tmp_path: Path, study_file) -> None:
    base = study_file((
        'kind = "relative"\nsource = "study, Table 2"\n\n# Pitch-roll',
        'distribution = "triangular"\nlow = -17.0\nmode = -16.0\nhigh = -15.0\nsource = "x"\n\n# Pitch-roll',
    ), ('value = -16.169\nunit = "1/rad"\nrange = [-0.20, 0.20]', 'value = -16.169\nunit = "1/rad"'))  # fmt: skip
    path = tmp_path / "child.toml"
    path.write_text(BARE.format(base=base))
    write(path, names=["C_mq"])
    assert ends(load_study(path), "C_mq") == pytest.approx([-16.169, -3.5], abs=1e-6)


def test_study_that_keeps_some_factors_keeps_the_new_one(child: Path) -> None:
    child.write_text(child.read_text() + 'without = ["coupling"]\nfactors = ["M"]\n')
    write(child, names=["C_malphadot"])
    assert load_study(child).space.names == ("M", "C_malphadot")


def test_new_study_extends_the_other_without_its_claims(tmp_path: Path) -> None:
    path = tmp_path / "k of mine" / "study.toml"
    path.parent.mkdir()
    write(path, names=["C_Lalphadot"])
    study = load_study(path)
    assert study.name == "k-of-mine"
    assert study.findings is None
    assert study.cases == ()
    assert ends(study, "C_Lalphadot") == pytest.approx([-2.3, 0.0], abs=1e-6)
    assert len(study.space) == len(load_study(STUDY).space) + 1


def test_part_in_alphadot_is_not_counted_twice(child: Path) -> None:
    write(child)
    before = child.read_text()
    with pytest.raises(InputError, match=r"factor\.C_Lalphadot: is a factor of the study"):
        write(child, lumped=True)
    assert child.read_text() == before


def test_vehicle_with_a_part_in_alphadot_takes_no_lumped_derivative(study_file, vehicle_file) -> None:
    craft = vehicle_file(("C_malphadot = { value = 0.0", "C_malphadot = { value = -4.5"))
    path = study_file(('vehicle = "reference-evtol"', f'vehicle = "{craft.as_posix()}"'))
    with pytest.raises(InputError, match=r"C_malphadot: is -4\.5 in the vehicle"):
        write(path, lumped=True)


@pytest.mark.parametrize(
    ("given", "more", "words"),
    [
        (found(k=(0.1,)), {}, "k: 1 value spans no range"),
        (found(("yaw",)), {}, "factor: no range for what was asked: C_Lalpha needs the motion heave"),
        (found(), {"names": ["C_mqq"]}, "C_mqq is not read from these oscillations"),
    ],
)
def test_what_gives_no_range_is_refused(child: Path, given: Derivatives, more: dict, words: str) -> None:
    before = child.read_text()
    with pytest.raises(InputError) as caught:
        write(child, given, **more)
    assert words in str(caught.value)
    assert child.read_text() == before


def test_study_that_is_not_there_needs_one_to_extend(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is none to extend"):
        write_study(tmp_path / "study.toml", found(), GEOMETRY, tmp_path / "none.toml")
    assert list(tmp_path.iterdir()) == []


def test_every_factor_is_a_target() -> None:
    assert set(APART) | set(LUMPED) <= set(TARGETS)
