"""The criteria that recorded data allow, each as one reading with its values, Level and reasons."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.bandwidth import ResponseType
from levelone.handling.coupling import coupling
from levelone.handling.damping import dynamic_stability
from levelone.handling.height_response import height_response
from levelone.handling.history import TimeHistory
from levelone.handling.joint_identification import student_factor
from levelone.handling.large_amplitude import Agility, large_amplitude
from levelone.handling.levels import Boundaries, Level, load_boundaries
from levelone.handling.picks import Picks
from levelone.handling.quickness import attitude_quickness
from levelone.handling.translation import translational_rate
from levelone.status import Status

FloatArray = NDArray[np.float64]
NO_CHART = "no chart"
SHARP = 0.25
"""Part of the damped period within which a pulse's control must come back, for what follows to be a free response. Assumed: no
source states it; what a control that decays leaves behind is then lost in the response."""


@dataclass(frozen=True)
class Value:
    """One number of a criterion: SI and rad, its status, and its standard deviation from noise with the number of independent
    averages that this rests on (NaN where not known). ``words`` say more than the status alone."""

    name: str
    value: float
    unit: str
    status: int
    error: float = math.nan
    averages: float = math.nan
    words: str = ""

    @property
    def text(self) -> str:
        """The status in words."""
        return self.words or Status(self.status).text

    @property
    def half_width(self) -> float:
        """Half of the interval that holds the value with 95 %, by Student's t; NaN where it is not known."""
        return float(self.error * student_factor(self.averages))


@dataclass(frozen=True)
class Reading:
    """One criterion, read once.

    Parameters
    ----------
    criterion, title, axis
        Key, what was read (``"theta / delta_lon"``), and the axis.
    record
        Name of the record, or of all of them together.
    values
        What it gives; the first two are those that the Level is read from.
    level, level_extrapolated
        :class:`~levelone.handling.levels.Level`, and by the lines extended beyond the chart.
    chart
        The boundary that judged, or :data:`NO_CHART`; ``verified`` says whether it is confirmed.
    times
        ``[pick]``, s: what was picked on the record, for the eye.
    remarks
        What to know beside the statuses.
    """

    criterion: str
    title: str
    axis: str
    record: str
    values: tuple[Value, ...]
    level: int
    level_extrapolated: int
    chart: str
    verified: bool = True
    times: Mapping[str, float] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def value(self, name: str) -> Value:
        """A value by its name."""
        return next(each for each in self.values if each.name == name)


@dataclass(frozen=True)
class Unread:
    """A criterion that the data do not allow, and why."""

    criterion: str
    why: str


def no_level(value: float) -> int:
    """What stands for the Level where no chart judges: undefined without a value, otherwise outside of all requirements."""
    return int(Level.UNDEFINED if math.isnan(value) else Level.OUTSIDE)


def quickness_reading(history: TimeHistory, axis: str, boundaries: Boundaries) -> Reading:
    """Attitude quickness of one record (its first run)."""
    chart = boundaries.attitude_quickness.get(axis)
    judge = boundaries if chart is not None else load_boundaries()
    found = attitude_quickness(history, axis, boundaries=judge)  # type: ignore[arg-type]  # pitch, roll or yaw
    rate, attitude = RATE_AND_ATTITUDE[axis]
    low, status = (int(found.status_min[0]), int(found.status[0]))
    none = no_level(float(found.quickness[0]))
    return Reading(
        "attitude_quickness", f"{rate} and {attitude}", axis, history.name,
        (
            Value("quickness", float(found.quickness[0]), "1/s", status),
            Value(f"delta_{attitude}_min", float(found.delta_theta_min[0]), "rad", low),
            Value(f"{rate}_pk", float(found.q_pk[0]), "rad/s", status),
            Value(f"delta_{attitude}_pk", float(found.delta_theta_pk[0]), "rad", status),
        ),
        none if chart is None else int(found.level[0]), none if chart is None else int(found.level_extrapolated[0]),
        NO_CHART if chart is None else chart.name, chart is None or chart.verified,
        _times(found.picks, ("rate_peak", "attitude_peak", "second_point")),
        ("the smallest attitude change is read at the second stationary point of the rate",),
    )  # fmt: skip


def stability_reading(history: TimeHistory, axis: str, boundaries: Boundaries, returns_in: float) -> Reading:
    """Damping ratio and natural frequency of one pulse; undefined where its control came back (s) too slowly."""
    found = dynamic_stability(history, axis, boundaries=boundaries)  # type: ignore[arg-type]
    limits = boundaries.dynamic_stability
    level, delay = int(found.level[0]), float(history.delay[0])
    values = [
        Value("zeta", float(found.zeta[0]), "1", int(found.status[0])),
        Value("omega_n", float(found.omega_n[0]), "rad/s", int(found.status_omega[0])),
        Value("damped_period", float(found.damped_period[0]), "s", int(found.status_omega[0])),
        Value("peak_ratio", float(found.peak_ratio[0]), "1", int(found.status[0])),
    ]
    period = 2.0 * float(found.times[0, 1] - found.times[0, 0])
    if returns_in > SHARP * period:
        words = f"the control comes back over {returns_in:.3g} s, more than a quarter of the period ({period:.3g} s): it drives on"
        values = [replace(each, value=math.nan, status=int(Status.STILL_DRIVEN), words=words) for each in values]
        level = int(Level.UNDEFINED)
    return Reading(
        "dynamic_stability", RATE_AND_ATTITUDE[axis][0], axis, history.name,
        tuple(values),
        level, level, limits.name, limits.verified,
        _times(found.picks, ("first_peak", "first_valley", "second_peak")) | {"free": history.input_off + delay},
        (f"taken as free from {history.input_off + delay:.3f} s on, {delay:.3g} s after the end of the input",),
    )  # fmt: skip


def coupling_reading(history: TimeHistory, axis: str, boundaries: Boundaries) -> Reading:
    """Pitch-roll coupling of one step."""
    judge, table = _limits(boundaries, "pitch_roll_coupling")
    found = coupling(history, axis, boundaries=judge)
    status, literal = int(found.status[0]), int(found.status_literal[0])
    level = int(found.level[0]) if table else no_level(float(found.ratio[0]))
    return Reading(
        "pitch_roll_coupling", "roll for pitch" if axis == "pitch" else "pitch for roll", axis, history.name,
        (
            Value("ratio", float(found.ratio[0]), "1", status),
            Value("ratio_literal", float(found.ratio_literal[0]), "1", literal),
            Value("off_axis_peak", float(found.off_axis_peak[0]), "rad", status),
            Value("on_axis_peak", float(found.on_axis_peak[0]), "rad", status),
        ),
        level, level, "pitch_roll_coupling" if table else NO_CHART, table.get("confidence") == "high" or not table,
        {}, ("the Level is that of the ratio to the on-axis peak, never the harsher one",),
    )  # fmt: skip


def translation_reading(history: TimeHistory, axis: str, boundaries: Boundaries) -> Reading:
    """Equivalent rise time of one step of commanded speed."""
    channel = history.input_name.removesuffix("_ref")
    judge, table = _limits(boundaries, "translational_rate")
    found = translational_rate(history, channel, boundaries=judge)
    status = int(found.status[0])
    level = int(found.level[0]) if table else no_level(float(found.rise_time[0]))
    return Reading(
        "translational_rate", f"{channel} to {history.input_name}", axis, history.name,
        (
            Value("rise_time", float(found.rise_time[0]), "s", int(found.status_level[0])),
            Value("overshoot", float(found.overshoot[0]), "1", status),
            Value("settling_time", float(found.settling_time[0]), "s", status),
        ),
        level, level, "translational_rate" if table else NO_CHART, table.get("confidence") == "high" or not table,
        {"rise": history.input_on + float(found.rise_time[0])},
    )  # fmt: skip


def height_reading(history: TimeHistory, axis: str, boundaries: Boundaries) -> Reading:
    """First-order fit of the climb rate after one step of collective or of commanded climb."""
    judge, table = _limits(boundaries, "height_response")
    found = height_response(history, boundaries=judge)
    status, slow = int(found.status[0]), int(found.status_time_constant[0])
    level = int(found.level[0]) if table else no_level(float(found.delay[0]))
    return Reading(
        "height_response", f"V_vert to {history.input_name}", axis, history.name,
        (
            Value("T_hdot", float(found.time_constant[0]), "s", slow),
            Value("tau_hdot", float(found.delay[0]), "s", status),
            Value("K_hdot", float(found.gain[0]), "m/s", slow),
            Value("r2", float(found.determination[0]), "1", status),
        ),
        level, level, "height_response" if table else NO_CHART, table.get("confidence") == "high" or not table,
    )  # fmt: skip


def amplitude_reading(history: TimeHistory, axis: str, response_type: ResponseType, agility: Agility | None) -> Reading:
    """Largest rate or attitude change of one step or pulse; a Level only where the agility of the tasks is stated."""
    found = large_amplitude(history, axis, response_type, agility or "moderate")  # type: ignore[arg-type]  # pitch, roll or yaw
    rate, attitude = RATE_AND_ATTITUDE[axis]
    channel, status = rate if response_type == "rate_command" else attitude, int(found.status[0])
    peak = float(found.peak[0])
    values = [Value(f"{channel}_largest", peak, found.limits.unit, status)]
    if agility is not None:
        values.append(Value(f"{channel}_required", float(found.required[0]), found.limits.unit, status))
    level = int(found.level[0]) if agility is not None else no_level(peak)
    remarks = ("what this input achieved: the achievable value only where the control went to its stop",)
    if agility is None:
        remarks = (*remarks, "no Level: --agility states the tasks that ask for a minimum")
    return Reading(
        "large_amplitude", channel, axis, history.name, tuple(values), level, level,
        NO_CHART if agility is None else f"large_amplitude.{found.limits.name}", agility is None or found.limits.verified,
        {"largest": float(found.time[0])}, remarks,
    )  # fmt: skip


def _limits(boundaries: Boundaries, criterion: str) -> tuple[Boundaries, Mapping[str, Any]]:
    """Boundaries that hold single limits of a criterion, and the limits; where there are none, those that ship, and nothing."""
    if criterion in boundaries.limits:
        return boundaries, boundaries.limits[criterion]
    return load_boundaries(), {}


def _times(picks: Picks, names: Sequence[str]) -> dict[str, float]:
    return {name: float(time) for name, time in zip(names, picks.time[0], strict=True)}
