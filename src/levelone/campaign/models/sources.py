"""Which code a value comes from: a changed criterion must not find the values of the old one in a store."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

#: parts of the package that make or read a record; config too, since it assembles matrices, units, steps and signs
PARTS = ("compiled.py", "status.py", "config", "dynamics", "handling", "vehicle", "campaign/models")


@cache
def sources_digest() -> str:
    """SHA-256 over the files of the package that decide a value, in hexadecimal."""
    root = Path(__file__).parents[2]
    found = (path for part in PARTS for path in [root / part, *(root / part).rglob("*")])
    files = sorted(path for path in found if path.suffix in (".py", ".toml", ".csv"))
    together = hashlib.sha256()
    for path in files:
        together.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return together.hexdigest()
