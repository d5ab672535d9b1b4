"""What the command shares: errors of one line, tables, CSV files, progress bars. Nothing heavy is imported with it."""

from __future__ import annotations

import csv
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from levelone.errors import InputError, LeveloneError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, TaskID

INTERRUPTED = 130
Columns = Mapping[str, Sequence[Any]]


class Commands(TyperGroup):
    """Commands whose errors are one line on stderr: exit code 2 for bad input, 130 for Ctrl-C."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except LeveloneError as error:
            text = " ".join(str(error).split())
            say(text if error.exit_code == INTERRUPTED else f"error: {text}")
            raise typer.Exit(error.exit_code) from None
        except KeyboardInterrupt:
            say("interrupted: what was not finished has not been written")
            raise typer.Exit(INTERRUPTED) from None


def say(text: str) -> None:
    """A line on stderr."""
    typer.echo(text, err=True)


def numbers(text: str, field: str) -> list[float]:
    """``"0,5,10"``, or ``"FIRST:LAST:COUNT"`` in equal steps.

    Raises
    ------
    InputError
        Neither form.
    """
    parts = text.split(":")
    try:
        if len(parts) == 3:
            first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
            values = [first + (last - first) * i / (count - 1) for i in range(count)] if count > 1 else []
        else:
            values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if not values or not all(abs(value) < float("inf") for value in values):
        raise InputError(
            field, f"{text!r} is no list; write numbers like 0,5,10, or FIRST:LAST:COUNT like 0:15:16 with two or more"
        )
    return values


@contextmanager
def csv_draft(path: Path | None, field: str = "--csv") -> Iterator[Path | None]:
    """A place to write to that becomes ``path`` when the block ends well; None where no file was asked for.

    Raises
    ------
    InputError
        Before anything is computed, if the file cannot be made.
    """
    if path is None:
        yield None
        return
    try:
        if path.is_dir():
            raise IsADirectoryError(None, "it is a folder")
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        os.close(handle)
    except OSError as error:
        raise InputError(field, f"cannot write {path}: {error.strerror}") from None
    draft = Path(name)
    try:
        yield draft
        draft.chmod(0o644)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def write_csv(path: Path, columns: Columns) -> None:
    """Columns of equal length under their names; numbers to the last bit."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))


def show(title: str, columns: Columns) -> None:
    """A table on stdout; floats with four significant digits, text on the left."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(title=title, box=SIMPLE_HEAD, title_justify="left", title_style="bold")
    cells = [[each if isinstance(each, str) else _digits(each) for each in values] for values in columns.values()]
    for name, values in zip(columns, columns.values(), strict=True):
        table.add_column(name, justify="left" if any(isinstance(each, str) for each in values) else "right")
    for row in zip(*cells, strict=True):
        table.add_row(*row)
    _console().print(table)


def _digits(value: float) -> str:
    return f"{0.0 if abs(value) < 1e-12 else value:.4g}"


def _console(stderr: bool = False) -> Console:
    from rich.console import Console

    # a pipe or file takes whole rows, however wide
    stream = sys.stderr if stderr else sys.stdout
    return Console(stderr=stderr, highlight=False, markup=False, width=None if stream.isatty() else 200)


def announce_compilation(part: str = "dynamics") -> None:
    """Say that the first run compiles the kernels of a part of the package, where it does."""
    from levelone.compiled import cache_folder, folders_with

    folder = cache_folder(folders_with(f"levelone.{part}"))
    if folder is None:
        say("compiling the kernels (no folder for compiled code can be written: this happens in every run) ...")
    elif not any(Path(folder).rglob("*.nbc")):
        say("compiling the kernels (first run only, about half a minute) ...")


class StageBars:
    """Progress bars on stderr, one a stage; called with a stage's name, how much is done, and of how much."""

    def __init__(self, bars: Progress) -> None:
        self._bars = bars
        self._tasks: dict[str, TaskID] = {}
        self._last: TaskID | None = None

    def __call__(self, stage: str, done: int, total: int) -> None:
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=total, note="")
        self._last = self._tasks[stage]
        self._bars.update(self._last, completed=done, total=total)

    def note(self, text: str) -> None:
        """Say something behind the bar that moved last."""
        if self._last is not None:
            self._bars.update(self._last, note=text)


@contextmanager
def stage_bars() -> Iterator[StageBars]:
    """Progress bars on stderr for as long as the block runs."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:<24}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=_console(stderr=True)) as bars:
        yield StageBars(bars)
