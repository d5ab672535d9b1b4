"""What a rule comes to: conditions with the distance by which they are missed, and the verdict that they make together."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from levelone.campaign.claims.evidence import Evidence

Outcome = Literal["agrees", "differs", "undecidable"]
OUTCOMES: tuple[Outcome, ...] = ("agrees", "differs", "undecidable")
NO_NUMBERS = "no numbers"


class Undecided(Exception):
    """A rule cannot be applied; ``reason`` says why. Raised by what reads the results, never past the decision."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(frozen=True)
class Condition:
    """One part of a rule: whether it holds, and by how much of its limit it is missed (0 where it holds)."""

    holds: bool
    gap: float = 0.0


@dataclass(frozen=True)
class Decision:
    """Outcome of one rule.

    Parameters
    ----------
    verdict
        "agrees", "differs" or "undecidable".
    here
        The numbers in words.
    numbers
        The same as numbers, SI and radians unless a name ends in ``_deg``.
    reason
        Why a rule is undecidable; empty otherwise.
    gap
        Sum of what the conditions miss, relative to their limits: 0 for "agrees", NaN for "undecidable". Orders
        outcomes of one rule by how near they are to agreeing; says nothing across rules.
    """

    verdict: Outcome
    here: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    reason: str = ""
    gap: float = math.nan


@dataclass(frozen=True)
class Claim:
    """A rule as programmed.

    Parameters
    ----------
    id, rule
        Name and text; a file of findings that words the rule otherwise is not decided by it.
    decide
        The rule on the evidence of a study; may raise :class:`Undecided`.
    uses
        Monte Carlo responses that the rule reads, itself or by Sobol indices: their undefined runs can change the outcome.
    calibrated
        Whether a calibration may aim at it, so that it does not count.
    """

    id: str
    rule: str
    decide: Callable[[Evidence], Decision]
    uses: tuple[str, ...]
    calibrated: bool


def claim(name: str, rule: str, *uses: str, calibrated: bool = False) -> Callable[[Callable[[Evidence], Decision]], Claim]:
    """Make a function the :class:`Claim` of this name and rule."""

    def made(decide: Callable[[Evidence], Decision]) -> Claim:
        return Claim(name, rule, decide, uses, calibrated)

    return made


def decided(here: str, numbers: Mapping[str, float], *conditions: Condition) -> Decision:
    """Agrees where all conditions hold, differs otherwise."""
    if all(each.holds for each in conditions):
        return Decision("agrees", here, numbers, gap=0.0)
    return Decision("differs", here, numbers, gap=sum(each.gap for each in conditions if not each.holds))


def undecided(reason: str, here: str = NO_NUMBERS, numbers: Mapping[str, float] | None = None) -> Decision:
    """A rule that cannot be applied, and why."""
    return Decision("undecidable", here, numbers or {}, reason)


def within(value: float, low: float, high: float) -> Condition:
    """low <= value <= high."""
    scale = max(abs(low), abs(high))
    return Condition(low <= value <= high, max(low - value, value - high, 0.0) / scale)


def at_most(value: float, limit: float) -> Condition:
    """value <= limit."""
    return Condition(value <= limit, _missed(value - limit, limit))


def at_least(value: float, limit: float) -> Condition:
    """value >= limit."""
    return Condition(value >= limit, _missed(limit - value, limit))


def below(value: float, limit: float) -> Condition:
    """value < limit."""
    return Condition(value < limit, _missed(value - limit, limit))


def above(value: float, limit: float) -> Condition:
    """value > limit."""
    return Condition(value > limit, _missed(limit - value, limit))


def _missed(by: float, limit: float) -> float:
    return max(by, 0.0) / (abs(limit) or 1.0)
