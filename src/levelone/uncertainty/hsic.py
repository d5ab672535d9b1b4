"""Does a response depend on a factor at all? A check of the ranking that does not go by the variance.

The Hilbert-Schmidt independence criterion (Gretton, Bousquet, Smola and Scholkopf, Algorithmic Learning Theory 2005, 63-77; for
sensitivity analysis Da Veiga, Journal of Statistical Computation and Simulation 85, 2015, 1283-1305) measures any dependence
between a factor and a response, not the share of a variance; a permutation test says how often chance alone would give as much.
It takes any sample, as :mod:`levelone.uncertainty.given_data` does.

Both sides enter as ranks, so that no change of scale of an input or of the response matters, and one outlier neither. Kernel
exp(-d^2 / (2 l^2)) with l = 0.15 of the range of the ranks. The usual choice, the standard deviation (0.29), is too smooth to see
an effect of two periods over the range: of the inputs of the Ishigami function at 500 runs it ranks none of 20 samples right,
this one all; so did medians, means and largest values of PAWN (none).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from levelone.errors import InputError
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failure_doubt import doubt, gathered_p
from levelone.uncertainty.failures import EstimateStatus, Policy, bounding_values, check_policy, is_constant
from levelone.uncertainty.given_data import FEWEST_RUNS, check_sample, unit_ranks
from levelone.uncertainty.seeds import stage_seed

LENGTH = 0.15
"""Length of the kernel, as a fraction of the range of the ranks."""

# The kernel is the scalar product of exp(-t^2 / 2) t^i / sqrt(i!), i = 0, 1, ...; ranks reach t = 1 / (2 l), where the squares of
# these features are Poisson probabilities of mean 11.1: beyond 48 of them less than 1e-14 is left.
_FEATURES = 48
# Features of less than this share of the largest singular value add nothing that double precision would hold.
_NEGLIGIBLE = 1e-10


@dataclass(frozen=True, eq=False)
class Dependence:
    """Dependence of one response on each of k factors, from a sample.

    Attributes
    ----------
    names
        Names of the factors.
    R2
        [k]: HSIC(x, y) / sqrt(HSIC(x, x) HSIC(y, y)), between 0 and 1 (biased estimates: chance gives about 0.005 at 500 runs).
    p_value
        [k]: share of permutations of the response that give as much, the sample itself counted among them.
    runs, used, failed
        Runs of the sample, those that the estimate rests on, those that failed.
    failure_p
        Whether failures gather in a part of the factor box: :func:`levelone.uncertainty.failure_doubt.gathered_p`.
    status
        ``CONSTANT_RESPONSE`` or ``TOO_FEW_RUNS``: every figure is then NaN.
    bounding
        Under the policy "bound" with failures: the same with failed runs at the lowest and at the highest value seen.
    """

    names: tuple[str, ...]
    R2: FloatArray
    p_value: FloatArray
    runs: int
    used: int
    failed: int
    failure_p: float
    status: EstimateStatus
    bounding: tuple[Dependence, Dependence] | None = None

    @property
    def doubt(self) -> str:
        """Why these figures cannot be trusted, in words; empty where nothing speaks against them.

        See :func:`levelone.uncertainty.failure_doubt.doubt`. Here a figure moves when a p-value crosses 5 %.
        """
        moved = (
            None
            if self.bounding is None
            else any(((side.p_value <= 0.05) != (self.p_value <= 0.05)).any() for side in self.bounding)
        )
        return doubt(self.status, self.failed, self.failure_p, moved)


def dependence(
    x: ArrayLike, values: ArrayLike, names: Sequence[str], seed: int, *, permutations: int = 500, policy: Policy = "refuse"
) -> Dependence:
    """Normalised HSIC of one response and each factor, with p-values.

    Parameters
    ----------
    x
        [n, k] inputs of independent runs, in any unit.
    values
        [n], one response; NaN where a run failed.
    names
        Names of the k factors.
    seed
        Seed of the permutations.
    permutations
        Number of permutations, at least 19; the least p-value is 1 / (permutations + 1).
    policy
        What to do about failed runs: see :mod:`levelone.uncertainty.failures`.

    Raises
    ------
    InputError
        Shapes that disagree, an input that is not finite or never varies, too few permutations, an unknown policy, failed runs
        under "refuse".
    """
    names = tuple(names)
    inputs, y = check_sample(x, values, names)
    if permutations < 19:
        raise InputError("permutations", f"{permutations!r}; at least 19 are needed for a p-value of 5 %")
    check_policy(policy, y)
    failures = int(np.isnan(y).sum()), gathered_p(inputs, np.isnan(y))
    bounding = None
    if policy == "bound" and failures[0]:
        low, high = (_dependence(inputs, filled, names, seed, permutations, failures) for filled in bounding_values(y))
        bounding = (low, high)
    return _dependence(inputs, y, names, seed, permutations, failures, bounding)


def _dependence(
    inputs: FloatArray,
    y: FloatArray,
    names: tuple[str, ...],
    seed: int,
    permutations: int,
    failures: tuple[int, float],
    bounding: tuple[Dependence, Dependence] | None = None,
) -> Dependence:
    kept = np.logical_not(np.isnan(y))
    x, response, n, k = inputs[kept], y[kept], int(kept.sum()), len(names)
    R2, p_value = np.full(k, np.nan), np.full(k, np.nan)
    status = EstimateStatus.OK
    if n < FEWEST_RUNS or (np.ptp(x, axis=0) == 0.0).any():
        status = EstimateStatus.TOO_FEW_RUNS
    elif is_constant(response):
        status = EstimateStatus.CONSTANT_RESPONSE
    else:
        with OneBlasThread():
            R2, p_value = _measure([_features(column) for column in x.T], _features(response), seed, permutations)
    return Dependence(names, R2, p_value, inputs.shape[0], n, *failures, status, bounding)


def _features(column: FloatArray) -> FloatArray:
    """Centred features [n, r] whose scalar products are the centred kernel matrix of the ranks."""
    t = (unit_ranks(column) - 0.5) / LENGTH
    features = np.empty((column.size, _FEATURES))
    features[:, 0] = np.exp(-0.5 * t * t)
    for i in range(1, _FEATURES):
        features[:, i] = features[:, i - 1] * t / np.sqrt(i)
    left, singular, _ = np.linalg.svd(features - features.mean(axis=0), full_matrices=False)
    large = singular > _NEGLIGIBLE * singular[0]
    compact: FloatArray = left[:, large] * singular[large]
    return compact


def _measure(inputs: list[FloatArray], response: FloatArray, seed: int, permutations: int) -> tuple[FloatArray, FloatArray]:
    """R2 and p-values, [k] each. The criterion is the squared Frobenius norm of the product of features, over n^2."""
    stacked = np.hstack(inputs)
    first = np.concatenate([[0], np.cumsum([features.shape[1] for features in inputs])])[:-1]

    def criterion(rows: FloatArray) -> FloatArray:
        return np.add.reduceat(((stacked.T @ rows) ** 2).sum(axis=1), first)

    found = criterion(response)
    own = np.array([((features.T @ features) ** 2).sum() for features in inputs]) * ((response.T @ response) ** 2).sum()
    rng = np.random.default_rng(stage_seed(seed, "permutations of dependence"))
    # Rounding may put a permutation that changes nothing on either side of the sample itself.
    threshold = found * (1.0 - 1e-9)
    exceeding = sum((criterion(rng.permutation(response)) >= threshold).astype(float) for _ in range(permutations))
    return found / np.sqrt(own), (1.0 + np.asarray(exceeding)) / (permutations + 1.0)
