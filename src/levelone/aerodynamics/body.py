"""The bound vortices of a rigid body, made ready for time steps: everything that is constant in the frame of the geometry.

Where geometry, motion and wind are symmetric in y = 0 only the first half of the strips is solved for, and its image acts as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from levelone.aerodynamics import loads
from levelone.aerodynamics.kernels import influence, influence_vectors
from levelone.aerodynamics.lattice import FloatArray, IntArray, Lattice, rings, spacing_of
from levelone.aerodynamics.wake_panels import Edges, shed_nodes

#: groups of panels along the chord that act on a free wake, at most
GROUPS = 2
MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Body:
    """A lattice of which p panels in s strips are solved for: all of them, or the first half."""

    lattice: Lattice
    symmetric: bool
    carrier: loads.Carriers
    edges: Edges
    shed: FloatArray  # [nodes, 3] shed line in the frame of the geometry, m
    points: FloatArray  # [2 p, 3] collocation points, then bound vortices, m
    normal: FloatArray  # [p, 3]
    factors: tuple[FloatArray, NDArray[np.int32]]  # of the matrix of normal velocities
    vectors: FloatArray  # [3, p, p] velocity at bound vortices by rings of unit circulation, 1/m
    rings: FloatArray  # [p, 4, 3] corners, m
    lines: FloatArray  # [g, nodes, 3] mean bound vortices of g groups of panels along the chord, m
    closing: IntArray  # [g, s] last panel of each group

    @property
    def panels(self) -> int:
        """Panels solved for."""
        return len(self.normal)

    @property
    def strips(self) -> int:
        """Strips solved for."""
        return len(self.edges.left)

    def circulation(self, wind: FloatArray) -> FloatArray:
        """Circulations [p] that let no wind [p, 3] relative to the collocation points through."""
        return np.asarray(lu_solve(self.factors, -np.einsum("pa,pa->p", wind, self.normal), check_finite=False))

    def at_edge(self, gamma: FloatArray) -> FloatArray:
        """Circulation [s] of the last ring of each strip."""
        return np.asarray(gamma[self.lattice.trailing[: self.strips]])

    def whole(self, half: FloatArray, vector: bool = False) -> FloatArray:
        """Values of all panels or strips from those solved for; ``vector``: [..., 3] vectors, which are mirrored."""
        if not self.symmetric:
            return half
        return np.concatenate([half, half * MIRROR if vector else half])


def prepare(lattice: Lattice, step: float, symmetric: bool) -> Body:
    """A body whose wake moves by ``step`` metres a time step; ``symmetric``: solve for one half of a mirrored lattice."""
    h = spacing_of(lattice, step)
    half = symmetric and lattice.mirrored
    p, s = (len(lattice.bound) // 2, len(lattice.first) // 2) if half else (len(lattice.bound), len(lattice.first))
    found, shed = shed_nodes(lattice, h, s, half)
    corners = rings(lattice, h)[:p]
    ends = found.ends(shed)
    corners[lattice.trailing[:s], 3], corners[lattice.trailing[:s], 2] = ends[:, 0], ends[:, 1]
    images = (corners * MIRROR)[:, [1, 0, 3, 2]]
    loaded = np.ascontiguousarray(lattice.midpoint[:p])
    matrix = influence(lattice.collocation[:p], lattice.normal[:p], corners)
    vectors = influence_vectors(loaded, corners)
    if half:
        matrix += influence(lattice.collocation[:p], lattice.normal[:p], images)
        vectors += influence_vectors(loaded, images)
    points = np.concatenate([lattice.collocation[:p], loaded])
    factors = lu_factor(matrix, check_finite=False)
    return Body(
        lattice, half, loads.carriers(lattice, h), found, shed, points, lattice.normal[:p], factors, vectors, corners,
        *_grouped(lattice, found),
    )  # fmt: skip


def _grouped(lattice: Lattice, found: Edges) -> tuple[FloatArray, IntArray]:
    """Lines and last panels of groups along the chord: as a wake, which is at least a core away, sees the bound vortices."""
    strips = len(found.left)
    groups = min(GROUPS, int(lattice.count[:strips].min()))
    parts = [
        np.array_split(np.arange(first, first + count), groups) for first, count in zip(lattice.first, lattice.count, strict=True)
    ]
    ends = np.array([[lattice.bound[part].mean(axis=0) for part in strip] for strip in parts[:strips]])
    closing = np.array([[part[-1] for part in strip] for strip in parts[:strips]])
    return np.stack([found.joined(ends[:, g]) for g in range(groups)]), np.ascontiguousarray(closing.T)
