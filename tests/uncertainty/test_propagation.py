from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from uncertainty_functions import REFERENCE, unit_space

from levelone.errors import InputError
from levelone.uncertainty import failure_corner, latin_hypercube, rank_agreement, shares, summarize
from levelone.uncertainty.propagation import QUANTILES

NAN = np.nan


@pytest.mark.theory
def test_statistics_of_a_uniform_sample():
    values = latin_hypercube(unit_space(1), 5000, 0).points[:, 0]
    result = summarize(values)
    assert result.mean == pytest.approx(0.5, abs=1e-4)
    assert result.std == pytest.approx(1.0 / np.sqrt(12.0), abs=1e-4)
    np.testing.assert_allclose(result.quantiles, QUANTILES, atol=5e-4)
    assert 0.0 <= result.min < 2e-4
    assert 1.0 - 2e-4 < result.max <= 1.0


def test_failed_runs_are_counted_and_left_out():
    result = summarize([1.0, NAN, 3.0, np.inf])
    assert (result.n, result.failed, result.mean, result.min, result.max) == (4, 2, 2.0, 1.0, 3.0)
    assert result.std == pytest.approx(np.sqrt(2.0))


def test_nothing_left_is_nan():
    result = summarize([NAN, NAN])
    assert (result.n, result.failed) == (2, 2)
    assert np.isnan([result.mean, result.std, result.min, result.max]).all()
    assert np.isnan(summarize([1.0]).std)


def test_shares_with_the_interval_of_the_textbooks():
    book = REFERENCE["clopper_pearson"]
    hits, trials = book["successes"], book["trials"]
    result = shares(["Level 1"] * hits + ["failed"] * (trials - hits), ["Level 1", "Level 2", "failed"])
    np.testing.assert_allclose(result.share, [0.8, 0.0, 0.2])
    assert result.counts.tolist() == [8, 0, 2]
    np.testing.assert_allclose(result.ci[0], [book["low"], book["high"]], atol=book["tolerance"])
    # None of n: from 0 to 1 - (alpha / 2)^(1/n).
    np.testing.assert_allclose(result.ci[1], [0.0, 1.0 - 0.025**0.1], rtol=1e-12)
    np.testing.assert_allclose(shares(["a"] * 10, ["a"]).ci, [[0.025**0.1, 1.0]], rtol=1e-12)


@pytest.mark.oracle
@pytest.mark.parametrize(("hits", "n"), [(0, 5), (1, 7), (250, 500), (499, 500)])
def test_intervals_of_shares_agree_with_scipy(hits, n):
    ours = shares(["a"] * hits + ["b"] * (n - hits), ["a", "b"]).ci[0]
    theirs = stats.binomtest(hits, n).proportion_ci(method="exact")
    np.testing.assert_allclose(ours, [theirs.low, theirs.high], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("labels", "words"), [([], "no run"), (["a", "x"], "'x' is not among a, b")])
def test_unknown_categories_are_refused(labels, words):
    with pytest.raises(InputError, match=words):
        shares(labels, ["a", "b"])


@pytest.mark.oracle
def test_rank_agreement_agrees_with_scipy_ties_included():
    a, b = [0.1, 0.5, 0.5, 2.0, 0.0], [0.2, 0.4, 0.6, 0.5, 0.2]
    assert rank_agreement(a, b) == pytest.approx(stats.spearmanr(a, b).statistic, rel=1e-12)


@pytest.mark.parametrize(("a", "b"), [([1.0, 1.0, 1.0], [1.0, 2.0, 3.0]), ([1.0, NAN, 3.0], [1.0, 2.0, 3.0]), ([1, 2], [1, 2])])
def test_rank_agreement_is_undefined_without_ranks(a, b):
    assert np.isnan(rank_agreement(a, b))


def test_failures_in_a_corner_are_found():
    design = latin_hypercube(unit_space(4), 400, 1)
    failed = (design.unit_points[:, 0] > 0.8) & (design.unit_points[:, 2] < 0.3)
    corner = failure_corner(design.unit_points, failed, design.names)
    assert corner.failed == failed.sum()
    assert corner.n == 400
    np.testing.assert_allclose(corner.mean_all, 0.5, atol=1e-2)
    assert corner.mean_failed[0] == pytest.approx(0.9, abs=0.02)
    assert corner.mean_failed[2] == pytest.approx(0.15, abs=0.06)
    assert (corner.p_value[[0, 2]] < 1e-6).all()
    assert (corner.p_value[[1, 3]] > 0.01).all()


def test_a_corner_needs_failures():
    points = latin_hypercube(unit_space(2), 10, 0).unit_points
    nothing = failure_corner(points, np.zeros(10), ["a", "b"])
    assert np.isnan(nothing.mean_failed).all()
    assert np.isnan(nothing.p_value).all()
    everything = failure_corner(points, np.ones(10), ["a", "b"])
    np.testing.assert_array_equal(everything.mean_failed, everything.mean_all)
    assert np.isnan(everything.p_value).all()
    with pytest.raises(InputError, match=r"\[10, 3\]"):
        failure_corner(points, np.zeros(10), ["a", "b", "c"])
