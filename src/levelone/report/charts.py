"""The boundaries that a study was judged by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from levelone.handling.levels import DEFAULT, Chart, DampingLimits, load_boundaries

_BODY_AXIS = {"V_lon": "pitch", "V_lat": "roll", "yaw_rate": "yaw", "theta": "pitch", "phi": "roll", "q": "pitch", "p": "roll"}


@dataclass(frozen=True)
class Charts:
    """One chart for each criterion, and what the file of boundaries says of itself."""

    attitude_quickness: Chart
    dynamic_stability: DampingLimits
    bandwidth: Chart
    name: str
    source: str


def charts_of(study: Mapping[str, Any]) -> Charts:
    """Charts of a study's axis and task; those that ship where it names no file of boundaries.

    Raises
    ------
    InputError
        The file cannot be read, or has no chart for the axis or task.
    """
    boundaries = load_boundaries(study.get("boundaries", DEFAULT))
    axis = _BODY_AXIS.get(study["manoeuvres"]["attitude_quickness"]["axis"], "pitch")
    return Charts(
        attitude_quickness=boundaries.chart("attitude_quickness", axis),
        dynamic_stability=boundaries.dynamic_stability,
        bandwidth=boundaries.chart("bandwidth", study.get("task", "all_other")),
        name=boundaries.name,
        source=boundaries.source,
    )
