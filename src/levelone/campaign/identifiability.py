"""What targets tell about parameters: the linear analysis of a Jacobian under a prior of one sigma in every parameter.

With J in tolerances of the targets for one sigma of the priors, the posterior covariance is (J^T J + I)^-1 in those sigmas
(Tarantola, Inverse Problem Theory, 2005, ch. 3, least squares with a Gaussian prior). The singular value decomposition of J gives
the combinations of parameters that the targets see.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: share of its prior variance that the targets must remove for a parameter to count as identified
REMOVED = 0.5
#: posterior correlation beyond which two parameters cannot be told apart
CORRELATED = 0.8
#: standard deviation over accepted fits, in that of their starts, beyond which a parameter counts as not identified
SPREAD = 0.5


@dataclass(frozen=True, eq=False)
class Identifiability:
    """Analysis of a Jacobian [m, p].

    Parameters
    ----------
    singular_values
        [k] tolerances for one sigma along each direction, largest first; above 1 the targets know more than the prior.
    directions
        [k, p] unit vectors in sigmas of the priors, the largest component positive.
    removed
        [p] share of the prior variance that the targets remove, 0 to 1.
    correlation
        [p, p] of the posterior.
    """

    singular_values: FloatArray
    directions: FloatArray
    removed: FloatArray
    correlation: FloatArray


def analyse(jacobian: FloatArray) -> Identifiability:
    """Analyse a finite Jacobian [m targets, p parameters], tolerances for one sigma of the priors."""
    jacobian = np.asarray(jacobian, dtype=float)
    _, values, directions = np.linalg.svd(jacobian, full_matrices=True)
    largest = np.take_along_axis(directions, np.abs(directions).argmax(axis=1, keepdims=True), axis=1)
    directions = directions * np.where(largest < 0.0, -1.0, 1.0)
    # the inverse of J^T J + I without forming it: directions that no target sees keep the prior's variance
    kept = np.ones(jacobian.shape[1])
    kept[: len(values)] = 1.0 / (1.0 + values**2)
    covariance = (directions.T * kept) @ directions
    sigma = np.sqrt(np.diag(covariance))
    removed = np.clip(1.0 - np.diag(covariance), 0.0, 1.0)
    return Identifiability(values, directions[: len(values)], removed, covariance / np.outer(sigma, sigma))


def inseparable(correlation: FloatArray, limit: float = CORRELATED) -> list[tuple[int, int, float]]:
    """Pairs (i, j, correlation) with i < j whose correlation exceeds the limit in size, the strongest first."""
    rows, columns = np.triu_indices(len(correlation), k=1)
    pairs = [(int(i), int(j), float(correlation[i, j])) for i, j in zip(rows, columns, strict=True)]
    return sorted((pair for pair in pairs if abs(pair[2]) > limit), key=lambda pair: -abs(pair[2]))


def spread_ratio(starts: FloatArray, fitted: FloatArray) -> FloatArray:
    """[p] standard deviation over fits [n, p] in that of their starts [n, p].

    NaN for fewer than two fits, and where all starts were the same.
    """
    if len(fitted) < 2:
        return np.full(starts.shape[1], np.nan)
    before, after = (np.std(values, axis=0, ddof=1) for values in (starts, fitted))
    return after / np.where(np.ptp(starts, axis=0) > 0.0, before, np.nan)
