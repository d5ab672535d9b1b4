"""How every kernel is compiled, and where its machine code is kept.

Reassociation and reciprocals are allowed; the assumption that nothing is NaN or infinite is not, since it removes the very test
that finds a diverged run. ``nogil`` lets threads work on chunks of a batch side by side.

Numba looks only at a function's own file to decide whether kept machine code is still good: a change in a file that it calls goes
unseen, and the old numbers come back. Kept code therefore lies in a folder named by the contents of every file that holds kernels
and of every file of the package that these import, since the values of constants are part of the machine code.
"""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

FASTMATH = {"contract", "arcp", "nsz", "reassoc"}
#: folders whose kernels call each other; a change in one leaves the machine code of the other groups as it is
GROUPS = (("dynamics", "handling", "vehicle"), ("aerodynamics",))
_IMPORT = re.compile(r"^\s*from levelone\.([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


def folders_with(module: str) -> tuple[str, ...]:
    """The group of folders that a module of the package belongs to; the first one for everything else."""
    parts = module.split(".")
    return next((group for group in GROUPS if len(parts) > 1 and parts[1] in group), GROUPS[0])


def kernel_sources(folders: tuple[str, ...]) -> list[Path]:
    """Files of these folders that hold kernels, and all files of the package that they import, directly or through others."""
    root = Path(__file__).parent
    files = {path: path.read_text(encoding="utf-8") for folder in folders for path in (root / folder).rglob("*.py")}
    reached, waiting = set(), [path for path, text in files.items() if "levelone.compiled" in text]
    while waiting:
        path = waiting.pop()
        if path not in reached:
            reached.add(path)
            waiting += _imported(root, files.get(path) or path.read_text(encoding="utf-8"))
    return sorted(reached)


def _imported(root: Path, text: str) -> list[Path]:
    """Files of the package that a module's text imports, its own folders' ``__init__`` among them."""
    paths: list[list[str]] = []
    for module, names in _IMPORT.findall(text):
        parts = module.split(".")
        paths += [parts[:i] for i in range(1, len(parts) + 1)] + [[*parts, name] for name in re.findall(r"\w+", names)]
    files = [root.joinpath(*path, "__init__.py") for path in paths] + [root.joinpath(*path).with_suffix(".py") for path in paths]
    return [path for path in files if path.is_file()]


@cache
def cache_folder(folders: tuple[str, ...] = GROUPS[0]) -> str | None:
    """The user's own folder for machine code, or None where it cannot be written; never a folder that others can write to."""
    digest = hashlib.blake2b(numba.__version__.encode(), digest_size=8)
    for source in kernel_sources(folders):
        digest.update(source.read_bytes())
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    folder = Path(base) / "levelone" / digest.hexdigest()
    try:
        folder.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        folder.mkdir(exist_ok=True, mode=0o700)
        if not _own(folder):
            return None
        with tempfile.TemporaryFile(dir=folder):
            return str(folder)
    except OSError:
        return None


def _own(folder: Path) -> bool:
    """Whether only this user can write to a folder: what Numba keeps is read back as it is."""
    if not hasattr(os, "getuid"):
        return True
    info = folder.stat()
    return info.st_uid == os.getuid() and not info.st_mode & 0o022


def _decorate(options: dict[str, Any]) -> Callable[[Callable[..., Any]], Any]:
    def decorate(function: Callable[..., Any]) -> Any:
        folder = cache_folder(folders_with(function.__module__))
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = folder or before
        try:
            return numba.njit(cache=folder is not None, nogil=True, fastmath=FASTMATH, error_model="numpy", **options)(function)
        finally:
            numba.config.CACHE_DIR = before

    return decorate


#: an entry point or a function large enough to stand by itself in machine code
kernel = _decorate({})
#: the same for the innermost functions: they allocate nothing and count no references to arrays (the count is a locked
#: instruction, and cost a quarter of the simulation)
innermost = _decorate({"_nrt": False})
#: a small function that always becomes part of its caller; allocates nothing
inlined = _decorate({"forceinline": True, "_nrt": False})
