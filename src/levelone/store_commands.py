"""The commands ``levelone status`` and ``levelone export``: what the folder of a campaign holds."""

from __future__ import annotations

import json
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from levelone.console import say, show
from levelone.errors import InputError

if TYPE_CHECKING:
    from levelone.campaign.store_reader import Stored

DirArgument = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a campaign's results.")]
FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="The new file: .csv, .parquet or .nc.")]
ModelOption = Annotated[str, typer.Option("--model", metavar="HASH", help="Beginning of a model's hash, where there are several.")]
Force = Annotated[bool, typer.Option("--force", help="Write over a file that is there.")]

#: what a run writes beside its store before the first evaluation
PLAN_NAME = "campaign.json"


def status(folder: DirArgument, model: ModelOption = "") -> None:
    """Say what a campaign has done, what failed and where, and how to go on; also while it runs."""
    from levelone.campaign.store_export import chosen
    from levelone.campaign.store_reader import read_stored, stored_models
    from levelone.campaign.store_schema import is_written, open_to_read

    path = store_of(folder)
    plan = read_plan(folder)
    with closing(open_to_read(path)) as connection:
        models = stored_models(connection, path)
        stored = read_stored(connection, path, chosen(models, path, model)) if models else None
    running = is_written(path)
    if plan.get("study"):
        say(f"study: {plan['study']}")
    held = len(stored.points) if stored else 0
    say(_done(held, plan.get("planned")))
    if stored:
        _outcomes(stored)
        _time(stored)
    if len(models) > 1 and stored:
        others = ", ".join(each.hash[:12] for each in models if each.hash != stored.model.hash)
        say(f"this is model {stored.model.hash[:12]}; the store also holds evaluations of {others} (--model)")
    if running:
        say("a process is running this campaign now")
    elif held < plan.get("planned", 0):
        say(f"to go on: levelone run STUDY.toml --out {folder} --resume (runs only what is missing)")


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


def read_plan(folder: Path) -> dict[str, Any]:
    """``planned`` (number of evaluations) and ``study`` (title) of the last run, as far as the folder says.

    Raises
    ------
    InputError
        The file is damaged.
    """
    path = folder / PLAN_NAME
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(found, dict):
            raise ValueError("it holds no names")
        plan = {name: found[name] for name in ("planned", "study") if name in found}
        if not isinstance(plan.get("planned", 0), int) or not isinstance(plan.get("study", ""), str):
            raise ValueError("it holds other kinds of values than a number and a title")
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}") from None
    except (ValueError, TypeError, RecursionError) as error:
        raise InputError(str(path), f"is damaged ({error}): remove it, the evaluations do not depend on it") from None
    return plan


def _done(held: int, planned: int | None) -> str:
    if planned is None:
        return f"evaluations: {held}"
    text = f"evaluations: {held}, planned: {planned}"
    return f"{text} ({100.0 * held / planned:.0f} %)" if 0 < held <= planned else text


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
