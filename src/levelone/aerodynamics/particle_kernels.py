"""Velocity and stretching induced by vortex particles: the regularised Biot-Savart sum, pair by pair (compiled).

A source q of strength G_q (m^3/s) and core s_q induces at the distance vector r = x - x_q

    u(x) = F(r) G_q x r,    (h . grad) u = F G_q x h + K (r . h) G_q x r,    F = g(r/s_q) / (4 pi r^3),  K = F'(r) / r

with h any vector at the target: for h = G of the target this is the rate of stretching. Kernels g (Winckelmans and Leonard,
J. Comput. Phys. 109, 1993; Alvarez and Ning, AIAA J. 62, 2024):

- ``winckelmans``: g = p^3 (p^2 + 5/2) / (p^2 + 1)^(5/2);
- ``gaussian-erf``: g = erf(p / sqrt 2) - sqrt(2 / pi) p exp(-p^2 / 2).

The second one is g = sqrt(2 / pi) p^3 B1(p^2 / 2) and K = -sqrt(2 / pi) B2(p^2 / 2) / (4 pi s^5) with the Boys functions
B_m(x) = int_0^1 t^(2m) exp(-x t^2) dt. Both are regular at r = 0, where a particle induces nothing on itself.

The inner loop runs over sources held as one array for each quantity, has no branch and ends in sums that may be reordered: it
becomes vector code. Each target is summed by itself in a fixed order, so threads and chunks leave every bit as it is.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
from scipy import special

from levelone.compiled import inlined, innermost, kernel

FloatArray = npt.NDArray[np.float64]

#: names of the kernels, and the numbers by which compiled code knows them
KERNELS = {"winckelmans": 0, "gaussian-erf": 1}
WINCKELMANS = KERNELS["winckelmans"]
#: what the rows of the sources (position, strength, core) are multiplied by in the image in y = 0
MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
#: targets of one piece of work; pairs below which starting threads takes longer than the sum
CHUNK, FEW_PAIRS = 128, 200_000

#: x from which B1 and B2 come from erf and exp; x beyond which erf is 1 to the last bit; largest argument of exp
SWITCH, WHOLE, LARGEST = 1.0, 36.0, 64.0
_ROOTS = 0.5 * np.sqrt(np.pi)


def _boys2(x: FloatArray) -> FloatArray:
    x = np.maximum(x, 1e-9)
    return np.asarray(special.gamma(2.5) * special.gammainc(2.5, x) / (2.0 * x**2.5))


def _scaled_erfc(t: FloatArray) -> FloatArray:
    return np.asarray(special.erfcx(2.0 * (1.0 / t - 1.0)))


def _interpolated(function: Callable[[FloatArray], FloatArray], degree: int, low: float, high: float) -> tuple[float, ...]:
    """Coefficients, lowest power first, of the polynomial through the Chebyshev points of an interval."""
    series = np.polynomial.Chebyshev.interpolate(function, degree, domain=[low, high])
    return tuple(float(c) for c in series.convert(kind=np.polynomial.Polynomial).coef)


# largest errors over the range used, against SciPy's functions: exp 2e-13, erfc 1e-12 (absolute), B2 6e-12 (relative)
_EXP = _interpolated(lambda x: np.exp(-x), 9, 0.0, LARGEST / 128.0)
_ERFC = _interpolated(_scaled_erfc, 9, 1.0 / (1.0 + 0.5 * np.sqrt(WHOLE)), 1.0 / (1.0 + 0.5 * np.sqrt(SWITCH)))
_BOYS = _interpolated(_boys2, 8, 0.0, SWITCH)


@inlined
def _horner9(c, x):
    return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * (c[5] + x * (c[6] + x * (c[7] + x * (c[8] + x * c[9]))))))))


@inlined
def _horner8(c, x):
    return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * (c[5] + x * (c[6] + x * (c[7] + x * c[8])))))))


@inlined
def boys(x):
    """B1(x), B2(x) and exp(-x) for x >= 0, without a branch; relative error below 1e-11."""
    e = _horner9(_EXP, min(x, LARGEST) * (1.0 / 128.0))
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    y = np.sqrt(x)
    d = 1.0 + 0.5 * y
    both = 1.0 / (x * d)
    erf = 1.0 - e * _horner9(_ERFC, x * both)
    half = 0.5 * d * both
    far1 = half * (_ROOTS * erf * y * d * both - e)
    far2 = half * (3.0 * far1 - e)
    near2 = _horner8(_BOYS, x)
    near1 = (2.0 * x * near2 + e) * (1.0 / 3.0)
    near = x < SWITCH
    return near1 if near else far1, near2 if near else far2, e


@inlined
def _algebraic(r2, core):
    """F and K times 4 pi for ``core`` = s^2."""
    a = r2 + core
    inverse = 1.0 / a
    p = np.sqrt(a) * inverse * inverse * inverse
    return (a + 1.5 * core) * p, -(3.0 * a + 7.5 * core) * p * inverse


@inlined
def _error_function(r2, core):
    """F and K times 4 pi, less the factor sqrt(2 / pi) / s^3 that the packed strength holds, for ``core`` = 1 / (2 s^2)."""
    b1, b2, _ = boys(r2 * core)
    return b1, -2.0 * core * b2


@innermost
def induced(kind, px, py, pz, hx, hy, hz, sources):
    """Velocity (3) and (h . grad) velocity (3) at a point p by packed sources [7, n]."""
    x, y, z, gx, gy, gz, core = sources[0], sources[1], sources[2], sources[3], sources[4], sources[5], sources[6]
    ux, uy, uz, wx, wy, wz, sx, sy, sz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(sources.shape[1]):
        rx, ry, rz = px - x[j], py - y[j], pz - z[j]
        r2 = rx * rx + ry * ry + rz * rz
        f, k = _algebraic(r2, core[j]) if kind == WINCKELMANS else _error_function(r2, core[j])
        cx, cy, cz = gy[j] * rz - gz[j] * ry, gz[j] * rx - gx[j] * rz, gx[j] * ry - gy[j] * rx
        ux += f * cx
        uy += f * cy
        uz += f * cz
        wx += f * gx[j]
        wy += f * gy[j]
        wz += f * gz[j]
        k *= rx * hx + ry * hy + rz * hz
        sx += k * cx
        sy += k * cy
        sz += k * cz
    return ux, uy, uz, sx + wy * hz - wz * hy, sy + wz * hx - wx * hz, sz + wx * hy - wy * hx


@kernel
def _sum_block(kind, points, vectors, sources, out):
    for i in range(points.shape[0]):
        p, h = points[i], vectors[i]
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5] = induced(
            kind, p[0], p[1], p[2], h[0], h[1], h[2], sources
        )


def gathered(position: FloatArray, strength: FloatArray, core: FloatArray, mirrored: bool = False) -> FloatArray:
    """Sources [7, n]: position, strength, core; with the images in the plane y = 0 behind them if ``mirrored``, [7, 2n].

    An image has the strength (-Gx, Gy, -Gz): vorticity is an axial vector.
    """
    sources = np.concatenate([position, strength, core[:, None]], axis=1).T
    if mirrored:
        sources = np.concatenate([sources, sources * MIRROR[:, None]], axis=1)
    return np.ascontiguousarray(sources)


def packed(sources: FloatArray, name: str) -> FloatArray:
    """The same with the strength times 1 / (4 pi) and the kernel's own factor, and the kernel's core parameter, as in the sums."""
    out, core = sources.copy(), sources[6]
    if KERNELS[name] == WINCKELMANS:
        out[3:6] /= 4.0 * np.pi
        out[6] = core**2
    else:
        out[3:6] *= np.sqrt(2.0 / np.pi) / (4.0 * np.pi * core**3)
        out[6] = 0.5 / core**2
    return out


def direct_sums(
    points: FloatArray, vectors: FloatArray, sources: FloatArray, name: str, threads: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Velocity u and (h . grad) u at points [p, 3] with vectors h [p, 3] by sources [7, n], every pair by itself: two of [p, 3]."""
    out, ready = np.empty((len(points), 6)), packed(sources, name)

    def work(first: int, end: int) -> None:
        _sum_block(KERNELS[name], points[first:end], vectors[first:end], ready, out[first:end])

    in_blocks(work, len(points), CHUNK, threads if len(points) * sources.shape[1] > FEW_PAIRS else 1)
    return out[:, :3], out[:, 3:]


def in_blocks(work: Callable[[int, int], None], n: int, size: int, threads: int | None) -> None:
    """Call ``work(first, end)`` for consecutive blocks of ``range(n)``, on threads (None: one for each usable processor)."""
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    count = threads or available or 1
    if count == 1 or n <= size:
        work(0, n)
        return
    with ThreadPoolExecutor(count) as pool:
        list(pool.map(lambda first: work(first, min(first + size, n)), range(0, n, size)))
