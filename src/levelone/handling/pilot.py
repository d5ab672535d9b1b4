"""A pilot who captures a position: what is seen, how late, and what is asked of the inceptor.

The crossover model's gain, lead and effective delay (McRuer and Krendel, Mathematical Models of Human Pilot Behavior, AGARDograph
188, 1974, ch. II), closed on the distance to go of an aircraft whose inceptor commands ground speed. Far out the pilot keeps to a
constant deceleration, the case tau-dot = 1/2 of Padfield, Lee and Bradley, How Do Helicopter Pilots Know When to Stop, Turn or Pull
Up?, Journal of the American Helicopter Society 48 (2), 2003.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from levelone.errors import InputError


@dataclass(frozen=True)
class Pilot:
    """Deceleration to a point ahead.

    With e the distance to go seen ``delay`` seconds ago and s = e + lead * de/dt, the commanded forward ground speed is gain * s
    near the point, and sqrt(2 a (s - a / (2 gain^2))) beyond s = a / gain^2, where both and their slopes agree; a is
    ``deceleration``. It is kept between ``-reverse`` and the trim speed.

    Parameters
    ----------
    gain
        1/s.
    lead
        s: how far ahead the distance is judged by its rate.
    delay
        s: effective delay of eye, mind and hand; rounded to whole control periods.
    deceleration
        m/s^2: what the pilot plans for.
    reverse
        m/s: largest rearward speed that is commanded.
    distance
        m: hover point ahead of the start of the record.

    Raises
    ------
    InputError
        A number is not finite, negative, or zero where it must not be.
    """

    gain: float
    lead: float
    delay: float
    deceleration: float
    reverse: float
    distance: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value) or value < 0.0:
                raise InputError(f"pilot.{field.name}", f"is {value:g}, must be finite and not negative")
        for name in ("gain", "deceleration", "distance"):
            if getattr(self, name) == 0.0:
                raise InputError(f"pilot.{name}", "is 0, must be positive")
