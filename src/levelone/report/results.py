"""The folder of a finished study, read back and checked."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import xarray as xr

from levelone.errors import InputError, unknown_name

SCHEMA = 1
CRITERIA = ("attitude_quickness", "dynamic_stability", "bandwidth")
"""Criteria in the order of the report; also the groups of ``histories.nc``."""

_SECTIONS = (
    "study", "responses", "levels", "nominal", "numerics", "sweep", "validity", "assumed", "not_validated",
    "validity_domain", "provenance",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Results:
    """What one study left in its folder: SI and rad, undefined values NaN.

    Parameters
    ----------
    directory
        The folder.
    summary
        ``results.json``.
    monte_carlo
        ``monte_carlo.nc``: ``values[run, response]`` with its coordinates.
    histories
        Criterion to its group of ``histories.nc``; run 0 is the nominal vehicle.
    linear, swept
        Groups of ``frequency.nc``.
    """

    directory: Path
    summary: Mapping[str, Any]
    monte_carlo: xr.Dataset
    histories: Mapping[str, xr.Dataset]
    linear: xr.Dataset
    swept: xr.Dataset

    @property
    def responses(self) -> Mapping[str, Any]:
        """Responses of the study by name."""
        return self.summary["responses"]

    def of(self, criterion: str) -> dict[str, Any]:
        """Responses that one criterion gives, in the order of the file."""
        return {name: entry for name, entry in self.responses.items() if entry["criterion"] == criterion}

    def sample(self, response: str) -> Any:
        """Monte Carlo values of one response, ``[run]``."""
        names = self.monte_carlo["response"].values.tolist()
        if response not in names:
            raise unknown_name(str(self.directory / "monte_carlo.nc"), response, names)
        return self.monte_carlo["values"].values[:, names.index(response)]


def load_results(directory: str | PathLike[str]) -> Results:
    """Read the folder of a finished study.

    Raises
    ------
    InputError
        The folder holds no results, is incomplete, or was written under another schema.
    """
    folder = Path(directory)
    summary = read_summary(folder, _SECTIONS)
    groups = {name: read_group(folder / "histories.nc", name) for name in CRITERIA}
    return Results(
        directory=folder,
        summary=summary,
        monte_carlo=read_group(folder / "monte_carlo.nc"),
        histories=groups,
        linear=read_group(folder / "frequency.nc", "linear"),
        swept=read_group(folder / "frequency.nc", "swept"),
    )


def attribute(data: xr.Dataset, name: str) -> float:
    """A number among the attributes of a dataset; NaN stays NaN, absence is an error."""
    if name not in data.attrs:
        raise InputError(f"{data.encoding.get('source', 'dataset')}: attribute {name}", "missing; run the study again")
    return float(data.attrs[name])


def read_summary(folder: Path, sections: Sequence[str]) -> dict[str, Any]:
    """``results.json`` of a folder, which must have the sections.

    Raises
    ------
    InputError
        The folder holds no results, is incomplete, or was written under another schema.
    """
    path = folder / "results.json"
    if not folder.is_dir():
        raise InputError(str(folder), "is not a folder; give the one that a finished study wrote (it holds results.json)")
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(str(folder), "holds no results.json: not the folder of a finished study") from None
    except OSError as error:
        raise InputError(str(path), f"cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(str(path), f"is not a JSON file: {error}") from error
    schema = summary.get("schema") if isinstance(summary, dict) else None
    if schema != SCHEMA:
        raise InputError(f"{path}: schema", f"is {schema!r}; this version reads {SCHEMA}: run the study again or use its levelone")
    for section in sections:
        if section not in summary:
            raise InputError(f"{path}: {section}", "missing; run the study again")
    return summary


def read_group(path: Path, group: str | None = None) -> xr.Dataset:
    """One group of a NetCDF file, or the whole file.

    Raises
    ------
    InputError
        The file or the group is missing, or cannot be read.
    """
    what = str(path) if group is None else f"{path}: group {group}"
    try:
        with xr.open_dataset(path, group=group, engine="h5netcdf") as data:
            return data.load()
    except (OSError, ValueError, KeyError) as error:
        if not path.is_file():
            raise InputError(str(path), "missing; run the study again") from None
        raise InputError(what, f"cannot be read: {error}") from error
