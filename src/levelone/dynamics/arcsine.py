"""Arc sine without a call: three of them are in every evaluation of the airframe, and each call of the C library spills what the
compiler holds in registers.

For |x| up to 1/2, asin(x) = x P(x^2); beyond, asin(x) = pi/2 - 2 asin(sqrt((1 - |x|) / 2)), which comes back to the same range.
P is the interpolant of asin(sqrt z) / sqrt z at the Chebyshev nodes of [0, 1/4]; its nearest singularity, at z = 1, makes the error
fall by a factor of 14 with each degree.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from levelone.compiled import inlined

DEGREE = 14


def _ratio(z: np.ndarray) -> np.ndarray:
    s = np.sqrt(z)
    return np.where(z > 1e-12, np.arcsin(s) / np.where(z > 1e-12, s, 1.0), 1.0 + z / 6.0)


_SERIES = Chebyshev.interpolate(_ratio, DEGREE, domain=[0.0, 0.25]).convert(kind=Polynomial, domain=[-1.0, 1.0], window=[-1.0, 1.0])
C0, C1, C2, C3, C4, C5, C6, C7, C8, C9, C10, C11, C12, C13, C14 = (float(c) for c in _SERIES.coef)


@inlined
def arcsine(x):
    """asin(x) for x in [-1, 1], to 1e-14."""
    size = abs(x)
    far = size > 0.5
    z = 0.5 * (1.0 - size) if far else x * x
    # two interleaved chains (even and odd powers) halve the latency of Horner's rule
    zz = z * z
    even = C0 + zz * (C2 + zz * (C4 + zz * (C6 + zz * (C8 + zz * (C10 + zz * (C12 + zz * C14))))))
    odd = C1 + zz * (C3 + zz * (C5 + zz * (C7 + zz * (C9 + zz * (C11 + zz * C13)))))
    ratio = even + z * odd
    near_value = x * ratio
    far_value = math.copysign(0.5 * math.pi - 2.0 * math.sqrt(z) * ratio, x)
    return far_value if far else near_value
