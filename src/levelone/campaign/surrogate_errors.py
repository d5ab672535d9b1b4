"""What the surrogates of a study add to the errors of its indices, and how far they can be believed."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign.sampling import Progress, Sampled, SampledStudy
from levelone.dynamics.simulate import threads_of
from levelone.uncertainty import (
    Kriging,
    SobolIndices,
    SurrogateIndices,
    Validation,
    sobol_design,
    sobol_on_surrogate,
    stage_seed,
    validate,
)
from levelone.uncertainty.distributions import FloatArray

Json = dict[str, Any]
STAGE = "errors of the surrogates"


@dataclass(frozen=True)
class SurrogateError:
    """Of one response: indices with intervals that hold the surrogate's error (None for correlated factors), and its validation."""

    indices: SurrogateIndices | None
    validation: Validation


def surrogate_errors(
    study: SampledStudy, sampled: Sampled, seed: int, threads: int | None, progress: Progress
) -> dict[str, SurrogateError]:
    """Validate each surrogate of the study, and find intervals that hold its error, the responses side by side in threads."""
    names = sampled.read.responses.names
    base = None if study.space.correlated else sobol_design(study.space, study.method.base_points, stage_seed(seed, "sobol"))
    done = 0

    def one(name: str, model: Kriging, found: SobolIndices | None) -> SurrogateError:
        nonlocal done
        x, y = _runs(sampled, name, model)
        own = stage_seed(seed, "errors of the surrogates")
        indices = None
        if base is not None and found is not None:
            indices = sobol_on_surrogate(x, y, model, base, own, coordinates="physical", sampled=found)
        done += 1
        progress(STAGE, done, len(names))
        return SurrogateError(indices, validate(x, y, model, own))

    progress(STAGE, 0, len(names))
    with ThreadPoolExecutor(threads_of(threads)) as pool:
        return dict(zip(names, pool.map(one, names, sampled.found.surrogates, sampled.found.indices), strict=True))


def _runs(sampled: Sampled, name: str, model: Kriging) -> tuple[FloatArray, FloatArray]:
    """Points and values that a surrogate was fitted to; none where the failures left an input that never varies."""
    y = sampled.read.responses.column(name)
    kept = np.isfinite(y) if len(model.loo_residual) else np.zeros(len(y), dtype=bool)
    return sampled.sample.points[kept], y[kept]


def validation_json(found: Validation) -> Json:
    """What the report says of a surrogate's validation."""
    return {
        "q2_folds": found.q2_folds, "q2_holdout": found.q2_holdout, "coverage_95": found.coverage_95, "spread": found.spread,
        "verdict": found.verdict or "nothing speaks against it", "status": found.status.text,
    }  # fmt: skip


def with_errors(block: Json, found: SurrogateError) -> Json:
    """The block of a response with the wider intervals; those of sampling alone stay beside them under another name."""
    sobol = {factor: dict(row) for factor, row in block["sobol"].items()}
    if found.indices is not None:
        for j, name in enumerate(found.indices.names):
            for index in ("S1", "ST"):
                row, ci = sobol[name], getattr(found.indices, f"{index}_ci")
                if np.isfinite(row[index]):
                    row |= {f"{index}_ci_sampling": row[f"{index}_ci"], f"{index}_ci": ci[j].tolist()}
    kind = "none: no indices" if found.indices is None else found.indices.error_kind
    told = {"validation": validation_json(found.validation), "error_kind": kind}
    return block | {"sobol": sobol, "surrogate": block["surrogate"] | told}


def residual_dataset(sampled: Sampled) -> xr.Dataset:
    """[response, run] values and leave-one-out residuals with their standard deviations; NaN where a run failed."""
    r = sampled.read.responses
    residual, std = np.full((2, len(r.names), len(r)), np.nan)
    for j, (name, model) in enumerate(zip(r.names, sampled.found.surrogates, strict=True)):
        kept = np.isfinite(r.column(name))
        if len(model.loo_residual) == kept.sum():
            residual[j, kept], std[j, kept] = model.loo_residual, model.loo_std
    dims = ("response", "run")
    return xr.Dataset(
        {"value": (dims, r.values.T), "loo_residual": (dims, residual), "loo_std": (dims, std)}, {"response": list(r.names)}
    )
