"""What a test reads of one run: the criterion, its quantities with their statuses, and the Level where a boundary says one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from levelone.campaign.models.answers import axis_of_limits
from levelone.campaign.models.protocol import FloatArray, IntArray, LinearSource, ModelFailure
from levelone.config.model_table import quantities
from levelone.handling.axes import RATE_AND_ATTITUDE, RotationAxis
from levelone.handling.bandwidth import Bandwidth, bandwidth
from levelone.handling.damping import DynamicStability, dynamic_stability
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import TimeHistory
from levelone.handling.identification import identify
from levelone.handling.levels import Boundaries, Level
from levelone.handling.quickness import Quickness, attitude_quickness
from levelone.handling.translation import TranslationalRate, translational_rate
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import Test


@dataclass(frozen=True, eq=False)
class Spectral:
    """A frequency response and what was read on it, of one run."""

    response: FrequencyResponse
    reading: Bandwidth


#: a value and its status, of one run
Pair = tuple[FloatArray | float, IntArray | int]
Result = Quickness | DynamicStability | Spectral | TranslationalRate


def has_level(test: Test, boundaries: Boundaries) -> bool:
    """Whether the boundaries say a Level for a test: of its axis, and a bandwidth on attitude only."""
    if test.criterion == "attitude_quickness":
        return test.axis in boundaries.attitude_quickness
    if test.criterion == "translational_rate":
        return "translational_rate" in boundaries.limits
    if test.axis != axis_of_limits(boundaries):
        return False
    return test.criterion != "bandwidth" or test.output == RATE_AND_ATTITUDE[test.axis][0 if test.integrate else 1]


def channels_of(test: Test) -> tuple[str, ...]:
    """Channels that the criterion of a test needs."""
    if test.criterion == "bandwidth":
        return (str(test.output),)
    if test.criterion == "translational_rate":
        return (test.manoeuvre.axis,)
    return RATE_AND_ATTITUDE[str(test.axis)]


def read(test: Test, record: TimeHistory, boundaries: Boundaries) -> Result:
    """The criterion of a test on the record of one run.

    Raises
    ------
    ModelFailure
        The run failed, or its record lacks a channel.
    InputError
        What would fail on every record, such as a window longer than it.
    """
    status = Status(int(record.status[0]))
    if status.failed:
        raise ModelFailure(status, status.text)
    for name in channels_of(test):
        if name not in record.channels:
            raise ModelFailure(Status.OUTPUT_MISSING, f"the record has no channel {name}; it has {', '.join(record.channels)}")
    if test.delay:
        record = replace(record, delay=record.delay + test.delay)
    if test.criterion == "attitude_quickness":
        return attitude_quickness(record, _rotation(test), boundaries=_with_chart(boundaries, str(test.axis)))
    if test.criterion == "dynamic_stability":
        return dynamic_stability(record, _rotation(test), boundaries=boundaries)
    if test.criterion == "translational_rate":
        return translational_rate(record, test.manoeuvre.axis, boundaries=boundaries)
    response = identify(
        record,
        str(test.output),
        sign=test.sign,
        windows=test.windows or None,
        omega_min=test.manoeuvre.omega_min,
        omega_max=test.manoeuvre.omega_max,
    )
    return read_response(test, integrated(test, response), boundaries)


def read_linear(test: Test, source: LinearSource, point: FloatArray, boundaries: Boundaries) -> Spectral:
    """The bandwidth of a test on the exact frequency response of a source at a point; raises ModelFailure."""
    response = source.frequency_response(point, test.manoeuvre.axis, str(test.output), np.array(test.omega))
    return read_response(test, integrated(test, response.scaled(float(test.sign))), boundaries)


def integrated(test: Test, response: FrequencyResponse) -> FrequencyResponse:
    """The response of the attitude where the test integrates that of its rate: divided by j omega; any other as it is.

    The attitude itself does not return to trim after the sweep of a vehicle whose command is a rate, and its spectra would hold the
    step at the end of the record; its rate does.
    """
    if not test.integrate:
        return response
    return FrequencyResponse(response.omega, response.value / (1j * response.omega), response.coherence)


def read_response(test: Test, response: FrequencyResponse, boundaries: Boundaries) -> Spectral:
    """Bandwidth and phase delay on the response of one run, whose sign is already that of the command."""
    one = response if response.value.ndim == 1 else response.select(0)
    reading = bandwidth(
        one,
        test.response_type,  # type: ignore[arg-type]  # checked there
        phase_reference=test.phase_reference,
        coherence_min=test.coherence_min,
        task=test.task,
        boundaries=boundaries,
    )
    return Spectral(one, reading)


def numbers(test: Test, result: Result) -> tuple[FloatArray, IntArray, int]:
    """Values and statuses of the test's quantities, in their order, and the Level by the criterion's own rule."""
    pairs: list[Pair]
    if isinstance(result, Quickness):
        pairs = [
            (result.quickness, result.status),
            (result.delta_theta_min, result.status_min),
            (result.delta_theta_pk, result.status),
        ]
        level = result.level
    elif isinstance(result, DynamicStability):
        pairs = [(result.zeta, result.status), (result.omega_n, result.status_omega)]
        level = result.level
    elif isinstance(result, TranslationalRate):
        pairs = [(result.rise_time, result.status), (result.overshoot, result.status)]
        level = result.level
    else:
        pairs = _spectral_pairs(test, result)
        level = result.reading.level
    values = np.array([float(np.ravel(value)[0]) for value, _ in pairs])
    codes = np.array([int(np.ravel(code)[0]) for _, code in pairs], dtype=np.int64)
    return values, codes, int(np.ravel(level)[0])


def undefined(test: Test, status: Status) -> tuple[FloatArray, IntArray, int]:
    """As :func:`numbers`, of a run that came to nothing."""
    count = len(quantities(test))
    return np.full(count, np.nan), np.full(count, int(status), dtype=np.int64), int(Level.UNDEFINED)


def _spectral_pairs(test: Test, result: Spectral) -> list[Pair]:
    b = result.reading
    pairs: list[Pair] = [
        (b.omega_bw, b.status),
        (b.omega_bw_phase, b.status_phase),
        (b.omega_bw_gain, b.status_gain),
        (b.omega_180, b.status_180),
        (b.tau_p, b.status_tau_p),
    ]
    return [*pairs, least_coherence(result)] if test.method == "sweep" else pairs


def least_coherence(result: Spectral) -> tuple[float, int]:
    """Least coherence from the lowest frequency to 2 omega_180, the range that a phase delay is read in, and its status."""
    response, reading = result.response, result.reading
    omega_180 = float(reading.omega_180)
    if int(reading.status_180) != Status.OK or response.coherence is None:
        return np.nan, int(reading.status_180) or int(Status.MODEL_FAILED)
    if 2.0 * omega_180 > response.omega[-1]:
        return np.nan, int(Status.RANGE_TOO_SHORT)
    within = response.coherence[response.omega <= 2.0 * omega_180]
    least = float(within.min()) if np.isfinite(within).all() else np.nan
    return least, int(Status.OK if np.isfinite(least) else Status.LOW_COHERENCE)


def _rotation(test: Test) -> RotationAxis:
    return cast(RotationAxis, test.axis)  # checked by the criterion


def _with_chart(boundaries: Boundaries, axis: str) -> Boundaries:
    """Boundaries in which the axis has a chart: the criterion looks one up even where no Level is asked for."""
    charts = boundaries.attitude_quickness
    if axis in charts or not charts:
        return boundaries
    return replace(boundaries, attitude_quickness={**charts, axis: next(iter(charts.values()))})
