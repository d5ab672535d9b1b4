"""The controller's period against the same law written out in NumPy, tick by tick, in every mode."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from vehicles import vehicle

from levelone.dynamics import trim
from levelone.dynamics.controller import COMMANDS, MODES, control
from levelone.dynamics.trim import law_of
from levelone.vehicle import PID, SENSOR_CHANNELS, Vehicle

T, G, SPEED = 0.004, 9.80665, 5.0
#: limits so narrow that every loop reaches its own long before a throttle does
CRAFT = vehicle(
    law={
        "command_lag": 0.1, "velocity_limit": 0.5, "climb_limit": 0.5, "attitude_limit": 0.08, "rate_limit": 0.3, "roll": 5.0,
        "horizontal": PID(0.89, 0.32, 0.05, 0.1, 0.8), "vertical": PID(2.0, 1.0, 0.2, 0.05, 0.7),
        "roll_rate": PID(5.4, 5.9, 0.12, 0.02, 1.5), "pitch_rate": PID(5.0, 5.5, 0.1, 0.03, 1.2),
        "yaw_rate": PID(0.2, 0.1, 0.01, 0.03, 0.05),
    }
)  # fmt: skip


@dataclass
class Loop:
    """Kp e + Ki integral of e - Kd times the filtered slope of the measurement; limited, with the integral held at the limit."""

    gains: PID
    integral: float
    filtered: float
    limited: bool = False

    def __call__(self, reference: float, measured: float) -> float:
        g = self.gains
        slope = (measured - self.filtered) / (g.tau_f + T)
        self.filtered += T * slope
        error = reference - measured
        free = g.Kp * error + self.integral - g.Kd * slope
        if abs(free) <= g.limit or error * free < 0.0:
            self.integral += g.Ki * error * T
        self.limited = self.limited or abs(free) > g.limit
        return float(np.clip(free, -g.limit, g.limit))


@dataclass
class Cascade:
    """The documented structure around six loops, from the trim of the design vehicle at ``SPEED``."""

    craft: Vehicle
    mode: str
    height: float = 0.0
    heading: float = 0.0
    filtered_speed: np.ndarray = field(default_factory=lambda: np.array([SPEED, 0.0]))

    def __post_init__(self) -> None:
        c = self.craft.controller
        speeds = np.arange(-5.0, 15.5, 1.0)
        trims = [trim(self.craft, v) for v in speeds]
        self.feed_forward = PchipInterpolator(speeds, [np.concatenate([t.attitude[0], t.throttle[0]]) for t in trims])
        self.allocation = law_of(self.craft).allocation
        self.trim_attitude = trim(self.craft, SPEED).attitude[0]
        self.lon, self.lat, self.vert = Loop(c.horizontal, 0.0, SPEED), Loop(c.horizontal, 0.0, 0.0), Loop(c.vertical, 0.0, 0.0)
        self.rates = [Loop(g, 0.0, 0.0) for g in (c.roll_rate, c.pitch_rate, c.yaw_rate)]

    def attitude(self, command: dict[str, float], y: dict[str, float]) -> tuple[float, float, float]:
        """phi, theta and the forward speed that schedules the feed-forward."""
        c = self.craft.controller
        if self.mode in ("rate", "attitude"):
            return command["phi"] + self.trim_attitude[1], command["theta"] + self.trim_attitude[0], SPEED
        wanted = np.array([SPEED + command["V_lon"], command["V_lat"]])
        if self.mode == "position":
            north, east = command["x_north"] - y["x_north"], command["y_east"] - y["y_east"]
            cos, sin = np.cos(y["psi"]), np.sin(y["psi"])
            to_place = c.position * np.array([cos * north + sin * east, cos * east - sin * north])
            wanted += np.clip(to_place, -c.velocity_limit, c.velocity_limit)
        self.filtered_speed = wanted + np.exp(-T / c.command_lag) * (self.filtered_speed - wanted)
        forward, right = self.lon(self.filtered_speed[0], y["V_lon"]), self.lat(self.filtered_speed[1], y["V_lat"])
        theta, phi = self.feed_forward(self.filtered_speed[0])[:2]
        wanted_attitude = np.clip([phi + right / G, theta - forward / G], -c.attitude_limit, c.attitude_limit)
        return *wanted_attitude, self.filtered_speed[0]

    def __call__(self, command: dict[str, float], y: dict[str, float]) -> np.ndarray:
        c, m = self.craft.controller, self.craft.airframe.mass
        phi, theta, speed = self.attitude(command, y)
        p, q = command["p"], command["q"]
        if self.mode != "rate":
            errors = np.array([c.roll * (phi - y["phi"]), c.pitch * (theta - y["theta"])])
            p, q = np.clip(errors, -c.rate_limit, c.rate_limit)
        self.heading += command["yaw_rate"] * T
        turn = np.angle(np.exp(1j * (self.heading - y["psi"])))
        r = command["yaw_rate"] + float(np.clip(c.heading * turn, -c.rate_limit, c.rate_limit))
        error = self.height + command["altitude"] - y["altitude"]
        climb = float(np.clip(command["V_vert"] + c.altitude * error, -c.climb_limit, c.climb_limit))
        self.height += command["V_vert"] * T
        moments = [loop(ref, y[name]) for loop, ref, name in zip(self.rates, (p, q, r), "pqr", strict=True)]
        demand = np.array([m.mass, m.I_xx, m.I_yy, m.I_zz]) * [self.vert(climb, y["V_vert"]), *moments]
        return self.feed_forward(speed)[2:] + self.allocation @ demand


@pytest.mark.oracle
@pytest.mark.parametrize("mode", MODES)
def test_each_period_is_the_documented_law(mode: str) -> None:
    """Smooth random motion of all channels and commands, large enough for the loops' limits, small enough for the throttles'."""
    law, start, cascade = law_of(CRAFT), trim(CRAFT, SPEED), Cascade(CRAFT, mode)
    random = np.random.default_rng(5)
    t = T * np.arange(400)[:, None]
    channels = {"V_lon": SPEED, "theta": start.attitude[0, 0]}
    sizes = {"x_north": 4.0, "y_east": 8.0, "altitude": 1.5, "V_lon": 0.8, "V_lat": 0.8, "V_vert": 0.6, "psi": 3.0}
    asked = {**sizes, "p": 0.3, "q": 0.3}
    phases, speeds = random.uniform(0.0, 6.0, (2, len(SENSOR_CHANNELS)))
    wave = np.sin(speeds * t + phases) - np.sin(phases)
    y = np.array([channels.get(n, 0.0) for n in SENSOR_CHANNELS]) + wave * [sizes.get(n, 0.05) for n in SENSOR_CHANNELS]
    phases, speeds = random.uniform(0.0, 6.0, (2, len(COMMANDS)))
    commands = (np.sin(speeds * t + phases) - np.sin(phases)) * [asked.get(n, 0.05) for n in COMMANDS]
    memory, throttle = start.memory[0].copy(), np.empty(8)
    for k in range(len(t)):
        saturated = control(law, MODES.index(mode), commands[k], SPEED, 0.0, y[k], memory, throttle)
        expected = cascade(dict(zip(COMMANDS, commands[k], strict=True)), dict(zip(SENSOR_CHANNELS, y[k], strict=True)))
        assert not saturated, k
        np.testing.assert_allclose(throttle, expected, rtol=0.0, atol=1e-9, err_msg=f"tick {k}")
    loops = [cascade.vert, *cascade.rates] + ([cascade.lon, cascade.lat] if mode in ("velocity", "position") else [])
    assert all(loop.limited for loop in loops)


@pytest.mark.theory
def test_the_derivative_of_a_ramp_is_its_slope() -> None:
    """Rate mode, pitch rate ramping: after many filter times the derivative term is -Kd times the slope of q."""
    law, start = law_of(vehicle(law={"pitch_rate": PID(0.0, 0.0, 0.3, 0.02, 1e6)})), trim(CRAFT, 0.0)
    memory, throttle = np.zeros_like(start.memory[0]), np.empty(8)
    y = np.zeros(len(SENSOR_CHANNELS))
    for k in range(200):
        y[SENSOR_CHANNELS.index("q")] = 2.0 * k * T
        control(law, MODES.index("rate"), np.zeros(len(COMMANDS)), 0.0, 0.0, y, memory, throttle)
    moment = np.linalg.pinv(law.allocation) @ (throttle - start.throttle[0])
    assert moment[2] == pytest.approx(-0.3 * 2.0 * 0.7237, rel=1e-6)
