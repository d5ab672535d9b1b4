"""The report: every figure as SVG and PNG, and one page that holds all."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from os import PathLike
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, UndefinedError
from markupsafe import Markup

from levelone.errors import InputError
from levelone.report import assumptions, style, svg, symbols, tables
from levelone.report.charts import Charts, charts_of
from levelone.report.formatting import number, percent
from levelone.report.pictures import Picture, pictures
from levelone.report.results import CRITERIA, Results, load_results

Progress = Callable[[str, int, int], None]
"""Called with the stage's name, the steps done and the steps in all."""


def render_report(directory: str | PathLike[str], progress: Progress | None = None) -> Path:
    """Draw all figures of a finished study into ``figures/`` and write ``report.html``; return its path.

    The same results give the same bytes. Nothing is written unless the folder can be read as a whole.

    Parameters
    ----------
    directory
        Folder that the study wrote.
    progress
        Called after each figure drawn and each file written, with ``"report"``, steps done and steps in all.

    Raises
    ------
    InputError
        The folder holds no results, is incomplete, was written under another schema, or cannot be written to.
    """
    results = load_results(directory)
    try:
        charts = charts_of(results.summary["study"])
        context = _context(results, charts)
        plans = pictures(results, charts)
        with style.paper():
            drawings = _write(results.directory / "figures", plans, progress or (lambda stage, done, total: None))
        page = _environment().get_template("report.html").render(**context, drawings=drawings)
    except (KeyError, UndefinedError) as error:
        raise InputError(str(results.directory), f"the results miss {error}; run the study again") from error
    path = results.directory / "report.html"
    try:
        path.write_text(page, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from error
    return path


def _write(folder: Path, plans: list[Picture], progress: Progress) -> dict[str, list[dict[str, Any]]]:
    """Draw and save; the pictures of each criterion with number, caption and inline SVG."""
    total, done = 3 * len(plans), 0

    def each(items: Iterable[Any], work: Callable[[Any], Any]) -> list[Any]:
        nonlocal done
        results = []
        for item in items:
            results.append(work(item))
            done += 1
            progress("report", done, total)
        return results

    figures = each(plans, lambda plan: plan.draw())
    try:
        folder.mkdir(exist_ok=True)
        pairs = list(zip(plans, figures, strict=True))
        each(pairs, lambda pair: style.save_png(pair[1], folder / f"{pair[0].name}.png"))
        each(pairs, lambda pair: style.save_svg(pair[1], folder / f"{pair[0].name}.svg"))
    except OSError as error:
        raise InputError(str(folder), f"cannot be written: {error.strerror}") from error
    return _numbered(folder, plans)


def _numbered(folder: Path, plans: list[Picture]) -> dict[str, list[dict[str, Any]]]:
    drawings: dict[str, list[dict[str, Any]]] = {criterion: [] for criterion in CRITERIA}
    for count, plan in enumerate(plans, start=1):
        text = (folder / f"{plan.name}.svg").read_text(encoding="utf-8")
        drawings[plan.criterion].append({
            "number": count, "name": plan.name, "caption": plan.caption, "wide": plan.wide,
            "svg": Markup(svg.inline(text, plan.name)),  # drawn here: text in it is outlines
        })  # fmt: skip
    return drawings


def _context(results: Results, charts: Charts) -> dict[str, Any]:
    """Everything that the template shows, apart from the pictures."""
    summary = results.summary
    varied, fixed = assumptions.ranked(summary)
    titles, validity = tables.validity_rows(summary["validity"])
    return {
        "study": summary["study"],
        "provenance": summary["provenance"],
        "summary": summary,
        "varied": varied,
        "fixed": fixed,
        "rows": tables.summary_rows(results, tables.nominal_levels(results, charts)),
        "levels": tables.level_rows(summary["levels"]),
        "indices": {
            criterion: [(symbols.title(name), symbols.html(name), symbols.field_unit(entry["unit"])[1], tables.index_rows(entry))
                        for name, entry in results.of(criterion).items()]
            for criterion in CRITERIA
        },
        "failures": tables.failure_rows(results),
        "validity_titles": titles,
        "validity": validity,
        "numerics": tables.numerics_rows(results),
        "nominal": tables.nominal_rows(summary["nominal"]),
        "boundaries": charts,
        "criteria": {criterion: symbols.CRITERION_TITLES[criterion] for criterion in CRITERIA},
    }  # fmt: skip


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("levelone.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters.update(number=number, percent=percent, symbol=symbols.html)
    return environment
