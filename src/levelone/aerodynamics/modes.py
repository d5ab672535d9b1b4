"""Rigid small motions of a body, as the relative wind that they give to its points.

Geometry frame: x aft, y right, z up, free stream along +x of unit speed. Angles and rates in the sense of the pilot: pitch nose
up, roll right wing down, yaw nose right, sideslip with the wind from the right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from levelone.errors import unknown_name

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: motions symmetric in y = 0: pitch about a point; heave with incidence alpha; pitch rate with constant incidence (the path
#: pitches along)
LONGITUDINAL = ("pitch", "heave", "rate")
#: motions antisymmetric in y = 0: sideslip of constant heading, roll, yaw about a point, yaw rate with constant sideslip
LATERAL = ("sideslip", "roll", "yaw", "yaw_rate")
#: incidence and sideslip that belong to a unit of each motion
INCIDENCE = {"pitch": 1.0, "heave": 1.0, "alpha": 1.0}
SIDESLIP = {"sideslip": 1.0, "beta": 1.0, "yaw": -1.0}
_STEADY = ("alpha", "q", "beta", "p", "r")


def relative_wind(motion: str, points: FloatArray, centre: FloatArray, kappa: float) -> ComplexArray:
    """Wind [p, 3] relative to the free stream's speed at points [p, 3], m, that move with unit amplitude.

    Parameters
    ----------
    motion
        One of the oscillations, of unit angle (rad) and of omega/V = ``kappa`` (1/m), or "alpha", "beta" (rad) and "q", "p",
        "r" (rate over V, 1/m) for steady motion.
    centre
        Point [3] about which rotations are meant, m.
    """
    if motion not in (*LONGITUDINAL, *LATERAL, *_STEADY):
        raise unknown_name("motion", motion, (*LONGITUDINAL, *LATERAL, *_STEADY))
    wind = np.zeros(points.shape, dtype=np.complex128)
    wind[:, 2] += INCIDENCE.get(motion, 0.0)
    wind[:, 1] -= SIDESLIP.get(motion, 0.0)
    axis, rate = {"q": (1, 1.0), "p": (0, 1.0), "r": (2, 1.0)}.get(motion, _oscillating(motion, kappa))
    x, y, z = (points - centre).T
    turn = np.zeros_like(points)
    if axis == 0:
        turn[:, 1], turn[:, 2] = -z, y
    elif axis == 1:
        turn[:, 0], turn[:, 2] = -z, x
    else:
        turn[:, 0], turn[:, 1] = -y, x
    return np.asarray(wind + rate * turn)


def _oscillating(motion: str, kappa: float) -> tuple[int, complex]:
    """Axis and rate of rotation of an oscillation of unit angle."""
    axis = {"pitch": 1, "rate": 1, "roll": 0, "yaw": 2, "yaw_rate": 2}.get(motion, 1)
    return axis, 0.0 if motion in ("heave", "sideslip", "alpha", "beta") else 1j * kappa


def antisymmetric(motion: str) -> bool:
    """Whether the motion turns its sign in the mirror y = 0."""
    return motion in (*LATERAL, "beta", "p", "r")
