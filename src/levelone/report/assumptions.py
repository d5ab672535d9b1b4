"""Assumptions of the vehicle's file and of the study, ranked by what they can move."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

SECTIONS = {"aerodynamics": ("C_*",), "rotors.table": ("K_T", "T_u")}
"""Targets of factors that act on a section of the vehicle's file which is assumed as a whole; ``*`` ends a prefix."""
ASSUMED = "assumed: "
"""How a factor's source begins where its range is assumed."""


@dataclass(frozen=True)
class Assumption:
    """One assumed number, section or range.

    Parameters
    ----------
    field, why
        Where it stands, and the reason given there.
    factor
        The uncertain input that acts on it, of several the most influential; empty where the study varies none.
    several
        How many uncertain inputs act on it.
    influence
        Largest total index ST of these over the responses; NaN where no response has one.
    response
        The response with that index.
    """

    field: str
    why: str
    factor: str = ""
    several: int = 0
    influence: float = math.nan
    response: str = ""


def ranked(summary: Mapping[str, Any]) -> tuple[list[Assumption], list[Assumption]]:
    """Assumptions that the study varies, the most influential first; and those that it does not, in the file's order."""
    factors = summary["study"]["factors"]
    entries = [(entry["field"], entry["why"]) for entry in summary["assumed"]]
    entries += [
        (f"range of {factor['name']}", factor["source"].removeprefix(ASSUMED))
        for factor in factors
        if factor["source"].startswith(ASSUMED)
    ]
    varied, fixed = [], []
    for field, why in entries:
        acting = _acting(field.removeprefix("range of "), factors)
        if acting:
            factor, response, influence = _largest(acting, summary["responses"])
            varied.append(Assumption(field, why, factor, len(acting), influence, response))
        else:
            fixed.append(Assumption(field, why))
    varied.sort(key=lambda item: -math.inf if math.isnan(item.influence) else item.influence, reverse=True)
    return varied, fixed


def _acting(field: str, factors: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of the factors that vary a field: the same name or target, the same last part of the path, or its section."""
    for match in (field, field.rpartition(".")[2]):
        for factor in factors:
            target = str(factor["target"])
            if match in (factor["name"], target, target.rpartition(".")[2]):
                return [str(factor["name"])]
    patterns = SECTIONS.get(field, ())
    prefixes = tuple(pattern[:-1] for pattern in patterns if pattern.endswith("*"))
    last = {str(factor["name"]): str(factor["target"]).rpartition(".")[2] for factor in factors}
    return [name for name, target in last.items() if target in patterns or (prefixes and target.startswith(prefixes))]


def _largest(acting: Sequence[str], responses: Mapping[str, Any]) -> tuple[str, str, float]:
    """Factor and response with the largest ST, and that index."""
    best = (acting[0], "", math.nan)
    for name, entry in responses.items():
        for factor in acting:
            total = entry["sobol"].get(factor, {}).get("ST", math.nan)
            if not math.isnan(total) and not total <= best[2]:
                best = (factor, name, total)
    return best
