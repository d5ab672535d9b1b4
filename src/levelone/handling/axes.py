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

STEADY = 0.1
"""Largest change before the input, as a fraction of the first peak, that still counts as trim."""


def rotation(history: TimeHistory, axis: str) -> tuple[FloatArray, FloatArray]:
    """Rate and attitude of an axis as changes from trim, ``[run, time]`` each."""
    if axis not in RATE_AND_ATTITUDE:
        raise unknown_name("axis", str(axis), RATE_AND_ATTITUDE)
    rate, attitude = (history.change(channel) for channel in RATE_AND_ATTITUDE[axis])
    if axis == "yaw":  # a heading may be recorded within half a turn
        attitude = np.unwrap(attitude, axis=1)
        attitude -= 2.0 * np.pi * np.round(attitude[:, :1] / (2.0 * np.pi))
    return np.ascontiguousarray(rate), np.ascontiguousarray(attitude)


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
