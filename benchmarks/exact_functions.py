"""Test functions of 14 inputs with exact indices, those of the tests, for the benchmarks."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "uncertainty"))
from uncertainty_functions import REFERENCE, ishigami, sobol_g, unit_space
from uncertainty_functions import exact as exact_pair

K = 14
SPACE = unit_space(K)
NEW = np.random.default_rng(99).random((10_000, K))
FUNCTIONS = {"ishigami": ishigami, "sobol_g": sobol_g}


def exact(name, index):
    """S1 or ST [14] of a function."""
    return exact_pair(name, K)[("S1", "ST").index(index)]


__all__ = ["FUNCTIONS", "NEW", "REFERENCE", "SPACE", "K", "exact", "exact_pair", "ishigami", "sobol_g"]
