"""What a campaign asks of a model, and what a model answers.

A model is a frozen description that can be pickled: names of files, mappings, options. What it opens (an FMU, a simulation, a
function) is opened in the process that evaluates, when it is first needed, and does not travel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from levelone.errors import LeveloneError
from levelone.status import CAUTIONS, Status

if TYPE_CHECKING:
    from levelone.handling.frequency import FrequencyResponse
    from levelone.handling.history import TimeHistory
    from levelone.handling.manoeuvres import Manoeuvre
    from levelone.uncertainty import Responses

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: characters of a message that are kept, from its end
TAIL = 2000
#: of :class:`levelone.handling.levels.Level`: the metric has no value
NO_LEVEL = -1
STANDS = (int(Status.OK), *(int(code) for code in CAUTIONS))


@dataclass(frozen=True, eq=False)
class Evaluations:
    """What a model answered at n points.

    Parameters
    ----------
    values
        [n, m] responses, SI and rad; NaN where the status is a failure, and only there.
    status
        [n, m], codes of :class:`levelone.status.Status`.
    levels
        [n, c], codes of :class:`levelone.handling.levels.Level`, one column for each criterion that was judged.
    seconds
        [n] wall time of each evaluation; NaN where it is not known.
    messages
        n texts: the end of what a failed evaluation had to say, empty for the others.
    histories
        n mappings from the name of a test to its record, or empty where none are kept.
    """

    values: FloatArray
    status: IntArray
    levels: IntArray
    seconds: FloatArray
    messages: tuple[str, ...]
    histories: tuple[Mapping[str, TimeHistory], ...] = field(default=())

    def __len__(self) -> int:
        return len(self.values)

    def select(self, index: Any) -> Evaluations:
        """Some of the evaluations, by an index array or slice."""
        chosen = np.arange(len(self))[index]
        return Evaluations(
            self.values[chosen],
            self.status[chosen],
            self.levels[chosen],
            self.seconds[chosen],
            tuple(self.messages[i] for i in chosen),
            tuple(self.histories[i] for i in chosen) if self.histories else (),
        )

    def responses(self, names: Sequence[str], units: Sequence[str]) -> Responses:
        """Values and statuses under their names, for the analysis."""
        from levelone.uncertainty import Responses

        return Responses(self.values, self.status, tuple(names), tuple(units))


def joined(parts: Sequence[Evaluations]) -> Evaluations:
    """Evaluations one after the other."""
    return Evaluations(
        np.concatenate([p.values for p in parts]),
        np.concatenate([p.status for p in parts]),
        np.concatenate([p.levels for p in parts]),
        np.concatenate([p.seconds for p in parts]),
        tuple(text for p in parts for text in p.messages),
        tuple(each for p in parts for each in p.histories) if all(len(p.histories) == len(p) for p in parts) else (),
    )


def failed(status: Status, message: str, responses: int, levels: int, seconds: float = np.nan) -> Evaluations:
    """One evaluation without any value: every response has the status, and the end of the message is kept."""
    return Evaluations(
        np.full((1, responses), np.nan),
        np.full((1, responses), int(status), dtype=np.int64),
        np.full((1, levels), NO_LEVEL, dtype=np.int64),
        np.array([seconds]),
        (message[-TAIL:],),
    )


def settled(values: FloatArray, status: IntArray) -> tuple[FloatArray, IntArray]:
    """Values and statuses that agree: NaN wherever the status is a failure, and a status wherever a value is not finite."""
    stands = np.isin(status, STANDS)
    unexplained = stands & ~np.isfinite(values)
    codes = np.where(unexplained, np.int64(Status.OUTPUT_NOT_FINITE), status)
    return np.where(stands & ~unexplained, values, np.nan), codes


class ModelFailure(LeveloneError):
    """One evaluation that came to nothing: data for the campaign, not an error of its user.

    Parameters
    ----------
    status
        What happened.
    message
        What the model had to say; only the end of it is kept.
    """

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(f"{status.text}: {message[-TAIL:]}")
        self.status = status
        self.message = message[-TAIL:]

    def __reduce__(self) -> tuple[Any, ...]:
        return ModelFailure, (self.status, self.message)


class Model(Protocol):
    """Anything that maps points of a factor space to responses."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the m responses."""

    @property
    def units(self) -> tuple[str, ...]:
        """Their units, SI and rad."""

    @property
    def judged(self) -> tuple[str, ...]:
        """Names of the c criteria that are judged by Levels."""

    @property
    def key(self) -> Mapping[str, Any]:
        """Everything that decides a value, as plain JSON: options, mappings, and hashes in place of files."""

    def evaluate(self, points: FloatArray) -> Evaluations:
        """Answers at ``points`` [n, factors]; what fails is NaN with a status, never an exception."""


class HistorySource(Protocol):
    """A flight simulation that can be flown: the part of a model that is not levelone's."""

    @property
    def key(self) -> Mapping[str, Any]:
        """As of :class:`Model`."""

    def fly(self, point: FloatArray, manoeuvre: Manoeuvre) -> TimeHistory:
        """One run at ``point`` [factors] under a manoeuvre, with the channels that are mapped, SI and rad, signs of levelone.

        Raises
        ------
        ModelFailure
            The run came to nothing.
        """


class LinearSource(HistorySource, Protocol):
    """A source that also has an exact frequency response."""

    def frequency_response(self, point: FloatArray, command: str, output: str, omega: FloatArray) -> FrequencyResponse:
        """Response [frequency] of a channel to a command at ``omega`` rad/s; raises ModelFailure."""
