"""What a criterion on a rotation reads of a record."""

from __future__ import annotations

from typing import Literal

import numpy as np

from levelone.errors import InputError, unknown_name
from levelone.handling.history import FloatArray, IntArray, TimeHistory
from levelone.status import Status

RotationAxis = Literal["pitch", "roll", "yaw"]
RATE_AND_ATTITUDE = {"pitch": ("q", "theta"), "roll": ("p", "phi"), "yaw": ("r", "psi")}
"""Channels of each axis."""

MAY_WRAP = ("phi", "psi", "phi_ref", "psi_ref")
"""Channels, rad, that may be recorded within a turn."""
STEADY = 0.1
"""Largest change before the input, as a fraction of the first peak, that still counts as trim."""


def rotation(history: TimeHistory, axis: str) -> tuple[FloatArray, FloatArray]:
    """Rate and attitude of an axis as changes from trim, ``[run, time]`` each."""
    if axis not in RATE_AND_ATTITUDE:
        raise unknown_name("axis", str(axis), RATE_AND_ATTITUDE)
    rate, attitude = (history.change(channel) for channel in RATE_AND_ATTITUDE[axis])
    if axis == "yaw":
        attitude = continuous(attitude)
    return np.ascontiguousarray(rate), np.ascontiguousarray(attitude)


def continuous(heading: FloatArray) -> FloatArray:
    """Change of a heading that may be recorded within a turn, ``[run, time]``, rad: without jumps, its first sample within half
    a turn of trim."""
    with np.errstate(invalid="ignore"):
        turned = np.unwrap(heading, axis=1)
        return np.asarray(turned - 2.0 * np.pi * np.round(turned[:, :1] / (2.0 * np.pi)), dtype=np.float64)


def without_jumps(channel: str, values: FloatArray) -> FloatArray:
    """Values of a channel, ``[time]``; of one that may wrap, without whole turns between samples, so that it has a mean."""
    return np.unwrap(values) if channel in MAY_WRAP else values


def run_failures(history: TimeHistory) -> IntArray:
    """Status of each run that failed, 0 for the others: a failed run has no metric, whatever its channels hold."""
    failed = np.array([Status(code).failed for code in history.status.tolist()])
    return np.where(failed, history.status, 0).astype(np.int64)


def first_sample(history: TimeHistory, time: float | FloatArray) -> IntArray:
    """First sample at or after each time, none below 0; one that equals it but for rounding counts."""
    place = (np.asarray(time, dtype=np.float64) - history.time[0]) / history.dt
    return np.maximum(np.ceil(place - 1e-6), 0.0).astype(np.int64)


def check_prominence(prominence: float) -> None:
    """Raise :class:`InputError` unless the fraction lies between 0 and 1."""
    if not 0.0 < prominence < 1.0:
        raise InputError("prominence", f"is {prominence}, must lie between 0 and 1")
