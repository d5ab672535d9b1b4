"""Kriging and decomposition of one response, levelone beside its peers: CPU seconds on one thread, Q2, errors of ST.

500 Latin-hypercube points in 14 inputs, the same for all; fit, 2^14 base points (262,144 predictions), indices; Q2 on
10,000 new points is not timed. ``pytest benchmarks/test_kriging_peers.py -s``; some minutes. The ratios belong to one
run on one machine; a peer that is not installed is left out with its name.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from exact_functions import FUNCTIONS, NEW, SPACE, K, exact
from levelone.uncertainty import Kriging, latin_hypercube, sobol, sobol_design
from levelone.uncertainty.pce import PolynomialChaos

RUNS, BASE, SEED = 500, 2**14, 0
# Rows that a peer predicts at once: more, and its arrays leave the cache and then the memory.
ROWS = 4096


@dataclass(frozen=True)
class Line:
    """What one program cost and what came out."""

    who: str
    cpu: float
    q2: float
    st_error: float


def in_parts(predict):
    """The same prediction in blocks of ROWS."""
    return lambda points: np.concatenate([predict(points[i : i + ROWS]) for i in range(0, len(points), ROWS)])


def levelone(x, y):
    return Kriging.fit(x, y, SEED).predict_mean


def scikit_learn(x, y):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    kernel = ConstantKernel() * Matern(np.ones(K), (1e-2, 1e2), nu=2.5) + WhiteKernel(1e-5, (1e-8, 1.0))
    return in_parts(GaussianProcessRegressor(kernel, normalize_y=True).fit(x, y).predict)


def smt(x, y):
    from smt.surrogate_models import KRG

    # One start of Cobyla: its default, ten starts of TNC, did not end within three minutes.
    model = KRG(corr="matern52", hyper_opt="Cobyla", n_start=1, print_global=False)
    model.set_training_values(x, y)
    model.train()
    return in_parts(lambda points: model.predict_values(points)[:, 0])


def measure(who, build, name, x, y):
    truth, design = FUNCTIONS[name](NEW), sobol_design(SPACE, BASE, 2)
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        start = time.process_time()
        predict = build(x, y)
        indices = sobol(design, predict(design.unit_points))
        cpu = time.process_time() - start
        q2 = 1.0 - np.mean((predict(NEW) - truth) ** 2) / truth.var()
    return Line(who, cpu, q2, np.abs(indices.ST - exact(name, "ST")).max())


def chaos(name, x, y):
    truth = FUNCTIONS[name](NEW)
    with threadpool_limits(1):
        start = time.process_time()
        model = PolynomialChaos.fit(x, y, SEED)
        cpu = time.process_time() - start
        q2 = 1.0 - np.mean((model.predict_mean(NEW) - truth) ** 2) / truth.var()
    return Line("levelone, polynomial chaos", cpu, q2, np.abs(model.ST - exact(name, "ST")).max())


def dakota(name, x, y):
    from dakota_route import surfpack_vbd

    found = surfpack_vbd(x, y, base_points=BASE)
    return Line("Dakota, surfpack", found["cpu"], np.nan, np.abs(np.array(found["ST"]) - exact(name, "ST")).max())


def peers(name, x, y):
    """A line for each peer that is installed; one that is not is named."""
    import importlib.util

    for who, module, call in (
        ("scikit-learn, one start", "sklearn", lambda: measure("scikit-learn, one start", scikit_learn, name, x, y)),
        ("SMT KRG, one start", "smt", lambda: measure("SMT KRG, one start", smt, name, x, y)),
        ("Dakota, surfpack", "dakota", lambda: dakota(name, x, y)),
    ):
        if importlib.util.find_spec(module) is None:
            print(f"{name}: {who} is not installed and left out")
        else:
            yield call()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_kriging_beside_its_peers(capsys, name):
    x = latin_hypercube(SPACE, RUNS, SEED).unit_points
    y = FUNCTIONS[name](x)
    with capsys.disabled():
        own = measure("levelone", levelone, name, x, y)
        print(f"\n{name}: {own.who:26s} {own.cpu:6.1f} CPU s, Q2 {own.q2:.4f}, largest ST error {own.st_error:.4f}")
        for line in [chaos(name, x, y), *peers(name, x, y)]:
            print(
                f"{name}: {line.who:26s} {line.cpu:6.1f} CPU s, Q2 {line.q2:.4f}, largest ST error {line.st_error:.4f}; "
                f"CPU over levelone's Kriging {line.cpu / own.cpu:.1f}"
            )
