"""The commands ``levelone status`` and ``levelone export``: what the folder of a campaign holds."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from levelone.console import say, show
from levelone.errors import InputError

if TYPE_CHECKING:
    from levelone.campaign.store_plan import Plan
    from levelone.campaign.store_reader import Stored, StoredModel

DirArgument = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a campaign's results.")]
FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="The new file: .csv, .parquet or .nc.")]
ModelOption = Annotated[str, typer.Option("--model", metavar="HASH", help="Beginning of a model's hash, where there are several.")]
Force = Annotated[bool, typer.Option("--force", help="Write over a file that is there.")]


def status(folder: DirArgument, model: ModelOption = "") -> None:
    """Say what a campaign has done, what failed and where, and how to go on; also while it runs."""
    from levelone.campaign.store_plan import read_plan
    from levelone.campaign.store_reader import read_stored, stored_models
    from levelone.campaign.store_schema import is_written, open_to_read

    path = store_of(folder)
    with closing(open_to_read(path)) as connection:
        plan, models = read_plan(connection, path), stored_models(connection, path)
        shown = _shown(models, path, model, plan)
        of_plan = plan is not None and (shown is None or shown.hash == plan.model)
        stored = read_stored(connection, path, shown, planned=of_plan) if shown else None
    running = is_written(path)
    if plan and plan.study:
        say(f"study: {plan.study}")
    if plan and of_plan:
        say(_done(len(stored.points) if stored else 0, plan.planned))
    else:
        say(f"evaluations: {len(stored.points) if stored else 0} (of all studies)")
    if stored and len(stored.points):
        _outcomes(stored)
        _time(stored)
    _others(models, shown)
    if running:
        say("a process is running this campaign now")
    elif plan and plan.held < plan.planned:
        say(f"to go on: levelone run STUDY.toml --out {folder} --resume (runs only what is missing)")


def _shown(models: list[StoredModel], path: Path, prefix: str, plan: Plan | None) -> StoredModel | None:
    """The model that was asked for; else that of the plan, None while it has no evaluations; else the one evaluated last."""
    from levelone.campaign.store_export import chosen

    if prefix or (plan is None and models):
        return chosen(models, path, prefix)
    return next((each for each in models if plan and each.hash == plan.model), None)


def _others(models: list[StoredModel], shown: StoredModel | None) -> None:
    others = ", ".join(each.hash[:12] for each in models if each is not shown)
    if others:
        this = f"this is model {shown.hash[:12]}" if shown else "of this model there is none yet"
        say(f"{this}; the store also holds evaluations of {others} (--model)")


def export(folder: DirArgument, file: FileArgument, model: ModelOption = "", force: Force = False) -> None:
    """Write a campaign's evaluations as CSV, Parquet or NetCDF, one row each."""
    from levelone.campaign.store_export import export as write

    stored = write(store_of(folder), file, model=model, force=force)
    say(f"{len(stored.points)} evaluations of model {stored.model.hash[:12]}: {file}")


def store_of(folder: Path) -> Path:
    """The store in a campaign's folder.

    Raises
    ------
    InputError
        There is none.
    """
    from levelone.campaign.store_schema import FILE_NAME

    if not folder.is_dir():
        raise InputError("DIR", f"{folder} is not a folder; give the one that a campaign wrote (it holds {FILE_NAME})")
    path = folder / FILE_NAME
    if not path.is_file():
        raise InputError("DIR", f"{folder} holds no {FILE_NAME}: no campaign has been run in it")
    return path


def _done(held: int, planned: int) -> str:
    text = f"evaluations: {held}, planned: {planned}"
    # rounded down: 100 % is all of them
    return f"{text} ({100 * held // planned} %)" if held else text


def _outcomes(stored: Stored) -> None:
    """Counts in words on stdout, and where the failures lie on stderr."""
    import numpy as np

    from levelone.campaign.failure_map import failure_map
    from levelone.campaign.store_reader import outcomes

    points, model = stored.points, stored.model
    low, high = points.min(axis=0), points.max(axis=0)
    unit = (points - low) / np.where(high > low, high - low, 1.0)
    codes = stored.evaluations.status
    found = failure_map(unit, points, codes, model.factors, [""] * len(model.factors), model.names, seed=0)
    complete = int((outcomes(codes) == 0).sum())
    rows = [("every response", "", complete), *((row["name"], row["status"], row["evaluations"]) for row in found["outcomes"])]
    names, texts, counts = (list(column) for column in zip(*rows, strict=True))
    show("evaluations by outcome", {"outcome": names, "what happened": texts, "evaluations": [str(count) for count in counts]})
    pair = found.get("pair")
    if pair and pair["p_value"] < 0.05:
        say(f"failures gather in the plane of {pair['factors'][0]} and {pair['factors'][1]} (p = {pair['p_value']:.2g})")
    for row in found.get("factors", [])[:3]:
        if row["p_value"] < 0.05:
            side = "high" if row["mean_failed"] > row["mean_all"] else "low"
            say(f"failures lie {side} in {row['factor']}: mean position {row['mean_failed']:.2f} of the range seen, all "
                f"{row['mean_all']:.2f} (p = {row['p_value']:.2g})")  # fmt: skip


def _time(stored: Stored) -> None:
    import numpy as np

    from levelone.campaign.store_export import instant

    seconds = stored.evaluations.seconds
    known = seconds[np.isfinite(seconds)]
    if known.size:
        middle, late = np.quantile(known, [0.5, 0.95])
        say(f"an evaluation takes {middle:.3g} s (median), {late:.3g} s (95 %)")
    say(f"last written: {instant(float(stored.finished.max()))}")
