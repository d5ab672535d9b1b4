"""Time of ``levelone assess`` from shell to page: five sweeps of 90 s at 200 Hz, imports included, kernels compiled before."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy import signal

RECORDS, DURATION, RATE = 5, 90.0, 200.0
COLUMNS = "theta=pitch[deg], q=rate[deg/s], delta_lon=stick[in]/5"


def written(folder: Path, seed: int) -> Path:
    time = np.arange(round(DURATION * RATE)) / RATE
    part = np.clip((time - 2.0) / (DURATION - 6.0), 0.0, 1.0)
    growth = np.log(20.0 / 0.4)
    phase = 0.4 * (DURATION - 6.0) / growth * np.expm1(part * growth)
    stick = 0.1 * np.clip(np.minimum(time - 2.0, DURATION - 4.0 - time), 0.0, 1.0) * np.sin(phase)
    rng = np.random.default_rng(seed)
    angle, rate = (signal.lsim((top, [1.0, 3.0, 9.0]), stick, time)[1] for top in ([7.2], [7.2, 0.0]))
    angle, rate = (x + 0.02 * x.std() * rng.standard_normal(x.size) for x in (angle, rate))
    table = np.column_stack([time, 5.0 * stick, np.degrees(rate), np.degrees(angle)])
    path = folder / f"sweep{seed}.csv"
    np.savetxt(path, table, delimiter=",", fmt="%.7g", header="time[s],stick,rate,pitch", comments="")
    return path


def test_five_sweeps_to_a_page(benchmark, tmp_path):
    paths = [str(written(tmp_path, seed)) for seed in range(RECORDS)]
    command = [sys.executable, "-m", "levelone.cli", "assess", *paths, "--columns", COLUMNS, "--out", str(tmp_path)]

    def run() -> None:
        subprocess.run(command, check=True, capture_output=True)

    run()  # compiles, and fills the caches of files
    benchmark.pedantic(run, rounds=3)
    assert (tmp_path / "assessment.html").stat().st_size > 100_000
