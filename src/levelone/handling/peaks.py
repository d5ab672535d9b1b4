"""Extrema of a sampled signal, refined between samples so that what is built on them is smooth in the model's inputs.

The largest sample jumps by one interval when an input moves the peak across the middle between two samples; a
metric read from it is a staircase, and the difference of two runs is noise. Here a quartic is fitted by least
squares to the seven samples around the extremum and its own extremum is taken.

Why a fit through samples, and not the extremum of the simulated motion itself: the controller holds its output for
one period, so the angular acceleration jumps at every tick and the rate between ticks is bent at a place that
moves with the delay. The samples at the ticks, however, are those of a linear discrete system and lie on a smooth
curve; the fit follows that curve. Why seven samples and degree four: odd errors cancel at the centre of a
symmetric window, so the error of the value is of sixth order in (omega dt) (below 1e-9 at 6 rad/s and 250 Hz),
while a recorded flight's noise is still averaged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from levelone.compiled import kernel
from levelone.handling.history import FloatArray, IntArray

HALF_WINDOW = 3
_TINY = 1e-6

BoolArray = npt.NDArray[np.bool_]
_OFFSETS = np.arange(-HALF_WINDOW, HALF_WINDOW + 1.0)
_FIT: FloatArray = np.ascontiguousarray(np.linalg.pinv(np.vander(_OFFSETS, 5, increasing=True)))
"""``[power, sample]``: coefficients of the least-squares quartic from the seven samples."""


@kernel
def fit(x, centre):
    """Coefficients c0 to c4 of the quartic in (sample - centre)."""
    c0 = c1 = c2 = c3 = c4 = 0.0
    for j in range(2 * HALF_WINDOW + 1):
        v = x[centre - HALF_WINDOW + j]
        c0 += _FIT[0, j] * v
        c1 += _FIT[1, j] * v
        c2 += _FIT[2, j] * v
        c3 += _FIT[3, j] * v
        c4 += _FIT[4, j] * v
    return c0, c1, c2, c3, c4


@kernel
def window_centre(k, low, high):
    """Centre nearest to sample k whose window stays within the samples low to high, inclusive."""
    return min(max(k, low + HALF_WINDOW), high - HALF_WINDOW)


@kernel
def value_at(x, position, low, high):
    """Value at a place between samples, position counted in samples."""
    centre = window_centre(round(position), low, high)
    c0, c1, c2, c3, c4 = fit(x, centre)
    s = position - centre
    return c0 + s * (c1 + s * (c2 + s * (c3 + s * c4)))


@kernel
def refine(x, k, low, high):
    """Place (in samples) and value of the extremum near sample k, from samples low to high, inclusive.

    Where the fit has no extremum within a sample of k (noise, or the end of the record), the sample itself is returned.
    """
    centre = window_centre(k, low, high)
    c0, c1, c2, c3, c4 = fit(x, centre)
    left, right = k - centre - 1.0, k - centre + 1.0
    slope_left = c1 + left * (2.0 * c2 + left * (3.0 * c3 + left * 4.0 * c4))
    slope_right = c1 + right * (2.0 * c2 + right * (3.0 * c3 + right * 4.0 * c4))
    if not slope_left * slope_right < 0.0:
        return float(k), x[k]
    for _ in range(60):  # bisection: ends at the last bit of a sample's place, for a few microseconds a run
        s = 0.5 * (left + right)
        slope = c1 + s * (2.0 * c2 + s * (3.0 * c3 + s * 4.0 * c4))
        if slope * slope_left > 0.0:
            left = s
        else:
            right = s
    s = 0.5 * (left + right)
    return centre + s, c0 + s * (c1 + s * (c2 + s * (c3 + s * c4)))


@kernel
def usable_end(x, start):
    """One past the last sample before the first that is not finite."""
    for k in range(start, x.size):
        if not math.isfinite(x[k]):
            return k
    return x.size


@kernel
def spread_before(x, stop):
    """Peak-to-peak value and largest magnitude before sample ``stop``: what the record shows without any input."""
    if stop <= 0:
        return 0.0, 0.0
    low, high = x[0], x[0]
    for k in range(1, stop):
        low, high = min(low, x[k]), max(high, x[k])
    return high - low, max(abs(low), abs(high))


@kernel
def first_extrema(x, start, stop, prominence, noise, found):
    """Samples of the first extrema of x (change from trim) in [start, stop); their number is returned, ``found``
    is filled.

    Maxima and minima alternate. An extremum counts once the signal has turned back from it by ``prominence`` times
    the first extremum's magnitude, and by more than the record's own ``noise``. The first extremum lies inside the
    range, above the noise, and is dropped when the next one is more than 1/prominence times larger: it was a blip
    ahead of the response.
    """
    largest = 0.0
    for k in range(start, stop):
        largest = max(largest, abs(x[k]))
    floor = max(noise, _TINY * largest)
    count, direction = 0, 0
    high = low = start
    for k in range(start + 1, stop):
        if x[k] > x[high]:
            high = k
        if x[k] < x[low]:
            low = k
        first = abs(x[found[0]]) if count > 0 else 0.0
        from_high = max(prominence * (first if count > 0 else abs(x[high])), floor)
        from_low = max(prominence * (first if count > 0 else abs(x[low])), floor)
        if direction >= 0 and high > start and x[high] - x[k] >= from_high:
            pick, direction = high, -1
        elif direction <= 0 and low > start and x[k] - x[low] >= from_low:
            pick, direction = low, 1
        else:
            continue
        high = low = k
        if count == 0 and abs(x[pick]) < floor:
            continue
        if count == 1 and prominence * abs(x[pick]) > first:
            count = 0
        found[count] = pick
        count += 1
        if count == found.size:
            break
    return count


@kernel
def settled(x, start, stop, tolerance):
    """Whether the last tenth of the range moves by no more than the tolerance."""
    tail = max(stop - max((stop - start) // 10, 2), start)
    low, high = x[tail], x[tail]
    for k in range(tail, stop):
        low, high = min(low, x[k]), max(high, x[k])
    return high - low <= tolerance


@kernel
def _extrema_kernel(x, before, starts, prominence, values, places, counts, spread, at_rest):
    found = np.zeros(values.shape[1] - 1, np.int64)
    for i in range(x.shape[0]):
        row, start = x[i], starts[i]
        stop = usable_end(row, 0)
        if stop - start <= 2 * HALF_WINDOW + 1:
            counts[i] = -1
            continue
        noise, offset = spread_before(row, min(before, stop))
        spread[i, 0], spread[i, 1] = noise, offset
        count = first_extrema(row, start, stop, prominence, noise, found)
        counts[i] = count
        largest = start
        for k in range(start, stop):
            if abs(row[k]) > abs(row[largest]):
                largest = k
        for j in range(found.size + 1):  # the last column: the largest change, a peak or not
            if j < count or j == found.size:
                k = largest if j == found.size else found[j]
                places[i, j], values[i, j] = refine(row, k, start, stop - 1)
        scale = abs(values[i, 0]) if count > 0 else abs(row[largest])
        at_rest[i] = settled(row, start, stop, max(prominence * scale, noise))


@kernel
def _values_kernel(x, starts, places, values):
    for i in range(x.shape[0]):
        last = usable_end(x[i], 0) - 1
        if places[i] <= last and last - starts[i] >= 2 * HALF_WINDOW:
            values[i] = value_at(x[i], places[i], starts[i], last)


@dataclass(frozen=True, eq=False)
class Extrema:
    """First extrema of each run of a signal, refined between samples.

    Parameters
    ----------
    count
        ``[run]``: how many were found; -1 where the record is too short to search.
    place, value
        ``[run, extremum]``: in samples, and in the signal's unit; NaN where there is none.
    largest_place, largest_value
        ``[run]``: the same for the largest change, whether the signal turns back from it or not.
    noise, offset
        ``[run]``: peak-to-peak value and largest magnitude before the input.
    at_rest
        ``[run]``: whether the end of the record moves by less than what counts as an extremum.
    """

    count: IntArray
    place: FloatArray
    value: FloatArray
    largest_place: FloatArray
    largest_value: FloatArray
    noise: FloatArray
    offset: FloatArray
    at_rest: BoolArray


def extrema(x: FloatArray, before: int, starts: IntArray, prominence: float, number: int) -> Extrema:
    """First extrema of each row of changes from trim.

    Parameters
    ----------
    x
        ``[run, time]``, contiguous.
    before
        First sample of the input: what lies before it is the record's own noise.
    starts
        ``[run]``: sample from which each run is searched.
    prominence
        Fraction of the first extremum by which the signal must turn back.
    number
        How many extrema are asked for.
    """
    shape = (x.shape[0], number + 1)
    values, places = np.full(shape, np.nan), np.full(shape, np.nan)
    counts, spread = np.zeros(x.shape[0], dtype=np.int64), np.zeros((x.shape[0], 2))
    at_rest = np.zeros(x.shape[0], dtype=np.bool_)
    _extrema_kernel(x, before, starts, prominence, values, places, counts, spread, at_rest)
    return Extrema(
        count=counts,
        place=places[:, :-1],
        value=values[:, :-1],
        largest_place=places[:, -1],
        largest_value=values[:, -1],
        noise=spread[:, 0],
        offset=spread[:, 1],
        at_rest=at_rest,
    )


def values_at(x: FloatArray, starts: IntArray, places: FloatArray) -> FloatArray:
    """Value of each row at a place between samples, ``[run]``; NaN where the place is, or the row ends before it."""
    values = np.full(x.shape[0], np.nan)
    _values_kernel(x, starts, np.ascontiguousarray(places), values)
    return values
