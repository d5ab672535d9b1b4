"""Sections of a study file. A number stands for the unit named here, or is a table of value and unit."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from levelone.config.quantities import Origin, Quantity, plain, si
from levelone.config.schema import Finite, Strict, Text
from levelone.handling.levels import DEFAULT
from levelone.handling.manoeuvres import Start
from levelone.uncertainty.failures import Policy

Seconds = Annotated[float, plain("s")]
Speed = Annotated[float, plain("m/s")]
Distance = Annotated[float, plain("m")]
Frequency = Annotated[float, plain("rad/s")]
Count = Annotated[int, Field(ge=2)]
Texts = list[Text]
FileName = Annotated[str, Field(pattern=r"\.toml$")]
GivenTime = Annotated[Quantity, si("s", sign="not negative")]
GivenSpeed = Annotated[Quantity, si("m/s", sign="not negative")]
Acceleration = Annotated[Quantity, si("m/s^2", sign="positive")]
PerSecond = Annotated[Quantity, si("1/s", sign="positive")]
GivenLength = Annotated[Quantity, si("m", sign="positive")]
Angle = Annotated[Quantity, si("rad", sign="positive")]
Limit = Annotated[Quantity, si("s", sign="positive")]


class Inheritance(Strict):
    """What [study] says of another study file and of what is taken from it; other keys are not looked at."""

    model_config = ConfigDict(extra="ignore")

    extends: FileName | None = None
    without: Annotated[Texts, Field(default_factory=list)]
    factors: Annotated[Texts, Field(min_length=1)] | None = None


class Heir(Strict):
    """The part of a study file that is read before it is merged with the file that it extends."""

    model_config = ConfigDict(extra="ignore")

    study: Inheritance = Inheritance(without=[])


class General(Inheritance):
    """[study]"""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]
    title: Text
    vehicle: Text
    findings: FileName | None = None
    seed: Annotated[int, Field(ge=0)]
    intended_use: Text
    failures: Policy
    not_validated: Texts
    validity_domain: Texts
    notes: Annotated[Texts, Field(default_factory=list)]


class Condition(Strict):
    """[condition]"""

    trim_speed: Speed
    flight_mode: Literal["velocity", "position"]
    start: Start = "own trim"


class Step(Strict):
    """[manoeuvre.attitude_quickness]"""

    amplitude: Speed
    on: Seconds
    duration: Seconds


class Pulse(Strict):
    """[manoeuvre.dynamic_stability]"""

    amplitude: Speed
    on: Seconds
    length: Seconds
    duration: Seconds


class Sweep(Strict):
    """[manoeuvre.bandwidth.sweep]"""

    amplitude: Speed
    omega_min: Frequency
    omega_max: Frequency
    length: Seconds
    windows: Annotated[list[Seconds], Field(min_length=1)]
    amplitudes: Annotated[list[Speed], Field(default_factory=list)]


class FrequencyGrid(Strict):
    """[manoeuvre.bandwidth]: frequencies of the linear response, in equal ratios, and the sweep that it is compared with."""

    omega_min: Frequency
    omega_max: Frequency
    points: Annotated[int, Field(ge=20)]
    sweep: Sweep


class Manoeuvres(Strict):
    """[manoeuvre]"""

    attitude_quickness: Step
    dynamic_stability: Pulse
    bandwidth: FrequencyGrid


class MethodTable(Strict):
    """[method]"""

    trajectories: Count
    levels: Annotated[int, Field(ge=2, multiple_of=2)]
    samples: Count
    base_points: Count
    bootstrap: Count
    kernel: Literal["likeliest", "matern52", "squared_exponential"]
    trend: Literal["constant", "linear"]


def in_words(origin: Origin) -> str:
    """Where a value comes from, or "assumed: why"."""
    return origin.source if origin.source is not None else f"assumed: {origin.assumed}"


class FroudeTable(Origin):
    """[levels.froude]: the vehicle's length and that of the aircraft for which the limits were written."""

    length: GivenLength
    reference_length: GivenLength


class LevelTable(Strict):
    """[levels]"""

    boundaries: Text = DEFAULT
    task: Text = "all_other"
    froude: FroudeTable | None = None


class FactorTable(Origin):
    """[[factor]]"""

    name: Text
    target: Text | None = None
    value: Finite
    unit: str
    distribution: Text = "uniform"
    kind: Literal["absolute", "relative"] | None = None
    range: Annotated[list[Finite], Field(min_length=2, max_length=2)] | None = None
    low: Finite | None = None
    high: Finite | None = None
    mean: Finite | None = None
    std: Finite | None = None
    centre: Finite | None = None
    mode: Finite | None = None
    mu: Finite | None = None
    sigma: Finite | None = None
    values: list[Finite] | None = None
    weights: list[Finite] | None = None
    intervals: list[Annotated[list[Finite], Field(min_length=2, max_length=2)]] | None = None
    masses: list[Finite] | None = None

    @property
    def parameters(self) -> dict[str, Any]:
        """What is given of the distribution."""
        return {name: value for name in PARAMETERS if (value := getattr(self, name)) is not None}


PARAMETERS = (
    "kind", "range", "low", "high", "mean", "std", "centre", "mode", "mu", "sigma", "values", "weights", "intervals", "masses",
)  # fmt: skip


class CorrelationTable(Origin):
    """[[correlation]]: Spearman rank correlation of two factors."""

    factors: Annotated[Texts, Field(min_length=2, max_length=2)]
    rank: Annotated[float, Field(gt=-1.0, lt=1.0)]


class CouplingTable(Strict):
    """[coupling]: pitch-roll coupling, screened with the study's factors and those given here."""

    trajectories: Count
    factor: Annotated[list[FactorTable], Field(min_length=1)]


class BesideTable(Origin):
    """[cases.beside]: other numbers for the same cases, row by row."""

    name: Text
    rows: Annotated[list[list[Finite]], Field(min_length=1)]


class CasesTable(Origin):
    """[[cases]]: vehicles that differ from the nominal one in the columns, one a row."""

    name: Text
    criterion: Literal["attitude_quickness", "dynamic_stability", "bandwidth"]
    columns: Annotated[Texts, Field(min_length=1)]
    rows: Annotated[list[list[Finite]], Field(min_length=1)]
    beside: BesideTable | None = None


class PilotTable(Origin):
    """[deceleration.pilot]"""

    gain: PerSecond
    lead: GivenTime
    delay: GivenTime
    deceleration: Acceleration
    reverse: GivenSpeed


class ToleranceTable(Origin):
    """[deceleration.desired] and [deceleration.adequate]"""

    overshoot: GivenLength
    position: GivenLength
    height: GivenLength
    lateral: GivenLength
    heading: Angle
    time: Limit
    theta: Angle


class DecelerationTable(Strict):
    """[deceleration]: deceleration to hover over a point, flown by the pilot model."""

    speeds: Annotated[list[Speed], Field(min_length=1)]
    distances: Annotated[list[Distance], Field(min_length=1)]
    duration: Seconds
    hold: Seconds
    pilot: PilotTable
    desired: ToleranceTable
    adequate: ToleranceTable


class EpistemicTable(Origin):
    """[epistemic]: probability boxes over the factors that are only known as intervals."""

    factors: Annotated[Texts, Field(min_length=1)] | None = None
    outer: Count
    inner: Count | None = None


class StudyFile(Strict):
    """A whole study file."""

    study: General
    condition: Condition
    manoeuvre: Manoeuvres
    method: MethodTable
    levels: LevelTable = LevelTable()
    factor: Annotated[list[FactorTable], Field(min_length=1)]
    correlation: Annotated[list[CorrelationTable], Field(default_factory=list)]
    coupling: CouplingTable | None = None
    cases: Annotated[list[CasesTable], Field(default_factory=list)]
    deceleration: DecelerationTable | None = None
    epistemic: EpistemicTable | None = None
