"""How far a campaign is, in numbers and in words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from levelone.status import Status

#: a line has no room for what the words of a status advise
_SHORT = {
    Status.TIMED_OUT.text: "timed out",
    Status.CRASHED.text: "crashed",
    Status.MODEL_FAILED.text: "without a value",
    Status.OUTPUT_MISSING.text: "with an output missing",
    Status.OUTPUT_NOT_FINITE.text: "not finite",
}


@dataclass(frozen=True)
class Tally:
    """How far a campaign is; what is counted as done is in the store.

    Parameters
    ----------
    done, total
        Evaluations at different points.
    reused
        Of those done: found in the store.
    failed
        How many of those done have a failed response, by the words of the failure; an evaluation with several is counted once,
        with failures of the run before those of a measurement.
    rate
        1/s, evaluations since the start, those reused left out; NaN before the first.
    remaining
        s at that rate; NaN before the first.
    """

    done: int
    total: int
    reused: int = 0
    failed: Mapping[str, int] = field(default_factory=dict)
    rate: float = math.nan
    remaining: float = math.nan


def tally_text(tally: Tally) -> str:
    """A line for a progress display."""
    parts = [f"{tally.done}/{tally.total}"]
    if tally.reused:
        parts.append(f"{tally.reused} found in the store")
    if tally.rate > 0.0:
        per = f"{tally.rate:.3g}/s" if tally.rate >= 1.0 else f"{1.0 / tally.rate:.3g} s each"
        parts.append(per)
    if tally.done < tally.total and math.isfinite(tally.remaining):
        parts.append(f"{duration(tally.remaining)} left")
    if tally.failed:
        most_first = sorted(tally.failed.items(), key=lambda each: -each[1])
        counts = ", ".join(f"{count} {_SHORT.get(text, text.split(':')[0])}" for text, count in most_first)
        parts.append(f"{sum(tally.failed.values())} failed ({counts})")
    return "  ".join(parts)


def duration(seconds: float) -> str:
    """A time in words of two units at most: "45 s", "12 min 5 s", "3 h 20 min", "2 d 4 h"."""
    whole = round(seconds)
    for size, name, smaller, below in ((86400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if whole >= size:
            rest = whole % size // smaller
            return f"{whole // size} {name}" + (f" {rest} {below}" if rest else "")
    return f"{whole} s"
