"""Froude scaling: boundaries of a full-size aircraft carried over to one of another length.

Two aircraft are dynamically alike under gravity when V^2 / (g L) is the same for both. With N the reference length over
the length, speeds and times then go with N^(-1/2), frequencies and rates with N^(1/2), while angles, damping ratios and
accelerations stay (Wolowicz, Bowman and Gilbert, Similitude Requirements and Scaling Relationships as Applied to Model
Testing, NASA TP-1435, 1979). Requirements of MIL-DTL-32742, which supersedes ADS-33E-PRF, have been carried over to small
unmanned aircraft in this way (Ivler and Geyer, Outer Loop Requirements for Vertical Lift Unmanned Aerial System Automated
Flying Qualities, Vertical Flight Society, 2024).

What scaling cannot give: a remote or automatic pilot, and tasks of another kind, may need other limits than the scaled
ones. A scaled boundary is therefore never more than "medium" in confidence.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from levelone.errors import InputError, unknown_name
from levelone.handling.levels import Boundaries, Chart, Confidence, DampingLimits
from levelone.handling.limits import single_limits

_TIME, _NONE = -1, 0
_LIMITS: dict[str, dict[str, int]] = {
    "pitch_roll_coupling": {"level_1": _NONE, "level_2": _NONE},
    "height_response": {"level_1_T": _TIME, "level_1_tau": _TIME, "level_2_tau": _TIME},
    "translational_rate": {"rise_time_level_1": _TIME},
}
"""Power of N^(1/2) that multiplies each single limit."""

_TEXTS = ("confidence", "source", "note")


def rate_scale(length: float, reference_length: float) -> float:
    """Factor of frequencies and rates, sqrt(reference_length / length); times are divided by it.

    Parameters
    ----------
    length, reference_length
        m: characteristic length of the aircraft, and of the one that the boundaries are for; the same kind of length.

    Raises
    ------
    InputError
        A length that is not finite and positive.

    Examples
    --------
    >>> rate_scale(4.0, 16.0)
    2.0
    """
    for name, value in (("length", length), ("reference_length", reference_length)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"froude.{name}", f"is {value} m, must be finite and positive")
    return math.sqrt(reference_length / length)


def froude_scaled(boundaries: Boundaries, length: float, reference_length: float) -> Boundaries:
    """Boundaries for an aircraft of another length, by Froude scaling.

    Parameters
    ----------
    boundaries
        Boundaries for aircraft of ``reference_length``.
    length, reference_length
        m: the same kind of length on both aircraft (rotor diameter, or largest distance between hubs).

    Returns
    -------
    Boundaries
        Rates (quickness, bandwidth, corner, growth) times sqrt(N), times (phase delay, rise times, T, tau) divided by it,
        N = ``reference_length / length``; angles, damping ratios and coupling ratios as they are. Names, sources and
        notes say so, and no confidence is above "medium". Equal lengths give the boundaries themselves.

    Raises
    ------
    InputError
        A length that is not finite and positive; a single limit whose dimension is not known here.

    Notes
    -----
    The times within which a criterion looks at a record (4 s of coupling, 5 s of climb) stay those of the criterion.
    """
    rate = rate_scale(length, reference_length)
    if length == reference_length:
        return boundaries
    lengths = f"Froude-scaled from {reference_length:g} m to {length:g} m"
    words = (lengths, f"{lengths}: rates times {rate:.4g}, times divided by it; confidence of the scaling itself: medium at most")
    quickness = {key: _chart(chart, 1.0, rate, words) for key, chart in boundaries.attitude_quickness.items()}
    bandwidth = {key: _chart(chart, 1.0 / rate, rate, words) for key, chart in boundaries.bandwidth.items()}
    return Boundaries(
        name=f"{boundaries.name}, {lengths}",
        source=_joined(boundaries.source, lengths),
        attitude_quickness=quickness,
        bandwidth=bandwidth,
        dynamic_stability=_damping(boundaries.dynamic_stability, rate, words),
        limits={name: _limits(boundaries, name, rate, words) for name in boundaries.limits},
    )


def _chart(chart: Chart, across: float, up: float, words: tuple[str, str]) -> Chart:
    factors = np.array([across, up])
    return replace(
        chart,
        level_1_2=chart.level_1_2 * factors,
        level_2_3=chart.level_2_3 * factors,
        low=chart.low * across,
        high=chart.high * across,
        confidence=_at_most_medium(chart.confidence),
        source=_joined(chart.source, words[0]),
        note=_joined(chart.note, words[1]),
    )


def _damping(limits: DampingLimits, rate: float, words: tuple[str, str]) -> DampingLimits:
    return replace(
        limits,
        corner=limits.corner * rate,
        growth=limits.growth * rate,
        confidence=_at_most_medium(limits.confidence),
        confidence_zeta_1=_at_most_medium(limits.confidence_zeta_1),
        source=_joined(limits.source, words[0]),
        note=_joined(limits.note, words[1]),
    )


def _limits(boundaries: Boundaries, name: str, rate: float, words: tuple[str, str]) -> Mapping[str, Any]:
    where = f"{boundaries.name}: limits"
    if name not in _LIMITS:
        raise unknown_name(where, name, _LIMITS)
    powers, table = _LIMITS[name], dict(boundaries.limits[name])
    for key in table:
        if key not in powers and key not in _TEXTS:
            raise unknown_name(f"{where}.{name}", key, powers)
    keys = [key for key in powers if key in table]
    for key, value in zip(keys, single_limits(boundaries, name, *keys), strict=True):
        table[key] = (value * rate ** powers[key]).tolist()
    if "confidence" in table:
        table["confidence"] = _at_most_medium(table["confidence"])
    kept = "" if any(powers[key] for key in keys) else "; a ratio, which scaling does not change"
    table["source"] = _joined(str(table.get("source", "")), words[0] + kept)
    table["note"] = _joined(str(table.get("note", "")), words[1] + kept)
    return table


def _at_most_medium(confidence: Confidence) -> Confidence:
    return "medium" if confidence == "high" else confidence


def _joined(text: str, words: str) -> str:
    return f"{text}; {words}" if text else words
