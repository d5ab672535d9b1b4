"""Models that answer responses themselves: their answers become values, statuses and Levels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from levelone.campaign.models.keys import plain
from levelone.campaign.models.mapping import real_numbers
from levelone.campaign.models.protocol import Evaluations, FloatArray, IntArray, ModelFailure, failed, settled
from levelone.campaign.models.sources import sources_digest
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import ResponseName
    from levelone.handling.levels import Boundaries

#: criterion -> names and units of the numbers that its Level is read from; the names say what they mean (a bandwidth of attitude)
JUDGED_BY: Mapping[str, tuple[tuple[str, str], ...]] = {
    "attitude_quickness": (("quickness", "1/s"), ("delta_theta_min", "rad")),
    "dynamic_stability": (("zeta", "1"), ("omega_n", "rad/s")),
    "bandwidth": (("omega_bw_attitude", "rad/s"), ("tau_p_attitude", "s")),
    "translational_rate": (("rise_time", "s"),),
}


def axis_of_limits(boundaries: Boundaries) -> str:
    """Axis of the boundaries of damping and bandwidth, which name none: that of the only chart of quickness, else pitch."""
    charts = tuple(boundaries.attitude_quickness)
    return charts[0] if len(charts) == 1 else "pitch"


@dataclass(frozen=True)
class Judge:
    """Levels of responses that a model answers itself, all of the pitch axis.

    Parameters
    ----------
    responses
        Names and units.
    boundaries, task
        Level boundaries, and the bandwidth chart.

    Notes
    -----
    A criterion is judged where all of its numbers are there under their plain names (``JUDGED_BY``) and units, and the boundaries
    are those of pitch.
    """

    responses: tuple[ResponseName, ...]
    boundaries: Boundaries
    task: str

    @property
    def judged(self) -> tuple[str, ...]:
        """Criteria that have a Level."""
        given = {(each.name, each.unit) for each in self.responses}
        found = (name for name, needed in JUDGED_BY.items() if given.issuperset(needed))
        return tuple(name for name in found if self._speaks_of(name))

    def _speaks_of(self, criterion: str) -> bool:
        """Whether the boundaries say anything of a criterion in pitch."""
        if criterion == "translational_rate":
            return criterion in self.boundaries.limits
        charts = self.boundaries.attitude_quickness
        return "pitch" in charts if criterion == "attitude_quickness" else axis_of_limits(self.boundaries) == "pitch"

    def levels(self, values: FloatArray) -> IntArray:
        """[n, criteria] Level codes of ``values`` [n, responses]; undefined where a number is NaN."""
        column = {each.name: values[:, j] for j, each in enumerate(self.responses)}
        found = [self._levels(name, *(column[key] for key, _ in JUDGED_BY[name])) for name in self.judged]
        return np.column_stack(found).astype(np.int64) if found else np.zeros((len(values), 0), dtype=np.int64)

    def _levels(self, criterion: str, *numbers: FloatArray) -> IntArray:
        if criterion == "attitude_quickness":
            return self.boundaries.chart("attitude_quickness", "pitch").levels(numbers[1], numbers[0])[0]
        if criterion == "bandwidth":
            return self.boundaries.chart("bandwidth", self.task).levels(numbers[1], numbers[0])[0]
        if criterion == "dynamic_stability":
            return self.boundaries.dynamic_stability.levels(numbers[1], numbers[0])
        from levelone.handling.translation import rise_time_levels

        return rise_time_levels(numbers[0], self.boundaries)


class Answering:
    """What models that answer responses themselves have in common, whatever answers: names, units, Levels."""

    table: Any
    boundaries: Boundaries
    task: str

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the responses."""
        return tuple(each.name for each in self.table.responses)

    @property
    def units(self) -> tuple[str, ...]:
        """Their units."""
        return tuple(each.unit for each in self.table.responses)

    @property
    def judged(self) -> tuple[str, ...]:
        """Criteria that have a Level."""
        return self._judge.judged

    @cached_property
    def _judge(self) -> Judge:
        return Judge(self.table.responses, self.boundaries, self.task)

    @property
    def key(self) -> Mapping[str, Any]:
        """As of what answers, with the boundaries of the Levels and the code that judges by them."""
        own: Mapping[str, Any] = super().key  # type: ignore[misc]  # of the class that answers, which comes next
        return {**own, "boundaries": plain(self.boundaries), "task": self.task, "sources": sources_digest()}


def answered(answer: Mapping[str, Any], judge: Judge, seconds: float) -> Evaluations:
    """One evaluation from a mapping of numbers; a response that it lacks is missing, one that is not finite says so.

    Raises
    ------
    ModelFailure
        An answer that is no mapping, or holds something that is no number.
    """
    if not isinstance(answer, Mapping):
        raise ModelFailure(
            Status.MODEL_FAILED, f"the answer is a {type(answer).__name__}, and a mapping from responses to numbers is needed"
        )
    names = [each.name for each in judge.responses]
    values = np.array([[number(name, answer[name]) if name in answer else math.nan for name in names]])
    status = np.array([[int(Status.OK if name in answer else Status.OUTPUT_MISSING) for name in names]], dtype=np.int64)
    agreed, codes = settled(values, status)
    missing = [name for name in names if name not in answer]
    message = f"the answer lacks {', '.join(missing)}; it holds {', '.join(map(str, answer)) or 'nothing'}" if missing else ""
    return Evaluations(agreed, codes, judge.levels(agreed), np.array([seconds]), (message,))


def number(name: str, value: Any) -> float:
    """A number as a model wrote it, a float or an array without length; ModelFailure where it is no real one."""
    if isinstance(value, str | bytes) or value is None or np.ndim(value):
        raise ModelFailure(Status.MODEL_FAILED, f"response {name} is {_shown(value)}, and a number is needed")
    try:
        return float(real_numbers(value))
    except (TypeError, ValueError):
        raise ModelFailure(Status.MODEL_FAILED, f"response {name} is {_shown(value)}, and a number is needed") from None


def came_to_nothing(failure: ModelFailure, judge: Judge, seconds: float) -> Evaluations:
    """One evaluation without any value."""
    return failed(failure.status, failure.message, len(judge.responses), len(judge.judged), seconds)


def parameters_of(fixed: Sequence[tuple[str, float]], targets: Sequence[str], point: FloatArray) -> dict[str, float]:
    """Parameters of one run by the model's names: fixed numbers first, then the factors."""
    return {**dict(fixed), **dict(zip(targets, point.tolist(), strict=True))}


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:80]}..."
