"""The exponent between throttle and rotor table: what it does to trim, and to the curvature of thrust in throttle."""

from __future__ import annotations

import numpy as np
import pytest
from vehicles import vehicle

from levelone.dynamics import Command, State, derivative, trim
from levelone.vehicle import Vehicle


def lift(craft: Vehicle, throttle: float) -> float:
    """Upward acceleration of a vehicle at rest, without gravity, m/s^2."""
    return 9.80665 - derivative(craft, State(), Command((throttle,) * 8)).w


@pytest.mark.theory
@pytest.mark.parametrize("exponent", [0.5, 0.8, 1.0, 1.6])
def test_the_table_is_entered_with_a_power_of_the_throttle(exponent: float) -> None:
    plain, curved = vehicle(), vehicle(rotors={"throttle_exponent": exponent})
    for throttle in (0.1, 0.37, 0.8, 1.0):
        assert lift(curved, throttle) == pytest.approx(lift(plain, throttle**exponent), rel=1e-12)


@pytest.mark.theory
def test_hover_is_held_at_the_root_of_the_throttle() -> None:
    plain = trim(vehicle(), 0.0).throttle[0]
    curved = trim(vehicle(rotors={"throttle_exponent": 0.5}), 0.0).throttle[0]
    np.testing.assert_allclose(curved, plain**2.0, rtol=1e-9)


@pytest.mark.theory
def test_small_exponents_turn_the_curvature_of_thrust_round() -> None:
    """Thrust of about throttle squared: its second difference is positive, and negative once the exponent is below a half."""

    def bend(exponent: float) -> float:
        craft = vehicle(rotors={"throttle_exponent": exponent})
        at = float(trim(craft, 0.0).throttle[0].mean())
        return lift(craft, at + 0.05) - 2.0 * lift(craft, at) + lift(craft, at - 0.05)

    assert bend(1.0) > 0.0 > bend(0.4)
