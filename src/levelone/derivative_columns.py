"""Stability derivatives as columns: everything for files, what matters for the eye."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from levelone.aerodynamics.derivatives import Derivatives, Static

Columns = dict[str, Sequence[Any]]
#: coefficients that motions in the plane of symmetry, and across it, give rise to
OF_AXIS = {"longitudinal": ("C_L", "C_m", "C_D"), "lateral": ("C_Y", "C_l", "C_n")}


def record(found: Sequence[tuple[float, Derivatives]], axis: str) -> Columns:
    """One row for each motion, reduced frequency and speed (m/s); ``found`` holds the derivatives of each speed.

    Quadrature parts are divided by the reduced frequency of the motion (that of the span for lateral ones); each value is followed
    by the half-width of its error bar in a column of its own name with ``_error``.
    """
    motions, k = found[0][1].motions, found[0][1].k
    rows = [(speed, each, i, j) for i in range(len(motions)) for j in range(len(k)) for speed, each in found]
    columns: Columns = {
        "motion": [each.motions[i] for _, each, i, _ in rows],
        "k": [float(each.k[j]) for _, each, _, j in rows],
        "speed": [speed for speed, *_ in rows],
    }
    for name in OF_AXIS[axis]:
        for part in ("in_phase", "quadrature"):
            for error in ("", "_error"):
                at = [(getattr(each, part + error), i, j, each.coefficients.index(name)) for _, each, i, j in rows]
                columns[f"{name}_{part}{error}"] = [float(values[i, j, c]) for values, i, j, c in at]
    return columns


def table(found: Derivatives, axis: str) -> Columns:
    """Quadrature parts for the eye: value, error bar, and how far the ordinary grid is off."""
    columns: Columns = {
        "motion": [motion for motion in found.motions for _ in found.k],
        "k": [float(k) for _ in found.motions for k in found.k],
    }
    for name in OF_AXIS[axis][:2] if axis == "longitudinal" else OF_AXIS[axis]:
        c = found.coefficients.index(name)
        value, error = found.quadrature[:, :, c].ravel(), found.quadrature_error[:, :, c].ravel()
        columns[f"{name} quadrature"] = value.tolist()
        columns[f"+- {name}"] = error.tolist()
        columns[f"grid {name}"] = (found.ordinary_quadrature[:, :, c].ravel() - value).tolist()
    return columns


def static_table(found: Static, axis: str) -> Columns:
    """Steady derivatives for the eye, in the same form."""
    motions = ("alpha", "q") if axis == "longitudinal" else ("beta", "p", "r")
    wanted = [(name, motion) for name in OF_AXIS[axis] for motion in motions]
    at = [(found.motions.index(motion), found.coefficients.index(name)) for name, motion in wanted]
    names = [f"{name}{motion}" for name, motion in wanted]
    value, error = [float(found.value[place]) for place in at], [float(found.error[place]) for place in at]
    ordinary = [float(found.ordinary[place]) for place in at]
    if axis == "longitudinal":
        rest = [found.coefficients.index(name) for name in OF_AXIS[axis]]
        names = [f"{name}0" for name in OF_AXIS[axis]] + names
        value, error = [float(found.rest[c]) for c in rest] + value, [float(found.rest_error[c]) for c in rest] + error
        ordinary = [float(found.ordinary_rest[c]) for c in rest] + ordinary
    off = [a - b for a, b in zip(ordinary, value, strict=True)]
    return {"derivative": names, "value": value, "+-": error, "ordinary grid off by": off}
