"""Cost of dynamic derivatives in the frequency domain, by size of the lattice."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "aerodynamics"))
from shapes import geometry, tail, wing

from levelone.aerodynamics.frequency import oscillate, prepare
from levelone.aerodynamics.lattice import build


@pytest.mark.parametrize(("along", "strips", "of_tail"), [(4, 10, 4), (8, 10, 4), (12, 30, 10)])
def test_ten_reduced_frequencies(benchmark, along, strips, of_tail):
    """Pitch, heave and rate; the largest is 12 x 60 + 8 x 20 panels (a doublet-lattice code: 4.5 CPU-s for each k)."""
    k = np.linspace(0.02, 0.5, 10)
    lattice = build(geometry(wing(along, strips), tail(2 * along // 3 if along == 12 else along // 2, of_tail)))

    def run():
        return oscillate(prepare(lattice), k, ("pitch", "heave", "rate"), np.zeros(3))

    run()
    benchmark.extra_info["panels"] = len(lattice.bound)
    found = benchmark.pedantic(run, rounds=3)
    assert np.all(np.isfinite(found))
