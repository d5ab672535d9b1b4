"""The uncertain inputs that the claims are about: names and ranges of Table 2 of the study, in the units of its Table 2."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

#: m/s: all claims are about flight at this speed
SPEED = 5.0
#: lowest and highest value of each input ("study", Table 2; uniform)
RANGES = {
    "M": (6.5, 7.5),
    "I_y": (0.65133, 0.79607),
    "K_T": (5.916e-8, 8.004e-8),
    "T_u": (0.95, 1.05),
    "tau_d": (0.0, 0.03),
    "C_L0": (0.6196, 0.9294),
    "C_D0": (0.01464, 0.02196),
    "C_m0": (-0.0288, -0.0192),
    "C_Lalpha": (4.1016, 6.1524),
    "C_Dalpha": (0.20464, 0.30696),
    "C_malpha": (-0.64824, -0.43216),
    "C_Lq": (6.09088, 9.13632),
    "C_Dq": (0.57432, 0.86148),
    "C_mq": (-19.4028, -12.9352),
}
AERODYNAMIC = tuple(name for name in RANGES if name.startswith("C_"))
#: part of a range by which its ends may differ from the table: rounding, not another range
ROUNDING = 0.02


def other_inputs(factors: Sequence[Mapping[str, Any]]) -> str:
    """In what the inputs of a study are not those of the claims; empty where they are."""
    given = {str(factor["name"]): factor for factor in factors}
    missing = [name for name in RANGES if name not in given]
    if missing:
        return f"the study does not vary {', '.join(missing)}"
    further = [name for name in given if name not in RANGES]
    if further:
        return f"the study also varies {', '.join(further)}"
    for name, factor in given.items():
        if factor["distribution"] != "uniform":
            return f"the study varies {name} by a {factor['distribution']} distribution, the claims by a uniform one"
        if not _same_range(factor, RANGES[name]):
            low, high = RANGES[name]
            return f"the study varies {name} from {factor['low']:g} to {factor['high']:g}, the claims from {low:g} to {high:g}"
    return ""


def _same_range(factor: Mapping[str, Any], ends: tuple[float, float]) -> bool:
    allowed = ROUNDING * (ends[1] - ends[0])
    return abs(factor["low"] - ends[0]) <= allowed and abs(factor["high"] - ends[1]) <= allowed
