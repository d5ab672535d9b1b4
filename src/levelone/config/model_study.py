"""Study files of a model of one's own: a TOML file becomes a :class:`ModelStudy`, everything that a campaign on it needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from levelone.config.campaign_table import CampaignOptions, Cluster
from levelone.config.correlation_table import correlated, described
from levelone.config.factor_table import Inputs, check_corners, inputs_of
from levelone.config.files import file_hash, read_toml
from levelone.config.model_description import check_kind, description_of
from levelone.config.model_factors import own_inputs
from levelone.config.model_schema import SECTIONS, CampaignSection, ModelStudyFile
from levelone.config.model_table import (
    BuiltInTable,
    Channel,
    JsbsimTable,
    ModelDescription,
    ResponseName,
    Test,
    response_names,
)
from levelone.config.model_tests import tests_of
from levelone.config.schema import check, in_file, in_section
from levelone.config.study_file import Method, method_of
from levelone.errors import InputError, unknown_name
from levelone.handling.history import FloatArray
from levelone.handling.levels import Boundaries, load_boundaries
from levelone.uncertainty import FactorSpace
from levelone.uncertainty.failures import Policy

#: kinds whose evaluations run in processes of their own where the study file does not say: they may crash or hang
APART = ("command", "fmu", "jsbsim")
MOST = {"trajectories": 100_000, "levels": 1000, "samples": 1_000_000, "base_points": 1 << 24, "bootstrap": 1_000_000}
"""Largest sizes of [method]."""


@dataclass(frozen=True, eq=False)
class ModelStudy:
    """A checked study of a model of one's own.

    Parameters
    ----------
    name, title, intended_use
        For the report; ``name`` is also the name of its folder of results.
    path, hash
        The study file, and its SHA-256.
    seed
        From which the seeds of all stages are derived.
    policy
        What failed runs do to indices: "refuse", "drop" or "bound".
    space, targets, nominal
        Factors in the model's own units; the model's names that they set, and [factors] nominal values.
    correlations
        Both factors, rank correlation and origin in words of each correlated pair.
    method
        Sizes and options of the analysis.
    boundaries, boundaries_source, task
        Level boundaries, where they come from (library name or path), and the bandwidth chart that sets the Level.
    not_validated, validity_domain, notes
        Statements that the report repeats.
    assumed
        (path, why) of every value of the study file that is marked as assumed.
    read
        Responses that get surrogates and indices; empty for all.
    model
        Description of the model.
    tests
        What is flown and read; empty where the model answers responses itself.
    campaign
        Where the evaluations run.
    """

    name: str
    title: str
    intended_use: str
    path: Path
    hash: str
    seed: int
    policy: Policy
    space: FactorSpace
    targets: tuple[str, ...]
    nominal: FloatArray
    correlations: tuple[tuple[str, str, float, str], ...]
    method: Method
    boundaries: Boundaries
    boundaries_source: str
    task: str
    not_validated: tuple[str, ...]
    validity_domain: tuple[str, ...]
    notes: tuple[str, ...]
    assumed: tuple[tuple[str, str], ...]
    read: tuple[str, ...]
    model: ModelDescription
    tests: tuple[Test, ...]
    campaign: CampaignOptions

    @property
    def inputs(self) -> tuple[Channel, ...]:
        """Commands that are mapped, for the report."""
        return self.model.inputs

    @property
    def outputs(self) -> tuple[Channel, ...]:
        """Channels that are mapped, for the report."""
        return self.model.outputs


def is_model_study(path: str | PathLike[str]) -> bool:
    """Whether a study file has a [model] table; InputError where it cannot be read."""
    return "model" in read_toml(Path(path))


def load_model_study(path: str | PathLike[str]) -> ModelStudy:
    """Read a study of a model of one's own, and refuse what would fail in every evaluation.

    Only the study file, boundaries and a built-in vehicle are read: the model is neither opened nor run.

    Parameters
    ----------
    path
        TOML file; the format is described in docs/reference/model-study.md. Paths in it are relative to it.

    Raises
    ------
    InputError
        One line with file, path of the value, what is wrong and what is allowed.
    """
    path = Path(path)
    content = read_toml(path)
    kind = check_kind(content, path.name)
    checked = check(ModelStudyFile[SECTIONS[kind]], content, path.name)  # type: ignore[misc]
    folder = path.absolute().parent
    with in_file(path.name):
        responses = tuple(ResponseName(each.name, each.unit) for each in checked.response)
        _check_gives(checked.model.gives, checked, responses)
        boundaries_source, boundaries = _boundaries(checked.levels.boundaries, folder)
    model = _described(checked.model, folder, responses, path.name)
    with in_file(path.name):
        tests = tests_of(checked.test, model, checked.levels.task)
        _check_tasks(boundaries, checked, tests)
        inputs = correlated(_inputs(checked, model, tests), checked.correlation, None)
        general = checked.study
        return ModelStudy(
            name=general.name,
            title=general.title,
            intended_use=general.intended_use,
            path=path,
            hash=file_hash(path),
            seed=general.seed,
            policy=general.failures,
            space=inputs.space,
            targets=inputs.targets,
            nominal=inputs.nominal,
            correlations=described(checked.correlation),
            method=_method(checked),
            boundaries=boundaries,
            boundaries_source=boundaries_source,
            task=checked.levels.task,
            not_validated=tuple(general.not_validated),
            validity_domain=tuple(general.validity_domain),
            notes=tuple(general.notes),
            assumed=_assumed(checked),
            read=_read(checked, tests, responses),
            model=model,
            tests=tests,
            campaign=_campaign(checked.campaign, kind),
        )


def _described(section: Any, folder: Path, responses: tuple[ResponseName, ...], name: str) -> ModelDescription:
    """The description; errors of a vehicle's file keep the name of that file."""
    try:
        return description_of(section, folder, responses)
    except InputError as error:
        raise InputError(f"{name}: {error.field}" if error.field.startswith("model") else error.field, error.problem) from None


def _check_gives(gives: str, content: ModelStudyFile[Any], responses: Sequence[ResponseName]) -> None:
    """Tests belong to a model that gives histories, responses to one that gives responses."""
    if gives == "responses":
        if content.test:
            raise InputError(f"test.{content.test[0].name}", 'has no place here: gives = "responses" takes [[response]]')
        if not responses:
            raise InputError("response", 'missing: gives = "responses" takes one [[response]] at least')
        for key in ("inputs", "outputs"):
            if getattr(content.model, key):
                raise InputError(f"model.{key}", 'has no place here: gives = "responses" maps no channels')
    elif responses:
        raise InputError(f"response.{responses[0].name}", 'has no place here: gives = "histories" takes [[test]]')
    elif not content.test:
        raise InputError("test", 'missing: gives = "histories" takes one [[test]] at least')
    names = [each.name for each in responses]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"response.{name}", "is the name of two responses; each needs one of its own")


def _boundaries(given: str, folder: Path) -> tuple[str, Boundaries]:
    """Name in the library or absolute path, and the boundaries."""
    source = given
    if given.endswith(".toml"):
        source = str((folder / given).resolve())
        read_toml(Path(source))  # its limits hold for every file that a study names
    with in_section("levels"):
        return source, load_boundaries(source)


def _check_tasks(boundaries: Boundaries, content: ModelStudyFile[Any], tests: Sequence[Test]) -> None:
    """Every bandwidth chart that is named or read must be among the boundaries."""
    named = {"levels.task": content.levels.task} if "task" in content.levels.model_fields_set else {}
    read = {f"test.{test.name}.task": test.task for test in tests if test.criterion == "bandwidth"}
    for field, task in (*named.items(), *read.items()):
        try:
            boundaries.chart("bandwidth", task)
        except InputError as error:
            raise InputError(field, error.problem) from None


def _inputs(content: ModelStudyFile[Any], model: ModelDescription, tests: tuple[Test, ...]) -> Inputs:
    names = [each.name for each in content.factor]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"factor.{name}", "is the name of two factors; each needs one of its own")
    if isinstance(model, BuiltInTable):
        tables = [(f"factor.{table.name}", table) for table in content.factor]
        inputs = inputs_of(tables, model.vehicle, model.trim_speed)
        check_corners(inputs, [path for path, _ in tables], model.vehicle, tuple(test.manoeuvre for test in tests))
        return inputs
    taken = {name: "model.fixed" for name, _ in model.fixed}
    if isinstance(model, JsbsimTable):
        taken |= {name: "model.initial" for name, _ in model.initial} | {name: "model.set" for name, _ in model.set}
    return own_inputs(content.factor, {channel.name: f"model.inputs.{channel.levelone}" for channel in model.inputs} | taken)


def _method(content: ModelStudyFile[Any]) -> Method:
    for name, most in MOST.items():
        given = getattr(content.method, name)
        if given > most:
            raise InputError(f"method.{name}", f"is {given}, must be at most {most}")
    return method_of(content.method)


def _assumed(content: ModelStudyFile[Any]) -> tuple[tuple[str, str], ...]:
    entries = [(f"factor.{each.name}", each.assumed) for each in content.factor]
    pairs = [(f"correlation.{i}", each.assumed) for i, each in enumerate(content.correlation, 1)]
    return tuple((path, why) for path, why in (*entries, *pairs) if why is not None)


def _read(content: ModelStudyFile[Any], tests: tuple[Test, ...], responses: Sequence[ResponseName]) -> tuple[str, ...]:
    if content.responses is None:
        return ()
    known = [name for name, _, _ in response_names(tests)] or [each.name for each in responses]
    read = content.responses.read
    for i, name in enumerate(read, 1):
        if name not in known:
            raise unknown_name(f"responses.read.{i}", name, known)
        if name in read[: i - 1]:
            raise InputError(f"responses.read.{i}", f"{name!r} is given twice")
    return tuple(read)


def _campaign(given: CampaignSection, kind: str) -> CampaignOptions:
    options = {name: value for name, value in given if value is not None and name != "cluster"}
    options.setdefault("executor", "processes" if kind in APART else "batch")
    with in_section("campaign"):
        if given.cluster is None:
            return CampaignOptions(**options)
        with in_section("cluster"):
            cluster = Cluster(**{name: value for name, value in given.cluster if value is not None})
        return CampaignOptions(**options, cluster=cluster)
