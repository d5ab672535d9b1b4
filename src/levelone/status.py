"""Outcomes of a run or of a measurement, as codes that a batch can carry and words that a reader can act on.

A value whose status is not ``OK`` is NaN, except for the codes of :data:`CAUTIONS`: there the value stands, and the words qualify
it.
"""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """Outcome of one run or one measured value; ``text`` says what happened and what to change."""

    OK = 0
    # the run
    TRIM_FAILED = 1
    DIVERGED = 2
    TABLE_EXCEEDED = 3
    LINEARISATION_FAILED = 4
    MODEL_FAILED = 5
    TIMED_OUT = 6
    CRASHED = 7
    OUTPUT_MISSING = 8
    OUTPUT_NOT_FINITE = 9
    # the measurement on a time history
    NO_FIRST_PEAK = 20
    NO_SECOND_STATIONARY_POINT = 21
    NO_VALLEY = 22
    NO_SECOND_PEAK = 23
    RECORD_TOO_SHORT = 24
    NO_ATTITUDE_CHANGE = 25
    NOT_AT_TRIM = 26
    NOT_CAPTURED = 27
    NO_DECELERATION = 28
    ON_AXIS_RETURNED = 30
    NOT_SETTLED = 31
    OTHER_FINAL_SPEED = 32
    NO_STEADY_COMMAND = 33
    STILL_DRIVEN = 34
    # the measurement on a frequency response
    NO_PHASE_CROSSING = 40
    NO_OMEGA_180 = 41
    RANGE_TOO_SHORT = 42
    LOW_COHERENCE = 43
    NO_GAIN_CROSSING = 44
    # cautions: the value stands
    PEAK_CHOICE_CHANGED = 60
    PIO_CAUTION = 61
    OUTSIDE_REQUIREMENT = 62
    NEGATIVE_DRAG = 63
    INCIDENCE_OUTSIDE = 64
    LEVEL_2_AT_BEST = 65

    @property
    def text(self) -> str:
        """The outcome in words."""
        return _TEXT[self]

    @property
    def failed(self) -> bool:
        """Whether a value with this status is undefined (NaN)."""
        return self is not Status.OK and self not in CAUTIONS


CAUTIONS = frozenset(status for status in Status if status >= Status.PEAK_CHOICE_CHANGED)

_TEXT = {
    Status.OK: "ok",
    Status.TRIM_FAILED: "no trim found: thrust, speed or climb rate lie outside what the vehicle can hold",
    Status.DIVERGED: "the run diverged: a state left its physical range; the closed loop is unstable at this point",
    Status.TABLE_EXCEEDED: "the run left the range of the rotor or aerodynamic tables: extend the tables or reduce the speed",
    Status.LINEARISATION_FAILED: "the linearisation is not finite, or its derivatives change at half the step",
    Status.MODEL_FAILED: "the model returned no value",
    Status.TIMED_OUT: "the model did not answer within its time limit and was ended",
    Status.CRASHED: "the process of the model ended before it answered (crash or signal)",
    Status.OUTPUT_MISSING: "the model answered without this response or channel",
    Status.OUTPUT_NOT_FINITE: "the model answered with a number that is not finite",
    Status.NO_FIRST_PEAK: "no first peak of the rate after the input: the response is not oscillatory or the record ends too early",
    Status.NO_SECOND_STATIONARY_POINT: "the rate has no second stationary point after the input",
    Status.NO_VALLEY: "the rate has no valley after its first free peak: well damped beyond what a peak ratio can measure",
    Status.NO_SECOND_PEAK: "the rate has no second free peak: the period cannot be measured",
    Status.RECORD_TOO_SHORT: "the record ends before the response has been seen: lengthen the manoeuvre",
    Status.NO_ATTITUDE_CHANGE: "the attitude does not change: enlarge the input",
    Status.NOT_AT_TRIM: "the record is not steady before the input",
    Status.NOT_CAPTURED: "the hover point was not captured in the adequate time: distance or speed did not stay within tolerance",
    Status.NO_DECELERATION: "no deceleration was commanded: lengthen the record or shorten the distance",
    Status.ON_AXIS_RETURNED: "the on-axis attitude is nearly back at trim at the end of the window: read the ratio to its peak",
    Status.NOT_SETTLED: "the speed has not settled at the command when the record ends: lengthen the manoeuvre or damp the loop",
    Status.OTHER_FINAL_SPEED: "the speed comes to rest at another value than was commanded: a limit or an unmodelled load holds it",
    Status.NO_STEADY_COMMAND: "no constant change of speed is commanded at the end of the record: a step that stays is needed",
    Status.STILL_DRIVEN: "the input still drives the response where its free oscillation would be read: let it end faster",
    Status.NO_PHASE_CROSSING: "the phase never crosses the 45 deg margin inside the record",
    Status.NO_OMEGA_180: "the phase never reaches -180 deg: phase delay and gain bandwidth are undefined",
    Status.RANGE_TOO_SHORT: "the response ends below 2 omega_180: phase delay cannot be read; extend the sweep",
    Status.LOW_COHERENCE: "coherence below the accepted minimum where the value is read",
    Status.NO_GAIN_CROSSING: "the gain never crosses 6 dB above its value at omega_180",
    Status.PEAK_CHOICE_CHANGED: "another peak than the nominal one was picked: compare with care",
    Status.PIO_CAUTION: "gain bandwidth below phase bandwidth or undefined: pilot-induced oscillation caution",
    Status.OUTSIDE_REQUIREMENT: "outside the range in which the requirement is defined",
    Status.NEGATIVE_DRAG: "the linear drag went negative during the run: incidence below what the drag model can follow",
    Status.INCIDENCE_OUTSIDE: "incidence or sideslip left the stated validity of the linear aerodynamics",
    Status.LEVEL_2_AT_BEST: "Level 1 is not met, and the requirement states no limit of Level 2: Level 2 at best",
}
