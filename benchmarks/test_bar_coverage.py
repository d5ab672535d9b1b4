"""Do the error bars of the derivatives hold the converged values? A table, against grids three and 4.5 times the ordinary one."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "aerodynamics"))
from true_errors import bars_and_errors, shapes


def test_coverage_of_the_error_bars():
    found = {name: bars_and_errors(shape, (6, 9)) for name, shape in shapes().items()}
    print("\nerror bars of lift and moment in pitch and heave, k = 0.05 and 0.3")
    for name, (bar, error) in found.items():
        print(f"{name:15s} held {np.mean(error <= bar):5.0%}, median bar {np.median(bar):.5f}, median error {np.median(error):.5f}")
    bar, error = (np.concatenate([each[i] for each in found.values()]) for i in (0, 1))
    print(f"all {bar.size}: held {np.mean(error <= bar):.1%}; median bar is {np.median(bar) / np.median(error):.2f} median errors")
    assert np.mean(error <= bar) >= 0.9
