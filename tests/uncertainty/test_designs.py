from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import unit_space

from levelone.errors import InputError
from levelone.uncertainty import (
    Discrete,
    Factor,
    FactorSpace,
    Normal,
    TruncatedNormal,
    Uniform,
    latin_hypercube,
    morris_design,
    sobol_design,
)


@given(k=st.integers(1, 8), trajectories=st.integers(1, 12), half=st.integers(1, 4), seed=st.integers(0, 2**32))
def test_each_morris_step_moves_one_factor_by_delta_and_each_factor_moves_once(k, trajectories, half, seed):
    levels = 2 * half
    design = morris_design(unit_space(k), trajectories, levels, seed)
    assert design.points.shape == (trajectories * (k + 1), k)
    grid = design.points * (levels - 1)
    np.testing.assert_allclose(grid, np.round(grid), atol=1e-12)
    assert ((design.points >= 0.0) & (design.points <= 1.0)).all()
    steps = np.diff(design.points.reshape(trajectories, k + 1, k), axis=1)
    delta = levels / (2.0 * (levels - 1))
    np.testing.assert_allclose(np.sort(np.abs(steps), axis=2)[:, :, -1], delta)
    assert ((np.abs(steps) > 1e-12).sum(axis=2) == 1).all()
    assert ((np.abs(steps) > 1e-12).sum(axis=1) == 1).all()


def test_morris_levels_directions_and_orders_are_equally_likely():
    k, trajectories = 3, 6000
    design = morris_design(unit_space(k), trajectories, 4, 1)
    blocks = design.points.reshape(trajectories, k + 1, k)
    level = np.round(blocks[:, 0] * 3).astype(int)
    steps = np.diff(blocks, axis=1)
    order = np.abs(steps).argmax(axis=2) @ [9, 3, 1]
    tolerance = 5.0 * np.sqrt(0.25 / trajectories)
    for j in range(k):
        np.testing.assert_allclose(np.bincount(level[:, j], minlength=4) / trajectories, 0.25, atol=tolerance)
        assert (steps[:, :, j].sum(axis=1) > 0).mean() == pytest.approx(0.5, abs=tolerance)
    np.testing.assert_allclose(np.unique(order, return_counts=True)[1] / trajectories, 1.0 / 6.0, atol=tolerance)


def test_a_discrete_factor_moves_by_half_of_its_probability():
    space = FactorSpace([Factor("n", Discrete((2.0, 5.0))), Factor("m", Discrete((1.0, 2.0, 3.0, 4.0)))])
    design = morris_design(space, 50, 4, 3)
    steps = np.abs(np.diff(design.points.reshape(50, 3, 2), axis=1)).sum(axis=1)
    np.testing.assert_array_equal(steps[:, 0], 3.0)
    np.testing.assert_array_equal(steps[:, 1], 2.0)
    np.testing.assert_array_equal(space.transform(design.unit_points), design.points)


def test_morris_refuses_unbounded_factors_and_takes_truncated_ones():
    unbounded = FactorSpace([Factor("mass", Uniform(1.0, 2.0)), Factor("delay", Normal(0.0, 1.0))])
    with pytest.raises(InputError, match=r"factor delay: .*Normal.*truncation"):
        morris_design(unbounded, 4, 4, 0)
    bounded = FactorSpace([Factor("delay", TruncatedNormal(0.0, 1.0, -2.0, 2.0))])
    assert np.abs(morris_design(bounded, 20, 4, 0).points).max() == 2.0


@given(n=st.integers(1, 60), k=st.integers(1, 6), seed=st.integers(0, 2**32))
def test_a_latin_hypercube_has_one_point_in_each_cell(n, k, seed):
    design = latin_hypercube(unit_space(k), n, seed)
    cells = np.floor(design.points * n).astype(int)
    np.testing.assert_array_equal(np.sort(cells, axis=0), np.tile(np.arange(n)[:, None], (1, k)))


@settings(max_examples=20)
@given(k=st.integers(1, 6), power=st.integers(1, 6), seed=st.integers(0, 2**32))
def test_a_pick_freeze_block_holds_a_then_one_coordinate_of_b_each_then_b(k, power, seed):
    n = 2**power
    design = sobol_design(unit_space(k), n, seed)
    assert design.points.shape == (n * (k + 2), k)
    blocks = design.unit_points.reshape(n, k + 2, k)
    a, b = blocks[:, 0], blocks[:, -1]
    for j in range(k):
        mixed = a.copy()
        mixed[:, j] = b[:, j]
        np.testing.assert_array_equal(blocks[:, 1 + j], mixed)
    for half in (a, b):
        cells = np.floor(half * n).astype(int)
        np.testing.assert_array_equal(np.sort(cells, axis=0), np.tile(np.arange(n)[:, None], (1, k)))


def test_half_of_a_sobol_design_is_the_smaller_design():
    small, large = sobol_design(unit_space(3), 8, 5), sobol_design(unit_space(3), 16, 5)
    np.testing.assert_array_equal(large.points[: small.runs], small.points)


@pytest.mark.parametrize(
    "build",
    [
        lambda seed: morris_design(unit_space(4), 6, 4, seed),
        lambda seed: latin_hypercube(unit_space(4), 20, seed),
        lambda seed: sobol_design(unit_space(4), 16, seed),
    ],
)
def test_a_design_is_its_seed_and_cannot_be_written_to(build):
    np.testing.assert_array_equal(build(7).points, build(7).points)
    assert not np.array_equal(build(7).points, build(8).points)
    with pytest.raises(ValueError, match="read-only"):
        build(7).points[0, 0] = 0.5


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda s: morris_design(s, 0, 4, 0), "trajectories"),
        (lambda s: morris_design(s, 4, 5, 0), "5 is odd"),
        (lambda s: morris_design(s, 4, 4, -1), "seed"),
        (lambda s: latin_hypercube(s, 2.5, 0), "whole number"),
        (lambda s: sobol_design(s, 100, 0), "the nearest are 64 and 128"),
        (lambda s: latin_hypercube(s, 4, 0).require("sobol"), "this one is latin_hypercube"),
    ],
)
def test_wrong_sizes_are_refused(build, words):
    with pytest.raises(InputError, match=words):
        build(unit_space(2))
