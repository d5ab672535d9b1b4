"""Make the lift-rotor tables of the reference eVTOL: rpm, thrust and torque over throttle, airspeed and flow angle.

    python tools/make_rotor_table.py

writes reference-evtol-rotor.csv, the same on a finer grid (-fine) and for a battery without resistance (-stiff, for experiments)
into the vehicle library and prints a summary. The
model is in bemt.py (rotor) and drive.py (motor and battery); docs/theory/rotor-table.md explains both.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from bemt import Blade, Elements, Section, loads, make_elements
from drive import Array, Drive, steady_speed

LIBRARY = Path(__file__).resolve().parents[1] / "src" / "levelone" / "vehicle" / "library"
K_T = 6.96e-8  # N/rpm^2, static thrust over rpm squared: the anchor (reference study, Table 2)
AIR_DENSITY = 1.225  # kg/m^3
RPM = 60.0 / (2.0 * np.pi)  # rpm in one rad/s
HOVER_THRUST = 7.0 * 9.80665 / 8.0  # N, 7 kg on eight rotors
MAP_ANGLE = np.radians(0.25 * np.arange(-24, 409))  # atan2(V, Omega R); beyond 90 deg the rotor turns backwards
FINE = (np.arange(41) / 40.0, np.arange(21.0), 7.5 * np.arange(-12, 13))  # throttle, airspeed (m/s), angle (deg)
COARSE = tuple(axis[::2] for axis in FINE)
COLUMNS = ("rpm", "thrust", "torque")


@dataclass(frozen=True)
class LoadMap:
    """Scaled loads of the anchored rotor at given flow angles, as splines in atan2(V, Omega R)."""

    radius: float
    angle_deg: Array
    thrust: CubicSpline
    torque: CubicSpline

    def __call__(self, speed: Array, airspeed: Array, column: Array) -> tuple[Array, Array]:
        """Thrust (N) and torque (N m) at a rotor `speed` (rad/s), `airspeed` (m/s) and a `column` of `angle_deg`."""
        tip = speed * self.radius
        direction = np.arctan2(airspeed, tip)
        # a rotor at rest in still air has no direction, and needs none: its loads are zero
        pressure_area = AIR_DENSITY * np.pi * self.radius**2 * (tip**2 + airspeed**2)
        return (
            pressure_area * _column(self.thrust, direction, column),
            pressure_area * self.radius * _column(self.torque, direction, column),
        )


def _column(spline: CubicSpline, x: Array, column: Array) -> Array:
    """Value of component `column` of a vector spline, for arrays `x` and `column` of one shape."""
    i = np.clip(np.searchsorted(spline.x, x, side="right") - 1, 0, spline.x.size - 2)
    d = x - spline.x[i]
    c3, c2, c1, c0 = spline.c[:, i, column]
    return ((c3 * d + c2) * d + c1) * d + c0


def static_loads(elements: Elements, section: Section) -> tuple[float, float]:
    """F_T and F_Q in still air, before anchoring."""
    thrust, torque = loads(elements, section, np.ones(1), np.zeros(1), np.zeros(1))
    return float(thrust[0]), float(torque[0])


def anchor(blade: Blade, static_thrust: float) -> float:
    """Factor on thrust that makes the static thrust K_T rpm^2."""
    return K_T * RPM**2 / (AIR_DENSITY * np.pi * blade.radius**4 * static_thrust)


def make_map(blade: Blade, section: Section, angle_deg: Array) -> LoadMap:
    """Anchored load map: thrust times the factor, torque times its power 3/2: the static figure of merit stays."""
    elements = make_elements(blade)
    static_thrust, static_torque = static_loads(elements, section)
    factor = anchor(blade, static_thrust)
    tip, speed = np.cos(MAP_ANGLE)[:, None], np.sin(MAP_ANGLE)[:, None]
    angle = np.radians(angle_deg)
    # a negative speed at one angle is the positive speed at the opposite one: the map continues smoothly through zero
    thrust, torque = loads(
        elements,
        section,
        np.broadcast_to(tip, (MAP_ANGLE.size, angle.size)),
        np.abs(speed * np.cos(angle)),
        speed * np.sin(angle),
    )
    at_rest = np.argmin(np.abs(MAP_ANGLE))
    thrust[at_rest], torque[at_rest] = static_thrust, static_torque
    return LoadMap(
        blade.radius,
        angle_deg,
        CubicSpline(MAP_ANGLE, factor * thrust),
        CubicSpline(MAP_ANGLE, factor**1.5 * torque),
    )


def solve(load_map: LoadMap, drive: Drive, throttle: Array, airspeed: Array, column: Array) -> Array:
    """[..., 3] rpm, thrust and torque at points given by arrays of one shape."""
    # the load map ends at a slow reverse rotation, faster than shorted windings allow
    lowest = np.tan(np.pi / 2.0 - MAP_ANGLE[-1]) * airspeed / load_map.radius
    speed = steady_speed(drive, throttle, lambda w, v, i: load_map(w, v, i)[1], lowest, airspeed, column)
    return np.stack([speed * RPM, *load_map(speed, airspeed, column)], axis=-1)


def make_table(load_map: LoadMap, drive: Drive, throttle: Array, airspeed: Array) -> Array:
    """[throttle, airspeed, angle, 3] over the grid; one value for all angles at zero airspeed."""
    points = np.meshgrid(throttle, airspeed, np.arange(load_map.angle_deg.size), indexing="ij")
    table = solve(load_map, drive, *(p.ravel() for p in points)).reshape(*points[0].shape, 3)
    if airspeed[0] == 0.0:
        table[:, 0] = table[:, 0, :1]
    return np.round(table, 10) + 0.0  # no -0 and no roundoff in place of 0


def interpolate(axes: tuple[Array, ...], table: Array, to: tuple[Array, ...]) -> Array:
    """Tensor cubic spline of a table on another grid, with the symmetries of an averaged rotor.

    A negative airspeed is the positive one at the opposite angle, and slopes in angle vanish at +-90 deg.
    """
    throttle, airspeed, angle = axes
    out = CubicSpline(throttle, table, axis=0)(to[0])
    mirrored = np.concatenate([out[:, :0:-1, ::-1], out], axis=1)
    out = CubicSpline(np.concatenate([-airspeed[:0:-1], airspeed]), mirrored, axis=1)(to[1])
    return CubicSpline(angle, out, axis=2, bc_type="clamped")(to[2])


def header(factor: float, constants: tuple[object, ...], grid: str) -> list[str]:
    """Comment lines of a table file."""
    lines = [
        f"Lift rotor of the reference eVTOL: one three-blade propeller, 0.178 m; {grid}.",
        "throttle: 0 to 1; airspeed: air-relative, m/s; angle_deg: from disc plane to air-relative velocity, deg:",
        "  +90 axial climb, 0 edgewise, -90 axial descent. Angle varies fastest, throttle slowest.",
        "rpm: rev/min; thrust: N along the axis, positive up; torque: N m, positive against rotation. Means of a",
        "  revolution: only the size of the edgewise speed counts.",
        f"Anchor: static thrust = K_T rpm^2, K_T = {K_T:g} N/rpm^2 (reference study, Table 2); air of {AIR_DENSITY:g} kg/m^3.",
        "The rest is calculated, not measured: blade-element momentum theory of an assumed blade, an assumed motor and",
        f"  battery. Thrust of the theory times {factor:.6f}, torque times its power 3/2. The curvature of thrust in",
        "  throttle is assumed. Steep descent is a fit to measured induced velocities (vortex-ring state): mean only.",
        "Made by tools/make_rotor_table.py; equations and sources in docs/theory/rotor-table.md. Licence: Apache-2.0.",
    ]
    for part in constants:
        values = ", ".join(f"{f.name} = {_text(getattr(part, f.name))}" for f in fields(part))  # type: ignore[arg-type]
        lines.append(f"Assumed, {type(part).__name__} (SI, rad, rpm): {values}")
    return lines


def _text(value: object) -> str:
    return " ".join(f"{v:g}" for v in value) if isinstance(value, tuple) else f"{value:.6g}"


def write(path: Path, lines: list[str], axes: tuple[Array, ...], table: Array) -> None:
    """Write one table: comments, names of the columns, one row a node, nine significant digits."""
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    rows = np.concatenate([nodes, table], axis=-1).reshape(-1, 6)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"# {line}\n" for line in lines)
        file.write(",".join(("throttle", "airspeed", "angle_deg", *COLUMNS)) + "\n")
        np.savetxt(file, rows, fmt="%g,%g,%g,%.9g,%.9g,%.9g")


def hover_slopes(load_map: LoadMap, drive: Drive) -> dict[str, float]:
    """Numbers of one rotor in hover and at 5 m/s edgewise (same throttle), by central differences."""
    climb, edge = (int(np.flatnonzero(load_map.angle_deg == a)[0]) for a in (90.0, 0.0))

    def thrust(throttle: float, speed: float, column: int) -> float:
        # opposite angles are opposite columns
        i = column if speed >= 0 else load_map.angle_deg.size - 1 - column
        return float(solve(load_map, drive, np.array([throttle]), np.array([abs(speed)]), np.array([i]))[0, 1])

    def at_speed(omega: float, speed: float, column: int) -> float:
        i = column if speed >= 0 else load_map.angle_deg.size - 1 - column
        return float(load_map(np.array([omega]), np.array([abs(speed)]), np.array([i]))[0][0])

    hover = float(brentq(lambda d: thrust(d, 0.0, edge) - HOVER_THRUST, 0.1, 1.0, xtol=1e-13))
    rpm, _, torque = solve(load_map, drive, np.array([hover]), np.zeros(1), np.array([edge]))[0]
    omega, h = rpm / RPM, 1e-3
    ideal = HOVER_THRUST**1.5 / np.sqrt(2.0 * AIR_DENSITY * np.pi * load_map.radius**2)
    return {
        "hover throttle": hover,
        "hover rpm": rpm,
        "hover torque, N m": torque,
        "figure of merit": ideal / (torque * omega),
        "greatest static thrust / hover thrust": thrust(1.0, 0.0, edge) / HOVER_THRUST,
        "d ln T / d ln throttle": (np.log(thrust(hover * (1 + h), 0, edge) / thrust(hover * (1 - h), 0, edge)) / 2 / h),
        "dT/dw axial, N s/m": (thrust(hover, h, climb) - thrust(hover, -h, climb)) / 2 / h,
        "dT/dw axial at constant rpm, N s/m": (at_speed(omega, h, climb) - at_speed(omega, -h, climb)) / 2 / h,
        "dT/dV edgewise at 5 m/s, N s/m": (thrust(hover, 5 + h, edge) - thrust(hover, 5 - h, edge)) / 2 / h,
        "dT/dV edgewise at 5 m/s at constant rpm, N s/m": ((at_speed(omega, 5 + h, edge) - at_speed(omega, 5 - h, edge)) / 2 / h),
        "thrust ratio at 5 m/s edgewise": thrust(hover, 5.0, edge) / HOVER_THRUST,
    }


def interpolation_errors(table: Array) -> dict[str, float]:
    """Error of the coarse table's spline at the fine nodes, in hover thrusts: where the aircraft flies, elsewhere."""
    error = interpolate(COARSE, table[::2, ::2, ::2], FINE)[..., 1] / HOVER_THRUST - table[..., 1] / HOVER_THRUST
    d, v, a = np.meshgrid(*FINE, indexing="ij")
    inside = (v <= 12) & (np.abs(a) <= 60) & (d >= 0.2) & (d <= 0.9)
    out = {}
    for name, where in (("inside", inside), ("elsewhere", ~inside)):
        out[f"interpolation error {name}, max"] = float(np.abs(error[where]).max())
        out[f"interpolation error {name}, rms"] = float(np.sqrt(np.mean(error[where] ** 2)))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=LIBRARY, help="folder to write to")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    blade, section, drive = Blade(), Section(), Drive()
    static_thrust, static_torque = static_loads(make_elements(blade), section)
    factor = anchor(blade, static_thrust)
    load_map = make_map(blade, section, FINE[2])
    table = make_table(load_map, drive, FINE[0], FINE[1])
    constants = (blade, section, drive)
    for name, axes, values in (("", COARSE, table[::2, ::2, ::2]), ("-fine", FINE, table)):
        grid = " x ".join(str(a.size) for a in axes) + " nodes of throttle, airspeed and angle"
        write(out / f"reference-evtol-rotor{name}.csv", header(factor, constants, grid), axes, values)
    stiff = replace(drive, battery_resistance=0.0)
    values = make_table(load_map, stiff, FINE[0], FINE[1])[::2, ::2, ::2]
    grid = f"a battery without resistance; {' x '.join(str(a.size) for a in COARSE)} nodes"
    write(out / "reference-evtol-rotor-stiff.csv", header(factor, (blade, section, stiff), grid), COARSE, values)
    summary = {
        "raw C_T": static_thrust * np.pi**3 / 4.0,
        "raw C_P": static_torque * np.pi**4 / 4.0,
        "factor on thrust": factor,
        **hover_slopes(load_map, drive),
        "d ln T / d ln throttle without sag": hover_slopes(load_map, stiff)["d ln T / d ln throttle"],
        **interpolation_errors(table),
    }
    for name, value in summary.items():
        print(f"{name:50s} {value:.6g}")


if __name__ == "__main__":
    main()
