"""Numbers as a reader of tables wants them."""

from __future__ import annotations

import math

UNDEFINED = "undefined"
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float, digits: int = 4) -> str:
    """A value to so many significant digits; the word "undefined" for NaN."""
    if math.isnan(value):
        return UNDEFINED
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    text = f"{value:.{digits}g}"
    mantissa, _, exponent = text.partition("e")
    text = f"{mantissa}·10{str(int(exponent)).translate(_SUPERSCRIPT)}" if exponent else text
    return text.replace("-", "−", 1) if text.startswith("-") else text


def percent(share: float) -> str:
    """A share of 0 to 1 in percent, with one decimal; two for what would read 0.0 or 100.0 and is not."""
    if math.isnan(share):
        return UNDEFINED
    decimals = 2 if 0.0 < share < 5e-4 or 1.0 - 5e-4 < share < 1.0 else 1
    return f"{100.0 * share:.{decimals}f} %"


def interval(ends: tuple[float, float] | list[float], digits: int = 3) -> str:
    """``low to high``."""
    low, high = ends
    if math.isnan(low) and math.isnan(high):
        return UNDEFINED
    return f"{number(low, digits)} to {number(high, digits)}"


def percent_interval(ends: tuple[float, float] | list[float]) -> str:
    """Ends of an interval of a share, in percent."""
    low, high = ends
    if math.isnan(low) and math.isnan(high):
        return UNDEFINED
    return f"{percent(low).removesuffix(' %')} to {percent(high)}"
