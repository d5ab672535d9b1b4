from __future__ import annotations

import numpy as np
import pytest

from levelone.uncertainty.correlation import CORRELATIONS
from levelone.uncertainty.hyperparameters import HyperparameterPosterior, draw_hyperparameters
from levelone.uncertainty.likelihood import RestrictedLikelihood
from levelone.uncertainty.multistart import NUGGET_BOUNDS


def data(n=15):
    x = np.linspace(0.0, 1.0, n)[:, None]
    y = np.sin(5.0 * x[:, 0]) + 0.15 * np.random.default_rng(8).standard_normal(n)
    return x, (y - y.mean()) / y.std()


def log_density(x, y, log_length, log_nugget, power=1.0):
    """Dense formulas: restricted likelihood with the variance integrated out, exponential prior on 1 / l as a density of log l."""
    n = len(y)
    k = np.exp(-0.5 * (x - x.T) ** 2 / np.exp(2.0 * log_length)) + np.exp(log_nugget) * np.eye(n)
    ki, ones = np.linalg.inv(k), np.ones(n)
    beta = (ones @ ki @ y) / (ones @ ki @ ones)
    quadratic = (y - beta) @ ki @ (y - beta)
    likelihood = -0.5 * ((n - 1) * np.log(quadratic) + np.linalg.slogdet(k)[1] + np.log(ones @ ki @ ones))
    edges = np.log(NUGGET_BOUNDS)
    walls = np.exp((edges[0] - log_nugget) / 0.5) + np.exp((log_nugget - edges[1]) / 0.5)
    return power * likelihood - np.exp(-log_length) - log_length - walls


@pytest.mark.theory
@pytest.mark.parametrize("power", [1.0, 0.5])
def test_draws_have_the_moments_of_the_density_on_a_grid(power):
    """One length and a nugget: 700 draws of lag-one correlation below 0.6 are worth 175, so that 0.3 standard deviations is four
    standard errors of a mean, and 0.22 is four of the logarithm of a standard deviation."""
    x, y = data()
    likelihood = RestrictedLikelihood(x, y, np.ones((len(y), 1)), "squared_exponential", True)
    draws = draw_hyperparameters(likelihood, np.log([0.3, 1e-3]), 700, np.random.default_rng(4), power)
    lengths, nuggets = np.linspace(-4.0, 4.0, 101), np.linspace(np.log(1e-8) - 2.0, np.log(10.0) + 2.0, 81)
    log = np.array([[log_density(x, y, a, b, power) for b in nuggets] for a in lengths])
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    for column, values, marginal in ((0, lengths, weight.sum(axis=1)), (1, nuggets, weight.sum(axis=0))):
        mean = values @ marginal
        std = np.sqrt((values - mean) ** 2 @ marginal)
        found = draws.parameters[:, column]
        assert abs(found.mean() - mean) < 0.3 * std
        assert abs(np.log(found.std() / std)) < 0.22
    assert 0.6 < draws.acceptance <= 1.0


@pytest.mark.theory
@pytest.mark.parametrize("kind", CORRELATIONS)
@pytest.mark.parametrize("nugget", [False, True])
def test_the_gradient_is_that_of_differences(kind, nugget):
    rng = np.random.default_rng(0)
    x = rng.random((30, 3))
    y = np.sin(4.0 * x[:, 0]) + x[:, 1]
    posterior = HyperparameterPosterior(RestrictedLikelihood(x, y, np.ones((30, 1)), kind, nugget), 0.5)
    at = np.append(np.log([0.3, 0.8, 2.0]), [np.log(2e-8)] * nugget)
    gradient = posterior(at)[1]
    step = 1e-5
    for j, unit in enumerate(np.eye(at.size)):
        difference = (posterior(at + step * unit)[0] - posterior(at - step * unit)[0]) / (2.0 * step)
        assert gradient[j] == pytest.approx(difference, rel=2e-5, abs=2e-5)


def test_far_parameters_have_no_density():
    x, y = data()
    posterior = HyperparameterPosterior(RestrictedLikelihood(x, y, np.ones((len(y), 1)), "matern52", True))
    for far in ([-9.0, -5.0], [30.0, -5.0], [0.0, 10.0], [0.0, -30.0], [np.nan, -5.0]):
        assert posterior(np.array(far))[0] == np.inf


def test_the_seed_decides_every_digit():
    x, y = data()
    parameters = [
        draw_hyperparameters(
            RestrictedLikelihood(x, y, np.ones((len(y), 1)), "matern52"), np.log([0.3]), 20, np.random.default_rng(seed)
        ).parameters
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(parameters[0], parameters[1])
    assert np.abs(parameters[0] - parameters[2]).max() > 0.01
