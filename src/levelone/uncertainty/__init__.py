"""Sensitivity analysis and uncertainty propagation for any model that maps points to responses.

The way through: :class:`FactorSpace` -> :class:`Design` (``morris_design``, ``latin_hypercube``, ``sobol_design``,
``shapley_design`` ...) -> values of a model -> indices (``morris``, ``sobol``, ``shapley`` ...), with :class:`Kriging`
or :class:`PolynomialChaos` in place of the model where it would have to run 10^5 times; runs of other origin go to
``given_data`` and ``dependence``. Every function is pure, every random stage takes a seed, and a failed run is NaN under
a declared policy.
"""

from __future__ import annotations

from levelone.uncertainty.designs import Design, latin_hypercube, morris_design, sobol_design
from levelone.uncertainty.dgsm import DerivativeMeasures, derivative_design, derivative_measures
from levelone.uncertainty.distributions import (
    DISTRIBUTIONS,
    Discrete,
    Distribution,
    Interval,
    LogNormal,
    Normal,
    Triangular,
    TruncatedNormal,
    Uniform,
    uniform_around,
)
from levelone.uncertainty.evidence import Evidence, FocalBoxes, focal_boxes
from levelone.uncertainty.factors import Factor, FactorSpace
from levelone.uncertainty.failures import EstimateStatus, Policy, bounding_values
from levelone.uncertainty.given_data import GivenDataIndices, given_data
from levelone.uncertainty.hsic import Dependence, dependence
from levelone.uncertainty.kriging import Kriging, Prediction
from levelone.uncertainty.morris import MorrisIndices, morris
from levelone.uncertainty.morris_convergence import MorrisConvergence, morris_convergence
from levelone.uncertainty.morris_designs import add_trajectories, grouped_morris_design, radial_design
from levelone.uncertainty.pce import PolynomialChaos
from levelone.uncertainty.probability_box import BoxSearch, ProbabilityBox, search_boxes
from levelone.uncertainty.propagation import FailureCorner, Shares, Summary, failure_corner, rank_agreement, shares, summarize
from levelone.uncertainty.responses import Responses
from levelone.uncertainty.seeds import stage_seed
from levelone.uncertainty.sequential import next_points, sequential_design
from levelone.uncertainty.shapley import ShapleyEffects, shapley, shapley_design
from levelone.uncertainty.sobol import SobolIndices, sobol, widest
from levelone.uncertainty.surrogate_intervals import SurrogateIndices, sobol_on_surrogate
from levelone.uncertainty.surrogates import fit_all, predict_all
from levelone.uncertainty.validation import Validation, validate

__all__ = [
    "BoxSearch",
    "DISTRIBUTIONS",
    "Dependence",
    "DerivativeMeasures",
    "Design",
    "Discrete",
    "Distribution",
    "EstimateStatus",
    "Evidence",
    "Factor",
    "FactorSpace",
    "FailureCorner",
    "FocalBoxes",
    "GivenDataIndices",
    "Interval",
    "Kriging",
    "LogNormal",
    "MorrisConvergence",
    "MorrisIndices",
    "Normal",
    "Policy",
    "PolynomialChaos",
    "Prediction",
    "ProbabilityBox",
    "Responses",
    "ShapleyEffects",
    "Shares",
    "SobolIndices",
    "Summary",
    "SurrogateIndices",
    "Triangular",
    "TruncatedNormal",
    "Uniform",
    "Validation",
    "add_trajectories",
    "bounding_values",
    "dependence",
    "derivative_design",
    "derivative_measures",
    "failure_corner",
    "fit_all",
    "focal_boxes",
    "given_data",
    "grouped_morris_design",
    "latin_hypercube",
    "morris",
    "morris_convergence",
    "morris_design",
    "next_points",
    "predict_all",
    "radial_design",
    "rank_agreement",
    "search_boxes",
    "sequential_design",
    "shapley",
    "shapley_design",
    "shares",
    "sobol",
    "sobol_design",
    "sobol_on_surrogate",
    "stage_seed",
    "summarize",
    "uniform_around",
    "validate",
    "widest",
]
