"""Forces on a lattice by the unsteady law of Kutta and Joukowski.

Each vortex segment on the surface carries rho v x Gamma l at its middle, each ring rho dGamma/dt S along its normal: the bound
vortices where they lie, so that a flat plate has no false moment. The ring behind the last bound vortex carries load only as
far as the point where the continuous wake begins (see wake_start): beyond it the sheet moves with the stream and is free of
load. The rule is exact for the acceleration of a flat plate and of second order otherwise. Source: Katz and Plotkin, section
12.5 and 13.12; end of the load: own.

The forces are linear in the velocity and in the circulation, each by itself: linear and nonlinear solutions use the same functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelone.aerodynamics.lattice import FloatArray, Lattice, shed_line, starts

Array = NDArray[Any]  # of float64 or complex128


@dataclass(frozen=True)
class Carriers:
    """What carries load, in the frame of the lattice: bound segments [n], side segments [n, 2] and loaded rings [n]."""

    bound: FloatArray  # [n, 3] m, from left to right
    side: FloatArray  # [n, 2, 3] m, right side aft, left side forward
    side_middle: FloatArray  # [n, 2, 3] m
    ring: FloatArray  # [n, 3] m^2, area along the normal
    ring_middle: FloatArray  # [n, 3] m


def carriers(lattice: Lattice, h: FloatArray) -> Carriers:
    """Segments and rings that carry load; ``h`` [m] distance of wake vortices in lengths of each strip's last panel."""
    aft = np.empty_like(lattice.bound)
    aft[:-1] = lattice.bound[1:]
    aft[lattice.trailing] = shed_line(lattice, starts(h))
    left, right = aft[:, 0] - lattice.bound[:, 0], aft[:, 1] - lattice.bound[:, 1]
    middle = np.stack([0.5 * (aft[:, 1] + lattice.bound[:, 1]), 0.5 * (aft[:, 0] + lattice.bound[:, 0])], axis=1)
    along = lattice.bound[:, 1] - lattice.bound[:, 0]
    area = np.cross(0.5 * (left + right), 0.5 * (along + aft[:, 1] - aft[:, 0]))
    return Carriers(along, np.stack([right, -left], axis=1), middle, area, 0.5 * middle.sum(axis=1))


def net(lattice: Lattice, gamma: Array) -> Array:
    """Circulation of each bound segment [n]: its ring's less that of the ring ahead, whose aft side it is."""
    out = gamma.copy()
    out[1:] -= gamma[:-1]
    out[lattice.first] = gamma[lattice.first]
    return out


def bound_forces(carrier: Carriers, wind: Array, circulation: Array) -> Array:
    """Forces [n, 3] over density on the bound segments; ``wind`` [n, 3] relative to them, net ``circulation`` [n]."""
    return np.asarray(np.cross(wind, carrier.bound) * circulation[:, None])


def side_forces(carrier: Carriers, wind: Array, gamma: Array) -> Array:
    """Forces [n, 2, 3] over density on the side segments; ``wind`` [n, 2, 3], ``gamma`` [n] of the rings."""
    return np.asarray(np.cross(wind, carrier.side) * gamma[:, None, None])


def rate_forces(carrier: Carriers, gamma_rate: Array) -> Array:
    """Forces [n, 3] over density of the growing circulation ``gamma_rate`` [n] of the rings, m^2/s^2."""
    return np.asarray(carrier.ring * gamma_rate[:, None])


def total(points: FloatArray, forces: Array, about: FloatArray) -> tuple[Array, Array]:
    """Sum of forces [..., 3] and of their moments about a point [3]."""
    flat, at = forces.reshape(-1, 3), points.reshape(-1, 3) - about
    return flat.sum(axis=0), np.cross(at, flat).sum(axis=0)
