"""Impossible vehicles are refused when they are made, with the field and the value."""

from __future__ import annotations

import numpy as np
import pytest
from vehicles import LAW, POSITION, airframe, rotor_table, vehicle

from levelone.errors import InputError
from levelone.vehicle import PID, Controller, MassProperties


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"mass": {"mass": 0.0}}, r"mass: must be positive, got 0\.0"),
        ({"mass": {"I_yy": -1.0}}, r"I_yy: must be positive, got -1\.0"),
        ({"mass": {"mass": float("nan")}}, "mass: must be positive, got nan"),
        ({"mass": {"I_xz": 2.0}}, r"I_xz: 2\.0 makes the inertia matrix indefinite"),
        ({"rotors": {"spin": np.array([1.0] * 7 + [0.5])}}, r"rotors\.spin: must be \+1 or -1"),
        ({"rotors": {"axis": np.tile([0.0, 0.0, -2.0], (8, 1))}}, "rotors.axis: must be unit vectors"),
        ({"rotors": {"position": POSITION[:7]}}, "must describe the same rotors"),
        ({"rotors": {"K_T": 0.0}}, r"rotors\.K_T: must be positive, got 0\.0"),
        ({"rotors": {"T_u": -1.0}}, r"rotors\.T_u: must be positive"),
        ({"rotors": {"tau_d": -0.01}}, r"rotors\.tau_d: must not be negative, got -0\.01"),
        ({"rotors": {"motor_lag": float("nan")}}, r"rotors\.motor_lag: must not be negative, got nan"),
    ],
)
def test_impossible_numbers_are_refused(changes: dict, text: str) -> None:
    with pytest.raises(InputError, match=text):
        airframe(**changes)


def test_impossible_controllers_are_refused() -> None:
    for changes, text in (
        ({"rate": 0.0}, r"controller\.rate: must be positive, got 0\.0"),
        ({"throttle_min": 0.5, "throttle_max": 0.4}, "controller.throttle: needs 0 <= min < max <= 1, got 0.5 and 0.4"),
        ({"throttle_max": 1.2}, "controller.throttle"),
    ):
        with pytest.raises(InputError, match=text):
            Controller(design=airframe(), **{**LAW, **changes})
    assert vehicle().controller.period == 0.004


def test_values_are_frozen() -> None:
    for value in (vehicle(), airframe(), MassProperties(1.0, 1.0, 1.0, 1.0), PID(1.0), rotor_table()):
        with pytest.raises(AttributeError, match="cannot assign"):
            value.mass = 3.0  # type: ignore[union-attr, misc]
