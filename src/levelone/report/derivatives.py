"""The page of a geometry's derivatives, with its figures and the files for ParaView."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from levelone import __version__
from levelone.aerodynamics.derivatives import Derivatives, Static
from levelone.aerodynamics.extrapolation import LEVELS
from levelone.aerodynamics.frequency import Plant, prepare
from levelone.aerodynamics.geometry import STEEP, FloatArray, Geometry
from levelone.aerodynamics.lattice import Lattice, build
from levelone.aerodynamics.loading import Loading, at_rest, loading, panels
from levelone.errors import InputError
from levelone.report import derivatives_figures as figures
from levelone.report import derivatives_labels as labels
from levelone.report import derivatives_record as records
from levelone.report import derivatives_tables as tables
from levelone.report import vtk, wake_figures
from levelone.report.derivatives_record import Record
from levelone.report.formatting import number
from levelone.report.page import environment, files_of, write_figures
from levelone.report.pictures import Picture

#: amplitude and reduced frequency of the loop that is drawn where no record is given: those of the study
AMPLITUDE, LOOP_K = math.radians(2.0), 0.2
LOOP = ("C_L", "C_m")
#: what the study prints for the geometry (wing and tailplane, 6 and 8 m/s, no mean incidence; C_Lq and C_mq at the ends of k from
#: 0.1 to 0.2, Tables 3 to 5), and the pitch damping that it quotes from a lifting-surface code of earlier work (Table 4)
PRINTED = {
    "reference-wing-tail": figures.Printed((0.1, 0.2), {"C_L": (5.9649, 7.9898), "C_m": (-6.9263, -8.6516)}, {"C_m": -16.169}),
}  # fmt: skip


@dataclass(frozen=True)
class _Loads:
    """What is drawn on the lattice of the geometry's own grid."""

    quads: FloatArray
    each: dict[str, Loading]


def render_derivatives(
    folder: str | PathLike[str],
    geometry: Geometry,
    derivatives: Derivatives,
    static: Static,
    *,
    speeds: Sequence[float] = (),
    record: Record | None = None,
) -> Path:
    """Write ``derivatives.html``, its figures in ``figures/`` and files for ParaView in ``paraview/``; return the page's path.

    Parameters
    ----------
    folder
        Where to write; made if it is missing.
    geometry, derivatives, static
        A geometry and what :func:`levelone.aerodynamics.derivatives.dynamic` (longitudinal motions, lateral ones, or both) and
        :func:`~levelone.aerodynamics.derivatives.static` give for it.
    speeds
        Airspeeds (m/s) at which the table gives frequencies in Hz.
    record
        A pitch oscillation of the same geometry in the time domain: its loop and its wake are drawn as well.

    Raises
    ------
    InputError
        The folder cannot be written to.
    """
    place = Path(folder)
    lattice = build(geometry)
    loads = _loads(prepare(lattice))
    wake = None if record is None or record.history.wake is None else wake_figures.wake_arrays(record.history.wake)
    plans = _pictures(geometry, derivatives, static, lattice, loads, record, wake)
    context = _context(geometry, derivatives, static, speeds, record)
    path = place / "derivatives.html"
    try:
        (place / "paraview").mkdir(parents=True, exist_ok=True)
        context["files"] = _write_paraview(place / "paraview", loads, wake)
        drawings = write_figures(place / "figures", plans, files_of(plans))
        page = environment().get_template("derivatives.html").render(**context, drawings=drawings)
        path.write_text(page, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(str(place), f"cannot be written: {error.strerror}") from error
    return path


def _loads(plant: Plant) -> _Loads:
    each = {motion: loading(plant, motion) for motion in ("alpha", "q")}
    if plant.loaded:  # and roll beside it: views stand two in a row
        each |= {"rest": at_rest(plant), "p": loading(plant, "p")}
    return _Loads(panels(plant.lattice), each)


_LOAD_LABELS = {
    "alpha": "per rad of incidence",
    "q": "per unit of $qc/(2V)$",
    "rest": "at rest in the stream",
    "p": "per unit of $pb/(2V)$",
}


def _pictures(
    geometry: Geometry,
    derivatives: Derivatives,
    static: Static,
    lattice: Lattice,
    loads: _Loads,
    record: Record | None,
    wake: wake_figures.WakeArrays | None,
) -> list[Picture]:
    plans = []
    if _motions(derivatives, "longitudinal"):
        plans.append(_dynamic(geometry, derivatives, "longitudinal"))
    if "pitch" in derivatives.motions:
        plans += [_loops(derivatives, static, record), _theodorsen(float(derivatives.k.max()))]
    if _motions(derivatives, "lateral"):
        plans.append(_dynamic(geometry, derivatives, "lateral"))
    if wake is not None:
        plans.append(Picture("wake", "wake",
                             "Wake at the end of the oscillation in the time domain: panels next to the trailing edges by "
                             "circulation, and the particles that they become.",
                             True, partial(wake_figures.draw_wake, wake)))  # fmt: skip
    return plans + _load_pictures(geometry, lattice, loads)


def _theodorsen(highest: float) -> Picture:
    caption = (
        "Thin aerofoil for comparison (Theodorsen): out-of-phase derivatives of a pitch oscillation about the quarter chord and of "
        "heave, moments about the quarter chord. In two dimensions the lift goes to minus infinity as k goes to zero; on a wing it "
        "stays finite."
    )
    k = np.linspace(0.02, max(0.5, highest), 200)
    return Picture("theodorsen", "longitudinal", caption, True, partial(figures.draw_theodorsen, k))


def _load_pictures(geometry: Geometry, lattice: Lattice, loads: _Loads) -> list[Picture]:
    views = [(rf"$\Delta c_p$ {_LOAD_LABELS[name]}", load.pressure) for name, load in loads.each.items()]
    return [
        Picture("load", "load",
                "Pressure difference over dynamic pressure on the panels of the geometry’s own grid, positive along the normal. "
                "Colours go with the square root of the value.", True, partial(wake_figures.draw_loaded, loads.quads, views)),
        Picture("span_load", "load", _span_caption(geometry), True, partial(figures.draw_span_loads, _span_loads(lattice, loads))),
    ]  # fmt: skip


def _motions(derivatives: Derivatives, axis: str) -> list[str]:
    return [motion for motion in labels.MOTIONS[axis] if motion in derivatives.motions]


def _dynamic(geometry: Geometry, derivatives: Derivatives, axis: str) -> Picture:
    motions = _motions(derivatives, axis)
    printed = PRINTED.get(geometry.name) if axis == "longitudinal" and "pitch" in motions else None
    names = LOOP if axis == "longitudinal" else labels.LATERAL_COEFFICIENTS
    largest = float(np.nanmax(derivatives.quadrature_error[[derivatives.motions.index(motion) for motion in motions]], initial=0.0))
    caption = (
        "Out-of-phase derivatives against k = ωc/(2V), extrapolated over three grids, with error bars (the largest is "
        f"± {number(largest, 2)}). Grey circles: the geometry’s own grid without extrapolation."
    )
    if axis == "longitudinal" and {"pitch", "heave", "rate"} <= set(motions):
        caption += " The pitch oscillation is the sum of the other two."
    if printed is not None:
        caption += " Diamonds: the values that the study prints for the ends of its range of k."
    return Picture(f"dynamic_{axis}", axis, caption, True, partial(figures.draw_dynamic, derivatives, motions, names, printed))


def _loops(derivatives: Derivatives, static: Static, record: Record | None) -> Picture:
    wanted, amplitude = (LOOP_K, AMPLITUDE) if record is None else (record.k, record.amplitude)
    index = int(np.argmin(np.abs(derivatives.k - wanted)))
    mean = {name: float(static.rest[static.coefficients.index(name)]) for name in LOOP}
    loops = [figures.harmonic_loop(derivatives, index, amplitude, mean)]
    if record is not None and not record.history.outcome.failed:
        loops.append(records.loop_of(record, LOOP))
    caption = (
        f"Hysteresis of a pitch oscillation of {number(math.degrees(amplitude), 3)} deg. The loop in the frequency domain is made "
        "of the derivatives at this k, extrapolated over the grids; its thickness at mean attitude is 2 A k times the "
        "out-of-phase one."
    )
    return Picture("loops", "longitudinal", caption, True, partial(figures.draw_loops, loops, LOOP))


def _span_caption(geometry: Geometry) -> str:
    text = "Load of each strip, as section coefficient times local chord over reference chord, on the geometry’s own grid."
    steep = [surface.name for surface in geometry.surfaces if abs(surface.dihedral) > STEEP]
    return f"{text} Left out, being steep: {', '.join(steep)}." if steep else text


def _span_loads(lattice: Lattice, loads: _Loads) -> list[tuple[str, dict[str, list[tuple[FloatArray, FloatArray]]]]]:
    at = lattice.midpoint[lattice.first, 1]
    level = np.abs(lattice.edge[:, 1, 1] - lattice.edge[:, 0, 1]) > math.cos(STEEP) * lattice.width
    found = []
    for name, load in loads.each.items():
        surfaces = {}
        for index, surface in enumerate(lattice.names):
            halves = [np.flatnonzero((lattice.surface == index) & level & side) for side in (at >= 0.0, at < 0.0)]
            parts = [half[np.argsort(at[half])] for half in halves if len(half)]
            if parts:
                surfaces[surface] = [(at[part], load.reaching[part]) for part in parts]
        found.append((f"load {_LOAD_LABELS[name]}", surfaces))
    return found


def _context(
    geometry: Geometry, derivatives: Derivatives, static: Static, speeds: Sequence[float], record: Record | None
) -> dict[str, Any]:
    """Everything that the template shows, apart from the pictures."""
    failed, count = tables.undefined(derivatives, static)
    return {
        "geometry": geometry, "version": __version__, "surfaces": tables.surface_rows(geometry),
        "reference": f"area {number(geometry.area)} m², length {number(geometry.chord)} m, span {number(geometry.span)} m, "
                     f"moments about x, y, z = {', '.join(number(x) for x in geometry.reference_point)} m",
        "static": tables.static_rows(geometry, static), "speeds": [number(speed) for speed in speeds],
        "symmetric": all(surface.mirrored for surface in geometry.surfaces),
        "axes": [{"name": axis, "tables": tables.dynamic_tables(derivatives, axis, speeds, geometry.chord),
                  "unchanged": tables.unchanged(derivatives, axis)}
                 for axis in labels.MOTIONS if _motions(derivatives, axis)],
        "undefined": failed, "values": count, "levels": ", ".join(number(level / LEVELS[1]) for level in LEVELS),
        "record": None if record is None else {
            "k": number(record.k), "amplitude": number(math.degrees(record.amplitude)), "outcome": record.history.words,
            "rows": records.rows(record, LOOP), "removed": record.history.removed,
        },
    }  # fmt: skip


def _write_paraview(folder: Path, loads: _Loads, wake: wake_figures.WakeArrays | None) -> list[tuple[str, str]]:
    """Files and what is in them."""
    values: dict[str, FloatArray] = {}
    for name, load in loads.each.items():
        values |= {f"delta_c_p {name}": load.pressure, f"circulation {name}": load.circulation}
    vtk.write_quads(folder / "lattice.vtp", loads.quads, values)
    written = [("lattice.vtp", "panels with pressure difference and circulation over airspeed (m), per unit of each motion")]
    if wake is not None:
        vtk.write_quads(folder / "wake.vtp", wake.panels, {"circulation": wake.circulation})
        vtk.write_quads(folder / "body.vtp", wake.body, {})
        vtk.write_points(folder / "particles.vtp", wake.position, {"strength": wake.strength, "core": wake.core})
        written += [("wake.vtp", "wake panels with circulation, m²/s"), ("body.vtp", "rings of the body in the pose of the wake"),
                    ("particles.vtp", "particles with strength (vector, m³/s) and core, m")]  # fmt: skip
    return written
