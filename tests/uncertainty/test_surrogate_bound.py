"""The worst case of a surrogate's error holds whatever the error looks like, and takes the place of drawn functions where small."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import unit_space

from levelone.uncertainty import Kriging, latin_hypercube, sobol_design, sobol_on_surrogate
from levelone.uncertainty.surrogate_bound import SAFETY, worst_case

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
NODES, WEIGHTS = 0.5 * (NODES + 1.0), 0.5 * WEIGHTS
X1, X2 = np.meshgrid(NODES, NODES, indexing="ij")


def indices(f):
    """Exact S1 and ST [2, 2] and the standard deviation of a function of two inputs, given on the nodes."""
    f = f - WEIGHTS @ f @ WEIGHTS
    alone = np.array([WEIGHTS @ (f @ WEIGHTS) ** 2, WEIGHTS @ (WEIGHTS @ f) ** 2])
    whole = WEIGHTS @ f**2 @ WEIGHTS
    return np.array([alone, whole - alone[::-1]]) / whole, np.sqrt(whole)


@pytest.mark.theory
@settings(max_examples=60)
@given(part=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6), size=st.floats(1e-3, 0.4))
def test_no_error_of_that_size_moves_an_index_further(part, size):
    g = np.sin(3.0 * X1) + X1 * X2**2
    shapes = np.array([X1, X2, X1 * X2, np.cos(5.0 * X1), X2**3, np.sin(4.0 * X1 * X2)])
    e = np.tensordot(np.array(part) + 1e-6, shapes, 1)
    found, spread = indices(g)
    _, error = indices(e)
    e *= size * spread / error
    truth, _ = indices(g + e)
    low, high = np.moveaxis(worst_case(found, 1.0 - (size / SAFETY) ** 2), -1, 0)
    assert (low - 1e-12 <= truth).all()
    assert (truth <= high + 1e-12).all()


@pytest.mark.theory
def test_an_error_on_one_factor_alone_comes_near_the_bound():
    g = X1 + 0.5 * X2
    found, spread = indices(g)
    e = 0.01 * spread * (X1 - 0.5) * np.sqrt(12.0)
    truth, _ = indices(g + e)
    high = worst_case(found, 1.0 - (0.01 / SAFETY) ** 2)[..., 1]
    assert 0.0 < truth[0, 0] - found[0, 0] < high[0, 0] - found[0, 0] < 12.0 * (truth[0, 0] - found[0, 0])


def test_nothing_is_known_of_a_poor_surrogate():
    assert worst_case(np.array([0.2, 0.0]), 0.7).tolist() == [[0.0, np.inf], [0.0, np.inf]]


def smooth(u):
    return np.exp(0.5 * u[:, 0] * u[:, 1]) + 0.3 * u[:, 2] ** 2


def test_a_very_good_surrogate_needs_no_draws():
    space = unit_space(4)
    design, x = sobol_design(space, 256, 3), latin_hypercube(space, 80, 1).unit_points
    y = smooth(x)
    model = Kriging.fit(x, y, 1)
    found = sobol_on_surrogate(x, y, model, design, 5)
    assert found.error_kind == "bounded"
    assert np.isnan([found.acceptance, found.inflation]).all()
    for ci, inner in ((found.S1_ci, found.S1_ci_sampling), (found.ST_ci, found.ST_ci_sampling)):
        assert (ci[:, 0] <= inner[:, 0]).all()
        assert (ci[:, 1] >= inner[:, 1]).all()
        assert np.diff(ci).max() <= 1.13 * np.diff(inner).max() + 0.004
    drawn = np.random.default_rng(2).normal(scale=0.2 * y.std(), size=80)
    assert sobol_on_surrogate(x, y + drawn, Kriging.fit(x, y + drawn, 1), design, 5).error_kind == "drawn"
