"""Models that are Python functions: of responses, one point or many at a time, or of time histories."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from levelone.campaign.models.answers import Answering, answered, came_to_nothing, parameters_of
from levelone.campaign.models.importing import code_digest, function_of
from levelone.campaign.models.keys import plain, versions
from levelone.campaign.models.mapping import change_of_input, channel_history, real_numbers, to_si
from levelone.campaign.models.protocol import Evaluations, FloatArray, ModelFailure, joined
from levelone.campaign.models.travel import FieldsTravel
from levelone.errors import InputError
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import PythonTable
    from levelone.handling.history import TimeHistory
    from levelone.handling.levels import Boundaries
    from levelone.handling.manoeuvres import Manoeuvre


@dataclass(frozen=True)
class _Function(FieldsTravel):
    """A function that is imported when it is first called, in the process that calls it."""

    table: PythonTable
    targets: tuple[str, ...]

    @cached_property
    def function(self) -> Callable[..., Any]:
        """The user's function; InputError where there is none."""
        return function_of(self.table.function, self.table.folder)

    @property
    def key(self) -> Mapping[str, Any]:
        """Path, options and mapping of the function, the hash of its code, and the versions of Python's numeric libraries."""
        table = self.table
        return {
            "kind": table.kind,
            "function": table.function,
            "code": code_digest(table.function, table.folder),
            "vectorised": table.vectorised,
            "fixed": plain(table.fixed),
            "inputs": plain(table.inputs),
            "outputs": plain(table.outputs),
            "responses": plain(table.responses),
            "targets": plain(self.targets),
            "versions": versions("numpy", "scipy"),
        }


@dataclass(frozen=True)
class PythonHistories(_Function):
    """A function ``(parameters, manoeuvre) -> {"time": [n], name: [n], ...}`` as a source of time histories.

    Parameters
    ----------
    table
        Where the function is, and how its channels are named.
    targets
        Parameters that the columns of a point set.

    Raises
    ------
    InputError
        An input with a ``trim`` of its own: the function is told the change of the input only.

    Notes
    -----
    The function gets the parameters by name, as floats, and the manoeuvre with its amplitude in the model's own unit and sign:
    ``manoeuvre.command(time)`` is the change of the input. ``time`` is in s from the beginning of the record, other channels are
    in the units of the study file.
    """

    def __post_init__(self) -> None:
        for channel in self.table.inputs:
            if channel.trim is not None:
                raise InputError(
                    f"model.inputs.{channel.levelone}.trim",
                    f"is {channel.trim:g}, and a function is told the change of its input from trim only: leave it out",
                )

    def fly(self, point: FloatArray, manoeuvre: Manoeuvre) -> TimeHistory:
        """One run; see :class:`levelone.campaign.models.protocol.HistorySource`."""
        given = change_of_input(self.table.command(manoeuvre.axis), manoeuvre)
        answer = _called(self.function, parameters_of(self.table.fixed, self.targets, point), given)
        if not isinstance(answer, Mapping):
            raise ModelFailure(
                Status.MODEL_FAILED,
                f"the function returned a {type(answer).__name__}, and a mapping from channels to arrays is needed",
            )
        for name in ("time", *(channel.name for channel in self.table.outputs)):
            if name not in answer:
                raise ModelFailure(
                    Status.OUTPUT_MISSING, f"the function returned no {name!r}; it returned {', '.join(map(str, answer))}"
                )
        channels = {channel.levelone: _si(channel, answer[channel.name]) for channel in self.table.outputs}
        return channel_history(answer["time"], channels, manoeuvre)


@dataclass(frozen=True, eq=False)
class PythonResponses(Answering, _Function):
    """A function of responses: ``({name: float}) -> {response: float}``, or of arrays [n] where it is vectorised.

    Parameters
    ----------
    table
        Where the function is, and its responses.
    targets
        Parameters that the columns of a point set.
    boundaries, task
        For Levels, where the responses have the names of a criterion's numbers (see :class:`Judge`).
    """

    boundaries: Boundaries
    task: str

    def evaluate(self, points: FloatArray) -> Evaluations:
        """Responses at ``points`` [n, targets].

        Where a call for many points fails, they are asked for one by one: a failure stays with its own point, and no answer
        depends on which points were asked for together.
        """
        rows = np.atleast_2d(np.asarray(points, dtype=np.float64))
        function = self.function
        if self.table.vectorised and len(rows) > 1:
            together = self._together(function, rows)
            if together is not None:
                return together
        return joined([self._one(function, row) for row in rows])

    def _one(self, function: Callable[..., Any], row: FloatArray) -> Evaluations:
        began = perf_counter()
        given: dict[str, Any] = parameters_of(self.table.fixed, self.targets, row)
        try:
            if self.table.vectorised:
                answer = _first(_called(function, {name: np.full(1, value) for name, value in given.items()}))
            else:
                answer = _called(function, given)
            return answered(answer, self._judge, perf_counter() - began)
        except ModelFailure as failure:
            return came_to_nothing(failure, self._judge, perf_counter() - began)

    def _together(self, function: Callable[..., Any], rows: FloatArray) -> Evaluations | None:
        """All points in one call; None where it did not give [n] numbers for every response."""
        began = perf_counter()
        n = len(rows)
        given = {name: np.full(n, value) for name, value in self.table.fixed}
        given |= {name: column.copy() for name, column in zip(self.targets, rows.T, strict=True)}
        try:
            answer = _called(function, given)
            values = _columns(answer, self.names, n)
        except ModelFailure:
            return None
        if values is None:
            return None
        from levelone.campaign.models.protocol import settled

        agreed, status = settled(values, np.zeros(values.shape, dtype=np.int64))
        seconds = np.full(n, (perf_counter() - began) / n)
        return Evaluations(agreed, status, self._judge.levels(agreed), seconds, ("",) * n)


def _called(function: Callable[..., Any], *arguments: Any) -> Any:
    """What the function returns; whatever it raises is a failure of this run, with the end of the traceback."""
    try:
        return function(*arguments)
    except ModelFailure:
        raise
    except (Exception, SystemExit):
        raise ModelFailure(Status.MODEL_FAILED, traceback.format_exc().strip()) from None


def _si(channel: Any, values: Any) -> FloatArray:
    try:
        return to_si(channel, values)
    except (TypeError, ValueError):
        raise ModelFailure(Status.MODEL_FAILED, f"channel {channel.name} holds something that is no number") from None


def _first(answer: Any) -> Any:
    """The answer of a vectorised function to one point, as numbers."""
    if not isinstance(answer, Mapping):
        return answer
    return {name: _only(name, value) for name, value in answer.items()}


def _only(name: str, value: Any) -> Any:
    if np.shape(value) != (1,):
        raise ModelFailure(Status.MODEL_FAILED, f"response {name} has shape {np.shape(value)} for one point, and (1,) is needed")
    return np.asanyarray(value)[0]  # a masked one stays masked


def _columns(answer: Any, names: Sequence[str], n: int) -> FloatArray | None:
    """[n, responses] of a vectorised answer; None where it is not that."""
    if not isinstance(answer, Mapping) or any(name not in answer or np.shape(answer[name]) != (n,) for name in names):
        return None
    try:
        return np.column_stack([real_numbers(answer[name]) for name in names])
    except (TypeError, ValueError):
        return None
