"""Evaluations of a campaign for other programs: CSV, Parquet and NetCDF, one row an evaluation."""

from __future__ import annotations

import csv
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from levelone.campaign.store_reader import Stored, StoredModel, read_stored, status_text, stored_models
from levelone.campaign.store_schema import open_to_read
from levelone.errors import InputError, closest
from levelone.status import Status

#: codes of :class:`levelone.handling.levels.Level` in words; that module would load the compiler of the criteria
_LEVELS = {-1: "undefined", 0: "outside the requirement", 1: "Level 1", 2: "Level 2", 3: "Level 3"}
ENGINE: Any = "h5netcdf"


@dataclass(frozen=True)
class Column:
    """One column of an export: its name, unit and n values."""

    name: str
    unit: str
    values: Sequence[Any]


def export(store: Path, target: Path, *, model: str = "", force: bool = False) -> Stored:
    """Write the evaluations of one model as a file of the kind that its ending says, in one move.

    Parameters
    ----------
    store
        The file of the campaign; it may be written to by another process meanwhile.
    target
        The new file: ``.csv``, ``.parquet`` or ``.nc``.
    model
        Beginning of the hash of the model, where the store has several; that evaluated last where empty.
    force
        Write over a file that is there.

    Returns
    -------
    Stored
        What was written.

    Raises
    ------
    InputError
        The target is there already, has another ending or cannot be written; the store cannot be read; no such model; Parquet
        without its library.
    """
    write = _writer(target)
    if target.is_dir():
        raise InputError("FILE", f"{target} is a folder, the name of a file is needed")
    if target.exists() and not force:
        raise InputError("FILE", f"{target} is there already: choose another name, or write over it with --force")
    with closing(open_to_read(store)) as connection:
        stored = read_stored(connection, store, chosen(stored_models(connection, store), store, model))
    try:
        _in_one_move(target, lambda part: write(part, stored))
    except OSError as error:
        raise InputError("FILE", f"{target} cannot be written: {error.strerror or error}") from None
    return stored


def chosen(models: Sequence[StoredModel], store: Path, prefix: str) -> StoredModel:
    """The model whose hash begins so; the first, evaluated last, where nothing is said.

    Raises
    ------
    InputError
        None or several do, or the store has no evaluations.
    """
    if not models:
        raise InputError(str(store), "holds no evaluations yet")
    found = [each for each in models if each.hash.startswith(prefix)]
    if prefix and len(found) != 1:
        names = [each.hash[:12] for each in models]
        raise InputError("--model", f"{prefix!r} begins {len(found) or 'no'} of the models' hashes; {closest(prefix, names)}")
    return found[0]


def columns(stored: Stored) -> list[Column]:
    """Factors, responses, their statuses in words, Levels in words, and how each evaluation went."""
    model, e = stored.model, stored.evaluations
    text = {int(code): status_text(int(code)) for code in np.unique(e.status)}
    rows = [Column(name, "", x) for name, x in zip(model.factors, stored.points.T.tolist(), strict=True)]
    rows += [Column(*each) for each in zip(model.names, model.units, e.values.T.tolist(), strict=True)]
    rows += [
        Column(f"{name}_status", "", [text[code] for code in codes])
        for name, codes in zip(model.names, e.status.T.tolist(), strict=True)
    ]
    rows += [
        Column(f"level_{name}", "", [_LEVELS.get(code, str(code)) for code in codes])
        for name, codes in zip(model.judged, e.levels.T.tolist(), strict=True)
    ]
    return _apart([
        *rows,
        Column("seconds", "s", e.seconds.tolist()),
        Column("attempts", "", stored.attempts.tolist()),
        Column("finished", "", [instant(each) for each in stored.finished.tolist()]),
        Column("study", "", stored.studies),
        Column("message", "", e.messages),
    ])  # fmt: skip


def write_csv(path: Path, stored: Stored) -> None:
    """CSV: numbers to the last bit, NaN where undefined."""
    table = columns(stored)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([column.name for column in table])
        writer.writerows(zip(*(column.values for column in table), strict=True))


def write_parquet(path: Path, stored: Stored) -> None:
    """Parquet, the unit of each response in the metadata of its column; NaN and not null where undefined."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise InputError("FILE", "Parquet needs the library pyarrow: pip install levelone[records]") from None
    table = columns(stored)
    fields = []
    for column in table:
        kind = pyarrow.array(column.values[:1]).type
        fields.append(pyarrow.field(column.name, kind, metadata={"unit": column.unit} if column.unit else None))
    arrays = [pyarrow.array(column.values, type=each.type) for column, each in zip(table, fields, strict=True)]
    schema = pyarrow.schema(fields, metadata={"model": stored.model.hash})
    pyarrow.parquet.write_table(pyarrow.Table.from_arrays(arrays, schema=schema), path)


def write_netcdf(path: Path, stored: Stored) -> None:
    """NetCDF as the samples of a study have it: arrays [run, factor], [run, response] and [run, criterion]."""
    import xarray as xr

    model, e = stored.model, stored.evaluations
    numbers: Mapping[str, Any] = {
        "points": (("run", "factor"), stored.points),
        "values": (("run", "response"), e.values),
        "status": (("run", "response"), e.status.astype(np.int16)),
        "level": (("run", "criterion"), e.levels.astype(np.int16)),
        "seconds": (("run",), e.seconds, {"units": "s"}),
        "attempts": (("run",), stored.attempts),
    }
    texts: Mapping[str, Any] = {
        "finished": (("run",), np.array([instant(each) for each in stored.finished], dtype=object)),
        "study": (("run",), np.array(stored.studies, dtype=object)),
        "message": (("run",), np.array(e.messages, dtype=object)),
    }
    data = xr.Dataset(
        {**numbers, **texts},
        coords={
            "factor": list(model.factors), "response": list(model.names), "response_unit": ("response", list(model.units)),
            "criterion": list(model.judged),
        },
        attrs={"model": model.hash, "status_codes": "; ".join(f"{int(s)}: {s.text}" for s in Status)},
    )  # fmt: skip
    data.to_netcdf(path, engine=ENGINE, encoding={name: {"zlib": True, "complevel": 4} for name in numbers})


_WRITERS: dict[str, Callable[[Path, Stored], None]] = {".csv": write_csv, ".parquet": write_parquet, ".nc": write_netcdf}


def _writer(target: Path) -> Callable[[Path, Stored], None]:
    suffix = target.suffix.lower()
    if suffix not in _WRITERS:
        raise InputError("FILE", f"the ending of {target.name} names no format; {closest(suffix, _WRITERS)}")
    return _WRITERS[suffix]


def _in_one_move(target: Path, write: Callable[[Path], None]) -> None:
    """Write to a file of another name that nobody has, and rename it when it is whole."""
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
    os.close(handle)
    part = Path(name)
    try:
        write(part)
        part.chmod(0o644)
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)


def instant(seconds: float) -> str:
    """Seconds since 1970 as date and time in UTC, ISO 8601."""
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")


def _apart(table: Iterable[Column]) -> list[Column]:
    """Columns whose names differ: a later one of the same name gets underscores."""
    out: list[Column] = []
    taken: set[str] = set()
    for column in table:
        name = column.name
        while name in taken:
            name += "_"
        taken.add(name)
        out.append(Column(name, column.unit, column.values))
    return out
