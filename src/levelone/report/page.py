"""A page of its own: its templates, and its figures as files and inside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from levelone.errors import InputError
from levelone.report import style, svg, symbols
from levelone.report.formatting import number, percent

if TYPE_CHECKING:
    from levelone.report.pictures import Picture

Progress = Callable[[str, int, int], None]
"""Called with the stage's name, the steps done and the steps in all."""


def quiet(stage: str, done: int, total: int) -> None:
    """No progress."""


def environment() -> Environment:
    """Where templates come from, and the filters that they use."""
    made = Environment(
        loader=PackageLoader("levelone.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    made.filters.update(number=number, percent=percent, symbol=symbols.html)
    return made


def files_of(plans: Sequence[Picture], progress: Progress = quiet) -> list[tuple[bytes, bytes]]:
    """Draw pictures; PNG and SVG of each. ``progress`` is called after each figure and each file."""
    total, done = 3 * len(plans), 0

    def each(items: Iterable[Any], work: Callable[[Any], Any]) -> list[Any]:
        nonlocal done
        results = []
        for item in items:
            results.append(work(item))
            done += 1
            progress("report", done, total)
        return results

    with style.paper():
        figures = each(plans, lambda plan: plan.draw())
        dots = each(figures, style.png_of)
        lines = each(figures, style.svg_of)
    return list(zip(dots, lines, strict=True))


def write_figures(folder: Path, plans: Sequence[Picture], files: Sequence[tuple[bytes, bytes]]) -> list[dict[str, Any]]:
    """Write pictures into a folder; for each its number, name, section, caption, width and SVG for the page.

    Raises
    ------
    InputError
        The folder cannot be written to.
    """
    try:
        folder.mkdir(exist_ok=True)
        for plan, (dots, lines) in zip(plans, files, strict=True):
            (folder / f"{plan.name}.png").write_bytes(dots)
            (folder / f"{plan.name}.svg").write_bytes(lines)
    except OSError as error:
        raise InputError(str(folder), f"cannot be written: {error.strerror}") from error
    return [_shown(plan, lines.decode(), count) for count, (plan, (_, lines)) in enumerate(zip(plans, files, strict=True), start=1)]


def _shown(plan: Picture, text: str, count: int) -> dict[str, Any]:
    return {
        "number": count, "name": plan.name, "section": plan.criterion, "caption": plan.caption, "wide": plan.wide,
        "svg": Markup(svg.inline(text, plan.name)),  # drawn here: text in it is outlines
    }  # fmt: skip
