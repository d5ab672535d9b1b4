from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from levelone.errors import InputError
from levelone.uncertainty import (
    DISTRIBUTIONS,
    Discrete,
    Distribution,
    LogNormal,
    Normal,
    Triangular,
    TruncatedNormal,
    Uniform,
    uniform_around,
)

ONE_OF_EACH = [
    Uniform(-2.0, 3.0),
    Normal(1.5, 0.2),
    TruncatedNormal(0.0, 1.0, -0.5, 2.0),
    Triangular(-1.0, 0.5, 1.0),
    Triangular(0.0, 0.0, 2.0),
    LogNormal(0.3, 0.4),
    Discrete((3.0, -1.0, 7.0), (1.0, 2.0, 1.0)),
]
ids = [type(item).__name__ for item in ONE_OF_EACH]


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("ours", "scipys"),
    [
        (Uniform(-2.0, 3.0), stats.uniform(-2.0, 5.0)),
        (Normal(1.5, 0.2), stats.norm(1.5, 0.2)),
        (Triangular(-1.0, 0.5, 1.0), stats.triang(0.75, -1.0, 2.0)),
        (Triangular(0.0, 0.0, 2.0), stats.triang(0.0, 0.0, 2.0)),
        (Triangular(0.0, 2.0, 2.0), stats.triang(1.0, 0.0, 2.0)),
        (LogNormal(0.3, 0.4), stats.lognorm(0.4, scale=math.exp(0.3))),
        (TruncatedNormal(0.0, 1.0, -0.5, 2.0), stats.truncnorm(-0.5, 2.0)),
    ],
)
def test_quantiles_and_means_agree_with_scipy(ours, scipys):
    u = np.linspace(0.001, 0.999, 97)
    np.testing.assert_allclose(ours.ppf(u), scipys.ppf(u), rtol=1e-12, atol=1e-14)
    assert ours.mean == pytest.approx(scipys.mean(), rel=1e-12)
    assert ours.support == pytest.approx(scipys.support())


@pytest.mark.parametrize("distribution", ONE_OF_EACH, ids=ids)
def test_mean_is_the_integral_of_the_quantile(distribution):
    u = (np.arange(200_000) + 0.5) / 200_000
    assert distribution.ppf(u).mean() == pytest.approx(distribution.mean, abs=2e-4)


@pytest.mark.parametrize("distribution", ONE_OF_EACH, ids=ids)
@given(u=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=20))
def test_quantile_increases_and_stays_in_the_support(distribution, u):
    value = distribution.ppf(np.sort(u))
    low, high = distribution.support
    assert (value[1:] >= value[:-1]).all()
    assert (value >= low).all()
    assert (value <= high).all()


@pytest.mark.parametrize("distribution", ONE_OF_EACH, ids=ids)
def test_each_is_a_distribution_that_hashes_and_compares(distribution):
    assert isinstance(distribution, Distribution)
    assert type(distribution) in DISTRIBUTIONS.values()
    assert len({distribution, distribution}) == 1


def test_truncation_far_in_the_tail_keeps_its_digits():
    # P(X > x | X > 10) of a standard normal variable falls like exp(-10 (x - 10)): the median lies near 10 + ln 2 / 10.
    value = TruncatedNormal(0.0, 1.0, 10.0, 12.0).ppf(np.array([0.0, 0.5, 1.0]))
    assert value[0] == pytest.approx(10.0)
    assert value[1] == pytest.approx(10.0 + math.log(2.0) / 10.0, abs=2e-3)
    assert value[2] == 12.0


def test_discrete_shares_of_a_balanced_set_are_exact():
    u = np.arange(1024) / 1024
    values, counts = np.unique(Discrete((2.0, 0.0, 1.0), (1.0, 2.0, 1.0)).ppf(u), return_counts=True)
    assert values.tolist() == [0.0, 1.0, 2.0]
    assert counts.tolist() == [512, 256, 256]


@pytest.mark.parametrize(
    ("build", "field"),
    [
        (lambda: Uniform(2.0, 1.0), "Uniform.high"),
        (lambda: Uniform(1.0, 1.0), "Uniform.high"),
        (lambda: Uniform(math.nan, 1.0), "Uniform.low"),
        (lambda: Uniform("0", 1.0), "Uniform.low"),
        (lambda: Normal(0.0, 0.0), "Normal.std"),
        (lambda: Normal(0.0, math.inf), "Normal.std"),
        (lambda: TruncatedNormal(0.0, 1.0, 1.0, -1.0), "TruncatedNormal.high"),
        (lambda: Triangular(0.0, 3.0, 2.0), "Triangular.mode"),
        (lambda: LogNormal(0.0, -1.0), "LogNormal.sigma"),
        (lambda: Discrete((1.0,)), "Discrete.values"),
        (lambda: Discrete((1.0, 1.0)), "Discrete.values"),
        (lambda: Discrete((1.0, 2.0), (1.0, 0.0)), "Discrete.weights"),
        (lambda: Discrete((1.0, 2.0), (1.0,)), "Discrete.weights"),
    ],
)
def test_wrong_parameters_are_named(build, field):
    with pytest.raises(InputError) as error:
        build()
    assert error.value.field == field


def test_ranges_about_a_nominal_value():
    assert uniform_around(2.0, -0.5, 0.25) == Uniform(1.5, 2.25)
    assert uniform_around(2.0, -0.5, 0.25, "relative") == Uniform(1.0, 2.5)
    assert uniform_around(0.0, 0.0, 0.03) == Uniform(0.0, 0.03)


def test_a_relative_range_of_a_negative_value_is_not_reversed():
    assert uniform_around(-0.5, -0.2, 0.4, "relative") == Uniform(-0.7, -0.4)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0.0, -0.2, 0.2, "relative"), "zero"),
        ((1.0, 0.2, -0.2, "relative"), "reversed"),
        ((1.0, 0.2, 0.2, "absolute"), "reversed or empty"),
        ((math.nan, -0.2, 0.2, "absolute"), "finite"),
        ((1.0, -0.2, 0.2, "percent"), "percent"),
    ],
)
def test_ranges_that_mean_nothing_are_refused(arguments, words):
    with pytest.raises(InputError, match=words) as error:
        uniform_around(*arguments, field="factor.M.range")
    assert error.value.field == "factor.M.range"
