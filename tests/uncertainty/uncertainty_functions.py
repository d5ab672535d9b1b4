"""Functions whose Sobol indices are known, on the unit cube, and their exact values."""

from __future__ import annotations

import tomllib
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np

from levelone.uncertainty import Factor, FactorSpace, Uniform

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "uncertainty.toml").read_text(encoding="utf-8"))


def unit_space(k):
    return FactorSpace([Factor(f"x{j + 1}", Uniform(0.0, 1.0)) for j in range(k)])


def ishigami(u):
    """Three active inputs; any further ones are inert."""
    a, b = REFERENCE["ishigami"]["a"], REFERENCE["ishigami"]["b"]
    x = np.pi * (2.0 * u - 1.0)
    return np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])


def sobol_g(u):
    a = np.array(REFERENCE["sobol_g"]["a"])
    return np.prod((np.abs(4.0 * u - 2.0) + a) / (1.0 + a), axis=1)


def exact(name, k):
    """S1 and ST [k] of a function; the last listed value stands for all further inputs, zero for Ishigami."""
    if name == "block_sum":
        main, total, _, variance = block_truth()
        return [main / variance, total / variance]
    fill = 0.0 if name == "ishigami" else None
    rows = []
    for index in ("S1", "ST"):
        listed = REFERENCE[name][index]
        rows.append(np.array(listed + [listed[-1] if fill is None else fill] * (k - len(listed))))
    return rows


# Sum of blocks of one to three inputs that interact inside the block only: (columns, function of the block).
BLOCKS = (
    ((0, 1), lambda x: np.exp(x[..., 0] * x[..., 1])),
    ((2, 3), lambda x: x[..., 0] * np.sin(2.0 * np.pi * x[..., 1]) + 0.3 * x[..., 0] ** 2),
    ((4, 5, 6), lambda x: (x[..., 0] - 0.5 + 1.5 * (x[..., 1] - 0.5) * x[..., 2]) ** 2 + 0.4 * x[..., 2]),
    ((7, 8), lambda x: 1.5 * np.cos(3.0 * x[..., 0]) * (x[..., 1] - 0.3)),
    ((9,), lambda x: 0.5 * x[..., 0]),
    ((10,), lambda x: 0.2 * np.sqrt(0.1 + x[..., 0])),
    ((11, 12), lambda x: 0.1 * x[..., 0] * x[..., 1]),
)


def block_sum(u):
    """The sum of BLOCKS; the last of its 14 inputs is inert."""
    return sum(part(u[:, list(columns)]) for columns, part in BLOCKS)


@cache
def block_truth(blocks=BLOCKS, k=14, nodes=40):
    """Parts of the variance of a sum of blocks: main and total [k], pairs [k, k], all.

    Variances of conditional means by Gauss-Legendre quadrature of each block.
    """
    x, w = np.polynomial.legendre.leggauss(nodes)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    main, total, pair, variance = np.zeros(k), np.zeros(k), np.zeros((k, k)), 0.0
    for columns, part in blocks:
        m = len(columns)
        values = part(np.stack(np.meshgrid(*[x] * m, indexing="ij"), axis=-1))

        def explained(kept, values=values, m=m):
            """Variance of the mean given the inputs that are kept."""
            mean = values
            for axis in sorted(set(range(m)) - set(kept), reverse=True):
                mean = np.tensordot(mean, w, axes=(axis, 0))
            square = mean**2
            for _ in kept:
                mean, square = np.tensordot(mean, w, axes=(0, 0)), np.tensordot(square, w, axes=(0, 0))
            return square - mean**2

        variance += explained(range(m))
        for i, column in enumerate(columns):
            main[column] = explained([i])
            total[column] = explained(range(m)) - explained([other for other in range(m) if other != i])
        for i, j in combinations(range(m), 2):
            pair[columns[i], columns[j]] = explained([i, j]) - explained([i]) - explained([j])
    return main, total, pair, variance


FUNCTIONS = {"ishigami": ishigami, "sobol_g": sobol_g, "block_sum": block_sum}


def exact_pairs(name, k):
    """S2 [k, k], zero on and below the diagonal."""
    if name == "block_sum":
        return block_truth()[2] / block_truth()[3]
    if name == "ishigami":
        pairs = np.zeros((k, k))
        pairs[0, 2] = REFERENCE[name]["ST"][2]
        return pairs
    part = sobol_g_parts(k)
    return np.triu(np.outer(part, part), 1) / (np.prod(1.0 + part) - 1.0)


def sobol_g_parts(k):
    """Variances of the factors of sobol_g, each of mean 1: V_j = 1/3 / (1 + a_j)^2."""
    return 1.0 / (3.0 * (1.0 + np.array(REFERENCE["sobol_g"]["a"][:k])) ** 2)
