"""What the slipstreams of a vehicle's lift rotors do to the lift of its wing and tail in slow level flight.

A vehicle's rotors become actuator discs, a geometry becomes a lattice in their mean wind. The change of C_L0 is computed for one
base case and for variations of it, one at a time: of the numbers of the computation, whose spread is the numerical uncertainty, and
of what no source gives (places of the discs, thrust, camber), whose spread says what the result is conditional on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from levelone.aerodynamics import wing_in_wake
from levelone.aerodynamics.actuator_disc import Disc, Vector
from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.disc_wake import Marching, settle
from levelone.aerodynamics.frequency import prepare, steady
from levelone.aerodynamics.geometry import Geometry
from levelone.aerodynamics.lattice import build
from levelone.aerodynamics.outcome import Outcome
from levelone.config.geometry_file import load_geometry
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError, unknown_name
from levelone.vehicle.vehicle import Vehicle

FloatArray = NDArray[np.float64]
#: radius of the lift rotors, m: study, Table 1 (vertical propeller diameter 0.178 m); vehicle files hold no radius
RADIUS = 0.089
#: C_L0 without and with slipstreams by the study's predecessor (its Ref. 6): study, Tables 3 to 5
CLEAN, WITH_WAKES = 0.6268, 0.4524
#: core of the wing's vortices, and length of its wake, where they act on slipstreams, in chords
WING_CORE, WING_WAKE = 0.25, 8.0
#: points of a camber line
CAMBER_POINTS = 41


@dataclass(frozen=True)
class Case:
    """One case.

    Parameters
    ----------
    label, group
        Name, and ``"base"``, ``"numerical"``, ``"assumption"`` or ``"diagnosis"`` (what does it).
    clean
        C_L0 without slipstreams that the wing's camber is chosen for; None: camber as in the geometry.
    camber_at
        Place of the largest camber of a NACA four-digit mean line, chords.
    lift_on_wing
        Whether the rotors carry the weight less the clean lift, or all of it.
    rise, aft, spread
        Discs moved up, aft, and away from the quarter chord fore and aft, m.
    rotors
        ``"all"``, ``"front"`` or ``"rear"``: those that have a thrust.
    wing_acts
        Whether the wing's vortices move the slipstreams.
    halves
        Grid of the lattice, see :func:`levelone.aerodynamics.lattice.build`.
    """

    label: str
    group: str = "base"
    how: Marching = field(default_factory=lambda: Marching(step=0.1, points=24, core=0.3, free=16, far=24, settle=40, window=40))
    clean: float | None = CLEAN
    camber_at: float = 0.4
    lift_on_wing: bool = True
    rise: float = 0.0
    aft: float = 0.0
    spread: float = 0.0
    rotors: str = "all"
    wing_acts: bool = True
    halves: int = 2


@dataclass(frozen=True)
class Found:
    """What a case gives: changes of coefficients of the whole [6] and of each surface [s, 6], half the difference between both
    halves of the window [6], clean coefficients [6], thrust of a rotor (N), largest camber (chords). NaN if the march failed."""

    case: Case
    change: FloatArray
    surfaces: FloatArray
    unsteady: FloatArray
    clean: FloatArray
    names: tuple[str, ...]
    thrust: float
    camber: float
    outcome: Outcome
    words: str

    @property
    def loss(self) -> float:
        """Change of C_L0."""
        return float(self.change[NAMES.index("C_L")])


@dataclass(frozen=True)
class Summary:
    """Change of C_L0: base case, its numerical uncertainty (root of the sum of squares), range over the assumptions; and how many
    cases failed or did not settle."""

    base: float
    numerical: float
    lowest: float
    highest: float
    failed: int
    unsettled: int


def cases() -> tuple[Case, ...]:
    """The base case and its variations."""
    base = Case("base")
    how = base.how
    finer = replace(how, step=0.05, free=2 * how.free, far=2 * how.far, settle=2 * how.settle, window=2 * how.window)
    numerical: dict[str, dict[str, Any]] = {
        "half the time step": {"how": finer},
        "half the core, twice the particles": {"how": replace(how, core=0.15, points=48)},
        "one and a half times the particles": {"how": replace(how, points=36)},
        "free wake of half the length": {"how": replace(how, free=8, settle=32)},
        "free wake of 1.5 times the length": {"how": replace(how, free=24, settle=48)},
        "carried wake of twice the length": {"how": replace(how, far=48, settle=64)},
        "window of three times the length": {"how": replace(how, window=120)},
        "lattice of 1.5 times the panels": {"halves": 3},
    }
    assumed: dict[str, dict[str, Any]] = {
        "discs 0.10 m above the wing": {"rise": 0.1}, "discs 0.05 m above": {"rise": 0.05}, "discs 0.05 m below": {"rise": -0.05},
        "discs 0.10 m below": {"rise": -0.1}, "discs 0.1 m forward": {"aft": -0.1}, "discs 0.1 m aft": {"aft": 0.1},
        "discs 0.1 m aft and 0.1 m below": {"aft": 0.1, "rise": -0.1},
        "arms 0.1 m longer": {"spread": 0.1}, "arms 0.1 m shorter": {"spread": -0.1}, "thrust = weight": {"lift_on_wing": False},
        "largest camber at 0.3 c": {"camber_at": 0.3}, "largest camber at 0.5 c": {"camber_at": 0.5}, "flat wing": {"clean": None},
    }  # fmt: skip
    diagnosis: dict[str, dict[str, Any]] = {
        "front rotors alone": {"rotors": "front"}, "rear rotors alone": {"rotors": "rear"},
        "wing does not move the slipstreams": {"wing_acts": False},
    }  # fmt: skip
    groups = (("numerical", numerical), ("assumption", assumed), ("diagnosis", diagnosis))
    return (base, *(replace(base, label=label, group=group, **what) for group, all_ in groups for label, what in all_.items()))


def interference(
    vehicle: str = "reference-evtol",
    geometry: str = "reference-evtol",
    speed: float = 5.0,
    chosen: Sequence[Case] | None = None,
    radius: float = RADIUS,
    threads: int | None = None,
    progress: Callable[[Found], None] | None = None,
) -> list[Found]:
    """Change of the coefficients at zero incidence by the slipstreams, case by case (all of :func:`cases` if None).

    Parameters
    ----------
    vehicle, geometry
        Names or paths. The vehicle gives weight, air density and the rotors' places from the centre of gravity, which lies at the
        geometry's reference point.
    speed
        Of level flight, m/s.
    radius
        Of the rotors, m.

    Raises
    ------
    InputError
        A speed that is not positive, an unknown choice of rotors, wing lift beyond the weight.
    """
    if not (math.isfinite(speed) and speed > 0.0):
        raise InputError("speed", f"{speed:g} m/s; allowed: above 0, finite")
    craft, shape = load_vehicle(vehicle), load_geometry(geometry)
    found = []
    for case in cases() if chosen is None else chosen:
        found.append(_run(case, craft, shape, speed, radius, threads))
        if progress is not None:
            progress(found[-1])
    return found


def summary(found: Sequence[Found]) -> Summary:
    """Base value, numerical uncertainty and range over the assumptions; NaN where a case that is needed failed."""
    base = next(each for each in found if each.case.group == "base")
    numerical = [each.loss - base.loss for each in found if each.case.group == "numerical"]
    assumed = [each.loss for each in found if each.case.group in ("assumption", "base")]
    own = float(base.unsteady[NAMES.index("C_L")])
    failed = sum(each.outcome.failed and each.outcome is not Outcome.NOT_CONVERGED for each in found)
    unsettled = sum(each.outcome is Outcome.NOT_CONVERGED for each in found)
    spread = math.sqrt(sum(each**2 for each in numerical) + own**2)
    return Summary(base.loss, spread, float(np.min(assumed)), float(np.max(assumed)), failed, unsettled)


def cambered(geometry: Geometry, largest: float, at: float) -> Geometry:
    """The geometry with a NACA four-digit mean line on its first surface: largest height and its place, chords.

    Abbott and von Doenhoff, Theory of Wing Sections, 1959, section 6.4.
    """
    x = 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, CAMBER_POINTS)))
    front = largest / at**2 * (2.0 * at * x - x**2)
    aft = largest / (1.0 - at) ** 2 * (1.0 - 2.0 * at + 2.0 * at * x - x**2)
    z = np.where(x < at, front, aft)
    line = ((0.0, 0.0), *((float(a), float(b)) for a, b in zip(x[1:-1], z[1:-1], strict=True)), (1.0, 0.0))
    wing, *others = geometry.surfaces
    return replace(geometry, surfaces=(replace(wing, camber=line), *others))


def camber_for(geometry: Geometry, lift: float, at: float) -> float:
    """Largest camber (chords) of the first surface with which the geometry's own grid has C_L0 = ``lift``.

    Raises
    ------
    InputError
        No camber from -10 to 10 % does.
    """

    def miss(largest: float) -> float:
        return float(steady(prepare(build(cambered(geometry, largest, at))))[0]) - lift

    low, high = -0.1, 0.1
    if miss(low) * miss(high) > 0.0:
        raise InputError(
            "clean",
            f"C_L0 = {lift:g} is out of reach: camber of -10 to 10 % gives {miss(low) + lift:.3f} to {miss(high) + lift:.3f}",
        )
    return float(brentq(miss, low, high, xtol=1e-7))


def discs(case: Case, vehicle: Vehicle, origin: Vector, thrust: float, radius: float) -> tuple[Disc, ...]:
    """The rotors as discs in the frame of the geometry, with the centre of gravity at ``origin`` (m).

    Raises
    ------
    InputError
        An unknown choice of rotors.
    """
    if case.rotors not in ("all", "front", "rear"):
        raise unknown_name("rotors", case.rotors, ("all", "front", "rear"))
    turned = np.array([-1.0, 1.0, -1.0])
    made = []
    for place, axis in zip(vehicle.airframe.rotors.position * turned, vehicle.airframe.rotors.axis * turned, strict=True):
        if case.rotors == "all" or (place[0] < 0.0) == (case.rotors == "front"):
            x, y, z = place + origin + [case.aft + case.spread * float(np.sign(place[0])), 0.0, case.rise]
            made.append(Disc((float(x), float(y), float(z)), radius, thrust, (float(axis[0]), float(axis[1]), float(axis[2]))))
    return tuple(made)


def _run(case: Case, vehicle: Vehicle, geometry: Geometry, speed: float, radius: float, threads: int | None) -> Found:
    camber = 0.0 if case.clean is None else camber_for(geometry, case.clean, case.camber_at)
    plant = prepare(build(geometry if case.clean is None else cambered(geometry, camber, case.camber_at), case.halves))
    at = wing_in_wake.points(plant)
    clean = wing_in_wake.steady_in(plant, np.zeros_like(at))
    air, weight = vehicle.airframe.air_density, vehicle.airframe.mass.mass * vehicle.airframe.gravity
    lift = 0.5 * air * speed**2 * geometry.area * float(clean.whole[0]) if case.lift_on_wing else 0.0
    thrust = (weight - lift) / len(vehicle.airframe.rotors.position)
    if not thrust > 0.0:
        raise InputError(
            "speed", f"{speed:g} m/s: the wing carries {lift:.3g} N of {weight:.3g} N, and nothing is left for the rotors"
        )
    placed, mirrored = _half(discs(case, vehicle, geometry.reference_point, thrust, radius))
    background = None
    if case.wing_acts:
        background = wing_in_wake.as_background(plant, clean.gamma * speed, WING_CORE * geometry.chord, WING_WAKE * geometry.chord)
    wind = settle(placed, (speed, 0.0, 0.0), air, case.how, at, mirrored, background, threads)
    first, last, mean = (wing_in_wake.steady_in(plant, u / speed) for u in (*wind.velocity, wind.velocity.mean(axis=0)))
    return Found(
        case, mean.whole - clean.whole, mean.surfaces - clean.surfaces, 0.5 * np.abs(last.whole - first.whole), clean.whole,
        plant.lattice.names, thrust, camber, wind.outcome, wind.words,
    )  # fmt: skip


def _half(placed: tuple[Disc, ...]) -> tuple[tuple[Disc, ...], bool]:
    """Starboard discs and True where they and their images are all; else all of them and False."""
    right = tuple(disc for disc in placed if disc.centre[1] > 0.0)
    places = {(disc.centre, disc.axis) for disc in placed}
    images = {((x, -y, z), (a, -b, c)) for (x, y, z), (a, b, c) in places}
    return (right, True) if images == places and 2 * len(right) == len(placed) else (placed, False)
