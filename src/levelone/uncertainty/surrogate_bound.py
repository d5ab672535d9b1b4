"""How far an index of a response can lie from that of its surrogate, whatever the surrogate's error looks like.

Let f be the response, g the surrogate, e = f - g, and d the norm of e over that of g, norms being standard deviations over the
factors. The parts of a function whose variances S1 and ST compare with that of the whole are projections of it: E(f | x_j), and f
less E(f | all but x_j). The norm of a projection of f differs from that of g by no more than the norm of e (triangle inequality),
and so does the norm of the whole. Hence

    (max(sqrt(S) - d, 0) / (1 + d))^2  <=  S of f  <=  ((sqrt(S) + d) / (1 - d))^2,    S of g, d < 1.

The bound asks for nothing but d; it is wide unless the surrogate is very good, since it lets all of the error stand on one factor.
"""

from __future__ import annotations

import numpy as np

from levelone.uncertainty.distributions import FloatArray

SAFETY = 2.0
"""Factor on d = sqrt(1 - Q2) by leave-one-out, assumed: d is an estimate from as many residuals as there are runs, and few of them
may carry most of it."""

WHOLE = 1.0
"""d from which nothing is known."""


def worst_case(S: FloatArray, q2: float) -> FloatArray:
    """Lowest and highest index of the response.

    Parameters
    ----------
    S
        [...] indices of the surrogate, S1 or ST; an estimate below zero counts as zero.
    q2
        Leave-one-out Q2 of the surrogate.

    Returns
    -------
    [..., 2]; 0 and infinity where the surrogate is too poor for any bound.
    """
    d = SAFETY * float(np.sqrt(max(1.0 - q2, 0.0)))
    if not d < WHOLE:
        return np.stack([np.zeros_like(S), np.full_like(S, np.inf)], axis=-1)
    root = np.sqrt(np.maximum(S, 0.0))
    return np.stack([(np.maximum(root - d, 0.0) / (1.0 + d)) ** 2, ((root + d) / (1.0 - d)) ** 2], axis=-1)
