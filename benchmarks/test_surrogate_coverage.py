"""How often intervals of Sobol indices on a surrogate hold the true index, and how wide they are, beside the plain bootstrap.

``pytest benchmarks/test_surrogate_coverage.py -s``: some hours of CPU time for 200 repetitions; fewer by the environment variable
``LEVELONE_REPETITIONS``. Inputs count as active where their true index is at least 0.01. The ratio of widths is given at the base
points of the design: the bootstrap narrows with their number, the error of the surrogate does not.
"""

from __future__ import annotations

import os
import time

import numpy as np
import pytest

from exact_functions import SPACE, K, exact_pair, ishigami, sobol_g
from levelone.uncertainty import Kriging, latin_hypercube, sobol_design
from levelone.uncertainty.surrogate_intervals import sobol_on_surrogate

REPETITIONS = int(os.environ.get("LEVELONE_REPETITIONS", "200"))
BASE_POINTS = int(os.environ.get("LEVELONE_BASE_POINTS", "4096"))
ACTIVE = 0.01


# Smooth blocks of interacting inputs; the inputs of no block are inert.
BLOCKS = (
    ((0, 1, 2), lambda a, b, c: np.exp(1.5 * a * b + 0.5 * c)),
    ((3, 4), lambda a, b: 1.5 * np.sin(np.pi * a) * (0.3 + b**2)),
    ((5, 6), lambda a, b: 3.0 / (1.0 + a + 0.5 * b)),
    ((7, 8, 9), lambda a, b, c: 2.0 * a * b + 0.6 * c),
)


def blocks(u):
    return sum(block(*u[:, inputs].T) for inputs, block in BLOCKS)


def blocks_exact():
    """S1 and ST by Gauss-Legendre quadrature with 32 nodes an input: the variance of a sum of blocks is that of its blocks."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    parts, total = np.zeros((2, K)), 0.0

    def mean(values, axes):
        for axis in sorted(axes, reverse=True):
            values = np.tensordot(values, weights, (axis, 0))
        return values

    for inputs, block in BLOCKS:
        values = block(*np.meshgrid(*[nodes] * len(inputs), indexing="ij"))
        axes = range(len(inputs))
        values = values - mean(values, axes)
        variance = mean(values**2, axes)
        total += variance
        for axis, j in enumerate(inputs):
            alone, without = mean(values, [a for a in axes if a != axis]), mean(values, [axis])
            parts[:, j] = weights @ alone**2, variance - mean(without**2, range(len(inputs) - 1))
    return parts / total


CASES = {
    "ishigami": (ishigami, exact_pair("ishigami", K)),
    "sobol_g": (sobol_g, exact_pair("sobol_g", K)),
    "blocks": (blocks, blocks_exact()),
}


def repeat(function, n, design):
    """Intervals [repetitions, kind, index, k, 2] of both kinds, ours and the plain bootstrap's, and CPU seconds of ours."""
    found, spent = [], 0.0
    for seed in range(REPETITIONS):
        x = latin_hypercube(SPACE, n, 1000 + seed).unit_points
        y = function(x)
        model = Kriging.fit(x, y, seed)
        start = time.process_time()
        indices = sobol_on_surrogate(x, y, model, design, seed)
        spent += time.process_time() - start
        found.append([[indices.S1_ci, indices.ST_ci], [indices.S1_ci_sampling, indices.ST_ci_sampling]])
    return np.array(found), spent / REPETITIONS


@pytest.mark.parametrize("n", [100, 200, 500])
@pytest.mark.parametrize("name", CASES)
def test_coverage(benchmark, capsys, name, n):
    function, exact = CASES[name]
    design = sobol_design(SPACE, BASE_POINTS, 7)
    ci, spent = benchmark.pedantic(repeat, args=(function, n, design), rounds=1)
    covered = (ci[..., 0] <= exact) & (exact <= ci[..., 1])
    width = ci[..., 1] - ci[..., 0]
    with capsys.disabled():
        print(f"\n{name}, {n} runs, {REPETITIONS} repetitions, {BASE_POINTS} base points, {spent:.1f} CPU s for the intervals")
        for i, index in enumerate(("S1", "ST")):
            active = exact[i] >= ACTIVE
            for kind, words in enumerate(("with surrogate error", "plain bootstrap")):
                held = covered[:, kind, i][:, active]
                print(
                    f"  {index} {words:21s} coverage {held.mean():.3f}, worst input {held.mean(axis=0).min():.3f}, "
                    f"median width {np.median(width[:, kind, i][:, active]):.4f}"
                )
            ratio = np.median(width[:, 0, i][:, active]) / np.median(width[:, 1, i][:, active])
            print(f"  {index} ratio of median widths {ratio:.2f}")
            assert covered[:, 0, i][:, active].mean() >= 0.9
