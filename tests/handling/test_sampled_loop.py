"""Metrics of a sampled closed loop stay smooth as a delay moves between multiples of the controller's period.

The loop holds its moment for one period, so that the rate is bent at a place that moves with the delay. At the
multiples themselves the loop's own response has a faint kink in the delay, which is the loop's and not the reading's.
"""

from __future__ import annotations

import numpy as np
from handling_signals import DT, batch, grid

from levelone.handling.damping import dynamic_stability
from levelone.handling.quickness import attitude_quickness
from levelone.status import Status

DELAYS = np.linspace(0.0, 0.03, 301)


def sampled_loop(delay, command, omega=5.61, zeta=0.5):
    """Pitch loop whose moment is computed at each tick, held, and applied after a pure delay; exact between ticks."""
    steps = command.size
    whole = np.floor(delay / DT + 1e-12).astype(int)
    part = delay / DT - whole
    runs = np.arange(delay.size)
    moment = np.zeros((delay.size, steps + 1))
    q, theta = np.zeros((delay.size, steps)), np.zeros((delay.size, steps))
    for k in range(steps):
        moment[:, k] = -2.0 * zeta * omega * q[:, k] - omega**2 * (theta[:, k] - command[k])
        if k + 1 == steps:
            break
        old = np.where(k - whole - 1 >= 0, moment[runs, np.maximum(k - whole - 1, 0)], 0.0)
        new = np.where(k - whole >= 0, moment[runs, np.maximum(k - whole, 0)], 0.0)
        early, late = part * DT, (1.0 - part) * DT
        q[:, k + 1] = q[:, k] + early * old + late * new
        theta[:, k + 1] = theta[:, k] + DT * q[:, k] + old * early * (0.5 * early + late) + 0.5 * new * late**2
    return q, theta


def roughness(values):
    """Largest second difference between multiples of the period, over the mean."""
    between = np.abs(DELAYS[1:-1] / DT - np.round(DELAYS[1:-1] / DT)) > 1e-6
    return np.abs(np.diff(values, 2))[between].max() / np.abs(values).mean()


def test_quickness_is_smooth_in_the_delay():
    time = grid(5.0)
    q, theta = sampled_loop(DELAYS, np.where(time >= 1.0 - 1e-9, -0.1, 0.0))
    result = attitude_quickness(batch(q, theta, time=time))
    assert (result.status == Status.OK).all()
    assert (result.status_min == Status.OK).all()
    for values in (result.quickness, result.q_pk, result.delta_theta_pk, result.delta_theta_min):
        assert np.abs(values / values[0] - 1.0).max() > 0.01  # the delay does matter
        assert roughness(values) < 1.5e-6
    assert roughness(np.abs(q).max(axis=1)) > 5e-6  # the largest sample


def test_damping_is_smooth_in_the_delay():
    time = grid(6.0)
    pulse = np.where((time >= 1.0 - 1e-9) & (time < 1.5 - 1e-9), -0.1, 0.0)
    q, theta = sampled_loop(DELAYS, pulse, zeta=0.4)
    result = dynamic_stability(batch(q, theta, time=time, off=1.5, delay=DELAYS))
    assert (result.status_omega == Status.OK).all()
    for values in (result.zeta, result.omega_n):
        assert np.abs(values / values[0] - 1.0).max() > 0.03
        assert roughness(values) < 1.5e-6
