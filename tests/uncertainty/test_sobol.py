from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncertainty_functions import REFERENCE, exact, ishigami, sobol_g, unit_space

from levelone.errors import InputError
from levelone.uncertainty import EstimateStatus, FactorSpace, latin_hypercube, sobol, sobol_design


@pytest.mark.oracle
@pytest.mark.parametrize(("function", "k"), [(ishigami, 3), (ishigami, 6), (sobol_g, 14)])
def test_agrees_with_salib_on_the_same_points(function, k):
    from SALib.analyze import sobol as salib

    design = sobol_design(unit_space(k), 256, 4)
    values = 50.0 + function(design.points)
    problem = {"num_vars": k, "names": list(design.names), "bounds": [[0.0, 1.0]] * k}
    theirs = salib.analyze(problem, values, calc_second_order=False, seed=1)
    ours = sobol(design, values)
    np.testing.assert_allclose(ours.S1, theirs["S1"], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(ours.ST, theirs["ST"], rtol=1e-10, atol=1e-10)
    # Its intervals are normal ones from as many draws of its own: alike, not equal.
    np.testing.assert_allclose(0.5 * np.diff(ours.ST_ci)[:, 0], theirs["ST_conf"], rtol=0.35, atol=1e-4)


@pytest.mark.theory
@pytest.mark.parametrize(("name", "function", "k"), [("ishigami", ishigami, 5), ("sobol_g", sobol_g, 14)])
def test_indices_of_known_functions(name, function, k):
    design = sobol_design(unit_space(k), 2**13, 1)
    result = sobol(design, function(design.points))
    S1, ST = exact(name, k)
    np.testing.assert_allclose(result.S1, S1, atol=3e-3)
    np.testing.assert_allclose(result.ST, ST, atol=3e-3)
    assert result.variance == pytest.approx(REFERENCE[name]["variance"], rel=5e-3)
    assert (result.S1_ci[:, 0] <= S1).all()
    assert (result.S1_ci[:, 1] >= S1).all()
    assert (result.ST_ci[:, 0] <= ST).all()
    assert (result.ST_ci[:, 1] >= ST).all()


@settings(max_examples=20)
@given(order=st.permutations(range(4)), seed=st.integers(0, 1000))
def test_permuted_factors_have_permuted_indices(order, seed):
    design = sobol_design(unit_space(4), 32, seed)
    space = FactorSpace([design.space.factors[j] for j in order])
    rows = [0, *(1 + np.array(order)), 5]
    unit = design.unit_points.reshape(32, 6, 4)[:, rows][:, :, order].reshape(-1, 4)
    permuted = replace(design, space=space, unit_points=unit.copy(), points=unit.copy())
    plain = sobol(design, ishigami(design.points), bootstrap=20)
    back = np.argsort(order)
    other = sobol(permuted, ishigami(permuted.points[:, back]), bootstrap=20)
    for index in ("S1", "ST", "S1_ci", "ST_ci"):
        np.testing.assert_allclose(getattr(other, index), getattr(plain, index)[list(order)], atol=1e-12)


@settings(max_examples=20)
@given(seed=st.integers(0, 1000), scale=st.floats(0.01, 100.0), shift=st.floats(-1e4, 1e4))
def test_an_affine_change_of_the_response_changes_no_index(seed, scale, shift):
    design = sobol_design(unit_space(3), 64, seed)
    values = ishigami(design.points)
    plain, changed = sobol(design, values, bootstrap=20), sobol(design, shift - scale * values, bootstrap=20)
    for index in ("S1", "ST", "S1_ci", "ST_ci"):
        np.testing.assert_allclose(getattr(changed, index), getattr(plain, index), rtol=1e-6, atol=1e-8)


def test_one_bad_run_does_not_touch_the_other_base_points():
    design = sobol_design(unit_space(3), 64, 0)
    values = ishigami(design.points)
    values[7] = np.nan
    with pytest.raises(InputError, match=r"1 of 320 runs failed \(rows 7\)"):
        sobol(design, values)
    result = sobol(design, values, policy="drop")
    kept = np.delete(values.reshape(64, 5), 1, axis=0)
    centred = kept - kept.mean()
    variance = centred[:, [0, 4]].var()
    expected = (centred[:, 4] * (centred[:, 2] - centred[:, 0])).mean() / variance
    assert result.S1[1] == pytest.approx(expected, rel=1e-12)
    assert (result.base, result.used, result.failed, result.bounding) == (64, 63, 1, None)


def test_bounding_shows_the_corner_that_dropping_deletes():
    design = sobol_design(unit_space(3), 512, 3)
    values = design.points[:, 1].copy()
    values[(design.points[:, 0] > 0.9) & (design.points[:, 1] > 0.5)] = np.nan
    result = sobol(design, values, policy="bound")
    low, high = result.bounding
    assert result.ST[0] == pytest.approx(0.0, abs=1e-12)
    assert low.ST[0] > 0.1
    assert low.used == high.used == 512
    assert low.failed == high.failed == result.failed > 0
    clean = sobol(design, design.points[:, 1], policy="bound")
    assert clean.bounding is None


def test_a_constant_response_has_no_indices():
    design = sobol_design(unit_space(3), 16, 0)
    for constant in (0.0, 1e6 / 3.0):
        result = sobol(design, np.full(design.runs, constant))
        assert result.status is EstimateStatus.CONSTANT_RESPONSE
        assert np.isnan([result.S1, result.ST]).all()
        assert np.isnan([result.S1_ci, result.ST_ci]).all()


def test_a_small_change_on_a_large_value_is_not_constant():
    design = sobol_design(unit_space(3), 256, 0)
    plain = sobol(design, ishigami(design.points))
    offset = sobol(design, 1e6 + 1e-3 * ishigami(design.points))
    assert offset.status is EstimateStatus.OK
    np.testing.assert_allclose(offset.ST, plain.ST, atol=1e-6)


def test_no_complete_base_point_is_a_status():
    design = sobol_design(unit_space(3), 4, 0)
    result = sobol(design, np.full(design.runs, np.nan), policy="bound")
    assert result.status is EstimateStatus.TOO_FEW_RUNS
    assert result.used == 0
    assert np.isnan(result.ST).all()
    assert all(np.isnan(side.ST).all() for side in result.bounding)


@pytest.mark.theory
def test_intervals_cover():
    """Of 60 designs, at most a few miss with a 95 % interval (binomial: 51 or fewer hits have probability 2e-3)."""
    S1, ST = exact("ishigami", 3)
    hits = np.zeros((2, 3))
    for seed in range(60):
        design = sobol_design(unit_space(3), 128, seed)
        result = sobol(design, ishigami(design.points), bootstrap=200)
        for row, (ci, truth) in enumerate(((result.S1_ci, S1), (result.ST_ci, ST))):
            hits[row] += (ci[:, 0] <= truth) & (truth <= ci[:, 1])
    assert hits.min() >= 52


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda d: sobol(d, np.zeros(5)), "80 runs"),
        (lambda d: sobol(d, np.zeros(80), policy="zero"), "zero"),
        (lambda d: sobol(latin_hypercube(d.space, 80, 0), np.zeros(80)), "a sobol design is needed"),
    ],
)
def test_wrong_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call(sobol_design(unit_space(3), 16, 0))
