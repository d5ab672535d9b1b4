"""The reference study as a whole process: wall and processor time and peak memory, from a cold and a warm compilation cache."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

STUDY = Path(__file__).parents[1] / "studies" / "reference" / "study.toml"
pytest.importorskip("resource")


def run_study(out: Path, cache: Path) -> tuple[float, float, float]:
    """Wall time (s), processor time (s) and peak memory (GiB) of one run."""
    environment = os.environ | {"XDG_CACHE_HOME": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, "-m", "levelone.cli", "run", str(STUDY), "--out", str(out)]
    start = time.perf_counter()
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        _, status, usage = os.wait4(process.pid, 0)
    assert status == 0
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 2**20


def test_the_whole_study(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    print("\nreference study        wall s    CPU s   peak GiB")
    for name in ("cold cache", "warm cache"):
        wall, processor, memory = run_study(tmp_path / "out", cache)
        print(f"{name:20s} {wall:8.1f} {processor:8.1f} {memory:10.2f}")
        assert (tmp_path / "out" / "report.html").exists()
