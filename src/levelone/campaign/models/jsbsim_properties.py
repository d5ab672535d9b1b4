"""Properties of an aircraft of JSBSim against what the study says of them: names, what may be done to them, and units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from levelone.campaign.models.mapping import ratio_of_units
from levelone.errors import InputError, closest, unknown_name

if TYPE_CHECKING:
    from levelone.config.model_table import JsbsimTable

#: what the end of a property's name says of its unit, by JSBSim's own convention; its pounds are of weight or of mass
SUFFIXES: dict[str, tuple[str, ...]] = {
    "rad": ("rad",),
    "deg": ("deg",),
    "rad_sec": ("rad/s",),
    "deg_sec": ("deg/s",),
    "ft": ("ft",),
    "inches": ("inch",),
    "fps": ("ft/s",),
    "kts": ("kt",),
    "lbs": ("lbf", "lb"),
    "slugs_ft2": ("slug ft^2",),
    "norm": ("1",),
}
Listing = Mapping[str, str]


def _plain_name(name: str) -> str:
    """A property's name without the index 0, which may be written or left out at every level."""
    return name.replace("[0]", "")


def listing(aircraft: Any) -> Listing:
    """Properties of an aircraft, each with what may be done to it: R, W or RW."""
    lines = aircraft.query_property_catalog("").splitlines()
    pairs = (line.strip().rpartition(" ") for line in lines if line.strip().endswith(")"))
    return {_plain_name(name): access.strip("()") for name, _, access in pairs}


def check_properties(table: JsbsimTable, targets: Sequence[str], known: Listing) -> None:
    """Everything that can be known to be wrong without a run.

    Raises
    ------
    InputError
        A property that the aircraft does not have, that cannot be set or read, that is set twice, or whose name says another unit.
    """
    for where, names in (("initial", table.initial), ("set", table.set), ("fixed", table.fixed)):
        for name, _ in names:
            _check_property(f"model.{where}", name, "W", known)
    for target in targets:
        _check_property("factor.target", target, "W", known)
    for group, channels, access in (("inputs", table.inputs, "W"), ("outputs", table.outputs, "R")):
        for channel in channels:
            field = f"model.{group}.{channel.levelone}"
            _check_property(f"{field}.name", channel.name, access, known)
            _check_unit(f"{field}.unit", channel.name, channel.unit)
    seen: set[str] = set()
    for name in (*(name for part in (table.initial, table.set, table.fixed) for name, _ in part), *targets):
        if _plain_name(name) in seen:
            raise InputError("model.set", f"property {name!r} is set twice: which value holds would be hidden in the order")
        seen.add(_plain_name(name))


def _check_property(field: str, name: str, access: str, known: Listing) -> None:
    allowed = known.get(_plain_name(name))
    if allowed is None:
        raise unknown_name(field, name, known)
    if access not in allowed:
        able = [each for each, how in known.items() if access in how]
        verb = "set: JSBSim computes it" if access == "W" else "read: JSBSim takes it as an order only"
        raise InputError(field, f"property {name!r} cannot be {verb}; {closest(name, able)}")


def check_factor_units(targets: Sequence[str], units: Sequence[str]) -> None:
    """InputError where the name of a property says another unit than that of the factor which sets it."""
    for target, unit in zip(targets, units, strict=True):
        _check_unit("factor.unit", target, unit)


def _check_unit(field: str, name: str, unit: str) -> None:
    suffix = re.sub(r"\[\d+\]$", "", name).rpartition("-")[2]
    own = SUFFIXES.get(suffix, ())
    ratios = [ratio_of_units(unit, each) for each in own]
    if ratios and not any(ratio is None or math.isclose(ratio, 1.0, rel_tol=1e-6) for ratio in ratios):
        raise InputError(field, f"is {unit!r}, but the name of property {name!r} says {' or '.join(map(repr, own))}")
