"""What a finished study leaves in its folder: results.json, NetCDF and CSV samples, time histories, frequency responses."""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign.models.builtin import Assessment
from levelone.errors import InputError
from levelone.handling.history import TimeHistory
from levelone.status import Status
from levelone.uncertainty import Design

ENGINE: Any = "h5netcdf"
COMPRESSED = {"zlib": True, "complevel": 4}


def prepare_folder(out: Path) -> Path:
    """Create the results folder, or say why it cannot be.

    Raises
    ------
    InputError
        The path is a file, or the folder cannot be created or written.
    """
    if out.exists() and not out.is_dir():
        raise InputError("--out", f"{out} is a file, a folder is needed")
    try:
        (out / "figures").mkdir(parents=True, exist_ok=True)
        probe = out / ".writable"
        probe.touch()
        probe.unlink()
    except (FileExistsError, NotADirectoryError):
        raise InputError("--out", f"{out} lies below a file, a folder is needed") from None
    except OSError as error:
        raise InputError("--out", f"{out} cannot be created or written: {error.strerror}") from None
    return out


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write JSON in one move, so that no half-written file is ever seen; undefined numbers are NaN."""
    text = json.dumps(_plain(content), indent=1, allow_nan=True)
    part = path.with_suffix(".part")
    part.write_text(text + "\n", encoding="utf-8")
    os.replace(part, path)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(v) for v in value]
    if isinstance(value, np.generic):
        return value.item()
    if value is None:
        raise TypeError("results hold NaN with a status, never null")
    if isinstance(value, float) and math.isinf(value):
        return math.nan
    return value


def sample_dataset(design: Design, assessed: Assessment) -> xr.Dataset:
    """Points, responses, statuses and Levels of a sample, labelled."""
    r = assessed.responses
    units = [factor.unit for factor in design.space.factors]
    levels = np.array([*assessed.levels.values()], dtype=np.int16).reshape(len(assessed.levels), len(r)).T
    beyond = {} if assessed.extrapolated is None else {"extrapolated_level": (("run",), assessed.extrapolated.astype(np.int16))}
    return xr.Dataset(
        {
            "points": (("run", "factor"), design.points),
            "values": (("run", "response"), r.values),
            "status": (("run", "response"), r.status.astype(np.int16)),
            "level": (("run", "criterion"), levels),
            **beyond,
        },
        coords={
            "factor": list(design.names),
            "factor_unit": ("factor", units),
            "response": list(r.names),
            "response_unit": ("response", list(r.units)),
            "criterion": list(assessed.levels),
        },
        attrs={"design": str(design.kind), "status_codes": "; ".join(f"{int(s)}: {s.text}" for s in Status)},
    )


def write_sample(folder: Path, name: str, design: Design, assessed: Assessment) -> None:
    """``name``.nc and ``name``.csv of one sample."""
    data = sample_dataset(design, assessed)
    data.to_netcdf(folder / f"{name}.nc", engine=ENGINE, encoding=dict.fromkeys(data.data_vars, COMPRESSED))
    r = assessed.responses
    header = [*design.names, *r.names, *(f"{n}_status" for n in r.names), *(f"level_{c}" for c in assessed.levels)]
    with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        for i in range(len(r)):
            levels = [int(codes[i]) for codes in assessed.levels.values()]
            texts = [Status(int(code)).name.lower() for code in r.status[i]]
            writer.writerow([*map(repr, design.points[i].tolist()), *map(repr, r.values[i].tolist()), *texts, *levels])


def history_dataset(history: TimeHistory, names: tuple[str, ...], attrs: Mapping[str, Any]) -> xr.Dataset:
    """Channels [run, time] of a record, with what was picked on its first run."""
    data = {name: (("run", "time"), history.channels[name]) for name in names}
    out = xr.Dataset(
        data, coords={"time": history.time}, attrs={"input_on": history.input_on, "input_off": history.input_off} | dict(attrs)
    )
    for name in names:
        out[name].attrs["unit"] = history.units[name]
    return out


def write_dataset(path: Path, data: xr.Dataset) -> None:
    """A dataset as one NetCDF file, in one move: no half-written file is ever seen."""
    part = path.with_suffix(".part")
    data.to_netcdf(part, engine=ENGINE, encoding=dict.fromkeys(data.data_vars, COMPRESSED))
    os.replace(part, path)


def write_groups(path: Path, groups: Mapping[str, xr.Dataset]) -> None:
    """Several datasets as groups of one NetCDF file."""
    part = path.with_suffix(".part")
    for i, (name, data) in enumerate(groups.items()):
        data.to_netcdf(
            part, mode="w" if i == 0 else "a", group=name, engine=ENGINE, encoding=dict.fromkeys(data.data_vars, COMPRESSED)
        )
    os.replace(part, path)
