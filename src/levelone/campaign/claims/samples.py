"""Parts of rules about a Monte Carlo sample."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.claims.decision import Condition, Undecided
from levelone.campaign.claims.evidence import Evidence
from levelone.handling.levels import Level
from levelone.vehicle.tables import FloatArray


def percentiles(values: FloatArray) -> tuple[float, float, float]:
    """5th, 50th and 95th percentile of defined values [run]."""
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95)).tolist()
    return low, middle, high


def largest(values: FloatArray, share: float) -> NDArray[np.bool_]:
    """[run] whether a value is among the largest ``share``, rounded up to whole runs; undefined ones are not."""
    known = values[np.isfinite(values)]
    count = math.ceil(share * known.size - 1e-9)
    with np.errstate(invalid="ignore"):
        return values >= np.sort(known)[-count]


def every_sample_at_level_1(evidence: Evidence, criterion: str) -> tuple[Condition, int]:
    """Whether every run is Level 1, and how many are worse. One run below decides, whatever the undefined ones would be."""
    codes = evidence.level(criterion)
    worse = int((codes > Level.LEVEL_1).sum())
    unknown = int((codes < Level.LEVEL_1).sum())
    if unknown and not worse:
        raise Undecided(f"{unknown} of {codes.size} runs have no Level of {criterion}, all others are Level 1")
    return Condition(not worse, worse / codes.size), worse


def every_sample_at_most(evidence: Evidence, response: str, limit: float) -> tuple[Condition, float]:
    """Whether every run lies at or below a limit, and the largest value seen. One run above decides."""
    values = evidence.sample(response)
    top = float(np.nanmax(values))
    unknown = int(np.isnan(values).sum())
    if unknown and top <= limit:
        raise Undecided(f"{response} is undefined in {unknown} of {values.size} runs, all others are within the limit")
    return Condition(top <= limit, max(top / limit - 1.0, 0.0)), top
