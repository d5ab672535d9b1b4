"""What a model returned: values, and how each of them came about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.errors import InputError, unknown_name
from levelone.status import Status
from levelone.uncertainty.distributions import FloatArray

_FAILED = np.array([status.value for status in Status if status.failed])


@dataclass(frozen=True, eq=False)
class Responses:
    """Values of m responses on n runs.

    Parameters
    ----------
    values
        [n, m], float; NaN where the status is a failure, and only there.
    status
        [n, m], codes of :class:`levelone.status.Status`.
    names, units
        m of each.

    Raises
    ------
    InputError
        Shapes that disagree, a name given twice, an unknown code, a failed value that is not NaN, or a NaN that
        nothing explains.
    """

    values: FloatArray
    status: NDArray[np.int64]
    names: tuple[str, ...]
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=np.float64)
        status = np.array(self.status, dtype=np.int64)
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "units", tuple(self.units))
        if values.ndim != 2 or status.shape != values.shape:
            raise InputError("Responses", f"values {values.shape} and status {status.shape}: both must be [n, m]")
        if len(self.names) != values.shape[1] or len(self.units) != values.shape[1]:
            raise InputError(
                "Responses",
                f"{len(self.names)} names and {len(self.units)} units for {values.shape[1]} columns of values",
            )
        if len(set(self.names)) != len(self.names):
            raise InputError("Responses.names", f"a name is given twice in {', '.join(self.names)}")
        _check_codes(values, status, self.names)
        values.setflags(write=False)
        status.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "status", status)

    @classmethod
    def from_values(cls, values: ArrayLike, names: Sequence[str], units: Sequence[str] | None = None) -> Responses:
        """Responses of a model that reports no status: what is not finite becomes NaN with ``Status.MODEL_FAILED``."""
        array = np.array(values, dtype=np.float64)
        finite = np.isfinite(array)
        array[~finite] = np.nan
        status = np.where(finite, Status.OK.value, Status.MODEL_FAILED.value)
        return cls(array, status, tuple(names), tuple(units) if units is not None else ("1",) * len(names))

    def __len__(self) -> int:
        return self.values.shape[0]

    def index(self, name: str) -> int:
        """Column of a response; InputError with the closest valid name."""
        try:
            return self.names.index(name)
        except ValueError:
            raise unknown_name("response", name, self.names) from None

    def column(self, name: str) -> FloatArray:
        """Values of one response, [n]."""
        return self.values[:, self.index(name)]

    def codes(self, name: str) -> NDArray[np.int64]:
        """Status codes of one response, [n]."""
        return self.status[:, self.index(name)]

    def failed(self, name: str) -> NDArray[np.bool_]:
        """Where one response is undefined, [n]."""
        return np.isin(self.codes(name), _FAILED)

    def counts(self, name: str) -> dict[Status, int]:
        """How often each outcome occurred, commonest first."""
        codes, counts = np.unique(self.codes(name), return_counts=True)
        pairs = sorted(zip(codes, counts, strict=True), key=lambda pair: (-pair[1], pair[0]))
        return {Status(int(code)): int(count) for code, count in pairs}


def _check_codes(values: FloatArray, status: NDArray[np.int64], names: tuple[str, ...]) -> None:
    unknown = ~np.isin(status, [code.value for code in Status])
    if unknown.any():
        row, column = np.argwhere(unknown)[0]
        raise InputError(f"Responses.status[{row}, {names[column]}]", f"unknown code {status[row, column]}")
    wrong = np.isin(status, _FAILED) != np.isnan(values)
    if wrong.any() or np.isinf(values).any():
        row, column = np.argwhere(wrong | np.isinf(values))[0]
        code = Status(int(status[row, column]))
        raise InputError(
            f"Responses.values[{row}, {names[column]}]",
            f"{values[row, column]} with status {code.name}: NaN belongs to a failure and to nothing else",
        )
