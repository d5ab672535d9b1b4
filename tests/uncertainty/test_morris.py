from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import ishigami, unit_space

from levelone.errors import InputError
from levelone.uncertainty import (
    EstimateStatus,
    Factor,
    FactorSpace,
    Uniform,
    latin_hypercube,
    morris,
    morris_design,
)

INDICES = ("mu", "mu_star", "sigma", "distance")


def problem(k):
    return {"num_vars": k, "names": [f"x{j + 1}" for j in range(k)], "bounds": [[0.0, 1.0]] * k}


@pytest.mark.oracle
@pytest.mark.parametrize(("k", "levels", "seed"), [(3, 4, 0), (5, 4, 1), (14, 6, 2)])
def test_agrees_with_salib_on_the_same_points(k, levels, seed):
    from SALib.analyze import morris as salib

    design = morris_design(unit_space(k), 20, levels, seed)
    values = 1e3 + ishigami(design.points)
    ours = morris(design, values)
    theirs = salib.analyze(problem(k), design.points, values, num_levels=levels, seed=1)
    for index in ("mu", "mu_star", "sigma"):
        np.testing.assert_allclose(getattr(ours, index), np.asarray(theirs[index], dtype=float), rtol=1e-10, atol=1e-10)


@pytest.mark.theory
def test_a_linear_response_has_its_coefficients_as_effects_whatever_the_ranges():
    space = FactorSpace([Factor("a", Uniform(-1.0, 3.0)), Factor("b", Uniform(0.0, 0.1)), Factor("c", Uniform(5.0, 9.0))])
    design = morris_design(space, 10, 4, 3)
    result = morris(design, design.points @ [2.0, -50.0, 0.0])
    np.testing.assert_allclose(result.mu, [8.0, -5.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(result.mu_star, [8.0, 5.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(result.sigma, 0.0, atol=1e-12)
    np.testing.assert_allclose(result.mu_star_ci, np.array([[8.0, 8.0], [5.0, 5.0], [0.0, 0.0]]), atol=1e-12)


@pytest.mark.theory
def test_the_effects_of_a_product_have_the_spread_of_its_other_factor():
    # y = u1 u2 on levels 0, 1/3, 2/3, 1: the effect of u1 is u2, uniform on the four levels.
    design = morris_design(unit_space(2), 20_000, 4, 11)
    result = morris(design, design.points.prod(axis=1), bootstrap=2)
    np.testing.assert_allclose(result.mu, 0.5, atol=0.01)
    np.testing.assert_allclose(result.sigma, np.sqrt(5.0 / 36.0), atol=0.01)
    np.testing.assert_allclose(result.distance, np.sqrt(0.25 + 5.0 / 36.0), atol=0.01)


@settings(max_examples=25)
@given(seed=st.integers(0, 1000), scale=st.floats(0.1, 10.0), shift=st.floats(-100.0, 100.0))
def test_an_affine_change_of_the_response_scales_every_index(seed, scale, shift):
    design = morris_design(unit_space(4), 8, 4, seed)
    values = ishigami(design.points)
    plain, changed = morris(design, values, bootstrap=20), morris(design, shift - scale * values, bootstrap=20)
    np.testing.assert_allclose(changed.mu, -scale * plain.mu, atol=1e-9)
    for index in ("mu_star", "sigma", "distance", "mu_star_ci", "sigma_ci", "distance_ci"):
        np.testing.assert_allclose(getattr(changed, index), scale * getattr(plain, index), rtol=1e-6, atol=1e-5)


def test_intervals_hold_the_estimate_and_shrink_with_the_square_root_of_the_trajectories():
    def result(r):
        design = morris_design(unit_space(3), r, 4, 5)
        return morris(design, ishigami(design.points))

    few, many = result(50), result(800)
    for index in INDICES:
        low, high = getattr(many, f"{index}_ci").T
        assert (low <= getattr(many, index)).all()
        assert (getattr(many, index) <= high).all()
    ratio = np.diff(few.mu_star_ci).mean() / np.diff(many.mu_star_ci).mean()
    assert ratio == pytest.approx(4.0, rel=0.3)


def test_the_interval_of_mu_is_that_of_a_mean():
    design = morris_design(unit_space(3), 400, 4, 9)
    result = morris(design, ishigami(design.points), bootstrap=4000)
    expected = 2.0 * 1.96 * result.sigma / np.sqrt(400)
    np.testing.assert_allclose(np.diff(result.mu_ci)[:, 0], expected, rtol=0.06, atol=1e-12)


def with_failures(design, values, rows):
    failed = values.copy()
    failed[list(rows)] = np.nan
    return failed


def test_failed_runs_are_refused_unless_told():
    design = morris_design(unit_space(3), 6, 4, 0)
    values = with_failures(design, ishigami(design.points), [2, 9])
    with pytest.raises(InputError, match=r"2 of 24 runs failed \(rows 2, 9\)"):
        morris(design, values)


def test_dropping_leaves_out_the_trajectory_and_counts_it():
    design = morris_design(unit_space(3), 6, 4, 0)
    values = ishigami(design.points)
    result = morris(design, with_failures(design, values, [4, 5, 23]), policy="drop")
    effects = morris(design, values).effects[[0, 2, 3, 4]]
    np.testing.assert_array_equal(result.effects, effects)
    np.testing.assert_allclose(result.mu_star, np.abs(effects).mean(axis=0))
    assert (result.failed, result.trajectories, result.bounding) == (3, 6, None)


def test_bounding_shows_what_dropping_hides():
    # Failures sit where x1 is high: that corner alone makes x1 matter.
    design = morris_design(unit_space(3), 40, 4, 2)
    values = design.points[:, 1] + 0.01 * design.points[:, 0]
    result = morris(design, np.where(design.points[:, 0] > 0.9, np.nan, values), policy="bound")
    dropped, (low, high) = result.mu_star[0], result.bounding
    assert dropped < 0.02
    assert low.mu_star[0] > 0.2
    assert high.mu_star[0] > 0.2
    assert low.failed == high.failed == result.failed
    assert low.effects.shape == high.effects.shape == (40, 3)


def test_too_few_complete_trajectories_are_a_status_and_not_zeros():
    design = morris_design(unit_space(3), 2, 4, 0)
    result = morris(design, with_failures(design, ishigami(design.points), [0]), policy="drop")
    assert result.status is EstimateStatus.TOO_FEW_RUNS
    for index in INDICES:
        assert np.isnan(getattr(result, index)).all()
        assert np.isnan(getattr(result, f"{index}_ci")).all()


def test_a_constant_response_has_no_effects():
    design = morris_design(unit_space(3), 5, 4, 0)
    result = morris(design, np.full(design.runs, 4.2))
    assert (result.mu_star == 0.0).all()
    assert result.status is EstimateStatus.OK


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda d: morris(d, np.zeros(5)), "24 runs"),
        (lambda d: morris(d, np.zeros(24), policy="ignore"), "ignore"),
        (lambda d: morris(d, np.zeros(24), bootstrap=1), "at least 2"),
        (lambda d: morris(latin_hypercube(d.space, 24, 0), np.zeros(24)), "a morris design is needed"),
    ],
)
def test_wrong_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call(morris_design(unit_space(3), 6, 4, 0))
