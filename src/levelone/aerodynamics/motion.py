"""Rigid motions of a body as functions of time.

Wind-tunnel frame: x along the undisturbed stream, y right, z up, SI units; the frame of the geometry lies on it when nothing is
displaced. A point x of the geometry is at ``position + rotation @ x``. Angles in the sense of the pilot: pitch nose up, roll right
wing down, yaw nose right, sideslip with the wind from the right. The oscillations are those of
:mod:`levelone.aerodynamics.modes` at finite amplitude; to first order they give the same relative wind.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from levelone.aerodynamics.modes import LATERAL, LONGITUDINAL
from levelone.errors import InputError, unknown_name

FloatArray = NDArray[np.float64]
#: angle rates in the sense of the pilot, along the axes x aft, y right, z up
_AXES = {
    "pitch": (0.0, 1.0, 0.0),
    "rate": (0.0, 1.0, 0.0),
    "roll": (-1.0, 0.0, 0.0),
    "yaw": (0.0, 0.0, -1.0),
    "yaw_rate": (0.0, 0.0, -1.0),
}
#: velocity of the centre, in units of airspeed times angle
_PATHS = {"heave": (0.0, 0.0, -1.0), "rate": (0.0, 0.0, 1.0), "sideslip": (0.0, 1.0, 0.0), "yaw_rate": (0.0, 1.0, 0.0)}
#: what counts as no motion out of the plane of symmetry
_SYMMETRIC = 1e-14


@dataclass(frozen=True)
class Pose:
    """Where a body is and how it moves, in the wind-tunnel frame.

    Position [3] (m) and velocity [3] (m/s) of the geometry's origin, rotation [3, 3] and its rate [3] (rad/s).
    """

    position: FloatArray
    rotation: FloatArray
    velocity: FloatArray
    rate: FloatArray

    def points(self, body: FloatArray) -> FloatArray:
        """Where points [..., 3] of the geometry are, m."""
        return np.asarray(body @ self.rotation.T + self.position)

    def velocities(self, body: FloatArray) -> FloatArray:
        """Velocities [..., 3] of points [..., 3] of the geometry, m/s."""
        return np.asarray(self.velocity + np.cross(self.rate, body @ self.rotation.T))

    @property
    def symmetric(self) -> bool:
        """Whether the plane y = 0 of the body lies in that of the tunnel and stays in it."""
        out = (self.position[1], self.velocity[1], self.rate[0], self.rate[2], self.rotation[1, 1] - 1.0)
        return bool(np.max(np.abs(out)) < _SYMMETRIC)


@dataclass(frozen=True)
class Motion:
    """A rigid motion: ``pose(t)`` at any time t >= 0 (s), and its name."""

    name: str
    pose: Callable[[float], Pose]


def steady(incidence: float = 0.0, sideslip: float = 0.0, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Motion:
    """A body at rest, turned about ``centre`` [3] (m) nose up and nose left by incidence and sideslip (rad)."""
    turned = _about(_rotation("yaw", -_finite("sideslip", sideslip)) @ _rotation("pitch", _finite("incidence", incidence)), centre)
    return Motion("steady", lambda t: turned)


def oscillation(
    kind: str, amplitude: float, omega: float, speed: float, centre: ArrayLike = (0.0, 0.0, 0.0), incidence: float = 0.0
) -> Motion:
    """amplitude sin(omega t) of one of the motions of :mod:`levelone.aerodynamics.modes`.

    Parameters
    ----------
    kind
        "pitch", "roll", "yaw": turn about ``centre``; "heave", "sideslip": move so that incidence or sideslip oscillate;
        "rate", "yaw_rate": turn, and move the centre where the nose points to, so that incidence or sideslip stay.
    amplitude
        Angle, rad. The centre's velocity is speed times angle: incidence is its arctangent, and a pure rate keeps it but for a
        third of the angle's cube.
    omega, speed
        Angular frequency, rad/s, and airspeed, m/s.
    centre
        Point [3] of the geometry, m.
    incidence
        Mean incidence, rad: the body is turned about the centre first.

    Raises
    ------
    InputError
        Unknown kind, frequency or speed that is not positive, values that are not finite.
    """
    if kind not in (*LONGITUDINAL, *LATERAL):
        raise unknown_name("motion", kind, (*LONGITUDINAL, *LATERAL))
    _finite("amplitude", amplitude), _positive("omega", omega), _positive("speed", speed)
    path, mean = speed * np.array(_PATHS.get(kind, (0.0, 0.0, 0.0))), _rotation("pitch", _finite("incidence", incidence))

    def pose(t: float) -> Pose:
        angle, rate = amplitude * math.sin(omega * t), amplitude * omega * math.cos(omega * t)
        # counted from t = 0, so that the wake starts where the body is
        moved = path * (amplitude / omega * (1.0 - math.cos(omega * t)))
        return _about(_rotation(kind, angle) @ mean, centre, rate * _axis(kind), moved, angle * path)

    return Motion(kind, pose)


def step(incidence: float, speed: float) -> Motion:
    """A body that plunges at t = 0 all at once, so that the incidence is ``incidence`` (rad, small: the tangent is meant)."""
    fall = np.array([0.0, 0.0, -_positive("speed", speed) * _finite("incidence", incidence)])
    return Motion("step", lambda t: Pose(fall * t, np.eye(3), fall, np.zeros(3)))


def ramp(angle: float, duration: float, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Motion:
    """Pitch from 0 to ``angle`` (rad) within ``duration`` (s) about ``centre`` [3] (m), without a jump in rate or acceleration."""
    _finite("angle", angle), _positive("duration", duration)

    def pose(t: float) -> Pose:
        share = min(max(t / duration, 0.0), 1.0)
        turned = angle * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        rate = angle / duration * 30.0 * share**2 * (1.0 - share) ** 2
        return _about(_rotation("pitch", turned), centre, rate * _axis("pitch"))

    return Motion("ramp", pose)


def flying(motion: Motion, velocity: ArrayLike) -> Motion:
    """The same motion of a body that also flies with a constant velocity [3] (m/s): seen by an observer in another frame."""
    along = np.asarray(velocity, dtype=float)

    def pose(t: float) -> Pose:
        own = motion.pose(t)
        return Pose(own.position + along * t, own.rotation, own.velocity + along, own.rate)

    return Motion(f"{motion.name}, flying", pose)


def _about(
    rotation: FloatArray,
    centre: ArrayLike,
    rate: FloatArray | None = None,
    moved: FloatArray | None = None,
    path: FloatArray | None = None,
) -> Pose:
    """Pose of a body turned about a centre [3] of the geometry that is displaced by ``moved`` and moves with ``path``."""
    at = np.asarray(centre, dtype=float)
    turn = np.zeros(3) if rate is None else rate
    arm = -rotation @ at
    position = at + arm + (0.0 if moved is None else moved)
    return Pose(position, rotation, np.cross(turn, arm) + (0.0 if path is None else path), turn)


def _axis(kind: str) -> FloatArray:
    return np.array(_AXES.get(kind, (0.0, 0.0, 0.0)))


def _rotation(kind: str, angle: float) -> FloatArray:
    return np.asarray(Rotation.from_rotvec(angle * _axis(kind)).as_matrix())


def _finite(field: str, value: float) -> float:
    if not math.isfinite(value):
        raise InputError(field, f"{value} is not a finite number")
    return value


def _positive(field: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(field, f"{value} is not a positive number")
    return value
