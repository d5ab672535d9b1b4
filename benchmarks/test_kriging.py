"""Kriging of 500 points in 14 inputs and Sobol indices on it: CPU seconds, Q2, errors of ST; the peers have a file of their own.

``pytest benchmarks/test_kriging.py -s``.
"""

from __future__ import annotations

import time

import numpy as np
import pytest

from exact_functions import FUNCTIONS, NEW, SPACE, exact
from levelone.uncertainty import (
    Kriging,
    fit_all,
    latin_hypercube,
    predict_all,
    sobol,
    sobol_design,
)


def report(who, name, seed, fit, mean, predict):
    """Print one line; ``predict(points)`` is the surrogate's mean."""
    truth = FUNCTIONS[name](NEW)
    q2 = 1.0 - np.mean((mean - truth) ** 2) / truth.var()
    design = sobol_design(SPACE, 2**14, 2)
    start = time.process_time()
    values = predict(design.unit_points)
    asked = time.process_time()
    indices = sobol(design, values)
    done = time.process_time()
    error = np.abs(indices.ST - exact(name, "ST")).max()
    print(
        f"\n{who:12s} {name:9s} seed {seed}: fit {fit:5.2f} CPU s, Q2 {q2:.4f}, {design.runs} predictions "
        f"{asked - start:4.2f} CPU s, indices {done - asked:4.2f} CPU s, largest ST error {error:.4f}"
    )


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_levelone(benchmark, capsys, name, seed):
    design = latin_hypercube(SPACE, 500, seed)
    values = FUNCTIONS[name](design.points)
    start = time.process_time()
    model = benchmark.pedantic(Kriging.fit, args=(design.unit_points, values, seed), rounds=1)
    fit = time.process_time() - start
    with capsys.disabled():
        report("levelone", name, seed, fit, model.predict_mean(NEW), model.predict_mean)


def test_eight_responses_side_by_side(benchmark, capsys):
    design = latin_hypercube(SPACE, 500, 0)
    values = np.column_stack([FUNCTIONS[name](design.points) for name in FUNCTIONS] * 4)
    points = sobol_design(SPACE, 2**14, 2).unit_points
    start, wall = time.process_time(), time.perf_counter()
    models = benchmark.pedantic(fit_all, args=(design.unit_points, values, 0), rounds=1)
    fitted, fit_wall = time.process_time(), time.perf_counter()
    predict_all(models, points)
    with capsys.disabled():
        print(
            f"\n8 responses: fits {fitted - start:.1f} CPU s in {fit_wall - wall:.1f} s; {points.shape[0]} predictions of "
            f"each {time.process_time() - fitted:.1f} CPU s in {time.perf_counter() - fit_wall:.1f} s"
        )
