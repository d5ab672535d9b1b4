"""Models that are commands: an executable is given a file of parameters and leaves a file of responses or of a time history."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from levelone.campaign.models import command_files as files
from levelone.campaign.models.answers import Answering, answered, came_to_nothing, parameters_of
from levelone.campaign.models.command_run import PARAMETERS, RESULTS, executable_of, run_command, template_files, template_key
from levelone.campaign.models.keys import file_digest, plain
from levelone.campaign.models.mapping import channel_history, command_values, to_si
from levelone.campaign.models.protocol import Evaluations, FloatArray, ModelFailure, joined
from levelone.campaign.models.travel import FieldsTravel
from levelone.errors import InputError
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import CommandTable
    from levelone.handling.history import TimeHistory
    from levelone.handling.levels import Boundaries
    from levelone.handling.manoeuvres import Manoeuvre


@dataclass(frozen=True)
class _Command(FieldsTravel):
    """An executable, its template and what identifies both."""

    table: CommandTable
    targets: tuple[str, ...]
    keep_in: Path | None

    def __post_init__(self) -> None:
        executable_of(self.table)
        if self.table.folder is not None:
            template_files(self.table.folder)
        if self.table.format == "dakota":
            for name in (*self.targets, *(name for name, _ in self.table.fixed)):
                if name.split() != [name]:
                    raise InputError("factor.target", f"{name!r} holds white space, which ends a name in Dakota's format")

    @cached_property
    def executable(self) -> Path:
        """File of the first argument."""
        return executable_of(self.table)

    @property
    def key(self) -> Mapping[str, Any]:
        """Arguments, options and mapping, and hashes of the executable, of files that arguments name, and of the template."""
        table = self.table
        named = {name: file_digest(Path(name), "model.arguments") for name in table.arguments[1:] if _is_file(name)}
        folder = table.folder
        return {
            "kind": table.kind,
            "arguments": list(table.arguments),
            "executable": file_digest(self.executable, "model.arguments.1"),
            "named": named,
            "template": template_key(folder) if folder is not None else "none",
            "format": table.format,
            "time_limit": plain(table.time_limit),
            "fixed": plain(table.fixed),
            "inputs": plain(table.inputs),
            "outputs": plain(table.outputs),
            "responses": plain(table.responses),
            "targets": plain(self.targets),
        }


@dataclass(frozen=True)
class CommandHistories(_Command):
    """A command that flies a manoeuvre and leaves a time history, as a source.

    Parameters
    ----------
    table
        The command; its format is JSON.
    targets
        Parameters that the columns of a point set.
    keep_in
        Folder for the directories of evaluations that are kept; None where none are.

    Raises
    ------
    InputError
        No such executable, a template with links out of it, Dakota's format (whose results are numbers, not histories), an input's
        name that the first row of a table cannot hold.

    Notes
    -----
    The file of parameters says what is commanded, and the command itself lies beside it as a table of time and input in the model's
    unit (``input.csv``), so that no program has to know the shapes of manoeuvres. Channels come back in the model's units.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.table.format != "json":
            raise InputError(
                "model.format", f'is {self.table.format!r}, which holds no histories: write "json" or gives = "responses"'
            )
        for channel in self.table.inputs:
            if any(character in channel.name for character in ',\r\n"'):
                raise InputError(f"model.inputs.{channel.levelone}.name", f"{channel.name!r} does not fit into a row of names")

    def fly(self, point: FloatArray, manoeuvre: Manoeuvre) -> TimeHistory:
        """One run; see :class:`levelone.campaign.models.protocol.HistorySource`."""
        channel = self.table.command(manoeuvre.axis)
        parameters = parameters_of(self.table.fixed, self.targets, point)
        time = manoeuvre.ticks()
        key = _content_key(parameters, plain(manoeuvre))
        texts = {
            PARAMETERS: files.json_parameters(key, parameters, manoeuvre, channel),
            files.INPUT: files.input_csv(channel.name, time, command_values(channel, manoeuvre, time, held=0.0)),
        }
        found = run_command(self.table, self.executable, texts, _history, key, self.keep_in)
        for name in ("time", *(each.name for each in self.table.outputs)):
            if name not in found:
                raise ModelFailure(Status.OUTPUT_MISSING, f"the results hold no {name!r}; they hold {', '.join(found)}")
        channels = {each.levelone: to_si(each, found[each.name]) for each in self.table.outputs}
        return channel_history(found["time"], channels, manoeuvre)


@dataclass(frozen=True, eq=False)
class CommandResponses(Answering, _Command):
    """A command that answers responses itself, in Dakota's format or in JSON.

    Parameters
    ----------
    table, targets, keep_in
        As of :class:`CommandHistories`; both formats.
    boundaries, task
        For Levels, where the responses have the names of a criterion's numbers (see
        :class:`levelone.campaign.models.answers.Judge`).
    """

    boundaries: Boundaries
    task: str

    def evaluate(self, points: FloatArray) -> Evaluations:
        """Responses at ``points`` [n, targets], one run of the command for each."""
        return joined([self._one(row) for row in np.atleast_2d(np.asarray(points, dtype=np.float64))])

    def _one(self, row: FloatArray) -> Evaluations:
        began = perf_counter()
        parameters = parameters_of(self.table.fixed, self.targets, row)
        key = _content_key(parameters, [])
        dakota = self.table.format == "dakota"
        text = files.dakota_parameters(parameters, self.names) if dakota else files.json_parameters(key, parameters)

        def read(work: Path) -> Evaluations:
            left = files.read_limited(work / RESULTS)
            answer = files.dakota_results(left, self.names) if dakota else files.json_responses(left)
            return answered(answer, self._judge, perf_counter() - began)

        try:
            return run_command(self.table, self.executable, {PARAMETERS: text}, read, key, self.keep_in)
        except ModelFailure as failure:
            return came_to_nothing(failure, self._judge, perf_counter() - began)


def _history(work: Path) -> dict[str, FloatArray]:
    return files.json_history(files.read_limited(work / RESULTS), work)


def _content_key(parameters: Mapping[str, float], flown: Any) -> str:
    """Name of an evaluation that its content alone decides, as long as a file's name may well be."""
    text = json.dumps([dict(parameters), flown], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def _is_file(name: str) -> bool:
    """Whether an argument names a file by an absolute path: a relative one is looked for in the directory of each run."""
    try:
        return Path(name).is_absolute() and Path(name).is_file()
    except (OSError, ValueError):
        return False
