"""From assessed samples to indices, statistics and shares, as plain dictionaries that JSON can hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.models.builtin import Assessment
from levelone.handling.levels import Level
from levelone.status import Status
from levelone.uncertainty import (
    Design,
    FactorSpace,
    Kriging,
    MorrisIndices,
    SobolIndices,
    bounding_values,
    failure_corner,
    fit_all,
    morris,
    predict_all,
    rank_agreement,
    shares,
    sobol,
    summarize,
)
from levelone.uncertainty.propagation import QUANTILES
from levelone.vehicle.tables import FloatArray

Json = dict[str, Any]
LEVEL_KEYS = {
    Level.LEVEL_1: "level_1",
    Level.LEVEL_2: "level_2",
    Level.LEVEL_3: "level_3",
    Level.OUTSIDE: "outside",
    Level.UNDEFINED: "failed",
}


#: why a study of correlated factors has neither Morris nor Sobol indices
CORRELATED = (
    "refused: the factors are correlated, so that shares of first and total order no longer add up and none can be moved alone; "
    "Shapley effects and first-order indices of the runs stand in their place"
)


@dataclass(frozen=True)
class Decomposition:
    """Surrogates of every response and the Sobol indices found on them; ``bounded`` holds those with failures filled in."""

    surrogates: tuple[Kriging, ...]
    indices: tuple[SobolIndices | None, ...]
    bounded: Mapping[str, tuple[SobolIndices, SobolIndices]]


def screen(design: Design, assessed: Assessment, policy: str, bootstrap: int) -> dict[str, MorrisIndices | None]:
    """Morris indices of each response; None where the policy refuses failed runs."""
    return {name: screen_one(design, assessed.responses.column(name), policy, bootstrap) for name in assessed.responses.names}


def screen_one(design: Design, values: FloatArray, policy: str, bootstrap: int) -> MorrisIndices | None:
    """Morris indices of one response [runs]; None where the policy refuses failed runs."""
    refused = policy == "refuse" and bool(np.isnan(values).any())
    return None if refused else morris(design, values, bootstrap=bootstrap, policy=policy)  # type: ignore[arg-type]


def decompose(
    sample: Design,
    assessed: Assessment,
    base: Design | None,
    policy: str,
    seed: int,
    bootstrap: int,
    options: Mapping[str, Any],
    workers: int | None,
    progress: Callable[[str, int, int], None],
) -> Decomposition:
    """Kriging of each response on the sample, and Sobol indices of each surrogate on the pick-freeze design ``base``.

    Correlated factors have no such design: surrogates only, None for every index.
    """
    names, values = assessed.responses.names, assessed.responses.values
    columns, owners = [values], list(names)
    if policy == "bound" and base is not None:
        for name in names:
            y = assessed.responses.column(name)
            if np.isnan(y).any() and np.isfinite(y).any():
                columns.append(np.column_stack(bounding_values(y)))
                owners += [name, name]
    y = np.column_stack(columns)
    total, done = y.shape[1], [0]

    def fitted() -> None:
        done[0] += 1
        progress("surrogates", done[0], total)

    models = fit_all(sample.points, y, seed, workers=workers, policy="drop", progress=fitted, **options)
    if base is None:
        return Decomposition(models, (None,) * total, {})
    indices = []
    for i, predicted in enumerate(predict_all(models, base.points, workers=workers).T):
        indices.append(sobol(base, predicted, bootstrap=bootstrap, policy="drop"))
        progress("decomposition", i + 1, total)
    n = len(names)
    bounded = {owners[i]: (indices[i], indices[i + 1]) for i in range(n, total, 2)}
    return Decomposition(models[:n], tuple(indices[:n]), bounded)


def statistics(values: FloatArray) -> Json:
    """Monte Carlo statistics of one response."""
    s = summarize(values)
    at = dict(zip(QUANTILES, s.quantiles.tolist(), strict=True))
    return {
        "n": s.n, "failed": s.failed, "mean": s.mean, "std": s.std, "min": s.min, "max": s.max,
        "p05": at[0.05], "p50": at[0.5], "p95": at[0.95],
    }  # fmt: skip


def outcomes(assessed: Assessment, name: str) -> tuple[Json, Json]:
    """Counts of failures and of cautions of one response, in words."""
    return in_words(assessed.responses.counts(name))


def in_words(counts: Mapping[Status, int]) -> tuple[Json, Json]:
    """Counts of statuses as words: of failures, and of cautions."""
    failures = {s.text: c for s, c in counts.items() if s.failed}
    cautions = {s.text: c for s, c in counts.items() if not s.failed and s is not Status.OK}
    return failures, cautions


def corner(design: Design, assessed: Assessment, name: str) -> list[Json]:
    """Where in the factor box a response failed; empty where it never did."""
    failed = assessed.responses.failed(name)
    if not failed.any():
        return []
    found = failure_corner(design.unit_points, failed, design.names)
    rows = zip(found.names, found.mean_failed.tolist(), found.mean_all.tolist(), found.p_value.tolist(), strict=True)
    return [{"factor": f, "mean_failed": a, "mean_all": b, "p_value": p} for f, a, b, p in rows]


def morris_json(space: FactorSpace, found: MorrisIndices | None) -> Json:
    """Morris indices by factor; NaN where the policy refused to give any."""
    nan = float("nan")
    if found is None:
        none = {"mu": nan, "mu_star": nan, "sigma": nan, "distance": nan, "mu_star_ci": [nan, nan], "sigma_ci": [nan, nan]}
        return {name: dict(none) for name in space.names}
    return {
        name: {
            "mu": float(found.mu[j]), "mu_star": float(found.mu_star[j]),
            "sigma": float(found.sigma[j]), "distance": float(found.distance[j]),
            "mu_star_ci": found.mu_star_ci[j].tolist(), "sigma_ci": found.sigma_ci[j].tolist(),
        }
        for j, name in enumerate(space.names)
    }  # fmt: skip


def sobol_json(space: FactorSpace, found: SobolIndices | None, intervals: bool = True) -> Json:
    """Sobol indices by factor; NaN where correlated factors have none."""
    out: Json = {}
    if found is None:
        nan = float("nan")
        return {
            name: {"S1": nan, "ST": nan} | ({"S1_ci": [nan, nan], "ST_ci": [nan, nan]} if intervals else {}) for name in space.names
        }
    for j, name in enumerate(space.names):
        out[name] = {"S1": float(found.S1[j]), "ST": float(found.ST[j])}
        if intervals:
            out[name] |= {"S1_ci": found.S1_ci[j].tolist(), "ST_ci": found.ST_ci[j].tolist()}
    return out


def surrogate_json(space: FactorSpace, model: Kriging) -> Json:
    """What the report says of a surrogate."""
    return {
        "q2": model.q2, "kernel": model.correlation, "trend": model.trend, "nugget": float(model.nugget),
        "length_scales": dict(zip(space.names, np.asarray(model.lengths, dtype=float).tolist(), strict=True)),
        "status": model.status.text,
    }  # fmt: skip


def agreement(screened: MorrisIndices | None, found: SobolIndices | None) -> float:
    """Rank correlation of mu_star with ST; NaN where either is missing."""
    return float("nan") if screened is None or found is None else rank_agreement(screened.mu_star, found.ST)


def level_shares(assessed: Assessment) -> Json:
    """Share of samples at each Level, outside the requirement's range and failed, for each criterion and for the worst of them."""
    names = list(LEVEL_KEYS.values())
    out: Json = {criterion: shares_json(codes) for criterion, codes in assessed.levels.items()}
    if assessed.extrapolated is None:
        return out
    beyond = shares([LEVEL_KEYS[Level(int(code))] for code in assessed.extrapolated], names)
    kept: Sequence[str] = names[:3]
    out["attitude_quickness"]["extrapolated"] = {k: float(v) for k, v in zip(names, beyond.share, strict=True) if k in kept}
    return out


def shares_json(codes: NDArray[np.int64]) -> Json:
    """Shares of one criterion's Levels, with the interval of Level 1."""
    names = list(LEVEL_KEYS.values())
    found = shares([LEVEL_KEYS[Level(int(code))] for code in codes], names)
    return {"n": found.n} | dict(zip(names, found.share.tolist(), strict=True)) | {"level_1_ci": found.ci[0].tolist()}
