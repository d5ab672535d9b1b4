"""Sections of the study file of a model of one's own."""

from __future__ import annotations

from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import Field

from levelone.config.quantities import plain
from levelone.config.schema import Finite, Strict, Text
from levelone.config.study_schema import CorrelationTable, FactorTable, Frequency, MethodTable, Seconds, Speed, Texts
from levelone.handling.levels import DEFAULT
from levelone.handling.manoeuvres import Start
from levelone.uncertainty.failures import Policy

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=64)]
Words = Annotated[str, Field(min_length=1, max_length=1000)]
Sign = Literal[1, -1]
Numbers = Annotated[dict[Words, Finite], Field(default_factory=dict, max_length=1000)]
Duration = Annotated[float, plain("s"), Field(gt=0.0, le=1e5)]
Settle = Annotated[float, plain("s"), Field(ge=0.0, le=1e5)]


class ModelGeneral(Strict):
    """[study]"""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=100)]
    title: Text
    seed: Annotated[int, Field(ge=0)]
    intended_use: Text
    failures: Policy
    not_validated: Texts
    validity_domain: Texts
    notes: Annotated[Texts, Field(default_factory=list)]


class OutputTable(Strict):
    """[model.outputs.CHANNEL]"""

    name: Words
    unit: Words
    sign: Sign = 1


class InputTable(OutputTable):
    """[model.inputs.COMMAND]"""

    trim: Literal["hold"] | Finite = "hold"


class BuiltInSection(Strict):
    """[model] with kind = "built-in" """

    kind: Literal["built-in"]
    gives: Literal["histories"] = "histories"
    vehicle: Text
    trim_speed: Speed
    flight_mode: Literal["rate", "attitude", "velocity", "position"]
    start: Start = "own trim"


class MappedSection(Strict):
    """What [model] has of every kind but the built-in vehicle."""

    gives: Literal["histories"] = "histories"
    fixed: Numbers
    inputs: Annotated[dict[str, InputTable], Field(default_factory=dict)]
    outputs: Annotated[dict[str, OutputTable], Field(default_factory=dict)]


class PythonSection(MappedSection):
    """[model] with kind = "python" """

    kind: Literal["python"]
    gives: Literal["histories", "responses"] = "histories"  # type: ignore[assignment]
    function: Annotated[str, Field(max_length=500)]
    folder: Words | None = None
    vectorised: bool = False


class CommandSection(MappedSection):
    """[model] with kind = "command" """

    kind: Literal["command"]
    gives: Literal["histories", "responses"] = "histories"  # type: ignore[assignment]
    arguments: Annotated[list[Annotated[str, Field(max_length=4000)]], Field(min_length=1, max_length=200)]
    format: Literal["dakota", "json"]
    folder: Words | None = None
    time_limit: Duration | None = None
    keep: Literal["failed", "all", "none"] = "failed"


class FmuSection(MappedSection):
    """[model] with kind = "fmu" """

    kind: Literal["fmu"]
    file: Words
    mode: Literal["co-simulation", "model-exchange"] = "co-simulation"
    step: Duration | None = None
    settle: Settle = 0.0
    tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None


class JsbsimSection(MappedSection):
    """[model] with kind = "jsbsim" """

    kind: Literal["jsbsim"]
    aircraft: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._+-]*$", max_length=100)]
    folder: Words | None = None
    step: Duration = 1.0 / 120.0
    initial: Numbers
    set: Numbers
    engines_running: bool = True
    settle: Settle = 0.0
    random_seed: Annotated[int, Field(ge=0, lt=2**31)] = 0


class StateSpaceSection(MappedSection):
    """[model] with kind = "state-space" """

    kind: Literal["state-space"]
    file: Words


SECTIONS: dict[str, type[Strict]] = {
    "built-in": BuiltInSection,
    "python": PythonSection,
    "command": CommandSection,
    "fmu": FmuSection,
    "jsbsim": JsbsimSection,
    "state-space": StateSpaceSection,
}


class TestTable(Strict):
    """[[test]]; ``amplitude`` is a number in the unit of the command, or a table of value and unit."""

    __test__ = False  # by its name a test collector would take it for one of its own

    name: Name
    criterion: Text
    command: Text
    axis: Text | None = None
    shape: Text | None = None
    amplitude: Any = None
    on: Seconds | None = None
    length: Seconds | None = None
    duration: Seconds | None = None
    dt: Seconds | None = None
    delay: Annotated[Seconds, Field(ge=0.0)] | None = None
    fade: Seconds | None = None
    settle: Seconds | None = None
    omega_min: Frequency | None = None
    omega_max: Frequency | None = None
    points: Annotated[int, Field(ge=20, le=100_000)] | None = None
    output: Text | None = None
    sign: Sign | None = None
    integrate: bool | None = None
    method: Literal["sweep", "linear"] | None = None
    windows: Annotated[list[Seconds], Field(min_length=1, max_length=20)] | None = None
    coherence_min: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    response_type: Literal["rate_command", "attitude_command"] | None = None
    phase_reference: Annotated[float, plain("rad")] | None = None
    task: Text | None = None


class ResponseTable(Strict):
    """[[response]]"""

    name: Name
    unit: Annotated[str, Field(min_length=1, max_length=60)]


class ReadTable(Strict):
    """[responses]"""

    read: Annotated[list[Text], Field(min_length=1, max_length=1000)]


class ModelLevels(Strict):
    """[levels]"""

    boundaries: Text = DEFAULT
    task: Text = "all_other"


class ClusterTable(Strict):
    """[campaign.cluster]; what is not given is the default of :class:`levelone.config.campaign_table.Cluster`."""

    kind: Text
    workers: int
    cores: int | None = None
    memory: Text | None = None
    walltime: Text | None = None
    queue: Text | None = None
    account: Text | None = None


class CampaignSection(Strict):
    """[campaign]; what is not given is the default of :class:`levelone.config.campaign_table.CampaignOptions`."""

    executor: Text | None = None
    workers: int | None = None
    time_limit: Seconds | None = None
    retries: int | None = None
    chunk: int | None = None
    histories: bool | None = None
    cluster: ClusterTable | None = None


Section = TypeVar("Section", bound=Strict)


class ModelStudyFile(Strict, Generic[Section]):
    """A whole study file of a model of one's own, with the section [model] of its kind."""

    study: ModelGeneral
    model: Section
    method: MethodTable
    levels: ModelLevels = ModelLevels()
    test: Annotated[list[TestTable], Field(default_factory=list, max_length=100)]
    response: Annotated[list[ResponseTable], Field(default_factory=list, max_length=1000)]
    factor: Annotated[list[FactorTable], Field(min_length=1, max_length=500)]
    correlation: Annotated[list[CorrelationTable], Field(default_factory=list, max_length=10_000)]
    responses: ReadTable | None = None
    campaign: CampaignSection = CampaignSection()
