"""Intervals and Dempster-Shafer structures as distributions, and the boxes that they make."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.uncertainty import DISTRIBUTIONS, Distribution, Factor, FactorSpace, Normal, Uniform
from levelone.uncertainty.distributions import Interval
from levelone.uncertainty.evidence import Evidence, focal_boxes

APART = Evidence(((2.0, 4.0), (-1.0, 0.0)), (0.25, 0.75))
NESTED = Evidence(((0.0, 4.0), (1.0, 2.0)), (0.5, 0.5))
STEPPED = Evidence(((0.0, 1.0), (0.5, 0.5)), (0.5, 0.5))


@pytest.mark.parametrize("item", [Interval(-1.0, 2.0), APART, NESTED, STEPPED], ids=["interval", "apart", "nested", "stepped"])
class TestPlainTreatment:
    def test_mean_is_the_integral_of_the_quantile(self, item: Distribution) -> None:
        u = (np.arange(200_000) + 0.5) / 200_000
        assert item.ppf(u).mean() == pytest.approx(item.mean, abs=2e-5)

    @given(u=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=20))
    def test_quantile_increases_and_ends_at_the_support(self, item: Distribution, u: list[float]) -> None:
        value = item.ppf([0.0, *sorted(u), 1.0])
        assert (np.diff(value) >= 0.0).all()
        assert (value[0], value[-1]) == item.support

    def test_is_a_distribution_that_a_factor_takes(self, item: Distribution) -> None:
        assert isinstance(item, Distribution)
        assert type(item) in DISTRIBUTIONS.values()
        assert item.epistemic  # type: ignore[attr-defined]
        assert FactorSpace([Factor("a", item)]).transform([[0.0], [1.0]]).ravel().tolist() == list(item.support)


def test_quantiles_of_a_mixture_by_hand() -> None:
    # mass 3/4 on -1 to 0, then a gap, then 1/4 on 2 to 4
    assert APART.ppf([0.0, 0.375, 0.74, 0.875, 1.0]) == pytest.approx([-1.0, -0.5, -1.0 + 0.74 / 0.75, 3.0, 4.0], rel=1e-12)
    # density 1/8 on 0 to 4, and 1/2 more on 1 to 2
    assert NESTED.ppf([0.125, 0.4375, 0.75, 0.875]) == pytest.approx([1.0, 1.5, 2.0, 3.0], rel=1e-12)
    # half of the mass exactly at 0.5
    assert STEPPED.ppf([0.25, 0.5, 0.7, 0.75, 0.875]) == pytest.approx([0.5, 0.5, 0.5, 0.5, 0.75], rel=1e-12)


def test_an_interval_is_drawn_from_as_uniform_and_is_not_the_same_statement() -> None:
    u = np.linspace(0.0, 1.0, 11)
    assert Interval(2.0, 5.0).ppf(u).tolist() == Uniform(2.0, 5.0).ppf(u).tolist()
    assert Interval(2.0, 5.0) != Uniform(2.0, 5.0)


def test_order_of_the_intervals_does_not_matter() -> None:
    assert Evidence(((-1.0, 0.0), (2.0, 4.0)), (0.75, 0.25)) == APART
    assert len({APART, Evidence(((-1.0, 0.0), (2.0, 4.0)), (0.75, 0.25))}) == 1


@pytest.mark.parametrize(
    ("build", "field", "says"),
    [
        (lambda: Interval(1.0, 1.0), "Interval.high", "empty"),
        (lambda: Interval(0.0, math.inf), "Interval.high", "finite"),
        (lambda: Evidence(((1.0, 0.0),), (1.0,)), "Evidence.intervals", "low = 1, high = 0"),
        (lambda: Evidence(((0.0, math.nan),), (1.0,)), "Evidence.intervals", "finite"),
        (lambda: Evidence((0.0, 1.0), (1.0,)), "Evidence.intervals", "pairs"),  # type: ignore[arg-type]
        (lambda: Evidence((), ()), "Evidence.intervals", "pairs"),
        (lambda: Evidence(((1.0, 1.0),), (1.0,)), "Evidence.intervals", "no width"),
        (lambda: Evidence(((0.0, 1.0), (0.0, 1.0)), (0.5, 0.5)), "Evidence.intervals", "twice"),
        (lambda: Evidence(((0.0, 1.0), (1.0, 2.0)), (0.5, 0.6)), "Evidence.masses", "sum to 1.1"),
        (lambda: Evidence(((0.0, 1.0), (1.0, 2.0)), (1.0, 0.0)), "Evidence.masses", "positive"),
        (lambda: Evidence(((0.0, 1.0), (1.0, 2.0)), (1.0,)), "Evidence.masses", "each of 2 intervals"),
    ],
)
def test_wrong_structures_are_named(build, field: str, says: str) -> None:
    with pytest.raises(InputError) as error:
        build()
    assert error.value.field == field
    assert says in error.value.problem


class TestFocalBoxes:
    def test_every_combination_has_the_product_of_the_masses(self) -> None:
        # masses and intervals of the two inputs in Dakota's reference manual, continuous_interval_uncertain
        first = Evidence(((2.0, 2.5), (4.0, 5.0), (4.5, 6.0)), (0.25, 0.5, 0.25))
        second = Evidence(((1.0, 5.0), (3.0, 5.0)), (0.4, 0.6))
        boxes = focal_boxes([first, second])
        assert boxes.mass == pytest.approx([0.1, 0.15, 0.2, 0.3, 0.1, 0.15], rel=1e-12)
        assert boxes.low.tolist() == [[a, b] for a in (2.0, 4.0, 4.5) for b in (1.0, 3.0)]
        assert boxes.high.tolist() == [[a, 5.0] for a in (2.5, 5.0, 6.0) for _ in range(2)]

    def test_what_is_no_evidence_is_one_interval(self) -> None:
        boxes = focal_boxes([Uniform(0.0, 1.0), Interval(2.0, 3.0)])
        assert (boxes.low.tolist(), boxes.high.tolist(), boxes.mass.tolist()) == ([[0.0, 2.0]], [[1.0, 3.0]], [1.0])

    @pytest.mark.parametrize(
        ("inputs", "says"),
        [([], "no input is epistemic"), ([Normal(0.0, 1.0)], "no ends"), ([NESTED] * 9, "512 combinations")],
    )
    def test_boxes_that_cannot_be_searched_are_refused(self, inputs: list, says: str) -> None:
        with pytest.raises(InputError, match=says):
            focal_boxes(inputs)
