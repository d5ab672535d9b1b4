"""Functions drawn from a Kriging model that all pass through its data: what else the response may be, given the runs.

Pathwise conditioning (Matheron's rule): a function f drawn from the prior becomes one drawn from the posterior by adding the
Kriging prediction, trend included, of what it misses at the training points, f(x) + k(x) Q (y - f - noise) + trend. Its error then
has the covariance of universal Kriging exactly. The prior is drawn as a sum of random cosines, whose covariance is right on
average over the frequencies.

Source: Wilson, Borovitskiy, Terenin, Mostowsky and Deisenroth, Journal of Machine Learning Research 22 (105), 2021, 1-47
(pathwise conditioning); with an unknown trend: Chiles and Delfiner, Geostatistics, 1999, chapter 7 (conditioning by Kriging).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri, ndtri
from scipy.stats import qmc

from levelone.uncertainty import lapack
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.correlation import Correlation, correlate, squared_distances
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.kriging import Trend, check_data, trend_functions
from levelone.uncertainty.likelihood import RestrictedLikelihood, Solves

FREQUENCIES = 512
"""Random frequencies, a cosine and a sine of each, that make a prior draw; a power of two."""

_MATERN_FREEDOM = 5  # the spectral density of Matern 5/2 is a Student density of 2 * 5/2 degrees of freedom

# Points evaluated at once: with 500 training points the working arrays of 1 MiB stay in a core's cache.
_CHUNK = 256


@dataclass(frozen=True, eq=False)
class PosteriorPaths:
    """s functions drawn from the posterior at one set of hyperparameters; call with points [m, k] for values [s, m].

    Built by :func:`posterior_paths`.
    """

    correlation: Correlation
    trend: Trend
    lengths: FloatArray
    _scaling: tuple[FloatArray, FloatArray, float, float] = field(repr=False)
    _z: FloatArray = field(repr=False)
    _frequencies: FloatArray = field(repr=False)
    _waves: FloatArray = field(repr=False)
    _alpha: FloatArray = field(repr=False)
    _beta: FloatArray = field(repr=False)

    def __call__(self, x: ArrayLike) -> FloatArray:
        """Values [s, m], in the unit of the response and without noise, at points x [m, k] in the coordinates of the fit."""
        low, width, y_mean, y_std = self._scaling
        points = np.asarray(x, dtype=np.float64)
        values = np.empty((len(points), self._beta.shape[1]))
        with OneBlasThread():
            for start in range(0, len(points), _CHUNK):
                u = (points[start : start + _CHUNK] - low) / width
                z = u / self.lengths
                r2 = squared_distances(z, self._z)
                k = correlate(self.correlation, r2, np.empty_like(r2))
                # Cosines in single precision cost a ninth, and nothing multiplies their rounding of 1e-6 of the process.
                prior = _waves(z.astype(np.float32), self._frequencies.astype(np.float32)) @ self._waves.astype(np.float32)
                values[start : start + len(u)] = prior + k @ self._alpha + trend_functions(u, self.trend) @ self._beta
        return y_mean + y_std * values.T


def posterior_paths(
    x: ArrayLike,
    y: ArrayLike,
    lengths: FloatArray,
    nugget: float,
    paths: int,
    rng: np.random.Generator,
    *,
    correlation: Correlation = "matern52",
    trend: Trend = "constant",
    inflation: float = 1.0,
) -> PosteriorPaths:
    """Draw functions that the data leave possible, at given hyperparameters.

    Parameters
    ----------
    x, y
        [n, k], [n]: training points and response, finite.
    lengths, nugget
        [k] length scales in units of the range of each input, and the nugget over the variance of the process.
    paths
        Number of functions.
    rng
        Everything random: frequencies (shared by the paths), amplitudes, noise, and the variance of the process, which is
        y'Qy over a chi-squared variable of n - p degrees of freedom for each path.
    correlation, trend
        As for :class:`levelone.uncertainty.kriging.Kriging`.
    inflation
        Factor on the standard deviation of the process: above one for a model whose errors are larger than it claims.
    """
    x, y = check_data(x, y)
    low, width, y_mean, y_std = x.min(axis=0), np.ptp(x, axis=0), float(y.mean()), float(y.std())
    u, scaled = (x - low) / width, (y - y_mean) / y_std
    basis, z = trend_functions(u, trend), u / lengths
    frequencies = _draw_frequencies(correlation, x.shape[1], rng)
    with OneBlasThread():
        solves = RestrictedLikelihood(u, scaled, basis, correlation).solves(lengths, nugget)
        std = inflation * np.sqrt(solves.quadratic / rng.chisquare(len(y) - basis.shape[1], paths))
        waves = rng.standard_normal((2 * len(frequencies), paths)) * (std / np.sqrt(len(frequencies)))
        noise = np.sqrt(nugget + solves.jitter) * std * rng.standard_normal((len(y), paths))
        missed = scaled[:, None] - _waves(z, frequencies) @ waves - noise
        alpha, beta = _condition(solves, basis, missed)
    return PosteriorPaths(correlation, trend, lengths, (low, width, y_mean, y_std), z, frequencies, waves, alpha, beta)


def _condition(solves: Solves, basis: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Q values [n, s] and the trend's coefficients [p, s], by generalised least squares."""
    solved = lapack.solve(solves.factor, values)
    beta = lapack.solve(np.asfortranarray(solves.trend_factor), basis.T @ solved)
    return solved - solves.trend_solve @ beta, beta


def _draw_frequencies(correlation: Correlation, k: int, rng: np.random.Generator) -> FloatArray:
    """Frequencies [f, k] from the spectral density in scaled coordinates: normal, or Student for Matern.

    What the data leave open comes from the few highest frequencies, a handful of independent draws; a scrambled Sobol sequence
    holds their number steady from draw to draw (Avron, Sindhwani, Yang and Mahoney, Journal of Machine Learning Research 17 (120),
    2016, 1-38).
    """
    unit = qmc.Sobol(k + 1, rng=rng).random_base2(FREQUENCIES.bit_length() - 1)
    unit = np.clip(unit, 2.0**-31, 1.0 - 2.0**-31)
    normal = ndtri(unit[:, :k])
    if correlation == "squared_exponential":
        return normal
    return normal / np.sqrt(chdtri(_MATERN_FREEDOM, unit[:, k:]) / _MATERN_FREEDOM)


def _waves(z: FloatArray, frequencies: FloatArray) -> FloatArray:
    """Cosines, then sines, of each frequency at scaled points, [m, 2 f]."""
    phase = z @ frequencies.T
    return np.hstack([np.cos(phase), np.sin(phase)])
