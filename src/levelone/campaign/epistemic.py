"""Epistemic against aleatory: bounds on distributions and on shares of Levels over the factors that are only known as intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from levelone.campaign.analysis import LEVEL_KEYS, Json
from levelone.campaign.epistemic_search import Found, Nested, find, nested_of
from levelone.campaign.models.builtin import CRITERIA, RESPONSES, Assessment, BuiltinModel
from levelone.config.study_file import Study
from levelone.handling.levels import Level
from levelone.uncertainty import Kriging
from levelone.uncertainty.evidence import FocalBoxes
from levelone.uncertainty.probability_box import BoxSearch, Origin, ProbabilityBox
from levelone.vehicle.tables import FloatArray

QUANTILES = {"p05": 0.05, "p50": 0.5, "p95": 0.95}
ORIGINS = {Origin.CORNER: "corner", Origin.LATIN_HYPERCUBE: "latin hypercube", Origin.REFINEMENT: "refinement"}
Progress = Callable[[str, int, int], None]


def epistemic_section(
    study: Study,
    model: BuiltinModel,
    assessed: Assessment,
    surrogates: Mapping[str, Kriging],
    seed: int,
    progress: Progress = lambda stage, done, total: None,
) -> Json:
    """Probability boxes of the responses, and lower and upper shares of Levels.

    Parameters
    ----------
    study
        With its section ``epistemic``.
    model
        Of the study.
    assessed
        The Monte Carlo sample: the plain treatment, each epistemic factor uniform on its intervals.
    surrogates
        Of each of the model's responses, in the units of the factors.
    seed
        Of the study; the section takes its own seeds from it.
    progress
        Called with the stage's name, what is done and what there is to do.

    Returns
    -------
    dict
        For results.json; its keys are in docs/reference/results.md.

    Raises
    ------
    InputError
        The study has no such section.
    """
    names = assessed.responses.names
    refused = {name for name in names if study.policy == "refuse" and assessed.responses.failed(name).any()}
    nested = nested_of(study, seed)
    found = find(study, model, nested, {n: None if n in refused else surrogates[n] for n in names}, seed, progress)
    responses = {
        name: _response(found, j, assessed.responses.column(name)) | _surrogate(found, j, surrogates[name], name in refused)
        for j, name in enumerate(names)
    }
    return _setting(study, nested, found) | {"responses": responses, "levels": _levels(found, assessed)}


def _setting(study: Study, nested: Nested, found: Found) -> Json:
    """What is epistemic, what was searched and which points were flown."""
    assert study.epistemic is not None
    searched, names = found.searched, study.epistemic.factors
    return {
        "factors": list(names),
        "aleatory": [study.space.names[j] for j in nested.aleatory],
        "basis": study.epistemic.basis,
        "outer": study.epistemic.outer,
        "inner": len(nested.inner),
        "boxes": _boxes(nested.boxes, names),
        "points": {text: int((searched.origin == code).sum()) for code, text in ORIGINS.items()},
        "extremes_by": {text: _share_found(searched, code) for code, text in ORIGINS.items()},
        "flown": [_flown_point(found, i, names) for i in range(len(found.chosen))],
        "flown_runs": len(found.chosen) * len(nested.inner),
    }


def _boxes(boxes: FocalBoxes, names: tuple[str, ...]) -> list[Json]:
    return [
        {"mass": float(boxes.mass[b]), "low": _by_name(names, boxes.low[b]), "high": _by_name(names, boxes.high[b])}
        for b in range(len(boxes))
    ]


def _by_name(names: tuple[str, ...], values: FloatArray) -> dict[str, float]:
    return dict(zip(names, values.tolist(), strict=True))


def _share_found(searched: BoxSearch, code: Origin) -> float:
    """Share of the bounds that lie at points of one origin, of statistics that move at all; NaN where none does.

    A bound that several points have counts for the first of them, corners before the others.
    """
    moves = searched.ends[0] < searched.ends[1]
    index = np.concatenate([searched.lowest[moves], searched.highest[moves]])
    return float((searched.origin[index] == code).mean()) if len(index) else float("nan")


def _flown_point(found: Found, i: int, names: tuple[str, ...]) -> Json:
    """A point that was flown, and the greatest shares of its runs by which model and surrogates differ there."""
    flown, readings = found.flown, found.readings
    off = np.abs(flown.values[i] - found.searched.values[found.chosen[i]])
    return {
        "box": int(flown.box[i]),
        "origin": ORIGINS[Origin(int(flown.origin[i]))],
        "values": _by_name(names, flown.points[i]),
        "failed": float(flown.values[i, readings.columns("failed")].max()),
        "level_difference": float(off[readings.columns("levels")].max()),
    }


def _response(found: Found, j: int, sample: FloatArray) -> dict[str, Any]:
    """Bounds of one response; ``sample`` [runs] are its Monte Carlo values."""
    readings, searched, flown = found.readings, found.searched, found.flown
    name = readings.names[j]
    cut, cut_failed = readings.columns("below")[j], readings.columns("below_or_failed")[j]
    cuts, known = readings.thresholds[j], np.sort(sample[np.isfinite(sample)])
    mean, failed = readings.columns("mean")[j], readings.columns("failed")[j]
    least, most = readings.columns("min")[j], readings.columns("max")[j]
    with np.errstate(invalid="ignore"):
        plain = searched.plain[cut] / (1.0 - searched.plain[failed])  # of the runs that have a value
    box = ProbabilityBox(cuts, searched.lower[cut], searched.upper[cut_failed], plain)
    below = np.searchsorted(known, cuts, side="right") / len(known) if len(known) else np.full(len(cuts), np.nan)
    return {
        "unit": RESPONSES[name][0],
        "thresholds": cuts, "lower": box.lower, "upper": box.upper, "plain": box.plain, "sample": below,
        "lower_flown": flown.lower[cut], "upper_flown": flown.upper[cut_failed],
        "mean": _bounds(searched, mean), "mean_flown": _bounds(flown, mean), "mean_plain": float(searched.plain[mean]),
        "range": _range(searched, least, most), "range_flown": _range(flown, least, most),
        "quantiles": {key: list(box.quantile(share)) for key, share in QUANTILES.items()},
        "failed_flown": _bounds(flown, failed),
        "difference": _difference(found, cut),
    }  # fmt: skip


def _surrogate(found: Found, j: int, model: Kriging, refused: bool) -> dict[str, Any]:
    """How far the surrogate can be relied on."""
    why = "refused: runs failed and the study's policy is 'refuse'" if refused else model.status.text
    return {"q2": np.nan if refused else model.q2, "status": why}


def _bounds(search: BoxSearch, column: int) -> list[float]:
    return [float(search.lower[column]), float(search.upper[column])]


def _range(search: BoxSearch, least: int, most: int) -> list[float]:
    """Smallest and largest value that any run of any box gave; NaN where none has a value."""
    low, high = search.ends[0, :, least], search.ends[1, :, most]
    known = np.isfinite(low)
    return [float(low[known].min()), float(high[known].max())] if known.any() else [np.nan, np.nan]


def _difference(found: Found, cut: Any) -> float:
    """Largest difference of the distribution functions of surrogate and model over the flown points and the thresholds."""
    return float(np.abs(found.flown.values[:, cut] - found.searched.values[found.chosen][:, cut]).max())


def _levels(found: Found, assessed: Assessment) -> Json:
    """Lower and upper shares of each criterion's Levels on surrogates and model, and the plain ones of both."""
    columns = found.readings.columns("levels")
    codes = list(LEVEL_KEYS)
    return {
        criterion: {LEVEL_KEYS[code]: _share(found, columns[i, q], assessed, criterion, code) for q, code in enumerate(codes)}
        for i, criterion in enumerate(CRITERIA)
    }


def _share(found: Found, column: int, assessed: Assessment, criterion: str, code: Level) -> dict[str, float]:
    return {
        "lower": float(found.searched.lower[column]), "upper": float(found.searched.upper[column]),
        "lower_flown": float(found.flown.lower[column]), "upper_flown": float(found.flown.upper[column]),
        "plain": float(found.searched.plain[column]), "sample": float((assessed.levels[criterion] == code).mean()),
    }  # fmt: skip
