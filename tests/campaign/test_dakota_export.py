"""Input files: what they say, what is refused, and that Dakota draws from the distributions that were meant."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dakota_cases import ISHIGAMI, MIXED, driver, exported, needs_dakota, plan
from scipy.stats import spearmanr

from levelone.campaign.dakota.coordinates import unit_points
from levelone.campaign.dakota.execute import run_dakota
from levelone.campaign.dakota.export import export_plan, plan_of
from levelone.campaign.dakota.tabular import read_tabular
from levelone.campaign.dakota.variables import ordered, variables_block
from levelone.campaign.models.builtin import RESPONSES
from levelone.errors import InputError
from levelone.uncertainty import Discrete, Factor, FactorSpace, Normal, TruncatedNormal, Uniform
from levelone.uncertainty.evidence import Evidence


def test_blocks_of_each_type_in_dakotas_order() -> None:
    text = variables_block(MIXED)
    for expected in (
        "  normal_uncertain = 1\n    means 7.0\n    std_deviations 0.25\n    lower_bounds 6.5\n    upper_bounds 8.0\n",
        "lognormal_uncertain = 1\n    lambdas 0.1\n    zetas 0.2\n    descriptors 'l'",
        "uniform_uncertain = 2\n    lower_bounds 2.0 -1.0\n    upper_bounds 5.0 1.0\n    descriptors 'u' 'v'",
        "triangular_uncertain = 1\n    modes 0.2\n    lower_bounds 0.0\n    upper_bounds 1.0\n    descriptors 't'",
        "elements_per_variable 3\n      elements 0.0 0.5 2.0\n      set_probabilities 0.25 0.25 0.5\n      descriptors 'd'",
    ):
        assert expected in text
    assert [factor.name for factor in ordered(MIXED)] == ["n", "l", "u", "v", "t", "d"]


@needs_dakota
@pytest.mark.oracle
def test_dakota_draws_from_the_distributions_of_the_study(tmp_path: Path) -> None:
    """A Latin hypercube has one point in each of n shares of equal probability: by our distribution functions as well."""
    n = 40
    exported(tmp_path, MIXED, samples=n)
    run_dakota(tmp_path / "lhs.in")
    found = read_tabular(tmp_path / "lhs.dat", MIXED)
    assert found.columns == ("n", "l", "u", "v", "t", "d")
    unit = unit_points(MIXED, found.points)
    for name in "nluvt":
        strata = np.floor(np.sort(unit[:, MIXED.index(name)]) * n)
        np.testing.assert_array_equal(strata, np.arange(n), err_msg=name)
    assert sorted(found.points[:, MIXED.index("d")].tolist()) == [0.0] * 10 + [0.5] * 10 + [2.0] * 20


@needs_dakota
@pytest.mark.oracle
def test_rank_correlations_reach_dakota_in_its_own_order(tmp_path: Path) -> None:
    factors = [Factor("u", Uniform(2.0, 5.0)), Factor("n", TruncatedNormal(7.0, 0.25, 6.5, 8.0)), Factor("v", Uniform(0.0, 1.0))]
    space = FactorSpace(factors, [[1.0, 0.7, 0.0], [0.7, 1.0, -0.3], [0.0, -0.3, 1.0]])
    exported(tmp_path, space, samples=300)
    assert sorted(path.name for path in tmp_path.glob("*.in")) == ["lhs.in"]
    run_dakota(tmp_path / "lhs.in")
    ranks = spearmanr(read_tabular(tmp_path / "lhs.dat", space).points).statistic
    np.testing.assert_allclose(ranks, np.array(space.correlation), atol=0.05)


def test_what_is_left_out_says_why(tmp_path: Path) -> None:
    done = export_plan(plan(MIXED, "run"), tmp_path)
    (name, why), *others = done.left_out
    assert (name, others) == ("morris.in", [])
    assert "not uniform: d, t, n, l" in why
    correlated = FactorSpace(ISHIGAMI.factors, [[1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]])
    done = export_plan(plan(correlated, "run"), tmp_path)
    assert {name for name, why in done.left_out if "correlated" in why} == {"morris.in", "surrogate.in", "direct.in"}


@pytest.mark.parametrize(
    ("factors", "named"),
    [
        ([Factor("a b", Uniform(0.0, 1.0))], "'a b'"),
        ([Factor("a", Evidence(((0.0, 1.0), (0.5, 2.0)), (0.5, 0.5)))], "no variable for Evidence"),
        ([Factor("a", Normal(0.0, 1.0)), Factor("b", TruncatedNormal(0.0, 1.0, -1.0, 1.0))], "factor a.*six standard deviations"),
    ],
)
def test_what_dakota_cannot_express_is_refused(factors: list[Factor], named: str) -> None:
    with pytest.raises(InputError, match=named):
        variables_block(FactorSpace(factors))


def test_correlated_discrete_factors_are_refused() -> None:
    space = FactorSpace([Factor("a", Uniform(0.0, 1.0)), Factor("b", Discrete((0.0, 1.0)))], [[1.0, 0.4], [0.4, 1.0]])
    with pytest.raises(InputError, match="factor b"):
        variables_block(space)


def test_a_plan_takes_the_sizes_of_the_study(study, tmp_path: Path) -> None:
    found = plan_of(study, seed=9)
    assert found.responses == tuple(RESPONSES)
    assert (found.trajectories, found.samples, found.surrogate_points, found.seed) == (4, 60, 256, 9)
    done = export_plan(found, tmp_path)
    texts = {path.stem: path.read_text() for path in done.written}
    assert set(texts) == {"morris", "lhs", "surrogate", "direct"}
    assert f"samples = {4 * 15} " in texts["morris"]
    assert "partitions = 3 " in texts["morris"]
    assert f"levelone dakota drive '{study.path}'" in texts["direct"]
    assert "variance_based_decomp" in texts["direct"]
    assert "gaussian_process surfpack" in texts["surrogate"]
    seeds = {line.strip() for text in texts.values() for line in text.splitlines() if line.strip().startswith("seed = ")}
    assert len(seeds) == 4
    assert export_plan(plan_of(study, seed=9), tmp_path / ".").written
    assert texts == {path.stem: path.read_text() for path in done.written}


def test_a_plan_refuses_what_is_no_response(study) -> None:
    with pytest.raises(InputError, match="did you mean 'zeta'"):
        plan_of(study, responses=["zetta"])
    with pytest.raises(InputError, match="twice"):
        plan_of(study, responses=["zeta", "zeta"])
    with pytest.raises(InputError, match="quote"):
        plan_of(replace(study, path=Path("/tmp/it's/study.toml")))


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot write"):
        export_plan(plan(ISHIGAMI, driver(tmp_path)), tmp_path / "nowhere")
