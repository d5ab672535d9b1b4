"""Dynamic derivatives by marching in time: the cross-check of the frequency domain, with the same error bars.

Each oscillation runs for three periods on three similar grids, a time step being the time to travel one panel, so that one
extrapolation covers panel size and time step (second order together, see wake_start). The wake is prescribed and cut. What the
cut leaves out is extrapolated from two lengths on the coarsest grid, as the inverse square of the length, and counted into the bar
in full.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from levelone.aerodynamics.coefficients import NAMES, Reference
from levelone.aerodynamics.derivatives import Derivatives, check_frequencies, grids, kinked
from levelone.aerodynamics.extraction import derivative, harmonic
from levelone.aerodynamics.extrapolation import extrapolate
from levelone.aerodynamics.geometry import Geometry
from levelone.aerodynamics.lattice import FloatArray, Lattice
from levelone.aerodynamics.modes import LATERAL, LONGITUDINAL
from levelone.aerodynamics.motion import oscillation
from levelone.aerodynamics.unsteady import Wake, simulate

#: rad; small enough for the linear part, large enough for rounding
AMPLITUDE = math.radians(0.5)
#: length of the wake, reference chords
CUT = 30.0
PERIODS = 3.0


def marched(
    geometry: Geometry,
    k: FloatArray,
    motions: tuple[str, ...] = LONGITUDINAL,
    speed: float = 1.0,
    threads: int = 2,
    progress: Callable[[str, int, int], None] | None = None,
) -> Derivatives:
    """Derivatives of oscillations about the reference point at an airspeed (m/s), in the form of :func:`derivatives.dynamic`.

    A run that fails or does not become periodic gives NaN, and its words in ``failures``.

    Raises
    ------
    InputError
        As :func:`derivatives.dynamic`; a speed that is not positive.
    """
    k = check_frequencies(geometry, k)
    lattices = grids(geometry)
    plans = [(lattice, CUT) for lattice in lattices] + [(lattices[0], 0.5 * CUT)]
    shape = (len(plans), len(motions), len(k), len(NAMES))
    found, failures = np.full((2, *shape), np.nan), []
    for done, (p, i, j) in enumerate(np.ndindex(shape[:-1])):
        lattice, cut = plans[p]
        parts, words = _one(lattice, motions[i], float(k[j]), speed, cut, threads)
        found[:, p, i, j] = parts
        failures += [f"{motions[i]} at k = {k[j]:g}, {len(lattice.bound)} panels: {words}"] if words else []
        if progress is not None:
            progress("time domain", done + 1, len(plans) * len(motions) * len(k))
    span = np.array([geometry.span / geometry.chord if motion in LATERAL else 1.0 for motion in motions])
    return _converged(found / np.stack([np.ones_like(span), span])[:, None, :, None, None], geometry, k, motions, tuple(failures))


def _one(lattice: Lattice, motion: str, k: float, speed: float, cut: float, threads: int) -> tuple[FloatArray, str]:
    """In-phase and quadrature parts [2, 6] per rad, and words if they are undefined."""
    omega = 2.0 * k * speed / lattice.chord
    dt = float(np.median(lattice.last)) / speed
    steps = math.ceil(PERIODS * 2.0 * math.pi / omega / dt) + 1
    path = oscillation(motion, AMPLITUDE, omega, speed, lattice.reference_point)
    history = simulate(lattice, path, speed, dt, steps, Wake(cut=cut), threads=threads)
    if history.outcome.failed:
        return np.full((2, len(NAMES)), np.nan), history.words
    reference = Reference(lattice.area, lattice.chord, lattice.span)
    # lift and drag against the wind, as alpha turns it; side force and moments along the body, which rolls and yaws
    axes = history.in_body_axes if motion in LATERAL else history.in_wind_axes
    values = axes(reference, 0.5 * 1.225 * speed**2)
    fits = [derivative(harmonic(history.time, column, omega), AMPLITUDE, k) for column in values.T]
    size = np.max(np.abs(values), axis=0)
    quiet = size < 1e-9 * np.max(size)
    parts = np.array([[0.0 if still else getattr(fit, part) for fit, still in zip(fits, quiet, strict=True)] for part in _PARTS])
    words = {fit.outcome.text for fit, still in zip(fits, quiet, strict=True) if fit.outcome.failed and not still}
    return parts, "; ".join(sorted(words))


_PARTS = ("in_phase", "quadrature")


def _converged(
    found: FloatArray, geometry: Geometry, k: FloatArray, motions: tuple[str, ...], failures: tuple[str, ...]
) -> Derivatives:
    """Limits over grids, time steps and lengths of the wake of parts [2, plan, motion, k, 6]."""
    longer = (found[:, 0] - found[:, 3]) / 3.0
    real, imaginary = (extrapolate(part[:3], kinked(geometry)) for part in found)
    return Derivatives(
        motions, k, NAMES, real.value + longer[0], imaginary.value + longer[1], real.error + np.abs(longer[0]),
        imaginary.error + np.abs(longer[1]), real.ordinary, imaginary.ordinary, failures,
    )  # fmt: skip
