from __future__ import annotations

import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from threadpoolctl import threadpool_info, threadpool_limits
from uncertainty_functions import REFERENCE, exact, ishigami, sobol_g, unit_space

from levelone.errors import InputError
from levelone.uncertainty import (
    EstimateStatus,
    Kriging,
    blas,
    bounding_values,
    fit_all,
    latin_hypercube,
    predict_all,
    sobol,
    sobol_design,
)
from levelone.uncertainty.blas import OneBlasThread
from levelone.uncertainty.correlation import CORRELATIONS
from levelone.uncertainty.likelihood import RestrictedLikelihood

LENGTHS = np.array([0.7, 1.3, 2.0])


def sample(n=40, k=3, seed=0):
    design = latin_hypercube(unit_space(k), n, seed)
    return design.points, np.sin(4.0 * design.points[:, 0]) + design.points[:, 1] ** 2 + 0.3 * design.points[:, -1]


def scaled(x):
    return (x - x.min(axis=0)) / np.ptp(x, axis=0)


@pytest.mark.theory
@pytest.mark.parametrize("kind", CORRELATIONS)
@pytest.mark.parametrize("trend", ["constant", "linear"])
@pytest.mark.parametrize("nugget", [False, True])
def test_the_gradient_of_the_likelihood_is_that_of_differences(kind, trend, nugget):
    x, y = sample()
    basis = np.ones((len(x), 1)) if trend == "constant" else np.column_stack([np.ones(len(x)), x])
    likelihood = RestrictedLikelihood(x, (y - y.mean()) / y.std(), basis, kind, nugget)
    at = np.append(np.log(LENGTHS / 4.0), [np.log(1e-2)] * nugget)
    gradient = likelihood(at)[1]
    step = 1e-5
    for j, unit in enumerate(np.eye(len(at))):
        difference = (likelihood(at + step * unit)[0] - likelihood(at - step * unit)[0]) / (2.0 * step)
        assert gradient[j] == pytest.approx(difference, rel=1e-6, abs=1e-6)


@pytest.mark.theory
def test_the_likelihood_is_that_of_the_contrasts():
    """The restricted likelihood is the plain one of n - p contrasts of the response that hold no trend (Harville 1974)."""
    x, y = sample(12)
    basis = np.column_stack([np.ones(12), x])
    parameters = np.log([0.5, 0.8, 1.1])
    other = parameters + np.array([0.3, -0.2, 0.1])
    contrasts = np.linalg.svd(basis)[0][:, basis.shape[1] :]

    def direct(log_lengths):
        z = x / np.exp(log_lengths)
        k = np.exp(-0.5 * ((z[:, None] - z) ** 2).sum(axis=2))
        reduced, w = contrasts.T @ k @ contrasts, contrasts.T @ y
        m = len(w)
        variance = w @ np.linalg.solve(reduced, w) / m
        return 0.5 * (m * np.log(variance) + np.linalg.slogdet(reduced)[1]) + np.exp(-log_lengths).sum()

    ours = RestrictedLikelihood(x, y, basis, "squared_exponential")
    assert ours(parameters)[0] - ours(other)[0] == pytest.approx(direct(parameters) - direct(other), rel=1e-8)


@pytest.mark.oracle
@pytest.mark.parametrize("kind", CORRELATIONS)
def test_predictions_agree_with_scikit_learn_at_the_same_hyperparameters(kind):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern

    x, y = sample()
    model = Kriging.condition(x, y, LENGTHS, 1e-4, correlation=kind)
    # A wide constant kernel is a flat prior on the mean, which is what generalised least squares assumes.
    wide = 1e6
    shape = RBF(LENGTHS) if kind == "squared_exponential" else Matern(LENGTHS, nu=2.5)
    low, width = x.min(axis=0), np.ptp(x, axis=0)
    peer = GaussianProcessRegressor(
        ConstantKernel(model.variance) * shape + ConstantKernel(model.variance * wide),
        alpha=model.variance * 1e-4,
        optimizer=None,
    ).fit((x - low) / width, y - y.mean())
    points = np.random.default_rng(1).random((50, 3))
    mean, std = peer.predict((points - low) / width, return_std=True)
    ours = model.predict(points)
    np.testing.assert_allclose(ours.mean - y.mean(), mean, atol=2e-5)
    np.testing.assert_allclose(ours.std, std, rtol=2e-3, atol=1e-6)


@pytest.mark.theory
@pytest.mark.parametrize("trend", ["constant", "linear"])
@pytest.mark.parametrize("nugget", [0.0, 1e-2])
def test_leave_one_out_in_closed_form_is_that_of_refits(trend, nugget):
    x, y = sample(25)
    # The ends of each range stay when a point is left out, so that the refits share the scaling.
    x = np.vstack([np.zeros(3), np.ones(3), x[2:]])
    model = Kriging.condition(x, y, LENGTHS, nugget, trend=trend)
    for i in range(2, 25):
        kept = np.arange(25) != i
        without = Kriging.condition(x[kept], y[kept], LENGTHS, nugget, trend=trend).predict(x[i : i + 1])
        assert model.loo_residual[i] == pytest.approx(y[i] - without.mean[0], rel=1e-6, abs=1e-9)
    expected = 1.0 - np.sum(model.loo_residual**2) / np.sum((y - y.mean()) ** 2)
    assert model.q2 == pytest.approx(expected, rel=1e-12)


@pytest.mark.theory
@pytest.mark.parametrize("kind", CORRELATIONS)
def test_without_nugget_the_model_interpolates(kind):
    x, y = sample()
    prediction = Kriging.condition(x, y, LENGTHS / 3.0, correlation=kind).predict(x)
    np.testing.assert_allclose(prediction.mean, y, atol=1e-7)
    assert prediction.std.max() < 1e-3 * y.std()


@pytest.mark.theory
def test_a_linear_trend_reproduces_a_plane_far_outside_the_points():
    x, _ = sample()
    far = 5.0 + 10.0 * x
    model = Kriging.condition(x, 3.0 + x @ [1.0, -2.0, 0.5], LENGTHS, 1e-4, trend="linear")
    np.testing.assert_allclose(model.predict_mean(far), 3.0 + far @ [1.0, -2.0, 0.5], rtol=1e-9, atol=1e-9)


@settings(max_examples=10, deadline=None)
@given(scale=st.floats(1e-6, 1e6), shift=st.floats(-1e3, 1e3), units=st.floats(1e-3, 1e3))
def test_units_of_inputs_and_response_change_nothing_but_the_units(scale, shift, units):
    x, y = sample()
    points = np.random.default_rng(2).random((20, 3))
    plain = Kriging.condition(x, y, LENGTHS, 1e-4)
    other = Kriging.condition(7.0 + units * x, scale * (y + shift), LENGTHS, 1e-4)
    expected, found = plain.predict(points), other.predict(7.0 + units * points)
    np.testing.assert_allclose(found.mean, scale * (expected.mean + shift), rtol=1e-6, atol=1e-6 * scale)
    np.testing.assert_allclose(found.std, scale * expected.std, rtol=1e-4)
    assert other.q2 == pytest.approx(plain.q2, abs=1e-7)


def test_permuted_inputs_have_permuted_length_scales():
    x, y = sample(80)
    lengths = np.log(Kriging.fit(x, y, 3).lengths)
    order = [2, 0, 1]
    permuted = np.log(Kriging.fit(x[:, order], y, 3).lengths)
    np.testing.assert_allclose(permuted, lengths[order], atol=0.02)


def test_a_nugget_finds_the_noise():
    x, y = sample(200)
    noise = 0.1 * np.random.default_rng(0).standard_normal(200)
    model = Kriging.fit(x, y + noise, 1)
    assert np.sqrt(model.nugget * model.variance) == pytest.approx(0.1, rel=0.15)
    points, truth = sample(500, seed=5)
    assert np.std(model.predict_mean(points) - truth) < 0.05


def test_pure_noise_is_not_a_surface():
    x, _ = sample(200)
    noise = np.random.default_rng(4).standard_normal(200)
    model = Kriging.fit(x, noise, 1)
    assert model.q2 < 0.1
    assert model.predict_mean(x).std() < 0.5


def test_points_given_twice_are_met_with_a_jitter():
    x, y = sample()
    x, y = np.vstack([x, x[:5]]), np.append(y, y[:5])
    model = Kriging.condition(x, y, LENGTHS)
    np.testing.assert_allclose(model.predict_mean(x), y, atol=1e-4)


def test_the_number_of_points_asked_at_once_changes_nothing():
    x, y = sample()
    model = Kriging.fit(x, y, 0)
    points = np.random.default_rng(3).random((1000, 3))
    whole = model.predict(points)
    parts = [model.predict(points[i : i + 1]) for i in (0, 255, 256, 999)]
    np.testing.assert_allclose([part.mean[0] for part in parts], whole.mean[[0, 255, 256, 999]], rtol=1e-9)
    np.testing.assert_allclose(model.predict_mean(points), whole.mean, rtol=1e-12)


def test_a_constant_response_predicts_the_constant():
    x, _ = sample()
    model = Kriging.fit(x, np.full(40, 1.0 / 3.0), 0)
    assert model.status is EstimateStatus.CONSTANT_RESPONSE
    assert np.isnan(model.q2)
    prediction = model.predict(x[:5])
    np.testing.assert_allclose(prediction.mean, 1.0 / 3.0)
    assert (prediction.std == 0.0).all()


def test_too_few_points_predict_nan():
    model = Kriging.fit([[0.0], [1.0]], [0.0, 1.0], 0)
    assert model.status is EstimateStatus.TOO_FEW_RUNS
    assert np.isnan(model.predict_mean([[0.5]])).all()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda x, y: Kriging.fit(x, y[:-1], 0), "shapes"),
        (lambda x, y: Kriging.fit(x, np.where(np.arange(40) == 3, np.nan, y), 0), "1 of 40 values .*row 3"),
        (lambda x, y: Kriging.fit(np.where(x > 0.9, np.nan, x), y, 0), "input is not finite"),
        (lambda x, y: Kriging.fit(x * [1.0, 0.0, 1.0], y, 0), r"x\[:, 1\]: this input never varies"),
        (lambda x, y: Kriging.fit(x, y, 0, correlation="matern"), "did you mean 'matern52'"),
        (lambda x, y: Kriging.fit(x, y, 0, trend="lineal"), "did you mean 'linear'"),
        (lambda x, y: Kriging.fit(x, y, 0, starts=0), "starts"),
        (lambda x, y: Kriging.fit(x, y, -1), "seed"),
        (lambda x, y: Kriging.condition(x, y, [1.0, -1.0, 1.0]), "lengths"),
        (lambda x, y: Kriging.condition(x, y, LENGTHS).predict(x[:, :2]), r"\[n, 3\]"),
        (lambda x, y: fit_all(x, y, 0), r"\[n, m\]"),
        (lambda x, y: fit_all(x, y[:, None], 0, policy="bound"), "bound"),
        (lambda x, y: fit_all(x, np.where(x > 0.9, np.nan, x), 0), "policy is 'refuse'"),
    ],
)
def test_wrong_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call(*sample())


def test_responses_side_by_side_are_those_one_by_one_whatever_the_workers():
    x, y = sample(60)
    responses = np.column_stack([y, y**2, np.cos(y), np.full(60, 2.0)])
    one, many = fit_all(x, responses, 5, workers=1), fit_all(x, responses, 5, workers=3)
    points = np.random.default_rng(0).random((600, 3))
    for j, (a, b) in enumerate(zip(one, many, strict=True)):
        alone = Kriging.fit(x, responses[:, j], 5)
        np.testing.assert_array_equal(a.lengths, b.lengths)
        np.testing.assert_array_equal(a.lengths, alone.lengths)
        np.testing.assert_array_equal(a.predict_mean(points), alone.predict_mean(points))
    np.testing.assert_array_equal(predict_all(one, points, workers=1), predict_all(many, points, workers=3))


def test_threads_of_the_blas_change_no_digit():
    x, y = sample(120)
    points = np.random.default_rng(0).random((600, 3))
    found = []
    for threads in (1, 2):
        with threadpool_limits(threads):
            model = Kriging.fit(x, y, 5)
            found.append((model.lengths, model.predict(points).std, model.q2))
    for a, b in zip(*found, strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_limit_of_the_blas_is_set_and_restored_once_by_the_first_thread_after_the_last_left(monkeypatch):
    events, entered, leaving = [], threading.Event(), threading.Event()

    class Limits:
        def __init__(self, limits, user_api):
            events.append(("set", limits, threading.current_thread().name))

        def __enter__(self):
            return self

        def __exit__(self, *_):
            events.append(("restore", threading.current_thread().name))

    def first():
        with OneBlasThread(), OneBlasThread():
            entered.set()
            leaving.wait(10.0)
        events.append(("first is through",))

    monkeypatch.setattr(blas, "threadpool_limits", Limits)
    thread = threading.Thread(target=first, name="first")
    thread.start()
    entered.wait(10.0)
    with OneBlasThread():
        leaving.set()
        thread.join(0.2)
        events.append(("second leaves",))
    thread.join(10.0)
    assert events == [("set", 1, "first"), ("second leaves",), ("restore", "first"), ("first is through",)]


def test_the_limit_of_the_blas_holds_inside_and_not_after():
    def threads():
        return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

    with threadpool_limits(2, user_api="blas"):
        with OneBlasThread():
            assert threads() == {1}
        assert threads() == {2}


def test_failed_runs_are_dropped_from_their_own_response():
    x, y = sample(60)
    responses = np.column_stack([y, y])
    responses[:4, 1] = np.nan
    whole, part = fit_all(x, responses, 5, policy="drop")
    assert (len(whole.loo_residual), len(part.loo_residual)) == (60, 56)
    np.testing.assert_array_equal(part.lengths, Kriging.fit(x[4:], y[4:], 5).lengths)
    low, high = bounding_values(responses[:, 1])
    np.testing.assert_array_equal(low[:4], y[4:].min())
    np.testing.assert_array_equal(high[:4], y[4:].max())
    assert fit_all(x, np.full((60, 1), np.nan), 5, policy="drop")[0].status is EstimateStatus.TOO_FEW_RUNS


def test_failures_that_leave_an_input_without_variation_are_a_status():
    x, y = sample(60)
    two_values = np.column_stack([x, np.repeat([0.0, 1.0], 30)])
    failed = np.where(np.arange(60) < 30, np.nan, y)
    model = fit_all(two_values, failed[:, None], 5, policy="drop")[0]
    assert model.status is EstimateStatus.TOO_FEW_RUNS
    assert np.isnan(model.predict_mean(two_values)).all()


@pytest.mark.theory
@pytest.mark.parametrize(("name", "function"), [("ishigami", ishigami), ("sobol_g", sobol_g)])
def test_a_surrogate_in_fourteen_inputs_gives_the_indices_of_the_function(name, function):
    goal, k = REFERENCE["surrogate"], 14
    space = unit_space(k)
    design = latin_hypercube(space, goal["points"], 1)
    model = Kriging.fit(design.unit_points, function(design.points), 1)
    new = np.random.default_rng(99).random((goal["new_points"], k))
    truth = function(new)
    prediction = model.predict(new)
    assert 1.0 - np.mean((prediction.mean - truth) ** 2) / truth.var() >= goal["q2_least"]
    assert abs(model.q2 - goal["q2_least"]) < 0.015
    assert 0.5 < np.std((prediction.mean - truth) / prediction.std) < 2.0
    pick_freeze = sobol_design(space, goal["base_points"], 2)
    result = sobol(pick_freeze, model.predict_mean(pick_freeze.unit_points))
    assert np.abs(result.ST - exact(name, k)[1]).max() <= goal["st_error_most"]
