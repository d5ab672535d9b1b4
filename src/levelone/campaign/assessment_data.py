"""From files of recorded data to records on one clock, with what was done to them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from levelone.campaign.assessment import Recorded
from levelone.config.column_mapping import CHANNELS, Source, by_name
from levelone.config.data_files import DataFile, read_data
from levelone.config.data_table import LARGEST_GAP, Table, tabulate
from levelone.errors import InputError

SAME_INTERVAL = 1e-6
"""Difference of two sampling intervals, as a fraction, above which all records are resampled to the longest."""


@dataclass(frozen=True, eq=False)
class Loaded:
    """A file as it was used: the file, its channels with where they come from, and the record that they are."""

    file: DataFile
    table: Table
    record: Recorded

    @property
    def assumed_units(self) -> list[str]:
        """Channels (and ``time``) whose unit neither the file nor the mapping states, so that SI was taken."""
        return [name for name, unit in self.table.units.items() if not unit and CHANNELS[name] != "1"]


def load_records(
    paths: Sequence[Path],
    mapping: Mapping[str, Source] | None,
    *,
    start: float = -math.inf,
    end: float = math.inf,
    largest_gap: float = LARGEST_GAP,
) -> list[Loaded]:
    """Read files of one kind and bring them to one sampling interval.

    Parameters
    ----------
    paths
        Files.
    mapping
        Where the channels come from; None where the columns bear their names.
    start, end
        s: window of each file's own clock.
    largest_gap
        Intervals without a sample over which is interpolated.

    Raises
    ------
    InputError
        Whatever keeps a file from being read, or a file given twice.
    """
    files = [read_data(path) for path in paths]
    hashes = [file.sha256 for file in files]
    for k, file in enumerate(files):
        if hashes.index(file.sha256) < k:
            raise InputError(
                str(file.path), f"has the same content as {files[hashes.index(file.sha256)].path}: give each record once"
            )
    mappings = [mapping if mapping is not None else _named(file) for file in files]
    options = {"start": start, "end": end, "largest_gap": largest_gap}
    tables = [tabulate(file, sources, **options) for file, sources in zip(files, mappings, strict=True)]
    longest = max(table.dt for table in tables)
    if any(abs(table.dt / longest - 1.0) > SAME_INTERVAL for table in tables):
        tables = [tabulate(file, sources, dt=longest, **options) for file, sources in zip(files, mappings, strict=True)]
    names = _names(files)
    return [
        Loaded(file, table, Recorded(name, table.time, table.channels))
        for file, table, name in zip(files, tables, names, strict=True)
    ]


def _named(file: DataFile) -> dict[str, Source]:
    found = by_name(file)
    if not set(found) - {"time"}:
        listed = ", ".join(list(file.columns)[:12]) + (", ..." if len(file.columns) > 12 else "")
        raise InputError(
            "--columns", f"{file.path.name} has no column called like a channel ({listed}); map them: theta=COLUMN[deg]"
        )
    return found


def _names(files: Sequence[DataFile]) -> list[str]:
    """What records are called: their files without the ending, with the ending or the folder where that is not enough."""
    for made in ((lambda path: path.stem), (lambda path: path.name), str):
        names = [made(file.path) for file in files]
        if len(set(names)) == len(names):
            return names
    return names
