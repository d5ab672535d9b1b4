from __future__ import annotations

import numpy as np
import pytest
from uncertainty_functions import unit_space

from levelone.uncertainty import Kriging, latin_hypercube
from levelone.uncertainty.correlation import CORRELATIONS, correlate
from levelone.uncertainty.paths import posterior_paths

LENGTHS = np.array([0.4, 0.9])


def sample(n=14):
    x = latin_hypercube(unit_space(2), n, 3).points
    return x, 5.0 + 2.0 * np.sin(5.0 * x[:, 0]) + x[:, 1] ** 2


def kernel(kind, a, b):
    r2 = (((a[:, None] - b) / LENGTHS) ** 2).sum(axis=2)
    return correlate(kind, r2, np.empty_like(r2))


def exact(kind, trend, nugget, x, y, new):
    """Mean and covariance of universal Kriging at new points by the dense formulas, up to the variance of the process."""
    low, width = x.min(axis=0), np.ptp(x, axis=0)
    u, v = (x - low) / width, (new - low) / width
    f, g = (np.ones((len(p), 1)) if trend == "constant" else np.column_stack([np.ones(len(p)), p - 0.5]) for p in (u, v))
    ki = np.linalg.inv(kernel(kind, u, u) + nugget * np.eye(len(u)))
    k = kernel(kind, v, u)
    normal = np.linalg.inv(f.T @ ki @ f)
    beta = normal @ f.T @ ki @ y
    gap = g - k @ ki @ f
    mean = g @ beta + k @ ki @ (y - f @ beta)
    quadratic = (y - f @ beta) @ ki @ (y - f @ beta)
    return mean, kernel(kind, v, v) - k @ ki @ k.T + gap @ normal @ gap.T, quadratic, len(u) - f.shape[1]


@pytest.mark.theory
@pytest.mark.parametrize("kind", CORRELATIONS)
@pytest.mark.parametrize(("trend", "nugget"), [("constant", 1e-3), ("linear", 0.05)])
def test_paths_have_the_moments_of_the_joint_posterior(kind, trend, nugget):
    """6000 paths in 100 sets of frequencies. In units of the standard deviations the standard error of a mean is 0.013 and that of
    a correlation or a variance at most 0.03 (the variance of the process is itself drawn), to which the paths that share
    frequencies add; the bounds are four times that."""
    x, y = sample()
    new = np.random.default_rng(1).random((6, 2))
    rng = np.random.default_rng(2)
    values = np.concatenate(
        [posterior_paths(x, y, LENGTHS, nugget, 60, rng, correlation=kind, trend=trend)(new) for _ in range(100)]
    )
    mean, covariance, quadratic, freedom = exact(kind, trend, nugget, x, y, new)
    covariance *= quadratic / (freedom - 2)  # mean of y'Qy over a chi-squared variable
    std = np.sqrt(covariance.diagonal())
    np.testing.assert_allclose((values.mean(axis=0) - mean) / std, 0.0, atol=0.06)
    np.testing.assert_allclose((np.cov(values.T) - covariance) / np.outer(std, std), 0.0, atol=0.13)


@pytest.mark.theory
@pytest.mark.parametrize("kind", CORRELATIONS)
def test_paths_pass_through_the_runs(kind):
    x, y = sample()
    paths = posterior_paths(x, y, LENGTHS, 0.0, 20, np.random.default_rng(0), correlation=kind)
    np.testing.assert_allclose(paths(x), np.tile(y, (20, 1)), atol=2e-5 * y.std())
    between = paths(np.random.default_rng(1).random((50, 2)))
    assert between.std(axis=0).max() > 0.01 * y.std()


@pytest.mark.theory
def test_inflation_stretches_the_spread_about_the_mean():
    x, y = sample()
    new = np.random.default_rng(1).random((30, 2))
    mean = Kriging.condition(x, y, LENGTHS, 1e-3).predict_mean(new)
    once, twice = (
        posterior_paths(x, y, LENGTHS, 1e-3, 5, np.random.default_rng(7), inflation=factor)(new) - mean for factor in (1.0, 2.0)
    )
    np.testing.assert_allclose(twice, 2.0 * once, atol=2e-5 * y.std())


def test_chunks_change_no_value():
    x, y = sample()
    new = np.random.default_rng(1).random((600, 2))
    paths = posterior_paths(x, y, LENGTHS, 1e-3, 3, np.random.default_rng(0))
    np.testing.assert_allclose(paths(new)[:, 250:270], paths(new[250:270]), rtol=0.0, atol=1e-6 * y.std())
