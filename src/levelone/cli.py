"""The command ``levelone``: parse, call, write. Each command imports what it needs, so that ``--help`` answers at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from levelone._version import __version__
from levelone.assess_command import assess
from levelone.check_command import check
from levelone.console import (
    Commands,
    announce_compilation,
    csv_draft,
    numbers,
    say,
    show,
    stage_bars,
    write_csv,
)
from levelone.dakota_command import dakota_app
from levelone.decompose_command import decompose
from levelone.derivatives_command import derivatives
from levelone.run_command import run
from levelone.store_commands import export, status

EPILOG = f"""\b
What to do next:
  levelone trim reference-evtol                   steady flight from 0 to 15 m/s: is it all installed?
  levelone simulate reference-evtol --speed 5     a step of forward speed, and what the criteria make of it
  levelone linearize reference-evtol --speed 5    poles of the closed loop
  levelone run studies/reference/study.toml       the whole study: a few minutes, ends with report.html
  levelone compare results/reference              the published findings, decided on that run
  levelone decompose studies/reference/study.toml the indices of the model itself, without a surrogate
  levelone calibrate studies/reference/calibration.toml   how the unpublished numbers were found
  levelone derivatives reference-wing-tail        aerodynamic derivatives of a geometry, against reduced frequency
  levelone check studies/own-model/study.toml     a model of your own: does its nominal case look right?
  levelone assess DATA.csv --columns ...          the criteria on recorded data

\b
Your own aircraft: copy reference-evtol.toml and its two tables, change the numbers, and give the path of your
file in place of "reference-evtol". The three files lie in
  {Path(__file__).parent / "vehicle" / "library"}
"""
app = typer.Typer(
    cls=Commands, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None, epilog=EPILOG,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)  # fmt: skip

VehicleArgument = Annotated[str, typer.Argument(metavar="VEHICLE", help="Name of a vehicle that ships, or path of a .toml file.")]
CsvOption = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write CSV (SI, rad) in place of a table.")]
SpeedOption = Annotated[float, typer.Option(help="Forward ground speed of the trim, m/s.")]
ClimbOption = Annotated[float, typer.Option(help="Rate of climb of the trim, m/s.")]
Axis = Literal["V_lon", "V_lat", "V_vert", "yaw_rate", "theta", "phi", "q", "p"]
Shape = Literal["step", "pulse"]
ModeOption = Annotated[Literal["rate", "attitude", "velocity", "position"], typer.Option(help="Flight mode.")]


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"levelone {__version__}")
        raise typer.Exit


@app.callback()
def levelone(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    """Predicted handling qualities of VTOL aircraft from flight simulation models, and how far they can be trusted."""


app.command()(run)
app.command()(check)
app.command()(status)
app.command()(export)
app.command()(assess)


@app.command()
def compare(directory: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that a run has filled.")]) -> None:
    """Decide the published study's findings on the results of a run; writes comparison.json."""
    from levelone.campaign.compare import COMPARISON, in_one_line, verdict_columns
    from levelone.campaign.compare import compare as decide

    verdicts = decide(directory)
    show("Findings", verdict_columns(verdicts))
    say(in_one_line(verdicts))
    say(f"comparison: {directory / COMPARISON}")


@app.command()
def experiments(
    file: Annotated[Path, typer.Argument(metavar="EXPERIMENTS.toml", help="The file of experiments.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The record.  [default: experiments.json beside it]")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="In place of the study's seed.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Worker threads; no influence on the results.")] = None,
) -> None:
    """Run a study on changed vehicles, to find what its verdicts hang on; goes on where it was interrupted."""
    from levelone.campaign.experiments import run_experiments

    announce_compilation()
    with stage_bars() as progress:
        record = run_experiments(file, out, seed=seed, threads=threads, progress=progress)
    say(f"experiments: {record}")


@app.command()
def calibrate(
    file: Annotated[Path, typer.Argument(metavar="CALIBRATION.toml", help="The calibration file.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the results.  [default: results/NAME]")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Worker threads; no influence on the results.")] = None,
) -> None:
    """Fit unpublished parameters of a vehicle to nominal handling qualities."""
    from levelone.campaign.calibration_run import run_calibration
    from levelone.campaign.models.builtin import RESPONSES
    from levelone.config.calibration_file import load_calibration

    checked = load_calibration(file, {name: unit for name, (unit, _) in RESPONSES.items()})
    from levelone.report.calibration import render_calibration

    folder = out if out is not None else Path("results") / checked.name
    announce_compilation()
    with stage_bars() as progress:
        results = run_calibration(checked, folder, threads=threads, progress=progress)
    page = render_calibration(folder)
    say(f"results: {results}")
    say(f"report:  {page}")


@app.command()
def report(directory: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that a run has filled.")]) -> None:
    """Write the report of a finished study anew."""
    from levelone.report.model_study import is_model_study, render_model_study

    if is_model_study(directory):
        say(f"report: {render_model_study(directory)}")
        return
    from levelone.dynamics.simulate import threads_of
    from levelone.report import render_report

    say(f"report: {render_report(directory, workers=min(threads_of(None), 4))}")


@app.command()
def trim(
    vehicle: VehicleArgument,
    speed: Annotated[str, typer.Option(help="Forward ground speeds, m/s: 0,5,10 or FIRST:LAST:COUNT.")] = "0:15:16",
    climb: ClimbOption = 0.0,
    csv: CsvOption = None,
) -> None:
    """Steady flight at one speed or several."""
    from levelone.config.vehicle_file import load_vehicle

    speeds = numbers(speed, "--speed")
    aircraft = load_vehicle(vehicle)
    with csv_draft(csv) as draft:
        announce_compilation()
        from levelone import columns, dynamics

        columns.check_speeds(aircraft, speeds, climb)
        found = [dynamics.trim(aircraft, each, climb) for each in speeds]
        if draft is not None:
            write_csv(draft, columns.trim_record(speeds, climb, found))
        else:
            show(f"Trim of {aircraft.name}, climb {climb:g} m/s", columns.trim_table(speeds, found))


@app.command()
def simulate(
    vehicle: VehicleArgument,
    axis: Annotated[Axis, typer.Option(help="Command that moves.")] = "V_lon",
    amplitude: Annotated[float, typer.Option(help="Change of the command: m/s, rad or rad/s.")] = 1.0,
    shape: Annotated[Shape, typer.Option(help="A step stays, a pulse ends after --length.")] = "step",
    length: Annotated[float, typer.Option(help="Length of a pulse, s.")] = 0.5,
    speed: SpeedOption = 5.0,
    duration: Annotated[float, typer.Option(help="Length of the record, s; the input begins at 1 s.")] = 10.0,
    mode: ModeOption = "velocity",
    csv: CsvOption = None,
) -> None:
    """Fly a step or a pulse from trim, and measure the answer."""
    from levelone.config.manoeuvres import manoeuvre
    from levelone.config.vehicle_file import load_vehicle

    aircraft = load_vehicle(vehicle)
    options = {"length": length} if shape == "pulse" else {}
    flown = manoeuvre(shape, axis, amplitude, aircraft.controller, speed, mode, duration=duration, **options)
    with csv_draft(csv) as draft:
        announce_compilation()
        from levelone import columns, dynamics

        history = dynamics.simulate(aircraft, flown)
        if draft is not None:
            history.to_csv(draft)
        else:
            show(f"{flown.name} of {amplitude:g} {flown.unit} from {speed:g} m/s, {aircraft.name}", columns.history_table(history))
            show("Criteria", columns.criteria_table(history, flown))


@app.command()
def linearize(
    vehicle: VehicleArgument,
    speed: SpeedOption = 5.0,
    climb: ClimbOption = 0.0,
    mode: ModeOption = "velocity",
    command: Annotated[str, typer.Option("--input", help="Command: V_lon, V_lat, theta, q ...")] = "V_lon",
    output: Annotated[str, typer.Option(help="Measured channel: q, theta, V_lon ...")] = "q",
    omega: Annotated[str, typer.Option(help="Frequencies of the response, rad/s: 1,2,5 or FIRST:LAST:COUNT.")] = "0.1:40:400",
    csv: CsvOption = None,
) -> None:
    """Poles of the closed loop; with --csv its frequency response."""
    from levelone.config.manoeuvres import integration_step
    from levelone.config.vehicle_file import load_vehicle

    frequencies = numbers(omega, "--omega")
    aircraft = load_vehicle(vehicle)
    with csv_draft(csv) as draft:
        announce_compilation()
        from levelone import columns, dynamics

        dt = integration_step(aircraft.controller)
        model = dynamics.linearize(aircraft, speed, flight_mode=mode, climb=climb, dt=dt)
        if draft is not None:
            write_csv(draft, columns.response_record(model, command, output, frequencies))
        else:
            show(f"Poles of {aircraft.name} at {speed:g} m/s, {mode} mode", columns.pole_table(model, command, output))


app.command()(decompose)
app.command()(derivatives)
app.add_typer(dakota_app, name="dakota")


def main() -> None:
    """Entry point of the command."""
    app(prog_name="levelone")


if __name__ == "__main__":
    main()
