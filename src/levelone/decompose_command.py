"""The command ``levelone decompose``: Sobol indices of a study's model itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from levelone.console import announce_compilation, say, show, stage_bars
from levelone.errors import InputError

StudyArgument = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the results.  [default: results/NAME]")]
BasePoints = Annotated[int, typer.Option(help="Base points in all; each costs a run for each factor, and two.")]
Scramblings = Annotated[int, typer.Option(help="Independent scramblings, from whose spread the intervals come.")]
SecondOrder = Annotated[bool, typer.Option("--second-order", help="Pairs of factors as well, for nearly twice the runs.")]
Group = Annotated[list[str] | None, typer.Option(metavar="NAME=A,B", help="Factors to be moved together; repeat for more groups.")]
UntilWidth = Annotated[float | None, typer.Option(help="Add scramblings until no interval of S1 and ST is wider.")]
Most = Annotated[int, typer.Option("--most-base-points", help="With --until-width: where adding ends all the same.")]
Seed = Annotated[int | None, typer.Option(min=0, help="In place of the study's seed.")]
Threads = Annotated[int | None, typer.Option(min=1, help="Worker threads; no influence on the results.")]


def decompose(
    study: StudyArgument, out: Out = None, base_points: BasePoints = 4096, scramblings: Scramblings = 8,
    second_order: SecondOrder = False, group: Group = None, until_width: UntilWidth = None, most: Most = 65536,
    seed: Seed = None, threads: Threads = None,
) -> None:  # fmt: skip
    """Decompose the variance of a study's responses on the model itself; goes on where it was interrupted."""
    from levelone.config.study_file import load_study

    checked = load_study(study)
    from levelone.campaign.direct import Plan, decompose_study

    plan = Plan(base_points, scramblings, second_order, groups_of(group or ()) or None, until_width, most)
    plan.design(checked, 0, plan.scramblings)  # refuses what cannot be built, before anything is announced
    folder = out if out is not None else Path("results") / checked.name
    announce_compilation()
    with stage_bars() as progress:
        path = decompose_study(checked, folder, plan, seed=seed, threads=threads, progress=progress)
    _printed(path)
    say(f"decomposition: {path}")
    if (folder / "results.json").is_file():
        say(f"levelone report {folder} sets it beside the indices on surrogates")


def groups_of(texts: Sequence[str]) -> dict[str, list[str]]:
    """Groups written as NAME=A,B.

    Raises
    ------
    InputError
        Another form, or a name given twice.
    """
    groups: dict[str, list[str]] = {}
    for text in texts:
        name, _, members = text.partition("=")
        factors = [each.strip() for each in members.split(",") if each.strip()]
        if not name.strip() or not factors:
            raise InputError("--group", f"{text!r} is no group; write NAME=A,B with the names of factors")
        if name.strip() in groups:
            raise InputError("--group", f"{name.strip()!r} is given twice")
        groups[name.strip()] = factors
    return groups


def _printed(path: Path) -> None:
    """A table of each response on stdout, doubts and the cost on stderr."""
    import json

    found = json.loads(path.read_text(encoding="utf-8"))
    for name, entry in found["responses"].items():
        ranked = sorted(entry["sobol"].items(), key=lambda row: -row[1]["ST"] if row[1]["ST"] == row[1]["ST"] else 1.0)
        show(f"{name}: {entry['status']}, {entry['failed']} runs failed", _columns(ranked))
        if entry["doubt"]:
            say(f"{name}: do not trust these indices: {entry['doubt']}")
        for pair in entry.get("S2", [])[:3]:
            low, high = pair["S2_ci"]
            say(f"{name}: S2 of {' and '.join(pair['pair'])} {pair['S2']:.3f} ({low:.3f} to {high:.3f})")
    cost, checked = found["cost"], found["against_whole_records"]
    say(f"{found['runs']} runs, {found['scramblings']} scramblings; widest interval {found['widest']:.3g}; {_reached(found)}")
    say(f"{cost['wall_s']:.0f} s, {cost['cpu_s']:.0f} CPU-s, {cost['peak_memory_gib']:.2f} GiB")
    say(
        f"{checked['runs']} runs with whole records: largest difference {checked['largest_difference']:.2g} of the spread, "
        f"{checked['statuses_differ']} fail in one and not in the other"
    )


def _columns(ranked: Sequence[tuple[str, dict[str, Any]]]) -> dict[str, list[Any]]:
    rows = [(name, x["S1"], _interval(x["S1_ci"]), x["ST"], _interval(x["ST_ci"])) for name, x in ranked]
    names = ("factor", "S1", "95 %", "ST", "95 % ")
    return {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


def _interval(ends: Sequence[float]) -> str:
    return f"{ends[0]:.3f} to {ends[1]:.3f}"


def _reached(found: dict[str, Any]) -> str:
    asked = found["until_width"]
    if asked != asked:
        return "no width was asked for"
    if found["widest"] != found["widest"]:
        return f"{asked:g} was asked for: no response has intervals"
    return f"{asked:g} was asked for" + ("" if found["widest"] <= asked else ": not reached, raise --most-base-points")
