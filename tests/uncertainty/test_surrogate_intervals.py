from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from uncertainty_functions import unit_space

from levelone.errors import InputError
from levelone.uncertainty import (
    EstimateStatus,
    Factor,
    FactorSpace,
    Kriging,
    Uniform,
    latin_hypercube,
    sobol,
    sobol_design,
    stage_seed,
    surrogate_intervals,
)
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.groups_out import random_groups
from levelone.uncertainty.surrogate_intervals import GROUP_POINTS, GROUPS, sobol_on_surrogate

A = np.array([0.0, 1.0, 4.5, 9.0, 99.0])


def product(u):
    """Sobol's function of five inputs."""
    return np.prod((np.abs(4.0 * u - 2.0) + A) / (1.0 + A), axis=1)


def truth():
    """S1 and ST in closed form: V_j = 1/3 / (1 + a_j)^2, V = prod(1 + V_j) - 1."""
    part = 1.0 / (3.0 * (1.0 + A) ** 2)
    variance = np.prod(1.0 + part) - 1.0
    return np.array([part, part * np.prod(1.0 + part) / (1.0 + part)]) / variance


@pytest.fixture(autouse=True)
def always_drawn(monkeypatch):
    """Functions are drawn also where the worst case of the surrogate would be minor."""
    monkeypatch.setattr(surrogate_intervals, "MINOR", -1.0)
    monkeypatch.setattr(surrogate_intervals, "NEGLIGIBLE", -1.0)


@pytest.fixture(scope="module")
def case():
    space = unit_space(3)
    runs = latin_hypercube(space, 40, 1)
    y = np.sin(4.0 * runs.points[:, 0]) + runs.points[:, 1] ** 2 + 0.3 * runs.points[:, 0] * runs.points[:, 2]
    return runs.unit_points, y, Kriging.fit(runs.unit_points, y, 0, starts=2), sobol_design(space, 256, 5)


def test_intervals_cover_the_truth(monkeypatch):
    """40 repetitions at 100 runs, inputs of an index of at least 0.01; half the draws of a study, to save time.

    If each interval covered with probability 0.9, and the 7 of a repetition were right or wrong together, a share of 30/40 or less
    would come up in 0.5 % of the cases (binomial). The plain bootstrap covers two thirds here."""
    monkeypatch.setattr(surrogate_intervals, "DRAWS", 10)
    space, exact = unit_space(5), truth()
    active = exact >= 0.01
    design = sobol_design(space, 1024, 9)
    covered, plain = [], []
    for seed in range(40):
        x = latin_hypercube(space, 100, seed).unit_points
        y = product(x)
        model = Kriging.fit(x, y, seed, correlation="matern52", starts=2)
        found = sobol_on_surrogate(x, y, model, design, seed, bootstrap=50)
        ci, sampling = np.array([found.S1_ci, found.ST_ci]), np.array([found.S1_ci_sampling, found.ST_ci_sampling])
        covered.append(((ci[..., 0] <= exact) & (exact <= ci[..., 1]))[active])
        plain.append(((sampling[..., 0] <= exact) & (exact <= sampling[..., 1]))[active])
    assert active.sum() == 7
    assert np.mean(covered) > 30 / 40
    assert np.mean(plain) < np.mean(covered) - 0.1


def test_the_estimate_is_that_of_the_mean_and_the_intervals_hold_those_of_sampling(case):
    x, y, model, design = case
    found = sobol_on_surrogate(x, y, model, design, 3, bootstrap=100)
    plain = sobol(design, model.predict_mean(design.unit_points), bootstrap=100)
    given = sobol_on_surrogate(x, y, model, design, 3, sampled=plain)
    for index in ("S1", "ST"):
        np.testing.assert_array_equal(getattr(found, index), getattr(plain, index))
        np.testing.assert_array_equal(getattr(given, f"{index}_ci"), getattr(found, f"{index}_ci"))
        sampling, ci = getattr(found, f"{index}_ci_sampling"), getattr(found, f"{index}_ci")
        np.testing.assert_array_equal(sampling, getattr(plain, f"{index}_ci"))
        shifted = getattr(found, index) + getattr(found, f"{index}_shift")
        assert (ci[:, 0] < sampling[:, 0]).all()
        assert (ci[:, 1] > sampling[:, 1]).all()
        assert ((ci[:, 0] < shifted) & (shifted < ci[:, 1])).all()


@pytest.mark.theory
def test_intervals_hold_the_jackknife_by_refits(case):
    """The interval is no narrower than 1.96 standard deviations of the grouped jackknife, from models conditioned anew."""
    x, y, model, design = case
    ends = np.vstack([np.zeros(3), np.ones(3), x[2:]])  # ranges of exactly one
    model = Kriging.condition(ends, y, model.lengths, model.nugget, correlation=model.correlation)
    seed = 3
    found = sobol_on_surrogate(ends, y, model, design, seed, bootstrap=100)
    small = sobol_design(design.space, GROUP_POINTS, stage_seed(seed, f"{GROUP_POINTS} points of the surrogate"))
    groups = random_groups(40, GROUPS, np.random.default_rng(stage_seed(seed, "groups left out")))
    refits = []
    for group in groups:
        kept = np.setdiff1d(np.arange(40), group)
        lengths = model.lengths / np.ptp(ends[kept], axis=0)  # in units of the range of the runs kept, which may be smaller
        refit = Kriging.condition(ends[kept], y[kept], lengths, model.nugget, correlation=model.correlation)
        indices = sobol(small, refit.predict_mean(small.unit_points), bootstrap=2)
        refits.append([indices.S1, indices.ST])
    jackknife = np.sqrt((GROUPS - 1) * np.var(refits, axis=0))
    for index, ci, std in ((found.S1, found.S1_ci, jackknife[0]), (found.ST, found.ST_ci, jackknife[1])):
        assert (index - ci[:, 0] >= 1.9599 * std * (1.0 - 1e-6)).all()
        assert (ci[:, 1] - index >= 1.9599 * std * (1.0 - 1e-6)).all()


def test_threads_change_no_digit(case, monkeypatch):
    """Few draws: on 40 runs two threads pass the interpreter to and fro for most of the time."""
    monkeypatch.setattr(surrogate_intervals, "DRAWS", 2)
    x, y, model, design = case

    def run(seed):
        found = sobol_on_surrogate(x, y, model, design, seed, bootstrap=50)
        return np.array([found.S1_ci, found.ST_ci])

    alone = run(4)
    with OneBlasThread(), ThreadPoolExecutor(2) as pool:
        first, second = pool.map(run, [4, 5])
    np.testing.assert_array_equal(alone, first)
    assert np.abs(first - second).max() > 1e-6


def test_groups_and_second_order_have_their_own_columns(case):
    x, y, model, design = case
    grouped = sobol_design(design.space, 64, 5, groups={"one": ["x1", "x2"], "other": ["x3"]})
    found = sobol_on_surrogate(x, y, model, grouped, 3, bootstrap=50)
    assert found.names == ("one", "other")
    assert found.ST_ci.shape == (2, 2)
    pairs = sobol_on_surrogate(x, y, model, sobol_design(design.space, 64, 5, second_order=True), 3, bootstrap=50)
    assert np.isfinite(pairs.sampled.S2[0, 2])
    assert (pairs.S1_ci[:, 0] < pairs.S1).all()


def test_a_model_of_physical_points_is_asked_at_physical_points():
    space = FactorSpace([Factor("a", Uniform(2.0, 5.0)), Factor("b", Uniform(-1.0, 9.0))])
    runs, design = latin_hypercube(space, 30, 1), sobol_design(space, 64, 5)
    y = runs.points[:, 0] ** 2 + runs.points[:, 1]
    model = Kriging.fit(runs.points, y, 0, starts=2)
    found = sobol_on_surrogate(runs.points, y, model, design, 3, coordinates="physical", bootstrap=50)
    np.testing.assert_array_equal(found.S1, sobol(design, model.predict_mean(design.points), bootstrap=50).S1)
    assert abs(found.S1.sum() - 1.0) < 0.1


def test_a_constant_response_and_too_few_runs_are_undefined():
    space = unit_space(3)
    x, design = latin_hypercube(space, 12, 1).unit_points, sobol_design(space, 16, 5)
    constant = sobol_on_surrogate(x, np.ones(12), Kriging.fit(x, np.ones(12), 0), design, 0)
    assert constant.status is EstimateStatus.CONSTANT_RESPONSE
    rough = np.sin(40.0 * x[:, 0])
    for runs, trend in ((2, "constant"), (7, "linear")):
        model = Kriging.fit(x[:runs], rough[:runs], 0, starts=1, trend=trend)
        few = sobol_on_surrogate(x[:runs], rough[:runs], model, design, 0)
        assert few.status is EstimateStatus.TOO_FEW_RUNS
        for result in (constant, few):
            numbers = [result.S1, result.ST_ci, result.S1_ci_sampling, result.ST_shift, result.inflation, result.acceptance]
            assert all(np.isnan(number).all() for number in numbers)


def test_bad_input_is_refused(case):
    x, y, model, design = case
    with pytest.raises(InputError, match="not the 40 runs"):
        sobol_on_surrogate(x[:-1], y[:-1], model, design, 0)
    with pytest.raises(InputError, match="not the 40 runs"):
        sobol_on_surrogate(x, y + 1.0, model, design, 0)
    other = sobol(sobol_design(design.space, 16, 5), np.arange(16.0 * 5), bootstrap=10)
    with pytest.raises(InputError, match="16 base points"):
        sobol_on_surrogate(x, y, model, design, 0, sampled=other)
    with pytest.raises(InputError, match="physical"):
        sobol_on_surrogate(x, y, model, design, 0, coordinates="phyiscal")
    with pytest.raises(InputError, match="sobol design is needed"):
        sobol_on_surrogate(x, y, model, latin_hypercube(design.space, 10, 0), 0)
