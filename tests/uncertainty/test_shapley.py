from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import REFERENCE, exact, ishigami, sobol_g, unit_space

from levelone.errors import InputError
from levelone.uncertainty import EstimateStatus, Factor, FactorSpace, Kriging, Normal, Uniform, latin_hypercube
from levelone.uncertainty.shapley import shapley, shapley_design


def from_all_subsets(k, explained):
    """Shapley values of a game: ``explained`` maps a tuple of factors to the variance that they explain."""
    value = {u: explained(u) for size in range(k + 1) for u in combinations(range(k), size)}
    effect = np.zeros(k)
    for j in range(k):
        for u in value:
            if j not in u:
                effect[j] += (value[tuple(sorted((*u, j)))] - value[u]) / (k * comb(k - 1, len(u)))
    return effect / value[tuple(range(k))]


def linear_gaussian(beta, covariance):
    """Exact effects of a linear function of correlated normal variables, by all subsets."""
    everything = set(range(len(beta)))

    def explained(u):
        total = beta @ covariance @ beta
        rest = sorted(everything - set(u))
        if not u:
            return 0.0
        if not rest:
            return total
        given_u = covariance[np.ix_(rest, u)] @ np.linalg.solve(covariance[np.ix_(u, u)], covariance[np.ix_(u, rest)])
        left = covariance[np.ix_(rest, rest)] - given_u
        return total - beta[rest] @ left @ beta[rest]

    return from_all_subsets(len(beta), explained)


def exact_effects(name, k):
    """Closed forms for independent inputs: every interaction is split evenly."""
    if name == "ishigami":
        first, total = exact(name, k)
        return 0.5 * (first + total)  # its only interaction is that of two inputs
    part = 1.0 / 3.0 / (1.0 + np.array(REFERENCE["sobol_g"]["a"][:k])) ** 2
    effect = np.zeros(k)
    for j in range(k):
        orders = np.array([1.0])
        for i in range(k):
            if i != j:
                orders = np.convolve(orders, [1.0, part[i]])
        effect[j] = part[j] * np.sum(orders / np.arange(1, k + 1))
    return effect / (np.prod(1.0 + part) - 1.0)


def rank_matrix(scores):
    ranks = 6.0 / np.pi * np.arcsin(0.5 * scores)
    np.fill_diagonal(ranks, 1.0)
    return ranks


SCORES = np.array([[1.0, 0.8, 0.0, -0.3], [0.8, 1.0, 0.2, 0.0], [0.0, 0.2, 1.0, 0.5], [-0.3, 0.0, 0.5, 1.0]])
STD = np.array([1.0, 2.0, 0.5, 3.0])
CORRELATED = FactorSpace([Factor(f"x{j}", Normal(float(j), float(s))) for j, s in enumerate(STD)], correlation=rank_matrix(SCORES))


@pytest.mark.theory
@pytest.mark.parametrize(("name", "function"), [("ishigami", ishigami), ("sobol_g", sobol_g)])
def test_closed_forms_of_independent_factors(name, function):
    design = shapley_design(unit_space(14), 1024, 4, scramblings=16)
    result = shapley(design, 1e3 + function(design.points))
    np.testing.assert_allclose(result.Sh, exact_effects(name, 14), atol=0.012)
    assert result.variance == pytest.approx(REFERENCE[name]["variance"], rel=0.03)
    assert result.Sh.sum() == pytest.approx(1.0, abs=1e-12)
    inside = (result.Sh_ci[:, 0] <= exact_effects(name, 14)) & (exact_effects(name, 14) <= result.Sh_ci[:, 1])
    assert inside.sum() >= 12


@pytest.mark.theory
def test_a_linear_function_of_correlated_normal_variables():
    beta = np.array([1.0, 0.4, 2.0, 0.0])
    truth = linear_gaussian(beta, SCORES * np.outer(STD, STD))
    assert truth[3] > 0.02  # not in the function, and yet it has a share
    design = shapley_design(CORRELATED, 512, 1, scramblings=16)
    result = shapley(design, design.points @ beta)
    np.testing.assert_allclose(result.Sh, truth, atol=0.012)
    assert ((result.Sh_ci[:, 0] <= truth) & (truth <= result.Sh_ci[:, 1])).all()


@pytest.mark.theory
def test_an_interaction_of_correlated_normal_variables():
    # y = x1 x2 + c x1 with correlation r: Var y = 1 + r^2 + c^2, E[y|x1] = r x1^2 + c x1, E[y|x2] = r x2^2 + c r x2.
    r, c = 0.6, 1.5
    rank = 6.0 / np.pi * np.arcsin(0.5 * r)
    space = FactorSpace([Factor("a", Normal(0.0, 1.0)), Factor("b", Normal(0.0, 1.0))], correlation=[[1.0, rank], [rank, 1.0]])
    design = shapley_design(space, 2048, 3)
    x = design.points
    result = shapley(design, x[:, 0] * x[:, 1] + c * x[:, 0])
    first = 0.5 * (1.0 + c**2 * (1.0 - r**2) / (1.0 + r**2 + c**2))
    np.testing.assert_allclose(result.Sh, [first, 1.0 - first], atol=0.012)
    assert result.variance == pytest.approx(1.0 + r**2 + c**2, rel=0.05)


@pytest.mark.theory
def test_two_factors_that_are_nearly_one_share_evenly():
    space = FactorSpace([Factor("a", Normal(0.0, 1.0)), Factor("b", Normal(0.0, 1.0))], correlation=[[1.0, 0.999], [0.999, 1.0]])
    design = shapley_design(space, 512, 0)
    result = shapley(design, design.points[:, 0])
    np.testing.assert_allclose(result.Sh, 0.5, atol=0.02)


def test_the_intervals_hold_the_truth_as_often_as_they_say():
    # 40 repetitions of 4 shares: with a true coverage of 95 % fewer than 140 of 160 have a probability below 1e-4, were they
    # independent; they are not quite, since the shares of one repetition add up to one.
    beta = np.array([1.0, 0.4, 2.0, 0.0])
    truth = linear_gaussian(beta, SCORES * np.outer(STD, STD))
    inside = 0
    for seed in range(40):
        design = shapley_design(CORRELATED, 32, seed)
        ci = shapley(design, design.points @ beta).Sh_ci
        inside += int(((ci[:, 0] <= truth) & (truth <= ci[:, 1])).sum())
    assert inside >= 140


@pytest.mark.oracle
def test_independent_factors_agree_with_salib_on_the_same_points():
    # SALib uses one end of the path only; a model without interactions is where both forms have the same mean, so the points
    # are compared through its estimate of the variance and, at many points, through the shares.
    from SALib.analyze import shapley as salib

    design = shapley_design(unit_space(3), 4096, 3)
    values = ishigami(design.points)
    names = ["x1", "x2", "x3"]
    theirs = salib.analyze({"num_vars": 3, "names": names, "bounds": [[0.0, 1.0]] * 3}, design.points, values)
    ours = shapley(design, values)
    assert ours.variance == pytest.approx(np.sum(theirs["shapley"]), rel=1e-10)
    difference = np.abs(ours.Sh - np.asarray(theirs["shapley_normalized"], dtype=float))
    assert (difference < 1.5 * np.asarray(theirs["shapley_normalized_conf"], dtype=float)).all()


@pytest.mark.oracle
def test_one_end_of_the_path_agrees_with_salib_on_the_same_points():
    # A correlation that is as good as none makes the estimate use one end of the path, as SALib does.
    from SALib.analyze import shapley as salib

    names = ("x1", "x2", "x3")
    nearly = np.eye(3)
    nearly[0, 1] = nearly[1, 0] = 1e-14
    space = FactorSpace([Factor(name, Uniform(0.0, 1.0)) for name in names], correlation=nearly)
    paths = shapley_design(unit_space(3), 256, 3)
    values = ishigami(paths.points)
    theirs = salib.analyze({"num_vars": 3, "names": list(names), "bounds": [[0.0, 1.0]] * 3}, paths.points, values)
    ours = shapley(shapley_design(space, 256, 3), values)
    np.testing.assert_allclose(ours.Sh, np.asarray(theirs["shapley_normalized"], dtype=float), rtol=1e-9, atol=1e-12)


def test_correlated_designs_without_correlation_are_the_independent_ones():
    nearly = np.eye(3)
    nearly[0, 1] = nearly[1, 0] = 1e-14
    space = FactorSpace(unit_space(3).factors, correlation=nearly)
    np.testing.assert_allclose(shapley_design(space, 64, 3).points, shapley_design(unit_space(3), 64, 3).points, atol=1e-8)


def test_every_row_of_a_correlated_design_has_the_joint_distribution():
    design = shapley_design(CORRELATED, 1024, 2)
    for row in range(design.block):
        found = np.corrcoef(design.points[row :: design.block].T)
        np.testing.assert_allclose(found, SCORES, atol=0.03)


def sum_and_product(x):
    return x[:, 0] + 2.0 * x[:, 1] * x[:, 2]


def test_a_surrogate_stands_for_the_model_at_the_unit_points():
    # The surrogate knows the unit cube only; the design carries the dependence in its unit points.
    space = FactorSpace(unit_space(3).factors, correlation=rank_matrix(SCORES[:3, :3]))
    training = latin_hypercube(space, 120, 3)
    surrogate = Kriging.fit(training.unit_points, sum_and_product(training.points), 0)
    assert surrogate.q2 > 0.98
    design = shapley_design(space, 128, 2)
    through = shapley(design, surrogate.predict_mean(design.unit_points))
    direct = shapley(design, sum_and_product(design.points))
    np.testing.assert_allclose(through.Sh, direct.Sh, atol=0.02)


def test_more_scramblings_begin_with_the_runs_of_fewer():
    small, large = (shapley_design(CORRELATED, 16, 5, scramblings=r) for r in (4, 6))
    np.testing.assert_array_equal(large.points[: small.runs], small.points)
    assert (small.runs, small.block, large.base) == (4 * 16 * 5, 5, 96)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 1000), scale=st.floats(0.1, 10.0), shift=st.floats(-100.0, 100.0))
def test_an_affine_change_of_the_response_changes_no_share(seed, scale, shift):
    design = shapley_design(unit_space(4), 16, seed, scramblings=4)
    values = ishigami(design.points)
    plain, changed = shapley(design, values), shapley(design, shift - scale * values)
    np.testing.assert_allclose(changed.Sh, plain.Sh, atol=1e-9)
    np.testing.assert_allclose(changed.Sh_ci, plain.Sh_ci, atol=1e-8)


def test_the_order_of_the_factors_changes_no_share():
    swap = [2, 0, 3, 1]
    space = FactorSpace([CORRELATED.factors[j] for j in swap], correlation=rank_matrix(SCORES)[np.ix_(swap, swap)])
    beta = np.array([1.0, 0.4, 2.0, 0.0])
    truth = linear_gaussian(beta, SCORES * np.outer(STD, STD))
    design = shapley_design(space, 512, 8)
    np.testing.assert_allclose(shapley(design, design.points @ beta[swap]).Sh, truth[swap], atol=0.02)


def failing(design, values, share, seed=0):
    return np.where(np.random.default_rng(seed).random(design.runs) < share, np.nan, values)


@pytest.mark.parametrize("share", [0.001, 0.01, 0.05])
def test_random_failures_are_dropped_counted_and_leave_the_truth_inside(share):
    design = shapley_design(unit_space(3), 256, 6)
    values = failing(design, ishigami(design.points), share)
    result, truth = shapley(design, values, policy="drop"), exact_effects("ishigami", 3)
    assert result.failed == np.isnan(values).sum()
    assert result.used == np.logical_not(np.isnan(values.reshape(-1, 4)).any(axis=1)).sum()
    assert result.status is EstimateStatus.OK
    wider = np.diff(result.Sh_ci)[:, 0]  # the interval about the estimate, twice as wide
    assert (np.abs(result.Sh - truth) <= wider).all()
    assert result.Sh.sum() == pytest.approx(1.0, abs=1e-12)


def test_bounding_shows_what_a_failing_corner_hides():
    design = shapley_design(unit_space(3), 64, 6)
    values = design.points[:, 1] + 0.01 * design.points[:, 0]
    corner = np.where(design.points[:, 0] > 0.8, np.nan, values)
    result = shapley(design, corner, policy="bound")
    assert result.Sh[0] < 0.01
    low, high = result.bounding
    assert min(low.Sh[0], high.Sh[0]) > 0.1


def test_undefined_effects_are_nan_with_a_status():
    design = shapley_design(unit_space(3), 8, 0)
    constant = shapley(design, np.full(design.runs, 3.0))
    assert constant.status is EstimateStatus.CONSTANT_RESPONSE
    assert np.isnan(constant.Sh).all()
    nothing = shapley(design, np.full(design.runs, np.nan), policy="drop")
    assert nothing.status is EstimateStatus.TOO_FEW_RUNS
    assert np.isnan(nothing.Sh_ci).all()
    few = shapley_design(unit_space(3), 8, 0, scramblings=3)
    result = shapley(few, ishigami(few.points))
    assert result.status is EstimateStatus.TOO_FEW_SCRAMBLINGS
    assert np.isfinite(result.Sh).all()
    assert np.isnan(result.Sh_ci).all()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: shapley_design(unit_space(2), 12, 0), "power of two"),
        (lambda: shapley_design(unit_space(2), 8, 0, scramblings=0), "at least 1"),
        (lambda: shapley_design(unit_space(2), 8, -1), "seed"),
        (lambda: shapley(latin_hypercube(unit_space(2), 24, 0), np.zeros(24)), "a shapley design is needed"),
        (lambda: shapley(shapley_design(unit_space(2), 8, 0), np.full(192, np.nan)), "192 of 192 runs failed"),
    ],
)
def test_wrong_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()
