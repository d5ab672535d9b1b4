"""Sections of a study file. A number stands for the unit named here, or is a table of value and unit."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from levelone.config.quantities import Origin, plain
from levelone.config.schema import Finite, Strict, Text
from levelone.handling.levels import DEFAULT
from levelone.uncertainty.failures import Policy

Seconds = Annotated[float, plain("s")]
Speed = Annotated[float, plain("m/s")]
Frequency = Annotated[float, plain("rad/s")]
Count = Annotated[int, Field(ge=2)]
Texts = list[Text]


class General(Strict):
    """[study]"""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]
    title: Text
    vehicle: Text
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


class LevelTable(Strict):
    """[levels]"""

    boundaries: Text = DEFAULT
    task: Text = "all_other"


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

    @property
    def parameters(self) -> dict[str, Any]:
        """What is given of the distribution."""
        return {name: value for name in PARAMETERS if (value := getattr(self, name)) is not None}


PARAMETERS = ("kind", "range", "low", "high", "mean", "std", "centre", "mode", "mu", "sigma", "values", "weights")


class StudyFile(Strict):
    """A whole study file."""

    study: General
    condition: Condition
    manoeuvre: Manoeuvres
    method: MethodTable
    levels: LevelTable = LevelTable()
    factor: Annotated[list[FactorTable], Field(min_length=1)]
