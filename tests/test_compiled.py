"""Kept machine code never outlives the sources it was made from, and a missing cache folder is no obstacle."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from levelone import compiled


def folder_seen_by_a_new_process(cache: Path) -> str:
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"} | {"XDG_CACHE_HOME": str(cache)}
    code = "from levelone.compiled import cache_folder; print(cache_folder())"
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True).stdout.strip()


def test_folder_is_named_by_the_sources(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Another file of kernels, another folder: Numba itself would go on using the old code of their callers."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    before = compiled.cache_folder.__wrapped__(("dynamics", "handling", "vehicle"))
    after = compiled.cache_folder.__wrapped__(("dynamics", "handling"))
    assert before != after
    assert str(tmp_path) in str(before)


def test_parts_that_do_not_call_each_other_keep_their_code_apart() -> None:
    assert compiled.folders_with("levelone.aerodynamics.kernels") == ("aerodynamics",)
    assert compiled.folders_with("levelone.handling.peaks") == compiled.folders_with("levelone.dynamics.model")
    assert "aerodynamics" not in compiled.folders_with("levelone.vehicle.tables")


def test_private_folder_or_none(tmp_path: Path) -> None:
    kept = Path(folder_seen_by_a_new_process(tmp_path / "cache"))
    assert kept.stat().st_mode & 0o077 == 0
    blocked = tmp_path / "file"
    blocked.write_text("")
    assert folder_seen_by_a_new_process(blocked) == "None"
