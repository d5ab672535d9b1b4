"""Frequency responses: complex values over angular frequency, with a phase whose branch is declared."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from levelone.compiled import kernel
from levelone.errors import InputError
from levelone.handling.history import FloatArray

ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Ratio of an output's to an input's complex amplitude.

    Parameters
    ----------
    omega
        ``[frequency]``, rad/s, positive and strictly increasing.
    value
        ``[frequency]`` or ``[run, frequency]``, complex, output unit over input unit. NaN marks an undefined value.
    coherence
        gamma squared in 0 to 1 in the shape of ``value`` or ``[frequency]``; ``None`` where the response is exact.

    Raises
    ------
    InputError
        Frequencies that are not positive and increasing, wrong shapes, infinite values.

    Notes
    -----
    The sign is part of the data: a forward speed command pitches the nose down, so the response of attitude that goes
    with the command is ``-theta / V_lon``; write ``-response`` to get it from ``theta / V_lon``.
    """

    omega: FloatArray
    value: ComplexArray
    coherence: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "omega", np.ascontiguousarray(self.omega, dtype=np.float64))
        object.__setattr__(self, "value", np.ascontiguousarray(self.value, dtype=np.complex128))
        _check_omega(self.omega)
        if self.value.ndim not in (1, 2) or self.value.shape[-1] != self.omega.size:
            raise InputError(
                "value",
                f"has shape {self.value.shape}, must be [frequency] or [run, frequency], {self.omega.size} frequencies",
            )
        if np.isinf(self.value).any():
            raise InputError("value", "is infinite at some frequency: leave out the pole on the imaginary axis, or write NaN")
        if self.coherence is not None:
            object.__setattr__(self, "coherence", _checked_coherence(self.coherence, self.value.shape))

    @property
    def n_runs(self) -> int:
        """Number of runs; 1 for a single response."""
        return 1 if self.value.ndim == 1 else int(self.value.shape[0])

    @property
    def gain_db(self) -> FloatArray:
        """20 log10 of the magnitude, in the shape of ``value``; -inf where the value is zero."""
        with np.errstate(divide="ignore"):
            return 20.0 * np.log10(np.abs(self.value))

    @property
    def phase(self) -> FloatArray:
        """Phase unwrapped along frequency, rad; at the lowest frequency with a value it lies in (-pi, pi]."""
        return self.unwrapped_phase()

    def unwrapped_phase(self, reference: float = 0.0) -> FloatArray:
        """Phase unwrapped along frequency, rad, in the shape of ``value``.

        Parameters
        ----------
        reference
            rad: at the lowest frequency with a value the phase lies in ``(reference - pi, reference + pi]``.
            Nothing in the data tells this branch: a response that begins near +-180 deg needs it declared.

        Notes
        -----
        Between neighbours the phase is taken to change by less than half a turn; a coarser grid cannot be unwrapped.
        NaN stays NaN and is passed over.
        """
        if not math.isfinite(reference):
            raise InputError("reference", f"is {reference}, must be a finite angle in rad")
        rows = np.atleast_2d(self.value)
        return unwrap_rows(rows, float(reference)).reshape(self.value.shape)

    def select(self, run: int) -> FrequencyResponse:
        """The response of one run, ``value`` then of shape ``[frequency]``."""
        if not 0 <= run < self.n_runs:
            raise InputError("run", f"{run} is not among the {self.n_runs} runs")
        coherence = self.coherence
        if coherence is not None and coherence.ndim == 2:
            coherence = coherence[run]
        return replace(self, value=np.atleast_2d(self.value)[run], coherence=coherence)

    def scaled(self, factor: float) -> FrequencyResponse:
        """The response times a real number other than zero."""
        if not math.isfinite(factor) or factor == 0.0:
            raise InputError("factor", f"is {factor}, must be finite and not zero")
        return replace(self, value=factor * self.value)

    def __neg__(self) -> FrequencyResponse:
        return self.scaled(-1.0)


def _check_omega(omega: FloatArray) -> None:
    if omega.ndim != 1 or omega.size < 1:
        raise InputError("omega", f"has shape {omega.shape}, must be a vector")
    if not (np.isfinite(omega).all() and omega[0] > 0.0):
        raise InputError("omega", f"begins at {omega[0]} rad/s: frequencies must be finite and positive")
    if not (np.diff(omega) > 0.0).all():
        raise InputError("omega", "must increase from each frequency to the next")


def _checked_coherence(coherence: npt.ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    checked = np.ascontiguousarray(coherence, dtype=np.float64)
    if checked.shape not in (shape, shape[-1:]):
        raise InputError("coherence", f"has shape {checked.shape}, must be {shape} or {shape[-1:]}")
    known = checked[~np.isnan(checked)]
    if known.size and (known.min() < 0.0 or known.max() > 1.0 + 1e-9):
        raise InputError("coherence", "must lie between 0 and 1")
    return checked


@kernel
def unwrap_rows(value: ComplexArray, reference: float) -> FloatArray:
    """Unwrapped phase of each row, rad; NaN is passed over (compiled)."""
    runs, count = value.shape
    phase = np.empty((runs, count))
    turn = 2.0 * math.pi
    for run in range(runs):
        last = reference
        for k in range(count):
            v = value[run, k]
            if math.isnan(v.real) or math.isnan(v.imag):
                phase[run, k] = math.nan
                continue
            angle = math.atan2(v.imag, v.real)
            # into (last - pi, last + pi]: the nearest branch, and at the first value the declared one; rounding must not
            # send a phase at the very edge to the other side
            angle -= turn * math.ceil((angle - last - math.pi) / turn - 1e-12)
            phase[run, k] = angle
            last = angle
    return phase
