"""From a study of a model of one's own to the model that a campaign evaluates; each kind is imported when it is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from levelone.campaign.models.protocol import HistorySource, Model
from levelone.config.model_table import (
    BuiltInTable,
    CommandTable,
    FmuTable,
    JsbsimTable,
    PythonTable,
    StateSpaceTable,
)

if TYPE_CHECKING:
    from levelone.config.model_study import ModelStudy


def build(study: ModelStudy, keep_in: Path | None = None) -> Model:
    """The model of a study, with everything checked that can be before the first evaluation.

    A Python function is imported here, which runs its module; nothing else is executed.

    Parameters
    ----------
    study
        The study.
    keep_in
        Folder under which directories of a command's evaluations are kept, as the study asks; None keeps none.

    Raises
    ------
    InputError
        What would fail every evaluation: a module, executable, file or name that is not there, an optional package that is missing.
    """
    table = study.model
    if isinstance(table, PythonTable) and table.gives == "responses":
        from levelone.campaign.models.python_function import PythonResponses

        answering = PythonResponses(table, study.targets, study.boundaries, study.task)
        _ = answering.function
        return answering
    if isinstance(table, CommandTable) and table.gives == "responses":
        from levelone.campaign.models.command import CommandResponses

        return CommandResponses(table, study.targets, keep_in, study.boundaries, study.task)
    from levelone.campaign.models.programme import HistoryModel

    nominal = tuple(float(value) for value in study.nominal)
    source = source_of(study, keep_in)
    return HistoryModel(source, study.tests, study.targets, nominal, study.boundaries, study.campaign.histories)


def source_of(study: ModelStudy, keep_in: Path | None = None) -> HistorySource:
    """What flies the tests of a study whose model gives histories; parameters and errors as of :func:`build`."""
    table = study.model
    if isinstance(table, BuiltInTable):
        return _built_in(table, study)
    if isinstance(table, PythonTable):
        from levelone.campaign.models.python_function import PythonHistories

        source = PythonHistories(table, study.targets)
        _ = source.function
        return source
    if isinstance(table, CommandTable):
        from levelone.campaign.models.command import CommandHistories

        return CommandHistories(table, study.targets, keep_in)
    if isinstance(table, FmuTable):
        from levelone.campaign.models.fmu import FmuSource
        from levelone.campaign.models.fmu_archive import described
        from levelone.campaign.models.fmu_variables import check_start_units

        check_start_units(study.targets, _units(study), described(table.file, table.mode))
        return FmuSource(table, study.targets)
    if isinstance(table, JsbsimTable):
        from levelone.campaign.models.jsbsim import JsbsimSource
        from levelone.campaign.models.jsbsim_properties import check_factor_units

        check_factor_units(study.targets, _units(study))
        return JsbsimSource(table, study.targets)
    if isinstance(table, StateSpaceTable):
        from levelone.campaign.models.state_space import StateSpaceSource

        return StateSpaceSource(table, study.targets, study.tests)
    raise TypeError(f"{type(table).__name__} is no description of a model")


def _units(study: ModelStudy) -> tuple[str, ...]:
    return tuple(factor.unit for factor in study.space.factors)


def _built_in(table: BuiltInTable, study: ModelStudy) -> HistorySource:
    from levelone.campaign.models.built_in_source import BuiltInSource

    source = BuiltInSource(table, study.targets)
    for test in study.tests:
        source.check(test.manoeuvre)
    return source
