"""Runs of the built-in vehicle in a campaign's store: a study interrupted or analysed in another way flies only what is missing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from levelone._version import __version__
from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.models.builtin import CHUNK, CRITERIA, RESPONSES, Assessment, BuiltinModel
from levelone.campaign.models.keys import plain, value_digest, versions
from levelone.campaign.models.protocol import Evaluations, FloatArray
from levelone.campaign.models.sources import sources_digest
from levelone.campaign.store_schema import FILE_NAME
from levelone.config.study_file import Study
from levelone.dynamics.integrate import EXTREMES
from levelone.dynamics.simulate import chunks
from levelone.status import Status
from levelone.uncertainty import Responses

MANOEUVRES = ("attitude_quickness", "dynamic_stability")
#: a store holds numbers with a status each: the extremes of the manoeuvres stand behind the responses
KEPT = tuple(f"{manoeuvre} {extreme}" for manoeuvre in MANOEUVRES for extreme in EXTREMES)
UNITS = tuple(unit for unit, _ in RESPONSES.values())
JUDGED = (*CRITERIA, "extrapolated")


@dataclass(frozen=True)
class StoredBuiltin:
    """The built-in model of a study, whose runs are kept; assesses a sample as :class:`BuiltinModel` does, to the last bit."""

    model: BuiltinModel
    store: EvaluationStore

    def assess(self, points: FloatArray, progress: Callable[[int], None]) -> Assessment:
        """Responses, Levels and extremes at ``points`` [n, targets]; ``progress`` is called with the number of runs done."""
        held, _ = self.store.lookup(points)
        _, first = np.unique(points, axis=0, return_index=True)
        missing = np.sort(first[~held[first]])
        already = len(points) - len(missing)
        progress(already)
        for part in chunks(len(missing), CHUNK):
            rows = points[missing[part]]
            self.store.add(rows, packed(self.model.assess_batch(self.model.batch(rows))))
            progress(already + part.stop)
        return unpacked(self.store.lookup(points)[1])


def open_store(folder: Path, study: Study, model: BuiltinModel) -> AbstractContextManager[EvaluationStore]:
    """The store of a study of the built-in vehicle in its results folder."""
    names, units = (*RESPONSES, *KEPT), (*UNITS, *["SI"] * len(KEPT))
    factors = study.space.names
    return EvaluationStore.open(folder / FILE_NAME, _key(model), names, units, JUDGED, factors, study.hash, study_title=study.title)


def _key(model: BuiltinModel) -> Mapping[str, Any]:
    """All that decides a value; the factors' ranges do not, so that a wider study finds the runs of a narrower one."""
    return {
        "levelone": __version__,
        "sources": sources_digest(),
        "vehicle": value_digest(model.vehicle),
        "versions": versions("numba", "numpy", "scipy"),
        "targets": list(model.targets),
        "manoeuvres": [plain(model.step), plain(model.pulse)],
        "omega": value_digest(model.omega),
        "boundaries": value_digest(model.boundaries),
        "task": model.task,
        "start": model.start,
    }


def packed(assessed: Assessment) -> Evaluations:
    """An assessment as evaluations: an extreme of a run that did not fly is undefined as its responses are."""
    r = assessed.responses
    extremes = np.column_stack([assessed.extremes[m][x] for m in MANOEUVRES for x in EXTREMES])
    status = np.where(np.isfinite(extremes), int(Status.OK), int(Status.MODEL_FAILED))
    codes = [*(assessed.levels[name] for name in CRITERIA), assessed.extrapolated]
    n = len(r)
    return Evaluations(
        np.hstack([r.values, extremes]), np.hstack([r.status, status]), np.column_stack(codes), np.full(n, np.nan), ("",) * n
    )


def unpacked(found: Evaluations) -> Assessment:
    """The assessment that was packed."""
    count = len(RESPONSES)
    extremes = iter(found.values[:, count:].T)
    return Assessment(
        Responses(found.values[:, :count], found.status[:, :count], tuple(RESPONSES), UNITS),
        {name: found.levels[:, j] for j, name in enumerate(CRITERIA)},
        found.levels[:, len(CRITERIA)],
        {manoeuvre: {extreme: next(extremes) for extreme in EXTREMES} for manoeuvre in MANOEUVRES},
    )
