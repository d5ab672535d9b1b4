"""Sections of a calibration file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from levelone.config.quantities import Origin
from levelone.config.schema import Finite, Strict, Text
from levelone.config.study_schema import FileName

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Factor = Annotated[float, Field(gt=1.0, allow_inf_nan=False)]
Range = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Role = Literal["fit", "draw", "hold"]
Scale = Literal["log", "linear"]


class GeneralTable(Strict):
    """[calibration]"""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]
    title: Text
    study: FileName
    seed: Annotated[int, Field(ge=0)]
    starts: Annotated[int, Field(ge=0)]
    perturbation: Factor
    digits: Annotated[int, Field(ge=2, le=15)]


class TargetTable(Origin):
    """[[target]]: a nominal response, what it should be, how closely it is pulled there, and what is accepted."""

    response: Text
    value: Finite
    unit: str
    tolerance: Positive
    accept: Range


class ParameterTable(Strict):
    """[[parameter]]: an assumed number of the vehicle's file, its prior and its bounds, in the unit of that file."""

    path: Text
    ties: Annotated[list[Text], Field(default_factory=list)]
    unit: str
    prior: Finite
    low: Finite
    high: Finite
    spread: Positive
    scale: Scale = "log"
    role: Role = "fit"
    assumed: Text


class FamilyTable(Strict):
    """[[tradeoff.family]]: a second curve, on which some parameters have another prior or another upper bound."""

    name: Text
    prior: Annotated[dict[Text, Finite], Field(min_length=1)]
    high: Annotated[dict[Text, Finite], Field(default_factory=dict)]


class TradeoffTable(Strict):
    """[tradeoff]: the target that is forced through a range while the others are fitted."""

    response: Text
    values: Annotated[list[Finite], Field(min_length=2)]
    tolerance: Positive
    unit: str
    family: Annotated[list[FamilyTable], Field(default_factory=list)]


class LimitTable(Origin):
    """[[checks.limit]]: what a response must not exceed in any Monte Carlo sample of the study."""

    response: Text
    high: Finite
    unit: str


class ChecksTable(Strict):
    """[checks]: what is looked at after the fit, and is no target."""

    speeds: Annotated[list[Finite], Field(min_length=1)]
    inactive: Annotated[list[Text], Field(default_factory=list)]
    limit: Annotated[list[LimitTable], Field(default_factory=list)]


class CalibrationFile(Strict):
    """A whole calibration file."""

    calibration: GeneralTable
    target: Annotated[list[TargetTable], Field(min_length=1)]
    parameter: Annotated[list[ParameterTable], Field(min_length=1)]
    tradeoff: TradeoffTable | None = None
    checks: ChecksTable
