"""The shipped study over reduced frequency holds what the lattice gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.derivatives import Derivatives, Static, dynamic, static
from levelone.config.geometry_file import load_geometry
from levelone.config.study_file import Study, load_study
from levelone.uncertainty import Uniform

STUDIES = Path(__file__).parents[2] / "studies"
#: of the ends of the factors' spans, and of the study's two values
K = (0.02, 0.1, 0.12, 0.2, 0.3, 0.4, 0.5)


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(STUDIES / "k-dependent" / "study.toml")


@pytest.fixture(scope="module")
def pitch() -> Derivatives:
    return dynamic(load_geometry("reference-wing-tail"), np.array(K), ("pitch",))


@pytest.fixture(scope="module")
def steady() -> Static:
    return static(load_geometry("reference-wing-tail"))


def test_ranges_are_the_spans_of_a_pitch_oscillation(study: Study, pitch: Derivatives) -> None:
    parts = {"C_Lalpha": pitch.in_phase, "C_malpha": pitch.in_phase, "C_Lq": pitch.quadrature, "C_mq": pitch.quadrature}
    for name, part in parts.items():
        values = part[0, :, NAMES.index(name[:3])]
        given = study.space[name].distribution
        assert isinstance(given, Uniform)
        nominal = study.nominal[study.space.index(name)]
        expected = [min(values.min(), nominal), max(values.max(), nominal)]
        assert [given.low, given.high] == pytest.approx(expected, rel=2e-3)


def test_all_else_is_the_reference_study(study: Study) -> None:
    reference = load_study(STUDIES / "reference" / "study.toml")
    assert study.space.names == reference.space.names
    for name in set(reference.space.names) - {"C_Lalpha", "C_malpha", "C_Lq", "C_mq"}:
        assert study.space[name] == reference.space[name]
    for own, other in zip(study.cases, reference.cases, strict=True):
        np.testing.assert_array_equal(own.rows, other.rows)
        assert (own.name, own.criterion, own.columns) == (other.name, other.criterion, other.columns)


def test_own_cases_stand_in_for_the_printed_values(study: Study, pitch: Derivatives, steady: Static) -> None:
    """Each printed number is one quantity: at k = 0.1, at k = 0.2, or of steady flow."""

    def oscillation(name: str, k: float) -> float:
        return float(pitch.at("pitch", name)[0][K.index(k)])

    def still(name: str, motion: str) -> float:
        return float(steady.value[steady.motions.index(motion), NAMES.index(name)])

    own = {
        "C_L0": {0.4524: 0.4524, 0.6268: 0.6268}, "C_m0": {-0.024: -0.024},
        "C_Lalpha": {5.115: still("C_L", "alpha"), 7.48: 7.48}, "C_malpha": {-0.5402: still("C_m", "alpha")},
        "C_Lq": {5.9649: oscillation("C_L", 0.1), 7.9898: oscillation("C_L", 0.2)},
        "C_mq": {-6.9263: oscillation("C_m", 0.1), -8.6516: oscillation("C_m", 0.2), -16.169: still("C_m", "q")},
    }  # fmt: skip
    for cases in study.cases:
        expected = [[own[name][value] for name, value in zip(cases.columns, row, strict=True)] for row in cases.rows.tolist()]
        np.testing.assert_allclose(cases.beside.rows, expected, rtol=5e-4)


def test_part_in_alphadot_is_in_the_lumped_derivatives_alone(study: Study) -> None:
    aero = study.vehicle.airframe.aerodynamics
    assert [aero.value(name, 5.0) for name in ("C_Lalphadot", "C_malphadot")] == [0.0, 0.0]
    assert not {"C_Lalphadot", "C_malphadot"} & set(study.targets)
