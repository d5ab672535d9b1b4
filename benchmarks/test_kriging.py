"""Kriging of 500 points in 14 inputs and Sobol indices on it, beside scikit-learn: CPU seconds, Q2, errors of ST.

``pytest benchmarks/test_kriging.py -s``; leave the peer out with ``-k "not scikit_learn"``.
"""

from __future__ import annotations

import time
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest

from levelone.uncertainty import (
    Factor,
    FactorSpace,
    Kriging,
    Uniform,
    fit_all,
    latin_hypercube,
    predict_all,
    sobol,
    sobol_design,
)

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "tests" / "reference" / "uncertainty.toml").read_text(encoding="utf-8"))
K = 14
SPACE = FactorSpace([Factor(f"x{j + 1}", Uniform(0.0, 1.0)) for j in range(K)])
NEW = np.random.default_rng(99).random((10_000, K))


def ishigami(u):
    x = np.pi * (2.0 * u - 1.0)
    a, b = REFERENCE["ishigami"]["a"], REFERENCE["ishigami"]["b"]
    return np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])


def sobol_g(u):
    a = np.array(REFERENCE["sobol_g"]["a"])
    return np.prod((np.abs(4.0 * u - 2.0) + a) / (1.0 + a), axis=1)


FUNCTIONS = {"ishigami": ishigami, "sobol_g": sobol_g}


def exact_st(name):
    listed = REFERENCE[name]["ST"]
    return np.array(listed + [0.0 if name == "ishigami" else listed[-1]] * (K - len(listed)))


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
    error = np.abs(indices.ST - exact_st(name)).max()
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


@pytest.mark.parametrize("name", FUNCTIONS)
def test_scikit_learn_one_start(benchmark, capsys, name):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
    from threadpoolctl import threadpool_limits

    design = latin_hypercube(SPACE, 500, 0)
    kernel = ConstantKernel() * Matern(np.ones(K), (1e-2, 1e2), nu=2.5) + WhiteKernel(1e-5, (1e-8, 1.0))
    model = GaussianProcessRegressor(kernel, normalize_y=True)
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore")
        start = time.process_time()
        benchmark.pedantic(model.fit, args=(design.unit_points, FUNCTIONS[name](design.points)), rounds=1)
        fit = time.process_time() - start

        def predict(points):
            return np.concatenate([model.predict(part) for part in np.array_split(points, max(1, len(points) // 5000))])

        with capsys.disabled():
            report("scikit-learn", name, 0, fit, predict(NEW), predict)


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
