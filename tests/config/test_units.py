from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.config.units import KNOWN, to_si
from levelone.errors import InputError

# Exact by definition: BIPM, The International System of Units, 9th ed.; yard and pound of 1959; nautical mile of 1929.
EXACT = [
    ("g", "kg", 1e-3),
    ("lb", "kg", 0.45359237),
    ("slug", "kg", 0.45359237 * 9.80665 / 0.3048),
    ("lbf", "N", 0.45359237 * 9.80665),
    ("ft", "m", 0.3048),
    ("inch", "m", 0.0254),
    ("in", "m", 0.0254),
    ("mm", "m", 1e-3),
    ("µs", "s", 1e-6),
    ("ms", "s", 1e-3),
    ("min", "s", 60.0),
    ("h", "s", 3600.0),
    ("kt", "m/s", 1852 / 3600),
    ("ft/min", "m/s", 0.3048 / 60),
    ("deg", "rad", math.pi / 180),
    ("deg/s", "rad/s", math.pi / 180),
    ("rev/s", "rad/s", 2 * math.pi),
    ("rpm", "rad/s", math.pi / 30),
    ("1/deg", "1/rad", 180 / math.pi),
    ("Hz", "1/s", 1.0),
    ("kHz", "Hz", 1e3),
    ("kN", "N", 1e3),
    ("percent", "1", 0.01),
    ("g cm^2", "kg m^2", 1e-7),
    ("g*cm**2", "kg m^2", 1e-7),
    ("kg m²", "kg m^2", 1.0),
    ("slug ft^2", "kg m^2", 0.45359237 * 9.80665 * 0.3048),
    ("N/(rad/s)^2", "N/rpm^2", (math.pi / 30) ** 2),
    ("mN/rpm^2", "N/rpm^2", 1e-3),
]


@pytest.mark.theory
@pytest.mark.parametrize(("unit", "expected", "factor"), EXACT)
def test_conversion_factors_are_those_of_their_definitions(unit, expected, factor):
    assert to_si(1.0, unit, expected, "x") == pytest.approx(factor, rel=1e-14)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_in_the_expected_unit_is_kept_to_the_last_bit(number):
    assert to_si(number, "N/rpm^2", "N/rpm^2", "K_T") == number


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=5))
def test_arrays_are_converted_like_their_numbers(values):
    assert to_si(values, "deg", "rad", "x").tolist() == [to_si(value, "deg", "rad", "x") for value in values]


def test_shapes_and_types_are_kept():
    assert to_si([[1.0, 2.0]], "cm", "m", "x").shape == (1, 2)
    assert isinstance(to_si(np.float64(3.0), "g", "kg", "x"), float)


@pytest.mark.parametrize("unit", KNOWN)
def test_every_unit_that_an_error_suggests_exists(unit):
    with pytest.raises(InputError, match="does not fit"):
        to_si(1.0, unit, "kg^7", "x")


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("kg", "m"),
        ("1", "1/rad"),
        ("1/rad", "1"),
        ("rad/s", "1/s"),
        ("deg", "1"),
        ("lb", "N"),
        ("N/rpm", "N/rpm^2"),
        ("kg", "kg m^2"),
    ],
)
def test_another_dimension_is_refused_with_field_unit_and_expected_unit(unit, expected):
    with pytest.raises(InputError) as caught:
        to_si(1.0, unit, expected, "mass.mass")
    text = str(caught.value)
    assert text.startswith("mass.mass: ")
    assert repr(unit) in text
    assert f"expected {expected}" in text


@pytest.mark.parametrize(
    ("unit", "hint"),
    [
        ("kgg m^2", "did you mean 'kg'?"),
        ("degg", "did you mean 'deg'?"),
        ("Nm", "unknown unit 'Nm'"),
        ("KG", "allowed:"),
        ("knott", "'knot'"),
    ],
)
def test_an_unknown_unit_is_refused_with_a_hint(unit, hint):
    with pytest.raises(InputError) as caught:
        to_si(1.0, unit, "kg m^2", "mass.I_yy")
    assert hint in str(caught.value)
    assert "expected kg m^2" in str(caught.value)


@pytest.mark.parametrize("unit", ["", "  ", "kg/", "7 kg", "kg^^2", "__import__('os').getcwd()", "kg m^^", "(kg", "kg\nm"])
def test_what_is_no_unit_is_refused_on_one_line(unit):
    with pytest.raises(InputError) as caught:
        to_si(1.0, unit, "kg m^2", "mass.I_yy")
    assert "\n" not in str(caught.value)
