"""A model that keeps its promise: what it raises, or answers in the wrong shape, becomes a failed evaluation."""

from __future__ import annotations

import time
import traceback
from dataclasses import replace

import numpy as np

from levelone.campaign.models.protocol import Evaluations, FloatArray, Model, ModelFailure, failed, joined
from levelone.errors import LeveloneError
from levelone.status import Status


class Guard:
    """One model, evaluated so that no exception of its own leaves a batch.

    Parameters
    ----------
    model
        Any model.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.responses, self.levels = len(model.names), len(model.judged)

    def evaluate(self, points: FloatArray) -> Evaluations:
        """Answers at ``points`` [n, factors]; where the batch fails as a whole, its points are evaluated one by one.

        Raises
        ------
        LeveloneError
            A mistake of the user, which would fail every evaluation.
        """
        began = time.perf_counter()
        try:
            return self._checked(self.model.evaluate(points), len(points))
        except ModelFailure as failure:
            lost = failure.status, failure.message
        except LeveloneError:
            raise
        except (Exception, SystemExit):
            lost = Status.MODEL_FAILED, traceback.format_exc()
        if len(points) > 1:
            return joined(with_histories([self.evaluate(point[None, :]) for point in points]))
        return failed(*lost, self.responses, self.levels, time.perf_counter() - began)

    def _checked(self, answer: Evaluations, n: int) -> Evaluations:
        shapes = (answer.values.shape, answer.status.shape, answer.levels.shape, answer.seconds.shape, len(answer.messages))
        due = ((n, self.responses), (n, self.responses), (n, self.levels), (n,), n)
        if shapes != due or len(answer.histories) not in (0, n):
            raise ModelFailure(Status.MODEL_FAILED, f"the model answered with arrays of shapes {shapes} in place of {due}")
        return answer


def none_of(responses: int, levels: int) -> Evaluations:
    """No evaluation at all, of a model with so many responses and criteria judged."""
    empty, codes = np.empty((0, responses)), np.empty((0, responses), dtype=np.int64)
    return Evaluations(empty, codes, np.empty((0, levels), dtype=np.int64), np.empty(0), ())


def with_histories(parts: list[Evaluations]) -> list[Evaluations]:
    """The same parts, where a failed evaluation without histories stands beside others that have them: with empty ones."""
    if not any(part.histories for part in parts):
        return parts
    return [part if part.histories else replace(part, histories=({},) * len(part)) for part in parts]
