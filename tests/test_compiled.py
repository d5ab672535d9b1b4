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
    after = compiled.cache_folder.__wrapped__(("aerodynamics",))
    assert before != after
    assert str(tmp_path) in str(before)


@pytest.mark.parametrize("folders", compiled.GROUPS)
def test_sources_are_all_that_kernels_load(folders: tuple[str, ...]) -> None:
    """What Python itself loads for the files with kernels: a constant in any of it may be part of the machine code."""
    root = Path(compiled.__file__).parent
    sources = compiled.kernel_sources(folders)
    kernels = [path for path in sources if "levelone.compiled import" in path.read_text()]
    modules = ["levelone." + ".".join(path.relative_to(root).with_suffix("").parts) for path in kernels]
    code = f"import sys, {', '.join(modules)}; print(*[m.__file__ for n, m in sys.modules.items() if n.startswith('levelone.')])"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert len(kernels) >= 4
    assert {Path(path) for path in loaded} - {root / "_version.py"} <= set(sources)


def test_other_files_leave_machine_code_as_it_is() -> None:
    """A criterion without kernels is no reason to compile the flight model again."""
    names = {path.name for path in compiled.kernel_sources(("dynamics", "handling", "vehicle"))}
    assert "integrate.py" in names
    assert "status.py" in names
    assert "identification.py" not in names


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


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="other systems have no such modes")
def test_a_folder_that_others_can_write_to_keeps_no_code(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Numba reads its index by pickle: what a stranger puts there would run."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    mine = compiled.cache_folder.__wrapped__(("aerodynamics",))
    Path(str(mine)).chmod(0o777)
    assert compiled.cache_folder.__wrapped__(("aerodynamics",)) is None
    Path(str(mine)).chmod(0o700)
    assert compiled.cache_folder.__wrapped__(("aerodynamics",)) == mine
