"""Recorded data of flight or simulation, read by every criterion that they allow."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.assessment_checks import checks_of
from levelone.campaign.assessment_input import (
    AxisName,
    Input,
    Kind,
    choose_axis,
    choose_input,
    excited_range,
    recognise,
    until_moved,
)
from levelone.campaign.assessment_sweep import Response, Sweeping, attitude_from_rate, bandwidth_reading, responses_of
from levelone.campaign.assessment_tests import (
    Reading,
    Unread,
    amplitude_reading,
    coupling_reading,
    height_reading,
    quickness_reading,
    stability_reading,
    translation_reading,
)
from levelone.errors import InputError
from levelone.handling.axes import RATE_AND_ATTITUDE, without_jumps
from levelone.handling.bandwidth import ResponseType
from levelone.handling.history import TimeHistory
from levelone.handling.identification import WINDOWS
from levelone.handling.large_amplitude import Agility
from levelone.handling.levels import Boundaries, load_boundaries
from levelone.handling.records import record

FloatArray = NDArray[np.float64]

SHIPPED = {"pitch": "ads33-levels", "roll": "ads33-roll", "yaw": "ads33-yaw", "heave": "ads33-levels"}
"""Boundaries that judge an axis by default."""
Reader = Callable[[TimeHistory, str, Boundaries], Reading]


@dataclass(frozen=True, eq=False)
class Recorded:
    """One run as it was read: name, uniform times (s) and channels ``[sample]`` in SI and rad; headings may wrap."""

    name: str
    time: FloatArray
    channels: Mapping[str, FloatArray]


@dataclass(frozen=True)
class Request:
    """What is wanted of the data; what is None is found out from them.

    Parameters
    ----------
    axis, kind, input_name
        Axis of the input, what it is, and its channel.
    input_on, input_off
        s: beginning and end of the input, where they are known better than the one record shows.
    delay
        s between command and response, after which a pulse's response counts as free; None: until the rate has moved
        (:func:`~levelone.campaign.assessment_input.until_moved`), an upper bound of it where the input is sharp.
    omega_min, omega_max
        rad/s: range of a sweep.
    windows
        s: window lengths of a sweep.
    response_type, phase_reference, task
        As for :func:`~levelone.handling.bandwidth.bandwidth`; ``"rate_command"`` counts the smaller bandwidth of both.
    agility
        Of the tasks that large amplitudes are judged for; no Level without.
    boundaries
        Name or path of a file of Level boundaries of this axis; those that ship for it by default.
    """

    axis: AxisName | None = None
    kind: Kind | None = None
    input_name: str | None = None
    input_on: float | None = None
    input_off: float | None = None
    delay: float | None = None
    omega_min: float | None = None
    omega_max: float | None = None
    windows: tuple[float, ...] | None = None
    response_type: ResponseType = "rate_command"
    phase_reference: float = 0.0
    task: str = "all_other"
    agility: Agility | None = None
    boundaries: str | None = None


@dataclass(frozen=True, eq=False)
class Assessment:
    """What the criteria make of the records.

    Parameters
    ----------
    kind, axis, input_name
        Of the input.
    histories, inputs
        The records, one run each, and their inputs as recognised.
    sweeping
        How sweeps were read; None for steps and pulses.
    responses
        Identified frequency responses by key.
    readings
        Everything that was read.
    unread
        Criteria that the data do not allow, with the reason.
    checks
        What looks wrong or should be known, in words.
    boundaries
        Level boundaries.
    """

    kind: Kind
    axis: AxisName
    input_name: str
    histories: tuple[TimeHistory, ...]
    inputs: tuple[Input, ...]
    sweeping: Sweeping | None
    responses: Mapping[str, Response]
    readings: tuple[Reading, ...]
    unread: tuple[Unread, ...]
    checks: tuple[str, ...]
    boundaries: Boundaries


def assess(records: Sequence[Recorded], request: Request = Request()) -> Assessment:
    """Read all criteria that records of one manoeuvre allow.

    Parameters
    ----------
    records
        Runs of one kind, each from trim. Sweeps are taken together, steps and pulses one by one.
    request
        What is known of them.

    Raises
    ------
    InputError
        No record, records of different kinds or channels, an input that cannot be recognised, or no channel to judge.
    """
    if not records:
        raise InputError("DATA", "no record given")
    records = [_without_jumps(each) for each in records]
    shared = [name for name in records[0].channels if all(name in each.channels for each in records)]
    input_name = choose_input(shared, request.input_name, request.axis)
    axis = choose_axis(input_name, request.axis)
    inputs = [
        recognise(each.time, each.channels[input_name], kind=request.kind, name=f"{each.name}: {input_name}") for each in records
    ]
    kinds = {each.kind for each in inputs}
    if len(kinds) > 1:
        listed = ", ".join(f"{each.name} {shape.kind}" for each, shape in zip(records, inputs, strict=True))
        raise InputError("DATA", f"records of one kind are assessed together, not {listed}; give --kind, or call once for each")
    kind = inputs[0].kind
    if kind != "sweep" and len(records) > 1 and not (request.input_on is None and request.input_off is None):
        raise InputError("--on" if request.input_on is not None else "--off", f"holds for one record, {len(records)} are given")
    histories = [_history(each, shape, shared, input_name, axis, request) for each, shape in zip(records, inputs, strict=True)]
    boundaries = load_boundaries(request.boundaries or SHIPPED[axis])
    sweeping = _sweeping(histories, request) if kind == "sweep" else None
    if sweeping is not None:
        responses, readings, unread = _swept(histories, axis, sweeping, boundaries)
    else:
        responses, (readings, unread) = {}, _stepped(histories, inputs, axis, request, boundaries)
    if not readings and not responses:
        raise InputError("DATA", f"nothing can be read: {'; '.join(f'{each.criterion}: {each.why}' for each in unread)}")
    checks = checks_of(histories, inputs, axis, responses)
    return Assessment(
        kind, axis, input_name, tuple(histories), tuple(inputs), sweeping, responses, tuple(readings), tuple(unread), tuple(checks),
        boundaries,
    )  # fmt: skip


def _without_jumps(each: Recorded) -> Recorded:
    return replace(each, channels={name: without_jumps(name, values) for name, values in each.channels.items()})


def _history(each: Recorded, shape: Input, shared: Sequence[str], input_name: str, axis: str, request: Request) -> TimeHistory:
    """One run; sweeps count from the mean before the input, or of all of the record where nothing came before it."""
    on = shape.on if request.input_on is None else request.input_on
    off = shape.off if request.input_off is None else request.input_off
    before = each.time < min(on, shape.moves) - 1e-9
    known = before if before.sum() >= 2 else np.ones(each.time.size, dtype=bool)
    if shape.kind != "sweep" and not before.any():
        raise InputError("--on", f"{each.name}: no sample before {min(on, shape.moves):g} s to take the trim from")
    trim = {name: float(each.channels[name][known].mean()) for name in shared}
    delay = request.delay
    if delay is None:
        rate = "" if axis == "heave" else RATE_AND_ATTITUDE[axis][0]
        moving = shape.kind == "pulse" and rate in shared
        delay = until_moved(each.time, each.channels[rate] - trim[rate], on) if moving else 0.0
    return record(
        each.time,
        {name: each.channels[name] for name in shared},
        input_name=input_name,
        input_on=on,
        input_off=math.nan if shape.kind == "step" else off,
        delay=delay,
        trim=trim,
        units={name: "1" for name in shared if name.startswith("delta_")},
        name=each.name,
    )


def _sweeping(histories: Sequence[TimeHistory], request: Request) -> Sweeping:
    low, high = request.omega_min, request.omega_max
    if low is None or high is None:
        found = excited_range(histories)
        low, high = found[0] if low is None else low, found[1] if high is None else high
    shortest = min(float(each.time[-1] - each.time[0]) for each in histories)
    windows = request.windows or tuple(part * shortest for part in WINDOWS)
    return Sweeping(low, high, windows, request.response_type, request.phase_reference, request.task)


def _swept(
    histories: Sequence[TimeHistory], axis: str, how: Sweeping, boundaries: Boundaries
) -> tuple[dict[str, Response], list[Reading], list[Unread]]:
    found = {each.key: each for each in responses_of(histories, axis, how)}
    unread = [Unread(name, "needs a step or a pulse, these are sweeps") for name in ("attitude_quickness", "dynamic_stability")]
    if axis == "heave":
        return found, [], [*unread, Unread("bandwidth", "is a criterion of attitude; heave is judged by a step")]
    rate, attitude = RATE_AND_ATTITUDE[axis]
    readings = []
    if attitude in found:
        readings.append(bandwidth_reading(found[attitude], axis, how, boundaries, judged=True))
    if rate in found:
        derived = attitude_from_rate(found[rate], histories[0].input_name, axis)
        found[derived.key] = derived
        readings.append(bandwidth_reading(derived, axis, how, boundaries, judged=True))
        readings.append(bandwidth_reading(found[rate], axis, how, boundaries, judged=False))
    if not readings:
        unread.append(Unread("bandwidth", f"needs {attitude} or {rate}: map one of them"))
    return found, readings, unread


def _stepped(
    histories: Sequence[TimeHistory], inputs: Sequence[Input], axis: str, request: Request, boundaries: Boundaries
) -> tuple[list[Reading], list[Unread]]:
    """Criteria on time histories, record by record, in the order of criteria."""
    channels, source, kind = histories[0].channels, histories[0].input_name, inputs[0].kind
    speed = source.removesuffix("_ref")

    def stability(history: TimeHistory, axis: str, boundaries: Boundaries) -> Reading:
        return stability_reading(history, axis, boundaries, inputs[list(histories).index(history)].returns_in)

    def amplitude(history: TimeHistory, axis: str, boundaries: Boundaries) -> Reading:
        return amplitude_reading(history, axis, request.response_type, request.agility)

    angular = () if axis == "heave" else RATE_AND_ATTITUDE[axis]
    asked: list[tuple[str, Reader, tuple[str, ...], tuple[str, ...]]] = []
    if angular:
        asked = [
            ("attitude_quickness", quickness_reading, ("step", "pulse"), angular),
            ("dynamic_stability", stability, ("pulse",), angular),
            ("large_amplitude", amplitude, ("step", "pulse"), angular),
        ]
    if axis in ("pitch", "roll"):
        asked.append(("pitch_roll_coupling", coupling_reading, ("step",), ("theta", "phi")))
    if source in ("V_lon_ref", "V_lat_ref"):
        asked.append(("translational_rate", translation_reading, ("step",), (speed,)))
    if axis == "heave":
        asked.append(("height_response", height_reading, ("step",), ("V_vert",)))
    readings: list[Reading] = []
    unread = [Unread("bandwidth", "needs a frequency sweep")] if angular else []
    for criterion, reader, kinds, needed in asked:
        missing = [name for name in needed if name not in channels]
        if kind not in kinds:
            why = "the response must become free" if kinds == ("pulse",) else "the input must stay"
            unread.append(Unread(criterion, f"needs a {' or a '.join(kinds)}: {why}"))
        elif missing:
            unread.append(Unread(criterion, f"needs {' and '.join(missing)}: map {'it' if len(missing) == 1 else 'them'}"))
        else:
            readings += [reader(history, axis, boundaries) for history in histories]
    return readings, unread
