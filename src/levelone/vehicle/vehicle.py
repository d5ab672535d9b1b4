"""The vehicle as frozen values: mass, inertia, aerodynamic schedule, rotors, controller, sensors and stated validity.

Body axes: x forward, y right, z down, origin at the centre of gravity. SI units and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from levelone.errors import InputError, unknown_name
from levelone.vehicle.tables import FloatArray, RotorTable, Schedule

LONGITUDINAL = (
    "C_L0", "C_Lalpha", "C_Lq", "C_Lalphadot",
    "C_D0", "C_Dalpha", "C_Dq",
    "C_m0", "C_malpha", "C_mq", "C_malphadot",
)  # fmt: skip
LATERAL = ("C_Ybeta", "C_Yp", "C_Yr", "C_lbeta", "C_lp", "C_lr", "C_nbeta", "C_np", "C_nr")
SURFACES = ("C_Ldelta_e", "C_mdelta_e", "C_ldelta_a", "C_ndelta_a", "C_Ydelta_r", "C_ldelta_r", "C_ndelta_r")
COEFFICIENTS = LONGITUDINAL + LATERAL + SURFACES


@dataclass(frozen=True)
class MassProperties:
    """Mass (kg) and moments of inertia about the centre of gravity (kg m^2)."""

    mass: float
    I_xx: float
    I_yy: float
    I_zz: float
    I_xz: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "I_xx", "I_yy", "I_zz"):
            if not getattr(self, name) > 0:
                raise InputError(name, f"must be positive, got {getattr(self, name)}")
        if not self.I_xx * self.I_zz > self.I_xz**2:
            raise InputError("I_xz", f"{self.I_xz} makes the inertia matrix indefinite")


@dataclass(frozen=True)
class Aerodynamics:
    """Linear airframe aerodynamics scheduled in airspeed.

    Coefficients are made with the dynamic pressure, ``area`` and, for moments, ``chord`` (pitch) or ``span`` (roll, yaw), about
    the centre of gravity; rates enter as q c / (2 V), p b / (2 V), r b / (2 V). ``schedule`` has one column for each name in
    ``COEFFICIENTS``; derivatives are per radian.
    """

    area: float
    chord: float
    span: float
    schedule: Schedule

    def __post_init__(self) -> None:
        for name in ("area", "chord", "span"):
            if not getattr(self, name) > 0:
                raise InputError(name, f"must be positive, got {getattr(self, name)}")
        if self.schedule.values.shape[1] != len(COEFFICIENTS):
            raise InputError("aerodynamics", f"schedule needs {len(COEFFICIENTS)} columns")

    def value(self, name: str, airspeed: float) -> float:
        """The coefficient ``name`` at an airspeed (m/s)."""
        if name not in COEFFICIENTS:
            raise unknown_name("aerodynamics", name, COEFFICIENTS)
        column = COEFFICIENTS.index(name)
        knots, cubics = self.schedule.knots, self.schedule.polynomials
        v = float(np.clip(airspeed, knots[0], knots[-1]))
        segment = int(np.clip(np.searchsorted(knots, v, side="right") - 1, 0, len(cubics) - 1))
        return float(np.polynomial.polynomial.polyval(v - knots[segment], cubics[segment, :, column]))


@dataclass(frozen=True)
class Rotors:
    """The lift rotors.

    Parameters
    ----------
    position
        [n, 3] of the hubs from the centre of gravity, m.
    axis
        [n, 3] unit vectors of positive thrust; (0, 0, -1) is straight up.
    spin
        [n] +1 for a rotation that is positive about +z (clockwise from above), -1 for the other sense.
    effectiveness
        [n] factor on thrust and torque of each rotor, 1 for a healthy one.
    table
        Steady performance of one rotor.
    K_T
        Static thrust coefficient of this vehicle's rotors, N/rpm^2; thrust (not torque) is the table's times K_T / K_T_table.
    K_T_table
        Static thrust coefficient that the table was made with, N/rpm^2.
    T_u
        Factor on the airspeed that enters the table (not on the angle).
    tau_d
        Pure delay from the mixer to the rotors, s.
    motor_lag
        First-order time constant of the rotors, s; 0 for none.
    local_velocity
        Whether each hub sees its own velocity (true) or that of the centre of gravity (false).
    throttle_exponent
        The table is entered with throttle ** throttle_exponent: 1 for a table measured on this vehicle's own throttle scale,
        below 1 where thrust flattens out towards full throttle.
    """

    position: FloatArray
    axis: FloatArray
    spin: FloatArray
    effectiveness: FloatArray
    table: RotorTable
    K_T: float
    K_T_table: float
    T_u: float = 1.0
    tau_d: float = 0.0
    motor_lag: float = 0.0
    local_velocity: bool = False
    throttle_exponent: float = 1.0

    def __post_init__(self) -> None:
        n = len(self.position)
        if (
            self.position.shape != (n, 3)
            or self.axis.shape != (n, 3)
            or self.spin.shape != (n,)
            or self.effectiveness.shape != (n,)
        ):
            raise InputError("rotors", "position, axis, spin and effectiveness must describe the same rotors")
        if not np.all(np.isin(self.spin, (-1.0, 1.0))):
            raise InputError("rotors.spin", f"must be +1 or -1, got {self.spin.tolist()}")
        if not np.allclose(np.linalg.norm(self.axis, axis=1), 1.0, atol=1e-9):
            raise InputError("rotors.axis", "must be unit vectors")
        for name in ("K_T", "K_T_table", "T_u", "throttle_exponent"):
            if not getattr(self, name) > 0:
                raise InputError(f"rotors.{name}", f"must be positive, got {getattr(self, name)}")
        for name in ("tau_d", "motor_lag"):
            if not getattr(self, name) >= 0:
                raise InputError(f"rotors.{name}", f"must not be negative, got {getattr(self, name)}")


@dataclass(frozen=True)
class Pushers:
    """Forward propellers, off in VTOL mode: position [n, 3] m, axis [n, 3], full thrust of each, N."""

    position: FloatArray
    axis: FloatArray
    max_thrust: float


@dataclass(frozen=True)
class Airframe:
    """Everything of a vehicle that is physics: what uncertainty touches."""

    mass: MassProperties
    aerodynamics: Aerodynamics
    rotors: Rotors
    pushers: Pushers
    air_density: float = 1.225
    gravity: float = 9.80665


@dataclass(frozen=True)
class PID:
    """Parallel form, derivative on the measurement through a first-order filter: Kp e + Ki int e dt - Kd s y / (tau_f s + 1)."""

    Kp: float
    Ki: float = 0.0
    Kd: float = 0.0
    tau_f: float = 0.0
    limit: float = np.inf


@dataclass(frozen=True)
class Controller:
    """Four cascaded loops, sampled; every number belongs to the vehicle the law was designed for (``design``).

    Velocity loops give accelerations (m/s^2), turned into attitude by 1/g and into collective force by the design mass; rate
    loops give angular accelerations (rad/s^2), turned into moments by the design inertia. Gains: position 1/s, velocity Kp 1/s,
    Ki 1/s^2, Kd 1, attitude 1/s, rate Kp 1/s, Ki 1/s^2, Kd 1. Limits: position loop m/s, velocity loops m/s^2, attitude rad and
    rad/s, rate loops rad/s^2.
    """

    design: Airframe
    rate: float
    position: float
    altitude: float
    velocity_limit: float
    climb_limit: float
    horizontal: PID
    vertical: PID
    roll: float
    pitch: float
    heading: float
    attitude_limit: float
    rate_limit: float
    roll_rate: PID
    pitch_rate: PID
    yaw_rate: PID
    throttle_min: float
    throttle_max: float
    command_lag: float = 0.0
    trim_speeds: tuple[float, float, float] = (-5.0, 15.0, 1.0)

    def __post_init__(self) -> None:
        if not self.rate > 0:
            raise InputError("controller.rate", f"must be positive, got {self.rate}")
        if not 0 <= self.throttle_min < self.throttle_max <= 1:
            raise InputError("controller.throttle", f"needs 0 <= min < max <= 1, got {self.throttle_min} and {self.throttle_max}")

    @property
    def period(self) -> float:
        """Control period T_c, s."""
        return 1.0 / self.rate


SENSOR_CHANNELS = ("x_north", "y_east", "altitude", "V_lon", "V_lat", "V_vert", "phi", "theta", "psi", "p", "q", "r")


@dataclass(frozen=True)
class Sensors:
    """Lag (s) and delay (whole control periods) of each channel in ``SENSOR_CHANNELS``; zeros are the ideal sensor."""

    lag: FloatArray = field(default_factory=lambda: np.zeros(len(SENSOR_CHANNELS)))
    delay: NDArray[np.int64] = field(default_factory=lambda: np.zeros(len(SENSOR_CHANNELS), dtype=np.int64))


@dataclass(frozen=True)
class Validity:
    """Where the linear aerodynamics are claimed to hold; incidences count only above ``airspeed_min`` (m/s). Radians."""

    alpha: tuple[float, float] = (-np.inf, np.inf)
    beta: tuple[float, float] = (-np.inf, np.inf)
    airspeed_min: float = 1.0


@dataclass(frozen=True)
class Vehicle:
    """A vehicle that can be trimmed, simulated and linearised."""

    name: str
    airframe: Airframe
    controller: Controller
    sensors: Sensors = field(default_factory=Sensors)
    validity: Validity = field(default_factory=Validity)
    assumed: tuple[tuple[str, str], ...] = ()

    @cached_property
    def n_rotors(self) -> int:
        """Number of lift rotors."""
        return len(self.airframe.rotors.spin)
