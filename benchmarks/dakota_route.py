"""Dakota's route from given runs to Sobol indices: a surfpack Gaussian process, and a variance-based decomposition on it."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.dakota.execute import run_dakota
from levelone.campaign.dakota.printed import read_sobol

INPUT = """environment
  output_precision = 16
  output_file = 'route.out'
method
  sampling
    sample_type lhs
    samples = {base_points}
    seed = {seed}
    variance_based_decomp
  model_pointer = 'SURROGATE'
  output quiet
model
  id_model = 'SURROGATE'
  surrogate global
    gaussian_process surfpack
    import_build_points_file = 'runs.dat' annotated
variables
  uniform_uncertain = {k}
    lower_bounds {k}*0.0
    upper_bounds {k}*1.0
    descriptors {names}
interface
  fork analysis_drivers = 'never_called'
responses
  response_functions = 1
  descriptors 'y'
  no_gradients
  no_hessians
"""


def surfpack_vbd(x_unit: NDArray[np.float64], y: NDArray[np.float64], base_points: int = 2**14, seed: int = 1) -> dict[str, Any]:
    """Indices of one response by surfpack's Gaussian process and Dakota's decomposition on it.

    Parameters
    ----------
    x_unit
        [n, k] coordinates in the unit cube, of independent uniform factors.
    y
        [n] values; rows of NaN are left out by Dakota.
    base_points
        N of a decomposition of N (k + 2) evaluations of the surrogate.
    seed
        Of the decomposition, from 1.

    Returns
    -------
    ``cpu`` and ``wall`` in s of the whole process (one thread: fit and decomposition), ``S1`` and ``ST`` [k].
    """
    x, y = np.asarray(x_unit, dtype=float), np.asarray(y, dtype=float)
    names = [f"x{j + 1}" for j in range(x.shape[1])]
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            f"{i + 1} NO_ID {' '.join(map(repr, row))} {value!r}"
            for i, (row, value) in enumerate(zip(x.tolist(), y.tolist(), strict=True))
        ]
        Path(folder, "runs.dat").write_text("\n".join([f"%eval_id interface {' '.join(names)} y", *rows, ""]))
        quoted = " ".join(f"'{name}'" for name in names)
        Path(folder, "route.in").write_text(INPUT.format(base_points=base_points, seed=seed, k=len(names), names=quoted))
        done = run_dakota(Path(folder, "route.in"))
        found = read_sobol(Path(folder, "route.out").read_text(), names)["y"]
    return {"cpu": done.cpu, "wall": done.wall, "S1": found.first, "ST": found.second}
