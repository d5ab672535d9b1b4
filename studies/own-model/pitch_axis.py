"""Pitch attitude of a second order behind a delay, as a model of one's own: see study.toml."""

import numpy as np
from scipy.signal import StateSpace, dlsim


def fly(parameters, manoeuvre):
    """One run: pitch in deg and pitch rate in deg/s over time in s, from trim at zero.

    The input is constant between samples, for which the steps are exact.
    """
    gain, omega, zeta, delay = (parameters[name] for name in ("gain", "omega", "zeta", "delay"))
    time = manoeuvre.ticks()
    stick = manoeuvre.command(time - delay)
    # states: pitch and pitch rate, rad
    system = StateSpace([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]], [[0.0], [gain * omega**2]], np.eye(2), np.zeros((2, 1)))
    _, answer, _ = dlsim(system.to_discrete(manoeuvre.dt, method="zoh"), stick)
    pitch, rate = np.degrees(answer).T
    return {"time": time, "pitch_deg": pitch, "pitch_rate": rate}
