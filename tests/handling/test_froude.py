from __future__ import annotations

import doctest
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling import froude
from levelone.handling.froude import froude_scaled, rate_scale
from levelone.handling.levels import load_boundaries

FULL = load_boundaries()
LENGTHS = st.floats(0.1, 100.0)
DEG = math.pi / 180.0


def charts(boundaries):
    return {chart.name: chart for group in (boundaries.attitude_quickness, boundaries.bandwidth) for chart in group.values()}


def numbers(boundaries):
    """Every number of a file of boundaries, in one order."""
    found = []
    for chart in charts(boundaries).values():
        found += [*chart.level_1_2.ravel(), *chart.level_2_3.ravel(), chart.low, chart.high]
    damping = boundaries.dynamic_stability
    found += [damping.zeta_1, damping.corner, damping.zeta_below_corner, damping.growth]
    for table in boundaries.limits.values():
        for value in table.values():
            found += [] if isinstance(value, str) else np.atleast_1d(value).tolist()
    return np.array(found)


def test_docstring_examples():
    outcome = doctest.testmod(froude)
    assert outcome.attempted > 0
    assert outcome.failed == 0


@pytest.mark.theory
def test_a_quarter_of_the_length_doubles_rates_and_halves_times():
    scaled = froude_scaled(FULL, 4.0, 16.0)
    assert scaled.chart("bandwidth", "target_acquisition").level_1_2.tolist() == [[0.0, 4.0], [0.06, 4.0]]
    assert scaled.chart("bandwidth", "target_acquisition").high == pytest.approx(0.06)
    quickness, known = scaled.chart("attitude_quickness", "pitch"), FULL.chart("attitude_quickness", "pitch")
    assert quickness.limits(10.0 * DEG)[0] == pytest.approx(2.0 * 1.41)
    assert (quickness.low, quickness.high) == (known.low, known.high)
    damping = scaled.dynamic_stability
    assert (damping.zeta_1, damping.zeta_below_corner) == (0.35, -0.20)
    assert (damping.corner, damping.growth) == pytest.approx((1.0, 0.278))
    assert scaled.limits["translational_rate"]["rise_time_level_1"] == pytest.approx([1.25, 2.5])
    height = scaled.limits["height_response"]
    assert [height[key] for key in ("level_1_T", "level_1_tau", "level_2_tau")] == pytest.approx([2.5, 0.1, 0.15])
    coupling = scaled.limits["pitch_roll_coupling"]
    assert (coupling["level_1"], coupling["level_2"]) == (0.25, 0.60)


@given(length=LENGTHS)
def test_equal_lengths_change_nothing(length):
    assert froude_scaled(FULL, length, length) is FULL


@settings(max_examples=30)
@given(a=LENGTHS, b=LENGTHS, c=LENGTHS)
def test_scaling_twice_is_scaling_once_over_both(a, b, c):
    twice = froude_scaled(froude_scaled(FULL, b, a), c, b)
    np.testing.assert_allclose(numbers(twice), numbers(froude_scaled(FULL, c, a)), rtol=1e-12)


@settings(max_examples=30)
@given(a=LENGTHS, b=LENGTHS)
def test_there_and_back_again(a, b):
    np.testing.assert_allclose(numbers(froude_scaled(froude_scaled(FULL, a, b), b, a)), numbers(FULL), rtol=1e-12)


@settings(max_examples=100)
@given(
    ratio=st.floats(0.05, 50.0),
    angle=st.floats(1.0, 60.0),
    rate=st.floats(0.05, 6.0),
    delay=st.floats(0.0, 0.3),
    zeta=st.floats(-0.9, 0.9),
)
@pytest.mark.theory
def test_a_dynamically_similar_aircraft_keeps_its_levels(ratio, angle, rate, delay, zeta):
    """Angles and damping ratios alike, rates times sqrt(N), times over sqrt(N): the same Level in every criterion."""
    scaled, factor = froude_scaled(FULL, 1.0, ratio), math.sqrt(ratio)
    for name, chart in charts(FULL).items():
        x = angle * DEG if name.startswith("attitude") else delay
        across = 1.0 if name.startswith("attitude") else 1.0 / factor
        assume(min(abs(rate - limit) for limit in chart.limits(x)) > 1e-9)
        assume(min(abs(x - chart.low), abs(x - chart.high)) > 1e-9 or x == 0.0)
        full, small = chart.levels(x, rate), charts(scaled)[name].levels(across * x, factor * rate)
        assert [level.item() for level in full] == [level.item() for level in small]
    first, second = FULL.dynamic_stability.limits(rate)
    assume(min(abs(zeta - first), abs(zeta - second), abs(rate - FULL.dynamic_stability.corner)) > 1e-9)
    small_damping = scaled.dynamic_stability.levels(factor * rate, zeta)
    assert small_damping == FULL.dynamic_stability.levels(rate, zeta)


def test_a_smaller_aircraft_must_be_faster_and_a_larger_one_may_be_slower():
    small, large = froude_scaled(FULL, 3.0, 16.36), froude_scaled(FULL, 30.0, 16.36)
    for name, chart in charts(FULL).items():
        middle = 0.5 * (chart.low + chart.high)
        assert charts(small)[name].limits(0.1 * middle)[0] > chart.limits(0.1 * middle)[0]
        assert charts(large)[name].limits(0.1 * middle)[0] < chart.limits(0.1 * middle)[0]


def test_the_lengths_are_stated_and_nothing_is_called_confirmed():
    scaled = froude_scaled(FULL, 3.0, 16.36)
    said = "Froude-scaled from 16.36 m to 3 m"
    assert said in scaled.name
    assert said in scaled.source
    damping = scaled.dynamic_stability
    assert FULL.dynamic_stability.confidence_zeta_1 == "high"
    assert damping.confidence_zeta_1 == "medium"
    for chart in (*charts(scaled).values(), damping):
        assert not chart.verified
        assert said in chart.source
        assert said in chart.note
    for name, table in scaled.limits.items():
        assert FULL.limits[name]["confidence"] in ("high", "low")
        assert table["confidence"] == {"high": "medium", "low": "low"}[FULL.limits[name]["confidence"]]
        assert said in table["source"]
        assert said in table["note"]
        assert ("does not change" in table["note"]) == (name == "pitch_roll_coupling")
    assert FULL.name == "ADS-33E-PRF (unverified where marked)"  # the boundaries given are left as they were


@pytest.mark.parametrize("bad", [0.0, -3.0, math.nan, math.inf])
def test_lengths_must_be_positive(bad):
    for function in (rate_scale, lambda length, reference: froude_scaled(FULL, length, reference)):
        with pytest.raises(InputError, match=r"froude.length: is .* m, must be finite and positive"):
            function(bad, 16.36)
        with pytest.raises(InputError, match=r"froude.reference_length: is .* m, must be finite and positive"):
            function(3.0, bad)


def test_a_limit_of_unknown_dimension_is_refused():
    unknown = replace(FULL, limits=dict(FULL.limits) | {"torque_response": {"level_1": 1.0}})
    with pytest.raises(InputError, match="unknown name 'torque_response'"):
        froude_scaled(unknown, 3.0, 16.36)
    extra = replace(FULL, limits={"translational_rate": {"rise_time_level_1": [2.5, 5.0], "rise_time_level_3": 8.0}})
    with pytest.raises(InputError, match="did you mean 'rise_time_level_1'"):
        froude_scaled(extra, 3.0, 16.36)
