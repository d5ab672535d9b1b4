from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss
from threadpoolctl import threadpool_limits
from uncertainty_functions import exact, ishigami, sobol_g, unit_space

from levelone.errors import InputError
from levelone.uncertainty import EstimateStatus, latin_hypercube
from levelone.uncertainty.chaos_indices import chaos_indices, jackknife_intervals
from levelone.uncertainty.pce import PolynomialChaos
from levelone.uncertainty.polynomials import evaluate, hyperbolic_terms, neighbours
from levelone.uncertainty.sparse_regression import select

NEW = np.random.default_rng(5).random((5000, 14))


def points(k, n, seed=0):
    return latin_hypercube(unit_space(k), n, seed).points


@pytest.mark.theory
def test_the_polynomials_are_orthonormal():
    terms, _ = hyperbolic_terms(2, 6, 1.0, 100)
    nodes, weights = leggauss(8)
    u = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 2) / 2.0 + 0.5
    weight = np.outer(weights, weights).ravel() / 4.0
    values = evaluate(terms, u)
    np.testing.assert_allclose((values * weight) @ values.T, np.eye(len(terms)), atol=1e-12)
    np.testing.assert_allclose(values @ weight, 0.0, atol=1e-12)


@pytest.mark.theory
@pytest.mark.parametrize(("k", "degree", "size"), [(2, 5, 21), (3, 4, 35), (14, 3, 680)])
def test_total_degree_has_binomially_many_terms(k, degree, size):
    terms, norms = hyperbolic_terms(k, degree, 1.0, 10**6)
    assert len(terms) == size - 1
    assert terms.sum(axis=1).max() == degree
    np.testing.assert_allclose(norms, terms.sum(axis=1))


@settings(max_examples=20, deadline=None)
@given(k=st.integers(1, 4), degree=st.integers(1, 6), norm=st.sampled_from([0.4, 0.5, 0.75, 1.0]))
def test_the_hyperbolic_set_is_what_the_norm_says(k, degree, norm):
    terms, norms = hyperbolic_terms(k, degree, norm, 10**6)
    every = np.stack(np.meshgrid(*[np.arange(degree + 1)] * k, indexing="ij"), axis=-1).reshape(-1, k)
    size = np.sum(every.astype(float) ** norm, axis=1) ** (1.0 / norm)
    expected = every[(size <= degree * (1.0 + 1e-7)) & every.any(axis=1)]
    assert {tuple(term) for term in terms} == {tuple(term) for term in expected}
    assert (np.diff(norms) >= 0.0).all()


def test_a_set_too_large_is_cut_at_a_whole_degree():
    terms, norms = hyperbolic_terms(14, 14, 1.0, 1500)
    assert norms.max() == 3.0
    assert len(terms) == 679


def test_neighbours_are_one_and_two_degrees_beyond_a_chosen_term():
    found = neighbours(np.array([[1, 0], [0, 1]]), np.array([[0, 1]]))
    assert {tuple(term) for term in found} == {(1, 0), (0, 1), (1, 1), (2, 1), (0, 2), (0, 3)}


@pytest.mark.oracle
def test_a_selected_term_is_the_one_that_lowers_the_residual_most():
    x = points(3, 60)
    terms, _ = hyperbolic_terms(3, 4, 1.0, 200)
    values, y = evaluate(terms, x), np.exp(x[:, 0]) * (1.0 + x[:, 1] * x[:, 2])
    chosen, _ = select(values, y)
    matrix = np.ones((60, 1))
    for row in chosen[:4]:
        rest = [np.linalg.lstsq(np.column_stack([matrix, value]), y, rcond=None)[1] for value in values]
        rest = [r[0] if r.size else np.inf for r in rest]
        assert int(np.argmin(rest)) == row
        matrix = np.column_stack([matrix, values[row]])


@pytest.mark.theory
def test_a_polynomial_is_found_exactly_with_its_indices():
    k, x = 6, points(6, 120)
    terms = np.array([[1, 0, 0, 0, 0, 0], [0, 2, 0, 0, 0, 0], [1, 0, 3, 0, 0, 0], [1, 1, 1, 0, 0, 0]])
    coefficients = np.array([2.0, 1.0, 0.5, 0.25])
    model = PolynomialChaos.fit(x, 7.0 + coefficients @ evaluate(terms, x), 0)
    order = [int(np.flatnonzero((model.terms == term).all(axis=1))[0]) for term in terms]
    assert len(model.terms) == 4
    np.testing.assert_allclose(model.coefficients[order], coefficients, rtol=1e-10)
    assert model.mean == pytest.approx(7.0, rel=1e-12)
    variance = 4.0 + 1.0 + 0.25 + 0.0625
    assert model.variance == pytest.approx(variance, rel=1e-10)
    np.testing.assert_allclose(model.S1, np.array([4.0, 1.0, 0.0, 0.0, 0.0, 0.0]) / variance, atol=1e-10)
    np.testing.assert_allclose(model.ST, np.array([4.3125, 1.0625, 0.3125, 0.0, 0.0, 0.0]) / variance, atol=1e-10)
    expected = np.full((k, k), np.nan)
    expected[np.triu_indices(k, 1)] = 0.0
    expected[0, 2] = 0.25 / variance
    np.testing.assert_allclose(model.S2, expected, atol=1e-10)
    assert model.q2 > 1.0 - 1e-12


@pytest.mark.oracle
def test_coefficients_of_given_terms_are_those_of_openturns():
    ot = pytest.importorskip("openturns", reason="OpenTURNS is not installed")
    x = points(3, 80)
    y = ishigami(x)
    inputs = ot.JointDistribution([ot.Uniform(0.0, 1.0)] * 3)
    numbering = ot.LinearEnumerateFunction(3)
    basis = ot.OrthogonalProductPolynomialFactory([ot.LegendreFactory()] * 3, numbering)
    size = 35
    strategy = ot.FixedStrategy(basis, size)
    algorithm = ot.FunctionalChaosAlgorithm(ot.Sample(x), ot.Sample(y[:, None]), inputs, strategy, ot.LeastSquaresStrategy())
    algorithm.run()
    result = algorithm.getResult()
    theirs = np.array(result.getCoefficients()).ravel()
    indices = [np.array(numbering(int(i)), dtype=int) for i in result.getIndices()]
    model = PolynomialChaos.condition(x, y, np.array([index for index in indices if index.any()]), 0)
    ours = dict(zip(map(tuple, model.terms), model.coefficients, strict=True)) | {(0, 0, 0): model.mean}
    # OpenTURNS' Legendre polynomials on -1 to 1 are orthonormal under the uniform density: the same functions.
    np.testing.assert_allclose([ours[tuple(index)] for index in indices], theirs, rtol=1e-8, atol=1e-8)
    shares = ot.FunctionalChaosSobolIndices(result)
    np.testing.assert_allclose(model.S1, [shares.getSobolIndex(j) for j in range(3)], atol=1e-8)
    np.testing.assert_allclose(model.ST, [shares.getSobolTotalIndex(j) for j in range(3)], atol=1e-8)
    np.testing.assert_allclose(model.S2[0, 2], shares.getSobolIndex([0, 2]), atol=1e-8)


@pytest.mark.theory
def test_ishigami_among_fourteen_inputs():
    x = points(14, 150)
    model = PolynomialChaos.fit(x, ishigami(x), 0)
    S1, ST = exact("ishigami", 14)
    np.testing.assert_allclose(model.S1, S1, atol=1e-3)
    np.testing.assert_allclose(model.ST, ST, atol=1e-3)
    assert model.S2[0, 2] == pytest.approx(ST[2], abs=1e-3)
    assert model.mean == pytest.approx(3.5, abs=0.01)


@pytest.mark.theory
def test_kinks_are_reflected_in_q2_and_in_the_intervals():
    x = points(14, 200, 3)
    model = PolynomialChaos.fit(x, sobol_g(x), 3)
    S1, ST = exact("sobol_g", 14)
    truth = sobol_g(NEW)
    q2 = 1.0 - np.mean((model.predict_mean(NEW) - truth) ** 2) / truth.var()
    assert q2 > 0.97
    assert model.q2 == pytest.approx(q2, abs=0.01)
    assert ((model.S1_ci[:, 0] <= S1) & (model.S1_ci[:, 1] >= S1)).all()
    assert ((model.ST_ci[:, 0] <= ST) & (model.ST_ci[:, 1] >= ST)).all()
    assert np.diff(model.ST_ci[:4], axis=1).max() < 0.15


def test_noise_is_not_explained():
    x = points(14, 200)
    y = np.random.default_rng(8).standard_normal(200)
    model = PolynomialChaos.fit(x, y, 0)
    assert model.q2 < 0.1
    assert len(model.terms) <= 3
    # Nothing is known: whatever is said of an index, its interval leaves nearly everything open.
    assert np.diff(model.ST_ci, axis=1).min() > 0.9


@pytest.mark.theory
def test_leave_one_out_in_closed_form_is_that_of_refits():
    x = points(2, 30)
    y = np.sin(3.0 * x[:, 0]) + x[:, 1]
    terms = np.array([[1, 0], [0, 1], [2, 0]])
    model = PolynomialChaos.condition(x, y, terms, 0)
    for i in range(30):
        kept = np.arange(30) != i
        without = PolynomialChaos.condition(x[kept], y[kept], terms, 0).predict_mean(x[i : i + 1])[0]
        assert model.loo_residual[i] == pytest.approx(y[i] - without, rel=1e-9, abs=1e-12)
    assert model.q2_loo == pytest.approx(1.0 - np.sum(model.loo_residual**2) / np.sum((y - y.mean()) ** 2), rel=1e-12)


@pytest.mark.theory
def test_the_interval_is_the_jackknife_and_what_is_unexplained():
    terms = np.array([[1, 0], [0, 1]])
    refits = [chaos_indices(terms, np.array([c, 1.0])) for c in (1.0, 1.1, 0.9, 1.0)]
    whole = chaos_indices(terms, np.array([1.0, 1.0]))
    intervals = jackknife_intervals(whole, refits, 0.2)
    first = np.array([c**2 / (c**2 + 1.0) for c in (1.0, 1.1, 0.9, 1.0)])
    error = np.sqrt(3.0 / 4.0 * np.sum((first - first.mean()) ** 2))
    t_three = 3.182446305
    np.testing.assert_allclose(intervals.S1[0], [0.4 - t_three * error, 0.6 + t_three * error], rtol=1e-8)
    assert np.isnan(intervals.S2[1, 0]).all()


@settings(max_examples=10, deadline=None)
@given(scale=st.floats(1e-6, 1e6), shift=st.floats(-1e3, 1e3))
def test_units_of_the_response_change_nothing_but_the_units(scale, shift):
    x = points(3, 60)
    y = np.exp(x[:, 0]) * (1.0 + x[:, 1])
    plain, other = PolynomialChaos.fit(x, y, 0), PolynomialChaos.fit(x, scale * y + scale * shift, 0)
    assert {tuple(t) for t in plain.terms} == {tuple(t) for t in other.terms}
    np.testing.assert_allclose(other.ST, plain.ST, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(other.predict_mean(x), scale * (plain.predict_mean(x) + shift), rtol=1e-8, atol=1e-8 * scale)


def test_order_of_the_inputs_does_not_matter():
    x = points(5, 80)
    y = np.exp(x[:, 0]) * (1.0 + x[:, 1]) + x[:, 4] ** 3
    swap = np.array([4, 2, 0, 1, 3])
    plain, other = PolynomialChaos.fit(x, y, 0), PolynomialChaos.fit(x[:, swap], y, 0)
    np.testing.assert_allclose(other.ST, plain.ST[swap], rtol=1e-9, atol=1e-12)


def test_threads_of_blas_change_no_digit():
    x = points(14, 100)
    with threadpool_limits(2):
        many = PolynomialChaos.fit(x, sobol_g(x), 1)
    with threadpool_limits(1):
        one = PolynomialChaos.fit(x, sobol_g(x), 1)
    np.testing.assert_array_equal(many.coefficients, one.coefficients)
    np.testing.assert_array_equal(many.ST_ci, one.ST_ci)


def test_the_seed_moves_the_folds_only():
    x = points(14, 100)
    a, b = (PolynomialChaos.fit(x, sobol_g(x), seed) for seed in (0, 1))
    np.testing.assert_array_equal(a.coefficients, b.coefficients)
    assert a.q2 != b.q2


def test_degenerate_responses_are_undefined_with_a_reason():
    x = points(3, 20)
    constant = PolynomialChaos.fit(x, np.full(20, 2.5), 0)
    assert constant.status is EstimateStatus.CONSTANT_RESPONSE
    np.testing.assert_array_equal(constant.predict_mean(x), 2.5)
    assert np.isnan(constant.S1).all()
    assert np.isnan(constant.ST_ci).all()
    assert np.isnan(constant.q2)
    few = PolynomialChaos.fit(x[:5], x[:5, 0], 0)
    assert few.status is EstimateStatus.TOO_FEW_RUNS
    assert np.isnan(few.predict_mean(x)).all()
    assert np.isnan(few.mean)


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        (np.full((20, 2), 0.5), np.arange(20.0), "never varies"),
        (np.full((20, 2), 0.5), np.arange(19.0), "shapes"),
        (np.full((20, 2), 1.5), np.arange(20.0), "unit cube"),
        (np.full((20, 2), np.nan), np.arange(20.0), "unit cube"),
        (np.full((20, 2), 0.5), np.append(np.arange(19.0), np.nan), "failed runs"),
    ],
)
def test_bad_data_are_refused(x, y, message):
    with pytest.raises(InputError, match=message):
        PolynomialChaos.fit(x, y, 0)


@pytest.mark.parametrize(
    ("terms", "message"),
    [([[0, 0]], "constant"), ([[1, 0], [1, 0]], "twice"), ([[1, -1]], "negative"), ([[1, 0, 0]], "shape")],
)
def test_bad_terms_are_refused(terms, message):
    x = points(2, 20)
    with pytest.raises(InputError, match=message):
        PolynomialChaos.condition(x, x[:, 0], terms, 0)


def test_more_terms_than_runs_are_refused():
    x = points(2, 12)
    terms, _ = hyperbolic_terms(2, 4, 1.0, 100)
    with pytest.raises(InputError, match="14 terms"):
        PolynomialChaos.condition(x, x[:, 0], terms, 0)


def test_one_run_that_differs_explains_nothing():
    x = points(4, 40)
    y = np.full(40, 0.1)
    y[7] = 1.0
    model = PolynomialChaos.fit(x, y, 0)
    assert model.q2 < 0.1
    assert np.diff(model.ST_ci, axis=1).min() > 0.9


def test_runs_that_bear_out_no_term_are_too_few():
    corner = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
    x = np.vstack([np.tile(corner, (5, 1))])
    chosen, criterion = select(evaluate(np.array([[1, 0], [0, 1]]), x), np.tile([1.0, -1.0, -1.0, 1.0], 5))
    assert chosen.size == 0
    assert criterion == np.inf


def test_terms_that_the_runs_cannot_tell_apart_are_refused():
    x = np.repeat([[0.0, 0.2], [1.0, 0.7]], 10, axis=0)
    with pytest.raises(InputError, match="tell them apart"):
        PolynomialChaos.condition(x, x[:, 0], [[1, 0], [0, 1]], 0)


def test_inputs_of_two_values_are_fitted_by_a_straight_line_in_each():
    x = np.random.default_rng(0).integers(0, 2, size=(60, 3)).astype(float)
    model = PolynomialChaos.fit(x, 1.0 + x[:, 0] + 2.0 * x[:, 0] * x[:, 1], 0)
    np.testing.assert_allclose(model.predict_mean(x), 1.0 + x[:, 0] + 2.0 * x[:, 0] * x[:, 1], atol=1e-4)


def test_points_to_predict_are_checked():
    x = points(2, 20)
    model = PolynomialChaos.fit(x, x[:, 0], 0)
    with pytest.raises(InputError, match=r"\[n, 2\]"):
        model.predict_mean(np.zeros((3, 1)))
