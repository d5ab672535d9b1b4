"""Bounds over unknown factors: against closed forms with a model whose responses are linear, and on the flight model itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from levelone.campaign import build_model
from levelone.campaign.analysis import Decomposition
from levelone.campaign.delay import delay_section
from levelone.campaign.epistemic import epistemic_section
from levelone.campaign.epistemic_search import nested_of
from levelone.campaign.epistemic_statistics import Readings, thresholds_over
from levelone.campaign.froude import judged
from levelone.campaign.models.builtin import CRITERIA, RESPONSES, Assessment, BuiltinModel
from levelone.campaign.sampling import Sampled
from levelone.campaign.sections import run_sections
from levelone.config.epistemic_table import Epistemic
from levelone.config.study_file import Study
from levelone.errors import InputError
from levelone.handling.levels import Level
from levelone.uncertainty import FactorSpace, Kriging, Responses, fit_all, latin_hypercube
from levelone.uncertainty.distributions import Interval
from levelone.uncertainty.evidence import Evidence

FloatArray = NDArray[np.float64]
PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "results.md").read_text(encoding="utf-8")
UNKNOWN = {"C_L0": Interval(0.6, 0.9), "C_mq": Interval(-19.0, -13.0)}
KEPT = ("M", "tau_d", "C_L0", "C_mq")


def with_unknowns(study: Study, distributions: dict, inner: int, outer: int = 8, keep: tuple[str, ...] = KEPT) -> Study:
    """The study with a few of its factors, some of them epistemic."""
    columns = [study.space.index(name) for name in keep]
    factors = [study.space.factors[j] for j in columns]
    space = FactorSpace(replace(each, distribution=distributions.get(each.name, each.distribution)) for each in factors)
    bare = replace(study, amplitudes=(), cases=(), coupling=None, deceleration=None, froude=None)
    epistemic = Epistemic(tuple(name for name in keep if name in distributions), outer, inner, "why")
    targets = tuple(study.targets[j] for j in columns)
    return replace(bare, space=space, targets=targets, nominal=study.nominal[columns], epistemic=epistemic)


@dataclass(frozen=True)
class Linear:
    """In place of the flight model: zeta = 0.35 + slope * (C_mq + 16), everything else the same number in every run."""

    study: Study
    slope: float = 0.01
    fails: Callable[[FloatArray], NDArray[np.bool_]] = lambda points: np.zeros(len(points), dtype=bool)
    threads: int | None = None

    def responses(self, points: FloatArray) -> FloatArray:
        values = np.ones((len(points), len(RESPONSES)))
        place = {name: j for j, name in enumerate(self.study.space.names)}
        zeta = 0.35 + self.slope * (points[:, place["C_mq"]] + 16.0) + 2.0 * points[:, place["tau_d"]]
        values[:, list(RESPONSES).index("zeta")] = np.where(self.fails(points), np.nan, zeta)
        return values

    def assess(self, points: FloatArray, progress: Callable[[int], None] = lambda done: None) -> Assessment:
        responses = Responses.from_values(self.responses(points), tuple(RESPONSES))
        levels, extrapolated = judged(responses, self.study.boundaries, self.study.task)
        progress(len(points))
        return Assessment(responses, levels, extrapolated, {})


def section(study: Study, model: Linear) -> dict:
    sample = latin_hypercube(study.space, 40, 3)
    assessed = model.assess(sample.points)
    fitted = fit_all(sample.points, assessed.responses.values, 1, policy="drop", correlation="squared_exponential", starts=1)
    return epistemic_section(study, model, assessed, dict(zip(RESPONSES, fitted, strict=True)), 7)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def found(study: Study) -> tuple[Study, dict]:
    small = with_unknowns(study, UNKNOWN, inner=50)
    return small, section(small, Linear(small))


class TestClosedForm:
    def test_mean_lies_between_the_ends_of_the_unknown_coefficient(self, found) -> None:
        study, out = found
        delay = nested_of(study, 7).inner[:, 1].mean()
        expected = [0.35 + 0.01 * (end + 16.0) + 2.0 * delay for end in (-19.0, -13.0)]
        assert out["responses"]["zeta"]["mean_flown"] == pytest.approx(expected, rel=1e-12)
        assert out["responses"]["zeta"]["mean"] == pytest.approx(expected, rel=1e-4)
        assert delay == pytest.approx(0.015, abs=0.0005)

    def test_distribution_of_the_delay_is_shifted_by_them(self, found) -> None:
        """Delay uniform from 0 to 0.03 s moves zeta by 0 to 0.06: the bounds are those of two uniform variables."""
        entry = found[1]["responses"]["zeta"]
        cuts = np.array(entry["thresholds"])
        for key, end in (("lower_flown", -13.0), ("upper_flown", -19.0)):
            start = 0.35 + 0.01 * (end + 16.0)
            np.testing.assert_allclose(entry[key], np.clip((cuts - start) / 0.06, 0.0, 1.0), atol=1.0 / 50 + 1e-9)
        assert entry["range_flown"][0] == pytest.approx(0.32, abs=0.06 / 50)
        assert entry["range_flown"][1] == pytest.approx(0.44, abs=0.06 / 50)

    def test_shares_of_levels_follow_from_them(self, found) -> None:
        """Level 1 needs zeta of 0.35: never at -19 for delays below 0.015 s, always at -13."""
        block = found[1]["levels"]["dynamic_stability"]["level_1"]
        assert (block["lower_flown"], block["upper_flown"]) == (pytest.approx(0.5, abs=0.02), 1.0)
        assert block["lower"] <= block["plain"] <= block["upper"]
        # P(0.01 (C_mq + 16) + 2 tau_d >= 0) of two uniform variables: one minus a triangle of 3 by 0.015 s over 6 by 0.03 s
        assert block["plain"] == pytest.approx(0.875, abs=0.02)

    def test_shares_sum_to_one_in_the_plain_treatment(self, found) -> None:
        for block in found[1]["levels"].values():
            assert sum(share["plain"] for share in block.values()) == pytest.approx(1.0, rel=1e-12)

    def test_every_point_flown_lies_in_its_box_and_is_counted(self, found) -> None:
        out = found[1]
        assert out["flown_runs"] == 50 * len(out["flown"])
        assert {point["values"]["C_mq"] for point in out["flown"]} >= {-19.0, -13.0}
        assert all(0.6 <= point["values"]["C_L0"] <= 0.9 for point in out["flown"])
        assert out["boxes"] == [{"mass": 1.0, "low": {"C_L0": 0.6, "C_mq": -19.0}, "high": {"C_L0": 0.9, "C_mq": -13.0}}]
        assert (out["factors"], out["aleatory"]) == (["C_L0", "C_mq"], ["M", "tau_d"])
        assert (out["inner"], out["outer"], out["basis"]) == (50, 8, "why")
        assert out["points"]["corner"] == 4
        assert sum(out["extremes_by"].values()) == pytest.approx(1.0, rel=1e-12)

    def test_response_that_never_varies_has_a_box_without_width(self, found) -> None:
        entry = found[1]["responses"]["omega_n"]
        assert entry["range"] == entry["range_flown"] == [1.0, 1.0]
        assert entry["lower"].tolist() == entry["upper"].tolist()
        assert "does not vary" in entry["status"]

    def test_every_key_is_described(self, found) -> None:
        out = found[1]
        keys = {*out, *out["boxes"][0], *out["flown"][0], *out["responses"]["zeta"], *out["levels"]["worst"]["level_1"]}
        described = PAGE[PAGE.index("### epistemic") : PAGE.index("## monte_carlo.nc")]
        assert {key for key in keys - {"unit"} if f"`{key}`" not in described} == set()

    def test_same_seed_gives_the_same_numbers(self, found) -> None:
        study, out = found
        again = section(study, Linear(study))
        assert again["points"] == out["points"]
        assert again["levels"] == out["levels"]


def test_evidence_weighs_the_bounds_of_its_boxes(study: Study) -> None:
    small = with_unknowns(study, {"C_mq": Evidence(((-19.0, -13.0), (-8.0, -7.0)), (0.75, 0.25))}, inner=20)
    out = section(small, Linear(small))
    delay = nested_of(small, 7).inner[:, 1].mean()
    low, high = 0.75 * -19.0 + 0.25 * -8.0, 0.75 * -13.0 + 0.25 * -7.0
    expected = [0.35 + 0.01 * (end + 16.0) + 2.0 * delay for end in (low, high)]
    assert out["responses"]["zeta"]["mean_flown"] == pytest.approx(expected, rel=1e-12)
    assert [box["mass"] for box in out["boxes"]] == [0.75, 0.25]
    assert {point["box"] for point in out["flown"]} == {0, 1}


def test_with_nothing_left_to_vary_shares_are_zero_or_one(study: Study) -> None:
    unknown = {"M": Interval(6.5, 7.5), "tau_d": Interval(0.0, 0.03), **UNKNOWN}
    small = with_unknowns(study, unknown, inner=1)
    out = section(small, Linear(small))
    assert out["inner"] == 1
    assert out["aleatory"] == []
    entry = out["responses"]["zeta"]
    assert entry["range_flown"] == pytest.approx([0.32, 0.44], rel=1e-12)
    assert entry["mean_flown"] == entry["range_flown"]
    for key in ("lower", "upper", "lower_flown", "upper_flown"):
        assert set(entry[key].tolist()) <= {0.0, 1.0}
    ends = [{share[key] for share in block.values() for key in ("lower_flown", "upper_flown")} for block in out["levels"].values()]
    assert set().union(*ends) == {0.0, 1.0}
    assert out["levels"]["dynamic_stability"]["level_1"]["lower_flown"] == 0.0
    assert out["levels"]["dynamic_stability"]["level_1"]["upper_flown"] == 1.0


class TestFailures:
    """Runs with a mass above 7.25 kg fail: a quarter of the aleatory sample, wherever the unknown factors are."""

    @staticmethod
    def heavy(points: FloatArray) -> NDArray[np.bool_]:
        return points[:, 0] > 7.25

    def test_flown_failures_are_a_category_of_their_own_and_widen_the_box(self, study: Study) -> None:
        small = with_unknowns(study, UNKNOWN, inner=40)
        out = section(replace(small, policy="drop"), Linear(small, fails=self.heavy))
        entry = out["responses"]["zeta"]
        assert entry["failed_flown"] == pytest.approx([0.25, 0.25], abs=1e-12)
        assert out["levels"]["dynamic_stability"]["failed"]["lower_flown"] == pytest.approx(0.25, abs=1e-12)
        assert entry["lower_flown"][-1] == pytest.approx(0.75, abs=1e-12)
        assert entry["upper_flown"][0] == pytest.approx(0.25, abs=1e-12)
        assert all(point["failed"] == pytest.approx(0.25) for point in out["flown"])

    def test_refused_failures_leave_no_surrogate_and_nothing_is_known(self, study: Study) -> None:
        small = with_unknowns(replace(study, policy="refuse"), UNKNOWN, inner=40)
        out = section(small, Linear(small, fails=self.heavy))
        entry = out["responses"]["zeta"]
        assert entry["status"].startswith("refused")
        assert np.isnan([entry["q2"], *entry["mean"], entry["mean_plain"], *entry["range"], *entry["plain"]]).all()
        assert set(entry["lower"].tolist()) == {0.0}
        assert set(entry["upper"].tolist()) == {1.0}
        assert out["levels"]["dynamic_stability"]["failed"]["lower"] == 1.0
        assert out["responses"]["omega_n"]["range"] == [1.0, 1.0]


class TestReadings:
    def test_numbers_by_hand(self) -> None:
        readings = Readings(("a", "b"), np.array([[0.0, 2.0], [0.0, 9.0]]))
        values = np.array([[[1.0, 5.0], [3.0, math.nan]], [[math.nan, 7.0], [math.nan, 7.0]]])
        levels = {name: np.array([Level.LEVEL_1, Level.LEVEL_2, Level.UNDEFINED, Level.OUTSIDE]) for name in CRITERIA}
        found = readings.of(values, levels)
        np.testing.assert_array_equal(found[:, readings.columns("mean")], [[2.0, 5.0], [math.nan, 7.0]])
        np.testing.assert_array_equal(found[:, readings.columns("min")], [[1.0, 5.0], [math.nan, 7.0]])
        np.testing.assert_array_equal(found[:, readings.columns("max")], [[3.0, 5.0], [math.nan, 7.0]])
        np.testing.assert_array_equal(found[:, readings.columns("failed")], [[0.0, 0.5], [1.0, 0.0]])
        np.testing.assert_array_equal(found[:, readings.columns("below")[0]], [[0.0, 0.5], [0.0, 0.0]])
        np.testing.assert_array_equal(found[:, readings.columns("below_or_failed")[1]], [[0.5, 1.0], [0.0, 1.0]])
        expected = [[0.5, 0.5, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.5, 0.5]]
        for i in range(len(CRITERIA)):
            np.testing.assert_array_equal(found[:, readings.columns("levels")[i]], expected)

    def test_thresholds_reach_beyond_the_range(self) -> None:
        cuts = thresholds_over(np.array([1.0, 5.0, np.inf]), np.array([2.0, 5.0, -np.inf]))
        assert cuts[0, 0] < 1.0 < 2.0 < cuts[0, -1]
        assert cuts[1, 0] < 5.0 < cuts[1, -1]
        assert np.isfinite(cuts).all()


@pytest.fixture(scope="module")
def flown(study: Study) -> tuple[Study, BuiltinModel, Sampled]:
    small = with_unknowns(study, {"C_mq": UNKNOWN["C_mq"]}, inner=6, outer=4)
    model, sample = build_model(small), latin_hypercube(small.space, 24, 3)
    assessed = model.assess(sample.points)
    fitted = fit_all(sample.points, assessed.responses.values, 1, policy="drop", correlation="squared_exponential", starts=1)
    found = Decomposition(fitted, (), {})
    return small, model, Sampled(assessed, sample, assessed, sample, assessed, assessed, found)


class TestFlightModel:
    def test_section_is_run_where_the_study_asks_for_it(self, flown) -> None:
        study, model, sampled = flown
        out = run_sections(study, model, sampled, 5, lambda stage, done, total: None).results
        assert set(out) == {"without_delay", "epistemic"}
        assert out["without_delay"].keys() == delay_section(study, model, sampled.sample).keys()
        without = run_sections(replace(study, epistemic=None), model, sampled, 5, lambda stage, done, total: None).results
        assert "epistemic" not in without

        # what is said to have been flown is what a flight of these points gives
        block, nested = out["epistemic"], nested_of(study, 5)
        point = block["flown"][0]["values"]["C_mq"]
        again = model.assess(nested.points(np.array([[point]])))
        low, high = block["responses"]["zeta"]["mean_flown"]
        assert low - 1e-12 <= again.responses.column("zeta").mean() <= high + 1e-12
        ends = [model.assess(nested.points(np.array([[each["values"]["C_mq"]]]))) for each in block["flown"]]
        means = [end.responses.column("zeta").mean() for end in ends]
        assert (min(means), max(means)) == pytest.approx((low, high), rel=1e-12)

    def test_study_without_the_section_is_refused(self, flown) -> None:
        study, model, sampled = flown
        none: dict[str, Kriging] = {}
        with pytest.raises(InputError, match="the study has no such section"):
            epistemic_section(replace(study, epistemic=None), model, sampled.assessed, none, 5)
