"""Frequency response from a frequency sweep, by windowed spectra with coherence.

Overlapping segments of input and output are tapered and transformed; their averaged spectra give the response
H1 = S_xy / S_xx and the coherence |S_xy|^2 / (S_xx S_yy) (Bendat and Piersol, Random Data, 4th ed. 2010, chapters
6 and 9). Several window lengths are joined into one response, each weighted at each frequency by how little random
error it has (Tischler and Remple, Aircraft and Rotorcraft System Identification, 2nd ed. 2012, chapters 7 and 10).

What a linear sweep asks for, since each frequency passes only once:

- segments overlap by far more than half: one that meets a frequency on the rising side of its taper sees the response
  too large, on the falling side too small, and only a dense set of both cancels;
- the record is extended by zeros, its value in trim, on both sides, so that the first and last frequencies get both;
- windows are long: the response is averaged over the width of the window's own spectrum, some 3.6 / length in rad/s
  (rms, Hann), which flattens resonances and lifts a response that falls steeply towards low frequency.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from levelone.errors import InputError, unknown_name
from levelone.handling.axes import continuous, run_failures
from levelone.handling.frequency import ComplexArray, FrequencyResponse
from levelone.handling.history import FloatArray, TimeHistory
from levelone.handling.tapers import TAPERS, taper_of

WINDOWS = (0.6, 0.4, 0.2)
"""Window lengths taken by default, as parts of the record."""
Spectra = tuple[FloatArray, FloatArray, ComplexArray]
"""Auto spectra of input and output and cross spectrum, summed over the segments of one window length."""


@dataclass(frozen=True, eq=False)
class Segmentation:
    """How records are cut into segments, and at which frequencies their spectra are read.

    Parameters
    ----------
    rate
        1/s, samples a second.
    counts
        Samples of each window.
    overlap, taper
        Fraction of a window shared with the next, and its taper.
    transform
        Samples of the transform, padded by zeros.
    kept
        Frequencies of the transform that are read.
    omega
        ``[frequency]``, rad/s: those that are read.
    """

    rate: float
    counts: tuple[int, ...]
    overlap: float
    taper: str
    transform: int
    kept: slice
    omega: FloatArray


def identify(
    history: TimeHistory,
    output: str,
    *,
    input_name: str | None = None,
    sign: int = 1,
    windows: float | Sequence[float] | None = None,
    overlap: float = 0.8,
    taper: str = "hann",
    omega_min: float = 0.3,
    omega_max: float = 12.0,
) -> FrequencyResponse:
    """Frequency response of every run of a sweep, with coherence; both of shape ``[run, frequency]``.

    Parameters
    ----------
    history
        Sweep that begins and ends at trim.
    output
        Channel whose change from trim is the output.
    input_name
        Channel of the input; the record's own by default.
    sign
        1, or -1 for an output that moves against the command (``output="theta", sign=-1`` gives -theta / V_lon).
    windows
        s: one length, or several that are joined; by default 0.6, 0.4 and 0.2 of the record. A window should hold two
        periods of the lowest frequency of interest.
    overlap
        Fraction of a window shared with the next, 0.5 to 0.98.
    taper
        ``"hann"``, ``"hamming"``, ``"blackman"``, ``"nuttall"``, ``"cosine"`` or ``"boxcar"``.
    omega_min, omega_max
        rad/s: range that is returned; keep to what the sweep excites.

    Raises
    ------
    InputError
        Unknown channel or taper, a window longer than the record, a range without a frequency.

    Notes
    -----
    A run that failed, or holds values that are not finite, is NaN at every frequency. Several records of one kind are
    taken together by :func:`levelone.handling.joint_identification.identify_records`.
    """
    plan = segmentation([history], windows, overlap, taper, omega_min, omega_max)
    source, answer = input_and_output(history, output, input_name, sign)
    value = np.full((history.n_runs, plan.omega.size), np.nan + 0j)
    coherence = np.full(value.shape, np.nan)
    failures = run_failures(history)
    for run in range(history.n_runs):
        x, y = source[run], answer[run]
        if failures[run] or not (np.isfinite(x).all() and np.isfinite(y).all()):
            continue
        spectra = record_spectra(x, y, plan)
        value[run], coherence[run], _ = composite(spectra, [x.size / count for count in plan.counts])
    return FrequencyResponse(plan.omega, value, coherence)


def input_and_output(history: TimeHistory, output: str, input_name: str | None, sign: int) -> tuple[FloatArray, FloatArray]:
    """Changes from trim of the input and of the signed output, ``[run, time]`` each; a heading ``psi`` may wrap.

    Raises
    ------
    InputError
        An unknown channel, or a sign other than 1 and -1.
    """
    if sign not in (-1, 1):
        raise InputError("sign", f"is {sign}, must be 1 or -1")
    source = history.change(history.input_name if input_name is None else input_name)
    answer = history.change(output)
    return source, sign * (continuous(answer) if output == "psi" else answer)


def segmentation(
    histories: Sequence[TimeHistory],
    windows: float | Sequence[float] | None,
    overlap: float,
    taper: str,
    omega_min: float,
    omega_max: float,
) -> Segmentation:
    """How records of one sampling interval are cut; windows must fit into the shortest of them.

    Raises
    ------
    InputError
        A window that does not fit, an overlap or taper that is not allowed, a range without a frequency.
    """
    lengths = _checked(histories, windows, overlap, taper)
    dt = histories[0].dt
    rate = 1.0 / dt
    counts = tuple(max(round(length * rate), 8) for length in lengths)
    transform = 2 ** math.ceil(math.log2(2 * max(counts)))
    omega = np.asarray(2.0 * np.pi * np.fft.rfftfreq(transform, dt), dtype=np.float64)
    kept = slice(int(np.searchsorted(omega, omega_min)), int(np.searchsorted(omega, omega_max, side="right")))
    if not omega_min > 0.0 or not kept.start < kept.stop:
        raise InputError("omega_min", f"no frequency between {omega_min} and {omega_max} rad/s; both must be positive")
    return Segmentation(rate, counts, overlap, taper, transform, kept, omega[kept])


def record_spectra(x: FloatArray, y: FloatArray, plan: Segmentation) -> list[Spectra]:
    """Spectra of one record, ``[time]`` each, for every window length; several records add up."""
    return [_spectra(x, y, plan, count) for count in plan.counts]


def _spectra(x: FloatArray, y: FloatArray, plan: Segmentation, count: int) -> Spectra:
    shared = min(round(plan.overlap * count), count - 1)
    step = count - shared
    segments = (x.size + 2 * count - shared) // step
    shape = taper_of(plan.taper, count)
    window = shape / np.sqrt(plan.rate * np.sum(shape**2))  # so that squares are power spectral densities
    source, answer = (
        fft.rfft(sliding_window_view(np.pad(series, count), count)[::step] * window, n=plan.transform)[:, : plan.kept.stop].T.copy()
        for series in (x, y)
    )
    # one-sided; the sum over segments is wanted, not their mean, so that windows of different length see the same energy
    energy = segments * step
    auto_x, auto_y = (2.0 * (each.real**2 + each.imag**2).mean(axis=-1) * energy for each in (source, answer))
    cross = 2.0 * (source.conj() * answer).mean(axis=-1) * energy
    return auto_x[plan.kept], auto_y[plan.kept], cross[plan.kept]


def composite(spectra: list[Spectra], independent: list[float]) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Response, coherence and weights ``[window, frequency]`` (their sum is 1) from the spectra of all window lengths.

    ``independent`` is the number of segments of each length that would fit side by side.
    """
    coherences = [_coherence(*each) for each in spectra]
    # neither no nor full coherence may weigh without bound
    errors = [noise_part(np.clip(gamma2, 1e-12, 1.0 - 1e-12), n) for gamma2, n in zip(coherences, independent, strict=True)]
    least = np.min(errors, axis=0)
    weights = [(least / error) ** 8 for error in errors]
    total = np.sum(weights, axis=0)
    auto_x, auto_y, cross = (
        np.sum([weight * each[part] for weight, each in zip(weights, spectra, strict=True)], axis=0) / total for part in range(3)
    )
    excited = auto_x > 1e-12 * auto_x.max()
    value = np.full(cross.shape, np.nan + 0j)
    value[excited] = cross[excited] / auto_x[excited]
    return value, np.where(excited, _coherence(auto_x, auto_y, cross), np.nan), np.asarray(weights) / total


def noise_part(gamma2: FloatArray, averages: npt.ArrayLike) -> FloatArray:
    """Random error of a gain, as a fraction of it, and of a phase, rad, at a coherence, from so many independent averages."""
    with np.errstate(divide="ignore"):
        return np.sqrt(np.maximum(1.0 - gamma2, 0.0) / (2.0 * np.asarray(averages) * gamma2))


def _coherence(auto_x: FloatArray, auto_y: FloatArray, cross: ComplexArray) -> FloatArray:
    power = auto_x * auto_y
    gamma2 = np.zeros(power.shape)
    np.divide(np.abs(cross) ** 2, power, out=gamma2, where=power > 0.0)
    return np.clip(gamma2, 0.0, 1.0)


def _checked(histories: Sequence[TimeHistory], windows: float | Sequence[float] | None, overlap: float, taper: str) -> list[float]:
    duration = min(float(history.time[-1] - history.time[0]) for history in histories)
    given = [part * duration for part in WINDOWS] if windows is None else windows
    lengths = [float(length) for length in np.atleast_1d(np.asarray(given, dtype=np.float64))]
    for length in lengths:
        if not 0.0 < length <= duration:
            raise InputError("windows", f"{length} s does not fit into the record of {duration:.6g} s")
    if not 0.5 <= overlap <= 0.98:
        raise InputError("overlap", f"is {overlap}, must lie between 0.5 and 0.98")
    if taper not in TAPERS:
        raise unknown_name("taper", taper, TAPERS)
    return lengths
