"""Tapers of spectral windows, periodic as spectra want them (Harris, Proc. IEEE 66 (1), 1978; Nuttall 1981, minimum of four terms).

SciPy's are the same to the last digits; its ``signal`` alone takes a quarter of the time in which a page of recorded data is made.
"""

from __future__ import annotations

import numpy as np

from levelone.handling.history import FloatArray

_COSINES = {
    "boxcar": (1.0,),
    "hann": (0.5, 0.5),
    "hamming": (0.54, 0.46),
    "blackman": (0.42, 0.5, 0.08),
    "nuttall": (0.3635819, 0.4891775, 0.1365995, 0.0106411),
}
TAPERS = (*_COSINES, "cosine")


def taper_of(name: str, count: int) -> FloatArray:
    """``[count]`` samples of a taper, one of :data:`TAPERS`."""
    if name == "cosine":
        return np.sin(np.pi * (np.arange(count) + 0.5) / (count + 1))
    turn = 2.0 * np.pi * np.arange(count) / count
    terms = [(-1.0) ** k * weight * np.cos(k * turn) for k, weight in enumerate(_COSINES[name])]
    return np.asarray(np.sum(terms, axis=0), dtype=np.float64)
