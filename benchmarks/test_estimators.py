"""Sensitivity measures beside one another on test functions of 14 inputs: errors, coverage of the intervals, peers.

``pytest benchmarks/test_estimators.py -s``; about two minutes. Errors are root mean squares over repetitions.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.stats import ks_2samp

from exact_functions import REFERENCE, SPACE, K, exact, ishigami, sobol_g
from levelone.uncertainty import Factor, FactorSpace, Normal, morris, morris_design
from levelone.uncertainty.dgsm import derivative_design, derivative_measures
from levelone.uncertainty.given_data import given_data
from levelone.uncertainty.hsic import dependence
from levelone.uncertainty.morris_designs import radial_design
from levelone.uncertainty.shapley import shapley, shapley_design

NAMES = list(SPACE.names)


def exact_shapley(name):
    if name == "ishigami":
        return 0.5 * (exact(name, "S1") + exact(name, "ST"))
    part = 1.0 / 3.0 / (1.0 + np.array(REFERENCE["sobol_g"]["a"])) ** 2
    effect = np.zeros(K)
    for j in range(K):
        orders = np.array([1.0])
        for i in range(K):
            if i != j:
                orders = np.convolve(orders, [1.0, part[i]])
        effect[j] = part[j] * np.sum(orders / np.arange(1, K + 1))
    return effect / (np.prod(1.0 + part) - 1.0)


FUNCTIONS = {"ishigami": (ishigami, 3), "sobol_g": (sobol_g, 4)}
CASES = pytest.mark.parametrize("name", FUNCTIONS)


def line(who, name, errors, inside=None, widths=None):
    """Print one line: errors [repetitions, active], shares of intervals that hold the truth, median widths over 4 deviations."""
    text = f"{who:34s} {name:9s} rms error " + " ".join(f"{e:.4f}" for e in np.sqrt(np.mean(np.square(errors), axis=0)))
    if inside is not None:
        text += "  coverage " + " ".join(f"{c:.2f}" for c in np.mean(inside, axis=0))
        spread = 2.0 * 1.96 * np.std(errors, axis=0)
        text += "  width / (3.92 s) " + " ".join(f"{w:.2f}" for w in np.median(widths, axis=0) / spread)
    print(text)


def holds(ci, truth):
    return (ci[:, 0] <= truth) & (truth <= ci[:, 1])


@CASES
@pytest.mark.parametrize(("n", "scramblings"), [(64, 8), (128, 16)])
def test_shapley_effects_of_independent_factors(name, n, scramblings):
    function, active = FUNCTIONS[name]
    truth = exact_shapley(name)[:active]
    errors, inside, widths = [], [], []
    for seed in range(60):
        design = shapley_design(SPACE, n, seed, scramblings=scramblings)
        result = shapley(design, function(design.points))
        errors.append(result.Sh[:active] - truth)
        inside.append(holds(result.Sh_ci[:active], truth))
        widths.append(np.diff(result.Sh_ci[:active])[:, 0])
    line(f"Shapley effects, {design.runs} runs", name, errors, inside, widths)
    assert np.mean(inside) > 0.9


def test_shapley_effects_of_correlated_factors():
    """A sum of two equal normal variables of correlation r and a third one: shares (1 + r) / (3 + 2 r), twice, and the rest."""
    r = 0.8
    rank = np.eye(3)
    rank[0, 1] = rank[1, 0] = 6.0 / np.pi * np.arcsin(0.5 * r)
    space = FactorSpace([Factor(name, Normal(0.0, 1.0)) for name in "abc"], correlation=rank)
    truth = np.array([1.0 + r, 1.0 + r, 1.0]) / (3.0 + 2.0 * r)
    errors, inside, widths = [], [], []
    for seed in range(60):
        design = shapley_design(space, 64, seed)
        result = shapley(design, design.points.sum(axis=1))
        errors.append(result.Sh - truth)
        inside.append(holds(result.Sh_ci, truth))
        widths.append(np.diff(result.Sh_ci)[:, 0])
    line(f"Shapley effects, {design.runs} runs", "linear", errors, inside, widths)
    assert np.mean(inside) > 0.9


@CASES
@pytest.mark.parametrize("n", [100, 500, 2000])
def test_first_order_indices_of_a_given_sample(name, n):
    function, active = FUNCTIONS[name]
    truth = exact(name, "S1")
    errors, inside, widths = [], [], []
    for seed in range(60):
        u = np.random.default_rng([seed, n]).random((n, K))
        result = given_data(u, function(u), NAMES)
        errors.append(result.S1 - truth)
        inside.append(holds(result.S1_ci, truth))
        widths.append(np.diff(result.S1_ci)[:, 0])
    shown = [j for j in range(active) if truth[j] > 0.0]
    errors, inside, widths = (np.array(item) for item in (errors, inside, widths))
    line(f"given data, {n} runs", name, errors[:, shown], inside[:, shown], widths[:, shown])
    print(f"{'':34s} inert inputs: rms error {np.sqrt(np.mean(errors[:, active:] ** 2)):.4f}")
    assert inside[:, shown].mean() > 0.9


@CASES
def test_rank_estimator_and_rbd_fast_on_the_same_samples(name):
    ot = pytest.importorskip("openturns", reason="OpenTURNS is not installed")
    salib = pytest.importorskip("SALib.analyze.rbd_fast", reason="SALib is not installed")
    function, active = FUNCTIONS[name]
    truth = exact(name, "S1")
    ranked, periodic = [], []
    problem = {"num_vars": K, "names": NAMES, "bounds": [[0.0, 1.0]] * K}
    for seed in range(60):
        u = np.random.default_rng([seed, 500]).random((500, K))
        values = function(u)
        peer = ot.RankSobolSensitivityAlgorithm(ot.Sample(u), ot.Sample(values[:, None]))
        ranked.append(np.array(peer.getFirstOrderIndices()) - truth)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            periodic.append(np.asarray(salib.analyze(problem, u, values, num_resamples=2, seed=1)["S1"], dtype=float) - truth)
    shown = [j for j in range(active) if truth[j] > 0.0]
    for who, errors in (("OpenTURNS, ranks, 500 runs", ranked), ("SALib, RBD-FAST, 500 runs", periodic)):
        errors = np.array(errors)
        line(who, name, errors[:, shown])
        print(f"{'':34s} inert inputs: rms error {np.sqrt(np.mean(errors[:, active:] ** 2)):.4f}")


def pawn(u, y):
    return [np.median([ks_2samp(y[part], y).statistic for part in np.array_split(np.argsort(x), 10)]) for x in u.T]


@CASES
def test_ranking_by_dependence_at_500_runs(name):
    function, active = FUNCTIONS[name]
    shown = 3  # the fourth input of G has 1 % of the variance
    right = {"HSIC": 0, "PAWN": 0}
    found = []
    for seed in range(20):
        u = np.random.default_rng([seed, 3]).random((500, K))
        values = function(u)
        result = dependence(u, values, NAMES, 0, permutations=199)
        found.append(result.p_value <= 0.05)
        for who, measure in (("HSIC", result.R2), ("PAWN", np.array(pawn(u, values)))):
            right[who] += list(np.argsort(-measure)[:shown]) == list(np.argsort(-exact(name, "ST"))[:shown])
    print(f"{name:9s} samples of 20 with the first {shown} in the right order: {right}")
    power = np.mean(found, axis=0)
    print(f"{'':9s} HSIC, p <= 0.05: active {np.round(power[:active], 2)}, inert {power[active:].mean():.3f}")


@CASES
def test_bound_of_the_total_index_from_derivatives(name):
    function, active = FUNCTIONS[name]
    for n in (16, 64, 256):
        design = derivative_design(SPACE, n, 1)
        result = derivative_measures(design, function(design.points))
        shown = " ".join(f"{b:.3f}" for b in result.ST_bound[: active + 1])
        true = np.round(exact(name, "ST")[: active + 1], 3)
        print(f"derivatives, {design.runs:5d} runs, {name:9s} bound of ST {shown}   exact {true}")
        if n == 256:
            assert (result.ST_bound_ci[:, 1] >= exact(name, "ST")).all()


@CASES
def test_ranking_by_elementary_effects(name):
    function, active = FUNCTIONS[name]
    order = list(np.argsort(-exact(name, "ST"))[:active])
    builders = {
        "trajectories on 4 levels": lambda r, seed: morris_design(SPACE, r, 4, seed),
        "radial": lambda r, seed: radial_design(SPACE, r, seed),
    }
    for r in (10, 20, 40, 100):
        for who, build in builders.items():
            right, spread = 0, []
            for seed in range(40):
                design = build(r, seed)
                mu_star = morris(design, function(design.points), bootstrap=2).mu_star
                right += list(np.argsort(-mu_star)[:active]) == order
                spread.append(mu_star[:active])
            scatter = np.round(np.std(spread, axis=0) / np.mean(spread, axis=0), 2)
            print(f"{who:25s} r = {r:3d}, {name:9s} order of ST in {right / 40:.2f} of the designs, scatter {scatter}")
