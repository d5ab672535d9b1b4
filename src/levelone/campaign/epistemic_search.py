"""Search over the factors that are only known as intervals: on the surrogates, then at the extreme points on the model itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from levelone.campaign.epistemic_statistics import Readings, thresholds_over
from levelone.campaign.froude import judged
from levelone.campaign.models.builtin import BuiltinModel, IntArray
from levelone.config.study_file import Study
from levelone.errors import InputError
from levelone.uncertainty import FactorSpace, Kriging, Responses, latin_hypercube, stage_seed
from levelone.uncertainty.evidence import FocalBoxes, focal_boxes
from levelone.uncertainty.probability_box import BoxSearch, fewest_points, search_boxes, starting_points
from levelone.uncertainty.surrogates import predict_all
from levelone.vehicle.tables import FloatArray

#: runs that the corners of all boxes may cost on the surrogates; with more, only corners that the search comes to are visited
CORNER_RUNS = 2**18
#: rows predicted at once
ROWS = 2**14
#: aleatory points with which the range of a response is looked for
FEW = 8
#: how near to an extreme counts as reaching it when points are chosen to be flown: part of the spread of a mean over the box
NEAR = 0.02
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Nested:
    """Points of a study as an epistemic and an aleatory part.

    Attributes
    ----------
    epistemic, aleatory
        Columns of the study's factors.
    boxes
        Of the epistemic factors.
    inner
        [m, aleatory] one sample of the aleatory factors, the same at every epistemic point; one empty row where none varies.
    """

    epistemic: IntArray
    aleatory: IntArray
    boxes: FocalBoxes
    inner: FloatArray

    def points(self, outer: FloatArray, few: int | None = None) -> FloatArray:
        """Every epistemic point [n, e] with every aleatory one (or a ``few``), [n m, k], the aleatory ones varying fastest."""
        inner = self.inner if few is None else self.inner[:few]
        out = np.empty((len(outer) * len(inner), len(self.epistemic) + len(self.aleatory)))
        out[:, self.epistemic] = np.repeat(outer, len(inner), axis=0)
        out[:, self.aleatory] = np.tile(inner, (len(outer), 1))
        return out


@dataclass(frozen=True, eq=False)
class Found:
    """Bounds on the surrogates, and bounds on the model among the points that were flown.

    Attributes
    ----------
    readings
        Which statistic is which column.
    searched
        Every point, on the surrogates.
    chosen
        [c] which of these points were flown, in increasing order.
    flown
        These points, on the model.
    """

    readings: Readings
    searched: BoxSearch
    chosen: IntArray
    flown: BoxSearch


def nested_of(study: Study, seed: int) -> Nested:
    """The epistemic boxes of a study and the sample of what varies."""
    given = study.epistemic
    if given is None:
        raise InputError("epistemic", "the study has no such section")
    space = study.space
    epistemic = np.array([space.index(name) for name in given.factors])
    aleatory = np.setdiff1d(np.arange(len(space)), epistemic)
    inner = np.empty((1, 0))
    if aleatory.size:
        rank = None if space.correlation is None else np.array(space.correlation)[np.ix_(aleatory, aleatory)]
        varying = FactorSpace((space.factors[j] for j in aleatory), rank)
        inner = latin_hypercube(varying, given.inner, stage_seed(seed, "epistemic inner")).points
    boxes = focal_boxes([space.factors[j].distribution for j in epistemic])
    return Nested(epistemic, aleatory, boxes, inner)


def find(
    study: Study, model: BuiltinModel, nested: Nested, surrogates: Mapping[str, Kriging | None], seed: int, progress: Progress
) -> Found:
    """Search the boxes on the surrogates, and fly the extreme points.

    Parameters
    ----------
    study, model
        The study, with its section ``epistemic``, and the vehicle under its manoeuvres.
    nested
        From :func:`nested_of`.
    surrogates
        Of each of the model's responses, in its order and in the units of the factors; None where there is none to be trusted, and
        the response counts as undefined.
    seed
        Of the study.
    progress
        Called with the stage's name, what is done and what there is to do.
    """
    assert study.epistemic is not None
    boxes, runs = nested.boxes, len(nested.inner)
    corners = CORNER_RUNS // (runs * len(boxes))
    outer, seed = study.epistemic.outer, stage_seed(seed, "epistemic outer")
    models, names = tuple(surrogates.values()), tuple(surrogates)
    readings = Readings(names, _thresholds(models, nested, starting_points(boxes, outer, seed, corners), model.threads))

    def statistics(points: FloatArray) -> FloatArray:
        out = []
        for part in _parts(nested, points):
            values = _predicted(models, part, model.threads)
            levels, _ = judged(Responses.from_values(values, names), study.boundaries, study.task)
            out.append(readings.of(values.reshape(-1, runs, len(names)), levels))
            progress("epistemic, surrogates", sum(map(len, out)), len(points))
        return np.vstack(out)

    searched = search_boxes(statistics, boxes, outer, seed, corners=corners, targets=readings.targets)
    chosen = _to_be_flown(readings, searched, (1.0 + 1e-9) / runs)
    points = searched.points[chosen]
    flown = BoxSearch.of(
        boxes, points, searched.box[chosen], searched.origin[chosen], _fly(model, nested, readings, points, progress)
    )
    return Found(readings, searched, chosen, flown)


def _thresholds(models: Sequence[Kriging | None], nested: Nested, outer: FloatArray, workers: int | None) -> FloatArray:
    """Thresholds over the range that the surrogates have at the first points: a few runs at all of them, all runs where these lie
    furthest out."""
    few = np.vstack([_predicted(models, part, workers) for part in _parts(nested, outer, FEW)])
    means = few.reshape(len(outer), -1, len(models)).mean(axis=1)
    furthest = np.unique([means.argmin(axis=0), means.argmax(axis=0)])
    values = np.vstack([few, *(_predicted(models, part, workers) for part in _parts(nested, outer[furthest]))])
    known = ~np.isnan(values)
    return thresholds_over(np.where(known, values, np.inf).min(axis=0), np.where(known, values, -np.inf).max(axis=0))


def _parts(nested: Nested, outer: FloatArray, few: int | None = None) -> list[FloatArray]:
    """The points in parts of bounded memory, no epistemic point cut in two."""
    step = max(1, ROWS // len(nested.inner[:few]))
    return [nested.points(outer[i : i + step], few) for i in range(0, len(outer), step)]


def _predicted(models: Sequence[Kriging | None], points: FloatArray, workers: int | None) -> FloatArray:
    """Means of the surrogates, [n, r]; NaN where there is none."""
    out = np.full((len(points), len(models)), np.nan)
    there = [j for j, model in enumerate(models) if model is not None]
    out[:, there] = predict_all([model for model in models if model is not None], points, workers=workers)
    return out


def _to_be_flown(readings: Readings, searched: BoxSearch, one_run: float) -> IntArray:
    """Few points that come near the extremes of every mean and within a run of those of every share of Levels, in each box."""
    means, shares = readings.columns("mean"), readings.columns("levels").ravel()
    columns = np.concatenate([means, shares])
    ends = searched.ends[:, :, columns]
    within = np.where(np.isin(columns, means), NEAR * (ends[1] - ends[0]), one_run)
    off = np.abs(searched.values[:, columns] - ends[:, searched.box])
    near = (off <= within[searched.box]) & (searched.box == np.arange(len(searched.boxes))[:, None])[:, None, :, None]
    return np.sort(fewest_points(near.transpose(0, 1, 3, 2).reshape(-1, len(searched.points))))


def _fly(model: BuiltinModel, nested: Nested, readings: Readings, outer: FloatArray, progress: Progress) -> FloatArray:
    """The statistics of the points on the model itself."""
    points = nested.points(outer)
    assessed = model.assess(points, lambda done: progress("epistemic, flights", min(done, len(points)), len(points)))
    values = assessed.responses.values.reshape(len(outer), len(nested.inner), -1)
    return readings.of(values, assessed.levels)
