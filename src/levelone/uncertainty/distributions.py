"""Distributions of one uncertain input, each defined by its inverse distribution function.

Every distribution is a frozen value with ``ppf(u)`` (array in, array out, increasing in u), ``mean`` and ``support``.
A share of samples over an input that is only known as an interval is a share of that interval, not a probability:
Interval and Evidence say so of an input, and are drawn from as uniform where a method needs a distribution.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri
from scipy.stats import truncnorm

from levelone.errors import InputError
from levelone.uncertainty.evidence import Evidence
from levelone.uncertainty.parameter_checks import check_increasing, check_numbers, check_positive, path

FloatArray = NDArray[np.float64]


@runtime_checkable
class Distribution(Protocol):
    """What a factor needs of a distribution."""

    @property
    def mean(self) -> float:
        """Expected value."""

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest possible value; infinite where unbounded."""

    def ppf(self, u: ArrayLike) -> FloatArray:
        """Inverse distribution function at probabilities ``u`` in [0, 1], any shape."""


@dataclass(frozen=True)
class Uniform:
    """Every value between ``low`` and ``high`` equally likely."""

    low: float
    high: float

    def __post_init__(self) -> None:
        check_numbers(self)
        check_increasing(self, "low", "high")

    @property
    def mean(self) -> float:
        """Expected value."""
        return 0.5 * (self.low + self.high)

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest possible value."""
        return self.low, self.high

    def ppf(self, u: ArrayLike) -> FloatArray:
        """Inverse distribution function; exact at both ends."""
        u = np.asarray(u, dtype=np.float64)
        return self.low * (1.0 - u) + self.high * u


@dataclass(frozen=True)
class Interval(Uniform):
    """A fixed value somewhere between ``low`` and ``high``, about which nothing else is known: an epistemic input.

    Where a method needs a distribution it is treated as uniform; a probability box keeps it an interval
    (:mod:`levelone.uncertainty.probability_box`).
    """

    epistemic: ClassVar[bool] = True


@dataclass(frozen=True)
class Normal:
    """Normal distribution with mean ``mean`` and standard deviation ``std``; unbounded."""

    mean: float
    std: float

    def __post_init__(self) -> None:
        check_numbers(self)
        check_positive(self, "std")

    @property
    def support(self) -> tuple[float, float]:
        """Infinite on both sides."""
        return -math.inf, math.inf

    def ppf(self, u: ArrayLike) -> FloatArray:
        """Inverse distribution function; infinite at 0 and 1."""
        return self.mean + self.std * ndtri(np.asarray(u, dtype=np.float64))


@dataclass(frozen=True)
class TruncatedNormal:
    """Normal distribution of parameters ``centre`` and ``std``, conditioned on ``low`` to ``high``.

    ``centre`` and ``std`` are those before truncation; ``mean`` is the mean of what remains.
    """

    centre: float
    std: float
    low: float
    high: float

    def __post_init__(self) -> None:
        check_numbers(self)
        check_positive(self, "std")
        check_increasing(self, "low", "high")

    def _ends(self) -> tuple[float, float]:
        return (self.low - self.centre) / self.std, (self.high - self.centre) / self.std

    @property
    def mean(self) -> float:
        """Mean after truncation."""
        return float(truncnorm.mean(*self._ends(), loc=self.centre, scale=self.std))

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest possible value."""
        return self.low, self.high

    def ppf(self, u: ArrayLike) -> FloatArray:
        """Inverse distribution function, accurate far in the tails."""
        value = truncnorm.ppf(np.asarray(u, dtype=np.float64), *self._ends(), loc=self.centre, scale=self.std)
        return np.clip(value, self.low, self.high)


@dataclass(frozen=True)
class Triangular:
    """Density rising linearly from ``low`` to ``mode`` and falling to ``high``; the mode may lie on an end."""

    low: float
    mode: float
    high: float

    def __post_init__(self) -> None:
        check_numbers(self)
        check_increasing(self, "low", "high")
        if not self.low <= self.mode <= self.high:
            raise InputError(path(self, "mode"), f"{self.mode:g} lies outside low = {self.low:g} to high = {self.high:g}")

    @property
    def mean(self) -> float:
        """Expected value."""
        return (self.low + self.mode + self.high) / 3.0

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest possible value."""
        return self.low, self.high

    def ppf(self, u: ArrayLike) -> FloatArray:
        """Inverse distribution function."""
        u = np.asarray(u, dtype=np.float64)
        width = self.high - self.low
        rising = self.low + np.sqrt(u * width * (self.mode - self.low))
        falling = self.high - np.sqrt((1.0 - u) * width * (self.high - self.mode))
        return np.where(u * width < self.mode - self.low, rising, falling)


@dataclass(frozen=True)
class LogNormal:
    """exp of a normal variable of mean ``mu`` and standard deviation ``sigma`` (both of the natural logarithm)."""

    mu: float
    sigma: float

    def __post_init__(self) -> None:
        check_numbers(self)
        check_positive(self, "sigma")

    @property
    def mean(self) -> float:
        """Expected value of the variable itself."""
        return math.exp(self.mu + 0.5 * self.sigma**2)

    @property
    def support(self) -> tuple[float, float]:
        """From zero to infinity."""
        return 0.0, math.inf

    def ppf(self, u: ArrayLike) -> FloatArray:
        """Inverse distribution function; 0 at 0, infinite at 1."""
        return np.exp(self.mu + self.sigma * ndtri(np.asarray(u, dtype=np.float64)))


@dataclass(frozen=True)
class Discrete:
    """A finite set of numbers with probabilities in proportion to ``weights`` (equal by default).

    Values are kept in increasing order, so that ``ppf`` increases; a cell of the unit interval is closed below and
    open above, as the elementary intervals of a Sobol point set are.
    """

    values: tuple[float, ...]
    weights: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        values = np.asarray(self.values, dtype=np.float64)
        weights = np.ones(values.shape) if self.weights is None else np.asarray(self.weights, dtype=np.float64)
        if values.ndim != 1 or values.size < 2 or not np.isfinite(values).all():
            raise InputError(path(self, "values"), f"{self.values!r}: two or more finite numbers are needed")
        if np.unique(values).size != values.size:
            raise InputError(path(self, "values"), f"{self.values!r} holds a value twice; give it a weight instead")
        if weights.shape != values.shape or not np.isfinite(weights).all() or (weights <= 0.0).any():
            raise InputError(path(self, "weights"), f"{self.weights!r}: one positive number for each value is needed")
        order = np.argsort(values)
        object.__setattr__(self, "values", tuple(values[order].tolist()))
        object.__setattr__(self, "weights", tuple((weights[order] / weights.sum()).tolist()))

    @property
    def mean(self) -> float:
        """Expected value."""
        return float(np.dot(self.values, self.weights or ()))

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest value of the set."""
        return self.values[0], self.values[-1]

    def ppf(self, u: ArrayLike) -> FloatArray:
        """Inverse distribution function: a staircase."""
        inner = np.cumsum(self.weights or ())[:-1]
        return np.asarray(self.values)[np.searchsorted(inner, np.asarray(u, dtype=np.float64), side="right")]


DISTRIBUTIONS: Mapping[str, type] = MappingProxyType(
    {
        "uniform": Uniform,
        "interval": Interval,
        "evidence": Evidence,
        "normal": Normal,
        "truncated_normal": TruncatedNormal,
        "triangular": Triangular,
        "lognormal": LogNormal,
        "discrete": Discrete,
    }
)
"""Names that a study file uses."""


def uniform_around(
    value: float, low: float, high: float, kind: Literal["absolute", "relative"] = "absolute", *, field: str = "range"
) -> Uniform:
    """Uniform distribution given as a range about a nominal value.

    Parameters
    ----------
    value
        Nominal value.
    low, high
        Ends of the range, low < high: offsets in the unit of ``value`` ("absolute"), or fractions of it ("relative":
        ``value * (1 + low)`` to ``value * (1 + high)``, sorted, since a negative value turns the ends round).
    field
        Path that an error names.

    Raises
    ------
    InputError
        Range reversed or empty, a number that is not finite, a relative range of zero, an unknown kind.
    """
    for name, number in (("value", value), ("low", low), ("high", high)):
        if not math.isfinite(number):
            raise InputError(field, f"{name} = {number!r} is not a finite number")
    if not low < high:
        raise InputError(field, f"range reversed or empty: low = {low:g}, high = {high:g}")
    if kind == "absolute":
        return Uniform(value + low, value + high)
    if kind != "relative":
        raise InputError(field, f"unknown kind {kind!r}; allowed: absolute, relative")
    if value == 0.0:
        raise InputError(field, "a relative range of a value that is zero has no width; give an absolute range")
    ends = sorted((value * (1.0 + low), value * (1.0 + high)))
    return Uniform(ends[0], ends[1])
