"""Manoeuvres that fit a vehicle's controller."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from levelone.handling.manoeuvres import Manoeuvre, pulse, step, sweep
from levelone.vehicle import Controller

#: largest integration step, s
LONGEST_STEP = 0.004
_MAKERS: dict[str, Callable[..., Manoeuvre]] = {"step": step, "pulse": pulse, "sweep": sweep}


def integration_step(controller: Controller) -> float:
    """Largest step up to 4 ms that divides the control period, s."""
    return controller.period / math.ceil(controller.period / LONGEST_STEP - 1e-9)


def manoeuvre(
    shape: str, axis: Any, amplitude: float, controller: Controller, trim_speed: float, flight_mode: str, **options: Any
) -> Manoeuvre:
    """A step, pulse or sweep at the rate of a controller; ``options`` as in :mod:`levelone.handling.manoeuvres`."""
    timing = {"dt": integration_step(controller), "controller_rate": controller.rate}
    return _MAKERS[shape](axis, amplitude, trim_speed=trim_speed, flight_mode=flight_mode, **timing, **options)


def held_trim(controller: Controller, trim_speed: float, trim_climb: float = 0.0) -> Manoeuvre:
    """Steady flight, with no input."""
    return Manoeuvre(
        "trim",
        "velocity",
        "V_lon",
        trim_speed,
        trim_climb,
        "none",
        dt=integration_step(controller),
        controller_rate=controller.rate,
    )
