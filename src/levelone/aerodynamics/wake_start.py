"""Where the wake of an unsteady vortex lattice has to begin.

A lattice lumps the vortex sheet of each panel at its quarter line and meets the boundary condition at three quarters. The sheet
of an unsteady aerofoil does not end at the trailing edge: it goes on into the wake with the same strength. Where the modelled
wake begins decides whether the collocation points next to the edge see a gap or an overlap, and an error there feeds the
homogeneous solution that the Kutta condition excludes: the lift in quadrature is then wrong by a term of order n^(-1/2) in the
chordwise panels.

Near the edge, lengths in panels: vortices at -(j + 3/4), collocation at -(i + 1/4), wake vortices at x_s + (m + 1/2) h, each
for the sheet of length h around it. A sheet of constant strength induces, at collocation point i, the difference

    r_i = psi((i + b)/h + 1/2) + ln h - psi(i + 1/2),    b = x_s + 1/4

(psi the digamma function; ln(i + b) in place of the first two terms for a continuous wake, h = 0), which should vanish. The lattice
matrix 1/(j - i + 1/2) is annihilated from the left by a_i = Gamma(i + 1/2)/(Gamma(i + 1) sqrt(pi)), since
sum_i a_i/(i + s) = B(s, 1/2) vanishes at s = -(j + 1/2). The homogeneous solution is not excited where sum_i a_i r_i = 0: that
fixes x_s. For h = 1 wake and bound vortices form one uniform row, r_i = 0 for every i, and x_s = -1/4.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.special import digamma, poch, zeta

from levelone.errors import InputError

_TERMS = 400


@lru_cache(maxsize=256)
def wake_start(h: float) -> float:
    """Beginning of the continuous wake behind the trailing edge, in lengths of the last panel (negative: ahead of the edge).

    Parameters
    ----------
    h
        Distance of wake vortices, V dt, in lengths of the last panel; 0 for a continuous wake. The first of them lies at
        ``wake_start(h) + h/2``.

    Raises
    ------
    InputError
        If ``h`` is negative or not finite.

    Notes
    -----
    Own derivation, see the module; -0.12783 for a continuous wake, -1/4 for h = 1.
    """
    if not (np.isfinite(h) and h >= 0.0):
        raise InputError("h", f"{h} is no distance of wake vortices: zero or a positive number of panels")
    if h == 1.0:
        return -0.25
    return float(brentq(lambda b: _excitation(b, h), -0.5 * h + 1e-3 if h > 0.0 else 1e-4, 3.0, xtol=1e-14)) - 0.25


def _excitation(b: float, h: float) -> float:
    """Weighted sum of the differences; its tail from their expansion in 1/i."""
    i = np.arange(_TERMS)
    weight = poch(i + 1.0, -0.5) / np.sqrt(np.pi)
    sheet = digamma((i + b) / h + 0.5) + np.log(h) if h > 0.0 else np.log(i + b)
    head = np.sum(weight * (sheet - digamma(i + 0.5)))
    second = -0.5 * b**2 + (h**2 - 1.0) / 24.0 - b / 8.0
    return float(head + (b * zeta(1.5, _TERMS) + second * zeta(2.5, _TERMS)) / np.sqrt(np.pi))
