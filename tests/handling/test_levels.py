from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling.levels import Level, load_boundaries, worst

DEG = math.pi / 180.0


def test_every_shipped_boundary_says_how_far_it_is_confirmed():
    shipped = load_boundaries()
    charts = [*shipped.attitude_quickness.values(), *shipped.bandwidth.values()]
    assert {chart.confidence for chart in charts} == {"medium", "low"}
    assert not any(chart.verified for chart in charts)
    assert all(chart.source for chart in charts)
    assert not shipped.dynamic_stability.verified
    assert shipped.dynamic_stability.confidence_zeta_1 == "high"
    assert shipped.limits["pitch_roll_coupling"]["level_1"] == 0.25


def test_quickness_lines_pass_through_their_points():
    chart = load_boundaries().chart("attitude_quickness", "pitch")
    for x, y in ((5.5, 1.58), (10.0, 1.41), (30.0, 0.95)):
        assert chart.limits(x * DEG)[0] == pytest.approx(y)
    assert chart.limits(12.5 * DEG)[0] == pytest.approx(0.5 * (1.41 + 1.24))
    assert chart.limits(1.0 * DEG)[0] == pytest.approx(1.58 + 4.5 * (1.58 - 1.41) / 4.5)
    assert chart.limits(7.0 * DEG)[1] == pytest.approx(0.41 - 1.5 / 4.5 * 0.01)


@pytest.mark.parametrize(
    ("x", "y", "level", "extended"),
    [
        (10.0, 1.42, 1, 1),
        (10.0, 1.40, 2, 2),
        (10.0, 0.39, 3, 3),
        (4.99, 3.0, 0, 1),
        (4.99, 1.0, 0, 2),
        (5.0, 3.0, 1, 1),
        (30.0, 3.0, 1, 1),
        (31.0, 3.0, 0, 1),
        (math.nan, 3.0, -1, -1),
        (10.0, math.nan, -1, -1),
        (2.0, math.nan, -1, -1),
    ],
)
def test_level_of_a_point(x, y, level, extended):
    found = load_boundaries().chart("attitude_quickness", "pitch").levels([x * DEG], [y])
    assert (found[0][0], found[1][0]) == (level, extended)


@pytest.mark.parametrize(
    ("omega_n", "zeta", "level"),
    [
        (5.61, 0.35, 1),
        (5.61, 0.34, 2),
        (5.61, -0.02, 2),
        (5.61, -0.03, 3),
        (0.4, -0.19, 1),
        (0.4, -0.21, 2),
        (0.4, -0.36, 3),
        (0.5, 0.0, 1),
        (0.51, 0.0, 2),
        (math.nan, 0.4, 1),
        (math.nan, 0.2, -1),
        (5.0, math.nan, -1),
    ],
)
def test_level_of_a_damping(omega_n, zeta, level):
    assert load_boundaries().dynamic_stability.levels([omega_n], [zeta])[0] == level


def test_damping_limits_can_be_drawn_down_to_zero_frequency():
    first, second = load_boundaries().dynamic_stability.limits([0.0, 0.3, 0.6])
    assert first.tolist() == [-0.2, -0.2, 0.35]
    assert second[0] == -np.inf
    assert second[1:].tolist() == pytest.approx([-0.139 / 0.3, -0.139 / 0.6])


@given(st.lists(st.sampled_from(list(Level)), min_size=1, max_size=5))
def test_worst_of_several(levels):
    found = worst(*levels)
    if Level.LEVEL_3 in levels:
        expected = Level.LEVEL_3
    elif Level.UNDEFINED in levels:
        expected = Level.UNDEFINED
    else:
        expected = max(levels)
    assert found == expected


def test_worst_goes_run_by_run():
    assert worst([1, 2, 0, -1], [0, 1, 0, 1], [1, 3, 0, 3]).tolist() == [1, 3, 0, 3]


def user_file(tmp_path, old="", new=""):
    from importlib import resources

    text = resources.files("levelone.handling").joinpath("library", "ads33-levels.toml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


def test_a_users_file_replaces_the_boundaries(tmp_path):
    path = user_file(tmp_path, "level_1_2 = [[0.0, 1.0], [0.12, 1.0]]", "level_1_2 = [[0.0, 3.0], [0.12, 3.0]]")
    mine = load_boundaries(path)
    assert mine.chart("bandwidth", "all_other").levels(0.05, 2.0)[0] == Level.LEVEL_2
    assert load_boundaries().chart("bandwidth", "all_other").levels(0.05, 2.0)[0] == Level.LEVEL_1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("schema = 1", "schema = 2", "schema: is 2, must be 1"),
        ("schema = 1", "schema = ", "not a TOML file"),
        ("[attitude_quickness.pitch]", "[atitude_quickness.pitch]", "did you mean 'attitude_quickness'"),
        ('confidence = "medium"', 'confidence = "sure"', "unknown name 'sure'"),
        ("range_deg = [5.0, 30.0]", "range_deg = [30.0, 5.0]", "reversed"),
        ("range_deg = [5.0, 30.0]", "range_rad = [0.1, 0.5]", "did you mean 'range_deg'"),
        ("[5.5, 1.58], [10.0", "[15.5, 1.58], [10.0", "must increase"),
        ("[5.5, 1.58]", "[5.5]", "must be pairs of numbers"),
        ("zeta_1 = 0.35 ", 'zeta_1 = "0.35" # ', "must be a number"),
        ("corner = 0.5 ", "corners = 0.5 ", "did you mean 'corner'"),
        ("[dynamic_stability]", "[limits.dynamic_stability]", "dynamic_stability: missing"),
    ],
)
def test_a_bad_file_is_refused_with_its_field(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message):
        load_boundaries(user_file(tmp_path, old, new))


def test_an_unknown_name_or_path_is_refused(tmp_path):
    with pytest.raises(InputError, match="did you mean 'ads33-levels'"):
        load_boundaries("ads33-level")
    with pytest.raises(InputError, match="cannot be read"):
        load_boundaries(tmp_path / "none.toml")
    with pytest.raises(InputError, match="did you mean 'pitch'"):
        load_boundaries().chart("attitude_quickness", "pitsch")
