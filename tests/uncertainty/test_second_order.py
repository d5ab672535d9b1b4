from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import block_sum, exact, exact_pairs, ishigami, sobol_g, unit_space

from levelone.uncertainty import sobol, sobol_design


def with_pairs(function, k, n, seed, offset=0.0):
    design = sobol_design(unit_space(k), n, seed, second_order=True)
    return design, offset + function(design.points)


def salib_pairs(values, k):
    from SALib.analyze import sobol as salib

    problem = {"num_vars": k, "names": [f"x{j + 1}" for j in range(k)], "bounds": [[0.0, 1.0]] * k}
    return salib.analyze(problem, values, calc_second_order=True, seed=1)


@settings(max_examples=20)
@given(k=st.integers(2, 6), power=st.integers(1, 5), seed=st.integers(0, 2**32))
def test_a_second_order_block_holds_both_halves(k, power, seed):
    n = 2**power
    design = sobol_design(unit_space(k), n, seed, second_order=True)
    blocks = design.unit_points.reshape(n, 2 * k + 2, k)
    plain = sobol_design(unit_space(k), n, seed).unit_points.reshape(n, k + 2, k)
    np.testing.assert_array_equal(blocks[:, : k + 1], plain[:, : k + 1])
    np.testing.assert_array_equal(blocks[:, -1], plain[:, -1])
    for j in range(k):
        mixed = blocks[:, -1].copy()
        mixed[:, j] = blocks[:, 0, j]
        np.testing.assert_array_equal(blocks[:, 1 + k + j], mixed)


@pytest.mark.oracle
@pytest.mark.parametrize(("function", "k"), [(ishigami, 3), (ishigami, 5), (sobol_g, 14), (block_sum, 14)])
def test_pairs_are_the_mean_of_two_of_salib(function, k):
    """SALib takes the first-order parts of a pair from one half of the design; ours is its mean over both halves."""
    design, values = with_pairs(function, k, 256, 3, 50.0)
    blocks = values.reshape(-1, 2 * k + 2)
    exchanged = blocks[:, [2 * k + 1, *range(k + 1, 2 * k + 1), *range(1, k + 1), 0]]
    one, other = salib_pairs(values, k)["S2"], salib_pairs(exchanged.ravel(), k)["S2"]
    np.testing.assert_allclose(sobol(design, values, bootstrap=20).S2, 0.5 * (one + other), rtol=1e-10, atol=1e-10)


@pytest.mark.oracle
def test_totals_differ_from_the_mean_of_two_of_salib_only_by_the_variance_that_they_are_divided_by():
    k = 14
    design, values = with_pairs(block_sum, k, 256, 3)
    blocks = values.reshape(-1, 2 * k + 2)
    a, c, d, b = blocks[:, :1], blocks[:, 1 : k + 1], blocks[:, k + 1 : -1], blocks[:, -1:]
    exchanged = np.hstack([b, d, c, a]).ravel()
    theirs = 0.5 * (salib_pairs(values, k)["ST"] + salib_pairs(exchanged, k)["ST"])
    ratio = np.var(np.hstack([a, b])) / (0.25 * ((a - b) ** 2 + (c - d) ** 2)).mean(axis=0)
    np.testing.assert_allclose(sobol(design, values, bootstrap=20).ST, theirs * ratio, rtol=1e-10)


@pytest.mark.oracle
def test_pairs_agree_with_openturns_on_the_same_points():
    """Saltelli's estimators of OpenTURNS on the same points, centred otherwise: here the two differ by 0.0008 at most."""
    ot = pytest.importorskip("openturns", reason="OpenTURNS is not installed")
    k, n = 3, 2**14
    design, values = with_pairs(ishigami, k, n, 2)
    blocks, points = values.reshape(n, -1), design.points.reshape(n, -1, k)
    order = [0, 2 * k + 1, *range(1, 2 * k + 1)]
    x, y = (np.concatenate([part[:, row] for row in order]) for part in (points, blocks[:, :, None]))
    algorithm = ot.SaltelliSensitivityAlgorithm(ot.Sample(x), ot.Sample(y), n)
    theirs = np.array(algorithm.getSecondOrderIndices())
    above = np.triu_indices(k, 1)
    np.testing.assert_allclose(sobol(design, values, bootstrap=20).S2[above], theirs[above], atol=2e-3)


@settings(max_examples=30)
@given(seed=st.integers(0, 10_000), power=st.integers(2, 7))
def test_first_order_is_never_above_total_and_inert_inputs_have_exactly_none(seed, power):
    design, values = with_pairs(ishigami, 5, 2**power, seed)
    found = sobol(design, values, bootstrap=20)
    assert (found.S1 <= found.ST + 1e-15).all()
    np.testing.assert_array_equal(found.S1[3:], 0.0)
    np.testing.assert_array_equal(found.ST[3:], 0.0)
    np.testing.assert_array_equal(found.S2[:3, 3:], 0.0)


@settings(max_examples=20)
@given(seed=st.integers(0, 1000), scale=st.floats(0.01, 100.0), shift=st.floats(-1e4, 1e4))
def test_an_affine_change_of_the_response_changes_no_pair(seed, scale, shift):
    design, values = with_pairs(ishigami, 3, 64, seed)
    plain, changed = sobol(design, values, bootstrap=20), sobol(design, shift - scale * values, bootstrap=20)
    for index in ("S1", "ST", "S2", "S2_ci"):
        np.testing.assert_allclose(getattr(changed, index), getattr(plain, index), rtol=1e-6, atol=1e-8)


def test_pairs_stand_above_the_diagonal_and_nowhere_without_second_order():
    design, values = with_pairs(ishigami, 4, 32, 0)
    found = sobol(design, values, bootstrap=20)
    above = np.triu(np.ones((4, 4), dtype=bool), 1)
    np.testing.assert_array_equal(np.isfinite(found.S2), above)
    np.testing.assert_array_equal(np.isfinite(found.S2_ci).all(axis=2), above)
    plain = sobol_design(unit_space(4), 32, 0)
    without = sobol(plain, ishigami(plain.points), bootstrap=20)
    assert np.isnan(without.S2).all()
    assert np.isnan(without.S2_ci).all()


@pytest.mark.theory
def test_second_order_halves_the_error_of_first_order_indices():
    """Root mean square error over 40 seeds, on the function where the plain estimator has the larger one."""
    truth = exact("block_sum", 14)[0]
    errors = {False: [], True: []}
    for seed in range(40):
        for second_order, found in errors.items():
            design = sobol_design(unit_space(14), 256, seed, second_order=second_order)
            found.append(sobol(design, block_sum(design.points), bootstrap=2).S1 - truth)
    plain, both = (np.sqrt((np.array(errors[key]) ** 2).mean()) for key in (False, True))
    assert both < 0.6 * plain


@pytest.mark.theory
def test_shares_of_a_function_without_third_order_add_up():
    design, values = with_pairs(ishigami, 3, 2**13, 1)
    found = sobol(design, values, bootstrap=20)
    assert found.S1.sum() + np.nansum(found.S2) == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(found.S2[np.triu_indices(3, 1)], exact_pairs("ishigami", 3)[np.triu_indices(3, 1)], atol=0.006)
