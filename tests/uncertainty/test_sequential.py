from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_limits
from uncertainty_functions import ishigami, unit_space

from levelone.errors import InputError
from levelone.uncertainty import (
    EstimateStatus,
    Factor,
    FactorSpace,
    Kriging,
    Uniform,
    latin_hypercube,
    sequential,
    sobol,
    sobol_design,
)
from levelone.uncertainty.posterior import Candidates
from levelone.uncertainty.sequential import index_gradients, next_points, sequential_design

LENGTHS = np.array([0.4, 0.8, 1.5])


def runs(n=30, k=3, seed=0):
    x = latin_hypercube(unit_space(k), n, seed).points
    return x, np.sin(4.0 * x[:, 0]) + x[:, 1] ** 2 + 0.3 * x[:, -1]


def conditioned(trend="constant", nugget=1e-3, kind="matern52", n=30):
    x, y = runs(n)
    return x, Kriging.condition(x, y, LENGTHS, nugget, correlation=kind, trend=trend)


@pytest.mark.theory
def test_gradients_of_the_indices_are_those_of_differences():
    """The centre is held, as in the docstring: a shift of the mean is of second order for values centred exactly."""
    design = sobol_design(unit_space(2), 8, 0)
    values = design.unit_points[:, 0] + design.unit_points[:, 0] * design.unit_points[:, 1]
    blocks = values.reshape(8, 4)
    means = blocks[:, [0, 3, 1, 2]].T

    def indices(means):
        a, b, *c = means - centre
        variance = 0.5 * (np.mean(a * a) + np.mean(b * b))
        first = [np.mean(b * (one - a)) / variance for one in c]
        return np.array(first + [0.5 * np.mean((a - one) ** 2) / variance for one in c])

    centre = means[:2].mean()
    gradients = list(index_gradients(means))
    assert len(gradients) == 4
    for row in range(4):
        for i in (0, 3, 7):
            step = np.zeros(means.shape)
            step[row, i] = 1e-6
            difference = (indices(means + step) - indices(means - step)) / 2e-6
            np.testing.assert_allclose(gradients[row][:, i], difference, rtol=1e-6, atol=1e-9)


@pytest.mark.theory
@pytest.mark.parametrize("trend", ["constant", "linear"])
@pytest.mark.parametrize("kind", ["matern52", "squared_exponential"])
def test_the_variance_left_is_that_of_the_model(trend, kind):
    x, model = conditioned(trend, kind=kind)
    points = np.random.default_rng(3).random((20, 3))
    candidates = Candidates(model, x, points)
    np.testing.assert_allclose(candidates.variance, model.predict(points).std ** 2 / model.variance, rtol=1e-6, atol=1e-9)
    full = candidates.covariance(candidates.weighted(points, np.eye(20)))
    np.testing.assert_allclose(full, full.T, atol=1e-10)
    np.testing.assert_allclose(full.diagonal(), candidates.variance, atol=1e-10)


@pytest.mark.theory
@pytest.mark.parametrize("trend", ["constant", "linear"])
def test_runs_added_one_by_one_leave_what_conditioning_on_all_of_them_leaves(trend):
    # The ends of each range are among the runs, so that the scaling does not move.
    x, _ = runs()
    x = np.vstack([np.zeros(3), np.ones(3), x])
    y = x.sum(axis=1) ** 2
    model = Kriging.condition(x, y, LENGTHS, 1e-3, trend=trend)
    points = np.random.default_rng(3).random((20, 3))
    candidates = Candidates(model, x, points)
    functional = np.full((1, 20), 0.05)
    covariance = candidates.covariance(candidates.weighted(points, functional))[0]
    for chosen in (4, 11):
        scale = np.sqrt(candidates.variance[chosen] + candidates.noise)
        covariance = covariance - covariance[chosen] / scale * candidates.add(chosen)
    again = Candidates(model, np.vstack([x, points[[4, 11]]]), points)
    np.testing.assert_allclose(candidates.variance, again.variance, atol=1e-9)
    np.testing.assert_allclose(covariance, again.covariance(again.weighted(points, functional))[0], atol=1e-9)


def test_a_batch_does_not_cluster_and_avoids_the_runs():
    x, model = conditioned(nugget=1e-6)
    new = next_points(model, x, 5, 12)
    assert new.shape == (12, 3)
    assert ((new >= 0.0) & (new <= 1.0)).all()
    chosen = new[6:]
    scaled = np.vstack([x, new]) / LENGTHS
    apart = np.sqrt(((scaled[:, None] - scaled[None]) ** 2).sum(axis=2))
    np.fill_diagonal(apart, np.inf)
    random = np.random.default_rng(0).random((2000, 3)) / LENGTHS
    typical = np.median(np.sqrt(((random[:, None] - (x / LENGTHS)[None]) ** 2).sum(axis=2)).min(axis=1))
    assert apart[-6:].min() > typical
    assert len(np.unique(chosen, axis=0)) == 6


def test_what_is_chosen_lowers_the_variance_more_than_chance():
    x, model = conditioned(nugget=1e-6)
    points = np.random.default_rng(9).random((256, 3))
    new = next_points(model, x, 1, 8)
    with_spread = np.vstack([x, new[:4]])

    def left(added):
        return Candidates(model, np.vstack([with_spread, added]), points).variance.mean()

    chance = [left(latin_hypercube(unit_space(3), 4, seed).points) for seed in range(10)]
    assert left(new[4:]) < min(chance)


def test_runs_go_to_the_input_that_matters():
    """Where the other inputs are inert, what is chosen fills the gaps of the one that is not, and of that one only."""
    x, _ = runs(10)
    model = Kriging.condition(x, np.sin(2.0 * x[:, 0]), [0.15, 50.0, 50.0], 1e-6)
    assert model.q2 > 0.8
    new = next_points(model, x, 2, 8)
    taken = list(np.append(x[:, 0], new[:4, 0]))
    for one in new[4:, 0]:
        nearest = np.abs(np.array(taken) - one).min()
        grid = np.linspace(0.0, 1.0, 501)
        typical = np.median(np.abs(grid[:, None] - np.array(taken)).min(axis=1))
        assert nearest > typical
        taken.append(one)


def test_threads_of_blas_and_repetition_change_no_digit():
    x, model = conditioned()
    with threadpool_limits(2):
        many = next_points(model, x, 7, 6)
    with threadpool_limits(1):
        one = next_points(model, x, 7, 6)
    np.testing.assert_array_equal(many, one)
    assert (next_points(model, x, 8, 6) != one).any()


def test_a_model_that_knows_nothing_asks_for_a_hypercube():
    x, _ = runs(20)
    flat = Kriging.fit(x, np.full(20, 3.0), 0)
    assert flat.status is EstimateStatus.CONSTANT_RESPONSE
    new = next_points(flat, x, 0, 10)
    np.testing.assert_array_equal(np.sort(np.floor(10.0 * new), axis=0), np.tile(np.arange(10.0)[:, None], 3))


def test_a_model_that_explains_little_asks_for_a_hypercube():
    x, y = runs(20)
    poor = Kriging.condition(x, y, [100.0, 0.01, 0.01], 1.0)
    assert poor.q2 < 0.5
    new = next_points(poor, x, 0, 10)
    np.testing.assert_array_equal(np.sort(np.floor(10.0 * new), axis=0), np.tile(np.arange(10.0)[:, None], 3))


def test_lengths_of_the_batch_before_stand_in_for_a_search_that_failed(monkeypatch):
    x, y = runs(30)
    before = Kriging.condition(x[:25], y[:25], LENGTHS, 1e-6)
    poor = Kriging.condition(x, y, [100.0, 0.01, 0.01], 1.0)
    monkeypatch.setattr(Kriging, "fit", lambda *_: poor)
    kept = sequential._surrogate(x, y, 0, before)
    np.testing.assert_array_equal(kept.lengths, LENGTHS)
    assert kept.q2 > poor.q2
    assert len(kept.loo_residual) == 30
    assert sequential._surrogate(x, y, 0) is poor


def test_the_loop_runs_what_it_was_told_to_and_is_repeatable():
    space = FactorSpace([Factor("a", Uniform(2.0, 4.0)), Factor("b", Uniform(-1.0, 1.0)), Factor("c", Uniform(0.0, 1.0))])
    asked = []

    def evaluate(points):
        asked.append(points)
        return points[:, 0] ** 2 + np.sin(3.0 * points[:, 1])

    found = sequential_design(evaluate, space, 16, 25, 6, 4)
    assert found.sizes == (16, 22, 25)
    assert [len(points) for points in asked] == [16, 6, 3]
    np.testing.assert_array_equal(np.vstack(asked), space.transform(found.unit_points))
    np.testing.assert_array_equal(found.unit_points[:16], latin_hypercube(space, 16, 4).unit_points)
    assert found.failed == 0
    assert found.q2.shape == (3,)
    assert found.q2[-1] == found.model.q2
    again = sequential_design(evaluate, space, 16, 25, 6, 4)
    np.testing.assert_array_equal(found.unit_points, again.unit_points)


def test_failed_runs_are_counted_and_not_asked_for_again():
    def evaluate(points):
        return np.where(points[:, 0] > 0.8, np.nan, points[:, 0] + points[:, 1] ** 2)

    found = sequential_design(evaluate, unit_space(2), 20, 40, 10, 0)
    assert found.failed == int((found.unit_points[:, 0] > 0.8).sum())
    assert 0 < found.failed < 15
    assert len(np.unique(found.unit_points, axis=0)) == 40
    assert len(found.model.loo_residual) == 40 - found.failed


def test_a_model_that_always_fails_ends_without_a_surrogate():
    found = sequential_design(lambda points: np.full(len(points), np.nan), unit_space(2), 10, 20, 5, 0)
    assert found.model.status is EstimateStatus.TOO_FEW_RUNS
    assert found.failed == 20
    assert np.isnan(found.q2).all()


@pytest.mark.theory
def test_an_interaction_is_decomposed_from_50_runs():
    """Of sin(2 pi u1) (1 + u2) the variance is 7/6: 27/28 of it by u1 alone, the rest by both."""
    found = sequential_design(lambda u: np.sin(2.0 * np.pi * u[:, 0]) * (1.0 + u[:, 1]), unit_space(3), 30, 50, 10, 1)
    design = sobol_design(unit_space(3), 2**11, 3)
    indices = sobol(design, found.model.predict_mean(design.unit_points), bootstrap=2)
    np.testing.assert_allclose(indices.S1, [27.0 / 28.0, 0.0, 0.0], atol=0.01)
    np.testing.assert_allclose(indices.ST, [1.0, 1.0 / 28.0, 0.0], atol=0.01)


@pytest.mark.parametrize(("start", "total", "batch"), [(1, 10, 5), (20, 10, 5), (10, 20, 0)])
def test_counts_that_do_not_fit_are_refused(start, total, batch):
    with pytest.raises(InputError, match="start at least 2"):
        sequential_design(ishigami, unit_space(3), start, total, batch, 0)


def test_correlated_factors_are_refused():
    space = FactorSpace([Factor("a", Uniform(0.0, 1.0)), Factor("b", Uniform(0.0, 1.0))], [[1.0, 0.5], [0.5, 1.0]])
    with pytest.raises(InputError, match="correlated"):
        sequential_design(lambda points: points[:, 0], space, 10, 20, 5, 0)


def test_bad_arguments_are_refused():
    x, model = conditioned()
    with pytest.raises(InputError, match="unit cube"):
        next_points(model, x[:, :2], 0, 3)
    with pytest.raises(InputError, match="1024"):
        next_points(model, x, 0, 2000)
    with pytest.raises(InputError, match="answered shape"):
        sequential_design(lambda points: points, unit_space(2), 10, 20, 5, 0)
