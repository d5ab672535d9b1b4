"""Policies for failed runs, and what an estimate can say about itself.

A failed run is NaN. An index computed from an incomplete design is another index, so the choice is the user's:

- ``refuse``: an error that names the first failed runs;
- ``drop``: leave out the whole block that holds the run (a Morris trajectory, a base point of a Sobol design) and
  count it;
- ``bound``: as ``drop``, and two more estimates with the failed runs set to the lowest and to the highest value that
  was seen, since failures gather in a corner of the factor box and leaving them out can delete the corner that
  matters.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.errors import InputError, unknown_name
from levelone.uncertainty.distributions import FloatArray

Policy = Literal["refuse", "drop", "bound"]


class EstimateStatus(IntEnum):
    """Whether an estimate is defined; ``text`` says why not."""

    OK = 0
    CONSTANT_RESPONSE = 1
    TOO_FEW_RUNS = 2
    TOO_FEW_SCRAMBLINGS = 3

    @property
    def text(self) -> str:
        """The outcome in words."""
        return _TEXT[self]


_TEXT = {
    EstimateStatus.OK: "ok",
    EstimateStatus.CONSTANT_RESPONSE: "the response does not vary over the design: it has no variance to share out",
    EstimateStatus.TOO_FEW_RUNS: "too few runs without failure are left for an estimate",
    EstimateStatus.TOO_FEW_SCRAMBLINGS: "runs without failure differ in fewer than four scramblings: no honest interval",
}


def as_values(values: ArrayLike, runs: int) -> FloatArray:
    """One response as a float array [runs], whatever is not finite as NaN; InputError on another length."""
    array = np.array(values, dtype=np.float64)
    if array.shape != (runs,):
        raise InputError("values", f"shape {array.shape}; the design has {runs} runs, and one value for each is needed")
    array[~np.isfinite(array)] = np.nan
    return array


def check_policy(policy: str, values: FloatArray) -> None:
    """Refuse an unknown policy, and failed values under "refuse"."""
    if policy not in get_args(Policy):
        raise unknown_name("policy", policy, get_args(Policy))
    failed = np.flatnonzero(np.isnan(values))
    if policy == "refuse" and failed.size:
        rows = ", ".join(str(row) for row in failed[:5]) + (", ..." if failed.size > 5 else "")
        raise InputError(
            "values",
            f"{failed.size} of {values.size} runs failed (rows {rows}) and the policy is 'refuse'; "
            "repair the runs or declare 'drop' or 'bound'",
        )


def complete_blocks(values: FloatArray, size: int) -> NDArray[np.bool_]:
    """Which blocks of ``size`` consecutive runs hold no failure, [n / size]."""
    return np.logical_not(np.isnan(values.reshape(-1, size)).any(axis=1))


def bounding_values(values: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Copies of a response with its failed runs at the lowest and at the highest value seen; NaN where none was."""
    array = np.asarray(values, dtype=np.float64)
    finite = array[np.isfinite(array)]
    if not finite.size:
        return np.full(array.shape, np.nan), np.full(array.shape, np.nan)
    bad = ~np.isfinite(array)
    return np.where(bad, finite.min(), array), np.where(bad, finite.max(), array)


def is_constant(values: FloatArray) -> bool:
    """Whether the finite values differ by no more than rounding."""
    finite = values[np.isfinite(values)]
    return bool(finite.size and np.ptp(finite) <= 64.0 * np.finfo(np.float64).eps * np.abs(finite).max())
