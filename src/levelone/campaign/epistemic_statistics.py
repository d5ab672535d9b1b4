"""What is read from the runs at one point of the epistemic box: numbers of each response, and shares of each criterion's Levels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from levelone.campaign.analysis import LEVEL_KEYS
from levelone.campaign.models.builtin import CRITERIA, IntArray
from levelone.uncertainty.probability_box import cumulative_shares
from levelone.vehicle.tables import FloatArray

#: thresholds of each response
THRESHOLDS = 61
#: of the range met at first, how much is added on both sides
BEYOND = 0.05
#: every so manieth threshold takes part in the refinement of the search
REFINED = 10


@dataclass(frozen=True, eq=False)
class Readings:
    """Layout of the statistics: [r] of each number of a response, [r, z] of each threshold, [c, 5] of each share of Levels.

    Attributes
    ----------
    names
        The r responses.
    thresholds
        [r, z] increasing values of each response.
    """

    names: tuple[str, ...]
    thresholds: FloatArray

    @property
    def _sizes(self) -> dict[str, tuple[int, ...]]:
        r, z = self.thresholds.shape
        one, cut = (r,), (r, z)
        return {
            "mean": one, "min": one, "max": one, "failed": one, "below": cut, "below_or_failed": cut,
            "levels": (len(CRITERIA), len(LEVEL_KEYS)),
        }  # fmt: skip

    def columns(self, kind: str) -> IntArray:
        """Columns of one kind of statistic, in its shape."""
        first = 0
        for name, shape in self._sizes.items():
            size = int(np.prod(shape))
            if name == kind:
                return np.arange(first, first + size).reshape(shape)
            first += size
        raise KeyError(kind)

    @property
    def targets(self) -> IntArray:
        """Columns whose extremes the search refines."""
        cuts = [self.columns(kind)[:, ::REFINED].ravel() for kind in ("below", "below_or_failed")]
        return np.concatenate([*(self.columns(kind).ravel() for kind in ("mean", "min", "max", "levels")), *cuts])

    def of(self, values: FloatArray, levels: Mapping[str, IntArray]) -> FloatArray:
        """The statistics [n, t] of m runs at each of n points.

        Parameters
        ----------
        values
            [n, m, r], NaN where a run failed.
        levels
            [n * m] of each of ``CRITERIA``.
        """
        n, m, _ = values.shape
        lost = np.isnan(values)
        empty = lost.all(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.where(lost, 0.0, values).sum(axis=1) / (m - lost.sum(axis=1))
        low = np.where(empty, np.nan, np.where(lost, np.inf, values).min(axis=1))
        high = np.where(empty, np.nan, np.where(lost, -np.inf, values).max(axis=1))
        cuts = [cumulative_shares(values[:, :, j], self.thresholds[j]) for j in range(len(self.names))]
        below, or_failed = (np.stack([each[side] for each in cuts], axis=1).reshape(n, -1) for side in (0, 1))
        shares = [(levels[name].reshape(n, m) == code).mean(axis=1) for name in CRITERIA for code in LEVEL_KEYS]
        return np.hstack([mean, low, high, lost.mean(axis=1), below, or_failed, np.column_stack(shares)])


def thresholds_over(low: FloatArray, high: FloatArray) -> FloatArray:
    """Thresholds [r, z] over a range of each response [r], a little beyond it; over 0 to 1 where there is none."""
    known = np.isfinite(low) & np.isfinite(high)
    low, high = np.where(known, low, 0.0), np.where(known, high, 1.0)
    margin = np.where(high > low, BEYOND * (high - low), np.maximum(np.abs(high), 1.0) * BEYOND)
    return np.linspace(low - margin, high + margin, THRESHOLDS, axis=1)
