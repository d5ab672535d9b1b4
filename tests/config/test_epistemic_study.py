"""Intervals, evidence and the section [epistemic] in study files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from levelone.config.epistemic_table import epistemic_of
from levelone.config.study_file import load_study
from levelone.config.study_schema import EpistemicTable
from levelone.errors import InputError
from levelone.uncertainty import FactorSpace, Uniform
from levelone.uncertainty.distributions import Interval
from levelone.uncertainty.evidence import Evidence

SHIPPED = Path(__file__).parents[2] / "studies" / "epistemic" / "study.toml"
MASS = 'range = [-0.5, 0.5]\nkind = "absolute"\n'
SECTION = '[epistemic]\nouter = 8\ninner = 16\nassumed = "a test"\n\n[[factor]]\nname = "M"'
FIRST = '[[factor]]\nname = "M"'


def loaded(study_file, mass: str = MASS, section: str = SECTION):
    return load_study(study_file((MASS, mass), (FIRST, section)))


def refused(study_file, **changes: str) -> str:
    with pytest.raises(InputError) as error:
        loaded(study_file, **changes)
    return str(error.value)


class TestDistributions:
    def test_interval_is_given_as_a_range_about_the_value(self, study_file) -> None:
        study = loaded(study_file, 'distribution = "interval"\n' + MASS)
        assert study.space["M"].distribution == Interval(6.5, 7.5)
        assert study.epistemic is not None
        assert study.epistemic.factors == ("M",)
        assert (study.epistemic.outer, study.epistemic.inner, study.epistemic.basis) == (8, 16, "assumed: a test")
        assert ("epistemic", "a test") in study.assumed

    def test_evidence_is_converted_to_the_unit_of_its_target(self, study_file) -> None:
        path = study_file(
            ('value = 7.0\nunit = "kg"\n' + MASS,
             'value = 7000\nunit = "g"\ndistribution = "evidence"\n'
             "intervals = [[6500, 7000], [6800, 7500]]\nmasses = [0.25, 0.75]\n"),
        )  # fmt: skip
        assert load_study(path).space["M"].distribution == Evidence(((6.5, 7.0), (6.8, 7.5)), (0.25, 0.75))

    @pytest.mark.parametrize(
        ("given", "says"),
        [
            ("", "factor.M.intervals: missing: an evidence distribution takes intervals, masses"),
            ("intervals = [[6.5, 7.5]]\n", "factor.M.masses: missing"),
            ("intervals = [[7.5, 6.5]]\nmasses = [1.0]\n", "factor.M.intervals: range reversed: low = 7.5, high = 6.5"),
            ("intervals = [[6.5, 7.5]]\nmasses = [0.5]\n", "factor.M.masses: (0.5,) sum to 0.5; they must sum to 1"),
            ("intervals = [[6.5, 7.5, 8.0]]\nmasses = [1.0]\n", "factor.M.intervals.1"),
            ("intervals = [[6.5, nan]]\nmasses = [1.0]\n", "factor.M.intervals.1.2"),
            ("intervals = [[6.5, 7.5]]\nmasses = [1.0]\n" + MASS, "factor.M.kind: has no place here"),
        ],
    )
    def test_wrong_evidence_is_named(self, study_file, given: str, says: str) -> None:
        assert says in refused(study_file, mass='distribution = "evidence"\n' + given)

    def test_unknown_distribution_gets_the_closest_name(self, study_file) -> None:
        assert "did you mean 'interval'?" in refused(study_file, mass='distribution = "intervall"\n' + MASS)

    def test_interval_without_a_range_says_what_it_takes(self, study_file) -> None:
        assert "an interval distribution takes range, kind" in refused(study_file, mass='distribution = "interval"\n')


class TestSection:
    def test_uniform_factors_count_where_they_are_named(self, study_file) -> None:
        section = SECTION.replace("outer", 'factors = ["tau_d", "C_mq"]\nouter')
        study = loaded(study_file, 'distribution = "interval"\n' + MASS, section)
        assert study.epistemic is not None
        assert study.epistemic.factors == ("M", "tau_d", "C_mq")
        assert study.space["C_mq"].distribution == Uniform(-16.169 * 1.2, -16.169 * 0.8)

    def test_study_without_the_section_has_none(self, study_file) -> None:
        assert load_study(study_file()).epistemic is None

    @pytest.mark.parametrize(
        ("section", "says"),
        [
            (SECTION, "epistemic: no factor is epistemic"),
            (
                SECTION.replace("outer", 'factors = ["C_mp"]\nouter'),
                "epistemic.factors.1: unknown name 'C_mp'; did you mean 'C_mq'?",
            ),
            (SECTION.replace("outer", "factors = []\nouter"), "epistemic.factors"),
            (SECTION.replace("outer = 8", "outer = 1"), "epistemic.outer"),
            (SECTION.replace("inner", "iner"), "epistemic: unknown name 'iner'; did you mean 'inner'?"),
            (SECTION.replace("inner = 16", 'factors = ["M"]'), "epistemic.inner: missing: 13 factors vary"),
            (SECTION.replace('assumed = "a test"', ""), "epistemic: neither source nor assumed"),
        ],
    )
    def test_wrong_sections_are_named(self, study_file, section: str, says: str) -> None:
        assert says in refused(study_file, section=section)

    def test_factor_that_varies_is_no_interval(self, study_file) -> None:
        normal = 'distribution = "truncated_normal"\ncentre = 7.0\nstd = 0.25\nlow = 6.5\nhigh = 7.5\n'
        text = refused(study_file, mass=normal, section=SECTION.replace("outer", 'factors = ["M"]\nouter'))
        assert "epistemic.factors.1: 'M' has the distribution truncatednormal" in text
        assert "allowed: uniform, interval, evidence" in text


def table(**given) -> EpistemicTable:
    return EpistemicTable(assumed="a test", outer=4, **given)


class TestBesideTheFile:
    SPACE = load_study(SHIPPED).space

    def test_nothing_left_to_vary_needs_no_sample(self) -> None:
        space = FactorSpace(replace(each, distribution=Interval(*each.distribution.support)) for each in self.SPACE.factors)
        found = epistemic_of(table(), space)
        assert found is not None
        assert (found.inner, found.factors) == (1, space.names)
        with pytest.raises(InputError, match=r"epistemic.inner: has no place here"):
            epistemic_of(table(inner=4), space)

    def test_unknown_value_is_correlated_with_nothing(self) -> None:
        rank = [[1.0, 0.3], [0.3, 1.0]]
        space = FactorSpace((self.SPACE["M"], self.SPACE["C_mq"]), rank)
        with pytest.raises(InputError, match="C_mq is one unknown value and cannot be correlated with M"):
            epistemic_of(table(inner=4), space)

    def test_what_varies_may_be_correlated(self) -> None:
        rank = [[1.0, 0.3, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 1.0]]
        found = epistemic_of(table(inner=4), FactorSpace((self.SPACE["M"], self.SPACE["I_y"], self.SPACE["C_mq"]), rank))
        assert found is not None
        assert found.factors == ("C_mq",)


def test_shipped_study_holds_both_statements_on_pitch_damping() -> None:
    study = load_study(SHIPPED)
    found = study.space["C_mq"].distribution
    assert isinstance(found, Evidence)
    assert found.masses == (0.5, 0.5)
    # the study's Table 2, 20 % either way, and its vortex-particle runs of Tables 3 to 5
    assert found.intervals[0] == pytest.approx((-16.169 * 1.2, -16.169 * 0.8), rel=1e-12)
    assert found.intervals[1] == (-8.6516, -6.9263)
    assert study.epistemic is not None
    assert study.epistemic.factors == tuple(name for name in study.space.names if name.startswith("C_"))
