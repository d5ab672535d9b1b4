"""A small lift+cruise vehicle in closed form, and NumPy counterparts of what the compiled model does.

The rotor's thrust is ``K_T rpm^2 (1 + a V_edgewise^2) - b rpm V_axial``: smooth, even in the edgewise speed, and the same for a
negative airspeed at one angle as for a positive one at the opposite angle, as the table asks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scipy.interpolate import NdBSpline
from scipy.spatial.transform import Rotation

from levelone.dynamics import Command, State, derivative
from levelone.vehicle import (
    COEFFICIENTS,
    PID,
    Aerodynamics,
    Airframe,
    Controller,
    MassProperties,
    Pushers,
    Rotors,
    RotorTable,
    Schedule,
    Sensors,
    Vehicle,
)

K_T, TORQUE_ARM = 6.96e-8, 0.018
EDGEWISE, AXIAL = 8e-4, 2.2e-5
RPM_MAX, RPM_BEND = 15500.0, 0.05
CALM = (0.0, 0.0, 0.0)

MASS: Mapping[str, float] = {"mass": 7.0, "I_xx": 1.2, "I_yy": 0.7237, "I_zz": 1.8, "I_xz": 0.04}
AERO: Mapping[str, float] = {
    "C_L0": 0.7745, "C_Lalpha": 5.127, "C_Lq": 7.6136, "C_D0": 0.0183, "C_Dalpha": 0.2558, "C_Dq": 0.7179,
    "C_m0": -0.024, "C_malpha": -0.5402, "C_mq": -16.169, "C_Ybeta": -0.3, "C_Yp": 0.05, "C_Yr": 0.2, "C_lbeta": -0.05,
    "C_lp": -0.5, "C_lr": 0.15, "C_nbeta": 0.02, "C_np": -0.05, "C_nr": -0.1,
}  # fmt: skip
LAW: Mapping[str, Any] = {
    "rate": 250.0, "position": 0.5, "altitude": 1.0, "velocity_limit": 3.0, "climb_limit": 3.0,
    "horizontal": PID(0.89, 0.32, 0.05, 0.1, 8.0), "vertical": PID(2.0, 1.0, 0.0, 0.05, 6.0),
    "roll": 7.6, "pitch": 7.6, "heading": 1.0, "attitude_limit": np.radians(30.0), "rate_limit": 3.0,
    "roll_rate": PID(5.4, 5.9, 0.12, 0.02, 40.0), "pitch_rate": PID(5.4, 5.9, 0.12, 0.02, 40.0),
    "yaw_rate": PID(2.0, 0.5, 0.0, 0.05, 10.0), "throttle_min": 0.02, "throttle_max": 1.0,
}  # fmt: skip
#: front, rear; inner, outer; right, left: neighbours (0, 1), (2, 3) ... are mirror images
POSITION = np.array([[0.4 * fore, side * out, 0.0] for fore in (1, -1) for out in (0.45, 0.95) for side in (1, -1)])
MIRRORED = [1, 0, 3, 2, 5, 4, 7, 6]
SPIN = np.array([1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0])
UP = np.tile([0.0, 0.0, -1.0], (8, 1))


def rotor(throttle: Any, airspeed: Any, angle: Any) -> tuple[Any, Any, Any]:
    """Closed form of the table: rpm, thrust (N) and torque (N m)."""
    rpm = RPM_MAX * throttle * (1.0 - RPM_BEND * throttle)
    edgewise, axial = airspeed * np.cos(angle), airspeed * np.sin(angle)
    thrust = K_T * rpm**2 * (1.0 + EDGEWISE * edgewise**2) - AXIAL * rpm * axial
    return rpm, thrust, TORQUE_ARM * thrust


@cache
def rotor_table(reach: float = 20.0) -> RotorTable:
    """The closed form on a grid up to ``reach`` m/s."""
    axes = np.linspace(0.0, 1.0, 21), np.linspace(0.0, reach, 11), np.radians(np.arange(-90.0, 91.0, 15.0))
    return RotorTable(*axes, np.stack(rotor(*np.meshgrid(*axes, indexing="ij")), axis=-1))


def schedule(knots: Sequence[float] = (0.0,), **changes: float | Sequence[float]) -> Schedule:
    """The coefficients, changed where asked: one number for every knot, or one for each."""
    columns = [np.broadcast_to({**AERO, **changes}.get(name, 0.0), len(knots)) for name in COEFFICIENTS]
    return Schedule(np.array(knots, dtype=float), np.array(columns).T)


def airframe(
    *,
    knots: Sequence[float] = (0.0,),
    aero: Mapping[str, float | Sequence[float]] | None = None,
    mass: Mapping[str, float] | None = None,
    rotors: Mapping[str, Any] | None = None,
    **fields: Any,
) -> Airframe:
    """The airframe with changed numbers."""
    healthy = Rotors(POSITION, UP, SPIN, np.ones(8), rotor_table(), K_T, K_T)
    return Airframe(
        MassProperties(**{**MASS, **(mass or {})}),
        Aerodynamics(0.78, 0.26, 3.0, schedule(knots, **(aero or {}))),
        replace(healthy, **(rotors or {})),
        Pushers(np.array([[-0.2, 0.3, 0.05], [-0.2, -0.3, 0.05]]), np.tile([1.0, 0.0, 0.0], (2, 1)), 10.0),
        **fields,
    )


def vehicle(
    *, law: Mapping[str, Any] | None = None, sensors: Sensors | None = None, design: Airframe | None = None, **options: Any
) -> Vehicle:
    """The vehicle; its controller is designed for the same airframe unless ``design`` says otherwise."""
    body = airframe(**options)
    controller = Controller(design=design or body, **{**LAW, **(law or {})})
    return Vehicle("test", body, controller, sensors or Sensors())


def open_loop(rate: float = 10.0) -> Mapping[str, Any]:
    """Gains of a controller that holds the throttles of the trim whatever it measures."""
    still = PID(0.0)
    loops = ("horizontal", "vertical", "roll_rate", "pitch_rate", "yaw_rate")
    return {"rate": rate, "position": 0.0, "altitude": 0.0, "roll": 0.0, "pitch": 0.0, "heading": 0.0} | dict.fromkeys(loops, still)


def attitude(phi: float, theta: float, psi: float) -> tuple[float, ...]:
    """Quaternion (scalar first) of roll, pitch and yaw, by SciPy."""
    x, y, z, w = Rotation.from_euler("ZYX", [psi, theta, phi]).as_quat()
    return (w, x, y, z)


def rotation(state: State | np.ndarray) -> Rotation:
    """SciPy's rotation from body axes to north-east-down."""
    q0, q1, q2, q3 = np.asarray(state)[6:10]
    return Rotation.from_quat([q1, q2, q3, q0])


def rate_of(
    craft: Vehicle, throttle: Callable[[float], Sequence[float]], wind: Callable[[float], Sequence[float]] = lambda t: CALM
) -> Callable[[float, np.ndarray], np.ndarray]:
    """Right-hand side for SciPy's integrators: the public derivative under throttles and wind of time."""

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        return np.array(derivative(craft, State(*x), Command(tuple(throttle(t))), tuple(wind(t))))

    return rate


def measured(x: np.ndarray) -> np.ndarray:
    """The sensor channels of a state, by SciPy's rotations."""
    psi, theta, phi = rotation(x).as_euler("ZYX")
    north, east, down = rotation(x).apply(x[3:6])
    forward, right = np.cos(psi) * north + np.sin(psi) * east, np.cos(psi) * east - np.sin(psi) * north
    return np.array([x[0], x[1], -x[2], forward, right, -down, phi, theta, psi, *x[10:13]])


def spline_at(table: RotorTable, throttle: Any, airspeed: Any, angle: Any) -> np.ndarray:
    """rpm, thrust and torque of the table's spline, evaluated by SciPy."""
    coefficients = np.moveaxis(table.spline, 2, 0)
    axes = (table.throttle, table.airspeed, table.angle)
    knots = tuple(a[0] + (a[1] - a[0]) * np.arange(-3, len(a) + 3) for a in axes)
    at = np.stack(np.broadcast_arrays(throttle, airspeed, angle), axis=-1)
    return NdBSpline(knots, coefficients, 3)(at)


def hover_state(**fields: float) -> State:
    """At rest, level, heading north, changed where asked."""
    return State()._replace(**fields)
