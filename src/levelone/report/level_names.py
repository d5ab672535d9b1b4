"""Names of the Levels written into the planes of ADS-33, where they stand clear of boundaries and data."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from levelone.handling.levels import Chart, DampingLimits
from levelone.report import regions

FloatArray = NDArray[np.float64]


def name_layers(panel: Axes, chart: Chart, clouds: Sequence[FloatArray]) -> None:
    """Levels above each other, as of attitude quickness: near the right end of the requirement's range."""
    top = panel.get_ylim()[1]
    first, second = (float(limit) / top for limit in chart.limits(0.8 * chart.high))
    regions.name_level(panel, 1, [(0.85, 0.93), (0.85, 0.5 * (1.0 + first))], clouds)
    regions.name_level(panel, 2, [(0.85, 0.5 * (first + second))], clouds)
    regions.name_level(panel, 3, [(0.85, 0.5 * second)], clouds)


def name_sectors(panel: Axes, limits: DampingLimits, clouds: Sequence[FloatArray]) -> None:
    """Levels beside each other, as of a pole: left of the ray of least damping, between it and the axis, right of the axis."""
    span, top = panel.get_xlim()[1] - panel.get_xlim()[0], panel.get_ylim()[1]
    axis, slope = -panel.get_xlim()[0] / span, limits.zeta_1 / math.sqrt(1.0 - limits.zeta_1**2) * top / span
    beyond = axis + limits.growth / span
    low, high = axis - 0.2 * slope, axis - 0.93 * slope
    regions.name_level(panel, 1, [(0.5 * low, 0.2), (0.5 * max(high, 0.0), 0.93)], clouds)
    regions.name_level(panel, 2, [(0.5 * (axis + max(high, 0.0)), 0.93)], clouds)
    regions.name_level(panel, 3, [(0.5 * (beyond + 1.0), 0.93), (0.5 * (beyond + 1.0), 0.1)], clouds)
