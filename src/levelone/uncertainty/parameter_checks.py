"""Checks that the parameters of distributions have in common; errors name class and parameter."""

from __future__ import annotations

import math
from dataclasses import fields
from numbers import Real

from levelone.errors import InputError


def check_numbers(distribution: object) -> None:
    """Refuse parameters that are not finite numbers, and store the rest as floats."""
    for item in fields(distribution):  # type: ignore[arg-type]
        value = getattr(distribution, item.name)
        if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
            raise InputError(path(distribution, item.name), f"{value!r} is not a finite number")
        object.__setattr__(distribution, item.name, float(value))


def check_increasing(distribution: object, low: str, high: str) -> None:
    """Refuse a range that is reversed or empty."""
    lower, upper = getattr(distribution, low), getattr(distribution, high)
    if not lower < upper:
        raise InputError(path(distribution, high), f"range reversed or empty: {low} = {lower:g}, {high} = {upper:g}")


def check_positive(distribution: object, name: str) -> None:
    """Refuse a parameter that is zero or negative."""
    value = getattr(distribution, name)
    if value <= 0.0:
        raise InputError(path(distribution, name), f"{value:g} is not positive")


def path(distribution: object, name: str) -> str:
    """Name of a parameter in errors, ``"Uniform.low"``."""
    return f"{type(distribution).__name__}.{name}"
