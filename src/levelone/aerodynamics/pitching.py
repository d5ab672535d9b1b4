"""One pitch oscillation marched in time with a free wake, for pictures of the wake and of the hysteresis."""

from __future__ import annotations

import math

from levelone.aerodynamics.geometry import Geometry
from levelone.aerodynamics.history import LoadHistory
from levelone.aerodynamics.lattice import build
from levelone.aerodynamics.motion import oscillation
from levelone.aerodynamics.unsteady import Wake, simulate

#: reduced frequency omega c/(2V), amplitude (rad), length of the wake (chords)
K, AMPLITUDE, CUT = 0.2, math.radians(2.0), 12.0
#: two periods that can be compared, after one in which the start dies out
PERIODS = 3.05


def pitched(geometry: Geometry, speed: float) -> tuple[LoadHistory, float, float, float]:
    """Loads of a pitch oscillation about the reference point at an airspeed (m/s); its k, omega (rad/s) and amplitude (rad)."""
    lattice = build(geometry)
    omega = 2.0 * K * speed / geometry.chord
    dt = min(0.25 * geometry.chord, 0.5 * float(lattice.chord_at.min())) / speed
    steps = math.ceil(PERIODS * 2.0 * math.pi / (omega * dt))
    path = oscillation("pitch", AMPLITUDE, omega, speed, geometry.reference_point)
    return simulate(lattice, path, speed, dt, steps, Wake(kind="free", cut=CUT)), K, omega, AMPLITUDE
