"""Whether trajectories were drawn at random, as a mean over them needs.

psuade_moat of Dakota 6.24 does not draw them so. Measured: the inputs that rest while one moves stand at the ends of their
ranges in 82 % of the steps with 3 inputs and in 62 % with 14, on four levels, where half would be right; with 3 inputs only 43 of
100 trajectories are different. It looks as if trajectories that lie far apart are favoured (as Campolongo et al., Environmental
Modelling and Software 22, 2007, 1509-1518, propose for a few chosen of many). What acts together with other inputs is then over-
or underrated, by more than any interval says: mu_star of Ishigami's first input is 12.1, and its mean over the grid 7.7.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from levelone.uncertainty import Design

#: standard errors by which the share may differ; all inputs that rest in a step are counted as one observation
SURE = 3.0


def doubt_of_trajectories(design: Design) -> str:
    """Why the trajectories of a Morris design are no random draw from its grid; empty where nothing speaks against them."""
    k = len(design.space)
    level = np.round(design.unit_points * (design.levels - 1)).astype(np.int64).reshape(design.base, k + 1, k)
    expected = 2.0 / design.levels
    share = _resting_at_ends(level, design.levels) if k > 1 else expected
    if abs(share - expected) <= SURE * np.sqrt(expected * (1.0 - expected) / (design.base * k)):
        return ""
    return (
        f"the trajectories are no random draw: inputs at rest stand at an end of their range in {share:.0%} of the steps in place "
        f"of {expected:.0%}, and means over them are not means over the ranges"
    )


def _resting_at_ends(level: NDArray[np.int64], levels: int) -> float:
    """Share of the inputs that do not move in a step which are at the lowest or highest level."""
    resting = np.diff(level, axis=1) == 0
    ends = (level[:, :-1] == 0) | (level[:, :-1] == levels - 1)
    return float(ends[resting].mean())
