"""The coefficients of a flight model, from a geometry or from what another code printed.

A vehicle file takes static derivatives, and those by the rates and by the rate of incidence apart. From a geometry, the static ones
(in alpha and beta) and the values at rest are those of the steady lattice: trim and slow motion hang on them. The parts in q, p, r
and alphadot belong to a frequency. By default they are the classical ones, the limit of slow motion; at a reduced frequency k they
are those of a pure rate oscillation and of a heave oscillation, divided by k; both together are the pitch oscillation's. An
inviscid lattice in incompressible flow knows the airspeed only through k = omega c/(2V): coefficients change with airspeed where
omega is given, and else not at all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from levelone._version import __version__
from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.derivatives import Static, dynamic, static
from levelone.aerodynamics.geometry import Geometry
from levelone.config.files import PathOrName
from levelone.config.geometry_file import load_geometry
from levelone.config.other_codes import OtherCode
from levelone.config.table_writer import ZERO, Coefficient, CoefficientTable, provenance
from levelone.config.units import to_si
from levelone.errors import InputError

FloatArray = NDArray[np.float64]
#: reduced frequency that stands for the limit of slow motion; its double tells how far it is from the limit
LOW = 1e-3
#: largest sideslip (rad) of another code's condition that counts as none
STRAIGHT = 1e-6
#: static derivatives: name, motion and coefficient of the steady lattice
STATIC = {f"{name}{motion}": (motion, name) for motion, names in
          {"alpha": ("C_L", "C_D", "C_m"), "beta": ("C_Y", "C_l", "C_n")}.items() for name in names}  # fmt: skip
#: rate derivatives: name, oscillation, steady motion and coefficient
RATES = {f"{name}{rate}": (motion, rate, name) for motion, rate, names in
         (("rate", "q", ("C_L", "C_D", "C_m")), ("roll", "p", ("C_Y", "C_l", "C_n")), ("yaw_rate", "r", ("C_Y", "C_l", "C_n")))
         for name in names}  # fmt: skip
LAGS = {"C_Lalphadot": "C_L", "C_malphadot": "C_m"}
NO_LAG = "0: quasi-steady code, which gives no part in the rate of incidence; the lag of the downwash is left out"


def geometry_table(
    geometry: PathOrName, k: float | None = None, omega: float | None = None, speeds: Sequence[float] = ()
) -> CoefficientTable:
    """All coefficients of a vehicle from its geometry, about its reference point, linear about its attitude in the file.

    Parameters
    ----------
    geometry
        Name of a geometry that ships, or path of a file.
    k
        Reduced frequency of the parts in q, p, r and alphadot; the limit of slow motion if neither this nor ``omega`` is given.
    omega, speeds
        Angular frequency (rad/s) and airspeeds (m/s, increasing): those parts at k = omega c/(2V) for each speed.

    Raises
    ------
    InputError
        Both k and omega, an omega without speeds or speeds without omega, numbers that are not positive; a bad geometry.
    """
    shape = load_geometry(geometry)
    reduced = _reduced(shape.chord, k, omega, speeds)
    origin = provenance(geometry, shape)
    steady = static(shape)
    found = _at_rest(steady, origin)
    for name, (motion, coefficient) in STATIC.items():
        i, j = steady.motions.index(motion), NAMES.index(coefficient)
        found[name] = _made(steady.value[i, j], steady.error[i, j], f"{origin}, k = 0")
    found["C_Ybeta"] = _without_drag(found["C_Ybeta"], steady)
    found |= _slow(shape, steady, origin) if reduced is None else _oscillating(shape, reduced, origin)
    known = {name: each for name, each in found.items() if np.all(np.isfinite(each.value))}
    return CoefficientTable(
        area=_reference(shape, "area", origin),
        chord=_reference(shape, "chord", origin),
        span=_reference(shape, "span", origin),
        moment_reference=_reference_point(shape),
        airspeed=tuple(map(float, speeds)),
        k=tuple(reduced.tolist()) if reduced is not None and len(speeds) else (),
        coefficients={name: _nothing(name, each, shape.name) for name, each in known.items()},
        missing=tuple((name, "the computation gives no finite number") for name in found if name not in known),
        notes=(*_notes(reduced, omega), *(f"assumed in the geometry, {field}: {why}" for field, why in shape.assumed)),
    )


def other_table(other: OtherCode, unit: str) -> CoefficientTable:
    """The coefficients of a vehicle from what another code printed.

    Values at rest are carried from the condition's incidence to zero along its slopes. The drag's part in a sideslip, which the
    flight model adds itself, is taken out of C_Ybeta.

    Parameters
    ----------
    other
        As read from the file.
    unit
        Of the file's lengths ("m", "ft"), which neither code names.

    Raises
    ------
    InputError
        A condition with sideslip, whose lateral coefficients at rest a vehicle file cannot hold; a unit that is no length.
    """
    if abs(other.beta) > STRAIGHT:
        raise InputError(
            other.source, f"beta is {math.degrees(other.beta):g} deg: a vehicle file needs a condition without sideslip"
        )
    scale = float(to_si(1.0, unit, "m", "unit"))
    mach = f", Mach {other.mach:g}" if math.isfinite(other.mach) else ""
    origin = f"{other.code}, {other.source}, alpha = {math.degrees(other.alpha):g} deg{mach}, read by levelone {__version__}"
    values = _of_vehicle(other)
    known = {name: _made(value, math.nan, origin) for name, value in values.items() if math.isfinite(value)}
    known |= {name: Coefficient((0.0,), (math.nan,), assumed=NO_LAG) for name in LAGS}
    point = ", ".join(f"{each * scale:g}" for each in other.reference_point)
    return CoefficientTable(
        area=_made(other.area * scale**2, 0.0, origin),
        chord=_made(other.chord * scale, 0.0, origin),
        span=_made(other.span * scale, 0.0, origin),
        moment_reference=f"({point}) m in the frame of {other.source}, x aft, z up; the centre of gravity must lie there",
        airspeed=(),
        k=(),
        coefficients=known,
        missing=tuple((name, f"not in {other.source}") for name in values if name not in known),
        notes=(
            f"{origin}; lengths of the file taken to be in {unit}; no error bars: the code prints none",
            "C_L0, C_D0, C_m0: carried to zero incidence along the file's slopes; C_Ybeta: without the drag's part",
            *(f"{what}: {why}" for what, why in other.not_converted),
        ),
    )


def _of_vehicle(other: OtherCode) -> dict[str, float]:
    """Values of another code as a vehicle file takes them; NaN where it does not print them."""
    values = {name: other.derivatives[name] for name in (*STATIC, *RATES)}
    values["C_Ybeta"] += other.coefficients["C_D"]
    for name in ("C_L", "C_D", "C_m"):
        values[f"{name}0"] = other.coefficients[name] - other.alpha * other.derivatives[f"{name}alpha"]
    return values


def _reduced(chord: float, k: float | None, omega: float | None, speeds: Sequence[float]) -> FloatArray | None:
    """Reduced frequencies [n]: one, or one for each speed; None for the limit of slow motion."""
    if k is not None and omega is not None:
        raise InputError("omega", "give k or omega, not both")
    if omega is None:
        if len(speeds):
            raise InputError("speeds", "without omega no coefficient changes with airspeed: at equal k the lattice is the same")
        return None if k is None else np.array([_positive("k", k)])
    if not len(speeds):
        raise InputError("speeds", "omega needs airspeeds: k = omega c/(2V)")
    for each in speeds:
        _positive("speeds", each)
    if np.any(np.diff(speeds) <= 0.0):
        raise InputError("speeds", f"must increase, got {', '.join(f'{each:g}' for each in speeds)} m/s")
    return _positive("omega", omega) * chord / (2.0 * np.asarray(speeds, dtype=float))


def _at_rest(steady: Static, origin: str) -> dict[str, Coefficient]:
    found = {f"{name}0": _made(steady.rest[j], steady.rest_error[j], f"{origin}, k = 0")
             for name, j in ((name, NAMES.index(name)) for name in ("C_L", "C_D", "C_m"))}  # fmt: skip
    drag = found["C_D0"]
    why = f"{origin}, k = 0: induced drag of the lattice alone; friction, fuselage and rotor arms are not in it: put the whole here"
    return found | {"C_D0": Coefficient(drag.value, drag.error, assumed=why)}


def _without_drag(whole: Coefficient, steady: Static) -> Coefficient:
    """C_Ybeta as the flight model takes it, which adds -C_D beta itself: the whole side force plus C_D."""
    drag, error = float(steady.rest[NAMES.index("C_D")]), float(steady.rest_error[NAMES.index("C_D")])
    return Coefficient((whole.value[0] + drag,), (whole.error[0] + error,), f"{whole.source}; without the drag's part")


def _slow(shape: Geometry, steady: Static, origin: str) -> dict[str, Coefficient]:
    """Rates of the steady lattice, and the limit of the parts in alphadot."""
    found = {}
    for name, (_, rate, coefficient) in RATES.items():
        i, j = steady.motions.index(rate), NAMES.index(coefficient)
        found[name] = _made(steady.value[i, j], steady.error[i, j], f"{origin}, k = 0")
    heave = dynamic(shape, np.array([LOW, 2.0 * LOW]), ("heave",))
    for name, coefficient in LAGS.items():
        value, error = heave.at("heave", coefficient)
        found[name] = _made(value[0], error[0] + abs(value[1] - value[0]), f"{origin}, heave at k = {LOW:g}: limit of slow motion")
    return found


def _oscillating(shape: Geometry, reduced: FloatArray, origin: str) -> dict[str, Coefficient]:
    """Parts in the rates and in alphadot at reduced frequencies [n]."""
    k = f"{min(reduced):.4g}" if len(reduced) == 1 else f"{min(reduced):.4g} to {max(reduced):.4g}"
    pitching = dynamic(shape, reduced, ("heave", "rate"))
    turning = dynamic(shape, reduced, ("roll", "yaw_rate"))
    found = {}
    for name, (motion, _, coefficient) in RATES.items():
        value, error = (pitching if motion == "rate" else turning).at(motion, coefficient)
        found[name] = Coefficient(
            tuple(value.tolist()), tuple(error.tolist()), f"{origin}, {motion.replace('_', ' ')} oscillation at k = {k}"
        )
    for name, coefficient in LAGS.items():
        value, error = pitching.at("heave", coefficient)
        found[name] = Coefficient(tuple(value.tolist()), tuple(error.tolist()), f"{origin}, heave oscillation at k = {k}")
    return found


def _made(value: float, error: float, source: str) -> Coefficient:
    return Coefficient((float(value),), (float(error),), source)


def _nothing(name: str, given: Coefficient, geometry: str) -> Coefficient:
    """A coefficient that is zero because the geometry holds nothing that gives it is an assumption, not a result."""
    if name == "C_D0" or max(map(abs, given.value)) >= ZERO:
        return given
    return Coefficient(
        (0.0,), (math.nan,), assumed=f"0: geometry {geometry} has nothing that gives it (flat, level or without fins)"
    )


def _reference(shape: Geometry, name: str, origin: str) -> Coefficient:
    """A reference value, assumed where the geometry's is."""
    value, why = float(getattr(shape, name)), dict(shape.assumed).get(f"geometry.reference.{name}")
    geometry = f"geometry {shape.name}"
    if why is not None:
        return Coefficient((value,), (0.0,), assumed=f"{geometry}: {why}")
    return Coefficient((value,), (0.0,), f"{geometry} of {origin.partition(',')[0]}")


def _reference_point(shape: Geometry) -> str:
    point = ", ".join(f"{each:g}" for each in shape.reference_point)
    return f"({point}) m in the frame of geometry {shape.name}, x aft, z up; the centre of gravity must lie there"


def _notes(reduced: FloatArray | None, omega: float | None) -> tuple[str, ...]:
    if reduced is None:
        parts = "parts in q, p, r, alphadot: limit of slow motion; levelone derivatives gives them at a frequency as well"
    elif omega is None:
        parts = f"parts in q, p, r, alphadot at k = {reduced[0]:.4g}: at another airspeed of another frequency"
    else:
        parts = f"parts in q, p, r, alphadot at omega = {omega:g} rad/s for each airspeed, held beyond the first and last"
    return (
        "Linear, inviscid, incompressible lattice of the lifting surfaces alone; no airspeed but through k = omega c/(2V).",
        f"Static derivatives of steady flow; {parts}.",
        "C_q and C_alphadot are apart; +- is the half-width of the error bar of the extrapolation over grids, not of the physics.",
    )


def _positive(name: str, value: float) -> float:
    if not 0.0 < value < math.inf:
        raise InputError(name, f"{value:g} is not a positive number")
    return value
