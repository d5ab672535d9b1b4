"""Sequential batches against a fresh Latin hypercube of as many runs: errors of S1 and ST on the Kriging surrogate.

``pytest benchmarks/test_sequential.py -s``; 20 seeds take some ten minutes, ``LEVELONE_SEEDS=3`` two.
"""

from __future__ import annotations

import os

import numpy as np
import pytest

from exact_functions import FUNCTIONS, SPACE, exact
from levelone.uncertainty import Kriging, latin_hypercube, sobol, sobol_design
from levelone.uncertainty.sequential import sequential_design

SEEDS = int(os.environ.get("LEVELONE_SEEDS", "20"))
START, TOTAL, BATCH = 100, 200, 20
DESIGN = sobol_design(SPACE, 2**11, 7)


def error(model, name):
    """Root mean square over the 28 indices."""
    found = sobol(DESIGN, model.predict_mean(DESIGN.unit_points), bootstrap=2)
    return np.sqrt(np.mean((np.concatenate([found.S1, found.ST]) - np.concatenate([exact(name, "S1"), exact(name, "ST")])) ** 2))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_batches_against_a_fresh_hypercube(capsys, name):
    call, rows = FUNCTIONS[name], []
    for seed in range(SEEDS):
        first, fresh = (latin_hypercube(SPACE, n, stage).unit_points for n, stage in ((START, seed), (TOTAL, 10_000 + seed)))
        more = latin_hypercube(SPACE, TOTAL - START, 20_000 + seed).unit_points
        designs = [first, fresh, np.vstack([first, more])]
        models = [Kriging.fit(x, call(x), seed) for x in designs]
        models.append(sequential_design(call, SPACE, START, TOTAL, BATCH, seed).model)
        rows.append([error(model, name) for model in models])
    with capsys.disabled():
        print()
        for who, column in zip(("start", "fresh hypercube", "two hypercubes", "sequential"), np.array(rows).T, strict=True):
            size = START if who == "start" else TOTAL
            print(
                f"{name}: {who:16s} {size} runs: rms error of S1 and ST mean {column.mean():.4f}, median {np.median(column):.4f}, "
                f"worst {column.max():.4f} of {SEEDS} seeds"
            )
