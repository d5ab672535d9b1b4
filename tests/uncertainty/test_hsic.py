from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import exact, ishigami, sobol_g

from levelone.errors import InputError
from levelone.uncertainty import EstimateStatus
from levelone.uncertainty.given_data import unit_ranks
from levelone.uncertainty.hsic import LENGTH, dependence


def names(k):
    return [f"x{j + 1}" for j in range(k)]


def sample(n, k, seed):
    return np.random.default_rng(seed).random((n, k))


def by_definition(x, y):
    """Normalised criterion from full kernel matrices of the ranks."""

    def centred(column):
        u = unit_ranks(column)
        kernel = np.exp(-0.5 * ((u[:, None] - u) / LENGTH) ** 2)
        return kernel - kernel.mean(axis=0) - kernel.mean(axis=1)[:, None] + kernel.mean()

    left, right = centred(x), centred(y)
    return (left * right).sum() / np.sqrt((left**2).sum() * (right**2).sum())


@pytest.mark.theory
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 1000), ties=st.booleans())
def test_features_give_the_criterion_by_its_definition(seed, ties):
    u = sample(80, 3, seed)
    x = np.round(5.0 * u) if ties else u
    values = ishigami(u)
    result = dependence(x, values, names(3), 0, permutations=19)
    np.testing.assert_allclose(result.R2, [by_definition(column, values) for column in x.T], atol=1e-9)


@pytest.mark.oracle
def test_it_agrees_with_openturns_on_the_same_points():
    ot = pytest.importorskip("openturns", reason="OpenTURNS is not installed")
    u = sample(150, 4, 1)
    values = ishigami(u)
    ranks = np.column_stack([unit_ranks(column) for column in u.T])
    kernels = [ot.SquaredExponential([LENGTH]) for _ in range(5)]
    peer = ot.HSICEstimatorGlobalSensitivity(kernels, ranks, unit_ranks(values)[:, None], ot.HSICVStat())
    ours = dependence(u, values, names(4), 0, permutations=400)
    np.testing.assert_allclose(ours.R2, np.array(peer.getR2HSICIndices()), atol=1e-10)
    ot.RandomGenerator.SetSeed(1)
    peer.setPermutationSize(400)
    # both p-values are shares of 400 random permutations: five standard errors of their difference
    np.testing.assert_allclose(ours.p_value, np.array(peer.getPValuesPermutation()), atol=5.0 * np.sqrt(0.5 / 400))


def test_the_inputs_of_test_functions_are_ranked_right_at_500_runs():
    total = exact("ishigami", 14)[1]
    for seed in range(5):
        u = sample(500, 14, [seed, 3])
        result = dependence(u, ishigami(u), names(14), 1, permutations=99)
        assert list(np.argsort(-result.R2)[:3]) == list(np.argsort(-total)[:3])
        assert (result.p_value[:3] == 0.01).all()
        # of G the share of the third input is 3 %, which 500 runs show in part of the samples only
        assert list(np.argsort(-dependence(u, sobol_g(u), names(14), 1, permutations=99).R2)[:2]) == [0, 1]


def test_p_values_of_independent_inputs_are_uniform():
    rng = np.random.default_rng(4)
    found = np.array(
        [dependence(rng.random((60, 5)), rng.normal(size=60), names(5), s, permutations=99).p_value for s in range(40)]
    )
    # 200 nearly independent values: mean 1/2 and share below 0.1, each within 4 standard errors
    assert found.mean() == pytest.approx(0.5, abs=4.0 * np.sqrt(1.0 / 12.0 / 200))
    assert (found <= 0.1).mean() == pytest.approx(0.1, abs=4.0 * np.sqrt(0.09 / 200))
    assert found.min() >= 0.01


def test_it_sees_a_dependence_that_leaves_mean_and_variance_alone():
    # the sign of a skewed noise: same mean, same variance, another distribution
    rng = np.random.default_rng(5)
    x = rng.random((1000, 2))
    noise = rng.exponential(size=1000) - 1.0
    result = dependence(x, np.where(x[:, 0] > 0.5, noise, -noise), names(2), 0)
    assert result.p_value[0] == pytest.approx(1.0 / 501.0)
    assert result.p_value[1] > 0.01


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 1000), scale=st.floats(0.1, 10.0), shift=st.floats(-100.0, 100.0))
def test_changes_of_scale_and_of_order_change_nothing(seed, scale, shift):
    u = sample(60, 3, seed)
    values = ishigami(u)
    plain = dependence(u, values, names(3), 2, permutations=19)
    changed = dependence(np.exp(u), shift - scale * values, names(3), 2, permutations=19)
    np.testing.assert_allclose(changed.R2, plain.R2, atol=1e-9)
    swapped = dependence(u[:, [2, 0, 1]], values, ["x3", "x1", "x2"], 2, permutations=19)
    np.testing.assert_allclose(swapped.R2, plain.R2[[2, 0, 1]], atol=1e-12)
    np.testing.assert_array_equal(swapped.p_value, plain.p_value[[2, 0, 1]])


def test_a_factor_that_is_the_response_has_one():
    u = sample(50, 2, 7)
    result = dependence(u, np.exp(u[:, 1]), names(2), 0, permutations=19)
    assert result.R2[1] == pytest.approx(1.0, abs=1e-12)
    assert result.p_value[1] == 0.05


def test_failures_are_dropped_counted_and_bounded():
    u = sample(500, 2, 3)
    values = np.where(u[:, 0] > 0.85, np.nan, u[:, 1])
    result = dependence(u, values, names(2), 0, policy="bound")
    assert (result.failed, result.used, result.runs) == (np.isnan(values).sum(), np.isfinite(values).sum(), 500)
    assert result.p_value[0] > 0.01
    assert max(one.p_value[0] for one in result.bounding) == pytest.approx(1.0 / 501.0)


def test_undefined_figures_are_nan_with_a_status():
    u = sample(40, 2, 0)
    constant = dependence(u, np.ones(40), names(2), 0)
    assert constant.status is EstimateStatus.CONSTANT_RESPONSE
    assert np.isnan(constant.R2).all()
    few = dependence(u, np.where(np.arange(40) < 20, np.nan, u[:, 0]), names(2), 0, policy="drop")
    assert few.status is EstimateStatus.TOO_FEW_RUNS
    assert np.isnan(few.p_value).all()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda u: dependence(u, u[:, 0], names(2), 0, permutations=18), "at least 19"),
        (lambda u: dependence(u, u[:, 0], names(2), -1), "seed"),
        (lambda u: dependence(u, u[:, 0], names(3), 0), "is needed"),
        (lambda u: dependence(u, np.full(40, np.nan), names(2), 0), "policy is 'refuse'"),
        (lambda u: dependence(u, u[:, 0], names(2), 0, policy="ignore"), "ignore"),
    ],
)
def test_wrong_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call(sample(40, 2, 0))
