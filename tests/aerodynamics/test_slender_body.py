from __future__ import annotations

import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.aerodynamics.geometry import Geometry, Surface
from levelone.aerodynamics.slender_body import Body, contributions, inertia_factors, spheroid
from levelone.errors import InputError

WING = Surface("wing", (0.0, 0.0, 0.0), 1.5, 0.26, 0.26)
GEOMETRY = Geometry("wing", "", (WING,), 0.78, 0.26, 3.0, (0.0, 0.0, 0.0))
CONE = Body((-0.5, 0.0, 0.0), 2.0, ((0.0, 0.0), (1.0, 0.3)))

widths = st.lists(st.floats(0.0, 0.5), min_size=2, max_size=6).filter(lambda found: max(found) > 0.01)


def body(found, x=-0.4, length=1.6, closed=False):
    ends = [0.0, *found, 0.0] if closed else found
    return Body((x, 0.0, 0.0), length, tuple(zip(np.linspace(0.0, 1.0, len(ends)).tolist(), ends, strict=True)))


@pytest.mark.theory
@pytest.mark.parametrize("fineness", [1.02, 1.5, 2.0, 4.0, 10.0])
def test_inertia_factors_against_the_elementary_form(fineness):
    """Lamb, section 114, with logarithms."""
    e = math.sqrt(1.0 - 1.0 / fineness**2)
    log = math.log((1.0 + e) / (1.0 - e))
    along = 2.0 * (1.0 - e**2) / e**3 * (0.5 * log - e)
    across = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * log
    np.testing.assert_allclose(inertia_factors(fineness), (along / (2.0 - along), across / (2.0 - across)), rtol=1e-10)


@pytest.mark.theory
def test_inertia_factors_of_the_limits():
    np.testing.assert_allclose(inertia_factors(1.0), (0.5, 0.5), rtol=1e-14)
    np.testing.assert_allclose(inertia_factors(1e6), (0.0, 1.0), atol=1e-9)


@pytest.mark.theory
def test_munk_moment_of_a_slender_spheroid():
    found = contributions(spheroid((-1.0, 0.0, 0.0), 20.0, 0.1), GEOMETRY)
    assert found.C_malpha == pytest.approx(2.0 * math.pi / 6.0 * 20.0 * 0.1**2 / (0.78 * 0.26), rel=2e-3)
    assert found.C_Lalpha == pytest.approx(0.0, abs=1e-12)


@pytest.mark.theory
def test_a_cone_lifts_with_its_base_at_two_thirds_of_its_length():
    found = contributions(CONE, GEOMETRY)
    base = 0.25 * math.pi * 0.3**2
    k_1, k_2 = inertia_factors(2.0 / 0.3)
    assert found.C_Lalpha == pytest.approx(2.0 * base / 0.78, rel=1e-12)
    # lift A_b w_b at the base, less the couple of the volume A_b l/3; pitch rate: cross-flow q x, first moment of the cone's volume
    assert found.C_malpha == pytest.approx(-2.0 * base / (0.78 * 0.26) * (1.5 - (k_2 - k_1) * 2.0 / 3.0), rel=1e-12)
    first = base * 2.0 / 3.0 * (1.5 - 0.5)
    assert found.C_malphadot == pytest.approx(-4.0 * k_2 * first / (0.78 * 0.26**2), rel=1e-12)
    assert found.C_mq == pytest.approx(4.0 * (k_2 * first - base * 1.5**2) / (0.78 * 0.26**2), rel=1e-12)


@given(found=widths, x=st.floats(-2.0, 1.0))
def test_a_closed_body_is_not_damped_in_pitch(found, x):
    each = contributions(body(found, x, closed=True), GEOMETRY)
    assert each.C_mq + each.C_malphadot == pytest.approx(0.0, abs=1e-12)
    assert each.C_malpha > 0.0


@given(found=widths, aft=st.floats(-1.0, 1.0))
def test_steady_loads_are_those_of_one_field_whatever_the_reference_point(found, aft):
    """Turning about another point adds heave, and the moment about it adds the lift's: the same flow must come out."""
    here = contributions(body(found), GEOMETRY)
    there = contributions(body(found), replace(GEOMETRY, reference_point=(aft, 0.0, 0.0)))
    s = aft / GEOMETRY.chord
    assert there.C_malpha == pytest.approx(here.C_malpha + s * here.C_Lalpha, abs=1e-10)
    assert there.C_Lq == pytest.approx(here.C_Lq - 2.0 * s * here.C_Lalpha, abs=1e-10)
    assert there.C_mq == pytest.approx(here.C_mq - 2.0 * s * here.C_malpha + s * there.C_Lq, abs=1e-10)
    assert there.C_malphadot == pytest.approx(here.C_malphadot + s * here.C_Lalphadot, abs=1e-10)


@given(found=widths, factor=st.floats(0.2, 5.0))
def test_coefficients_do_not_change_with_size(found, factor):
    small = body(found)
    large = Body(
        tuple(factor * each for each in small.nose), factor * small.length, tuple((x, factor * width) for x, width in small.widths)
    )
    grown = replace(GEOMETRY, area=factor**2 * GEOMETRY.area, chord=factor * GEOMETRY.chord)
    np.testing.assert_allclose(
        astuple(contributions(large, grown)), astuple(contributions(small, GEOMETRY)), rtol=1e-10, atol=1e-12
    )


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"length": 0.0}, "length"),
        ({"nose": (0.0, math.nan, 0.0)}, "nose"),
        ({"widths": ((0.0, 0.1), (0.9, 0.2))}, "widths"),
        ({"widths": ((0.0, 0.1), (0.0, 0.2), (1.0, 0.1))}, "widths"),
        ({"widths": ((0.0, 0.0), (1.0, -0.1))}, "widths"),
        ({"widths": ((0.0, 0.0), (1.0, 0.0))}, "widths"),
    ],
)
def test_impossible_bodies_are_refused(change, field):
    with pytest.raises(InputError) as caught:
        replace(CONE, **change)
    assert caught.value.field == field


def test_a_body_wider_than_long_is_refused():
    with pytest.raises(InputError, match="fineness"):
        contributions(replace(CONE, length=0.2), GEOMETRY)
