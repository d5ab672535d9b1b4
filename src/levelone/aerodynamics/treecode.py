"""Sums over many vortex particles by a tree: cells that are far away act through their multipoles (compiled).

Barnes and Hut, Nature 324, 1986; regularised kernels in the far field as in Lindsay and Krasny, J. Comput. Phys. 172, 2001. Sources
lie in the cells of a k-d tree. A cell holds the moments of its strengths G about its centre c, with y = x_q - c,

    M_a = sum G_a,   D_ab = sum G_a y_b,   Q_abc = 1/2 sum G_a y_b y_c,

and acts, with R = x - c, the radial functions F_0 = F, F_(k+1) = F_k'(R)/R of the kernel for the cell's mean core, d = D R,
q_ab = Q_abc R_c, q = q_ab R_b, t_a = Q_abb and (e.A)_i = eps_iab A_ab, through

    u = [F_0 M + F_1 (t - d) + F_2 q] x R - F_0 e.D + 2 F_1 e.(Q R),

the Taylor series of the kernel to second order; (h . grad) u is its exact derivative. Targets are taken in groups, the leaves of a
tree of their own. A cell of radius b acts on a group at the distance L (centre to the nearest point of the group's sphere) through
its moments if b < angle L and L exceeds the cell's core reach; otherwise its parts are asked, and in the end its particles one by
one, with their own cores. The near field is therefore the direct sum itself and needs no correction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from levelone.aerodynamics.particle_kernels import KERNELS, WINCKELMANS, FloatArray, boys, in_blocks, induced, packed
from levelone.compiled import inlined, innermost, kernel

IntArray = npt.NDArray[np.int64]

#: opening angle: measured errors in the theory page on vortex particles
ANGLE = 0.2
#: particles of a leaf of the sources and of a group of targets
SOURCE_LEAF, TARGET_LEAF = 32, 64
#: a cell acts from this many of its largest cores on; and from where the spread of its cores matters less than this
NEAREST_CORES, SPREAD_ERROR = 3.0, 1e-3
#: place of the pair (b, c) among xx, xy, xz, yy, yz, zz
PAIR = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
#: keeps the centre of a cell without strength defined
TINY = 1e-200
#: rows of a cell: centre 0:3, core 3, M 4:7, t 7:10, e.D 10:13, D 13:22, e.Q 22:31, Q (xx, xy, xz, yy, yz, zz) 31:49
CELL_ROWS = 49
GROUPS_PER_BLOCK = 8


@dataclass(frozen=True)
class _Cells:
    """Ranges [n, 2] of the ordered points, both children [n, 2] of each cell (-1: a leaf)."""

    order: IntArray
    range: IntArray
    child: IntArray


def _divide(points: FloatArray, leaf: int) -> _Cells:
    tree = cKDTree(points, leafsize=leaf)
    ranges: list[tuple[int, int]] = []
    children: list[list[int]] = []
    stack: list[tuple[Any, int, int]] = [(tree.tree, -1, 0)]
    while stack:
        node, parent, side = stack.pop()
        here = len(ranges)
        ranges.append((node.start_idx, node.end_idx))
        children.append([-1, -1])
        if parent >= 0:
            children[parent][side] = here
        if node.split_dim >= 0:
            stack += [(node.lesser, here, 0), (node.greater, here, 1)]
    return _Cells(np.asarray(tree.indices, dtype=np.int64), np.array(ranges, dtype=np.int64), np.array(children, dtype=np.int64))


@kernel
def _moments(sources, ranges, first_cell, end_cell, cells, size):
    """Fill the columns of cells [49, c], core squared in row 3, and size [2, c] (radius, reach) from ordered sources [7, n]."""
    c = np.empty(3)
    cell = np.empty(CELL_ROWS)
    y = np.empty(3)
    for m in range(first_cell, end_cell):
        first, end = ranges[m]
        c[:] = 0.0
        cell[:] = 0.0
        weight, low, high = 0.0, sources[6, first], sources[6, first]
        for j in range(first, end):
            w = np.sqrt(sources[3, j] ** 2 + sources[4, j] ** 2 + sources[5, j] ** 2) + TINY
            weight += w
            cell[3] += w * sources[6, j] ** 2
            low, high = min(low, sources[6, j]), max(high, sources[6, j])
            for a in range(3):
                c[a] += w * sources[a, j]
        radius = 0.0
        for a in range(3):
            c[a] /= weight
            cell[a] = c[a]
        cell[3] /= weight
        for j in range(first, end):
            for a in range(3):
                y[a] = sources[a, j] - c[a]
            radius = max(radius, y[0] ** 2 + y[1] ** 2 + y[2] ** 2)
            _add(cell, y, sources[3, j], sources[4, j], sources[5, j])
        _contract(cell)
        for row in range(CELL_ROWS):
            cells[row, m] = cell[row]
        size[0, m] = np.sqrt(radius)
        size[1, m] = max(NEAREST_CORES * high, (1.875 * (high**4 - low**4) / SPREAD_ERROR) ** 0.25)


@inlined
def _add(cell, y, gx, gy, gz):
    """Add one particle's part to M, D and Q."""
    for a, g in enumerate((gx, gy, gz)):
        cell[4 + a] += g
        for b in range(3):
            cell[13 + 3 * a + b] += g * y[b]
        h = 0.5 * g
        cell[31 + 6 * a] += h * y[0] * y[0]
        cell[32 + 6 * a] += h * y[0] * y[1]
        cell[33 + 6 * a] += h * y[0] * y[2]
        cell[34 + 6 * a] += h * y[1] * y[1]
        cell[35 + 6 * a] += h * y[1] * y[2]
        cell[36 + 6 * a] += h * y[2] * y[2]


@inlined
def _contract(cell):
    """Fill t, e.D and e.Q from D and Q."""
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        cell[7 + i] = cell[31 + 6 * i] + cell[34 + 6 * i] + cell[36 + 6 * i]
        cell[10 + i] = cell[13 + 3 * a + b] - cell[13 + 3 * b + a]
        for c in range(3):
            cell[22 + 3 * i + c] = cell[31 + 6 * a + PAIR[b, c]] - cell[31 + 6 * b + PAIR[a, c]]


@inlined
def _radial(kind, r2, core):
    """F_0 to F_3, times 4 pi and as the packed strengths of the kernel want them."""
    if kind == WINCKELMANS:
        v = 1.0 / (r2 + core)
        p = np.sqrt(r2 + core) * v * v
        e = 1.5 * core * v
        f0 = p * (1.0 + e)
        p *= -v
        f1 = p * (3.0 + 5.0 * e)
        p *= -v
        f2 = p * (15.0 + 35.0 * e)
        p *= -v
        return f0, f1, f2, p * (105.0 + 315.0 * e)
    x = r2 * core
    b1, b2, exponential = boys(x)
    half, c = 0.5 / x, -2.0 * core
    b3 = half * (5.0 * b2 - exponential)
    b4 = half * (7.0 * b3 - exponential)
    return b1, c * b2, c * c * b3, c * c * c * b4


@innermost
def _far(kind, px, py, pz, hx, hy, hz, m):
    """Velocity (3) and (h . grad) velocity (3) at a point p by the cells m [49, n]."""
    ux, uy, uz, sx, sy, sz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(m.shape[1]):
        x, y, z = px - m[0, j], py - m[1, j], pz - m[2, j]
        f0, f1, f2, f3 = _radial(kind, x * x + y * y + z * z, m[3, j])
        rho = x * hx + y * hy + z * hz
        vx, wx = _component(f0, f1, f2, f3, rho, x, y, z, hx, hy, hz, m, j, 0)
        vy, wy = _component(f0, f1, f2, f3, rho, x, y, z, hx, hy, hz, m, j, 1)
        vz, wz = _component(f0, f1, f2, f3, rho, x, y, z, hx, hy, hz, m, j, 2)
        ax, bx = _axial(f0, f1, f2, rho, x, y, z, hx, hy, hz, m, j, 0)
        ay, by = _axial(f0, f1, f2, rho, x, y, z, hx, hy, hz, m, j, 1)
        az, bz = _axial(f0, f1, f2, rho, x, y, z, hx, hy, hz, m, j, 2)
        ux += vy * z - vz * y + ax
        uy += vz * x - vx * z + ay
        uz += vx * y - vy * x + az
        sx += wy * z - wz * y + vy * hz - vz * hy + bx
        sy += wz * x - wx * z + vz * hx - vx * hz + by
        sz += wx * y - wy * x + vx * hy - vy * hx + bz
    return ux, uy, uz, sx, sy, sz


@inlined
def _component(f0, f1, f2, f3, rho, x, y, z, hx, hy, hz, m, j, a):
    """Component a of the vector V whose cross product with R is the velocity, and of its derivative along h."""
    row, q = 13 + 3 * a, 31 + 6 * a
    qx = m[q, j] * x + m[q + 1, j] * y + m[q + 2, j] * z
    qy = m[q + 1, j] * x + m[q + 3, j] * y + m[q + 4, j] * z
    qz = m[q + 2, j] * x + m[q + 4, j] * y + m[q + 5, j] * z
    first = m[7 + a, j] - (m[row, j] * x + m[row + 1, j] * y + m[row + 2, j] * z)
    second = qx * x + qy * y + qz * z
    value = f0 * m[4 + a, j] + f1 * first + f2 * second
    slope = rho * (f1 * m[4 + a, j] + f2 * first + f3 * second)
    slope += 2.0 * f2 * (qx * hx + qy * hy + qz * hz) - f1 * (m[row, j] * hx + m[row + 1, j] * hy + m[row + 2, j] * hz)
    return value, slope


@inlined
def _axial(f0, f1, f2, rho, x, y, z, hx, hy, hz, m, j, a):
    """Component a of the part -F_0 e.D + 2 F_1 e.(Q R), and of its derivative along h."""
    row = 22 + 3 * a
    q = 2.0 * (m[row, j] * x + m[row + 1, j] * y + m[row + 2, j] * z)
    slope = 2.0 * f1 * (m[row, j] * hx + m[row + 1, j] * hy + m[row + 2, j] * hz)
    return f1 * q - f0 * m[10 + a, j], slope + rho * (f2 * q - f1 * m[10 + a, j])


@kernel
def _sort_out(x, y, z, radius, angle, cells, size, child, stack, near, far):
    """Fill near (leaves) and far (cells) for a group of targets in a sphere; their numbers. Each list has room for every cell."""
    stack[0], depth, n_near, n_far = 0, 1, 0, 0
    while depth > 0:
        depth -= 1
        m = stack[depth]
        distance = np.sqrt((cells[0, m] - x) ** 2 + (cells[1, m] - y) ** 2 + (cells[2, m] - z) ** 2) - radius
        if size[0, m] < angle * distance and size[1, m] < distance:
            far[n_far] = m
            n_far += 1
        elif child[m, 0] < 0:
            near[n_near] = m
            n_near += 1
        else:
            stack[depth], stack[depth + 1] = child[m, 0], child[m, 1]
            depth += 2
    return n_near, n_far


@kernel
def _copied(table, first, end, n):
    """The columns first[i] to end[i] of a table, side by side; n in all. (Loops: slices take seconds to compile.)"""
    out = np.empty((table.shape[0], n))
    for row in range(table.shape[0]):
        k = 0
        for i in range(first.shape[0]):
            for j in range(first[i], end[i]):
                out[row, k] = table[row, j]
                k += 1
    return out


@kernel
def _sphere(points, members):
    """Centre and radius of a sphere about the mean of some points."""
    x, y, z, square, share = 0.0, 0.0, 0.0, 0.0, 1.0 / members.shape[0]
    for i in members:
        x, y, z = x + share * points[i, 0], y + share * points[i, 1], z + share * points[i, 2]
    for i in members:
        square = max(square, (points[i, 0] - x) ** 2 + (points[i, 1] - y) ** 2 + (points[i, 2] - z) ** 2)
    return x, y, z, np.sqrt(square)


@kernel
def _groups(kind, angle, points, vectors, order, groups, sources, ranges, child, cells, size, out):
    """Sums at the targets of some groups (ranges of ``order``), into out [p, 6]."""
    stack, near, far = np.empty_like(ranges[:, 0]), np.empty_like(ranges[:, 0]), np.empty_like(ranges[:, 0])
    for g in range(groups.shape[0]):
        members = order[groups[g, 0] : groups[g, 1]]
        x, y, z, radius = _sphere(points, members)
        n_near, n_far = _sort_out(x, y, z, radius, angle, cells, size, child, stack, near, far)
        first, end = ranges[near[:n_near], 0], ranges[near[:n_near], 1]
        close = _copied(sources, first, end, (end - first).sum())
        distant = _copied(cells, far[:n_far], far[:n_far] + 1, n_far)
        for i in members:
            p, h = points[i], vectors[i]
            ux, uy, uz, sx, sy, sz = induced(kind, p[0], p[1], p[2], h[0], h[1], h[2], close)
            vx, vy, vz, tx, ty, tz = _far(kind, p[0], p[1], p[2], h[0], h[1], h[2], distant)
            out[i, 0], out[i, 1], out[i, 2] = ux + vx, uy + vy, uz + vz
            out[i, 3], out[i, 4], out[i, 5] = sx + tx, sy + ty, sz + tz


def tree_sums(
    points: FloatArray,
    vectors: FloatArray,
    sources: FloatArray,
    name: str,
    threads: int | None = None,
    angle: float = ANGLE,
) -> tuple[FloatArray, FloatArray]:
    """Velocity u and (h . grad) u at points [p, 3] with vectors h [p, 3] by sources [7, n]: two of [p, 3]."""
    tree, targets = _divide(sources[:3].T, SOURCE_LEAF), _divide(points, TARGET_LEAF)
    groups = targets.range[targets.child[:, 0] < 0]
    ordered = np.ascontiguousarray(sources[:, tree.order])
    cells, size = np.empty((CELL_ROWS, len(tree.range))), np.empty((2, len(tree.range)))
    in_blocks(lambda i, j: _moments(ordered, tree.range, i, j, cells, size), len(tree.range), 64, threads)
    _scale(cells, name)
    out, ready = np.empty((len(points), 6)), packed(ordered, name)

    def work(first: int, end: int) -> None:
        part = groups[first:end]
        _groups(KERNELS[name], angle, points, vectors, targets.order, part, ready, tree.range, tree.child, cells, size, out)

    in_blocks(work, len(groups), GROUPS_PER_BLOCK, threads)
    return out[:, :3], out[:, 3:]


def _scale(cells: FloatArray, name: str) -> None:
    """Bring the moments to the kernel's units, with the mean core of each cell, in place."""
    unit = np.zeros((7, cells.shape[1]))
    unit[3], unit[6] = 1.0, np.sqrt(cells[3])
    unit = packed(unit, name)
    cells[3] = unit[6]
    cells[4:] *= unit[3]
