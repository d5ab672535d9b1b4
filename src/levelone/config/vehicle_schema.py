"""Sections of a vehicle file. Each number is declared with the unit that it is kept in."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import create_model

from levelone.config.quantities import Origin, Quantity, si
from levelone.config.schema import Strict, Text
from levelone.vehicle import COEFFICIENTS, SENSOR_CHANNELS, TARGET_UNITS

OPTIONAL_COEFFICIENTS = {
    ("C_Lalphadot", "C_malphadot"): "not given: 0, the lag of the downwash is left out",
    ("C_Ldelta_e", "C_mdelta_e", "C_ldelta_a", "C_ndelta_a", "C_Ydelta_r", "C_ldelta_r", "C_ndelta_r"): (
        "not given: 0, no control surface moves in VTOL flight"
    ),
}
"""Groups of coefficients that a file may leave out, and what is assumed then."""

Fraction = Annotated[Quantity, si("1", sign="not negative")]
Seconds = Annotated[Quantity, si("s", sign="not negative")]
Length = Annotated[Quantity, si("m", sign="positive")]
SpeedLimit = Annotated[Quantity, si("m/s", sign="not negative")]
Inertia = Annotated[Quantity, si("kg m^2", sign="positive")]
Exponent = Annotated[Quantity, si("1", sign="positive")]
ThrustCoefficient = Annotated[Quantity, si("N/rpm^2", sign="positive")]
PerSecond = Annotated[Quantity, si("1/s", sign="not negative")]
PerSecondSquared = Annotated[Quantity, si("1/s^2", sign="not negative")]
AngleRange = Annotated[Quantity, si("rad", (2,))]
Each = Annotated[Quantity, si("1", (None,))]
Shares = Annotated[Quantity, si("1", (None,), sign="not negative")]
Points = Annotated[Quantity, si("m", (None, 3))]
Axes = Annotated[Quantity, si("1", (None, 3))]


class General(Strict):
    """[vehicle]"""

    name: Text
    description: str = ""


class Mass(Origin):
    """[mass]: about the centre of gravity, body axes."""

    mass: Annotated[Quantity, si("kg", sign="positive")]
    I_xx: Inertia
    I_yy: Inertia
    I_zz: Inertia
    I_xz: Annotated[Quantity, si("kg m^2")]


class Environment(Origin):
    """[environment]"""

    air_density: Annotated[Quantity, si("kg/m^3", sign="positive")]
    gravity: Annotated[Quantity, si("m/s^2", sign="positive")]


class _Geometry(Origin):
    area: Annotated[Quantity, si("m^2", sign="positive")]
    chord: Length
    span: Length
    moment_reference: Text
    airspeed: Annotated[Quantity, si("m/s", (None,))] | None = None


def _coefficient(name: str) -> tuple[Any, Any]:
    annotation: Any = Annotated[Quantity, si(TARGET_UNITS[name], (), (None,))]
    optional = any(name in group for group in OPTIONAL_COEFFICIENTS)
    return (annotation | None, None) if optional else (annotation, ...)


_COEFFICIENTS: dict[str, Any] = {name: _coefficient(name) for name in COEFFICIENTS}
Aerodynamics: Any = create_model("Aerodynamics", __base__=_Geometry, **_COEFFICIENTS)
"""[aerodynamics]: coefficients are constant, or one value for each entry of ``airspeed``."""


class Table(Origin):
    """[rotors] table: performance of one rotor, and the same on a finer grid for convergence checks."""

    needed: ClassVar[bool] = True

    file: Text
    fine_file: Text | None = None


class RotorGroup(Origin):
    """[rotors]"""

    table: Table
    position: Points
    axis: Axes | None = None
    spin: Each
    effectiveness: Shares | None = None
    K_T: ThrustCoefficient
    K_T_table: ThrustCoefficient
    T_u: Fraction
    tau_d: Seconds
    motor_lag: Seconds
    throttle_exponent: Exponent | None = None
    velocity: Literal["centre of gravity", "local"]


class PusherGroup(Origin):
    """[pushers]"""

    position: Points
    axis: Axes | None = None
    max_thrust: Annotated[Quantity, si("N", sign="not negative")]


class VelocityLoop(Origin):
    """Gains from a velocity error to an acceleration."""

    Kp: PerSecond
    Ki: PerSecondSquared
    Kd: Fraction
    tau_f: Seconds
    limit: Annotated[Quantity, si("m/s^2", sign="positive")]


class RateLoop(Origin):
    """Gains from a rate error to an angular acceleration."""

    Kp: PerSecond
    Ki: PerSecondSquared
    Kd: Fraction
    tau_f: Seconds
    limit: Annotated[Quantity, si("rad/s^2", sign="positive")]


class Control(Origin):
    """[controller]"""

    rate: Annotated[Quantity, si("Hz", sign="positive")]
    command_lag: Seconds
    position: PerSecond
    altitude: PerSecond
    velocity_limit: SpeedLimit
    climb_limit: SpeedLimit
    horizontal: VelocityLoop
    vertical: VelocityLoop
    roll: PerSecond
    pitch: PerSecond
    heading: PerSecond
    attitude_limit: Annotated[Quantity, si("rad", sign="positive")]
    rate_limit: Annotated[Quantity, si("rad/s", sign="positive")]
    roll_rate: RateLoop
    pitch_rate: RateLoop
    yaw_rate: RateLoop
    throttle_min: Fraction
    throttle_max: Fraction
    trim_speeds: Annotated[Quantity, si("m/s", (3,))]


class Sensor(Origin):
    """[sensors.CHANNEL]"""

    lag: Seconds | None = None
    delay: Seconds | None = None


_CHANNELS: dict[str, Any] = dict.fromkeys(SENSOR_CHANNELS, (Sensor | None, None))
SensorUnit: Any = create_model("SensorUnit", __base__=Origin, **_CHANNELS)
"""[sensors]: channels that are left out are ideal."""


class Limits(Origin):
    """[validity]"""

    alpha: AngleRange
    beta: AngleRange
    airspeed_min: SpeedLimit


class VehicleFile(Strict):
    """A whole vehicle file."""

    vehicle: General
    mass: Mass
    environment: Environment
    aerodynamics: Aerodynamics
    rotors: RotorGroup
    pushers: PusherGroup | None = None
    controller: Control
    sensors: SensorUnit | None = None
    validity: Limits
