"""Rows of the page of derivatives: geometry, static and dynamic derivatives with their error bars, as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from levelone.aerodynamics.derivatives import Derivatives, Static
from levelone.aerodynamics.geometry import Geometry, Surface
from levelone.report import derivatives_labels as labels
from levelone.report import symbols
from levelone.report.formatting import UNDEFINED, number

#: significant digits of a value without an error bar, and decimals at most that are not written as a power of ten
_DIGITS, _MOST_DECIMALS = 5, 5


def surface_rows(geometry: Geometry) -> list[dict[str, Any]]:
    """One row for each surface: size, position and angles in deg."""
    return [
        {
            "name": each.name, "sides": "both sides" if each.mirrored else "one",
            "position": ", ".join(number(x) for x in each.position),
            "span": number(each.span), "chords": _ends(each), "sweep": _degrees(each.sweep), "dihedral": _degrees(each.dihedral),
            "incidence": _degrees(each.incidence), "twist": _degrees(each.twist),
            "section": f"camber line of {len(each.camber)} points" if each.camber else "flat",
            "panels": f"{each.chordwise} × {each.strips}", "spacing": f"{each.chord_spacing}, {each.span_spacing}",
        }
        for each in geometry.surfaces
    ]  # fmt: skip


def _ends(surface: Surface) -> str:
    root, tip = number(surface.root_chord), number(surface.tip_chord)
    return root if root == tip else f"{root} to {tip}"


def _degrees(angle: float) -> str:
    return number(math.degrees(angle))


def static_rows(geometry: Geometry, static: Static) -> list[dict[str, Any]]:
    """Coefficients at rest and static derivatives, each with its error bar and what the geometry's own grid is off by.

    Symmetric geometries have no coupling between motions in the plane of symmetry and others: those zeros are left out.
    """
    symmetric = all(surface.mirrored for surface in geometry.surfaces)
    rows = []
    for column in _columns(static.coefficients, "longitudinal" if symmetric else "all"):
        parts = static.rest[column], static.rest_error[column], static.ordinary_rest[column]
        rows.append(_row(labels.symbol_html(static.coefficients[column], "0"), "at rest in the stream", *parts))
    for index, motion in enumerate(static.motions):
        axis = "longitudinal" if motion in ("alpha", "q") else "lateral"
        for column in _columns(static.coefficients, axis if symmetric else "all"):
            parts = static.value[index, column], static.error[index, column], static.ordinary[index, column]
            rows.append(_row(labels.symbol_html(static.coefficients[column], motion), labels.STEADY_WORDS[motion], *parts))
    return rows


def _columns(names: Sequence[str], axis: str) -> list[int]:
    wanted = names if axis == "all" else labels.COEFFICIENTS[axis]
    return [index for index, name in enumerate(names) if name in wanted]


def _row(symbol: str, words: str, value: float, error: float, ordinary: float) -> dict[str, Any]:
    shown, half = rounded(value, error)
    return {"symbol": symbol, "words": words, "value": shown, "error": half,
            "off": off(value, error, ordinary)}  # fmt: skip


def rounded(value: float, error: float) -> tuple[str, str]:
    """A value and the half-width of its error bar, to the second digit of the bar."""
    if math.isnan(value) or math.isnan(error):
        return number(value, _DIGITS), UNDEFINED
    if not (error > 0.0 and math.isfinite(value)):
        return number(value, _DIGITS), f"± {number(error, 2)}"
    decimals = 1 - math.floor(math.log10(error))
    if not 0 <= decimals <= _MOST_DECIMALS:
        before = math.floor(math.log10(abs(value))) + 1 if value else 1
        return number(value, max(1, before + decimals)), f"± {number(error, 2)}"
    shown = f"{value:.{decimals}f}"
    return shown.replace("-", "−" if float(shown) else ""), f"± {error:.{decimals}f}"


def off(value: float, error: float, ordinary: float) -> str:
    """How far the ordinary grid is off: in percent where the value is well above its error bar, else as it is."""
    difference = ordinary - value
    if math.isnan(difference):
        return UNDEFINED
    if difference == 0.0:
        return "0"
    if abs(value) > 10.0 * error:
        return f"{number(100.0 * difference / abs(value), 2)} %"
    return number(difference, 2)


def dynamic_tables(derivatives: Derivatives, axis: str, speeds: Sequence[float], chord: float) -> list[dict[str, Any]]:
    """A table for each motion of an axis: in-phase and out-of-phase parts of each coefficient against k."""
    names = [name for name in labels.COEFFICIENTS[axis] if name not in unchanged(derivatives, axis)]
    return [
        {
            "title": labels.WORDS[motion], "coefficients": names, "in_phase": [symbols.html(name) for name in names],
            "quadrature": [labels.quadrature_html(motion, name) for name in names],
            "rows": [_at(derivatives, motion, names, index, speeds, chord) for index in range(len(derivatives.k))],
        }
        for motion in labels.MOTIONS[axis]
        if motion in derivatives.motions
    ]  # fmt: skip


def _at(
    derivatives: Derivatives, motion: str, names: Sequence[str], index: int, speeds: Sequence[float], chord: float
) -> dict[str, Any]:
    row, k = derivatives.motions.index(motion), float(derivatives.k[index])
    cells = []
    for name in names:
        at = (row, index, derivatives.coefficients.index(name))
        inside, ahead = derivatives.in_phase[at], derivatives.quadrature[at]
        cells.append({
            "in_phase": " ".join(rounded(inside, derivatives.in_phase_error[at])),
            "quadrature": " ".join(rounded(ahead, derivatives.quadrature_error[at])),
            "off": off(ahead, derivatives.quadrature_error[at], derivatives.ordinary_quadrature[at]),
        })  # fmt: skip
    return {"k": number(k), "cells": cells, "frequencies": [number(k * speed / (math.pi * chord), 3) for speed in speeds]}


def unchanged(derivatives: Derivatives, axis: str) -> list[str]:
    """Coefficients of an axis that none of its motions changes: the drag of a geometry without load at rest."""
    rows = [index for index, motion in enumerate(derivatives.motions) if motion in labels.MOTIONS[axis]]

    def zero(name: str) -> bool:
        column = derivatives.coefficients.index(name)
        return not (derivatives.in_phase[rows, :, column].any() or derivatives.quadrature[rows, :, column].any())

    return [name for name in labels.COEFFICIENTS[axis] if zero(name)]


def undefined(derivatives: Derivatives, static: Static) -> tuple[int, int]:
    """How many values are undefined, and of how many."""
    arrays = (derivatives.in_phase, derivatives.quadrature, static.value, static.rest)
    return sum(int(np.isnan(each).sum()) for each in arrays), sum(each.size for each in arrays)
