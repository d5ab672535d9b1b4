"""A second-order attitude response and a first-order speed response, in closed form, for models of every kind."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import cont2discrete, lfilter

from levelone.campaign.models.mapping import channel_history
from levelone.config.model_table import CommandTable, PythonTable, ResponseName, Test
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import TimeHistory
from levelone.handling.manoeuvres import Manoeuvre, pulse, step, sweep

OMEGA_N, ZETA, SPEED_LAG = 5.0, 0.3, 3.0
DIRECT: dict[str, Any] = {"trim_speed": 0.0, "flight_mode": "direct"}
STEP = step("delta_lon", 0.2, **DIRECT)
PULSE = pulse("delta_lon", 0.2, duration=6.0, **DIRECT)
SWEEP = sweep("delta_lon", 0.2, length=60.0, omega_min=0.5, omega_max=25.0, **DIRECT)
SPEED = step("V_lon", 1.0, trim_speed=0.0, duration=30.0)
QUICK = Test("quick", "attitude_quickness", "pitch", STEP)
FREE = Test("free", "dynamic_stability", "pitch", PULSE)
RISE = Test("rise", "translational_rate", None, SPEED)
SWEPT = Test(
    "swept", "bandwidth", "pitch", SWEEP, output="theta", method="sweep", windows=(20.0, 10.0), response_type="attitude_command"
)


def attitude(omega_n: float, zeta: float, time: np.ndarray, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """theta and q of theta'' + 2 zeta omega_n theta' + omega_n^2 theta = omega_n^2 command, rad and rad/s, exact at samples."""
    dt, poles = float(time[1] - time[0]), [1.0, 2.0 * zeta * omega_n, omega_n**2]
    theta, q = (cont2discrete(([omega_n**2, *zeros], poles), dt, method="zoh") for zeros in ([], [0.0]))
    return lfilter(theta[0][0], theta[1], command), lfilter(q[0][0], q[1], command)


@dataclass(frozen=True)
class SecondOrder:
    """A source whose factors are omega_n and zeta; speeds follow with SPEED_LAG. It counts its flights."""

    flown: list[str] = field(default_factory=list)

    @property
    def key(self) -> dict[str, Any]:
        return {"kind": "second order"}

    def fly(self, point: np.ndarray, manoeuvre: Manoeuvre) -> TimeHistory:
        self.flown.append(manoeuvre.axis)
        time = manoeuvre.ticks()
        if manoeuvre.axis == "V_lon":
            since = np.maximum(time - manoeuvre.on, 0.0)
            return channel_history(time, {"V_lon": manoeuvre.amplitude * -np.expm1(-since / SPEED_LAG)}, manoeuvre)
        theta, q = attitude(*point, time, manoeuvre.command(time))
        return channel_history(time, {"theta": theta, "q": q}, manoeuvre)

    def frequency_response(self, point: np.ndarray, command: str, output: str, omega: np.ndarray) -> FrequencyResponse:
        r = omega / point[0]
        return FrequencyResponse(omega, np.exp(-0.05j * omega) / (1.0 - r**2 + 2j * point[1] * r))


def python_table(function: str, folder: Path | None, *responses: tuple[str, str], **options: Any) -> PythonTable:
    """A Python function that answers responses, or histories where none are named."""
    named = tuple(ResponseName(*each) for each in responses)
    given = {"kind": "python", "fixed": (), "inputs": (), "outputs": (), "vectorised": False} | options
    return PythonTable(**given, function=function, folder=folder, gives="responses" if named else "histories", responses=named)


def command_table(arguments: tuple[str, ...], base: Path, *responses: tuple[str, str], **options: Any) -> CommandTable:
    """A command that answers responses, or histories where none are named."""
    named = tuple(ResponseName(*each) for each in responses)
    given: dict[str, Any] = {"kind": "command", "fixed": (), "inputs": (), "outputs": (), "format": "json", "folder": None}
    given |= {"time_limit": 20.0, "keep": "failed"} | options
    return CommandTable(**given, arguments=arguments, base=base, gives="responses" if named else "histories", responses=named)
