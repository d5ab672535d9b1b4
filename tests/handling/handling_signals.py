"""Records whose metrics are known in closed form, and small helpers that several tests share."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

from levelone.handling.history import TimeHistory
from levelone.status import Status

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "handling.toml").read_text(encoding="utf-8"))
DT = 0.004


def batch(rate, attitude, *, time, on=1.0, off=np.nan, delay=0.0, status=None, trim_rate=0.0, trim_attitude=0.0):
    """A record of pitch: ``rate`` and ``attitude`` are changes from trim, ``[run, time]``."""
    rate, attitude = np.atleast_2d(rate), np.atleast_2d(attitude)
    runs = rate.shape[0]
    command = np.where((time >= on - 1e-9) & ~(time >= off - 1e-9), 1.0, 0.0)
    return TimeHistory(
        time=time,
        channels={
            "V_lon_ref": np.tile(5.0 + command, (runs, 1)),
            "q": rate + trim_rate,
            "theta": attitude + trim_attitude,
        },
        units={"V_lon_ref": "m/s", "q": "rad/s", "theta": "rad"},
        trim={"V_lon_ref": np.full(runs, 5.0), "q": np.full(runs, trim_rate), "theta": np.full(runs, trim_attitude)},
        input_name="V_lon_ref",
        input_on=on,
        input_off=off,
        delay=np.broadcast_to(np.asarray(delay, dtype=float), (runs,)).copy(),
        wind=(0.0, 0.0, 0.0),
        status=np.full(runs, Status.OK, dtype=np.int64) if status is None else np.asarray(status, dtype=np.int64),
    )


def grid(duration=10.0, dt=DT):
    return np.arange(round(duration / dt) + 1) * dt


def decaying_sine(time, zeta, omega_n, amplitude=-0.3, begin=1.0):
    """Rate -A exp(-sigma s) sin(omega s) from ``begin`` and its integral: ``[run, time]`` each."""
    zeta, omega_n, begin = (np.atleast_1d(np.asarray(v, dtype=float))[:, None] for v in (zeta, omega_n, begin))
    sigma, omega = zeta * omega_n, omega_n * np.sqrt(1.0 - zeta**2)
    s = np.maximum(time - begin, 0.0)
    decay = np.exp(-sigma * s)
    rate = amplitude * decay * np.sin(omega * s)
    attitude = amplitude * (omega - decay * (sigma * np.sin(omega * s) + omega * np.cos(omega * s))) / omega_n**2
    return rate, attitude


def decaying_sine_metrics(zeta, omega_n, amplitude=-0.3):
    """q_pk, delta_theta_pk, delta_theta_min and their times after the beginning, by calculus."""
    sigma, omega = zeta * omega_n, omega_n * np.sqrt(1.0 - zeta**2)
    size = abs(amplitude)
    first = np.arctan2(omega, sigma) / omega

    def attitude(s):
        turn = sigma * np.sin(omega * s) + omega * np.cos(omega * s)
        return np.abs(omega - np.exp(-sigma * s) * turn) * size / omega_n**2

    q_pk = size * np.exp(-sigma * first) * np.sin(omega * first)
    second = first + np.pi / omega
    return q_pk, attitude(np.pi / omega), attitude(second), first, np.pi / omega, second


def second_difference(values):
    """Largest second difference over the mean size: what a step or a kink in a smooth sweep shows up in."""
    return np.abs(np.diff(values, 2)).max() / np.abs(values).mean()
