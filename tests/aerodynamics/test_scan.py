from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.aerodynamics.derivatives import dynamic, static
from levelone.aerodynamics.geometry import Geometry, Surface
from levelone.aerodynamics.scan import (
    Case,
    about,
    changed,
    crossing,
    moved,
    only,
    oscillations,
    quasi_steady,
    transferred,
    with_end_plates,
    with_uniform_strips,
)
from levelone.errors import InputError

WING = Surface("wing", (0.0, 0.0, 0.0), 1.5, 0.26, 0.26, chordwise=2, strips=4)
TAIL = Surface("tail", (1.08, 0.0, 0.0), 0.36, 0.13, 0.13, chordwise=1, strips=2)
BOTH = Geometry("both", "", (WING, TAIL), 0.78, 0.26, 3.0, (0.0, 0.0, 0.0))
K = np.array([0.1, 0.3])
CROSSING = changed(BOTH, "tail", position=(0.0, 0.0, 0.0))

offsets = st.floats(-2.0, 2.0)


@pytest.fixture(scope="module")
def both():
    return oscillations([Case("both", BOTH)], K)


@pytest.mark.oracle
@pytest.mark.parametrize(("axis", "moment"), [(0.3, 0.0), (0.0, -0.4), (-0.25, 0.5)])
def test_transfer_is_what_the_lattice_gives_about_other_points(both, axis, moment):
    pitch, heave = both.response[0, :2]
    direct = oscillations([Case("", about(BOTH, moment), (axis * BOTH.chord, 0.0, 0.0))], K, ("pitch",)).response[0, 0]
    np.testing.assert_allclose(transferred(pitch, heave, K, axis, moment), direct, rtol=1e-9, atol=1e-10)


@given(axis=offsets, moment=offsets)
def test_transfer_there_and_back_changes_nothing(axis, moment):
    pitch, heave = np.array([[[1.0 + 0.2j, -2.0 - 1j], [0.5 + 1j, -1.0 - 2j]], [[5.0 - 1j, -1.0 - 0.3j], [4.0 - 2j, -1.5 - 1j]]])
    there = transferred(pitch, heave, K, axis, moment)
    heave_there = transferred(heave, heave, K, 0.0, moment)
    np.testing.assert_allclose(transferred(there, heave_there, K, -axis, -moment), pitch, atol=1e-12)


def test_pitch_is_heave_and_rate_together(both):
    pitch, heave, rate = both.response[0]
    np.testing.assert_allclose(pitch, heave + rate, rtol=1e-9)


def test_a_batch_is_its_cases_one_by_one(both):
    variants = [Case("low", moved(BOTH, ["tail"], up=-0.2)), Case("both", BOTH)]
    batch = oscillations(variants, K)
    np.testing.assert_array_equal(batch.response[1], both.response[0])
    assert batch.labels == ("low", "both")
    direct = dynamic(BOTH, K, ("heave",))
    np.testing.assert_allclose(batch.at("heave")[1], direct.quadrature[0][:, [0, 4]], rtol=1e-12)


def test_quasi_steady_is_static_of_alpha_and_q():
    found = quasi_steady([Case("", BOTH)])
    direct = static(BOTH)
    np.testing.assert_array_equal(found.value[0], [direct.value[0, 0], direct.value[0, 4], direct.value[1, 0], direct.value[1, 4]])
    np.testing.assert_array_equal(found.ordinary[0, :2], direct.ordinary[0, [0, 4]])


@pytest.mark.theory
def test_steady_derivatives_about_another_centre_of_gravity():
    """Turning about a point s chords aft takes away an incidence of 2 s q; its moment gains s C_L."""
    here, there = quasi_steady([Case("", BOTH), Case("", about(BOTH, 0.2))]).value
    s = 0.2
    lift_q = here[2] - 2.0 * s * here[0]
    expected = [here[0], here[1] + s * here[0], lift_q, here[3] - 2.0 * s * here[1] + s * lift_q]
    np.testing.assert_allclose(there, expected, rtol=1e-9)


@pytest.mark.parametrize("batch", [lambda cases: oscillations(cases, K).quadrature, lambda cases: quasi_steady(cases).value])
def test_a_case_that_cannot_be_built_is_nan_and_the_others_stand(batch):
    found = batch([Case("good", BOTH), Case("bad", CROSSING)])
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1]).all()


def test_a_case_that_cannot_be_built_says_why():
    for found in (
        oscillations([Case("bad", CROSSING), Case("good", BOTH)], K),
        quasi_steady([Case("bad", CROSSING), Case("good", BOTH)]),
    ):
        assert "tail" in found.reasons[0]
        assert found.reasons[1] == ""
        assert np.isnan(found.error[0]).all()


@pytest.mark.parametrize(
    ("k", "motions", "field"), [([0.1, 0.0], ("pitch",), "k"), ([math.nan], ("pitch",), "k"), ([0.1], ("flap",), "motion")]
)
def test_what_concerns_every_case_is_an_error(k, motions, field):
    with pytest.raises(InputError) as caught:
        oscillations([Case("", BOTH)], k, motions)
    assert caught.value.field == field


def test_a_motion_that_was_not_computed_is_an_error(both):
    with pytest.raises(InputError, match="did you mean 'pitch'"):
        both.at("pich")


@given(root=st.floats(-0.9, 0.9))
def test_crossing_of_a_cubic_is_exact(root):
    x = np.linspace(-1.0, 1.0, 6)
    assert crossing(x, (x - root) * (x**2 + 1.0), 0.0) == pytest.approx([root], abs=1e-9)


def test_crossing_stays_inside_the_scan_and_leaves_gaps_out():
    x = np.linspace(0.0, 4.0, 5)
    assert crossing(x, x, 4.5).size == 0
    assert crossing(x, np.where(x == 1.0, np.nan, x**2), 2.25) == pytest.approx([1.5], abs=1e-9)


@pytest.mark.parametrize(("x", "y", "field"), [([0, 1, 2], [1, math.nan, 2], "values"), ([0, 2, 1], [0, 1, 2], "parameter")])
def test_a_scan_without_a_curve_is_refused(x, y, field):
    with pytest.raises(InputError) as caught:
        crossing(x, y, 0.5)
    assert caught.value.field == field


def test_variants_change_what_they_say_and_nothing_else():
    tail = moved(BOTH, ["tail"], aft=0.1, up=-0.2).surfaces[1]
    assert tail == replace(TAIL, position=(1.08 + 0.1, 0.0, -0.2))
    assert only(BOTH, "tail") == replace(BOTH, surfaces=(TAIL,))
    assert about(BOTH, 0.5) == replace(BOTH, reference_point=(0.13, 0.0, 0.0))
    uniform = with_uniform_strips(BOTH, {"tail": (3, 7)})
    assert uniform.surfaces == (WING, replace(TAIL, chordwise=3, strips=7, span_spacing="uniform"))


def test_end_plates_stand_on_the_tips_and_raise_the_damping():
    plated = with_end_plates(BOTH, "tail", 0.2)
    plate = plated.surfaces[2]
    assert plate.position == pytest.approx((1.08, 0.36, -0.1))
    assert (plate.span, plate.root_chord, plate.dihedral) == (0.2, 0.13, math.pi / 2)
    without, with_plates = quasi_steady([Case("", BOTH), Case("", plated)]).value[:, 3]
    assert with_plates < 1.05 * without < 0.0


def test_unknown_surfaces_and_bearers_are_refused():
    with pytest.raises(InputError, match="did you mean 'tail'"):
        moved(BOTH, ["tial"], aft=0.1)
    with pytest.raises(InputError, match="without dihedral"):
        with_end_plates(changed(BOTH, "tail", dihedral=0.1), "tail", 0.2)
