"""Uncertain inputs by name, and the map from the unit cube to their physical values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from levelone.errors import InputError, unknown_name
from levelone.uncertainty.copula import UNIT_MARGIN, dependent, score_correlation
from levelone.uncertainty.distributions import Distribution, FloatArray


@dataclass(frozen=True)
class Factor:
    """One uncertain input.

    Parameters
    ----------
    name
        Name in files and figures.
    distribution
        Its distribution, in the unit ``unit``.
    target
        Name of what it sets in the model, where that differs from ``name``; this package never reads it.
    unit
        Unit of the values, for labels.
    source
        Where the distribution comes from, or "assumed: why".
    """

    name: str
    distribution: Distribution
    target: str | None = field(default=None, kw_only=True)
    unit: str = field(default="1", kw_only=True)
    source: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InputError("Factor.name", f"{self.name!r} is not a name")
        if not isinstance(self.distribution, Distribution):
            raise InputError(f"factor {self.name}", f"{self.distribution!r} is not a distribution")

    @property
    def bounded(self) -> bool:
        """Whether both ends of the support are finite."""
        return bool(np.isfinite(self.distribution.support).all())


@dataclass(frozen=True)
class FactorSpace:
    """The factors of a study, in order.

    Parameters
    ----------
    factors
        The factors.
    correlation
        [k, k] Spearman rank correlations of a Gaussian copula (see :mod:`levelone.uncertainty.copula`); independent factors
        by default. They are those of the coordinates in the unit cube: a discrete factor, whose values are tied, shows less.

    Raises
    ------
    InputError
        No factor, a name given twice, correlations that no set of variables can have (the error names the pair to change).
    """

    factors: tuple[Factor, ...]
    correlation: tuple[tuple[float, ...], ...] | None = None

    def __init__(self, factors: Iterable[Factor], correlation: ArrayLike | None = None) -> None:
        object.__setattr__(self, "factors", tuple(factors))
        if not self.factors:
            raise InputError("factors", "at least one factor is needed")
        twice = [name for name, count in Counter(self.names).items() if count > 1]
        if twice:
            raise InputError("factors", f"name given twice: {', '.join(twice)}")
        rank = None if correlation is None else np.array(correlation, dtype=np.float64)
        if rank is not None:
            score_correlation(rank, self.names)
            # A unit matrix says what leaving it out says: the two spaces are equal, and map points bit for bit alike.
            rank = None if np.array_equal(rank, np.eye(len(self))) else rank
        object.__setattr__(self, "correlation", None if rank is None else tuple(map(tuple, rank.tolist())))

    def __len__(self) -> int:
        return len(self.factors)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the factors, in the order of the columns."""
        return tuple(factor.name for factor in self.factors)

    @property
    def correlated(self) -> bool:
        """Whether any two factors depend on each other."""
        return self.correlation is not None

    def require_independent(self, method: str, instead: str) -> None:
        """Refuse correlated factors for a method that moves one factor and holds the others, naming what is offered instead."""
        if self.correlation is not None:
            rank = np.abs(np.array(self.correlation) - np.eye(len(self)))
            i, j = np.unravel_index(rank.argmax(), rank.shape)
            raise InputError(
                "factors",
                f"{self.names[i]} and {self.names[j]} are correlated, and {method} moves factors independently of one another; "
                f"{instead}",
            )

    def score_correlation(self) -> FloatArray:
        """Correlations of the normal scores of the copula, [k, k]; the unit matrix for independent factors."""
        return np.eye(len(self)) if self.correlation is None else score_correlation(self.correlation, self.names)

    @property
    def bounded(self) -> bool:
        """Whether every factor has finite ends."""
        return all(factor.bounded for factor in self.factors)

    def require_bounded(self, method: str) -> None:
        """Refuse unbounded factors for a method that visits the ends of the cube, naming the first of them."""
        for factor in self.factors:
            if not factor.bounded:
                raise InputError(
                    f"factor {factor.name}",
                    f"{method} visits the ends of the range, and {type(factor.distribution).__name__} has none; "
                    "declare a truncation (TruncatedNormal or another bounded distribution)",
                )

    def index(self, name: str) -> int:
        """Column of a factor; InputError with the closest valid name."""
        try:
            return self.names.index(name)
        except ValueError:
            raise unknown_name("factor", name, self.names) from None

    def __getitem__(self, name: str) -> Factor:
        return self.factors[self.index(name)]

    def transform(self, u: ArrayLike) -> FloatArray:
        """Physical values of points of the unit cube.

        Parameters
        ----------
        u
            [n, k], each coordinate in [0, 1]; the coordinates are independent also where the factors are correlated.

        Returns
        -------
        [n, k] values, each column in the unit of its factor. Coordinates of unbounded factors are kept 2**-31 away from
        0 and 1 (6.1 standard deviations of a normal variable), so that every value is finite. Correlated factors follow
        the Gaussian copula in the order of the factors: column j depends on coordinates 1 to j.

        Raises
        ------
        InputError
            Wrong number of columns, a coordinate outside [0, 1] or NaN.
        """
        u = np.asarray(u, dtype=np.float64)
        if u.ndim != 2 or u.shape[1] != len(self):
            raise InputError("u", f"shape {u.shape}; [n, {len(self)}] is needed, one column for each factor")
        if not ((u >= 0.0) & (u <= 1.0)).all():
            raise InputError("u", "a coordinate of the unit cube lies outside 0 to 1 or is NaN")
        if self.correlation is not None:
            u = dependent(u, self.score_correlation())
        values = np.empty_like(u)
        for j, factor in enumerate(self.factors):
            column = u[:, j] if factor.bounded else np.clip(u[:, j], UNIT_MARGIN, 1.0 - UNIT_MARGIN)
            values[:, j] = factor.distribution.ppf(column)
        return values
