"""The position-capture pilot inside the loop: one call is one control period."""

from __future__ import annotations

import math
from typing import NamedTuple

from levelone.compiled import inlined
from levelone.errors import InputError
from levelone.handling.manoeuvres import Manoeuvre
from levelone.handling.pilot import Pilot


class Hand(NamedTuple):
    """A :class:`levelone.handling.pilot.Pilot` as a kernel sees it: ``delay`` and ``on`` in control periods."""

    gain: float = 0.0
    lead: float = 0.0
    delay: int = 0
    deceleration: float = 0.0
    reverse: float = 0.0
    distance: float = 0.0
    on: int = 0


def pilot_numbers(pilot: Pilot | None, manoeuvre: Manoeuvre, period: float) -> Hand:
    """The pilot in control periods; all zero where there is none.

    Raises
    ------
    InputError
        The manoeuvre commands something itself, or is not flown in velocity mode.
    """
    if pilot is None:
        return Hand()
    if manoeuvre.shape != "none":
        raise InputError("manoeuvre.shape", f"is {manoeuvre.shape!r}; with a pilot it must be 'none': only one may command")
    if manoeuvre.flight_mode != "velocity":
        raise InputError("manoeuvre.flight_mode", f"is {manoeuvre.flight_mode!r}; the pilot commands ground speed: 'velocity'")
    delay, on = round(pilot.delay / period), round(manoeuvre.on / period)
    return Hand(pilot.gain, pilot.lead, delay, pilot.deceleration, pilot.reverse, pilot.distance, on)


@inlined
def pilot_speed(pilot, sight, k, north, speed, trim_speed):
    """Commanded forward ground speed at tick ``k``; ``sight`` [delay + 1, 2] keeps what has been seen (position, speed).

    Before the first delay is over nothing has been seen: the trim is held.
    """
    depth = sight.shape[0]
    slot = k % depth
    sight[slot, 0], sight[slot, 1] = north, speed
    if k < max(pilot.delay, pilot.on):
        return trim_speed
    then = (k - pilot.delay) % depth
    judged = pilot.distance - sight[then, 0] - pilot.lead * sight[then, 1]
    near = pilot.deceleration / (pilot.gain * pilot.gain)
    wanted = pilot.gain * judged if judged < near else math.sqrt(2.0 * pilot.deceleration * (judged - 0.5 * near))
    return min(max(wanted, -pilot.reverse), trim_speed)
