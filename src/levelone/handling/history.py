"""Time histories: a simulated batch or a recorded flight, in the one form that every criterion reads.

A record holds named channels with units, the trim that changes are counted from, the times of the input and all delays
between command and response. A recorded CSV file gives the same value: see :mod:`levelone.handling.records`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

import numpy as np
import numpy.typing as npt

from levelone.errors import InputError, unknown_name
from levelone.status import Status

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

UNIFORM = 1e-3
"""Largest departure of a time stamp from the uniform grid, as a fraction of the interval."""


@dataclass(frozen=True, eq=False)
class TimeHistory:
    """Responses of one or several runs to the same input, sampled at the same uniform times.

    Parameters
    ----------
    time
        ``[time]``, s, increasing and uniform.
    channels
        ``[run, time]`` for each name, SI and rad. Names: ``x_north``, ``y_east``, ``altitude``, ``V_lon``, ``V_lat``,
        ``V_vert``, ``phi``, ``theta``, ``psi``, ``p``, ``q``, ``r``, ``u``, ``v``, ``w``, ``airspeed``, ``alpha``,
        ``beta``, ``throttle_1`` and on, and references such as ``V_lon_ref``; others may be added.
    units
        Unit of each channel, as text.
    trim
        ``[run]`` for each channel: its value in trim; subtracting it gives the change.
    input_name
        Channel that holds the input.
    input_on, input_off
        s; ``input_off`` is NaN where the input stays.
    delay
        ``[run]``, s: all delays between command and response. The free response begins at ``input_off + delay``.
    wind
        m/s: north, east, down.
    status
        ``[run]``, codes of :class:`levelone.status.Status`.
    extremes
        ``[run]`` for each name (``alpha_min``, ``alpha_max``, ``C_D_min`` ...); may be empty.

    Raises
    ------
    InputError
        Wrong shapes, missing units or trim values, times that are not uniform.
    """

    time: FloatArray
    channels: Mapping[str, FloatArray]
    units: Mapping[str, str]
    trim: Mapping[str, FloatArray]
    input_name: str
    input_on: float
    input_off: float
    delay: FloatArray
    wind: tuple[float, float, float]
    status: IntArray
    extremes: Mapping[str, FloatArray] = field(default_factory=dict)
    name: str = ""

    def __post_init__(self) -> None:
        _check_time(self.time)
        _check_channels(self)
        _check_input(self)

    @property
    def n_runs(self) -> int:
        """Number of runs."""
        return int(self.status.shape[0])

    @property
    def dt(self) -> float:
        """Sampling interval, s."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    def change(self, channel: str) -> FloatArray:
        """Change of one channel from trim, ``[run, time]``.

        Raises
        ------
        InputError
            The channel is not in the record.
        """
        if channel not in self.channels:
            raise unknown_name("channel", channel, self.channels)
        return self.channels[channel] - self.trim[channel][:, None]

    def select(self, runs: int | slice | npt.ArrayLike) -> TimeHistory:
        """The same record with some of its runs; the axis of runs stays."""
        index: Any = [runs] if isinstance(runs, int | np.integer) else runs
        if not isinstance(index, slice):
            index = np.asarray(index)
        try:
            status = self.status[index]
        except IndexError as error:
            raise InputError("runs", f"{runs!r} is not among the {self.n_runs} runs of the record") from error
        return replace(
            self,
            channels={name: values[index] for name, values in self.channels.items()},
            trim={name: values[index] for name, values in self.trim.items()},
            delay=self.delay[index],
            status=status,
            extremes={name: values[index] for name, values in self.extremes.items()},
        )

    def to_csv(self, path: str | PathLike[str], run: int = 0) -> None:
        """Write one run as CSV, to the last bit; see :func:`levelone.handling.records.write_csv`."""
        from levelone.handling.records import write_csv

        write_csv(self, path, run)

    @classmethod
    def from_csv(cls, path: str | PathLike[str], **given: Any) -> TimeHistory:
        """Read one run from CSV; ``given`` are the arguments of :func:`levelone.handling.records.read_csv`."""
        from levelone.handling.records import read_csv

        return read_csv(path, **given)


def _check_time(time: FloatArray) -> None:
    if not isinstance(time, np.ndarray) or time.ndim != 1 or time.size < 2:
        raise InputError("time", "needs a vector of two samples or more")
    dt = (time[-1] - time[0]) / (time.size - 1)
    if not (np.isfinite(time).all() and dt > 0.0):
        raise InputError("time", "must be finite and increase")
    departure = float(np.abs(time - (time[0] + dt * np.arange(time.size))).max()) / dt
    if departure > UNIFORM:
        raise InputError(
            "time",
            f"a sample lies {departure:.3g} intervals off the uniform grid (at most {UNIFORM:g}): resample first",
        )


def _check_channels(history: TimeHistory) -> None:
    runs, samples = history.status.shape[0] if history.status.ndim == 1 else -1, history.time.size
    if runs < 1:
        raise InputError("status", f"must have shape [run], not {history.status.shape}")
    for name, values in history.channels.items():
        if values.shape != (runs, samples):
            raise InputError(f"channels.{name}", f"has shape {values.shape}, must be [run, time] = {(runs, samples)}")
        if name not in history.units:
            raise InputError(f"units.{name}", "missing: every channel carries its unit")
        if name not in history.trim:
            raise InputError(f"trim.{name}", "missing: every channel carries its trim value")
    known = {int(code) for code in Status}
    for code in np.unique(history.status):
        if int(code) not in known:
            raise InputError("status", f"{int(code)} is not a code of Status")
    for group in ("trim", "extremes"):
        for name, values in getattr(history, group).items():
            if values.shape != (runs,):
                raise InputError(f"{group}.{name}", f"has shape {values.shape}, must be [run] = {(runs,)}")


def _check_input(history: TimeHistory) -> None:
    if history.input_name not in history.channels:
        raise unknown_name("input_name", history.input_name, history.channels)
    if not math.isfinite(history.input_on):
        raise InputError("input_on", f"is {history.input_on}, must be a finite time")
    if not math.isnan(history.input_off) and not history.input_off > history.input_on:
        raise InputError("input_off", f"is {history.input_off}, must come after input_on = {history.input_on} (or be NaN)")
    if history.delay.shape != history.status.shape:
        raise InputError("delay", f"has shape {history.delay.shape}, must be [run] = {history.status.shape}")
    if not (history.delay >= 0.0).all():
        raise InputError("delay", "must be zero or more in every run")
    if len(history.wind) != 3:
        raise InputError("wind", f"has {len(history.wind)} components, must be north, east, down")
