"""Draws from the posterior of the hyperparameters of a Kriging model, by Hamiltonian Monte Carlo.

One set of length scales is an estimate like any other. With 100 runs of 14 inputs the lengths are known to a factor of
1.2 at best, and those of weak inputs to a factor of three; a prediction error that takes them as given is too small.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.likelihood import PRIOR_RATE, NotPositiveDefinite, RestrictedLikelihood
from levelone.uncertainty.multistart import NUGGET_BOUNDS

Energy = Callable[[FloatArray], tuple[float, FloatArray]]

# The walls that keep log g inside its bounds rise over this distance.
_WALL = 0.5
# Log lengths beyond these are refused: exp would overflow, and the prior has no mass there.
_FARTHEST = (-8.0, 25.0)

# Curvature below which a direction counts as flat: it then moves by 1.2 in log length for a step of one standard deviation. On
# Ishigami and Sobol G with 100 to 500 points and 14 inputs these settings accept 85 to 90 % of the proposals, and the lag-one
# correlation of whitened draws is 0.1 to 0.6; steps of 0.8 accept half.
_LEAST_CURVATURE = 0.7
_STEP = (0.4, 0.55)
_STEPS = 4
_BURN_IN = 6

_DIFFERENCE = 0.05  # step of log length over which the gradient is differenced
_CLIMB = 20  # iterations that lead from the optimum of the penalised likelihood to that of the density in log length


@dataclass(frozen=True, eq=False)
class HyperparameterDraws:
    """Draws from a posterior.

    Attributes
    ----------
    parameters
        [draws, k], or [draws, k + 1] with a nugget: log lengths, log nugget.
    acceptance
        Share of the proposals that were accepted.
    """

    parameters: FloatArray
    acceptance: float


class HyperparameterPosterior:
    """Negative log posterior density of log l [k] (and log g), and its gradient; infinite where it is not defined.

    The variance of the process is integrated out under the prior 1 / s2, which gives the restricted likelihood that has it
    profiled out. The penalty of that likelihood is an exponential prior on 1 / l; as a density of log l it gains the factor 1 / l,
    which makes it proper: the likelihood of an inert input is flat towards long lengths. The prior of the nugget is uniform in log
    g between its bounds, with walls that rise smoothly.

    Parameters
    ----------
    likelihood
        Penalised restricted likelihood; its working arrays are used.
    power
        Power of the likelihood (not of the priors); 1 is Bayes' rule, less trusts the model less.
    """

    def __init__(self, likelihood: RestrictedLikelihood, power: float = 1.0) -> None:
        self.likelihood, self.power = likelihood, power
        self._k = likelihood.x.shape[1]

    def __call__(self, parameters: FloatArray) -> tuple[float, FloatArray]:
        """Value and gradient at log l, followed by log g where the likelihood has a nugget."""
        low, high = _FARTHEST
        lengths, nugget = parameters[: self._k], parameters[self._k :]
        edges = np.log(NUGGET_BOUNDS)
        if not ((lengths > low) & (lengths < high)).all() or not ((nugget > edges[0] - 5.0) & (nugget < edges[1] + 5.0)).all():
            return np.inf, np.zeros_like(parameters)
        try:
            value, gradient = self.likelihood(parameters)
        except NotPositiveDefinite:
            return np.inf, np.zeros_like(parameters)
        penalty = PRIOR_RATE * np.exp(-lengths)
        value = self.power * (value - float(penalty.sum())) + float(penalty.sum())
        gradient = self.power * gradient
        gradient[: self._k] -= (1.0 - self.power) * penalty
        below, above = np.exp((edges[0] - nugget) / _WALL), np.exp((nugget - edges[1]) / _WALL)
        slope = np.append(np.ones(self._k), (above - below) / _WALL)
        return value + float(lengths.sum() + below.sum() + above.sum()), gradient + slope


def draw_hyperparameters(
    likelihood: RestrictedLikelihood, start: FloatArray, draws: int, rng: np.random.Generator, power: float = 1.0
) -> HyperparameterDraws:
    """Draws from the posterior, by Hamiltonian Monte Carlo from its mode.

    The curvature at the mode, from differences of the analytic gradient, whitens the parameters, so that four leapfrog steps make
    a nearly independent draw; a draw costs four gradients, 0.06 s of CPU time with 500 points in 14 inputs.

    Source: Neal, in Handbook of Markov Chain Monte Carlo (Brooks et al., eds), 2011, chapter 5, section 5.3 and, for the whitening,
    5.4.1.

    Parameters
    ----------
    likelihood
        Penalised restricted likelihood of the response.
    start
        Log lengths [k], followed by the log nugget where the likelihood has one: the optimum found by the fit.
    draws
        Number of draws kept.
    rng
        Everything random.
    power
        As for :class:`HyperparameterPosterior`.
    """
    with OneBlasThread():
        return _sample(HyperparameterPosterior(likelihood, power), start, draws, rng)


def _sample(posterior: HyperparameterPosterior, start: FloatArray, draws: int, rng: np.random.Generator) -> HyperparameterDraws:
    mode, whitening = _mode(posterior, start)

    def energy(q: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = posterior(mode + whitening @ q)
        return value, whitening.T @ gradient

    q = np.zeros_like(mode)
    here = energy(q)
    kept, accepted = np.empty((draws, mode.size)), 0
    for i in range(-_BURN_IN, draws):
        momentum = rng.standard_normal(mode.size)
        proposal, there, left = _leapfrog(energy, q, here, momentum, rng.uniform(*_STEP))
        gain = here[0] + 0.5 * momentum @ momentum - there[0] - 0.5 * left @ left
        if np.log(rng.random()) < gain:
            q, here, accepted = proposal, there, accepted + 1
        if i >= 0:
            kept[i] = mode + whitening @ q
    return HyperparameterDraws(kept, accepted / (draws + _BURN_IN))


def _leapfrog(
    energy: Energy,
    q: FloatArray,
    here: tuple[float, FloatArray],
    momentum: FloatArray,
    step: float,
) -> tuple[FloatArray, tuple[float, FloatArray], FloatArray]:
    """Position, energy there and momentum after a trajectory; an infinite energy ends it."""
    there = here
    for i in range(_STEPS):
        momentum = momentum - (0.5 if i == 0 else 1.0) * step * there[1]
        q = q + step * momentum
        there = energy(q)
        if not np.isfinite(there[0]):
            return q, there, momentum
    return q, there, momentum - 0.5 * step * there[1]


def _mode(posterior: HyperparameterPosterior, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mode of the density in log length, and the matrix that maps whitened parameters to their distance from it."""
    edges = np.log(NUGGET_BOUNDS)
    inside = start.copy()
    nuggets = posterior.likelihood.x.shape[1]
    inside[nuggets:] = np.clip(inside[nuggets:], edges[0] + 2.0 * _WALL, edges[1] - 2.0 * _WALL)
    found = minimize(posterior, inside, jac=True, method="L-BFGS-B", options={"maxiter": _CLIMB, "maxcor": 30})
    mode = np.asarray(found.x if np.isfinite(found.fun) else inside)
    here = posterior(mode)[1]
    curvature = np.array([posterior(mode + _DIFFERENCE * unit)[1] - here for unit in np.eye(mode.size)]) / _DIFFERENCE
    values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
    return mode, vectors / np.sqrt(np.maximum(values, _LEAST_CURVATURE))
