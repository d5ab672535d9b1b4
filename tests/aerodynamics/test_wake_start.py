"""The wake begins where the lattice has no error of order n^(-1/2)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from levelone.aerodynamics.wake_start import wake_start
from levelone.errors import InputError


@pytest.mark.theory
def test_a_uniform_row_of_vortices_needs_no_gap():
    """Wake vortices at the distance of the bound ones continue their row: a quarter panel behind the edge."""
    assert wake_start(1.0) + 0.5 == pytest.approx(0.25, abs=1e-15)
    assert wake_start(1.0 + 1e-7) == pytest.approx(-0.25, abs=1e-6)


@pytest.mark.theory
def test_the_continuous_wake_is_the_limit_of_dense_ones():
    dense = [wake_start(h) for h in (0.1, 0.05, 0.025)]
    assert np.all(np.diff(np.abs(np.array(dense) - wake_start(0.0))) < 0.0)
    assert dense[-1] == pytest.approx(wake_start(0.0), abs=3e-4)


def start_of_a_long_row(h: float) -> float:
    """The same start from a long row of vortices: circulation that a sheet of constant strength induces must not depend on the gap.

    A lattice of n panels carries a sheet that rises linearly from the leading edge and goes on with constant strength; the wake
    starts where the total circulation of the lattice is exact. Independent of the closed weights: it solves the lattice itself.
    """
    n, far = 400, 4000.0
    vortex, point = np.arange(n) + 0.25, np.arange(n) + 0.75
    matrix = 1.0 / (point[:, None] - vortex[None, :])
    # exact velocity of strength x/n on 0..n and 1 on n..far (principal value)
    exact = (point / n) * np.log(point / np.abs(n - point)) - 1.0 + np.log((n - point) / (far - point))
    weights = np.linalg.solve(matrix.T, np.ones(n))

    def excess(start: float) -> float:
        if h == 0.0:
            wake = np.log((n + start - point) / (far - point))
        else:
            rows = n + start + (np.arange(round((far - n - start) / h)) + 0.5) * h
            wake = np.sum(h / (point[:, None] - rows[None, :]), axis=1) + np.log((rows[-1] + 0.5 * h - point) / (far - point))
        bound_part = n + start - 0.5 * n  # circulation of the sheet ahead of the wake
        return float(weights @ (exact - wake)) - bound_part

    # the first wake vortex, or the beginning of the wake, lies behind the last collocation point
    return float(brentq(excess, -0.24 - 0.5 * h, 0.2))


@pytest.mark.theory
@pytest.mark.parametrize("h", [0.0, 0.5, 1.0, 2.0])
def test_start_agrees_with_a_solved_row(h):
    assert start_of_a_long_row(h) == pytest.approx(wake_start(h), abs=2e-4)


@given(st.floats(0.02, 8.0), st.floats(0.02, 8.0))
def test_wider_rows_start_further_ahead(one, other):
    if one < other:
        assert wake_start(one) >= wake_start(other) - 1e-12


@pytest.mark.parametrize("h", [-0.1, float("nan"), float("inf")])
def test_no_negative_distance(h):
    with pytest.raises(InputError, match="distance of wake vortices"):
        wake_start(h)
