"""The report: every figure as SVG and PNG, and one page that holds all."""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from os import PathLike
from pathlib import Path
from typing import Any

from jinja2 import UndefinedError

from levelone.errors import InputError
from levelone.report import assumptions, symbols, tables
from levelone.report.charts import Charts, charts_of
from levelone.report.page import Progress, environment, files_of, quiet, write_figures
from levelone.report.pictures import Picture, pictures
from levelone.report.results import CRITERIA, Results, load_results
from levelone.report.sections import contexts, further_pictures
from levelone.report.translation import nominal_levels


def render_report(directory: str | PathLike[str], progress: Progress = quiet, workers: int = 1) -> Path:
    """Draw all figures of a finished study into ``figures/`` and write ``report.html``; return its path.

    The same results give the same bytes. Nothing is written unless the folder can be read as a whole.

    Parameters
    ----------
    directory
        Folder that the study wrote.
    progress
        Called after each figure drawn and each file made, with ``"report"``, steps done and steps in all; not with several workers.
    workers
        Processes that draw, on Linux; no influence on the results.

    Raises
    ------
    InputError
        The folder holds no results, is incomplete, was written under another schema, or cannot be written to.
    """
    results = load_results(directory)
    try:
        charts = charts_of(results.summary["study"])
        context = _context(results, charts)
        plans = _plans(results)
        alone = workers == 1 or sys.platform != "linux"
        files = files_of(plans, progress) if alone else _files_by(workers, results.directory, len(plans))
        drawings = _by_section(write_figures(results.directory / "figures", plans, files))
        page = environment().get_template("report.html").render(**context, drawings=drawings)
    except (KeyError, UndefinedError) as error:
        raise InputError(str(results.directory), f"the results miss {error}; run the study again") from error
    path = results.directory / "report.html"
    try:
        path.write_text(page, encoding="utf-8", newline="\n")
    except OSError as error:
        raise InputError(str(path), f"cannot be written: {error.strerror}") from error
    return path


def _plans(results: Results) -> list[Picture]:
    """Every picture of the report, in its order."""
    return [*pictures(results, charts_of(results.summary["study"])), *further_pictures(results)]


def _files_by(workers: int, directory: Path, count: int) -> list[tuple[bytes, bytes]]:
    """Draw in several processes: each takes every so many pictures.

    They are forked: started anew, each would load the libraries and read every symbol again, which costs what it saves.
    """
    with ProcessPoolExecutor(workers, mp_context=get_context("fork")) as pool:
        parts = list(pool.map(_part, [directory] * workers, range(workers), [workers] * workers))
    return [parts[i % workers][i // workers] for i in range(count)]


def _part(directory: Path, first: int, step: int) -> list[tuple[bytes, bytes]]:
    return files_of(_plans(load_results(directory))[first::step])


def _by_section(drawings: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Pictures of each criterion and of each further section."""
    out: dict[str, list[dict[str, Any]]] = {criterion: [] for criterion in CRITERIA}
    for drawing in drawings:
        out.setdefault(drawing["section"], []).append(drawing)
    return out


def _context(results: Results, charts: Charts) -> dict[str, Any]:
    """Everything that the template shows, apart from the pictures."""
    summary = results.summary
    levels = tables.nominal_levels(results, charts) | nominal_levels(results)
    varied, fixed = assumptions.ranked(summary)
    titles, validity = tables.validity_rows(summary["validity"])
    return {
        "study": summary["study"],
        "provenance": summary["provenance"],
        "summary": summary,
        "varied": varied,
        "fixed": fixed,
        "rows": tables.summary_rows(results, levels),
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
        **contexts(results),
        "criteria": {criterion: symbols.CRITERION_TITLES[criterion] for criterion in CRITERIA},
    }  # fmt: skip
