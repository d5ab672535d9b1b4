"""Outcomes of an aerodynamic computation or of a measurement on its loads, as codes that a batch can carry and words to act on.

A value whose outcome is not ``OK`` is NaN, except for the codes of :data:`CAUTIONS`: there the value stands, and the words qualify
it. Nothing is ever replaced by zero or left out.
"""

from __future__ import annotations

from enum import IntEnum


class Outcome(IntEnum):
    """Outcome of one computation or one measured value; ``text`` says what happened and what to change."""

    OK = 0
    # the computation
    WAKE_FULL = 1
    STEP_TOO_LONG = 2
    NOT_CONVERGED = 3
    DIVERGED = 4
    # the measurement on a history of loads
    NOT_PERIODIC = 20
    RECORD_TOO_SHORT = 21
    TOO_FEW_SAMPLES = 22
    NO_FREQUENCY = 23
    NO_AMPLITUDE = 24
    NOT_FINITE = 25
    TIME_NOT_INCREASING = 26
    NO_CROSSING = 27
    NOT_SINUSOIDAL = 28
    # cautions: the value stands
    UNCHECKED = 60

    @property
    def text(self) -> str:
        """The outcome in words."""
        return _TEXT[self]

    @property
    def failed(self) -> bool:
        """Whether a value with this outcome is undefined (NaN)."""
        return self is not Outcome.OK and self not in CAUTIONS


CAUTIONS = frozenset(outcome for outcome in Outcome if outcome >= Outcome.UNCHECKED)

_TEXT = {
    Outcome.OK: "ok",
    Outcome.WAKE_FULL: "wake capacity exceeded: raise the capacity, shorten the record or cut the wake earlier",
    Outcome.STEP_TOO_LONG: "the time step is longer than a chord allows: shorten the step",
    Outcome.NOT_CONVERGED: "the values on successive grids do not settle: refine the grid, the time step or the wake",
    Outcome.DIVERGED: "the computation diverged: loads or wake are not finite",
    Outcome.NOT_PERIODIC: "the last two periods differ: the start has not died out; lengthen the record",
    Outcome.RECORD_TOO_SHORT: "the record holds fewer whole periods than are needed: lengthen it",
    Outcome.TOO_FEW_SAMPLES: "too few samples in a period to separate its harmonics: shorten the time step",
    Outcome.NO_FREQUENCY: "the frequency of the oscillation is not a positive number: it defines no period",
    Outcome.NO_AMPLITUDE: "amplitude of the motion or reduced frequency is not a positive number: it defines no derivative",
    Outcome.NOT_FINITE: "the record holds values that are not finite",
    Outcome.TIME_NOT_INCREASING: "the times of the record do not increase",
    Outcome.NO_CROSSING: "the motion does not pass its mean upwards and downwards inside the last period",
    Outcome.NOT_SINUSOIDAL: "the motion is not one sine wave of the given frequency: check frequency and record",
    Outcome.UNCHECKED: "the record is shorter than two evaluated stretches: that the start has died out is not checked",
}
