from __future__ import annotations

import numpy as np
import pytest
from uncertainty_functions import REFERENCE, ishigami, sobol_g, sobol_g_parts, unit_space

from levelone.errors import InputError
from levelone.uncertainty import Factor, FactorSpace, Uniform, sobol, sobol_design

GROUPS = {"first": ["x1", "x3"], "second": ["x2", "x5", "x6"]}


def exact_groups(columns):
    """S1, ST and S2 of groups of factors of sobol_g: each group is a factor of the product, of mean 1 and its own variance."""
    part = sobol_g_parts(14)
    own = np.array([np.prod(1.0 + part[list(members)]) - 1.0 for members in columns])
    whole = np.prod(1.0 + own) - 1.0
    rest = np.array([np.prod(1.0 + np.delete(own, j)) for j in range(own.size)])
    return own / whole, own * rest / whole, np.triu(np.outer(own, own), 1) / whole


def test_the_parts_of_the_product_have_the_tabulated_variance():
    assert np.prod(1.0 + sobol_g_parts(14)) - 1.0 == pytest.approx(REFERENCE["sobol_g"]["variance"], rel=1e-12)


def test_a_group_moves_together_and_the_rest_alone():
    design = sobol_design(unit_space(7), 8, 2, groups=GROUPS, second_order=True)
    assert design.columns == ("first", "second", "x4", "x7")
    assert design.groups[:2] == (("first", ("x1", "x3")), ("second", ("x2", "x5", "x6")))
    assert design.names == ("x1", "x2", "x3", "x4", "x5", "x6", "x7")
    blocks = design.unit_points.reshape(8, 10, 7)
    a, b = blocks[:, 0], blocks[:, -1]
    for j, members in enumerate(([0, 2], [1, 4, 5], [3], [6])):
        for row, base, other in ((1 + j, a, b), (5 + j, b, a)):
            mixed = base.copy()
            mixed[:, members] = other[:, members]
            np.testing.assert_array_equal(blocks[:, row], mixed)


def test_groups_of_one_are_the_plain_design():
    plain = sobol_design(unit_space(3), 16, 1)
    grouped = sobol_design(unit_space(3), 16, 1, groups={"x1": ["x1"]})
    np.testing.assert_array_equal(grouped.points, plain.points)
    assert grouped.columns == plain.columns == ("x1", "x2", "x3")


@pytest.mark.theory
def test_indices_of_groups_of_a_product():
    groups = {"first two": ["x1", "x2"], "third": ["x3"], "the rest": [f"x{j}" for j in range(4, 15)]}
    design = sobol_design(unit_space(14), 2**11, 0, groups=groups, second_order=True, scramblings=8)
    found = sobol(design, sobol_g(design.points))
    S1, ST, S2 = exact_groups([range(2), [2], range(3, 14)])
    assert found.names == tuple(groups)
    np.testing.assert_allclose(found.S1, S1, atol=3e-3)
    np.testing.assert_allclose(found.ST, ST, atol=3e-3)
    above = np.triu_indices(3, 1)
    np.testing.assert_allclose(found.S2[above], S2[above], atol=6e-3)
    assert (found.S2_ci[above][:, 0] <= S2[above]).all()
    assert (S2[above] <= found.S2_ci[above][:, 1]).all()


@pytest.mark.theory
def test_a_group_that_holds_the_interaction_has_it_in_its_first_order_share():
    design = sobol_design(unit_space(3), 2**12, 0, groups={"pair": ["x1", "x3"]}, scramblings=4)
    found = sobol(design, ishigami(design.points))
    alone = REFERENCE["ishigami"]["S1"][1]
    np.testing.assert_allclose(found.S1, [1.0 - alone, alone], atol=0.01)
    np.testing.assert_allclose(found.ST, found.S1, atol=0.02)


@pytest.mark.oracle
def test_agrees_with_salib_on_the_same_points():
    from SALib.analyze import sobol as salib

    groups = {"a": ["x1", "x4"], "b": ["x2"], "c": ["x3", "x5", "x6"]}
    design = sobol_design(unit_space(6), 256, 4, groups=groups)
    values = 50.0 + sobol_g_of_six(design.points)
    problem = {"num_vars": 6, "names": list(design.names), "bounds": [[0.0, 1.0]] * 6, "groups": ["a", "b", "c", "a", "c", "c"]}
    theirs = salib.analyze(problem, values, calc_second_order=False, seed=1)
    found = sobol(design, values, bootstrap=20)
    np.testing.assert_allclose(found.S1, theirs["S1"], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(found.ST, theirs["ST"], rtol=1e-10, atol=1e-10)


def sobol_g_of_six(u):
    a = np.array(REFERENCE["sobol_g"]["a"][:6])
    return np.prod((np.abs(4.0 * u - 2.0) + a) / (1.0 + a), axis=1)


def correlated_space():
    rank = np.eye(3)
    rank[0, 2] = rank[2, 0] = 0.6
    return FactorSpace([Factor(f"x{j + 1}", Uniform(0.0, 1.0)) for j in range(3)], rank)


def test_correlated_factors_are_refused_unless_they_share_a_group():
    space = correlated_space()
    for groups in (None, {"g": ["x1", "x2"]}):
        with pytest.raises(InputError, match=r"x1 and x3 are correlated.*Shapley effects"):
            sobol_design(space, 8, 0, groups=groups)
    design = sobol_design(space, 2**12, 0, groups={"g": ["x1", "x3"]})
    rank = np.corrcoef(design.points[:: design.block].T)
    assert rank[0, 2] == pytest.approx(0.6, abs=0.02)


@pytest.mark.theory
def test_a_group_of_correlated_factors_has_the_share_of_their_joint_variance():
    """x1 + x2 + x3, each of variance 1/12, of which x1 and x3 have the correlation 0.6: 2 + 2 0.6 parts to 1."""
    design = sobol_design(correlated_space(), 2**11, 0, groups={"g": ["x1", "x3"]}, scramblings=4)
    found = sobol(design, design.points.sum(axis=1))
    np.testing.assert_allclose(found.S1, [3.2 / 4.2, 1.0 / 4.2], atol=3e-3)
    np.testing.assert_allclose(found.ST, found.S1, atol=3e-3)


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ({}, "at least one group"),
        ({"g": []}, "group g: .*list of names"),
        ({"g": "x1"}, "group g: 'x1'; a list"),
        ({"": ["x1"]}, "not a name"),
        ({"g": ["x9"]}, "unknown name 'x9'"),
        ({"g": ["x1"], "h": ["x1", "x2"]}, "factor given twice: x1"),
        ({"g": ["x1", "x1"]}, "factor given twice: x1"),
        ({"x2": ["x1"]}, "group x2: a factor that is in no group has this name"),
    ],
)
def test_wrong_groups_are_refused(groups, words):
    with pytest.raises(InputError, match=words):
        sobol_design(unit_space(3), 8, 0, groups=groups)
