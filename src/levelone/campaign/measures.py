"""Further measures of sensitivity on the Monte Carlo sample and its surrogates, which check the Sobol indices or stand in for them.

First-order indices straight from the runs need no surrogate; the dependence of response and factor is seen whatever its shape;
Shapley effects share the whole variance out and keep their meaning where factors are correlated; polynomial chaos is a second
surrogate of another kind.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from levelone.campaign.sampling import Progress, Sampled
from levelone.dynamics.simulate import threads_of
from levelone.uncertainty import Design, FactorSpace, Kriging, stage_seed
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.given_data import given_data
from levelone.uncertainty.hsic import dependence
from levelone.uncertainty.pce import PolynomialChaos
from levelone.uncertainty.shapley import shapley, shapley_design

Json = dict[str, Any]
#: points of each scrambling of the design of Shapley effects; eight of them
SHAPLEY_POINTS = 256
STAGE = "further measures"


def measures_section(sampled: Sampled, seed: int, threads: int | None, progress: Progress) -> Json:
    """For results.json, by response: ``given_data``, ``dependence``, ``shapley`` and ``chaos``, each with a ``status`` in words.

    Failed runs are left out and counted (``failed``): the measures are checks, and the bounds of the study's policy stand with its
    Sobol indices.
    """
    names = sampled.read.responses.names
    paths = shapley_design(sampled.sample.space, SHAPLEY_POINTS, stage_seed(seed, "shapley"))
    done = 0

    def one(job: tuple[str, Kriging]) -> Json:
        nonlocal done
        found = _measured(sampled.sample, paths, sampled.read.responses.column(job[0]), job[1], stage_seed(seed, "measures"))
        done += 1
        progress(STAGE, done, len(names))
        return found

    progress(STAGE, 0, len(names))
    with ThreadPoolExecutor(threads_of(threads)) as pool:
        return dict(zip(names, pool.map(one, zip(names, sampled.found.surrogates, strict=True)), strict=True))


def _measured(sample: Design, paths: Design, y: FloatArray, surrogate: Kriging, seed: int) -> Json:
    stands = np.isfinite(y)
    data = given_data(sample.points, y, sample.names, policy="drop")
    seen = dependence(sample.points, y, sample.names, seed, policy="drop")
    effects = shapley(paths, surrogate.predict_mean(paths.points), policy="drop")
    return {
        "failed": int((~stands).sum()),
        "given_data": {"status": data.status.text, "rows": _rows(sample.space, S1=data.S1, S1_ci=data.S1_ci)},
        "dependence": {"status": seen.status.text, "rows": _rows(sample.space, R2=seen.R2, p_value=seen.p_value)},
        "shapley": {"status": effects.status.text, "rows": _rows(sample.space, Sh=effects.Sh, Sh_ci=effects.Sh_ci)},
        "chaos": _chaos(sample, stands, y, seed),
    }


def _chaos(sample: Design, stands: Any, y: FloatArray, seed: int) -> Json:
    """Polynomial chaos, or why there is none; its indices are those of independent factors."""
    nan = np.full(len(sample.names), np.nan)
    if sample.space.correlated:
        status = "refused: the indices of an expansion in independent polynomials have no meaning for correlated factors"
        return {"status": status, "q2": np.nan, "terms": 0, "rows": _rows(sample.space, S1=nan, ST=nan)}
    kept = sample.unit_points[stands]
    if len(kept) < 2 or (np.ptp(kept, axis=0) == 0.0).any():
        return {"status": "too few runs without failure", "q2": np.nan, "terms": 0, "rows": _rows(sample.space, S1=nan, ST=nan)}
    found = PolynomialChaos.fit(kept, y[stands], seed)
    rows = _rows(sample.space, S1=found.S1, ST=found.ST, S1_ci=found.S1_ci, ST_ci=found.ST_ci)
    return {"status": found.status.text, "q2": found.q2, "terms": len(found.terms), "rows": rows}


def _rows(space: FactorSpace, **columns: FloatArray) -> Json:
    return {name: {key: values[j].tolist() for key, values in columns.items()} for j, name in enumerate(space.names)}
