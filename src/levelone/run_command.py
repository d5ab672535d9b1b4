"""The command ``levelone run``: a study of the built-in vehicle, or of a model of one's own, to its report."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from levelone.console import INTERRUPTED, announce_compilation, say, stage_bars
from levelone.errors import InputError

if TYPE_CHECKING:
    from levelone.config.campaign_table import CampaignOptions


def run(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the results.  [default: results/NAME]")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="In place of the study's seed.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Worker threads; no influence on the results.")] = None,
    executor: Annotated[
        str | None, typer.Option(metavar="WHERE", help="Of a [model]: batch, processes, cluster or dask://HOST:PORT.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Of a [model]: processes; no influence on the results.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Insist on going on with what the folder holds.")] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Of a [model]: evaluate anew what timed out, crashed or gave no value.")
    ] = False,
) -> None:
    """Run a study and write its results and report; goes on where it was interrupted."""
    from levelone.config.model_study import is_model_study

    if is_model_study(study):
        run_own_model(study, out, seed, threads, executor, workers, resume, retry_failed)
        return
    for name, given in (("--executor", executor), ("--workers", workers), ("--retry-failed", retry_failed or None)):
        if given is not None:
            raise InputError(name, f"has no place here: {study.name} flies the built-in vehicle, in threads of this process")
    run_builtin(study, out, seed, threads, resume)


def run_builtin(study: Path, out: Path | None, seed: int | None, threads: int | None, resume: bool) -> None:
    """Run a study of the built-in vehicle."""
    from levelone.config.study_file import load_study

    checked = load_study(study)
    from levelone.campaign import run_study
    from levelone.campaign.compare import compare as decide
    from levelone.campaign.compare import in_one_line
    from levelone.campaign.store import prepare_folder
    from levelone.dynamics.simulate import threads_of
    from levelone.report import render_report

    folder = out if out is not None else Path("results") / checked.name
    _check_resumable(folder, resume)
    folder = prepare_folder(folder)
    announce_compilation()
    try:
        with stage_bars() as progress:
            results = run_study(checked, folder, seed=seed, threads=threads, progress=progress)
    except KeyboardInterrupt:
        say(f"interrupted: finished runs are kept in {folder}, the same command goes on with them")
        raise typer.Exit(INTERRUPTED) from None
    verdicts = in_one_line(decide(folder)) if checked.findings is not None else ""
    page = render_report(folder, workers=min(threads_of(threads), 4))
    say(f"results: {results}")
    if checked.findings is not None:
        say(f"findings: {verdicts}")
    say(f"report:  {page}")


def run_own_model(
    study: Path,
    out: Path | None,
    seed: int | None,
    threads: int | None,
    executor: str | None,
    workers: int | None,
    resume: bool,
    retry_failed: bool,
) -> None:
    """Run a study of a model of one's own."""
    from levelone.config.model_study import load_model_study

    checked = load_model_study(study)
    options = _options(checked.campaign, executor, workers)
    from levelone.campaign.model_study import run_model_study
    from levelone.campaign.progress import tally_text
    from levelone.report.model_study import render_model_study

    folder = out if out is not None else Path("results") / checked.name
    _check_resumable(folder, resume)
    with stage_bars() as progress:
        results = run_model_study(
            checked, folder, options=options, seed=seed, threads=threads, retry_failed=retry_failed, progress=progress,
            on_tally=lambda tally: progress.note(tally_text(tally)),
        )  # fmt: skip
    page = render_model_study(folder)
    say(f"results: {results}")
    say(f"report:  {page}")


def _options(given: CampaignOptions, executor: str | None, workers: int | None) -> CampaignOptions:
    """The study's options with those of the command in their place."""
    changes: dict[str, object] = {}
    if workers is not None:
        changes["workers"] = workers
    if executor is not None:
        from levelone.config.campaign_table import check_executor

        check_executor(executor, "--executor")
        changes |= {"executor": executor} | ({} if executor == "cluster" else {"cluster": None})
        if executor != "processes" and workers is None:
            changes |= {"workers": None}
    try:
        return replace(given, **changes)  # type: ignore[arg-type]
    except InputError as error:
        raise InputError(f"campaign.{error.field}", error.problem) from None


def _check_resumable(folder: Path, resume: bool) -> None:
    from levelone.campaign.store_schema import FILE_NAME

    if resume and not (folder / FILE_NAME).is_file():
        raise InputError("--resume", f"{folder} holds no {FILE_NAME}: there is no campaign to go on with")
