"""Chordwise and spanwise stations of a lattice.

Cosine strips are cut at equal steps of the angle theta of y = b/2 cos(theta) and collocated at the middle angle, not at the
middle of the strip: the trailing vortices then integrate the square-root ends of the span load exactly, and the lift of an
elliptic wing is exact with any number of strips (Multhopp's and Lan's quadrature; Lan, J. Aircraft 11 (9), 1974).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def chordwise(count: int, spacing: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Panel edges [n+1], vortex stations [n] and collocation stations [n] as shares of the chord from the leading edge."""
    at = np.linspace(0.0, 1.0, count + 1)
    edges = at if spacing == "uniform" else 0.5 * (1.0 - np.cos(np.pi * at))
    length = np.diff(edges)
    return edges, edges[:-1] + 0.25 * length, edges[:-1] + 0.75 * length


def spanwise(breaks: FloatArray, counts: tuple[int, ...], spacing: str, symmetric: bool) -> tuple[FloatArray, FloatArray]:
    """Strip edges [m+1] and collocation stations [m] between the breaks of a surface (shares of its span, 0 to 1).

    Each interval between two breaks has its own strips. ``symmetric``: the first interval begins in a plane of symmetry, so
    that its strips crowd at its outer end only.
    """
    edges, stations = [np.array([breaks[0]])], []
    for i, count in enumerate(counts):
        half = symmetric and i == 0
        width = breaks[i + 1] - breaks[i]
        edges.append(breaks[i] + width * _share(np.arange(1, count + 1) / count, spacing, half))
        stations.append(breaks[i] + width * _share((np.arange(count) + 0.5) / count, spacing, half))
    return np.concatenate(edges), np.concatenate(stations)


def _share(at: FloatArray, spacing: str, half: bool) -> FloatArray:
    if spacing == "uniform":
        return at
    share = np.sin(0.5 * np.pi * at) if half else 0.5 * (1.0 - np.cos(np.pi * at))
    return np.where(at == 1.0, 1.0, share)
