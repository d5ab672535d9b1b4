"""Electric drive of one lift rotor: battery, speed controller and brushless motor in equilibrium with the rotor.

The speed controller is an ideal averaging converter: duty cycle d equals throttle, motor voltage d U, battery current
d I. With the open-circuit voltage E and this rotor's share R_b of the battery's resistance, U = E - R_b d I, and the
motor obeys d U = k Omega + R I, Q = k (I - I_0) (Drela, First-Order DC Electric Motor Model, MIT 2007). Together, with
a no-load current I_0 = c_0 Omega:

    d E = k Omega + (R + d^2 R_b) (Q / k + c_0 Omega).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import elementwise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drive:
    """Constants of motor and battery, all assumed: a motor for 7-inch propellers on six lithium-polymer cells."""

    speed_constant: float = 960.0  # rpm/V; assumed: hover of 7 kg near 0.58 throttle, static thrust to weight 2.2
    resistance: float = 0.06  # ohm, windings and controller; assumed: usual for 80 to 100 g motors
    no_load_current: float = 0.8  # A at `no_load_speed`; assumed
    no_load_speed: float = 9600.0  # rpm; taken proportional to speed, so that friction has no jump at rest
    voltage: float = 22.2  # V open circuit: six cells at their nominal 3.7 V; assumed constant during a manoeuvre
    battery_resistance: float = 0.112  # ohm a rotor: 14 milliohm of one pack times eight rotors drawing alike; assumed

    @property
    def torque_constant(self) -> float:
        """N m / A, equal to V s / rad."""
        return 60.0 / (2.0 * np.pi * self.speed_constant)

    def voltage_excess(self, throttle: Array, speed: Array, torque: Array) -> Array:
        """Voltage (V) left over at a rotor `speed` (rad/s) and aerodynamic `torque` (N m): zero in equilibrium."""
        friction = self.no_load_current / (self.no_load_speed * 2.0 * np.pi / 60.0)
        current = torque / self.torque_constant + friction * speed
        resistance = self.resistance + throttle**2 * self.battery_resistance
        return throttle * self.voltage - self.torque_constant * speed - resistance * current


def steady_speed(drive: Drive, throttle: Array, torque: Callable[..., Array], lowest: Array, *args: Array) -> Array:
    """Speed (rad/s) between `lowest` and well above no load where motor and rotor agree; all arrays of one shape.

    `torque(speed, *args)` in N m. The controller brakes as well as drives: a windmilling rotor feeds the battery, and
    at zero throttle the windings are shorted.
    """
    highest = 1.2 * drive.voltage / drive.torque_constant
    outcome = elementwise.find_root(
        lambda speed, throttle, *rest: drive.voltage_excess(throttle, speed, torque(speed, *rest)),
        (lowest, np.full(throttle.shape, highest)),
        args=(throttle, *args),
        tolerances={"xatol": 1e-11, "xrtol": 1e-14, "fatol": 0.0, "frtol": 0.0},
        maxiter=200,
    )
    if not np.all(outcome.success):
        raise ArithmeticError(f"{np.sum(~outcome.success)} points without an equilibrium of motor and rotor")
    return outcome.x
