from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu
from uncertainty_functions import unit_space

from levelone.uncertainty import EstimateStatus, morris, morris_design
from levelone.uncertainty.dgsm import derivative_design, derivative_measures
from levelone.uncertainty.failure_doubt import GATHERED_BELOW, doubt, gathered_p, leaves
from levelone.uncertainty.given_data import given_data
from levelone.uncertainty.hsic import dependence
from levelone.uncertainty.shapley import shapley, shapley_design

NAMES = ("x1", "x2", "x3")


def on_sample(estimate):
    def run(failing, policy):
        x = np.random.default_rng(4).random((1000, 3))
        return estimate(x, np.where(failing(x), np.nan, x[:, 1] + 0.01 * x[:, 0]), policy)

    return run


def on_design(design, estimate):
    def run(failing, policy):
        x = design.points
        return estimate(design, np.where(failing(x), np.nan, x[:, 1] + 0.01 * x[:, 0]), policy=policy)

    return run


ESTIMATES = {
    "given_data": on_sample(lambda x, y, policy: given_data(x, y, NAMES, policy=policy)),
    "hsic": on_sample(lambda x, y, policy: dependence(x, y, NAMES, 0, permutations=99, policy=policy)),
    "shapley": on_design(shapley_design(unit_space(3), 128, 1), shapley),
    "dgsm": on_design(derivative_design(unit_space(3), 512, 1), derivative_measures),
    "morris": on_design(morris_design(unit_space(3), 200, 4, 1), morris),
}


@pytest.mark.parametrize("name", ESTIMATES)
def test_a_failing_corner_raises_doubt_under_both_policies(name):
    def corner(x):
        return (x[:, 0] > 0.7) & (x[:, 2] > 0.6)

    dropped, bounded = (ESTIMATES[name](corner, policy) for policy in ("drop", "bound"))
    assert dropped.failure_p < GATHERED_BELOW
    assert "gather in a part" in dropped.doubt
    assert "move the estimate" in bounded.doubt


@pytest.mark.parametrize("name", ESTIMATES)
@pytest.mark.parametrize("share", [0.0, 0.01, 0.05])
def test_failures_anywhere_raise_none_under_drop(name, share):
    rng = np.random.default_rng(7)
    result = ESTIMATES[name](lambda x: rng.random(len(x)) < share, "drop")
    assert result.doubt == ""
    assert (result.failed == 0) == (share == 0.0)


def test_scattered_failures_rarely_look_gathered():
    # false alarms in 300 samples at a level of 1 %: more than 12 have a probability below 1e-4
    rng, alarms = np.random.default_rng(1), 0
    for _ in range(300):
        alarms += gathered_p(rng.random((200, 5)), rng.random(200) < 0.05) < GATHERED_BELOW
    assert alarms <= 12


def test_failures_at_both_ends_of_a_range_are_seen():
    x = np.random.default_rng(2).random((500, 3))
    ends = np.abs(x[:, 1] - 0.5) > 0.45
    assert mannwhitneyu(x[ends, 1], x[~ends, 1]).pvalue > 0.01  # the place alone does not show it
    assert gathered_p(x, ends) < 1e-6


@settings(max_examples=20)
@given(seed=st.integers(0, 1000))
def test_units_and_order_of_the_factors_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    x, failed = rng.random((60, 3)), rng.random(60) < 0.2
    assert gathered_p(x, failed) == pytest.approx(gathered_p(np.exp(3.0 * x)[:, [2, 0, 1]], failed), rel=1e-12, nan_ok=True)


def test_there_is_nothing_to_test_where_none_or_all_failed_or_nothing_varies():
    x = np.random.default_rng(0).random((10, 2))
    assert np.isnan(gathered_p(x, np.zeros(10, dtype=bool)))
    assert np.isnan(gathered_p(x, np.ones(10, dtype=bool)))
    assert np.isnan(gathered_p(np.ones((10, 2)), np.arange(10) < 3))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((EstimateStatus.TOO_FEW_RUNS, 3, 1.0, None), "too few runs"),
        ((EstimateStatus.OK, 3, 0.5, True), "move the estimate"),
        ((EstimateStatus.OK, 3, 0.001, None), "gather"),
    ],
)
def test_reasons_in_words(arguments, words):
    assert words in doubt(*arguments)


@pytest.mark.parametrize(
    "arguments", [(EstimateStatus.OK, 3, 0.001, False), (EstimateStatus.OK, 3, 0.5, None), (EstimateStatus.OK, 0, np.nan, None)]
)
def test_no_reason_is_no_words(arguments):
    assert doubt(*arguments) == ""


def test_an_undefined_figure_counts_as_outside():
    ci = np.array([[0.0, 1.0], [0.0, 0.0]])
    assert not leaves(ci, [np.array([0.5, 0.0009])])
    assert leaves(ci, [np.array([0.5, 0.0011])])
    assert not leaves(ci, [np.array([0.5, 0.0011])], whole=2.0)
    assert leaves(ci, [np.array([np.nan, 0.0])])
