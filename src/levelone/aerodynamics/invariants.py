"""What a free vorticity field keeps: total strength, linear and angular impulse.

Saffman, Vortex Dynamics, 1992, chapter 3, for point vortices of strength G at x and unit density:

    total strength  sum G,   linear impulse  1/2 sum x x G,   angular impulse  1/3 sum x x (x x G).

The total strength of closed vortex lines is zero, and only then is the impulse independent of the origin. The angular impulse is
that of the points; a term in sum s^2 G that their cores add is left out: it is zero where the cores of a closed line are equal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from levelone.aerodynamics.particle_kernels import FloatArray


@dataclass(frozen=True)
class Invariants:
    """Total strength (m^3/s), linear impulse (m^4/s) and angular impulse about the origin (m^5/s), each [3], for unit density."""

    strength: FloatArray
    impulse: FloatArray
    angular: FloatArray


def invariants(position: FloatArray, strength: FloatArray) -> Invariants:
    """Sums over vortices of strength [n, 3] (m^3/s) at positions [n, 3] (m), in one fixed order."""
    moment = np.cross(position, strength)
    return Invariants(strength.sum(axis=0), 0.5 * moment.sum(axis=0), np.cross(position, moment).sum(axis=0) / 3.0)
