"""Error bars beside true errors, from much finer grids."""

from __future__ import annotations

import numpy as np
from shapes import geometry, tail, wing

from levelone.aerodynamics.derivatives import dynamic, kinked
from levelone.aerodynamics.frequency import oscillate, prepare
from levelone.aerodynamics.geometry import Surface
from levelone.aerodynamics.lattice import build


def surface(*place: object, **changes: object) -> Surface:
    return Surface(*place, chordwise=6, strips=6, **changes)  # type: ignore[arg-type]


def shapes():
    origin = (0.0, 0.0, 0.0)
    plate = Surface("plate", (1.08, 0.3605, -0.1), 0.2, 0.13, 0.13, dihedral=np.pi / 2, chordwise=4, strips=4)
    return {
        "wing": geometry(wing(6, 6)), "wing and tail": geometry(wing(6, 6), tail(4, 4)),
        "swept": geometry(surface("wing", origin, 1.5, 0.4, 0.2, sweep=0.5)),
        "tapered": geometry(surface("wing", origin, 1.5, 0.3, 0.12, dihedral=0.1)),
        "short": geometry(surface("wing", origin, 0.39, 0.26, 0.26)),
        "tandem": geometry(wing(6, 6), surface("second", (0.8, 0.0, 0.1), 1.2, 0.26, 0.26)),
        "plates": geometry(wing(6, 6, incidence=0.08), tail(4, 4), plate),
    }  # fmt: skip


def bars_and_errors(shape, finest):
    """Error bars of lift and moment in pitch and heave, both parts, at two reduced frequencies, and the true errors."""
    k = np.array([0.05, 0.3])
    found = dynamic(shape, k, ("pitch", "heave"))
    fine = [oscillate(prepare(build(shape, halves)), k, ("pitch", "heave"), np.zeros(3)) for halves in finest]
    ratio = finest[1] / finest[0]
    orders = (1, 2) if kinked(shape) else (2,)
    limit = np.mean([fine[1] + (fine[1] - fine[0]) / (ratio**order - 1.0) for order in orders], axis=0)
    at = [found.coefficients.index(name) for name in ("C_L", "C_m")]
    bars = [found.in_phase_error[:, :, at], found.quadrature_error[:, :, at]]
    truth = [limit.real[:, :, at], limit.imag[:, :, at] / k[None, :, None]]
    errors = [np.abs(found.in_phase[:, :, at] - truth[0]), np.abs(found.quadrature[:, :, at] - truth[1])]
    return np.ravel(bars), np.ravel(errors)
