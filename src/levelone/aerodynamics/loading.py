"""Where a lattice carries its load: circulation, pressure difference of each panel, load of each strip, for pictures and checks.

Per unit of a steady motion, as the static derivatives are: rad for alpha and beta, qc/(2V), pb/(2V) and rb/(2V) for rates; or at
rest in the stream. Unit speed and density. The equations are those of :mod:`levelone.aerodynamics.frequency` at zero frequency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from levelone.aerodynamics import modes
from levelone.aerodynamics.frequency import Plant, circulations, forces, forces_at_rest, wakes_at
from levelone.aerodynamics.lattice import FloatArray, Lattice
from levelone.errors import unknown_name

#: steady motions, as in the table of static derivatives
MOTIONS = ("alpha", "q", "beta", "p", "r")


@dataclass(frozen=True)
class Loading:
    """Load of panels [n] and strips [m], per unit of the motion, over density and the square of the speed."""

    circulation: FloatArray  # [n] of the bound rings over the speed, m
    force: FloatArray  # [n, 3] on the panels, geometry frame, m^2
    pressure: FloatArray  # [n] pressure difference over dynamic pressure, positive along the normal (lift of a level wing)
    normal: FloatArray  # [m] section coefficient of the force along the normals: c_l of a level wing at small incidence
    reaching: FloatArray  # [m] the same times local chord over reference chord: areas under it are shares of the total


def loading(plant: Plant, motion: str, centre: FloatArray | None = None) -> Loading:
    """Change of the load by a unit of a steady motion about a point [3] (the reference point if None), m.

    Raises
    ------
    InputError
        If there is no such motion.
    """
    if motion not in MOTIONS:
        raise unknown_name("motion", motion, MOTIONS)
    lattice = plant.lattice
    about = lattice.reference_point if centre is None else centre
    wakes = wakes_at(plant, 0.0)
    wind = modes.relative_wind(motion, lattice.collocation, about, 0.0)
    gamma = circulations(plant, wakes, wind[:, :, None], -1.0 if modes.antisymmetric(motion) else 1.0)[:, 0]
    bound, side = forces(plant, wakes, motion, gamma, about, 0.0)
    length = {"q": lattice.chord, "p": lattice.span, "r": lattice.span}.get(motion)
    return _loading(lattice, gamma.real, (bound + side.sum(axis=1)).real, 1.0 if length is None else 2.0 / length)


def at_rest(plant: Plant) -> Loading:
    """The load of the geometry at rest in the stream: its incidence, twist and camber."""
    bound, side = forces_at_rest(plant)
    return _loading(plant.lattice, plant.mean, bound + side.sum(axis=1), 1.0)


def panels(lattice: Lattice) -> FloatArray:
    """Corners [n, 4, 3] of the panels: left front, right front, right aft, left aft, m.

    The lattice holds its trailing edges and the quarter lines of its panels. Three quarters of a panel lie behind its quarter line,
    which gives its front from its aft side, panel by panel from the trailing edge on. Exact where the section is flat; with camber,
    the corners are off the mean line by a small part of the height of a panel.
    """
    corners = np.empty((len(lattice.bound), 4, 3))
    aft = lattice.edge.copy()
    for behind in range(int(lattice.count.max())):
        strips = np.flatnonzero(lattice.count > behind)
        panel = lattice.trailing[strips] - behind
        front = aft[strips] - (aft[strips] - lattice.bound[panel]) / 0.75
        corners[panel, :2], corners[panel, 2:] = front, aft[strips][:, ::-1]
        aft[strips] = front
    return corners


def areas(quads: FloatArray) -> FloatArray:
    """Areas [n] of quadrilaterals [n, 4, 3], m^2: half the product of their diagonals."""
    across = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    return np.asarray(0.5 * np.linalg.norm(across, axis=1))


def _loading(lattice: Lattice, gamma: FloatArray, force: FloatArray, scale: float) -> Loading:
    force = scale * force
    along = np.einsum("na,na->n", force, lattice.normal)
    load = 2.0 * np.add.reduceat(along, lattice.first) / lattice.width
    return Loading(scale * gamma, force, 2.0 * along / areas(panels(lattice)), load / lattice.chord_at, load / lattice.chord)
