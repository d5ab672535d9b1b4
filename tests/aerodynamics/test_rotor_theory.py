"""Momentum theory against its closed forms, and the reference propeller."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.aerodynamics.rotor_theory import propeller, slipstream
from levelone.errors import InputError

DENSITY, RADIUS = 1.225, 0.089
speeds = st.floats(0.0, 50.0)


@pytest.mark.theory
def test_hover():
    found = slipstream(8.575, DENSITY, RADIUS)
    assert found.induced == pytest.approx(found.hover, rel=1e-12)
    assert found.contraction == pytest.approx(math.sqrt(0.5), rel=1e-12)
    # thrust is the mass flux times the velocity far away
    assert 2.0 * found.induced * found.mass_flux == pytest.approx(8.575, rel=1e-12)
    assert found.skew == found.far_skew == 0.0


@pytest.mark.theory
@given(climb=speeds)
def test_axial_climb(climb):
    found = slipstream(5.0, DENSITY, RADIUS, climb=climb)
    assert found.induced == pytest.approx(-0.5 * climb + math.sqrt(0.25 * climb**2 + found.hover**2), rel=1e-9)
    assert 2.0 * found.induced * found.mass_flux == pytest.approx(5.0, rel=1e-9)


@pytest.mark.theory
@given(edgewise=speeds)
def test_edgewise_flow(edgewise):
    found = slipstream(5.0, DENSITY, RADIUS, edgewise=edgewise)
    square = -0.5 * edgewise**2 + math.sqrt(0.25 * edgewise**4 + found.hover**4)
    assert found.induced == pytest.approx(math.sqrt(square), rel=1e-6)
    assert math.tan(found.skew) == pytest.approx(edgewise / found.induced, rel=1e-6)


@given(climb=speeds, edgewise=speeds)
def test_glauerts_equation(climb, edgewise):
    found = slipstream(5.0, DENSITY, RADIUS, climb, edgewise)
    through = math.hypot(edgewise, climb + found.induced)
    assert 2.0 * DENSITY * math.pi * RADIUS**2 * through * found.induced == pytest.approx(5.0, rel=1e-9)


@pytest.mark.theory
def test_a_fast_disc_is_a_circular_wing():
    # elliptic loading: C_L / (pi A) with the aspect ratio 4/pi of a circle, at unit thrust
    found = slipstream(1.0, DENSITY, RADIUS, edgewise=100.0)
    lift = 1.0 / (0.5 * DENSITY * 100.0**2 * math.pi * RADIUS**2)
    assert found.induced / 100.0 == pytest.approx(lift / (math.pi * 4.0 / math.pi), rel=1e-3)


@pytest.mark.paper
def test_eight_propellers_carry_the_reference_vehicle():
    found = propeller(RADIUS, 11_100.0, 6.96e-8, 0.02, DENSITY)
    assert 8.0 * found.thrust == pytest.approx(7.0 * 9.80665, rel=2e-3)
    assert found.tip_speed == pytest.approx(2.0 * math.pi * 185.0 * RADIUS, rel=1e-12)
    assert found.thrust_coefficient == pytest.approx(0.204, rel=5e-3)
    assert slipstream(found.thrust, DENSITY, RADIUS).hover == pytest.approx(11.86, abs=0.01)
    assert found.reynolds == pytest.approx(0.75 * found.tip_speed * 0.02 / 1.461e-5, rel=1e-12)


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ((0.0, 1.0, 1.0), "thrust"),
        ((1.0, -1.0, 1.0), "density"),
        ((1.0, 1.0, math.nan), "radius"),
        ((1.0, 1.0, 1.0, -1.0), "climb"),
        ((1.0, 1.0, 1.0, 0.0, -1.0), "edgewise"),
    ],
)
def test_bad_input(values, field):
    with pytest.raises(InputError) as caught:
        slipstream(*values)
    assert caught.value.field == field
