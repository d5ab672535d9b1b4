from __future__ import annotations

import numpy as np
import pytest
from uncertainty_functions import ishigami, unit_space

from levelone.errors import InputError
from levelone.uncertainty import EstimateStatus, Kriging, latin_hypercube, stage_seed
from levelone.uncertainty.groups_out import random_groups, without_groups
from levelone.uncertainty.validation import HELD_OUT, validate

LENGTHS = np.array([0.7, 1.3, 2.0])


def sample(n=30):
    x = latin_hypercube(unit_space(3), n, 0).points
    x = np.vstack([np.zeros(3), np.ones(3), x[2:]])
    return x, 3.0 + np.sin(4.0 * x[:, 0]) + x[:, 1] ** 2 + 0.3 * x[:, 2]


@pytest.mark.theory
@pytest.mark.parametrize("trend", ["constant", "linear"])
def test_models_without_groups_are_those_of_refits(trend):
    """Groups that leave the ends of each range alone, so that refits share the scaling of the inputs."""
    x, y = sample()
    model = Kriging.condition(x, y, LENGTHS, 1e-2, trend=trend)
    groups = [np.array([3, 7, 11]), np.arange(20, 30)]
    new = np.random.default_rng(0).random((40, 3))
    together = without_groups(x, y, model, groups).predict_mean(new)
    for g, group in enumerate(groups):
        kept = np.setdiff1d(np.arange(30), group)
        refit = Kriging.condition(x[kept], y[kept], LENGTHS, 1e-2, trend=trend)
        np.testing.assert_allclose(together[:, g], refit.predict_mean(new), atol=1e-8)


@pytest.mark.theory
def test_one_run_in_each_fold_is_leaving_one_out():
    x, y = sample()
    model = Kriging.condition(x, y, LENGTHS, 1e-2)
    assert validate(x, y, model, 0, folds=30).q2_folds == pytest.approx(model.q2, abs=1e-9)


@pytest.mark.theory
def test_the_held_out_fifth_is_predicted_by_a_model_fitted_to_the_others():
    x, y = sample()
    model = Kriging.fit(x, y, 0, starts=2)
    order = np.random.default_rng(stage_seed(5, "runs held out")).permutation(30)
    held, kept = order[: 30 // HELD_OUT], np.sort(order[30 // HELD_OUT :])
    seed = stage_seed(5, "search without the runs held out")
    other = Kriging.fit(x[kept], y[kept], seed, correlation=model.correlation)
    error = y[held] - other.predict_mean(x[held])
    expected = 1.0 - np.sum(error**2) / np.sum((y[held] - y[kept].mean()) ** 2)
    assert validate(x, y, model, 5).q2_holdout == pytest.approx(expected, abs=1e-12)


def test_a_response_that_is_noise_is_called_so():
    x = latin_hypercube(unit_space(3), 60, 0).points
    y = np.random.default_rng(1).standard_normal(60)
    found = validate(x, y, Kriging.fit(x, y, 0, starts=2), 0)
    assert "less than half" in found.verdict
    assert found.q2_loo < 0.5


def test_a_smooth_response_is_passed():
    x, y = sample(60)
    y += 1e-2 * np.random.default_rng(2).standard_normal(60)
    found = validate(x, y, Kriging.fit(x, y, 0, starts=2), 0)
    assert found.verdict == ""
    assert min(found.q2_loo, found.q2_folds, found.q2_holdout) > 0.99
    assert found.coverage_95 == pytest.approx(np.mean(np.abs(found.standardised) <= 1.96))
    assert found.spread == pytest.approx(np.sqrt(np.mean(found.standardised**2)))


def test_claims_that_do_not_hold_are_named():
    """Short lengths claim the whole standard deviation between the runs of a smooth response; long ones next to none at a jump."""
    x = latin_hypercube(unit_space(2), 150, 0).points
    timid = validate(x, x[:, 0], Kriging.condition(x, x[:, 0], np.array([0.1, 0.1]), 1e-6), 0)
    assert timid.coverage_95 > 0.99
    assert f"{round(150 * timid.coverage_95)} of 150 runs" in timid.verdict
    assert "smaller than it claims" in timid.verdict
    spikes = x[:, 0] + 2.0 * (np.arange(150) % 8 == 0)
    bold = Kriging.condition(x, spikes, np.array([1.0, 1.0]), 1e-4, correlation="squared_exponential")
    found = validate(x, spikes, bold, 0)
    assert found.coverage_95 == np.mean(np.abs(bold.loo_residual / bold.loo_std) <= 1.96)
    assert found.coverage_95 < 0.89
    assert "larger than it claims" in found.verdict


@pytest.mark.theory
def test_lengths_that_hang_on_few_runs_are_named():
    """Ishigami's function from 60 runs: leaving one out keeps the lengths that all runs chose."""
    x = latin_hypercube(unit_space(6), 60, 2).points
    y = ishigami(x)
    model = Kriging.fit(x, y, 0, starts=4)
    found = validate(x, y, model, 0)
    assert found.q2_loo == model.q2
    assert "Q2" in found.verdict


def test_an_input_that_rarely_varies_leaves_no_honest_test():
    x, y = sample()
    x = np.column_stack([x, np.zeros(30)])
    seed = next(s for s in range(99) if 4 in np.random.default_rng(stage_seed(s, "runs held out")).permutation(30)[:6])
    x[4, 3] = 1.0
    found = validate(x, y, Kriging.fit(x, y, 0, starts=2), seed)
    assert np.isnan(found.q2_holdout)
    assert found.q2_folds > 0.9


def test_undefined_models_have_an_undefined_validation():
    x, _ = sample()
    found = validate(x, np.ones(30), Kriging.fit(x, np.ones(30), 0), 0)
    assert found.status is EstimateStatus.CONSTANT_RESPONSE
    assert np.isnan([found.q2_loo, found.q2_folds, found.q2_holdout, found.coverage_95, found.spread]).all()
    assert found.verdict == EstimateStatus.CONSTANT_RESPONSE.text


def test_groups_share_out_every_run():
    groups = random_groups(23, 5, np.random.default_rng(0))
    assert sorted(np.concatenate(groups)) == list(range(23))
    assert {len(group) for group in groups} == {4, 5}
    for number in (1, 24):
        with pytest.raises(InputError, match="groups"):
            random_groups(23, number, np.random.default_rng(0))


def test_bad_input_is_refused():
    x, y = sample()
    model = Kriging.condition(x, y, LENGTHS)
    with pytest.raises(InputError, match="not the 30 runs"):
        validate(x[1:], y[1:], model, 0)
    with pytest.raises(InputError, match="folds"):
        validate(x, y, model, 0, folds=1)
