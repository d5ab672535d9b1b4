"""Channels of a recorded file on one uniform clock: windows of time, gaps, missing cells, resampling."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from levelone.config.column_mapping import Source, in_file, series, source_of_time
from levelone.config.data_files import DataFile, FloatArray
from levelone.errors import InputError
from levelone.handling.axes import without_jumps
from levelone.handling.history import UNIFORM

LARGEST_GAP = 5.0
"""Intervals between two samples over which is interpolated unless told otherwise."""
FAR = 1e6
"""s: a clock that begins beyond this counts from another age; times are then counted from the first sample."""
SLOW = 0.5
"""Interval from which on a clock must state its unit: no manoeuvre is recorded that slowly, a clock in ms or us looks like it."""
MOST_SAMPLES = 50_000_000
"""Samples of one channel after resampling; more is a slip in the clock."""
_EDGE = 1e-9
"""s: rounding of a clock that does not put a sample out of the window."""


@dataclass(frozen=True, eq=False)
class Table:
    """Channels on one uniform clock.

    Parameters
    ----------
    time
        ``[sample]``, s, uniform.
    channels
        ``[sample]`` each, SI and rad, finite; headings and bank angles without jumps.
    sources
        Where each channel and ``time`` (if the file has one column of it) come from, by the names that the file has.
    units
        The unit that each of them was read in; empty where neither the file nor the mapping states one, and SI was taken.
    largest_gap
        s between two neighbouring samples of the file.
    resampled
        Whether values were interpolated to the uniform clock.
    notes
        What was done to the data, in words.
    """

    time: FloatArray
    channels: Mapping[str, FloatArray]
    sources: Mapping[str, Source]
    units: Mapping[str, str]
    largest_gap: float
    resampled: bool
    notes: tuple[str, ...]

    @property
    def dt(self) -> float:
        """Sampling interval, s."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))


def tabulate(
    file: DataFile,
    mapping: Mapping[str, Source],
    *,
    start: float = -math.inf,
    end: float = math.inf,
    dt: float | None = None,
    largest_gap: float = LARGEST_GAP,
) -> Table:
    """Bring the mapped channels of a file to one uniform clock.

    Parameters
    ----------
    file, mapping
        The file, and where each channel comes from.
    start, end
        s: the window that is used, inclusive; nothing outside it is looked at.
    dt
        s: interval to resample to; by default the median one of the file (of the fastest column, where columns have their own
        clocks), and no resampling where the samples are uniform already.
    largest_gap
        Intervals without a sample over which is interpolated.

    Raises
    ------
    InputError
        Times that are missing, repeated or go back; a clock without a unit that would be too slow in s; a window without
        samples; a gap larger than allowed; a missing value.

    Notes
    -----
    Values between samples are linear. Headings and bank angles are unwrapped before, and whether or not it is interpolated.
    """
    sources = {name: in_file(file, source) for name, source in mapping.items()}
    clock_source = source_of_time(file, sources)
    time_of_file, units = _clock_of_file(file, clock_source)
    if clock_source is not None:
        sources = {"time": clock_source} | sources
    read = {name: series(file, source) for name, source in sources.items() if name != "time"}
    if not read:
        raise InputError(str(file.path), "no channel is taken from it; map at least an input and a response")
    clocks: dict[str, FloatArray] = {}
    values: dict[str, FloatArray] = {}
    for name, (numbers, own, _) in read.items():
        clock = own if own is not None else time_of_file
        if clock is None or clock.size != numbers.size:
            size = 0 if clock is None else clock.size
            raise InputError(mapping[name].field, f"{file.path.name}: {name} has {numbers.size} samples, its time {size}")
        clocks[name], values[name] = _window(file, mapping[name], clock, numbers, start, end)
    gaps = {name: _largest_gap(file, name, clock, largest_gap) for name, clock in clocks.items()}
    fastest = min(clocks, key=lambda name: (round(float(np.median(np.diff(clocks[name]))), 9), -clocks[name].size))
    time, resampled = _uniform(file, clocks, fastest, dt)
    channels = {name: _resampled(time, clocks[name], values[name], name, resampled) for name in values}
    notes = [*file.notes, *_notes(clocks, time, fastest, resampled, gaps)]
    if time_of_file is not None and time[0] > FAR:
        notes.append(f"the clock begins at {time[0]:.0f} s: times are counted from there")
        time = time - time[0]
    units |= {name: unit for name, (_, _, unit) in read.items()}
    return Table(time, channels, sources, units, max(gaps.values()), resampled, tuple(notes))


def _clock_of_file(file: DataFile, source: Source | None) -> tuple[FloatArray | None, dict[str, str]]:
    """The column of time, s, and the unit that it was read in; none where every column has its own.

    A clock in ms or us that is taken for one in s makes an aircraft of milliradians a second, with a Level.
    """
    if source is None:
        return None, {}
    clock, _, unit = series(file, source)
    interval = float(np.median(np.diff(clock))) if clock.size > 1 else 0.0
    if not unit and interval >= SLOW:
        usual = "us" if source.name.lower().startswith("timestamp") else "ms"
        raise InputError(
            source.field,
            f"{file.path.name}: its samples are {interval:.6g} apart, which as seconds is no record of a manoeuvre: "
            f"state its unit: time={source.name}[{usual}] or [s]",
        )
    return clock, {"time": unit}


def _window(
    file: DataFile, source: Source, clock: FloatArray, values: FloatArray, start: float, end: float
) -> tuple[FloatArray, FloatArray]:
    """Samples of one channel inside the window; InputError for times and values that cannot be used."""
    inside = ~((clock < start - _EDGE) | (clock > end + _EDGE))
    clock, values = clock[inside], values[inside]
    if clock.size < 2:
        raise InputError(str(file.path), f"holds {clock.size} samples from {start:g} to {end:g} s: two are the least")
    bad = np.flatnonzero(~np.isfinite(clock))
    if bad.size:
        raise InputError(str(file.path), f"{bad.size} times are missing, the first at sample {bad[0] + 1}")
    back = np.flatnonzero(np.diff(clock) <= 0.0)
    if back.size:
        k = back[0]
        what = "stands twice" if clock[k + 1] == clock[k] else f"is followed by {clock[k + 1]:.9g} s"
        raise InputError(
            str(file.path), f"time does not increase: {clock[k]:.9g} s (sample {k + 1}) {what}; {back.size} such places"
        )
    missing = np.flatnonzero(~np.isfinite(values))
    if missing.size:
        at = clock[missing[0]]
        raise InputError(
            source.field,
            f"{file.path.name}: {source.channel} has {missing.size} missing values, the first at {at:.6g} s: leave them out with "
            "--from and --to, or mend the record",
        )
    return clock, values


def _largest_gap(file: DataFile, name: str, clock: FloatArray, allowed: float) -> float:
    steps = np.diff(clock)
    k = int(np.argmax(steps))
    interval = float(np.median(steps))
    if steps[k] > allowed * interval * (1.0 + 1e-9):
        raise InputError(
            str(file.path),
            f"{name} has no sample for {steps[k]:.4g} s after {clock[k]:.6g} s, {steps[k] / interval:.1f} intervals (at most "
            f"{allowed:g}): leave the gap out with --from and --to, or allow it with --gap",
        )
    return float(steps[k])


def _uniform(file: DataFile, clocks: Mapping[str, FloatArray], fastest: str, dt: float | None) -> tuple[FloatArray, bool]:
    """The common clock, and whether values must be interpolated to it."""
    clock = clocks[fastest]
    first = max(float(each[0]) for each in clocks.values())
    last = min(float(each[-1]) for each in clocks.values())
    mean = (clock[-1] - clock[0]) / (clock.size - 1)
    even = clock[0] + mean * np.arange(clock.size)
    shared = all(each.size == clock.size and np.array_equal(each, clock) for each in clocks.values())
    if dt is None and shared and float(np.abs(clock - even).max()) <= 0.5 * UNIFORM * mean:
        return even, False
    step = float(np.median(np.diff(clock))) if dt is None else dt
    count = math.floor((last - first) / step * (1.0 + 1e-12) + 1e-6) + 1 if last > first else 0
    if not 2 <= count <= MOST_SAMPLES:
        raise InputError(str(file.path), f"its channels share {max(last - first, 0.0):.4g} s, {count} samples of {step:.4g} s")
    return first + step * np.arange(count), True


def _resampled(time: FloatArray, clock: FloatArray, values: FloatArray, name: str, resampled: bool) -> FloatArray:
    """Values on the common clock; an angle that may wrap goes on without jumps, for its mean and its changes count."""
    straight = without_jumps(name, values)
    return np.interp(time, clock, straight) if resampled else straight


def _notes(
    clocks: Mapping[str, FloatArray], time: FloatArray, fastest: str, resampled: bool, gaps: Mapping[str, float]
) -> list[str]:
    if not resampled:
        return []
    step = (time[-1] - time[0]) / (time.size - 1)
    steps = np.diff(clocks[fastest])
    notes = [f"resampled to {1.0 / step:.6g} Hz: intervals of {steps.min():.4g} to {steps.max():.4g} s in the file"]
    for name, clock in clocks.items():
        interval = float(np.median(np.diff(clock)))
        if interval > 1.5 * step:
            notes.append(
                f"{name} is recorded at {1.0 / interval:.4g} Hz and interpolated to {1.0 / step:.4g} Hz (largest gap "
                f"{gaps[name]:.3g} s): it is not known above {math.pi / interval:.3g} rad/s"
            )
    return notes
