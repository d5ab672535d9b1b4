"""Between a model's names, units and signs and those of levelone: commands on their way in, channels on their way out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from levelone.campaign.models.protocol import FloatArray, ModelFailure
from levelone.errors import InputError
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import Channel
    from levelone.handling.history import TimeHistory
    from levelone.handling.manoeuvres import Manoeuvre

#: samples by which a record may end before its manoeuvre does: sums of decimals, and a last step that is not recorded
SHORT = 1.5


def real_numbers(values: Any) -> FloatArray:
    """Numbers as a model answered them, of any shape; those that it masked are NaN.

    Raises
    ------
    TypeError, ValueError
        Something that is no real number: a complex number would lose its imaginary part, a truth value or a date become a number
        that nobody stated.
    """
    given = values if isinstance(values, np.ma.MaskedArray) else np.asarray(values)
    mixed = values if isinstance(values, list | tuple) else given.flat if given.dtype.kind == "O" else ()
    if given.dtype.kind in "cbmM" or any(isinstance(each, bool | np.bool_) for each in mixed):
        raise TypeError(f"truth values, complex numbers and times are no real numbers: {given.dtype}")
    try:
        numbers = given.astype(np.float64)
    except OverflowError as error:
        raise ValueError(str(error)) from None
    return np.asarray(numbers.filled(np.nan) if isinstance(numbers, np.ma.MaskedArray) else numbers)


def to_si(channel: Channel, values: ArrayLike) -> FloatArray:
    """Values of a channel in SI and rad, with levelone's sign, from those of the model; any shape.

    Raises
    ------
    TypeError, ValueError
        As of :func:`real_numbers`.
    """
    return channel.sign * channel.scale * real_numbers(values)


def ratio_of_units(unit: str, own: str) -> float | None:
    """How many units ``own`` one ``unit`` is; NaN where they measure different things, None where one is unknown here."""
    from levelone.config.units import to_si as in_unit

    if unit == own:
        return 1.0
    for each, expected in ((unit, "1"), (own, "1"), (unit, own)):
        try:
            ratio = float(in_unit(1.0, each, expected, "unit"))
        except InputError as error:
            if "does not fit" not in error.problem:
                return None
            ratio = math.nan
    return ratio


def change_of_input(channel: Channel, manoeuvre: Manoeuvre) -> Manoeuvre:
    """The same manoeuvre with its amplitude in the unit and sign of the model's input."""
    from dataclasses import replace

    return replace(manoeuvre, amplitude=manoeuvre.amplitude / (channel.sign * channel.scale))


def command_values(channel: Channel, manoeuvre: Manoeuvre, time: ArrayLike, held: float) -> FloatArray:
    """Values that the model's input takes under a manoeuvre.

    Parameters
    ----------
    channel
        The input; its ``trim`` is the value that the command is added to, where it states one.
    manoeuvre
        What is commanded, SI and rad.
    time
        s from the beginning of the record, any shape.
    held
        Value of the input, in the model's unit, when the record begins; it counts where the channel states no ``trim``.

    Returns
    -------
    array in the shape of ``time``, in the model's unit and sign.
    """
    base = held if channel.trim is None else channel.trim
    return base + manoeuvre.command(time) / (channel.sign * channel.scale)


def name_of_input(manoeuvre: Manoeuvre) -> str:
    """Channel of a record that holds the command: ``V_lon_ref``, and ``delta_lon`` as it is."""
    return manoeuvre.axis if manoeuvre.axis.startswith("delta_") else f"{manoeuvre.axis}_ref"


def sample_times(manoeuvre: Manoeuvre) -> FloatArray:
    """Times [sample] at which a record of a manoeuvre is sampled, s: multiples of its ``dt`` from 0 to its end."""
    from dataclasses import replace

    return replace(manoeuvre, controller_rate=1.0 / manoeuvre.dt).ticks()


def channel_history(
    time: ArrayLike,
    channels: Mapping[str, ArrayLike],
    manoeuvre: Manoeuvre,
    *,
    delay: float = 0.0,
    name: str = "",
) -> TimeHistory:
    """The record of one run of a model, as the criteria read it.

    Parameters
    ----------
    time
        [time] s, uniform, with t = 0 at the beginning of the manoeuvre's record; any interval.
    channels
        [time] of each channel by levelone's name, SI and rad, levelone's signs; the command is added here.
    manoeuvre
        What was commanded.
    delay
        s: delays between command and response, where the model states them; a free response begins that much later.
    name
        Of the record; that of the manoeuvre by default.

    Returns
    -------
    TimeHistory
        One run; trims are means before the input, and the command moves from the trim of its own channel where that is recorded.
        Roll and heading may be recorded within a turn; here they are without jumps.

    Raises
    ------
    ModelFailure
        OUTPUT_NOT_FINITE names the channel and the time; MODEL_FAILED: lengths that differ, times that are not uniform or do not
        begin before the input; RECORD_TOO_SHORT: the record ends before its manoeuvre.
    """
    from levelone.handling.records import record

    t = _checked_time(time, manoeuvre)
    series = {key: _checked_channel(key, values, t) for key, values in channels.items()}
    for angle in ("phi", "psi"):  # about north a heading jumps by a turn, and the mean of both sides is the way south
        if angle in series:
            series[angle] = np.unwrap(series[angle])
    before = t < manoeuvre.on - 1e-9
    moved = series.get(manoeuvre.axis)
    base = 0.0 if moved is None or name_of_input(manoeuvre) == manoeuvre.axis else float(moved[before].mean())
    series[name_of_input(manoeuvre)] = base + manoeuvre.command(t)
    try:
        return record(
            t,
            series,
            input_name=name_of_input(manoeuvre),
            input_on=manoeuvre.on,
            input_off=manoeuvre.off if math.isfinite(manoeuvre.off) else math.nan,
            delay=delay,
            wind=manoeuvre.wind,
            trim={name_of_input(manoeuvre): base},
            units={name_of_input(manoeuvre): manoeuvre.unit},
            name=name or manoeuvre.name,
        )
    except InputError as error:  # a record that no criterion can read is this run's failure
        raise ModelFailure(Status.MODEL_FAILED, str(error)) from None


def _checked_time(time: ArrayLike, manoeuvre: Manoeuvre) -> FloatArray:
    t = _numbers("time", time)
    if t.size < 2 or not np.isfinite(t).all():
        raise ModelFailure(Status.MODEL_FAILED, f"time holds {t.size} samples; two or more finite ones are needed")
    dt = (t[-1] - t[0]) / (t.size - 1)
    if not (dt > 0.0 and t[0] < manoeuvre.on - 1e-9):
        raise ModelFailure(
            Status.MODEL_FAILED,
            f"time runs from {t[0]:g} to {t[-1]:g} s; it must increase from before the input at {manoeuvre.on:g} s",
        )
    if t[-1] < manoeuvre.duration - SHORT * dt:
        raise ModelFailure(
            Status.RECORD_TOO_SHORT, f"the record ends at {t[-1]:g} s, and the manoeuvre lasts until {manoeuvre.duration:g} s"
        )
    return t


def _checked_channel(name: str, values: ArrayLike, time: FloatArray) -> FloatArray:
    series = _numbers(name, values)
    if series.shape != time.shape:
        raise ModelFailure(Status.MODEL_FAILED, f"channel {name} has {series.size} samples, time has {time.size}")
    bad = ~np.isfinite(series)
    if bad.any():
        first = int(np.argmax(bad))
        raise ModelFailure(Status.OUTPUT_NOT_FINITE, f"channel {name} is {series[first]} from t = {time[first]:g} s on")
    return series


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    try:
        series = real_numbers(values)
    except (TypeError, ValueError):
        raise ModelFailure(Status.MODEL_FAILED, f"channel {name} holds something that is no number") from None
    if series.ndim != 1:
        raise ModelFailure(Status.MODEL_FAILED, f"channel {name} has shape {series.shape}, and one dimension is needed")
    return series
