"""Largest errors on functions of 14 inputs whose indices are known exactly, at 2^14 base points."""

from __future__ import annotations

import numpy as np
import pytest
from uncertainty_functions import FUNCTIONS, REFERENCE, exact, exact_pairs, unit_space

from levelone.uncertainty import sobol, sobol_design


def test_the_helpers_quadrature_is_exact_for_a_product_of_two():
    """The block x1 x2 of two uniform inputs: variance 7/144, each main effect 1/48, the pair 1/144."""
    from uncertainty_functions import block_truth

    main, total, pair, variance = block_truth((((0, 1), lambda x: x[..., 0] * x[..., 1]),), 2)
    assert variance == pytest.approx(7.0 / 144.0, rel=1e-13)
    np.testing.assert_allclose(main, 1.0 / 48.0, rtol=1e-13)
    np.testing.assert_allclose(total, 1.0 / 48.0 + 1.0 / 144.0, rtol=1e-13)
    assert pair[0, 1] == pytest.approx(1.0 / 144.0, rel=1e-12)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_known_indices_are_consistent(name):
    """First-order share plus the pairs of an input are its total share where nothing of third order is there."""
    S1, ST = exact(name, 14)
    S2 = exact_pairs(name, 14)
    third = {"ishigami": 0.0, "sobol_g": 0.002, "block_sum": 0.02}[name]
    gap = ST - (S1 + S2.sum(axis=0) + S2.sum(axis=1))
    assert gap.min() >= -1e-12
    assert gap.max() <= third + 1e-12


@pytest.mark.theory
@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("scramblings", [1, 4])
def test_errors_at_two_to_the_fourteen_base_points(name, scramblings):
    largest = REFERENCE["direct"]
    S1, ST = exact(name, 14)
    above = np.triu_indices(14, 1)
    for seed in range(2):
        n = largest["base_points"] // scramblings
        design = sobol_design(unit_space(14), n, seed, second_order=True, scramblings=scramblings)
        found = sobol(design, FUNCTIONS[name](design.points), bootstrap=2)
        np.testing.assert_allclose(found.S1, S1, atol=largest["S1_error_most"])
        np.testing.assert_allclose(found.ST, ST, atol=largest["ST_error_most"])
        np.testing.assert_allclose(found.S2[above], exact_pairs(name, 14)[above], atol=largest["S2_error_most"])
