"""Vortex segments as particles: what panels become downstream, and how bound vortices and panels act on a free wake.

A segment of circulation Gamma from a to b has the strength Gamma (b - a) at its middle: total strength and linear impulse
(1/2 sum x cross G) are those of the segment, exactly, however many equal parts it is cut into.
"""

from __future__ import annotations

import math

import numpy as np

from levelone.aerodynamics.lattice import FloatArray, IntArray
from levelone.aerodynamics.wake_panels import Panels

#: a segment is cut into parts no longer than this many cores where it acts on a wake
PART = 2.0


def blobs(start: FloatArray, end: FloatArray, circulation: FloatArray, core: float, parts: IntArray) -> FloatArray:
    """Sources [7, k] (position, strength, core) from segments [e, 3] to [e, 3], each cut into ``parts`` [e]."""
    segment = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(segment)) - np.repeat(np.cumsum(parts) - parts, parts) + 0.5) / parts[segment]
    along = end - start
    out = np.empty((7, len(segment)))
    out[:3] = (start[segment] + share[:, None] * along[segment]).T
    out[3:6] = (along * (circulation / parts)[:, None])[segment].T
    out[6] = core
    return out


def parts_of(length: FloatArray, longest: float) -> IntArray:
    """Number of parts of segments of given lengths, none of them longer than ``longest``."""
    return np.maximum(np.ceil(length / longest * (1.0 - 1e-12)), 1.0).astype(np.int64)


def of_panels(panels: Panels, core: float) -> FloatArray:
    """Sources of all segments of wake panels."""
    across, along = panels.net()
    at, ends, nodes = panels.edges.across, panels.edges.trailing, panels.nodes
    start = np.concatenate([nodes[:, at].reshape(-1, 3), nodes[:-1, ends].reshape(-1, 3)])
    end = np.concatenate([nodes[:, at + 1].reshape(-1, 3), nodes[1:, ends].reshape(-1, 3)])
    parts = parts_of(np.linalg.norm(end - start, axis=1), PART * core)
    return blobs(start, end, np.concatenate([across[:, at].ravel(), along[:, ends].ravel()]), core, parts)


def released(panels: Panels, core: float, spacing: float) -> tuple[Panels, FloatArray, FloatArray]:
    """Panels without their last row, and the sources [7, k] that it becomes, along a segment no further apart than ``spacing`` (m).

    The front side of the row stays with the panels (``Panels.beyond``), since the next row shares it. The first sources are the aft
    side of the row less the front side of the row behind it; the last value [j, 3] is what their strengths change by when the row
    behind is cut off, so that the wake ends with closed rings.
    """
    across, along = panels.net()
    at, ends, (front, aft) = panels.edges.across, panels.edges.trailing, panels.nodes[-2:]
    start, end = np.concatenate([aft[at], front[ends]]), np.concatenate([aft[at + 1], aft[ends]])
    parts = parts_of(np.linalg.norm(end - start, axis=1), spacing if math.isfinite(spacing) else 1e30)
    sources = blobs(start, end, np.concatenate([across[-1, at], along[-1, ends]]), core, parts)
    behind = -panels.edges.laid(panels.beyond[None])[0, at]
    closing = blobs(aft[at], aft[at + 1], behind, core, parts[: len(at)])[3:6].T
    left = Panels(panels.edges, panels.nodes[:-1], panels.circulation[:-1], panels.circulation[-1])
    return left, sources, closing
