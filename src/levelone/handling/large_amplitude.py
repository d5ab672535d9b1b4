"""Large-amplitude response (ADS-33E-PRF 3.3.4 pitch and roll, 3.3.8 yaw): the rate or attitude that full control achieves.

With a rate response type the largest rate counts, with an attitude response type the largest change of attitude; the
requirement asks for a minimum on either side of trim that grows with the agility of the tasks to be flown. A record shows
what its own input achieved on one side, so that the value is the achievable one only where the control went to its stop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from levelone.errors import InputError, unknown_name
from levelone.handling.axes import STEADY, RotationAxis, first_sample, rotation, run_failures
from levelone.handling.bandwidth import ResponseType
from levelone.handling.history import FloatArray, IntArray, TimeHistory
from levelone.handling.levels import Confidence, Level
from levelone.handling.peaks import extrema
from levelone.handling.toml_files import read_toml_file, subtable
from levelone.status import Status

Agility = Literal["limited", "moderate", "aggressive"]
DEFAULT = "ads33-large-amplitude"


@dataclass(frozen=True)
class AmplitudeLimits:
    """Minimum achievable rate (rad/s) or attitude change (rad), as ``(negative side, positive side)``, both positive.

    ``level_2_3`` is the one minimum that the requirement states for Levels 2 and 3; ``unit`` is that of both.
    """

    name: str
    level_1: tuple[float, float]
    level_2_3: tuple[float, float]
    unit: str
    confidence: Confidence
    source: str
    note: str = ""

    @property
    def verified(self) -> bool:
        """Whether the limits are confirmed."""
        return self.confidence == "high"


@dataclass(frozen=True, eq=False)
class LargeAmplitude:
    """What each run achieves.

    Parameters
    ----------
    peak
        ``[run]``, rad/s or rad, signed: change from trim where it is largest after the input.
    time
        ``[run]``, s: when.
    required
        ``[run]``, in the same unit, positive: what Level 1 asks for on the side of the peak.
    level
        ``[run]``, :class:`~levelone.handling.levels.Level` of this side; 2 where the one minimum of Levels 2 and 3 is met,
        3 where not even that is.
    status
        ``[run]``, of all.
    limits
        What was asked for.
    """

    peak: FloatArray
    time: FloatArray
    required: FloatArray
    level: IntArray
    status: IntArray
    limits: AmplitudeLimits


def large_amplitude(
    history: TimeHistory,
    axis: RotationAxis = "pitch",
    response_type: ResponseType = "rate_command",
    agility: Agility = "moderate",
    *,
    limits: AmplitudeLimits | None = None,
) -> LargeAmplitude:
    """Largest rate or attitude change of every run of a record against the minimum that is asked for.

    Parameters
    ----------
    history
        Response to a large input to one side, held until the response has been seen.
    axis
        ``"pitch"`` (q, theta), ``"roll"`` (p, phi) or ``"yaw"`` (r, psi; a heading may wrap).
    response_type
        ``"rate_command"``: the rate counts; ``"attitude_command"``: the attitude.
    agility
        Of the mission task elements: ``"limited"``, ``"moderate"``, ``"aggressive"``.
    limits
        Limits of the user; by default those that ship for axis, response type and agility.

    Raises
    ------
    InputError
        Unknown axis, response type or agility, a missing channel, or no requirement for yaw attitude.

    Notes
    -----
    The peak is refined between samples by a fit that averages noise a little; it is the highest instant, so that noise
    adds to it.
    """
    asked = limits or amplitude_limits(axis, response_type, agility)
    rate, attitude = rotation(history, axis)
    start = first_sample(history, np.full(history.n_runs, history.input_on))
    found = extrema(rate if response_type == "rate_command" else attitude, int(start[0]), start, 0.5, 1)
    peak = found.largest_value
    status = np.select(
        [run_failures(history) != Status.OK, found.count < 0, found.offset > STEADY * np.abs(peak), ~(np.abs(peak) > found.noise)],
        [run_failures(history), Status.RECORD_TOO_SHORT, Status.NOT_AT_TRIM, Status.NO_ATTITUDE_CHANGE],
        Status.OK,
    )
    peak = np.where(status == Status.OK, peak, np.nan)
    first, second = (np.where(peak < 0.0, *pair) for pair in (asked.level_1, asked.level_2_3))
    size = np.abs(peak)
    level = np.where(size >= first, Level.LEVEL_1, np.where(size >= second, Level.LEVEL_2, Level.LEVEL_3))
    return LargeAmplitude(
        peak=peak,
        time=np.where(status == Status.OK, history.time[0] + history.dt * found.largest_place, np.nan),
        required=np.where(status == Status.OK, first, np.nan),
        level=np.where(np.isnan(peak), Level.UNDEFINED, level),
        status=status,
        limits=asked,
    )


def amplitude_limits(axis: str, response_type: str, agility: str, path: str | PathLike[str] | None = None) -> AmplitudeLimits:
    """Limits for one axis, response type and agility; of the file that ships, or of the user's in the same form.

    Raises
    ------
    InputError
        The file cannot be read, has no such entry, or an entry that is not a positive angle for either side.
    """
    for field, value, allowed in (
        ("axis", axis, get_args(RotationAxis)),
        ("response_type", response_type, get_args(ResponseType)),
        ("agility", agility, get_args(Agility)),
    ):
        if value not in allowed:
            raise unknown_name(field, str(value), allowed)
    content = _content(None if path is None else str(path))
    where = f"{content.get('name', DEFAULT)}: {axis}.{response_type}"
    group = subtable(subtable(content.get(axis, {}), where).get(response_type, {}), where)
    if agility not in group:
        raise InputError(where, f"no requirement for {agility} agility is stated")
    entry = subtable(group[agility], f"{where}.{agility}")
    if entry.get("confidence") not in get_args(Confidence):
        raise unknown_name(f"{where}.{agility}.confidence", str(entry.get("confidence")), get_args(Confidence))
    return AmplitudeLimits(
        name=f"{axis}.{response_type}.{agility}",
        level_1=_sides(f"{where}.{agility}.level_1", entry.get("level_1")),
        level_2_3=_sides(f"{where}.{agility}.level_2_3", entry.get("level_2_3")),
        unit="rad/s" if response_type == "rate_command" else "rad",
        confidence=entry["confidence"],
        source=str(content.get("source", "")),
        note=str(entry.get("note", "")),
    )


@cache
def _content(path: str | None) -> dict[str, Any]:
    source = Path(path) if path is not None else resources.files("levelone.handling").joinpath(f"library/{DEFAULT}.toml")
    return read_toml_file(source, str(source))


def _sides(field: str, value: object) -> tuple[float, float]:
    """Angles in deg on both sides as positive numbers in rad."""
    pair = value if isinstance(value, list) else [value, value]
    numbers = [abs(float(x)) for x in pair if isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x)]
    if len(numbers) != 2 or min(numbers) <= 0.0:
        raise InputError(field, f"is {value!r}, must be an angle in deg, or two: [negative side, positive side]")
    return math.radians(numbers[0]), math.radians(numbers[1])
