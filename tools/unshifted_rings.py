"""A vortex lattice with the discretisation errors of an ordinary unsteady code, to tell how large they are.

Rings lie on the edges of the panels and not a quarter of a panel behind them, the boundary condition is met in the middle of the
panel, the load acts there too, and the growth of circulation is a backward difference over a time step. The wake is a flat row of
panels, one a time step; the first carries the circulation of the trailing edge and is shorter. So do the vortex-lattice elements of
DUST (their source is public), but for particles in place of most of the wake panels, which add another 0.9 to 1.3 in lift.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from levelone.aerodynamics.geometry import FloatArray, Geometry, Surface
from levelone.aerodynamics.kernels import influence

STEP = 0.25  # of the reference chord, what the wake moves in a time step
FIRST = 0.3  # of a step, length of the first wake panel
ROWS = 96


@dataclass(frozen=True)
class Grid:
    """Rings [n, 4, 3], strip by strip from leading to trailing edge, of one rectangular surface at no incidence."""

    rings: FloatArray
    chordwise: int

    @property
    def middles(self) -> FloatArray:
        return np.asarray(self.rings.mean(axis=1))

    @property
    def widths(self) -> FloatArray:
        return np.asarray(self.rings[:, 1, 1] - self.rings[:, 0, 1])

    @property
    def lengths(self) -> FloatArray:
        return np.asarray(self.rings[:, 3, 0] - self.rings[:, 0, 0])


def rectangle(surface: Surface) -> Grid:
    """Uniform panels of a rectangular surface that lies in a plane z = constant; ``strips`` on one side."""
    x = surface.position[0] + surface.root_chord * (np.linspace(0.0, 1.0, surface.chordwise + 1) - 0.25)
    y = np.linspace(-surface.span, surface.span, 2 * surface.strips + 1)
    return Grid(_panels(x, y), surface.chordwise)


def _panels(x: FloatArray, y: FloatArray) -> FloatArray:
    corners = [
        [(x[i], y[j], 0.0), (x[i], y[j + 1], 0.0), (x[i + 1], y[j + 1], 0.0), (x[i + 1], y[j], 0.0)]
        for j in range(len(y) - 1)
        for i in range(len(x) - 1)
    ]
    return np.array(corners)


def pitch(geometry: Geometry, k: float) -> FloatArray:
    """C_L and C_m [2] in quadrature over k, for pitch about the origin, of the one surface of a geometry."""
    (surface,) = geometry.surfaces
    grid = rectangle(surface)
    kappa, step = 2.0 * k / geometry.chord, STEP * geometry.chord
    x = grid.middles[:, 0]
    gamma = np.linalg.solve(_matrix(grid, kappa, step), -(1.0 + 1j * kappa * x))
    net = gamma.copy()
    net[1:] -= gamma[:-1]
    net[:: grid.chordwise] = gamma[:: grid.chordwise]
    growth = (1.0 - np.exp(-1j * kappa * step)) / step * gamma
    lift = 2.0 * grid.widths * (net + grid.lengths * growth) / geometry.area
    return np.array([lift.sum().imag, -(lift * x).sum().imag / geometry.chord]) / k


def _matrix(grid: Grid, kappa: float, step: float) -> np.ndarray:
    normals = np.tile([0.0, 0.0, 1.0], (len(grid.rings), 1))
    matrix = influence(grid.middles, normals, grid.rings).astype(complex)
    lag = np.exp(-1j * kappa * step * np.arange(ROWS))
    for last in range(grid.chordwise - 1, len(grid.rings), grid.chordwise):
        edge = grid.rings[last, 2:]
        x = edge[0, 0] + step * np.concatenate([[0.0], FIRST + np.arange(ROWS)])
        matrix[:, last] += influence(grid.middles, normals, _panels(x, edge[::-1, 1])) @ lag
    return matrix
