"""Sensitivity analysis and uncertainty propagation for any model that maps points to responses.

The way through: :class:`FactorSpace` -> :class:`Design` (``morris_design``, ``latin_hypercube``, ``sobol_design``) ->
values of a model -> indices (``morris``, ``sobol``), with :class:`Kriging` in place of the model where it would have
to run 10^5 times. Every function is pure, every random stage takes a seed, and a failed run is NaN under a declared
policy.
"""

from __future__ import annotations

from levelone.uncertainty.designs import Design, latin_hypercube, morris_design, sobol_design
from levelone.uncertainty.distributions import (
    DISTRIBUTIONS,
    Discrete,
    Distribution,
    LogNormal,
    Normal,
    Triangular,
    TruncatedNormal,
    Uniform,
    uniform_around,
)
from levelone.uncertainty.factors import Factor, FactorSpace
from levelone.uncertainty.failures import EstimateStatus, Policy, bounding_values
from levelone.uncertainty.kriging import Kriging, Prediction
from levelone.uncertainty.morris import MorrisIndices, morris
from levelone.uncertainty.propagation import (
    FailureCorner,
    Shares,
    Summary,
    failure_corner,
    rank_agreement,
    shares,
    summarize,
)
from levelone.uncertainty.responses import Responses
from levelone.uncertainty.seeds import stage_seed
from levelone.uncertainty.sobol import SobolIndices, sobol
from levelone.uncertainty.surrogates import fit_all, predict_all

__all__ = [
    "DISTRIBUTIONS",
    "Design",
    "Discrete",
    "Distribution",
    "EstimateStatus",
    "Factor",
    "FactorSpace",
    "FailureCorner",
    "Kriging",
    "LogNormal",
    "MorrisIndices",
    "Normal",
    "Policy",
    "Prediction",
    "Responses",
    "Shares",
    "SobolIndices",
    "Summary",
    "Triangular",
    "TruncatedNormal",
    "Uniform",
    "bounding_values",
    "failure_corner",
    "fit_all",
    "latin_hypercube",
    "morris",
    "morris_design",
    "predict_all",
    "rank_agreement",
    "shares",
    "sobol",
    "sobol_design",
    "stage_seed",
    "summarize",
    "uniform_around",
]
