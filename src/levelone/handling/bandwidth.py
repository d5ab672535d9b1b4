"""Bandwidth and phase delay (ADS-33E-PRF 3.3.2.1) from a frequency response.

With omega_180 where the phase first falls through -180 deg:

- phase bandwidth: where the phase first falls through -135 deg (45 deg of margin);
- gain bandwidth: where the gain first falls through 6 dB above its value at omega_180;
- phase delay: (|phase at 2 omega_180| - 180 deg) / (57.3 * 2 omega_180), or the slope of a line fitted to the phase
  from omega_180 to 2 omega_180 over 2 * 57.3.

"First" is in increasing frequency; a gain that is still rising at the low end is passed until it falls.

Two readings of one aircraft. The standard reads the response of ATTITUDE. The reference study reads that of the RATE to
the speed command, q / V_lon. For a speed loop around an attitude loop G, -theta / V_lon behaves as s G / (s +
...): its phase begins near +90 deg. q / V_lon is -s times that, begins near 0 deg and ends 90 deg below: the same
lines are crossed at lower frequencies, and the two numbers must never be compared. The sign of the response and
the branch of its phase are the caller's to declare: nothing in the data tells -180 from +180 deg.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from levelone.compiled import kernel
from levelone.errors import InputError, unknown_name
from levelone.handling.crossings import BoolArray, any_between, bracket, crossing, cubic
from levelone.handling.frequency import FrequencyResponse, unwrap_rows
from levelone.handling.history import FloatArray, IntArray
from levelone.handling.levels import Boundaries, load_boundaries
from levelone.status import Status

ResponseType = Literal["attitude_command", "rate_command"]
PhaseDelay = Literal["two_point", "least_squares"]

DEGREES = 57.3
"""deg in a radian as the standard rounds it: tau_p is defined with this number."""
COHERENCE_MIN = 0.6
"""Least coherence at which the reference study and the standard's test guide read a swept response."""
MARGIN_DB = 6.0

_OK = int(Status.OK)
_NO_PHASE = int(Status.NO_PHASE_CROSSING)
_NO_180 = int(Status.NO_OMEGA_180)
_NO_GAIN = int(Status.NO_GAIN_CROSSING)
_SHORT = int(Status.RANGE_TOO_SHORT)
_INCOHERENT = int(Status.LOW_COHERENCE)
_PIO = int(Status.PIO_CAUTION)
_FIT_CELLS = 50


@dataclass(frozen=True, eq=False)
class Bandwidth:
    """Bandwidth and phase delay: numbers for a single response, arrays ``[run]`` for a batch.

    Parameters
    ----------
    omega_bw
        rad/s: the phase bandwidth for attitude command, the smaller of both for rate command.
    omega_bw_phase, omega_bw_gain, omega_180
        rad/s.
    tau_p
        s, positive for a lag.
    level, level_extrapolated
        :class:`~levelone.handling.levels.Level` in the plane of ``omega_bw`` and ``tau_p``, and by the lines extended
        beyond the known chart. It means what it says on attitude only.
    status
        Of ``omega_bw``. ``PIO_CAUTION``: the value stands, but under attitude command the gain bandwidth is smaller or
        undefined.
    status_phase, status_gain, status_180, status_tau_p
        Of the others.
    """

    omega_bw: FloatArray
    omega_bw_phase: FloatArray
    omega_bw_gain: FloatArray
    omega_180: FloatArray
    tau_p: FloatArray
    level: IntArray
    level_extrapolated: IntArray
    status: IntArray
    status_phase: IntArray
    status_gain: IntArray
    status_180: IntArray
    status_tau_p: IntArray


def bandwidth(
    response: FrequencyResponse,
    response_type: ResponseType = "attitude_command",
    *,
    phase_reference: float = 0.0,
    phase_delay: PhaseDelay = "two_point",
    coherence_min: float = COHERENCE_MIN,
    task: str = "all_other",
    boundaries: Boundaries | None = None,
) -> Bandwidth:
    """Bandwidth and phase delay of one response or of a batch.

    Parameters
    ----------
    response
        Output over command, with its sign: a positive command must give a positive output. Multiplying by a
        positive constant changes nothing.
    response_type
        ``"attitude_command"``: the phase bandwidth counts. ``"rate_command"``: the smaller of phase and gain bandwidth.
    phase_reference
        rad: the phase at the lowest frequency that can be read lies in ``(phase_reference - pi, phase_reference +
        pi]``, and -135 and -180 deg are counted on this branch. The default suits a response that begins anywhere
        between -180 and 180 deg, such as -theta / V_lon (near +90), an integrator (-90) or q / V_lon (near 0); use
        ``-pi`` for one that begins near -180 deg.
    phase_delay
        ``"two_point"`` or ``"least_squares"`` (a line through the phase over frequency, each frequency of the
        range alike).
    coherence_min
        Where the response has a coherence, frequencies below this are not read; what lies there gets ``LOW_COHERENCE``.
    task
        Chart of the Level: ``"all_other"``, ``"target_acquisition"``, ``"divided_attention"``.
    boundaries
        Level boundaries; those that ship by default.

    Raises
    ------
    InputError
        Unknown option, or a minimum coherence outside 0 to 1.

    Examples
    --------
    >>> import numpy as np
    >>> omega = np.geomspace(0.1, 100.0, 300)
    >>> result = bandwidth(FrequencyResponse(omega, np.exp(-0.1j * omega) / (1j * omega)))
    >>> print(f"{result.omega_bw:.4f} {result.omega_180:.4f} {result.tau_p:.6f}")
    7.8540 15.7080 0.049996

    Notes
    -----
    Phase and gain are interpolated between frequencies by cubics in the logarithm of frequency. A response without any
    value has the status ``MODEL_FAILED``.
    """
    _check(response_type, phase_delay, coherence_min, phase_reference)
    value = np.where(np.abs(response.value) > 0.0, response.value, np.nan)
    distrusted = np.zeros(value.shape, dtype=np.bool_)
    if response.coherence is not None:
        distrusted = ~(np.broadcast_to(response.coherence, value.shape) >= coherence_min) & ~np.isnan(value)
    value = np.atleast_2d(np.where(distrusted, np.nan, value))
    metrics, codes = np.full((len(value), 4), np.nan), np.zeros((len(value), 4), dtype=np.int64)
    _kernel(
        response.omega,
        unwrap_rows(value, phase_reference),
        20.0 * np.log10(np.abs(value)),
        np.atleast_2d(distrusted),
        phase_delay == "least_squares",
        np.empty((4, response.omega.size)),
        metrics,
        codes,
    )
    codes[np.isnan(value).all(axis=1) & ~distrusted.any(axis=-1)] = Status.MODEL_FAILED
    phase, gain, omega_180, tau_p = metrics.T
    status_phase, status_gain, status_180, status_tau_p = codes.T
    if response_type == "attitude_command":
        omega_bw = phase
        caution = ~(gain >= phase) & (status_phase == _OK)
        status = np.where(caution, _PIO, status_phase)
    else:
        omega_bw = np.minimum(phase, gain)  # NaN where either is
        status = np.where(status_phase != _OK, status_phase, status_gain)
    level, extrapolated = (boundaries or load_boundaries()).chart("bandwidth", task).levels(tau_p, omega_bw)
    values = (omega_bw, phase, gain, omega_180, tau_p, level, extrapolated)
    statuses = (status, status_phase, status_gain, status_180, status_tau_p)
    single = response.value.ndim == 1
    return Bandwidth(*(field[0] if single else np.ascontiguousarray(field) for field in values + statuses))


def _check(response_type: str, phase_delay: str, coherence_min: float, phase_reference: float) -> None:
    for field, value, allowed in (
        ("response_type", response_type, get_args(ResponseType)),
        ("phase_delay", phase_delay, get_args(PhaseDelay)),
    ):
        if value not in allowed:
            raise unknown_name(field, str(value), allowed)
    if not 0.0 <= coherence_min <= 1.0:
        raise InputError("coherence_min", f"is {coherence_min}, must lie between 0 and 1")
    if not math.isfinite(phase_reference):
        raise InputError("phase_reference", f"is {phase_reference}, must be a finite angle in rad")


@kernel
def _kernel(
    omega: FloatArray,
    phase: FloatArray,
    gain: FloatArray,
    distrusted: BoolArray,
    least_squares: bool,
    buffer: FloatArray,
    metrics: FloatArray,
    codes: IntArray,
) -> None:
    """Fill metrics ``[run, 4]``: phase bandwidth, gain bandwidth, omega_180, tau_p; and their codes ``[run, 4]``.

    Phase (rad, unwrapped) and gain (dB) are NaN where they cannot be read; ``distrusted`` says where coherence is why.
    """
    w, x, y, z = buffer[0], buffer[1], buffer[2], buffer[3]
    for i in range(phase.shape[0]):
        n = 0
        for k in range(omega.size):
            if not math.isnan(phase[i, k]):
                w[n], x[n], y[n], z[n] = omega[k], math.log(omega[k]), phase[i, k], gain[i, k]
                n += 1
        _measure(x[:n], y[:n], z[:n], w, omega, distrusted[i], least_squares, metrics[i], codes[i])


@kernel
def _measure(
    x: FloatArray,
    phase: FloatArray,
    gain: FloatArray,
    w: FloatArray,
    omega: FloatArray,
    distrusted: BoolArray,
    least_squares: bool,
    metrics: FloatArray,
    codes: IntArray,
) -> None:
    """One response: x, w, phase, gain over the frequencies that can be read; omega, distrusted over all."""
    # one call in a loop, not three: each would be compiled in line
    y, level, end, absent = phase, -0.75 * math.pi, math.inf, _NO_PHASE
    for j in (0, 2, 1):
        metrics[j], codes[j] = crossing(x, y, level, w, omega, distrusted, end, absent)
        level, absent = -math.pi, _NO_180
        if j == 2:
            if codes[2] != _OK:
                codes[1] = codes[3] = codes[2]
                return
            y, end, absent = gain, metrics[2], _NO_GAIN
            level = cubic(x, gain, math.log(metrics[2])) + MARGIN_DB
    omega_180 = metrics[2]
    last = w[x.size - 1]
    if 2.0 * omega_180 > last:
        codes[3] = _INCOHERENT if any_between(omega, distrusted, last, math.inf) else _SHORT
        return
    k = bracket(x, math.log(2.0 * omega_180))
    if any_between(omega, distrusted, w[k], w[k + 1]):
        codes[3] = _INCOHERENT
        return
    metrics[3] = _phase_delay(x, phase, omega_180, least_squares)


@kernel
def _phase_delay(x: FloatArray, phase: FloatArray, omega_180: float, least_squares: bool) -> float:
    """Phase delay, s.

    The fitted line is that of the continuous phase, every frequency alike, its integrals by Simpson's rule: the
    response's own grid has no weight in it, and no point jumps in or out as omega_180 moves.
    """
    if not least_squares:
        degrees = -math.degrees(cubic(x, phase, math.log(2.0 * omega_180)))
        return (degrees - 180.0) / (DEGREES * 2.0 * omega_180)
    moment = 0.0
    for j in range(2 * _FIT_CELLS + 1):
        weight = 1.0 if j in (0, 2 * _FIT_CELLS) else 2.0 + 2.0 * (j % 2)
        offset = 0.5 * j / _FIT_CELLS - 0.5  # in parts of omega_180 from the middle of the range
        degrees = math.degrees(cubic(x, phase, math.log((1.5 + offset) * omega_180)))
        moment += weight * offset * degrees / (6.0 * _FIT_CELLS)
    slope = 12.0 * moment / omega_180
    return -slope / (2.0 * DEGREES)
