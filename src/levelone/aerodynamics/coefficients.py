"""Forces and moments as coefficients, with the signs of flight dynamics."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelone.aerodynamics.lattice import Lattice

#: order of the coefficients in every array
NAMES = ("C_L", "C_D", "C_Y", "C_l", "C_m", "C_n")
Coefficients = NDArray[Any]  # of float64 or complex128


class Reference(NamedTuple):
    """Area (m^2), chord and span (m) that coefficients refer to."""

    area: float
    chord: float
    span: float


def coefficients(lattice: Lattice | Reference, force: Coefficients, moment: Coefficients) -> Coefficients:
    """Coefficients [..., 6] of forces and moments [..., 3] over density, for a free stream of unit speed along +x.

    Geometry frame: x aft, y right, z up. C_L up, C_D aft, C_Y to the right; C_l right wing down, C_m nose up, C_n nose right.
    Divide by the square of the speed where it is not one.
    """
    force, moment = np.asarray(force), np.asarray(moment)
    by_area = 2.0 / lattice.area
    columns = (
        force[..., 2], force[..., 0], force[..., 1], -moment[..., 0] / lattice.span, moment[..., 1] / lattice.chord,
        -moment[..., 2] / lattice.span,
    )  # fmt: skip
    return by_area * np.stack(columns, axis=-1)


def in_wind_axes(change: Coefficients, mean: Coefficients, incidence: float) -> Coefficients:
    """Small change [6] in body axes as a change of lift and drag across and along the wind, which turns by ``incidence`` (rad)."""
    turned = change.copy()
    turned[0] -= mean[1] * incidence
    turned[1] += mean[0] * incidence
    return turned
