from __future__ import annotations

import numpy as np
import pytest
from uncertainty_functions import ishigami, sobol_g, unit_space

from levelone.errors import InputError
from levelone.uncertainty import EstimateStatus, latin_hypercube, morris, morris_design
from levelone.uncertainty.morris_convergence import TIE, morris_convergence
from levelone.uncertainty.morris_designs import grouped_morris_design, radial_design


def test_the_last_checkpoint_is_the_whole_design():
    design = morris_design(unit_space(3), 40, 4, 0)
    values = ishigami(design.points)
    record, whole = morris_convergence(design, values), morris(design, values)
    assert list(record.trajectories) == [10, 13, 17, 20, 23, 27, 30, 33, 37, 40]
    np.testing.assert_allclose(record.mu_star[-1], whole.mu_star, rtol=1e-12)
    part = morris(morris_design(unit_space(3), 40, 4, 0), np.r_[values[: 4 * 20], np.full(80, np.nan)], policy="drop")
    np.testing.assert_allclose(record.mu_star[3], part.mu_star, rtol=1e-12)
    assert (record.mu_star_ci[..., 0] <= record.mu_star).all()
    assert (record.mu_star <= record.mu_star_ci[..., 1]).all()


@pytest.mark.theory
def test_a_linear_response_is_settled_at_once_and_a_difference_that_never_shows_never():
    design = morris_design(unit_space(3), 60, 4, 1)
    clear = morris_convergence(design, design.points @ [3.0, 2.0, 0.5])
    assert clear.stable_from == 10.0
    np.testing.assert_array_equal(clear.open_pairs, 0)
    # two effects of the same distribution with large scatter: their order stays open until they count as equal
    u = design.points
    scattered = morris_convergence(design, np.sin(11.0 * u[:, 0]) * u[:, 2] + np.sin(11.0 * u[:, 1]) * (1.0 - u[:, 2]))
    assert np.isnan(scattered.stable_from)
    assert (scattered.open_pairs > 0).all()


def test_a_tie_counts_as_settled():
    design = morris_design(unit_space(2), 12, 4, 1)
    record = morris_convergence(design, design.points @ [1.0, 1.0 - 0.5 * TIE])
    assert record.stable_from == 10.0


def test_where_it_says_settled_the_ranking_is_that_of_very_many_trajectories():
    reference = radial_design(unit_space(14), 4096, 99)
    truth = morris(reference, sobol_g(reference.points), bootstrap=2).mu_star
    settled = 0
    for seed in range(8):
        design = radial_design(unit_space(14), 60, seed)
        record = morris_convergence(design, sobol_g(design.points), checkpoints=[10, 20, 30, 40, 50, 60], bootstrap=300)
        if np.isfinite(record.stable_from):
            settled += 1
            at = list(record.trajectories).index(int(record.stable_from))
            ranked = truth[np.argsort(-record.mu_star[at])]
            assert (np.diff(ranked) < TIE * truth.max()).all()
    assert settled >= 6


def test_groups_are_ranked_too():
    design = grouped_morris_design(unit_space(4), 20, 4, 0, {"g": ["x1", "x2"]})
    record = morris_convergence(design, design.points @ [5.0, 1.0, 1.0, 0.0])
    assert record.names == ("g", "x3", "x4")
    assert record.stable_from == 10.0


def test_failed_trajectories_are_left_out_and_counted():
    design = morris_design(unit_space(3), 30, 4, 0)
    values = ishigami(design.points)
    values[:40] = np.nan
    record = morris_convergence(design, values, checkpoints=[5, 11, 12, 30], policy="drop")
    np.testing.assert_array_equal(record.used, [0, 1, 2, 20])
    assert np.isnan(record.mu_star[:2]).all()
    assert np.isfinite(record.mu_star[2:]).all()
    np.testing.assert_array_equal(record.open_pairs[:3], 2)
    assert (record.failed, record.status) == (40, EstimateStatus.OK)
    few = morris_convergence(design, np.where(np.arange(120) < 90, np.nan, values), policy="drop")
    assert few.status is EstimateStatus.TOO_FEW_RUNS
    assert np.isnan(few.stable_from)


def test_a_constant_response_has_nothing_to_rank():
    design = morris_design(unit_space(3), 12, 4, 0)
    record = morris_convergence(design, np.full(design.runs, 4.0))
    assert (record.mu_star == 0.0).all()
    assert record.stable_from == 10.0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda d: morris_convergence(d, np.zeros(48), checkpoints=[5, 5]), "must increase"),
        (lambda d: morris_convergence(d, np.zeros(48), checkpoints=[5, 13]), "at most 12"),
        (lambda d: morris_convergence(d, np.zeros(48), checkpoints=[5.5]), "whole numbers"),
        (lambda d: morris_convergence(d, np.full(48, np.nan)), "policy is 'refuse'"),
        (lambda d: morris_convergence(latin_hypercube(d.space, 48, 0), np.zeros(48)), "a morris design is needed"),
    ],
)
def test_wrong_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call(morris_design(unit_space(3), 12, 4, 0))
