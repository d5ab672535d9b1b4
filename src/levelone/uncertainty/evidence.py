"""Dempster-Shafer structures: what is known of an input that is neither a number nor a distribution.

A structure is a list of focal intervals with masses: evidence of weight m says that the value lies in this interval, and
nothing about where in it. Several inputs give boxes, one for each combination of focal intervals, with the product of the
masses (independent evidence).

Sources: Shafer, A Mathematical Theory of Evidence, 1976; Ferson et al., SAND2002-4015, 2003, section 2; Dakota 6.24 theory
manual, chapter "Epistemic Methods", section "Dempster-Shafer theory of evidence".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.errors import InputError
from levelone.uncertainty.parameter_checks import path

FloatArray = NDArray[np.float64]

#: deviation of the sum of the masses from 1 that counts as rounding
_ROUNDING = 1e-6
#: combinations of focal intervals that are searched at most: each costs a search of its own
MOST_BOXES = 64


class Bounded(Protocol):
    """What a box needs of an input that has no focal intervals of its own."""

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest possible value."""


@dataclass(frozen=True)
class Evidence:
    """Focal intervals with masses that sum to 1: an epistemic input.

    Intervals may overlap, nest and lie apart; one without width stands for an exact value. They are kept in increasing
    order. Where a method needs a distribution (``mean``, ``ppf``), a mixture of uniform distributions on the focal intervals
    with the masses as weights is taken.

    Parameters
    ----------
    intervals
        [m] pairs of low and high.
    masses
        [m] positive numbers.

    Raises
    ------
    InputError
        An interval that is reversed, given twice or not finite, masses that are not positive or do not sum to 1, another
        number of masses than of intervals, a structure without any width.
    """

    intervals: tuple[tuple[float, float], ...]
    masses: tuple[float, ...]
    epistemic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        ends = self._checked_intervals()
        masses = _numbers(self.masses)
        if masses is None or masses.shape != ends.shape[:1] or not (masses > 0.0).all():
            raise InputError(
                path(self, "masses"), f"{self.masses!r}: one positive number for each of {len(ends)} intervals is needed"
            )
        if abs(masses.sum() - 1.0) > _ROUNDING:
            raise InputError(path(self, "masses"), f"{self.masses!r} sum to {masses.sum():.10g}; they must sum to 1")
        order = np.lexsort((ends[:, 1], ends[:, 0]))
        object.__setattr__(self, "intervals", tuple((low, high) for low, high in ends[order].tolist()))
        object.__setattr__(self, "masses", tuple((masses[order] / masses.sum()).tolist()))

    def _checked_intervals(self) -> FloatArray:
        """The intervals, [m, 2]."""
        field = path(self, "intervals")
        ends = _numbers(self.intervals)
        if ends is None or ends.ndim != 2 or ends.shape[1] != 2:
            raise InputError(field, f"{self.intervals!r}: a list of pairs [low, high] of finite numbers is needed")
        for low, high in ends.tolist():
            if low > high:
                raise InputError(field, f"range reversed: low = {low:g}, high = {high:g}")
        if len(np.unique(ends, axis=0)) != len(ends):
            raise InputError(field, f"{self.intervals!r} holds an interval twice; give it the sum of the masses instead")
        if ends.min() == ends.max():
            raise InputError(field, f"{self.intervals!r} has no width: the value is known exactly, and no uncertain input")
        return ends

    @property
    def mean(self) -> float:
        """Mean of the mixture of uniform distributions."""
        return math.fsum(0.5 * mass * (low + high) for (low, high), mass in zip(self.intervals, self.masses, strict=True))

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest end of the focal intervals."""
        return self.intervals[0][0], max(high for _, high in self.intervals)

    def ppf(self, u: ArrayLike) -> FloatArray:
        """Inverse distribution function of the mixture of uniform distributions: it jumps over gaps between the intervals."""
        ends, masses = np.array(self.intervals), np.array(self.masses)
        low, width = ends[:, 0], np.diff(ends)[:, 0]
        knots = np.unique(ends)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside = np.clip((knots[:, None] - low) / width, 0.0, 1.0)
        # an exact value is a step of the distribution function: its left and right limit are two points of the inverse
        left = np.where(width > 0.0, inside, knots[:, None] > low) @ masses
        right = np.where(width > 0.0, inside, knots[:, None] >= low) @ masses
        share = np.column_stack([left, right]).ravel()
        share[-1] = 1.0  # whatever the masses were rounded to
        return np.interp(np.asarray(u, dtype=np.float64), share, np.repeat(knots, 2))


@dataclass(frozen=True, eq=False)
class FocalBoxes:
    """Combinations of focal intervals of e epistemic inputs.

    Attributes
    ----------
    low, high
        [b, e] ends of each box, in the units of the inputs.
    mass
        [b] products of the masses; they sum to 1.
    """

    low: FloatArray
    high: FloatArray
    mass: FloatArray

    def __len__(self) -> int:
        return len(self.mass)


def focal_boxes(inputs: Sequence[Bounded]) -> FocalBoxes:
    """The boxes that the focal intervals of several inputs make, the last input varying fastest.

    Parameters
    ----------
    inputs
        Distributions, at least one; what is no :class:`Evidence` counts as one interval, its support.

    Raises
    ------
    InputError
        No input, an input without finite ends, more than ``MOST_BOXES`` boxes.
    """
    if not inputs:
        raise InputError("epistemic", "no input is epistemic: there is no box to search")
    parts = [_structure(each) for each in inputs]
    count = math.prod(len(intervals) for intervals, _ in parts)
    if count > MOST_BOXES:
        raise InputError("epistemic", f"{count} combinations of focal intervals; at most {MOST_BOXES} are searched")
    ends = np.array(list(product(*(intervals for intervals, _ in parts))))
    masses = np.array(list(product(*(masses for _, masses in parts))))
    return FocalBoxes(ends[:, :, 0], ends[:, :, 1], masses.prod(axis=1))


def _structure(given: Bounded) -> tuple[tuple[tuple[float, float], ...], tuple[float, ...]]:
    if isinstance(given, Evidence):
        return given.intervals, given.masses
    low, high = given.support
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError("epistemic", f"{given!r} has no ends: an epistemic input needs a finite interval")
    return ((low, high),), (1.0,)


def _numbers(given: object) -> FloatArray | None:
    """Finite numbers as an array; None for anything else."""
    try:
        array = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return array if array.size and array.ndim and np.isfinite(array).all() else None
