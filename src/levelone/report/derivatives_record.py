"""A pitch oscillation marched in time, beside the frequency domain: its hysteresis loop, and the derivatives read from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.extraction import derivative, harmonic, single_point
from levelone.aerodynamics.history import LoadHistory
from levelone.errors import InputError
from levelone.report import derivatives_labels as labels
from levelone.report.derivatives_figures import Loop
from levelone.report.formatting import number

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Record:
    """Loads of a pitch oscillation A sin(omega t).

    Parameters
    ----------
    history
        Its loads.
    k
        Reduced frequency omega c/(2V).
    omega
        Angular frequency, rad/s.
    amplitude
        A, rad.

    Raises
    ------
    InputError
        A value that is not positive.
    """

    history: LoadHistory
    k: float
    omega: float
    amplitude: float

    def __post_init__(self) -> None:
        for name in ("k", "omega", "amplitude"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError(name, f"{getattr(self, name)} is not a positive number")

    @property
    def theta(self) -> FloatArray:
        """Pitch attitude [t], rad, nose up."""
        rotation = self.history.rotation
        return np.arctan2(rotation[:, 0, 2], rotation[:, 2, 2])


def loop_of(record: Record, names: tuple[str, ...]) -> Loop:
    """The last period of a record."""
    history = record.history
    last = history.time > history.time[-1] - 2.0 * math.pi / record.omega * (1.0 + 1e-9)
    found = {name: history.coefficients[last, NAMES.index(name)] for name in names}
    return Loop(f"time domain, $k$ = {record.k:.3g}, last period", record.theta[last], found)


def rows(record: Record, names: tuple[str, ...]) -> list[dict[str, Any]]:
    """Derivatives by harmonic fit and by the single-point method, with what is to be said of them."""
    history, found = record.history, []
    for name in names:
        values = history.coefficients[:, NAMES.index(name)]
        fitted = derivative(harmonic(history.time, values, record.omega), record.amplitude, record.k)
        read = single_point(history.time, values, record.theta, record.omega, record.k)
        found.append({
            "symbol": labels.quadrature_html("pitch", name),
            "fitted": number(fitted.quadrature, 5), "read": number(read.quadrature, 5),
            "status": "; single point: ".join(dict.fromkeys((fitted.outcome.text, read.outcome.text))),
        })  # fmt: skip
    return found
