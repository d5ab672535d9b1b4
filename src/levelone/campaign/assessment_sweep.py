"""Bandwidth and phase delay of recorded sweeps, with the random error that noise leaves in them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.assessment_tests import NO_CHART, Reading, Value, no_level
from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.bandwidth import COHERENCE_MIN, Bandwidth, ResponseType, bandwidth
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import TimeHistory
from levelone.handling.joint_identification import Identified, identify_records
from levelone.handling.levels import Boundaries

FloatArray = NDArray[np.float64]

SLOPE_OVER = 0.15
"""Half-width, as a fraction of the frequency, over which the slope of phase and gain is read for the errors."""
AGAINST = "-"
"""Mark in the title of a response that is read with the other sign."""


@dataclass(frozen=True)
class Sweeping:
    """How sweeps are identified and read.

    Parameters
    ----------
    omega_min, omega_max
        rad/s.
    windows
        s: lengths of the windows.
    response_type, phase_reference, task
        As for :func:`~levelone.handling.bandwidth.bandwidth`.
    """

    omega_min: float
    omega_max: float
    windows: tuple[float, ...]
    response_type: ResponseType = "rate_command"
    phase_reference: float = 0.0
    task: str = "all_other"


@dataclass(frozen=True, eq=False)
class Response:
    """An identified frequency response: key (``"theta"``), title (``"theta / delta_lon"``), unit, and what was found."""

    key: str
    title: str
    unit: str
    identified: Identified

    @property
    def response(self) -> FrequencyResponse:
        """The response itself, with its coherence."""
        return self.identified.response


def responses_of(histories: Sequence[TimeHistory], axis: str, how: Sweeping) -> list[Response]:
    """Responses of attitude and rate that the records allow; that of the climb rate in heave.

    A forward speed command pitches the nose down: attitude is then read with the other sign, as ``-theta / V_lon_ref``.
    """
    channels = ("V_vert",) if axis == "heave" else RATE_AND_ATTITUDE[axis][::-1]
    known = [channel for channel in channels if all(channel in history.channels for history in histories)]
    with ThreadPoolExecutor() as pool:  # the transforms, nearly all of the time, run side by side
        return list(pool.map(partial(_identified, histories, how), known))


def _identified(histories: Sequence[TimeHistory], how: Sweeping, channel: str) -> Response:
    # of a speed command the rate is read as the reference study reads it, q / V_lon
    source = histories[0].input_name
    sign = -1 if source == "V_lon_ref" and channel == "theta" else 1
    found = identify_records(histories, channel, sign=sign, windows=how.windows, omega_min=how.omega_min, omega_max=how.omega_max)
    title = f"{AGAINST if sign < 0 else ''}{channel} / {source}"
    return Response(channel, title, f"{histories[0].units[channel]} / ({histories[0].units[source] or 'unit'})", found)


def attitude_from_rate(response: Response, source: str, axis: str) -> Response:
    """The response of attitude as that of the rate over i omega: where sensors measure rates better than angles."""
    rate, attitude = RATE_AND_ATTITUDE[axis]
    inner = response.response
    sign = -1.0 if source == "V_lon_ref" else 1.0
    value = sign * inner.value / (1j * inner.omega)
    title = f"{AGAINST if sign < 0 else ''}{rate} / (s {source})"
    found = replace(response.identified, response=replace(inner, value=value))
    return Response(f"{attitude}_from_{rate}", title, response.unit, found)


def bandwidth_reading(response: Response, axis: str, how: Sweeping, boundaries: Boundaries, *, judged: bool) -> Reading:
    """Bandwidth and phase delay of one response; ``judged`` where it is one of attitude, which the standard reads."""
    found = bandwidth(response.response, how.response_type, phase_reference=how.phase_reference)
    errors = bandwidth_errors(response.identified, found, how.phase_reference)
    averages = _averages(response.identified, found)
    names = (
        ("omega_bw", "rad/s", "status"),
        ("tau_p", "s", "status_tau_p"),
        ("omega_bw_phase", "rad/s", "status_phase"),
        ("omega_bw_gain", "rad/s", "status_gain"),
        ("omega_180", "rad/s", "status_180"),
    )
    values = tuple(
        Value(name, float(getattr(found, name)), unit, int(getattr(found, status)), errors[name], averages[name])
        for name, unit, status in names
    )
    chart = boundaries.bandwidth.get(how.task) if judged else None
    if chart is None:
        level = beyond = no_level(values[0].value)
    else:
        level, beyond = (int(each) for each in chart.levels(values[1].value, values[0].value))
    remarks = () if judged else ("a response of rate: its bandwidth is not the standard's, and the two must never be compared",)
    return Reading(
        "bandwidth", response.title, axis, "all records", values, level, beyond,
        NO_CHART if chart is None else chart.name, chart is None or chart.verified, {}, remarks,
    )  # fmt: skip


def _averages(identified: Identified, found: Bandwidth) -> dict[str, float]:
    """Independent averages that each value's error rests on: the fewest of the frequencies that it is read at."""
    turn, fall = float(found.omega_180), float(found.omega_bw_gain)
    read = {
        "omega_bw": (float(found.omega_bw),), "tau_p": (turn, 2.0 * turn), "omega_bw_phase": (float(found.omega_bw_phase),),
        "omega_bw_gain": (fall, turn), "omega_180": (turn,),
    }  # fmt: skip
    return {name: float(np.interp(at, identified.response.omega, identified.averages).min()) for name, at in read.items()}


def bandwidth_errors(identified: Identified, found: Bandwidth, phase_reference: float = 0.0) -> dict[str, float]:
    """Standard deviation of each value from the random error of gain and phase, to first order; NaN where it is not known.

    A crossing moves by the error of what crosses over its slope there. Phase delay is that of phase at 2 omega_180 and of
    omega_180 itself; the gain's line lies 6 dB above the gain at omega_180, whose error counts as well. Errors at frequencies
    further apart than a window resolves are independent of each other.
    """
    response = identified.response
    good = np.isfinite(response.value) & (np.nan_to_num(response.coherence) >= COHERENCE_MIN)
    if good.sum() < 3:
        return dict.fromkeys(("omega_bw", "tau_p", "omega_bw_phase", "omega_bw_gain", "omega_180"), math.nan)
    omega, error = response.omega[good], identified.error[good]
    phase, gain = response.unwrapped_phase(phase_reference)[good], response.gain_db[good]
    decibels = 20.0 / math.log(10.0) * error

    def at(x: float, values: FloatArray) -> float:
        return float(np.interp(x, omega, values, math.nan, math.nan)) if math.isfinite(x) else math.nan

    def slope(x: float, values: FloatArray) -> float:
        near = np.abs(omega - x) <= SLOPE_OVER * x if math.isfinite(x) else np.zeros(omega.size, dtype=bool)
        return float(np.polyfit(omega[near] - x, values[near], 1)[0]) if near.sum() >= 3 else math.nan

    bw, turn, fall = float(found.omega_bw_phase), float(found.omega_180), float(found.omega_bw_gain)
    sigma_phase = _ratio(at(bw, error), slope(bw, phase))
    sigma_180 = _ratio(at(turn, error), slope(turn, phase))
    line = math.hypot(at(turn, decibels), slope(turn, gain) * sigma_180)
    sigma_gain = _ratio(math.hypot(line, at(fall, decibels)), slope(fall, gain))
    steep = (-slope(2.0 * turn, phase) - float(found.tau_p)) / turn
    sigma_tau = math.hypot(at(2.0 * turn, error) / (2.0 * turn), steep * sigma_180)
    counted = float(found.omega_bw)
    return {
        "omega_bw": math.nan if math.isnan(counted) else sigma_phase if counted == bw else sigma_gain,
        "tau_p": sigma_tau,
        "omega_bw_phase": sigma_phase,
        "omega_bw_gain": sigma_gain,
        "omega_180": sigma_180,
    }


def _ratio(error: float, slope: float) -> float:
    return abs(error / slope) if slope else math.nan
