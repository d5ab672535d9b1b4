"""Polynomial chaos of 14 inputs: CPU seconds, Q2 said and true, errors and coverage of the indices, OpenTURNS beside.

``pytest benchmarks/test_pce.py -s``; a minute.
"""

from __future__ import annotations

import importlib.util
import time

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from exact_functions import FUNCTIONS, NEW, SPACE, K, exact
from levelone.uncertainty import latin_hypercube
from levelone.uncertainty.pce import PolynomialChaos

REPETITIONS = {100: 50, 200: 30, 500: 10}


def true_q2(name, mean):
    truth = FUNCTIONS[name](NEW)
    return 1.0 - np.mean((mean - truth) ** 2) / truth.var()


@pytest.mark.parametrize("runs", REPETITIONS)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_levelone(capsys, name, runs):
    truth, rows = exact(name, "ST"), []
    active = truth > 0.005
    for seed in range(REPETITIONS[runs]):
        x = latin_hypercube(SPACE, runs, seed).unit_points
        y = FUNCTIONS[name](x)
        start = time.process_time()
        model = PolynomialChaos.fit(x, y, seed)
        cpu = time.process_time() - start
        inside = (model.ST_ci[:, 0] <= truth) & (truth <= model.ST_ci[:, 1])
        width = np.median(np.diff(model.ST_ci[active], axis=1))
        error = np.abs(model.ST - truth).max()
        rows.append([cpu, model.q2, model.q2_loo, true_q2(name, model.predict_mean(NEW)), error, inside[active].mean(), width])
    cpu, q2, loo, true, error, inside, width = np.array(rows).T
    with capsys.disabled():
        print(
            f"\n{name} {runs} runs: {np.median(cpu):.2f} CPU s, Q2 held-out {np.median(q2):.4f}, "
            f"leave-one-out {np.median(loo):.4f}, true {np.median(true):.4f}; largest ST error {np.median(error):.4f}; "
            f"intervals of active ST hold the truth {inside.mean():.3f}, median width {np.median(width):.4f}"
        )


@pytest.mark.parametrize("name", FUNCTIONS)
def test_openturns_with_a_selection_of_its_own(capsys, name):
    if importlib.util.find_spec("openturns") is None:
        pytest.skip("OpenTURNS is not installed")
    import openturns as ot

    x = latin_hypercube(SPACE, 500, 0).unit_points
    inputs = ot.JointDistribution([ot.Uniform(0.0, 1.0)] * K)
    numbering = ot.HyperbolicAnisotropicEnumerateFunction(K, 0.5)
    basis = ot.OrthogonalProductPolynomialFactory([ot.LegendreFactory()] * K, numbering)
    size = numbering.getBasisSizeFromTotalDegree(10)
    selection = ot.LeastSquaresMetaModelSelectionFactory(ot.LARS(), ot.CorrectedLeaveOneOut())
    with threadpool_limits(1), capsys.disabled():
        start = time.process_time()
        sample = (ot.Sample(x), ot.Sample(FUNCTIONS[name](x)[:, None]))
        algorithm = ot.FunctionalChaosAlgorithm(*sample, inputs, ot.FixedStrategy(basis, size), ot.LeastSquaresStrategy(selection))
        algorithm.run()
        result = algorithm.getResult()
        cpu = time.process_time() - start
        mean = np.array(result.getMetaModel()(ot.Sample(NEW))).ravel()
        shares = ot.FunctionalChaosSobolIndices(result)
        error = np.abs([shares.getSobolTotalIndex(j) for j in range(K)] - exact(name, "ST")).max()
        print(
            f"\n{name} 500 runs, OpenTURNS LARS, {size} candidates: {cpu:.1f} CPU s, {len(result.getIndices())} terms, "
            f"Q2 true {true_q2(name, mean):.4f}, largest ST error {error:.4f}"
        )
