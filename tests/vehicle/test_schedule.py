"""Schedules in airspeed: knots, ends, slopes, shape."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator
from vehicles import hover_state, schedule, vehicle

from levelone.dynamics import Command, derivative
from levelone.errors import InputError
from levelone.vehicle import COEFFICIENTS, Aerodynamics, Schedule

KNOTS = (0.0, 3.0, 5.0, 9.0, 15.0)
C_L0 = (0.5, 0.8, 0.7, 0.7, 1.1)
AERO = Aerodynamics(0.78, 0.26, 3.0, schedule(KNOTS, C_L0=C_L0))
INCREASING = st.lists(st.floats(0.1, 5.0), min_size=2, max_size=7)


def test_knots_are_reproduced_and_the_ends_are_held() -> None:
    assert [AERO.value("C_L0", v) for v in KNOTS] == pytest.approx(C_L0, abs=1e-14)
    assert AERO.value("C_L0", 40.0) == AERO.value("C_L0", 15.0) == pytest.approx(1.1)
    assert AERO.value("C_L0", -3.0) == 0.5


@pytest.mark.oracle
def test_between_knots_it_is_fritsch_and_carlson() -> None:
    v = np.linspace(0.0, 15.0, 301)
    np.testing.assert_allclose([AERO.value("C_L0", x) for x in v], PchipInterpolator(KNOTS, C_L0)(v), atol=1e-13)


def test_one_slope_at_every_knot() -> None:
    h = 1e-6
    for knot in KNOTS[1:-1]:
        left, right = ((AERO.value("C_L0", knot + s * h) - AERO.value("C_L0", knot)) / (s * h) for s in (-1, 1))
        assert left == pytest.approx(right, abs=1e-5)


@given(INCREASING, INCREASING)
@settings(max_examples=40, deadline=None)
def test_monotone_data_stay_monotone(steps: list[float], rises: list[float]) -> None:
    n = min(len(steps), len(rises))
    knots = np.concatenate([[0.0], np.cumsum(steps[:n])])
    values = np.concatenate([[0.0], np.cumsum(rises[:n])])
    aero = Aerodynamics(1.0, 1.0, 1.0, schedule(tuple(knots), C_m0=tuple(values)))
    got = np.array([aero.value("C_m0", v) for v in np.linspace(0.0, knots[-1], 200)])
    assert np.diff(got).min() >= -1e-12
    assert got.min() >= -1e-12
    assert got.max() <= values[-1] + 1e-9


@pytest.mark.parametrize("speed", [0.5, 3.0, 4.2, 5.0, 8.99, 15.0, 18.0])
def test_the_dynamics_read_the_same_schedule(speed: float) -> None:
    """Lift at zero incidence, from the vertical acceleration."""
    craft = vehicle(knots=KNOTS, aero={"C_L0": C_L0}, rotors={"effectiveness": np.zeros(8)}, design=vehicle().airframe)
    rate = derivative(craft, hover_state(u=speed), Command((0.5,) * 8))
    lift = 7.0 * (9.80665 - rate.w)
    assert lift == pytest.approx(0.5 * 1.225 * speed**2 * 0.78 * AERO.value("C_L0", speed), abs=1e-9)


def test_one_knot_is_constant_everywhere() -> None:
    constant = Aerodynamics(0.78, 0.26, 3.0, schedule((5.0,), C_L0=0.3))
    assert [constant.value("C_L0", v) for v in (0.0, 5.0, 30.0)] == [0.3] * 3


def test_bad_schedules_are_refused() -> None:
    good = np.zeros((3, len(COEFFICIENTS)))
    with pytest.raises(InputError, match=r"schedule: knots must increase, got \[0\.0, 5\.0, 5\.0\]"):
        Schedule(np.array([0.0, 5.0, 5.0]), good)
    with pytest.raises(InputError, match="do not fit"):
        Schedule(np.array([0.0, 5.0]), good)
    bad = good.copy()
    bad[1, 2] = np.nan
    with pytest.raises(InputError, match="every knot and value must be a finite number"):
        Schedule(np.array([0.0, 5.0, 9.0]), bad)
    with pytest.raises(InputError, match="aerodynamics: schedule needs"):
        Aerodynamics(1.0, 1.0, 1.0, Schedule(np.array([0.0]), np.zeros((1, 4))))
    with pytest.raises(InputError, match="unknown name 'C_Lalfa'; did you mean 'C_Lalpha'"):
        AERO.value("C_Lalfa", 5.0)
