"""The two matrices between commands and forces: allocation (the controller's belief) and effectiveness (this vehicle's fact)."""

from __future__ import annotations

import numpy as np

from levelone.errors import InputError
from levelone.vehicle.tables import FloatArray
from levelone.vehicle.vehicle import Airframe, Pushers, Rotors


def effectiveness(rotors: Rotors) -> FloatArray:
    """Body force and moment for unit thrust and unit torque of each rotor.

    Returns
    -------
    FloatArray
        [12, n]: rows 0 to 5 give X, Y, Z, L, M, N for a thrust of 1 N, rows 6 to 11 for a torque of 1 N m. The reaction of a
        rotor that turns in the positive sense about +z is a negative yawing moment. Each rotor's own effectiveness is included.
    """
    thrust = np.vstack([rotors.axis.T, np.cross(rotors.position, rotors.axis).T])
    # spin +1 turns about +z, that is about minus the thrust axis; the airframe is turned the other way
    reaction = np.vstack([np.zeros((3, len(rotors.spin))), (rotors.spin[:, None] * rotors.axis).T])
    return np.vstack([thrust, reaction]) * rotors.effectiveness


def pusher_effectiveness(pushers: Pushers) -> FloatArray:
    """[6, n] body force and moment for full throttle of each pusher."""
    return pushers.max_thrust * np.vstack([pushers.axis.T, np.cross(pushers.position, pushers.axis).T])


def allocation(rotors: Rotors, thrust_slope: float, torque_slope: float) -> FloatArray:
    """Throttle change of each rotor for a unit of upward force (N) and of roll, pitch and yaw moment (N m).

    Parameters
    ----------
    rotors
        The rotors of the design vehicle.
    thrust_slope, torque_slope
        dT/dthrottle (N) and dQ/dthrottle (N m) of one rotor in the design hover.

    Returns
    -------
    FloatArray
        [n, 4], the least-squares inverse of the design effectiveness.

    Raises
    ------
    InputError
        If the layout cannot produce the four commands independently.
    """
    wrench = effectiveness(rotors)
    to_controls = thrust_slope * wrench[:6] + torque_slope * wrench[6:]
    rows = np.vstack([-to_controls[2], to_controls[3], to_controls[4], to_controls[5]])
    if np.linalg.matrix_rank(rows / np.abs(rows).max(axis=1, keepdims=True).clip(1e-300), tol=1e-6) < 4:
        raise InputError("rotors", "this layout cannot command lift, roll, pitch and yaw independently")
    return np.ascontiguousarray(np.linalg.pinv(rows))


def design_slopes(airframe: Airframe, rotor_at_rest: FloatArray) -> tuple[float, float, float]:
    """Hover throttle and slopes of thrust and torque in throttle for the design vehicle.

    Parameters
    ----------
    airframe
        The design airframe.
    rotor_at_rest
        [m, 3] throttle, thrust, torque of one rotor at zero airspeed, finely sampled.

    Returns
    -------
    tuple of float
        Throttle in hover, dT/dthrottle (N), dQ/dthrottle (N m).
    """
    throttle, thrust, torque = rotor_at_rest.T
    thrust = thrust * airframe.rotors.K_T / airframe.rotors.K_T_table
    upward = -float(np.sum(effectiveness(airframe.rotors)[2]))
    need = airframe.mass.mass * airframe.gravity / upward if upward > 0 else np.inf
    if not thrust[0] < need < thrust[-1]:
        raise InputError(
            "rotors",
            f"hover needs {need:.3g} N of each rotor, the table gives {thrust.min():.3g} to {thrust.max():.3g} N",
        )
    above = int(np.argmax(thrust >= need))
    hover = float(np.interp(need, thrust[above - 1 : above + 1], throttle[above - 1 : above + 1]))
    return (
        hover,
        float(np.interp(hover, throttle, np.gradient(thrust, throttle))),
        float(np.interp(hover, throttle, np.gradient(torque, throttle))),
    )
