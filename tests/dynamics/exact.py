"""The sampled closed loop integrated from event to event, as an oracle: switching and delay written anew, SciPy in between."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from vehicles import measured, rate_of

from levelone.dynamics import trim
from levelone.dynamics.controller import COMMANDS, MODES, control
from levelone.dynamics.trim import law_of
from levelone.vehicle import Vehicle


def gust_at(gust: np.ndarray, period: float, t: float) -> tuple[float, ...]:
    """Wind between ticks, linear."""
    ticks = period * np.arange(len(gust))
    return tuple(float(np.interp(t, ticks, column)) for column in gust.T)


def fly_exactly(craft: Vehicle, speed: float, gust: np.ndarray, commands: np.ndarray, mode: str = "velocity") -> np.ndarray:
    """[ticks, 13 + rotors] state and rotor throttles, from trim.

    Command ``k`` is computed at ``k T_c`` and reaches the rotors at ``k T_c + tau_d``; until the first arrives they follow the
    trim. With a motor lag the throttles approach the command exponentially.
    """
    start = trim(craft, speed, wind=tuple(gust[0]))
    law, period, rotors = law_of(craft), craft.controller.period, craft.airframe.rotors
    x, memory = start.state[0].copy(), start.memory[0].copy()
    actual, sent, output = start.throttle[0].copy(), start.throttle[0].copy(), []
    arrivals: list[tuple[float, np.ndarray]] = []
    for k in range(len(gust)):
        output.append(np.concatenate([x, actual]))
        control(law, MODES.index(mode), commands[k], speed, 0.0, measured(x), memory, sent)
        arrivals.append((k * period + rotors.tau_d, sent.copy()))
        begin, end = k * period, (k + 1) * period
        inside = [t for t, _ in arrivals if begin + 1e-12 < t < end - 1e-12]
        for a, b in zip([begin, *inside], [*inside, end], strict=True):
            arrived = [u for t, u in arrivals if t <= a + 1e-12]
            command = arrived[-1] if arrived else start.throttle[0]
            x, actual = between(craft, x, actual, command, gust, a, b)
        if arrivals[0][0] < begin - 3 * period and len(arrivals) > 300:
            arrivals.pop(0)
    return np.array(output)


def between(
    craft: Vehicle, x: np.ndarray, actual: np.ndarray, command: np.ndarray, gust: np.ndarray, a: float, b: float
) -> tuple[np.ndarray, np.ndarray]:
    """State and throttles at ``b`` from those at ``a`` under one command."""
    lag, period = craft.airframe.rotors.motor_lag, craft.controller.period

    def throttle(t: float) -> np.ndarray:
        return command + (actual - command) * np.exp(-(t - a) / lag) if lag > 0 else command

    rate = rate_of(craft, throttle, lambda t: gust_at(gust, period, t))
    run = solve_ivp(rate, (a, b), x, "DOP853", rtol=1e-11, atol=1e-12, first_step=b - a)
    end = run.y[:, -1]
    end[6:10] /= np.linalg.norm(end[6:10])
    return end, throttle(b)


def no_commands(ticks: int) -> np.ndarray:
    """[ticks, COMMANDS] zeros: hold the trim."""
    return np.zeros((ticks, len(COMMANDS)))
