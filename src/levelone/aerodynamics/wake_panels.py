"""The wake next to the trailing edges: rows of vortex rings on a grid of nodes.

Neighbouring strips share the nodes between them. The nodes of a row form one line: strip after strip, with a gap (a strip that
never carries circulation) wherever two strips do not touch. Ring r of a strip spans from node row r to r + 1; row 0 is the shed
line. The circulation of a ring is that of its strip at the time step when the ring was shed, and stays so (Kelvin, Helmholtz; Katz
and Plotkin, section 13.12).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from levelone.aerodynamics.lattice import FloatArray, IntArray, Lattice, shed_line, starts
from levelone.aerodynamics.particle_kernels import in_blocks
from levelone.aerodynamics.wake_kernels import grid_velocities

#: points closer than this share of the mean strip width are one node
_SAME = 1e-6
#: rows behind an edge whose segments are as thin as those of the lattice, at most; then they thicken over as many rows
SHARP_ROWS = 8
#: core of the rows further behind that pass another surface, in distances of rows: with thinner ones the surface feels each
#: vortex for itself (an error of 2 exp(-2 pi core) of the sheet's strength)
SPREAD = 1.0
#: points of one piece of work; pairs of points and nodes below which starting threads takes longer than the sum
BLOCK, FEW = 16, 100_000


@dataclass(frozen=True)
class Edges:
    """How strips share nodes: ``left`` [m] the node at the left end of each strip (the right one follows), of ``nodes`` in all.

    ``trailing`` are the nodes with a segment along the wake: all, but for those where the segment and its image in y = 0 are one.
    """

    left: IntArray
    nodes: int
    trailing: IntArray

    @property
    def across(self) -> IntArray:
        """Left nodes of the strips, in the order of the line of nodes: those with a segment across the wake."""
        return np.sort(self.left)

    def laid(self, circulation: FloatArray) -> FloatArray:
        """Circulations [r, m] of rings, each at the place of its left node: [r, nodes]."""
        out = np.zeros((len(circulation), self.nodes))
        out[:, self.left] = circulation
        return out

    def joined(self, ends: FloatArray) -> FloatArray:
        """Nodes [nodes, 3] from left and right ends [m, 2, 3] of strips: the mean where two strips meet."""
        total, count = np.zeros((self.nodes, 3)), np.zeros((self.nodes, 1))
        for side in (0, 1):
            np.add.at(total, self.left + side, ends[:, side])
            np.add.at(count, self.left + side, 1.0)
        return np.asarray(total / count)

    def ends(self, nodes: FloatArray) -> FloatArray:
        """Left and right ends [m, 2, 3] of strips from nodes [nodes, 3]."""
        return np.stack([nodes[self.left], nodes[self.left + 1]], axis=1)


def edges(ends: FloatArray, mirrored: bool = False) -> Edges:
    """The line of nodes of strips with left and right ends [m, 2, 3]; ``mirrored``: their images in y = 0 exist as well."""
    size = _SAME * float(np.mean(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))
    near = np.linalg.norm(ends[:, None, 1] - ends[None, :, 0], axis=2) < size
    left, free, node = np.full(len(ends), -1), set(range(len(ends))), 0
    while free:
        starting = [j for j in sorted(free) if not any(near[i, j] for i in free if i != j)] or sorted(free)
        strip: int | None = starting[0]
        while strip is not None:
            left[strip], node = node, node + 1
            free.discard(strip)
            strip = next((j for j in sorted(free) if near[strip, j]), None)
        node += 1
    line = Edges(left, node, np.arange(node))
    return replace(line, trailing=np.flatnonzero(np.abs(line.joined(ends)[:, 1]) > size)) if mirrored else line


@dataclass(frozen=True)
class Panels:
    """Wake panels in the wind-tunnel frame.

    ``nodes`` [r + 1, nodes, 3], m; ``circulation`` [r, m] of the rings, m^2/s; ``beyond`` [m] that of the ring behind the last row
    which has become particles: its front side is still here.
    """

    edges: Edges
    nodes: FloatArray
    circulation: FloatArray
    beyond: FloatArray

    @property
    def rows(self) -> int:
        """Rows of rings."""
        return len(self.circulation)

    def net(self) -> tuple[FloatArray, FloatArray]:
        """Circulations of the segments across [r + 1, nodes] (to the next node) and along [r, nodes] (to the next row)."""
        laid = self.edges.laid(self.circulation)
        around = np.concatenate([np.zeros((1, self.edges.nodes)), laid, self.edges.laid(self.beyond[None])])
        return np.diff(around, axis=0), np.roll(laid, 1, axis=1) - laid

    def velocities(self, points: FloatArray, cores: FloatArray, mirrored: bool, threads: int) -> FloatArray:
        """Velocity [p, 3], m/s, at points [p, 3]; ``cores`` [r + 1, nodes], m.

        A core spreads a sheet out of its plane, which changes the velocity there in proportion to the core. Twice the velocity less
        that for cores twice as thick is free of this error in first order.
        """
        if self.rows == 0:
            return np.zeros(points.shape)
        across, along = self.net()
        flat = across.ravel(), np.concatenate([along.ravel(), np.zeros(self.edges.nodes)])

        def summed(factor: float) -> FloatArray:
            grid, out = np.concatenate([self.nodes.reshape(-1, 3).T, factor * cores.reshape(1, -1)]), np.empty(points.shape)

            def work(first: int, end: int) -> None:
                grid_velocities(points[first:end], grid, self.edges.nodes, *flat, mirrored, out[first:end])

            in_blocks(work, len(points), BLOCK, threads if len(points) * grid.shape[1] > FEW else 1)
            return out

        return 2.0 * summed(1.0) - summed(2.0) if cores.any() else summed(1.0)

    def grown(self, shed: FloatArray, circulation: FloatArray) -> Panels:
        """The wake with a new row: its front at the shed line [nodes, 3], of the circulation [m] that the strips had before."""
        return Panels(
            self.edges, np.concatenate([shed[None], self.nodes]), np.concatenate([circulation[None], self.circulation]), self.beyond
        )

    def cut(self, rows: int) -> Panels:
        """The first rows of the wake; what lies behind is gone."""
        return Panels(self.edges, self.nodes[: rows + 1], self.circulation[:rows], np.zeros_like(self.beyond))


def shed_nodes(lattice: Lattice, h: FloatArray, strips: int, mirrored: bool) -> tuple[Edges, FloatArray]:
    """Nodes [nodes, 3] of the shed line of the first strips in the frame of the geometry; ``h`` [m] as in :func:`lattice.rings`."""
    found = edges(lattice.edge[:strips], mirrored)
    return found, found.joined(shed_line(lattice, starts(h) + 0.5 * h)[:strips])


def sharp_rows(lattice: Lattice, strips: int, distance: float) -> FloatArray:
    """Rows [m] of the wake of each strip that stay thin: none of them within reach of a surface behind; infinite without one."""
    rows = np.full(strips, np.inf)
    for j in range(strips):
        behind = lattice.collocation[lattice.surface[lattice.strip] != lattice.surface[j], 0] - lattice.edge[j, :, 0].mean()
        if np.any(behind > 0.0):
            rows[j] = min(float(SHARP_ROWS), 0.5 * float(behind[behind > 0.0].min()) / distance)
    return rows


def cores(edges: Edges, sharp: FloatArray, rows: int, distance: float) -> FloatArray:
    """Cores [rows + 1, nodes], m, of a wake whose rows are ``distance`` (m) apart, thin for the first ``sharp`` [m] rows."""
    of_nodes = np.full(edges.nodes, np.inf)
    np.minimum.at(of_nodes, edges.left, sharp)
    np.minimum.at(of_nodes, edges.left + 1, sharp)
    beyond = np.arange(rows + 1)[:, None] - of_nodes
    with np.errstate(invalid="ignore"):
        share = np.clip(beyond / np.maximum(of_nodes, 1.0), 0.0, 1.0)
    return np.where(np.isinf(of_nodes), 0.0, SPREAD * distance * np.nan_to_num(share))
