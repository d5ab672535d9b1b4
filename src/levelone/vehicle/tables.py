"""Interpolants built once at load: airspeed schedules (once differentiable) and the rotor table (twice differentiable).

A table that is linear between its knots has no unique slope at a knot, so a linearisation there has no unique value. Schedules
in airspeed use the shape-preserving cubic of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 1980): it adds no extremes between
the knots, so a derivative cannot change sign where the data do not. The rotor table is smooth by construction and uses tensor
cubic B-splines on uniform grids (de Boor, A Practical Guide to Splines, ch. IX), whose four weights an axis are cheap.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from levelone.errors import InputError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Schedule:
    """Columns of numbers over one scheduling variable, held constant beyond the first and last knot.

    Parameters
    ----------
    knots
        [n_knots] increasing values of the scheduling variable (m/s for airspeed). One knot means constant everywhere.
    values
        [n_knots, n_columns].
    """

    knots: FloatArray
    values: FloatArray
    polynomials: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        knots = np.ascontiguousarray(self.knots, dtype=float)
        values = np.ascontiguousarray(self.values, dtype=float)
        if knots.ndim != 1 or values.ndim != 2 or len(values) != len(knots) or len(knots) == 0:
            raise InputError("schedule", f"{values.shape} values do not fit {knots.shape} knots")
        if not (np.all(np.isfinite(knots)) and np.all(np.isfinite(values))):
            raise InputError("schedule", "every knot and value must be a finite number")
        if np.any(np.diff(knots) <= 0):
            raise InputError("schedule", f"knots must increase, got {knots.tolist()}")
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "polynomials", piecewise_cubics(knots, values))


def piecewise_cubics(knots: FloatArray, values: FloatArray) -> FloatArray:
    """Power-form coefficients [n_segments, 4, n_columns], lowest power first, in the distance from each segment's left knot."""
    if len(knots) == 1:
        out = np.zeros((1, 4, values.shape[-1]))
        out[0, 0] = values[0]
        return out
    # SciPy's order is highest power first: [4, n_segments, n_columns]
    return np.ascontiguousarray(np.moveaxis(PchipInterpolator(knots, values, axis=0).c[::-1], 1, 0))


@dataclass(frozen=True)
class RotorTable:
    """Speed, thrust and torque of one rotor over throttle, airspeed and the angle of the flow to the rotor disc.

    Parameters
    ----------
    throttle
        [n_t] uniform, from 0 to 1.
    airspeed
        [n_v] uniform, from 0, m/s.
    angle
        [n_a] uniform, from -pi/2 (descent along the axis) through 0 (edgewise) to +pi/2 (climb), rad.
    values
        [n_t, n_v, n_a, 3]: rotational speed (rpm), thrust (N, along the rotor axis), torque (N m, positive, opposing rotation).
    source
        Where the numbers come from.
    spline
        [n_v + 2, n_a + 2, n_t + 2, 3] B-spline coefficients, made here.

    Notes
    -----
    A rotor averaged over a revolution sees only the size of the edgewise speed: the table mirrors about +-pi/2, and a
    negative airspeed at one angle is the positive airspeed at the opposite angle. Both symmetries are built into the spline,
    so that thrust has one slope at rest in every direction.
    """

    throttle: FloatArray
    airspeed: FloatArray
    angle: FloatArray
    values: FloatArray
    source: str = ""
    spline: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name, low, high in (("throttle", 0.0, 1.0), ("airspeed", 0.0, None), ("angle", -np.pi / 2, np.pi / 2)):
            _check_axis(name, getattr(self, name), low, high)
        shape = (len(self.throttle), len(self.airspeed), len(self.angle), 3)
        if self.values.shape != shape:
            raise InputError("rotor table", f"values of shape {self.values.shape}, expected {shape}")
        if not np.all(np.isfinite(self.values)):
            raise InputError("rotor table", f"{int(np.sum(~np.isfinite(self.values)))} values are not finite numbers")
        at_rest = self.values[:, 0]
        if np.ptp(at_rest, axis=1).max() > 1e-9 * np.abs(at_rest).max():
            raise InputError("rotor table", "at zero airspeed the flow has no angle: all rows there must be equal")
        object.__setattr__(self, "spline", _rotor_spline(self.values))

    @property
    def grid(self) -> FloatArray:
        """[3, 2] first node and nodes per unit of throttle, airspeed and angle."""
        return np.array([[a[0], (len(a) - 1) / (a[-1] - a[0])] for a in (self.throttle, self.airspeed, self.angle)])


def _check_axis(name: str, axis: FloatArray, low: float, high: float | None) -> None:
    path = f"rotor table, {name}"
    if axis.ndim != 1 or len(axis) < 5:
        raise InputError(path, f"needs at least five nodes, got {axis.size}")
    steps = np.diff(axis)
    if np.any(steps <= 0) or np.ptp(steps) > 1e-6 * steps.mean():
        raise InputError(path, "nodes must increase in equal steps")
    if abs(axis[0] - low) > 1e-6 or (high is not None and abs(axis[-1] - high) > 1e-6):
        raise InputError(
            path,
            f"must run from {low:.6g} to {'any speed' if high is None else f'{high:.6g}'}, got {axis[0]:.6g} to {axis[-1]:.6g}",
        )


def _spline_matrix(n: int, left: str, right: str) -> FloatArray:
    """Rows that tie n + 2 uniform cubic B-spline coefficients to n node values and two end conditions.

    End conditions: ``smooth`` (third derivative continuous at the last node but one), ``even`` or ``odd`` reflection.
    """
    matrix = np.zeros((n + 2, n + 2))
    for i in range(n):
        matrix[i + 1, i : i + 3] = (1 / 6, 4 / 6, 1 / 6)
    ends = {"smooth": (1.0, -4.0, 6.0, -4.0, 1.0), "even": (1.0, 0.0, -1.0), "odd": (1.0, 0.0, 1.0)}
    matrix[0, : len(ends[left])] = ends[left]
    matrix[-1, n + 2 - len(ends[right]) :] = ends[right][::-1]
    return matrix


def _spline_along(values: FloatArray, axis: int, left: str, right: str) -> FloatArray:
    moved = np.moveaxis(values, axis, 0)
    n = len(moved)
    rhs = np.zeros((n + 2, moved[0].size))
    rhs[1:-1] = moved.reshape(n, -1)
    solved: FloatArray = np.asarray(np.linalg.solve(_spline_matrix(n, left, right), rhs), dtype=float)
    return np.moveaxis(solved.reshape(n + 2, *moved.shape[1:]), 0, axis)


def _rotor_spline(values: FloatArray) -> FloatArray:
    along_throttle = _spline_along(values, 0, "smooth", "smooth")
    mirrored = along_throttle[:, :, ::-1]
    even = _spline_along(0.5 * (along_throttle + mirrored), 1, "even", "smooth")
    odd = _spline_along(0.5 * (along_throttle - mirrored), 1, "odd", "smooth")
    spline = _spline_along(even + odd, 2, "even", "even")
    return np.ascontiguousarray(spline.transpose(1, 2, 0, 3))
