"""Counts that a user gives: whole numbers, not too small, powers of two where a Sobol sequence needs them."""

from __future__ import annotations

import numpy as np

from levelone.errors import InputError


def check_count(name: str, value: int, least: int) -> int:
    """The count as a Python integer, or InputError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(name, f"{value!r}; a whole number of at least {least} is needed")
    return int(value)


def check_power_of_two(name: str, value: int) -> int:
    """A count of points of a Sobol sequence, which is balanced only for powers of two; InputError names the nearest."""
    value = check_count(name, value, 2)
    if value & (value - 1):
        near = 1 << (value.bit_length() - 1)
        raise InputError(name, f"{value} is not a power of two; the nearest are {near} and {2 * near}")
    return value
