"""The command ``levelone derivatives``: a geometry's stability derivatives against reduced frequency."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from levelone.console import announce_compilation, csv_draft, numbers, say, show, write_csv
from levelone.errors import InputError

if TYPE_CHECKING:
    from levelone.aerodynamics.derivatives import Derivatives, Static
    from levelone.aerodynamics.geometry import Geometry

Method = Literal["frequency", "time"]
AxisName = Literal["longitudinal", "lateral"]
OTHER_CODES = (".st", ".stab")


Shape = Annotated[
    str, typer.Argument(metavar="GEOMETRY", help="Name of a geometry, path of a .toml, AVL .st or VSPAERO .stab file.")
]
Frequencies = Annotated[str, typer.Option("--k", help="Reduced frequencies omega c/(2V): 0.1,0.2 or FIRST:LAST:COUNT.")]
Speeds = Annotated[str, typer.Option(help="Airspeeds, m/s: 6,8 or FIRST:LAST:COUNT.")]
AxisOption = Annotated[AxisName, typer.Option(help="Pitch, heave and rate; or sideslip, roll, yaw and yaw_rate.")]
MethodOption = Annotated[Method, typer.Option(help="frequency: linear, exact in the wake. time: a march in time, slow.")]
Out = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the derivatives as CSV.")]
Table = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the [aerodynamics] section of a vehicle file.")]
Omega = Annotated[float | None, typer.Option(help="With --table: at this frequency, rad/s, for each --speed.")]
Unit = Annotated[str, typer.Option(help="Unit of length of an AVL or VSPAERO file.")]
StudyFile = Annotated[Path | None, typer.Option(metavar="STUDY.toml", help="Write factor ranges over k into a study file.")]
Extends = Annotated[Path, typer.Option(metavar="STUDY.toml", help="Study that a new --study file extends.")]
Lumped = Annotated[bool, typer.Option(help="With --study: C_q + C_alphadot of pitch as C_q, as the published study does.")]
Report = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of a page with figures, and of files for ParaView.")]


def derivatives(
    geometry: Shape, k: Frequencies = "0.02:0.5:10", speed: Speeds = "6", axis: AxisOption = "longitudinal",
    method: MethodOption = "frequency", out: Out = None, table: Table = None, omega: Omega = None, unit: Unit = "m",
    study: StudyFile = None, extends: Extends = Path("studies/reference/study.toml"), lumped: Lumped = False, report: Report = None,
) -> None:  # fmt: skip
    """Static and dynamic stability derivatives of lifting surfaces, with error bars."""
    if Path(geometry).suffix.lower() in OTHER_CODES:
        _check_unused(
            {"--out": out, "--study": study, "--report": report, "--omega": omega}, "an AVL or VSPAERO file gives a --table only"
        )
        _other_code(Path(geometry), table, unit)
        return
    from levelone.config.geometry_file import load_geometry

    frequencies, speeds = numbers(k, "--k"), _airspeeds(speed)
    if table is None:
        _check_unused({"--omega": omega}, "belongs to --table")
    if method == "time":
        _check_unused({"--study": study}, "takes the frequency domain's values: leave --method out")
    shape = load_geometry(geometry)
    with csv_draft(out, "--out") as draft:
        announce_compilation("aerodynamics")
        found = _computed(shape, frequencies, speeds, axis, method)
        if draft is not None:
            from levelone.derivative_columns import record

            write_csv(draft, record(found, axis))
    still = _printed(shape, found, axis)
    if out is not None:
        say(f"derivatives: {out}")
    if table is not None:
        _write_table(geometry, table, omega, speeds)
    if study is not None:
        _write_study(study, found[0][1], geometry, extends, lumped)
    if report is not None:
        _write_report(report, shape, found[0][1], still, speeds, axis)


def _check_unused(options: dict[str, object], why: str) -> None:
    for name, value in options.items():
        if value is not None:
            raise InputError(name, why)


def _printed(shape: Geometry, found: list[tuple[float, Derivatives]], axis: str) -> Static:
    """Both tables on stdout; what is undefined, and why, on stderr."""
    from levelone.aerodynamics.derivatives import static
    from levelone.derivative_columns import static_table, table

    still = static(shape)
    show(f"Steady derivatives of {shape.name}, per radian", static_table(still, axis))
    show(f"Oscillations of {shape.name}: quadrature over k, error bar, and error of the ordinary grid", table(found[0][1], axis))
    for words in [words for _, each in found for words in each.failures]:
        say(f"undefined: {words}")
    return still


def _write_report(report: Path, shape: Geometry, found: Derivatives, still: Static, speeds: list[float], axis: str) -> None:
    from levelone.aerodynamics.pitching import pitched
    from levelone.report.derivatives import render_derivatives
    from levelone.report.derivatives_record import Record

    record = Record(*pitched(shape, speeds[0])) if axis == "longitudinal" else None
    say(f"report: {render_derivatives(report, shape, found, still, speeds=speeds, record=record)}")


def _airspeeds(text: str) -> list[float]:
    speeds = numbers(text, "--speed")
    for each in speeds:
        if not each > 0.0:
            raise InputError("--speed", f"{each:g} m/s is no airspeed: a positive number is needed")
    return speeds


def _computed(
    shape: Geometry, frequencies: list[float], speeds: list[float], axis: str, method: str
) -> list[tuple[float, Derivatives]]:
    """Derivatives at each speed: of equal reduced frequency they are equal, and computed once, in the frequency domain."""
    import numpy as np

    from levelone.aerodynamics.derivatives import dynamic
    from levelone.aerodynamics.modes import LATERAL, LONGITUDINAL

    motions = LONGITUDINAL if axis == "longitudinal" else LATERAL
    if method == "time":
        from levelone.aerodynamics.marched import marched
        from levelone.console import stage_bars

        with stage_bars() as progress:
            return [(each, marched(shape, np.array(frequencies), motions, each, progress=progress)) for each in speeds]
    found = dynamic(shape, np.array(frequencies), motions)
    return [(each, found) for each in speeds]


def _other_code(path: Path, table: Path | None, unit: str) -> None:
    """The coefficients that another code has printed, as a section of a vehicle file."""
    from levelone.campaign.coefficient_table import other_table
    from levelone.config.other_codes import read_st, read_stab
    from levelone.config.table_writer import write_table

    other = read_st(path) if path.suffix.lower() == ".st" else read_stab(path)
    text = write_table(other_table(other, unit), table)
    if table is None:
        typer.echo(text, nl=False)
    else:
        say(f"table: {table}")


def _write_table(geometry: str, table: Path, omega: float | None, speeds: list[float]) -> None:
    from levelone.campaign.coefficient_table import geometry_table
    from levelone.config.table_writer import write_table

    write_table(geometry_table(geometry, omega=omega, speeds=speeds if omega is not None else ()), table)
    say(f"table: {table}")


def _write_study(study: Path, found: Derivatives, geometry: str, extends: Path, lumped: bool) -> None:
    from levelone.config.study_writer import write_study

    written = write_study(study, found, geometry, extends, lumped=lumped)
    for name, why in written.left_out:
        say(f"left out: {name} {why}")
    say(f"study: {study}")
