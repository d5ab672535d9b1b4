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
from typing import Any

import numpy as np
from scipy import signal

from levelone.errors import InputError, unknown_name
from levelone.handling.axes import run_failures
from levelone.handling.frequency import ComplexArray, FrequencyResponse
from levelone.handling.history import FloatArray, TimeHistory

WINDOWS = (0.6, 0.4, 0.2)
"""Window lengths taken by default, as parts of the record."""
TAPERS = ("hann", "hamming", "blackman", "nuttall", "cosine", "boxcar")
_Spectra = tuple[FloatArray, FloatArray, ComplexArray]


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
    A run that failed, or holds values that are not finite, is NaN at every frequency.
    """
    lengths = _checked(history, windows, overlap, taper, sign)
    source = history.change(history.input_name if input_name is None else input_name)
    answer = sign * history.change(output)
    rate = 1.0 / history.dt
    samples = [max(round(length * rate), 8) for length in lengths]
    transform = 2 ** math.ceil(math.log2(2 * max(samples)))
    omega = np.asarray(2.0 * np.pi * np.fft.rfftfreq(transform, history.dt), dtype=np.float64)
    inside = (omega >= omega_min) & (omega <= omega_max)
    if not omega_min > 0.0 or not inside.any():
        raise InputError("omega_min", f"no frequency between {omega_min} and {omega_max} rad/s; both must be positive")
    value = np.full((history.n_runs, int(inside.sum())), np.nan + 0j)
    coherence = np.full(value.shape, np.nan)
    failures = run_failures(history)
    for run in range(history.n_runs):
        x, y = source[run], answer[run]
        if failures[run] or not (np.isfinite(x).all() and np.isfinite(y).all()):
            continue
        spectra = [_spectra(x, y, rate, count, overlap, taper, transform, inside) for count in samples]
        value[run], coherence[run] = _composite(spectra, [x.size / count for count in samples])
    return FrequencyResponse(omega[inside], value, coherence)


def _spectra(
    x: FloatArray,
    y: FloatArray,
    rate: float,
    count: int,
    overlap: float,
    taper: str,
    transform: int,
    inside: np.ndarray,
) -> _Spectra:
    """Auto spectra of input and output and cross spectrum, for one window length of ``count`` samples."""
    x, y = np.pad(x, count), np.pad(y, count)
    shared = min(round(overlap * count), count - 1)
    options: dict[str, Any] = {
        "fs": rate,
        "window": taper,
        "nperseg": count,
        "noverlap": shared,
        "nfft": transform,
        "detrend": False,
    }
    # SciPy averages over segments; the sum is wanted, so that windows of different length see the same energy
    segments = (x.size - shared) // (count - shared)
    energy = segments * (count - shared)
    auto_x = signal.welch(x, **options)[1][inside] * energy
    auto_y = signal.welch(y, **options)[1][inside] * energy
    cross = signal.csd(x, y, **options)[1][inside] * energy
    return auto_x, auto_y, cross


def _composite(spectra: list[_Spectra], independent: list[float]) -> tuple[ComplexArray, FloatArray]:
    """Response and coherence from the spectra of all window lengths, each with its number of independent segments."""
    coherences = [_coherence(*each) for each in spectra]
    errors = [
        np.sqrt(np.maximum(1.0 - gamma2, 1e-12)) / np.sqrt(np.maximum(gamma2, 1e-12) * 2.0 * count)
        for gamma2, count in zip(coherences, independent, strict=True)
    ]
    least = np.min(errors, axis=0)
    weights = [(least / error) ** 8 for error in errors]
    total = np.sum(weights, axis=0)
    auto_x, auto_y, cross = (
        np.sum([weight * each[part] for weight, each in zip(weights, spectra, strict=True)], axis=0) / total for part in range(3)
    )
    excited = auto_x > 1e-12 * auto_x.max()
    value = np.full(cross.shape, np.nan + 0j)
    value[excited] = cross[excited] / auto_x[excited]
    return value, np.where(excited, _coherence(auto_x, auto_y, cross), np.nan)


def _coherence(auto_x: FloatArray, auto_y: FloatArray, cross: ComplexArray) -> FloatArray:
    power = auto_x * auto_y
    gamma2 = np.zeros(power.shape)
    np.divide(np.abs(cross) ** 2, power, out=gamma2, where=power > 0.0)
    return np.clip(gamma2, 0.0, 1.0)


def _checked(history: TimeHistory, windows: float | Sequence[float] | None, overlap: float, taper: str, sign: int) -> list[float]:
    duration = float(history.time[-1] - history.time[0])
    given = [part * duration for part in WINDOWS] if windows is None else windows
    lengths = [float(length) for length in np.atleast_1d(np.asarray(given, dtype=np.float64))]
    for length in lengths:
        if not 0.0 < length <= duration:
            raise InputError("windows", f"{length} s does not fit into the record of {duration:.6g} s")
    if not 0.5 <= overlap <= 0.98:
        raise InputError("overlap", f"is {overlap}, must lie between 0.5 and 0.98")
    if taper not in TAPERS:
        raise unknown_name("taper", taper, TAPERS)
    if sign not in (-1, 1):
        raise InputError("sign", f"is {sign}, must be 1 or -1")
    return lengths
