from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest, qmc, spearmanr
from uncertainty_functions import unit_space

from levelone.errors import InputError
from levelone.uncertainty import Discrete, Factor, FactorSpace, LogNormal, Normal, Triangular, Uniform, latin_hypercube
from levelone.uncertainty.copula import independent_scores, normal_scores, resampled_prefixes

FACTORS = (
    Factor("mass", Uniform(6.5, 7.5)),
    Factor("delay", LogNormal(0.0, 0.5)),
    Factor("gain", Normal(2.0, 0.1)),
    Factor("drag", Triangular(0.0, 1.0, 4.0)),
)


def sobol_points(k, power, seed):
    return qmc.Sobol(k, rng=np.random.default_rng(seed)).random_base2(power)


def admissible(k, seed):
    """Rank correlations of some set of k normal variables."""
    factor = np.random.default_rng(seed).normal(size=(k, k + 1))
    covariance = factor @ factor.T
    std = np.sqrt(np.diag(covariance))
    ranks = 6.0 / np.pi * np.arcsin(0.5 * covariance / np.outer(std, std))
    ranks = 0.5 * (ranks + ranks.T)
    np.fill_diagonal(ranks, 1.0)
    return ranks


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), k=st.integers(2, 4))
def test_rank_correlations_are_reproduced_and_margins_stay(seed, k):
    rank = admissible(k, seed)
    space = FactorSpace(FACTORS[:k], correlation=rank)
    points = space.transform(sobol_points(k, 12, seed))
    found = np.atleast_2d(spearmanr(points).statistic) if k > 2 else np.array([[1.0, spearmanr(points).statistic]])
    np.testing.assert_allclose(found[0, 1:], rank[0, 1:], atol=0.015)
    alone = FactorSpace(FACTORS[:k]).transform(sobol_points(k, 12, seed + 1))
    for j in range(k):
        np.testing.assert_allclose(np.quantile(points[:, j], [0.1, 0.5, 0.9]), np.quantile(alone[:, j], [0.1, 0.5, 0.9]), rtol=0.03)


@pytest.mark.theory
def test_coordinates_of_the_copula_are_uniform_and_their_scores_have_the_product_moment_correlation():
    space = FactorSpace(unit_space(3).factors, correlation=[[1.0, 0.6, 0.0], [0.6, 1.0, -0.4], [0.0, -0.4, 1.0]])
    v = space.transform(sobol_points(3, 13, 1))
    for j in range(3):
        assert kstest(v[:, j], "uniform").statistic < 0.01
    expected = 2.0 * np.sin(np.pi * np.array([0.6, 0.0, -0.4]) / 6.0)
    found = np.corrcoef(normal_scores(v).T)
    np.testing.assert_allclose([found[0, 1], found[0, 2], found[1, 2]], expected, atol=0.01)


def test_the_first_factor_and_those_correlated_with_none_keep_their_coordinates_bit_for_bit():
    correlation = np.eye(4)
    correlation[1, 3] = correlation[3, 1] = 0.7
    u = sobol_points(4, 8, 3)
    plain, changed = FactorSpace(FACTORS).transform(u), FactorSpace(FACTORS, correlation=correlation).transform(u)
    np.testing.assert_array_equal(changed[:, :3], plain[:, :3])
    assert np.abs(changed[:, 3] - plain[:, 3]).max() > 0.1


def test_points_do_not_depend_on_the_batch_they_come_in():
    space = FactorSpace(FACTORS, correlation=admissible(4, 3))
    u = sobol_points(4, 9, 3)
    whole = space.transform(u)
    for size in (1, 3, 64, 511):
        np.testing.assert_array_equal(space.transform(u[:size]), whole[:size])


def test_the_ends_of_the_cube_stay_finite():
    space = FactorSpace(FACTORS, correlation=admissible(4, 7))
    corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 4)).reshape(4, -1).T
    points = space.transform(corners)
    assert np.isfinite(points).all()
    assert ((points[:, 0] >= 6.5) & (points[:, 0] <= 7.5)).all()


def test_a_unit_matrix_is_the_same_space_as_none():
    plain, unit = FactorSpace(FACTORS), FactorSpace(FACTORS, correlation=np.eye(4))
    assert plain == unit
    assert hash(plain) == hash(unit)
    assert not unit.correlated
    np.testing.assert_array_equal(unit.score_correlation(), np.eye(4))


def test_spaces_differ_by_their_correlation_and_stay_frozen():
    rank = admissible(4, 1)
    one, same = FactorSpace(FACTORS, correlation=rank), FactorSpace(FACTORS, correlation=rank.tolist())
    assert one.correlated
    assert one == same
    assert hash(one) == hash(same)
    assert one != FactorSpace(FACTORS)
    assert one != FactorSpace(FACTORS, correlation=admissible(4, 2))
    before = one.correlation
    rank[0, 1] = 0.0
    assert one.correlation == before
    with pytest.raises(AttributeError):
        one.correlation = None
    assert f"{rank[2, 3]}" in repr(one)


def test_ties_of_a_discrete_factor_weaken_the_rank_correlation_that_is_seen():
    space = FactorSpace([Factor("a", Uniform(0.0, 1.0)), Factor("n", Discrete((0.0, 1.0)))], correlation=[[1.0, 0.8], [0.8, 1.0]])
    points = space.transform(sobol_points(2, 12, 0))
    assert 0.5 < spearmanr(points).statistic < 0.75
    np.testing.assert_allclose(points[:, 1].mean(), 0.5, atol=0.01)


def test_a_latin_hypercube_of_correlated_factors_is_allowed():
    space = FactorSpace(FACTORS, correlation=admissible(4, 5))
    design = latin_hypercube(space, 2000, 0)
    np.testing.assert_allclose(spearmanr(design.points).statistic, admissible(4, 5), atol=0.06)


SCORES = np.array([[1.0, 0.8, 0.0, -0.3], [0.8, 1.0, 0.2, 0.0], [0.0, 0.2, 1.0, 0.5], [-0.3, 0.0, 0.5, 1.0]])


@pytest.mark.theory
def test_draws_given_the_kept_factors_have_the_conditional_mean_and_spread():
    rng = np.random.default_rng(2)
    n, order = 200_000, np.array([2, 0, 3, 1])
    fixed = rng.normal(size=(1, 4))
    first, second = np.repeat(fixed, n, axis=0), rng.normal(size=(n, 4))
    paths = resampled_prefixes(first, second, np.tile(order, (n, 1)), SCORES)
    for drawn in range(1, 4):
        anew, kept = order[:drawn], order[drawn:]
        held = paths[0, 0, kept]
        np.testing.assert_array_equal(paths[:, drawn, kept], np.tile(held, (n, 1)))
        solved = SCORES[np.ix_(anew, kept)] @ np.linalg.inv(SCORES[np.ix_(kept, kept)])
        np.testing.assert_allclose(paths[:, drawn, anew].mean(axis=0), solved @ held, atol=0.01)
        left = SCORES[np.ix_(anew, anew)] - solved @ SCORES[np.ix_(kept, anew)]
        np.testing.assert_allclose(np.atleast_2d(np.cov(paths[:, drawn, anew].T)), left, atol=0.01)
    np.testing.assert_allclose(np.corrcoef(paths[:, 4].T), SCORES, atol=0.01)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_independent_scores_undo_the_dependence(seed):
    w = np.random.default_rng(seed).normal(size=(10, 4))
    z = w @ np.linalg.cholesky(SCORES).T
    np.testing.assert_allclose(independent_scores(z, SCORES), w, atol=1e-12)


def matrix(**pairs):
    rank = np.eye(3)
    for pair, value in pairs.items():
        i, j = int(pair[1]), int(pair[2])
        rank[i, j] = rank[j, i] = value
    return rank


def lopsided():
    rank = matrix(r01=0.5)
    rank[1, 0] = 0.4
    return rank


@pytest.mark.parametrize(
    ("correlation", "words"),
    [
        (np.eye(2), r"shape \(2, 2\); \[3, 3\] is needed"),
        (matrix(r01=np.nan), "not a finite number"),
        (2.0 * np.eye(3), "mass with itself: 2; it is 1"),
        (lopsided(), "mass and delay: 0.5 above and 0.4 below"),
        (matrix(r12=1.0), "delay and gain: 1; a number between -1 and 1"),
        (matrix(r02=-1.2), "mass and gain: -1.2; a number between"),
        (matrix(r01=0.9, r02=0.5, r12=-0.2), r"mass and delay: 0.9 contradicts .* between -0\.\d+ and 0\.71"),
    ],
)
def test_impossible_correlations_are_refused_by_pair(correlation, words):
    with pytest.raises(InputError, match=words):
        FactorSpace(FACTORS[:3], correlation=correlation)


def test_the_range_in_the_error_is_the_one_that_is_accepted():
    with pytest.raises(InputError) as error:
        FactorSpace(FACTORS[:3], correlation=matrix(r01=0.9, r02=0.5, r12=-0.2))
    high = float(error.value.problem.split(" and ")[-1])
    assert FactorSpace(FACTORS[:3], correlation=matrix(r01=high - 0.001, r02=0.5, r12=-0.2)).correlated
    with pytest.raises(InputError, match="mass and delay"):
        FactorSpace(FACTORS[:3], correlation=matrix(r01=high + 0.001, r02=0.5, r12=-0.2))


def test_where_no_single_pair_will_do_one_is_named_to_begin_with():
    rank = np.full((6, 6), -0.9)
    np.fill_diagonal(rank, 1.0)
    with pytest.raises(InputError, match="more than one pair contradicts"):
        FactorSpace(unit_space(6).factors, correlation=rank)


def test_methods_that_move_one_factor_at_a_time_refuse_by_pair():
    space = FactorSpace(FACTORS[:3], correlation=matrix(r01=0.2, r12=-0.5))
    with pytest.raises(InputError, match=r"delay and gain are correlated, and a method .* use another"):
        space.require_independent("a method", "use another")
    FactorSpace(FACTORS).require_independent("a method", "use another")
