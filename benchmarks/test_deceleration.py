"""Processor time of the Monte Carlo of the deceleration to hover, from each speed of the reference study.

``pytest benchmarks/test_deceleration.py -s``. CPU seconds of one thread after one flight that compiles; measures included. Nothing
here passes or fails by a time: the lines printed are the result.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from levelone.campaign import build_model
from levelone.campaign.deceleration_flights import assess
from levelone.config.study_file import load_study
from levelone.uncertainty import latin_hypercube

STUDY = Path(__file__).parents[1] / "studies" / "reference" / "study.toml"
RUNS = 500

pytestmark = pytest.mark.benchmark(timer=time.process_time)


@pytest.mark.parametrize("i", [0, 1])
def test_monte_carlo_of_a_deceleration(benchmark: Any, i: int) -> None:
    study = load_study(STUDY)
    model, given = build_model(study, threads=1), study.deceleration
    points = latin_hypercube(study.space, RUNS, 1).points
    assess(model, given, i, points[:1])
    found = benchmark.pedantic(lambda: assess(model, given, i, points), rounds=2, iterations=1)
    seconds, share = float(benchmark.stats.stats.min), float((found.performance > 0).mean())
    assert share == 1.0
    what = f"{RUNS} decelerations of {given.duration:g} s from {given.speeds[i]:g} m/s"
    print(f"\n{what:50s} {seconds:.2f} CPU-s (wanted: 10), {share:.1%} with a performance")
