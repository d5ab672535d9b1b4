"""Derivatives of variants of a geometry: what happens to pitch damping when one thing changes, or is read in another way.

A variant is a :class:`Case`. Functions below make variants of a geometry (tail arm, reference point, incidence, end plates ...);
:func:`oscillations` and :func:`quasi_steady` compute a list of them, on three grids each. A variant that cannot be built (surfaces
that intersect, say) is NaN and carries the reason in words.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.derivatives import STEADY, dynamic, static
from levelone.aerodynamics.geometry import Geometry, Surface
from levelone.errors import InputError, unknown_name

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

COEFFICIENTS = ("C_L", "C_m")
"""Last axis of the arrays of :class:`Oscillations`."""
QUASI_STEADY = ("C_Lalpha", "C_malpha", "C_Lq", "C_mq")
"""Last axis of the arrays of :class:`QuasiSteady`."""
_COLUMNS = [NAMES.index(name) for name in COEFFICIENTS]


@dataclass(frozen=True)
class Case:
    """A geometry with a label for its row, and the point that it pitches about, m (None: its reference point)."""

    label: str
    geometry: Geometry
    centre: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Oscillations:
    """Response of cases to oscillations of unit angle, with the half-widths of its error bars.

    ``response`` is complex [case, motion, k, 2]: in phase + i k quadrature, of C_L and C_m, 1/rad. ``error`` is that of the
    quadrature, divided by k. ``reasons`` says why a case is NaN and is empty for the others.
    """

    labels: tuple[str, ...]
    motions: tuple[str, ...]
    k: FloatArray
    response: ComplexArray
    error: FloatArray
    reasons: tuple[str, ...]

    @property
    def quadrature(self) -> FloatArray:
        """Out-of-phase part over k, [case, motion, k, 2]: C_q + C_alphadot for pitch, C_alphadot for heave, C_q for the rate."""
        return np.asarray(self.response.imag / self.k[:, None])

    def at(self, motion: str) -> FloatArray:
        """Quadrature [case, k, 2] of one motion."""
        if motion not in self.motions:
            raise unknown_name("motion", motion, self.motions)
        return self.quadrature[:, self.motions.index(motion)]


@dataclass(frozen=True)
class QuasiSteady:
    """C_Lalpha, C_malpha, C_Lq, C_mq of cases [case, 4]: limits, errors, the cases' own grid, and why a row is NaN."""

    labels: tuple[str, ...]
    value: FloatArray
    error: FloatArray
    ordinary: FloatArray
    reasons: tuple[str, ...]


def oscillations(cases: Sequence[Case], k: ArrayLike, motions: tuple[str, ...] = ("pitch", "heave", "rate")) -> Oscillations:
    """Responses of all cases at reduced frequencies k [k] = omega c/(2V).

    Raises
    ------
    InputError
        A reduced frequency that is not positive, or an unknown motion: these concern every case. What is wrong with one case only
        gives a NaN row and its reason.
    """
    k = np.atleast_1d(np.asarray(k, dtype=np.float64))
    shape = (len(cases), len(motions), len(k), len(COEFFICIENTS))
    response, error = np.full(shape, complex(np.nan, np.nan)), np.full(shape, np.nan)
    reasons = []
    for i, case in enumerate(cases):
        try:
            found = dynamic(case.geometry, k, motions, case.centre)
        except InputError as problem:
            if problem.field in ("k", "motion"):
                raise
            reasons.append(str(problem))
            continue
        response[i] = (found.in_phase + 1j * k[:, None] * found.quadrature)[..., _COLUMNS]
        error[i] = found.quadrature_error[..., _COLUMNS]
        reasons.append("")
    return Oscillations(tuple(case.label for case in cases), motions, k, response, error, tuple(reasons))


def quasi_steady(cases: Sequence[Case]) -> QuasiSteady:
    """Steady derivatives of all cases; pitch rate and moment are about the reference point, whatever a case's ``centre``."""
    value, error, ordinary = (np.full((len(cases), len(QUASI_STEADY)), np.nan) for _ in range(3))
    rows = [STEADY.index("alpha"), STEADY.index("q")]
    reasons = []
    for i, case in enumerate(cases):
        try:
            found = static(case.geometry)
        except InputError as problem:
            reasons.append(str(problem))
            continue
        for target, source in ((value, found.value), (error, found.error), (ordinary, found.ordinary)):
            target[i] = source[np.ix_(rows, _COLUMNS)].ravel()
        reasons.append("")
    return QuasiSteady(tuple(case.label for case in cases), value, error, ordinary, tuple(reasons))


def transferred(pitch: ComplexArray, heave: ComplexArray, k: FloatArray, axis: float, moment: float) -> ComplexArray:
    """Response to pitch about another axis, with moments about another point, of a geometry that carries no mean load.

    Parameters
    ----------
    pitch, heave
        [..., k, 2] responses (C_L, C_m) to pitch about the reference point and to heave, moments about it.
    k
        [k].
    axis, moment
        Pitch axis and moment point, in reference chords aft of the reference point.

    Notes
    -----
    Kinematics only: turning about an axis x aft is turning about the reference point and heaving with the incidence
    -i omega x/V = -2 i k x/c; a moment about a point x aft gains C_L x/c.
    """
    found = pitch - 2j * axis * k[:, None] * heave
    return np.stack([found[..., 0], found[..., 1] + moment * found[..., 0]], axis=-1)


def crossing(parameter: ArrayLike, values: ArrayLike, target: float) -> FloatArray:
    """Parameters at which a cubic spline through values [n] of a scan takes a target, ascending; none outside the scan.

    Rows that are NaN are left out; at least three must remain.

    Raises
    ------
    InputError
        Fewer than three values that are finite, or parameters that do not increase.
    """
    x, y = np.asarray(parameter, dtype=np.float64), np.asarray(values, dtype=np.float64)
    good = np.isfinite(y)
    if good.sum() < 3:
        raise InputError("values", f"{good.sum()} of {len(y)} are finite; a curve needs three")
    if not np.all(np.diff(x) > 0.0):
        raise InputError("parameter", "must increase from value to value")
    return np.asarray(CubicSpline(x[good], y[good]).solve(target, extrapolate=False), dtype=np.float64)


def changed(geometry: Geometry, surface: str, **fields: object) -> Geometry:
    """The geometry with fields of one :class:`Surface` replaced."""
    _surface(geometry, surface)
    surfaces = (replace(each, **fields) if each.name == surface else each for each in geometry.surfaces)  # type: ignore[arg-type]
    return replace(geometry, surfaces=tuple(surfaces))


def moved(geometry: Geometry, surfaces: Sequence[str], aft: float = 0.0, up: float = 0.0) -> Geometry:
    """The geometry with some surfaces moved, m."""
    for name in surfaces:
        x, y, z = _surface(geometry, name).position
        geometry = changed(geometry, name, position=(x + aft, y, z + up))
    return geometry


def only(geometry: Geometry, *surfaces: str) -> Geometry:
    """The geometry with no other surfaces than these; reference values stay."""
    return replace(geometry, surfaces=tuple(_surface(geometry, name) for name in surfaces))


def about(geometry: Geometry, aft: float) -> Geometry:
    """The geometry with its reference point, and with it the pitch axis, moved aft by a number of reference chords."""
    x, y, z = geometry.reference_point
    return replace(geometry, reference_point=(x + aft * geometry.chord, y, z))


def with_end_plates(geometry: Geometry, surface: str, height: float, strips: int = 4) -> Geometry:
    """The geometry with plates of a height (m, half above and half below) on the tips of a level, mirrored surface."""
    bearer = _surface(geometry, surface)
    if bearer.dihedral != 0.0 or not bearer.mirrored:
        raise InputError(f"surface.{surface}", "end plates are made for a mirrored surface without dihedral")
    x, y, z = bearer.position
    plate = Surface(
        f"{surface} end plate",
        (x + bearer.span * np.tan(bearer.sweep), y + bearer.span, z - 0.5 * height),
        height,
        bearer.tip_chord,
        bearer.tip_chord,
        dihedral=np.pi / 2,
        chordwise=bearer.chordwise,
        strips=strips,
        chord_spacing=bearer.chord_spacing,
        span_spacing=bearer.span_spacing,
    )
    return replace(geometry, surfaces=(*geometry.surfaces, plate))


def with_uniform_strips(geometry: Geometry, counts: dict[str, tuple[int, int]]) -> Geometry:
    """The geometry with panels alike along the span, as many along chord and span (one side) as ``counts`` says by surface."""
    for name, (chordwise, strips) in counts.items():
        geometry = changed(geometry, name, chordwise=chordwise, strips=strips, span_spacing="uniform")
    return geometry


def _surface(geometry: Geometry, name: str) -> Surface:
    found = {each.name: each for each in geometry.surfaces}
    if name not in found:
        raise unknown_name("surface", name, found)
    return found[name]
