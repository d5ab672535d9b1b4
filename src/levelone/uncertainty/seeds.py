"""Seeds by stage name: every random stage of a study draws from its own stream."""

from __future__ import annotations

from hashlib import blake2b

import numpy as np

from levelone.errors import InputError


def stage_seed(seed: int, stage: str) -> int:
    """Seed of a named stage; depends on nothing but the two arguments, so that adding a stage shifts no other.

    Parameters
    ----------
    seed
        Seed of the study, a non-negative integer.
    stage
        Name of the stage, for example ``"morris"``.

    Returns
    -------
    int
        Non-negative and below 2**53, so that JSON, NetCDF and spreadsheets hold it exactly.

    Raises
    ------
    InputError
        Negative or non-integer seed, empty stage name.
    """
    check_seed(seed)
    if not stage:
        raise InputError("stage", "the name of a random stage is empty")
    name = int.from_bytes(blake2b(stage.encode("utf-8"), digest_size=16).digest(), "little")
    state = np.random.SeedSequence([int(seed), name]).generate_state(1, np.uint64)
    return int(state[0] >> np.uint64(11))


def check_seed(seed: int) -> int:
    """The seed as a Python integer, or InputError: determinism forbids "no seed"."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError("seed", f"{seed!r} is not a non-negative integer")
    return int(seed)
