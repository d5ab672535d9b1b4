"""Functions whose Sobol indices are known, on the unit cube, and their exact values."""

from __future__ import annotations

import tomllib
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
    """S1 and ST [k] of "ishigami" or "sobol_g"; the last listed value stands for all further inputs, zero for Ishigami."""
    fill = 0.0 if name == "ishigami" else None
    rows = []
    for index in ("S1", "ST"):
        listed = REFERENCE[name][index]
        rows.append(np.array(listed + [listed[-1] if fill is None else fill] * (k - len(listed))))
    return rows
