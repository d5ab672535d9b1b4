from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import exact, ishigami, sobol_g, unit_space

from levelone.errors import InputError
from levelone.uncertainty import (
    Discrete,
    EstimateStatus,
    Factor,
    FactorSpace,
    Normal,
    Uniform,
    latin_hypercube,
    morris,
    morris_design,
)
from levelone.uncertainty.morris_designs import add_trajectories, grouped_morris_design, radial_design

GROUPS = {"pair": ["x1", "x3"], "rest": ["x4", "x5"]}
OF_FACTOR = np.array([0, 2, 0, 1, 1])  # x2 stands alone, after the groups


def grouped(r, seed, levels=4):
    return grouped_morris_design(unit_space(5), r, levels, seed, GROUPS)


@settings(max_examples=25, deadline=None)
@given(r=st.integers(1, 10), half=st.integers(1, 4), seed=st.integers(0, 2**32))
def test_each_grouped_step_moves_one_group_by_delta_and_each_group_moves_once(r, half, seed):
    levels = 2 * half
    design = grouped(r, seed, levels)
    assert (design.runs, design.block, design.base, design.columns) == (4 * r, 4, r, ("pair", "rest", "x2"))
    grid = design.unit_points * (levels - 1)
    np.testing.assert_allclose(grid, np.round(grid), atol=1e-12)
    assert ((design.unit_points >= 0.0) & (design.unit_points <= 1.0)).all()
    steps = np.diff(design.unit_points.reshape(r, 4, 5), axis=1)
    moved = np.abs(steps) > 1e-12
    np.testing.assert_allclose(np.abs(steps)[moved], levels / (2.0 * (levels - 1)))
    assert (moved.sum(axis=1) == 1).all()
    members = np.arange(3)[:, None] == OF_FACTOR
    for trajectory in moved:
        order = [int(np.flatnonzero((members == row).all(axis=1))[0]) for row in trajectory]
        assert sorted(order) == [0, 1, 2]


def test_groups_of_one_factor_each_are_plain_trajectories_with_signs():
    alone = grouped_morris_design(unit_space(3), 50, 4, 1, {"a": ["x1"], "b": ["x2"], "c": ["x3"]})
    result = morris(alone, alone.points @ [2.0, -5.0, 0.0])
    np.testing.assert_allclose(result.mu, [2.0, -5.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(result.sigma, 0.0, atol=1e-12)
    assert result.names == ("a", "b", "c")


@pytest.mark.theory
def test_a_group_of_a_linear_response_has_the_mean_magnitude_over_its_directions():
    # steps of c1 and c2 up or down: the change is |c1 + c2| or |c1 - c2|, equally likely
    design = grouped(4000, 2)
    result = morris(design, design.points @ [3.0, 1.0, 1.0, 0.0, 0.0], bootstrap=50)
    assert result.mu_star[0] == pytest.approx(3.0, abs=0.05)
    np.testing.assert_allclose(result.mu_star[1:], [0.0, 1.0], atol=1e-12)
    assert result.mu_star_ci[0, 0] < 3.0 < result.mu_star_ci[0, 1]


def test_only_mu_star_is_defined_for_a_group_of_several_factors():
    design = grouped(20, 3)
    result = morris(design, ishigami(design.points))
    for index in ("mu", "sigma", "distance"):
        assert np.isnan(getattr(result, index)[:2]).all()
        assert np.isnan(getattr(result, f"{index}_ci")[:2]).all()
        assert np.isfinite(getattr(result, index)[2])
    assert np.isfinite(result.mu_star_ci).all()
    assert (result.effects[:, :2] >= 0.0).all()


@pytest.mark.oracle
def test_groups_agree_with_salib_on_the_same_points():
    from SALib.analyze import morris as salib

    design = grouped(30, 4)
    values = ishigami(design.points)
    ours = morris(design, values)
    problem = {
        "num_vars": 5,
        "names": [f"x{j + 1}" for j in range(5)],
        "bounds": [[0.0, 1.0]] * 5,
        "groups": [design.columns[g] for g in OF_FACTOR],
    }
    theirs = salib.analyze(problem, design.points, values, num_levels=4, seed=1)
    order = [list(theirs["names"]).index(name) for name in ours.names]
    np.testing.assert_allclose(ours.mu_star, np.asarray(theirs["mu_star"], dtype=float)[order], rtol=1e-10)


@pytest.mark.oracle
def test_radial_effects_agree_with_salib_on_the_same_points():
    from SALib.analyze import radial_ee as salib

    design = radial_design(unit_space(3), 20, 5)
    values = ishigami(design.points)
    ours = morris(design, values)
    problem = {"num_vars": 3, "names": ["x1", "x2", "x3"], "bounds": [[0.0, 1.0]] * 3}
    theirs = salib.analyze(problem, design.points, values, sample_sets=20, num_resamples=10, seed=1)
    np.testing.assert_allclose(ours.mu_star, np.asarray(theirs["mu_star"], dtype=float), rtol=1e-10)
    np.testing.assert_allclose(ours.mu, np.asarray(theirs["mu"], dtype=float), rtol=1e-10, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(r=st.integers(1, 40), k=st.integers(1, 6), seed=st.integers(0, 2**32))
def test_radial_steps_start_at_the_base_point_and_span_a_quarter_to_three_quarters(r, k, seed):
    design = radial_design(unit_space(k), r, seed)
    blocks = design.unit_points.reshape(r, k + 1, k)
    step = blocks[:, 1:] - blocks[:, :1]
    j = np.arange(k)
    assert ((np.abs(step[:, j, j]) >= 0.25) & (np.abs(step[:, j, j]) <= 0.75)).all()
    step[:, j, j] = 0.0
    np.testing.assert_array_equal(step, 0.0)
    assert ((blocks >= 0.0) & (blocks < 1.0)).all()


def test_both_ends_of_radial_steps_are_evenly_spread():
    blocks = radial_design(unit_space(3), 1024, 0).unit_points.reshape(1024, 4, 3)
    for j in range(3):
        for row in (0, 1 + j):
            np.testing.assert_allclose(np.histogram(blocks[:, row, j], bins=8, range=(0.0, 1.0))[0] / 1024, 0.125, atol=0.012)


@pytest.mark.theory
@pytest.mark.parametrize(("name", "function", "active"), [("ishigami", ishigami, 3), ("sobol_g", sobol_g, 4)])
def test_radial_effects_rank_the_inputs_as_the_total_indices_do(name, function, active):
    design = radial_design(unit_space(14), 200, 1)
    result = morris(design, function(design.points), bootstrap=20)
    np.testing.assert_array_equal(np.argsort(-result.mu_star)[:active], np.argsort(-exact(name, 14)[1])[:active])


def test_radial_designs_take_unbounded_factors():
    space = FactorSpace([Factor("a", Normal(0.0, 1.0)), Factor("b", Uniform(0.0, 2.0))])
    assert np.isfinite(radial_design(space, 64, 0).points).all()


@pytest.mark.parametrize(
    "build",
    [
        lambda: morris_design(unit_space(5), 6, 4, 7),
        lambda: grouped(6, 7),
        lambda: radial_design(unit_space(5), 6, 7),
    ],
)
def test_adding_trajectories_keeps_the_runs_and_does_not_depend_on_the_steps(build):
    design = build()
    larger = add_trajectories(design, 5)
    np.testing.assert_array_equal(larger.points[: design.runs], design.points)
    assert (larger.base, larger.block, larger.columns, larger.levels) == (11, design.block, design.columns, design.levels)
    twice = add_trajectories(add_trajectories(design, 2), 3)
    np.testing.assert_array_equal(twice.points, larger.points)
    blocks = larger.unit_points.reshape(11, design.block, 5)
    assert len(np.unique(blocks.reshape(11, -1), axis=0)) == 11
    result = morris(larger, ishigami(larger.points))
    assert result.effects.shape == (11, design.block - 1)


def test_failures_are_dropped_by_block_and_bounded():
    design = radial_design(unit_space(3), 40, 2)
    values = ishigami(design.points)
    failed = np.where(np.random.default_rng(0).random(design.runs) < 0.05, np.nan, values)
    result = morris(design, failed, policy="drop")
    complete = np.isfinite(failed.reshape(-1, 4)).all(axis=1)
    np.testing.assert_array_equal(result.effects, morris(design, values).effects[complete])
    assert result.failed == np.isnan(failed).sum()
    corner = np.where(design.points[:, 0] > 0.8, np.nan, design.points[:, 1])
    bounded = morris(design, corner, policy="bound")
    assert bounded.mu_star[0] == 0.0
    assert max(one.mu_star[0] for one in bounded.bounding) > 0.2
    nothing = morris(grouped(3, 0), np.full(12, np.nan), policy="drop")
    assert nothing.status is EstimateStatus.TOO_FEW_RUNS
    assert nothing.mu_star.shape == (3,)
    assert np.isnan(nothing.mu_star).all()


CORRELATED = FactorSpace(unit_space(2).factors, correlation=[[1.0, 0.5], [0.5, 1.0]])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: radial_design(CORRELATED, 4, 0), "x1 and x2 are correlated"),
        (lambda: morris_design(CORRELATED, 4, 4, 0), "x1 and x2 are correlated"),
        (lambda: grouped_morris_design(CORRELATED, 4, 4, 0, {"g": ["x1", "x2"]}), "x1 and x2 are correlated"),
        (lambda: radial_design(FactorSpace([Factor("n", Discrete((1.0, 2.0)))]), 4, 0), "factor n: a discrete factor"),
        (lambda: radial_design(unit_space(2), 0, 0), "at least 1"),
        (lambda: grouped_morris_design(unit_space(2), 4, 4, 0, {"g": ["x9"]}), "x9"),
        (lambda: grouped_morris_design(unit_space(2), 4, 3, 0, {"g": ["x1"]}), "3 is odd"),
        (lambda: add_trajectories(latin_hypercube(unit_space(2), 4, 0), 1), "a morris design is needed"),
        (lambda: add_trajectories(radial_design(unit_space(2), 4, 0), 0), "more: 0"),
    ],
)
def test_wrong_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()
