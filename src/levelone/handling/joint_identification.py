"""One frequency response from several records of a sweep, with the random error that noise leaves in it.

The spectra of all records are added before the response is formed, so that no segment lies across the joint of two
records and records may differ in length. The random error is that of Bendat and Piersol (Random Data, 4th ed. 2010,
chapter 9; Tischler and Remple, Aircraft and Rotorcraft System Identification, 2nd ed. 2012, chapter 7): with n averages
that are independent of each other,

    std(|H|) / |H| = std(phase) = sqrt((1 - gamma^2) / (2 n gamma^2))

for gain and phase (rad) alike. How many averages are independent follows from the windows (Welch, The Use of Fast
Fourier Transform for the Estimation of Power Spectra, IEEE Trans. Audio Electroacoust. 15, 1967): segments that overlap
share their noise. For tapers w_i that enter with weights p_i (their sum is 1) into a record of length T

    n = T / sum_ij p_i p_j G_ij,    G_ij = integral of c_i(tau) c_j(tau) over tau,    c_i = (w_i * w_i) / (energy of w_i).

in the limit of dense segments: one Hann window of length L gives n = T / (0.48 L); at an overlap of one half it would be
T / (0.53 L), which this count misses by a tenth. It holds for a sweep, too, though that passes each frequency once: the
coherence is formed over all segments of the record, those without input at this frequency included, and both cancel.

What the response changes within the width of a window lowers the coherence as noise does: for sharp resonances and short
windows the error is stated too large, and it holds no bias.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import special

from levelone.errors import InputError
from levelone.handling.axes import run_failures
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import FloatArray, IntArray, TimeHistory
from levelone.handling.identification import (
    Segmentation,
    Spectra,
    composite,
    input_and_output,
    noise_part,
    record_spectra,
    segmentation,
)
from levelone.handling.tapers import taper_of
from levelone.status import Status

SAME_DT = 1e-4
"""Largest difference of two sampling intervals, as a fraction, that still counts as the same: frequencies are then off by it."""

_TAPER_SAMPLES = 400


@dataclass(frozen=True, eq=False)
class Identified:
    """A frequency response from records with noise, and how far the noise lets it be known.

    Parameters
    ----------
    response
        ``[frequency]``, with coherence.
    error
        ``[frequency]``: standard deviation of the gain as a fraction of the gain, and of the phase in rad; NaN where
        the response is.
    averages
        ``[frequency]``: number of independent averages that the error rests on.
    status
        ``[record]``: ``OK`` for a run that was used, otherwise why it was left out.
    """

    response: FrequencyResponse
    error: FloatArray
    averages: FloatArray
    status: IntArray

    @property
    def used(self) -> int:
        """Number of runs that were used."""
        return int((self.status == Status.OK).sum())

    def half_width(self, probability: float = 0.95) -> FloatArray:
        """Half-width of the band that holds the response at each frequency, ``[frequency]``: of the gain as a fraction, of the
        phase in rad.

        See :func:`student_factor`.
        """
        return self.error * student_factor(self.averages, probability)


def student_factor(averages: npt.ArrayLike, probability: float = 0.95) -> FloatArray:
    """Half-width of a band over the standard deviation that was estimated from ``averages`` independent ones; NaN up to one.

    Noise is estimated from the same few averages: the band is that of Student's t with 2 n - 2 degrees of freedom (real and
    imaginary part of n averages, less those of the response itself), wider than the normal one by little once n is above 10.

    Raises
    ------
    InputError
        A probability that does not lie between 0 and 1.
    """
    if not 0.0 < probability < 1.0:
        raise InputError("probability", f"is {probability}, must lie between 0 and 1")
    count = np.asarray(averages, dtype=np.float64)
    spare = np.where(count > 1.0, count - 1.0, np.nan)
    return np.asarray(np.sqrt(count / spare) * special.stdtrit(2.0 * spare, 0.5 + 0.5 * probability), dtype=np.float64)


def identify_records(
    histories: Sequence[TimeHistory],
    output: str,
    *,
    input_name: str | None = None,
    sign: int = 1,
    windows: float | Sequence[float] | None = None,
    overlap: float = 0.8,
    taper: str = "hann",
    omega_min: float = 0.3,
    omega_max: float = 12.0,
) -> Identified:
    """One frequency response of all runs of all records together, with coherence and random error.

    Parameters
    ----------
    histories
        Sweeps of one aircraft at one condition, each from trim to trim; of any length, at one sampling interval.
    output, input_name, sign
        As for :func:`~levelone.handling.identification.identify`.
    windows
        s: one length, or several that are joined; by default 0.6, 0.4 and 0.2 of the shortest record.
    overlap, taper, omega_min, omega_max
        As for :func:`~levelone.handling.identification.identify`.

    Raises
    ------
    InputError
        No record, sampling intervals that differ, or as :func:`~levelone.handling.identification.identify`.

    Notes
    -----
    A run that failed, or holds values that are not finite, is left out, and ``status`` says so; without any run left the
    response is NaN. One record gives the numbers of ``identify``.
    """
    if not histories:
        raise InputError("histories", "no record given: one sweep is the least")
    _check_intervals(histories)
    plan = segmentation(histories, windows, overlap, taper, omega_min, omega_max)
    total: list[Spectra] | None = None
    samples, codes = 0, []
    for history in histories:
        source, answer = input_and_output(history, output, input_name, sign)
        failures = run_failures(history)
        for run in range(history.n_runs):
            x, y = source[run], answer[run]
            finite = bool(np.isfinite(x).all() and np.isfinite(y).all())
            codes.append(int(failures[run]) or (Status.OK if finite else Status.OUTPUT_NOT_FINITE))
            if codes[-1] != Status.OK:
                continue
            spectra = record_spectra(x, y, plan)
            total = spectra if total is None else [_sum(one, other) for one, other in zip(total, spectra, strict=True)]
            samples += x.size
    response, averages = _response(total, samples, plan)
    return Identified(response, random_error(response, averages), averages, np.array(codes, dtype=np.int64))


def random_error(response: FrequencyResponse, averages: npt.ArrayLike) -> FloatArray:
    """Standard deviation of the gain as a fraction of it, and of the phase in rad, in the shape of ``value``.

    Parameters
    ----------
    response
        With coherence: what the output holds beside the answer to the input is taken for noise.
    averages
        Number of independent averages, 1 or more: one, or one for each frequency.

    Raises
    ------
    InputError
        A response without coherence (an exact one has no random error), or fewer than one average.
    """
    count = np.asarray(averages, dtype=np.float64)
    if response.coherence is None:
        raise InputError("response.coherence", "missing: the random error is read from it")
    if (count < 1.0).any():
        raise InputError("averages", f"is {count.min():.4g}, must be 1 or more: lengthen the record or shorten the windows")
    gamma2 = np.broadcast_to(response.coherence, response.value.shape)
    return np.where(np.isnan(response.value), np.nan, noise_part(gamma2, count))


def independent_averages(weights: FloatArray, plan: Segmentation, samples: int) -> FloatArray:
    """Number of independent averages at each frequency, ``[frequency]``, from the weights ``[window, frequency]`` of the
    window lengths and the number of samples of all records; 1 at least."""
    shared = np.array([[_shared(one, other, plan.taper) for other in plan.counts] for one in plan.counts])
    spread = np.einsum("if,ij,jf->f", weights, shared, weights)
    return np.maximum(samples / spread, 1.0)


def _shared(one: int, other: int, taper: str) -> float:
    """G of two windows of the given lengths, in samples: how long the noise of one is that of the other."""
    step = max(one, other) / _TAPER_SAMPLES  # the tapers are smooth: a coarse grid holds the integral
    first, second = (_correlation(count / step, taper) for count in (one, other))
    reach = min(first.size, second.size) // 2
    centre, middle = first.size // 2, second.size // 2
    return float(step * np.dot(first[centre - reach : centre + reach + 1], second[middle - reach : middle + reach + 1]))


def _correlation(length: float, taper: str) -> FloatArray:
    window = taper_of(taper, max(round(length), 8))
    product = np.asarray(np.convolve(window, window[::-1]), dtype=np.float64)
    return product / product.max()


def _response(total: list[Spectra] | None, samples: int, plan: Segmentation) -> tuple[FrequencyResponse, FloatArray]:
    if total is None:
        nothing = np.full(plan.omega.size, np.nan)
        return FrequencyResponse(plan.omega, nothing + 0j, nothing), nothing
    value, coherence, weights = composite(total, [samples / count for count in plan.counts])
    return FrequencyResponse(plan.omega, value, coherence), independent_averages(weights, plan, samples)


def _sum(one: Spectra, other: Spectra) -> Spectra:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def _check_intervals(histories: Sequence[TimeHistory]) -> None:
    for k, history in enumerate(histories):
        if abs(history.dt / histories[0].dt - 1.0) > SAME_DT:
            raise InputError(
                f"histories[{k}].time",
                f"is sampled every {history.dt:.6g} s, the first record every {histories[0].dt:.6g} s: resample to one interval",
            )
