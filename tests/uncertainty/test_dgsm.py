from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import REFERENCE, exact, ishigami, sobol_g, unit_space

from levelone.errors import InputError
from levelone.uncertainty import (
    Discrete,
    EstimateStatus,
    Factor,
    FactorSpace,
    LogNormal,
    Normal,
    Triangular,
    TruncatedNormal,
    Uniform,
    latin_hypercube,
)
from levelone.uncertainty.dgsm import derivative_design, derivative_measures, derivatives

MIXED = FactorSpace(
    [
        Factor("a", Uniform(-1.0, 3.0)),
        Factor("b", Normal(2.0, 0.3)),
        Factor("c", LogNormal(0.1, 0.4)),
        Factor("d", Triangular(0.0, 1.0, 2.0)),
        Factor("e", TruncatedNormal(0.0, 1.0, -1.0, 8.0)),
    ]
)


@pytest.mark.theory
def test_squared_derivatives_of_ishigami_in_closed_form():
    # x = pi (2 u - 1): the derivative in u is 2 pi times that in x; the means over x are elementary integrals.
    a, b = REFERENCE["ishigami"]["a"], REFERENCE["ishigami"]["b"]
    pi = np.pi
    in_x = [0.5 * (1.0 + 2.0 * b * pi**4 / 5.0 + b**2 * pi**8 / 9.0), 0.5 * a**2, 0.5 * 16.0 * b**2 * pi**6 / 7.0]
    truth = np.array([*in_x, 0.0]) * (2.0 * pi) ** 2
    design = derivative_design(unit_space(4), 4096, 1)
    result = derivative_measures(design, 1e3 + ishigami(design.points))
    np.testing.assert_allclose(result.nu, truth, rtol=0.01, atol=1e-9)
    np.testing.assert_allclose(result.ST_bound, truth / pi**2 / REFERENCE["ishigami"]["variance"], rtol=0.02, atol=1e-9)
    assert (result.ST_bound >= exact("ishigami", 4)[1] - 1e-9).all()


@pytest.mark.theory
def test_the_bound_is_reached_by_the_eigenfunction_of_the_uniform_distribution():
    # cos(pi u) has the largest variance for its slope among functions of a uniform variable.
    design = derivative_design(unit_space(1), 1024, 2, step=0.003)
    result = derivative_measures(design, np.cos(np.pi * design.points[:, 0]))
    assert result.ST_bound[0] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.theory
def test_a_linear_function_has_its_coefficients_as_slopes_whatever_the_distribution():
    coefficients = np.array([2.0, -3.0, 0.0, 0.5, 1.0])
    design = derivative_design(MIXED, 64, 3)
    logarithm = design.points.copy()
    logarithm[:, 2] = np.log(logarithm[:, 2])
    for points, coefficient_of_c in ((design.points, 0.0), (logarithm, 4.0)):
        slope = coefficients + np.array([0.0, 0.0, coefficient_of_c, 0.0, 0.0])
        result = derivative_measures(design, points @ slope)
        np.testing.assert_allclose(result.mean_magnitude, np.abs(slope), atol=1e-7)
        np.testing.assert_allclose(result.nu, slope**2, atol=1e-7)
        np.testing.assert_allclose(result.nu_ci, np.repeat(slope[:, None] ** 2, 2, axis=1), atol=1e-7)


@pytest.mark.theory
def test_the_bound_of_a_linear_function_is_the_variance_of_normal_factors_and_more_than_that_of_others():
    design = derivative_design(MIXED, 4096, 3)
    values = design.points @ [1.0, 5.0, 0.0, 2.0, 1.5] + 3.0 * np.log(design.points[:, 2])
    result = derivative_measures(design, values)
    own = np.array([16.0 / 12.0, (5.0 * 0.3) ** 2, (3.0 * 0.4) ** 2, 4.0 / 6.0, 0.0])
    own[4] = 1.5**2 * design.points[:: design.block, 4].var()
    share = own / own.sum()
    np.testing.assert_allclose(result.ST_bound[1:3], share[1:3], rtol=0.02)
    assert (result.ST_bound[[0, 3, 4]] > share[[0, 3, 4]]).all()
    # the truncated normal is 9 wide, but no wider than its standard deviation of 1 allows
    assert result.ST_bound[4] == pytest.approx(1.5**2 / own.sum(), rel=0.02)


@pytest.mark.theory
def test_the_bound_holds_for_the_total_index_of_g():
    design = derivative_design(unit_space(14), 1024, 5)
    result = derivative_measures(design, sobol_g(design.points))
    assert (result.ST_bound_ci[:, 0] > exact("sobol_g", 14)[1]).all()


@pytest.mark.order
def test_the_error_falls_with_the_square_of_the_step():
    def error(step):
        design = derivative_design(FactorSpace([Factor("x", Normal(0.0, 1.0))]), 256, 0, step=step)
        centre = design.points[:: design.block, 0]
        return np.abs(derivatives(design, np.sin(design.points[:, 0]))[:, 0] - np.cos(centre)).mean()

    slope = np.log2(error(0.02) / error(0.01))
    assert slope == pytest.approx(2.0, abs=0.05)


@pytest.mark.oracle
def test_it_agrees_with_salib_on_the_same_points():
    # SALib differences forward from a base point: for each factor it is given the lower neighbours as base points.
    from SALib.analyze import dgsm as salib

    k, n = 3, 64
    design = derivative_design(unit_space(k), n, 4)
    values = ishigami(design.points)
    ours = derivative_measures(design, values)
    points, y = design.points.reshape(n, design.block, k), values.reshape(n, design.block)
    for j in range(k):
        pair = [1 + j, 1 + k + j]
        problem = {"num_vars": 1, "names": ["x"], "bounds": [[0.0, 1.0]]}
        theirs = salib.analyze(problem, points[:, pair, j].reshape(-1, 1), y[:, pair].ravel(), num_resamples=2, seed=1)
        assert ours.nu[j] == pytest.approx(float(theirs["vi"][0]), rel=1e-9)
        # it takes the variance from its base points, ours is that of the centres
        bound = float(theirs["dgsm"][0]) * y[:, 1 + j].var() / ours.variance
        assert ours.ST_bound[j] == pytest.approx(bound, rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(power=st.integers(1, 5), seed=st.integers(0, 2**32), step=st.floats(1e-4, 0.1))
def test_neighbours_lie_on_both_sides_inside_the_cube_and_differ_in_one_factor(power, seed, step):
    design = derivative_design(MIXED, 2**power, seed, step=step)
    k = len(MIXED)
    blocks = design.unit_points.reshape(-1, 2 * k + 1, k)
    assert ((blocks >= 0.0) & (blocks <= 1.0)).all()
    for j in range(k):
        for row, way in ((1 + j, -1.0), (1 + k + j, 1.0)):
            moved = blocks[:, row] - blocks[:, 0]
            assert (moved[:, j] * way >= 0.0).all()
            np.testing.assert_array_equal(np.delete(moved, j, axis=1), 0.0)
        assert (blocks[:, 1 + k + j, j] > blocks[:, 1 + j, j]).all()


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 1000), scale=st.floats(0.1, 10.0), shift=st.floats(-100.0, 100.0))
def test_an_affine_change_of_the_response_leaves_the_bound(seed, scale, shift):
    design = derivative_design(unit_space(3), 16, seed)
    values = ishigami(design.points)
    plain = derivative_measures(design, values, bootstrap=20)
    changed = derivative_measures(design, shift - scale * values, bootstrap=20)
    np.testing.assert_allclose(changed.ST_bound, plain.ST_bound, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(changed.mean_magnitude, scale * plain.mean_magnitude, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(changed.nu, scale**2 * plain.nu, rtol=1e-6, atol=1e-8)


def test_failures_are_dropped_by_base_point_and_bounded():
    design = derivative_design(unit_space(3), 64, 6)
    values = ishigami(design.points)
    failed = np.where(np.random.default_rng(0).random(design.runs) < 0.02, np.nan, values)
    result = derivative_measures(design, failed, policy="drop")
    complete = np.isfinite(failed.reshape(-1, 7)).all(axis=1)
    assert (result.failed, result.used) == (np.isnan(failed).sum(), complete.sum())
    np.testing.assert_allclose(result.nu, (derivatives(design, values)[complete] ** 2).mean(axis=0), rtol=1e-12)
    corner = np.where(design.points[:, 0] > 0.8, np.nan, design.points[:, 1])
    bounded = derivative_measures(design, corner, policy="bound")
    assert bounded.ST_bound[0] == pytest.approx(0.0, abs=1e-12)
    assert max(one.ST_bound[0] for one in bounded.bounding) > 1.0


def test_undefined_measures_are_nan_with_a_status():
    design = derivative_design(unit_space(2), 8, 0)
    constant = derivative_measures(design, np.full(design.runs, 2.0))
    assert constant.status is EstimateStatus.CONSTANT_RESPONSE
    assert np.isnan(constant.ST_bound).all()
    few = derivative_measures(design, np.full(design.runs, np.nan), policy="drop")
    assert few.status is EstimateStatus.TOO_FEW_RUNS
    assert np.isnan(few.nu_ci).all()


CORRELATED = FactorSpace(unit_space(2).factors, correlation=[[1.0, 0.5], [0.5, 1.0]])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: derivative_design(CORRELATED, 8, 0), "x1 and x2 are correlated.*Shapley"),
        (lambda: derivative_design(FactorSpace([Factor("n", Discrete((1.0, 2.0)))]), 8, 0), "factor n: Discrete has no derivative"),
        (lambda: derivative_design(unit_space(2), 12, 0), "power of two"),
        (lambda: derivative_design(unit_space(2), 8, 0, step=0.2), "at most 0.1"),
        (lambda: derivative_measures(latin_hypercube(unit_space(2), 40, 0), np.zeros(40)), "a derivatives design is needed"),
        (lambda: derivative_measures(derivative_design(unit_space(2), 8, 0), np.full(40, np.nan)), "40 of 40 runs failed"),
    ],
)
def test_wrong_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()
