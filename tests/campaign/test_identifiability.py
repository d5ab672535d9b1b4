"""The analysis of a Jacobian against closed forms and the plain inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from levelone.campaign.identifiability import analyse, inseparable, spread_ratio

JACOBIANS = st.tuples(st.integers(1, 5), st.integers(1, 6)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.floats(-30.0, 30.0, allow_subnormal=False))
)


@pytest.mark.theory
def test_one_parameter_to_each_target_removes_s2_over_1_plus_s2() -> None:
    found = analyse(np.diag([3.0, 1.0, 0.5]))
    assert found.removed == pytest.approx([0.9, 0.5, 0.2], rel=1e-14)
    assert found.correlation == pytest.approx(np.eye(3), abs=1e-15)
    assert found.singular_values == pytest.approx([3.0, 1.0, 0.5])


@pytest.mark.theory
def test_two_parameters_that_act_alike_are_told_only_in_their_sum() -> None:
    """J = s (1, 1): the sum is known, the difference keeps the prior; correlation -s^2 / (1 + s^2)."""
    s = 10.0
    found = analyse(np.array([[s, s]]))
    assert found.directions[0] == pytest.approx([np.sqrt(0.5), np.sqrt(0.5)])
    assert found.removed == pytest.approx([s**2 / (1 + 2 * s**2)] * 2)
    assert found.correlation[0, 1] == pytest.approx(-(s**2) / (1 + s**2))
    assert inseparable(found.correlation) == [(0, 1, pytest.approx(-(s**2) / (1 + s**2)))]
    assert inseparable(found.correlation, 0.995) == []


def test_what_no_target_sees_keeps_its_prior() -> None:
    found = analyse(np.array([[4.0, 0.0, 1.0], [-2.0, 0.0, 3.0]]))
    assert found.removed[1] == pytest.approx(0.0, abs=1e-15)
    assert found.correlation[1] == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)


def test_a_direction_known_beyond_all_measure_stays_finite() -> None:
    found = analyse(np.array([[1e12, 1e12], [0.0, 1e-3]]))
    assert np.isfinite(found.correlation).all()
    assert found.correlation[0, 1] == pytest.approx(-1.0, abs=1e-12)


@pytest.mark.oracle
@given(JACOBIANS)
def test_the_posterior_is_that_of_the_plain_inverse(jacobian: np.ndarray) -> None:
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(jacobian.shape[1]))
    sigma = np.sqrt(np.diag(covariance))
    found = analyse(jacobian)
    assert found.removed == pytest.approx(1.0 - np.diag(covariance), abs=1e-9)
    assert found.correlation == pytest.approx(covariance / np.outer(sigma, sigma), abs=1e-6)


@given(JACOBIANS)
def test_the_shares_removed_add_up_over_directions(jacobian: np.ndarray) -> None:
    found = analyse(jacobian)
    s2 = found.singular_values**2
    assert found.removed.sum() == pytest.approx(float(np.sum(s2 / (1.0 + s2))), abs=1e-9)
    assert np.all((found.removed >= 0.0) & (found.removed <= 1.0))


@given(JACOBIANS)
def test_the_order_of_parameters_does_not_matter(jacobian: np.ndarray) -> None:
    order = np.arange(jacobian.shape[1])[::-1]
    assert analyse(jacobian[:, order]).removed == pytest.approx(analyse(jacobian).removed[order], abs=1e-9)


@given(JACOBIANS)
def test_directions_have_one_sign(jacobian: np.ndarray) -> None:
    directions = analyse(jacobian).directions
    assert np.all(directions[np.arange(len(directions)), np.abs(directions).argmax(axis=1)] > 0.0)


def test_spread_kept_by_fits() -> None:
    starts = np.array([[0.0, 0.0, 5.0], [1.0, 2.0, 5.0], [2.0, 4.0, 5.0]])
    fitted = np.array([[0.9, 0.0, 5.0], [1.0, 2.0, 6.0], [1.1, 4.0, 7.0]])
    assert spread_ratio(starts, fitted) == pytest.approx([0.1, 1.0, np.nan], nan_ok=True)
    assert np.isnan(spread_ratio(starts[:1], fitted[:1])).all()
    assert np.isnan(spread_ratio(np.empty((0, 3)), np.empty((0, 3)))).tolist() == [True] * 3
