"""Manoeuvres: what is commanded, from which trim, and for how long."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from levelone.errors import InputError, unknown_name
from levelone.handling.history import FloatArray

FlightMode = Literal["rate", "attitude", "velocity", "position", "direct"]
Axis = Literal["V_lon", "V_lat", "V_vert", "yaw_rate", "theta", "phi", "q", "p", "delta_lon", "delta_lat", "delta_col", "delta_ped"]
Shape = Literal["step", "pulse", "sweep", "none"]
Start = Literal["own trim", "design trim"]
"""From which trim a vehicle begins: its own, or that of the vehicle for which its controller was designed."""

UNITS = {
    "V_lon": "m/s",
    "V_lat": "m/s",
    "V_vert": "m/s",
    "yaw_rate": "rad/s",
    "theta": "rad",
    "phi": "rad",
    "q": "rad/s",
    "p": "rad/s",
    **dict.fromkeys(("delta_lon", "delta_lat", "delta_col", "delta_ped"), "1"),
}
"""Unit of the amplitude on each axis; a pilot's controls ``delta_*`` run from -1 to 1, positive nose up, right, up and right."""

_VELOCITIES = ("V_lon", "V_lat", "V_vert", "yaw_rate")
MODE_AXES: dict[str, tuple[str, ...]] = {
    "rate": ("q", "p", "yaw_rate", "V_vert"),
    "attitude": ("theta", "phi", "yaw_rate", "V_vert"),
    "velocity": _VELOCITIES,
    "position": _VELOCITIES,
    "direct": ("delta_lon", "delta_lat", "delta_col", "delta_ped"),
}
"""Axes that a command can move in each flight mode. In ``position`` a velocity moves the position that is held.
In ``direct`` a pilot's control reaches the model as it is, which models other than the built-in vehicle have."""

# Ticks and input times are sums of decimals: equal to the reader, not always to the last bit.
_SAME_TIME = 1e-9


@dataclass(frozen=True)
class Manoeuvre:
    """One input on one axis, from trim.

    Parameters
    ----------
    name
        Free text.
    flight_mode
        ``"rate"``, ``"attitude"``, ``"velocity"`` (ground speed in the heading frame, altitude held), ``"position"`` or
        ``"direct"``.
    axis
        Command that is moved: see :data:`MODE_AXES`.
    trim_speed, trim_climb
        m/s: ground speed forward and climb rate, positive up, of the trim.
    shape
        ``"step"``, ``"pulse"``, ``"sweep"`` or ``"none"`` (the trim is held).
    amplitude
        Change of the command, m/s, rad or rad/s by axis.
    on, off
        s. ``on`` is 1 or later, so that a record shows its trim; ``off`` is infinite for a step.
    duration
        s, whole record.
    dt
        s, integration step; divides the controller's period.
    controller_rate
        Hz.
    omega_min, omega_max
        rad/s: first and last frequency of a sweep.
    fade
        s over which a sweep fades in, and out.
    wind
        m/s: north, east, down; steady.

    Raises
    ------
    InputError
        A value is out of range, or names an axis that the flight mode cannot command.
    """

    name: str
    flight_mode: FlightMode
    axis: Axis
    trim_speed: float
    trim_climb: float = 0.0
    shape: Shape = "step"
    amplitude: float = 0.0
    on: float = 1.0
    off: float = math.inf
    duration: float = 10.0
    dt: float = 0.004
    controller_rate: float = 250.0
    omega_min: float = 0.3
    omega_max: float = 12.0
    fade: float = 2.0
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _check_names(self)
        _check_numbers(self)
        _check_times(self)
        if self.shape == "sweep":
            _check_sweep(self)

    @property
    def unit(self) -> str:
        """Unit of the amplitude."""
        return UNITS[self.axis]

    @property
    def steps_per_tick(self) -> int:
        """Integration steps in one period of the controller."""
        return round(1.0 / (self.controller_rate * self.dt))

    def ticks(self) -> FloatArray:
        """Times at which the controller samples: ``k / controller_rate`` from 0 to ``duration``, s."""
        last = math.floor(self.duration * self.controller_rate + _SAME_TIME * self.controller_rate)
        return np.arange(last + 1) / self.controller_rate

    def command(self, time: npt.ArrayLike) -> FloatArray:
        """Change of the commanded axis from trim at the given times, in the shape of ``time``.

        The input acts from ``on``, inclusive, until ``off``, exclusive. A sweep is a sine whose frequency grows
        linearly with time, so that its phase is the integral of the frequency; raised cosines fade it in and out.
        """
        t = np.asarray(time, dtype=np.float64)
        active = (t >= self.on - _SAME_TIME) & (t < self.off - _SAME_TIME)
        if self.shape == "none":
            return np.zeros_like(t)
        if self.shape in ("step", "pulse"):
            return np.where(active, self.amplitude, 0.0)
        since = np.clip(t - self.on, 0.0, self.off - self.on)
        length = self.off - self.on
        phase = self.omega_min * since + 0.5 * (self.omega_max - self.omega_min) * since**2 / length
        ends = np.minimum(since, length - since) / self.fade if self.fade > 0.0 else np.ones_like(t)
        envelope = 0.5 * (1.0 - np.cos(np.pi * np.minimum(ends, 1.0)))
        return np.where(active, self.amplitude * envelope * np.sin(phase), 0.0)


def step(axis: Axis, amplitude: float, *, trim_speed: float, **options: Any) -> Manoeuvre:
    """A step that stays until the end of the record; ``options`` are the fields of :class:`Manoeuvre`.

    Examples
    --------
    >>> step("V_lon", 1.0, trim_speed=5.0).command([0.5, 1.0, 9.0]).tolist()
    [0.0, 1.0, 1.0]
    """
    return _manoeuvre("step", axis, amplitude, trim_speed, options)


def pulse(axis: Axis, amplitude: float, *, trim_speed: float, length: float = 0.5, on: float = 1.0, **options: Any) -> Manoeuvre:
    """A pulse of ``length`` seconds; ``options`` are the fields of :class:`Manoeuvre`."""
    return _manoeuvre("pulse", axis, amplitude, trim_speed, {"on": on, "off": on + length, **options})


def sweep(
    axis: Axis,
    amplitude: float,
    *,
    trim_speed: float,
    length: float = 90.0,
    on: float = 1.0,
    settle: float = 5.0,
    **options: Any,
) -> Manoeuvre:
    """A linear-frequency sweep of ``length`` seconds, followed by ``settle`` seconds at trim.

    Keep ``settle`` above the memory of the response: the spectra then lose nothing at the end of the record.
    """
    times = {"on": on, "off": on + length, "duration": on + length + settle}
    return _manoeuvre("sweep", axis, amplitude, trim_speed, {**times, **options})


def _manoeuvre(shape: Shape, axis: Axis, amplitude: float, trim_speed: float, options: dict[str, Any]) -> Manoeuvre:
    fields = {"name": f"{shape} in {axis}", "flight_mode": "velocity", **options}
    for name in options:
        if name not in Manoeuvre.__dataclass_fields__:
            raise unknown_name("manoeuvre", name, Manoeuvre.__dataclass_fields__)
    return Manoeuvre(axis=axis, amplitude=amplitude, trim_speed=trim_speed, shape=shape, **fields)


def _check_names(manoeuvre: Manoeuvre) -> None:
    for field, allowed in (("flight_mode", get_args(FlightMode)), ("axis", get_args(Axis)), ("shape", get_args(Shape))):
        if getattr(manoeuvre, field) not in allowed:
            raise unknown_name(f"manoeuvre.{field}", str(getattr(manoeuvre, field)), allowed)
    axes = MODE_AXES[manoeuvre.flight_mode]
    if manoeuvre.axis not in axes:
        raise InputError(
            "manoeuvre.axis",
            f"{manoeuvre.axis!r} cannot be commanded in mode {manoeuvre.flight_mode!r}; allowed: {', '.join(axes)}",
        )


def _check_numbers(manoeuvre: Manoeuvre) -> None:
    for field in (
        "trim_speed",
        "trim_climb",
        "amplitude",
        "on",
        "duration",
        "dt",
        "controller_rate",
        "omega_min",
        "omega_max",
        "fade",
    ):
        if not math.isfinite(getattr(manoeuvre, field)):
            raise InputError(f"manoeuvre.{field}", f"is {getattr(manoeuvre, field)}, must be finite")
    for field in ("duration", "dt", "controller_rate"):
        if getattr(manoeuvre, field) <= 0.0:
            raise InputError(f"manoeuvre.{field}", f"is {getattr(manoeuvre, field)}, must be positive")
    if len(manoeuvre.wind) != 3 or not all(map(math.isfinite, manoeuvre.wind)):
        raise InputError("manoeuvre.wind", f"is {manoeuvre.wind}, must be three finite speeds: north, east, down")
    if manoeuvre.shape == "none":
        return
    if manoeuvre.amplitude == 0.0:
        raise InputError("manoeuvre.amplitude", "is 0: use shape = 'none' to hold the trim")


def _check_times(manoeuvre: Manoeuvre) -> None:
    ratio = 1.0 / (manoeuvre.controller_rate * manoeuvre.dt)
    if ratio < 0.5 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        period = 1.0 / manoeuvre.controller_rate
        raise InputError("manoeuvre.dt", f"{manoeuvre.dt} s does not divide the controller's period of {period:.9g} s")
    if manoeuvre.on < 1.0:
        raise InputError("manoeuvre.on", f"is {manoeuvre.on} s, must be 1 s or later, so that the record shows its trim")
    if manoeuvre.shape == "none":
        return
    if not manoeuvre.on < manoeuvre.duration:
        raise InputError("manoeuvre.duration", f"{manoeuvre.duration} s ends before the input at {manoeuvre.on} s")
    if not manoeuvre.off > manoeuvre.on:
        raise InputError("manoeuvre.off", f"is {manoeuvre.off} s, must come after on = {manoeuvre.on} s")
    if manoeuvre.shape == "step" and math.isfinite(manoeuvre.off):
        raise InputError("manoeuvre.off", f"is {manoeuvre.off} s on a step, which stays: use shape = 'pulse'")
    if manoeuvre.shape != "step" and not manoeuvre.off <= manoeuvre.duration:
        raise InputError("manoeuvre.off", f"is {manoeuvre.off} s, must lie within the record of {manoeuvre.duration} s")


def _check_sweep(manoeuvre: Manoeuvre) -> None:
    if not 0.0 < manoeuvre.omega_min < manoeuvre.omega_max:
        raise InputError(
            "manoeuvre.omega_max",
            f"{manoeuvre.omega_max} rad/s must exceed omega_min = {manoeuvre.omega_min} rad/s, which must be positive",
        )
    nyquist = math.pi * manoeuvre.controller_rate
    if manoeuvre.omega_max >= nyquist:
        raise InputError(
            "manoeuvre.omega_max",
            f"{manoeuvre.omega_max} rad/s reaches the controller's Nyquist frequency, {nyquist:.4g} rad/s",
        )
    if not 0.0 <= manoeuvre.fade <= 0.5 * (manoeuvre.off - manoeuvre.on):
        raise InputError("manoeuvre.fade", f"is {manoeuvre.fade} s, must lie between 0 and half the sweep")
