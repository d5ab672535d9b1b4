"""The command ``levelone dakota``: a study to Dakota, Dakota's evaluations flown, Dakota's results read back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from levelone.console import Commands, announce_compilation, csv_draft, say, show, stage_bars, write_csv
from levelone.errors import InputError

if TYPE_CHECKING:
    from levelone.config.study_file import Study

dakota_app = typer.Typer(
    cls=Commands, no_args_is_help=True, rich_markup_mode=None, help="A study through Dakota: input files, analysis driver, results."
)

StudyArgument = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")]
Seed = Annotated[int | None, typer.Option(min=0, help="In place of the study's seed.")]
Names = Annotated[list[str] | None, typer.Option("--response", help="A response, repeatable.  [default: all of the study]")]
Direct = Annotated[int, typer.Option("--direct", min=2, help="Base points N of direct.in: N (factors + 2) flights.")]


def _study(path: Path) -> Study:
    from levelone.config.study_file import load_study

    return load_study(path)


def _folder(out: Path) -> Path:
    """The folder, made if need be."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("--out", f"{out} cannot be made a folder: {error.strerror}") from None
    return out


@dakota_app.command()
def export(
    study: StudyArgument,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the input files.")],
    response: Names = None,
    direct: Direct = 1024,
    seed: Seed = None,
) -> None:
    """Write Dakota's input files of a study: screening, Latin hypercube, decomposition on a surrogate, and of the model itself."""
    checked = _study(study)
    from levelone.campaign.dakota.export import export_plan, plan_of

    plan = plan_of(checked, responses=response or (), seed=seed, direct_points=direct)
    written = export_plan(plan, _folder(out))
    for path in written.written:
        say(f"input file: {path}")
    for name, why in written.left_out:
        say(f"left out: {name}: {why}")


@dakota_app.command()
def drive(
    study: StudyArgument,
    parameters: Annotated[Path, typer.Argument(metavar="PARAMS", help="Parameters file, which Dakota writes.")],
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="Results file, which Dakota reads.")],
    threads: Annotated[int | None, typer.Option(min=1, help="Worker threads; no influence on the results.")] = None,
) -> None:
    """Fly what Dakota asks for: the analysis driver, one evaluation or a batch."""
    checked = _study(study)
    from levelone.campaign.dakota.drive import drive as answer
    from levelone.campaign.study import build_model

    count, undefined = answer(checked.space, build_model(checked, threads), parameters, results)
    if undefined:
        say(f"{count} evaluations, {undefined} values undefined: written as nan")


@dakota_app.command("import")
def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Tabular or HDF5 results of Dakota's.")],
    study: Annotated[Path, typer.Option("--study", metavar="STUDY.toml", help="The study file.")],
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Write JSON, CSV and NetCDF.")] = None,
    columns: Annotated[str, typer.Option(help="Names of the columns of a file without header: M,I_y,zeta.")] = "",
) -> None:
    """Read results of Dakota's, and analyse them as runs of our own."""
    checked = _study(study)
    from levelone.campaign.dakota.importing import import_results, write_import
    from levelone.campaign.dakota.tables import index_table, response_table

    names = tuple(name.strip() for name in columns.split(",") if name.strip())
    done = import_results(file, checked.space, checked.policy, checked.seed, checked.method.bootstrap, names)
    show(f"{file.name}: {done.results['runs']} runs, {done.results['layout']}", response_table(done.results))
    for name, row in done.results["responses"].items():
        table = index_table(row)
        if table:
            show(name, table)
    if done.results["layout"] == "other":
        say(f"no indices: {done.results['status']}")
    if out is not None:
        for path in write_import(done, _folder(out)):
            say(f"written: {path}")


@dakota_app.command()
def compare(
    study: StudyArgument,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of Dakota's files and of the comparison.")],
    response: Names = None,
    seed: Seed = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Worker threads; no influence on the results.")] = None,
) -> None:
    """Run a study through Dakota and through levelone: indices, wall and processor time side by side."""
    checked = _study(study)
    from levelone.campaign.dakota.compare import COMPARISON, compare_routes
    from levelone.campaign.dakota.execute import find_dakota
    from levelone.campaign.dakota.tables import agreement_table, comparison_table, stage_table

    find_dakota()
    folder = _folder(out)
    announce_compilation()
    with stage_bars() as progress:
        content = compare_routes(checked, folder, responses=response or (), seed=seed, threads=threads, progress=progress)
    table = comparison_table(content)
    with csv_draft(folder / "dakota-comparison.csv", "--out") as draft:
        if draft is not None:
            write_csv(draft, table)
    show("Indices of both routes", table)
    show("Agreement", agreement_table(content))
    show("Cost", stage_table(content))
    for each in content["left_out"]:
        say(f"left out: {each['file']}: {each['why']}")
    say(f"comparison: {folder / COMPARISON}")
