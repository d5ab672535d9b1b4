"""From physical values to the unit cube, and from points to the design that they are."""

from __future__ import annotations

import numpy as np
import pytest
from dakota_cases import ISHIGAMI, MIXED
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.campaign.dakota.coordinates import unit_points
from levelone.campaign.dakota.recognise import recognise
from levelone.campaign.dakota.trajectories import doubt_of_trajectories
from levelone.errors import InputError
from levelone.uncertainty import Factor, FactorSpace, Normal, Uniform, latin_hypercube, morris_design, sobol_design

CONTINUOUS = [j for j, name in enumerate(MIXED.names) if name != "d"]


def as_written(x: np.ndarray) -> np.ndarray:
    """Numbers as Dakota writes them, with 16 digits."""
    return np.array([[float(f"{value:.15e}") for value in row] for row in x])


def in_dakotas_order(design) -> np.ndarray:
    """The points of a pick-freeze design in the blocks of Dakota's decomposition."""
    k = len(design.space)
    blocks = design.points.reshape(design.base, k + 2, k)
    return np.concatenate([blocks[:, at] for at in (k + 1, 0, *range(1, k + 1))])


@settings(max_examples=30)
@given(st.integers(0, 2**31))
def test_unit_coordinates_undo_the_map_to_physical_values(seed: int) -> None:
    u = np.random.default_rng(seed).random((20, len(MIXED)))
    found = unit_points(MIXED, MIXED.transform(u))
    np.testing.assert_allclose(found[:, CONTINUOUS], u[:, CONTINUOUS], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(MIXED.transform(found)[:, MIXED.index("d")], MIXED.transform(u)[:, MIXED.index("d")])


def test_unit_coordinates_of_a_normal_factor() -> None:
    space = FactorSpace([Factor("a", Normal(3.0, 2.0))])
    # 0.975 is the share of a normal variable below its mean plus 1.959964 standard deviations
    np.testing.assert_allclose(unit_points(space, [[3.0], [3.0 + 2.0 * 1.959964]]), [[0.5], [0.975]], atol=1e-7)


def test_a_value_outside_its_support_names_run_and_factor() -> None:
    x = ISHIGAMI.transform(np.full((3, 3), 0.5))
    x[1, 2] = 4.0
    with pytest.raises(InputError, match=r"factor x3: run 2 has 4"):
        unit_points(ISHIGAMI, x)
    x = MIXED.transform(np.full((3, 6), 0.5))
    x[2, 1] = 0.7
    with pytest.raises(InputError, match=r"factor d: run 3 has 0\.7; allowed: 0, 0\.5, 2"):
        unit_points(MIXED, x)


@pytest.mark.parametrize("levels", [2, 4, 6, 10])
def test_trajectories_are_recognised_with_their_levels(levels: int) -> None:
    design = morris_design(ISHIGAMI, 5, levels, 3)
    found = recognise(ISHIGAMI, as_written(design.points), ISHIGAMI.names, 0)
    assert (found.layout, found.design.levels, found.design.base) == ("morris", levels, 5)
    np.testing.assert_allclose(found.design.unit_points, design.unit_points, atol=1e-14)


@pytest.mark.parametrize(("trajectories", "levels"), [(12, 4), (100, 4), (30, 2), (20, 6)])
def test_trajectories_drawn_at_random_raise_no_doubt(trajectories: int, levels: int) -> None:
    assert [doubt_of_trajectories(morris_design(ISHIGAMI, trajectories, levels, seed)) for seed in range(10)] == [""] * 10


def test_trajectories_at_the_ends_of_the_ranges_do() -> None:
    design = morris_design(ISHIGAMI, 200, 4, 3)
    unit = design.unit_points.reshape(200, 4, 3)
    resting, ends = np.diff(unit, axis=1) == 0.0, (unit == 0.0) | (unit == 1.0)
    chosen = np.flatnonzero((resting & ends[:, :-1]).sum(axis=(1, 2)) >= 4)  # of six
    rows = design.points.reshape(200, 4, 3)[chosen].reshape(-1, 3)
    found = recognise(ISHIGAMI, rows, ISHIGAMI.names, 0)
    assert "in place of 50%" in doubt_of_trajectories(found.design)


@pytest.mark.parametrize("order", [("x1", "x2", "x3"), ("x3", "x1", "x2")])
def test_a_decomposition_is_recognised_in_the_order_of_the_file(order: tuple[str, ...]) -> None:
    design = sobol_design(ISHIGAMI, 16, 3)
    rows = in_dakotas_order(design).reshape(5, 16, 3)
    rows = rows[[0, 1, *(2 + ISHIGAMI.index(name) for name in order)]].reshape(-1, 3)
    found = recognise(ISHIGAMI, as_written(rows), order, 0)
    assert (found.layout, found.design.base, found.design.block) == ("sobol", 16, 5)
    np.testing.assert_allclose(found.design.points, design.points, rtol=1e-14, atol=1e-14)
    np.testing.assert_array_equal(as_written(rows)[found.order], found.design.points)


def test_a_decomposition_in_an_order_that_is_not_the_files_is_none() -> None:
    rows = in_dakotas_order(sobol_design(ISHIGAMI, 16, 3))
    assert recognise(ISHIGAMI, rows, ("x3", "x1", "x2"), 0).layout == "other"


@pytest.mark.parametrize("spoil", ["cut", "shuffled", "one point"])
def test_a_design_that_is_not_whole_is_no_sample_either(spoil: str) -> None:
    rows = in_dakotas_order(sobol_design(ISHIGAMI, 16, 3))
    if spoil == "cut":
        rows = rows[:-7]
    elif spoil == "shuffled":
        rows = np.random.default_rng(0).permutation(rows)
    else:
        rows[40, 1] += 1e-6
    assert recognise(ISHIGAMI, rows, ISHIGAMI.names, 0).layout == "other"
    trajectories = morris_design(ISHIGAMI, 5, 4, 3).points
    assert recognise(ISHIGAMI, trajectories[:-1], ISHIGAMI.names, 0).layout == "other"


def test_a_latin_hypercube_is_a_sample_also_with_discrete_factors() -> None:
    for space in (ISHIGAMI, MIXED):
        found = recognise(space, latin_hypercube(space, 30, 1).points, space.names, 0)
        assert found.layout == "sample"
        np.testing.assert_array_equal(found.order, np.arange(30))


def test_correlated_factors_have_no_design_that_moves_one_of_them() -> None:
    rows = in_dakotas_order(sobol_design(ISHIGAMI, 16, 3))
    correlated = FactorSpace(
        [Factor(f.name, Uniform(*f.distribution.support)) for f in ISHIGAMI.factors], np.eye(3) + 0.3 * (1 - np.eye(3))
    )
    assert recognise(correlated, rows, correlated.names, 0).layout == "other"
