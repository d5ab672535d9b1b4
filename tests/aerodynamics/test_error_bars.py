"""Extrapolation to zero cell size, and whether its error bars hold what they promise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from true_errors import bars_and_errors, shapes

from levelone.aerodynamics.derivatives import kinked
from levelone.aerodynamics.extrapolation import LEVELS, extrapolate

SIZE = 1.0 / np.array(LEVELS)
reals = st.floats(-100.0, 100.0)


@pytest.mark.theory
@given(reals, reals)
def test_second_order_values_are_extrapolated_exactly(limit, factor):
    found = extrapolate(limit + factor * SIZE**2, kinked=False)
    assert found.value == pytest.approx(limit, abs=1e-10 * (1.0 + abs(limit) + abs(factor)))
    assert found.error <= 0.012 * abs(factor) + 2.1e-5 * abs(limit) + 1e-9
    assert found.ordinary == limit + factor * 0.25


@given(reals, st.floats(0.1, 100.0), st.floats(-100.0, 100.0))
def test_the_bar_of_a_kinked_shape_holds_first_order_limits(limit, first, second):
    """Values with a first- and a second-order part: the bar holds the limit, and shrinks with the first-order part."""
    found = extrapolate(limit + first * SIZE + second * SIZE**2, kinked=True)
    assert abs(found.value - limit) <= found.error + 1e-9
    assert found.error <= first + 0.02 * abs(second) + 1e-3 * abs(limit) + 1e-9


def test_a_value_that_is_not_finite_stays_so():
    assert np.isnan(extrapolate(np.array([1.0, np.nan, 1.0]), kinked=False).value)


def test_which_shapes_are_kinked():
    assert {name for name, shape in shapes().items() if kinked(shape)} == {"swept", "tapered", "plates"}


def test_bars_hold_the_converged_value_and_are_not_idle():
    """48 quantities against grids two and three times as fine; benchmarks/test_error_bars.py: 112 against three and 4.5 times."""
    found = [bars_and_errors(shapes()[name], (4, 6)) for name in ("short", "tapered", "wing and tail")]
    bar, error = np.concatenate([bars for bars, _ in found]), np.concatenate([errors for _, errors in found])
    assert bar.size == 48
    assert np.mean(error <= bar) >= 0.9
    assert np.median(bar) <= 5.0 * np.median(error)
    assert np.all(error <= 3.0 * bar)
