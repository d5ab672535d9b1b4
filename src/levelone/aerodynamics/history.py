"""Loads on a body against time, and how they are summed from its panels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from levelone.aerodynamics import loads
from levelone.aerodynamics.body import Body
from levelone.aerodynamics.coefficients import Reference, coefficients
from levelone.aerodynamics.lattice import FloatArray
from levelone.aerodynamics.motion import Pose
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.particles import Particles
from levelone.aerodynamics.wake_panels import Panels


@dataclass(frozen=True)
class FinalWake:
    """Wake at the end of a run, in the wind-tunnel frame, for drawing.

    Panels and particles of the half that was solved, and of the other half by mirroring in y = 0 where ``mirrored``; ``body``
    [p, 4, 3] the corners of the bound rings.
    """

    panels: Panels
    particles: Particles
    mirrored: bool
    body: FloatArray


@dataclass(frozen=True)
class LoadHistory:
    """Loads in the axes of the wind tunnel (x along the stream, y right, z up), SI; NaN from the first step that failed on.

    Moments are about the reference point, which moves with the body. The drag is the induced drag: the force along the stream on
    the vortices of the body, suction of the leading edge included.
    """

    time: FloatArray  # [t] s
    names: tuple[str, ...]  # of the surfaces
    force: FloatArray  # [t, surface, 3] N
    moment: FloatArray  # [t, surface, 3] N m
    by_surface: FloatArray  # [t, surface, 6] coefficients of each surface, see coefficients.NAMES
    strip_lift: FloatArray  # [t, m] lift of each strip over its width, N/m
    gamma: FloatArray  # [t, n] circulation of the bound rings, m^2/s
    rotation: FloatArray  # [t, 3, 3] of the body
    air: FloatArray  # [t, 3] undisturbed wind relative to the reference point, m/s
    outcome: Outcome
    words: str
    wake: FinalWake | None  # None where the run failed
    removed: int  # particles cut off the end of the wake; of one half where the wake is mirrored
    cut_incidence: FloatArray  # [t] rad, what the wake behind the cut would change the incidence by, at most; see the theory page

    @property
    def coefficients(self) -> FloatArray:
        """Coefficients [t, 6] of the whole body: C_L, C_D, C_Y, C_l, C_m, C_n in the axes of the wind tunnel."""
        return np.asarray(self.by_surface.sum(axis=1))

    def in_body_axes(self, reference: Reference, pressure: float) -> FloatArray:
        """Coefficients [t, 6] along the axes of the geometry; ``pressure`` is the dynamic pressure, Pa."""
        return self._turned(self.rotation, reference, pressure)

    def in_wind_axes(self, reference: Reference, pressure: float) -> FloatArray:
        """Coefficients [t, 6] with lift and drag across and along the air that meets the reference point, as heave turns it."""
        incidence = np.arctan2(self.air[:, 2], self.air[:, 0])
        turns = Rotation.from_rotvec(incidence[:, None] * [0.0, -1.0, 0.0]).as_matrix()
        return self._turned(turns, reference, pressure)

    def _turned(self, axes: FloatArray, reference: Reference, pressure: float) -> FloatArray:
        turned = [np.einsum("tij,ti->tj", axes, total.sum(axis=1)) for total in (self.force, self.moment)]
        return np.asarray(coefficients(reference, *turned) / (2.0 * pressure))


class Recorder:
    """Collects the loads of the steps of a run; rows that are never written stay NaN."""

    def __init__(self, body: Body, steps: int, density: float) -> None:
        lattice = body.lattice
        self.body, self.density, self.step = body, density, 0
        self.of_surface = (lattice.surface[lattice.strip] == np.arange(len(lattice.names))[:, None]).astype(float)
        shapes = {"force": (len(lattice.names), 3), "moment": (len(lattice.names), 3), "strip_lift": (len(lattice.first),)}
        shapes |= {"gamma": (len(lattice.bound),), "rotation": (3, 3), "air": (3,), "cut": ()}
        self.rows = {name: np.full((steps, *shape), np.nan) for name, shape in shapes.items()}

    def past(self, steps: int) -> FloatArray:
        """Circulations [p] recorded a number of steps before the one that comes next."""
        return np.asarray(self.rows["gamma"][self.step - steps, : self.body.panels])

    def add(
        self, pose: Pose, air: FloatArray, wind: FloatArray, sides: FloatArray, gamma: FloatArray, rate: FloatArray, cut: float
    ) -> bool:
        """Loads of a step; False if they are not finite.

        ``air`` [3] undisturbed wind relative to the reference point; ``wind`` [p, 3] relative to the bound vortices, in the frame
        of the geometry, ``sides`` [n, 2, 3] relative to the side segments;
        ``gamma`` [p] and its ``rate`` [p] of the panels solved for; ``cut`` the incidence by the wake that was cut off.
        """
        body, lattice, carrier = self.body, self.body.lattice, self.body.carrier
        circulation = body.whole(gamma)
        bound = loads.bound_forces(carrier, body.whole(wind, vector=True), loads.net(lattice, circulation))
        side = loads.side_forces(carrier, sides, circulation)
        ring = loads.rate_forces(carrier, body.whole(rate))
        arms = [points - lattice.reference_point for points in (lattice.midpoint, carrier.side_middle, carrier.ring_middle)]
        turning = np.cross(arms[0], bound) + np.cross(arms[1], side).sum(axis=1) + np.cross(arms[2], ring)
        force = self.density * (bound + side.sum(axis=1) + ring) @ pose.rotation.T
        if not (np.isfinite(force).all() and np.isfinite(turning).all()):
            return False
        row = {
            "force": self.of_surface @ force, "moment": self.density * (self.of_surface @ turning) @ pose.rotation.T,
            "strip_lift": np.add.reduceat(force[:, 2], lattice.first) / lattice.width, "gamma": circulation,
            "rotation": pose.rotation, "air": air, "cut": cut,
        }  # fmt: skip
        for name, value in row.items():
            self.rows[name][self.step] = value
        self.step += 1
        return True

    def history(self, dt: float, speed: float, outcome: Outcome, words: str, wake: FinalWake | None, removed: int) -> LoadHistory:
        """Everything as one value; steps are at dt, 2 dt, ..."""
        lattice, rows = self.body.lattice, self.rows
        time = np.asarray(dt * np.arange(1, len(rows["cut"]) + 1), dtype=np.float64)
        by_surface = coefficients(lattice, rows["force"], rows["moment"]) / (self.density * speed**2)
        return LoadHistory(
            time, lattice.names, rows["force"], rows["moment"], np.asarray(by_surface), rows["strip_lift"], rows["gamma"],
            rows["rotation"], rows["air"], outcome, words, wake, removed, rows["cut"],
        )  # fmt: skip
