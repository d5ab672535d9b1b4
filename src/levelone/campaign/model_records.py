"""Records and frequency responses of a study's nominal case, as files of its results folder and back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign.models.readings import Result, Spectral, read, read_response
from levelone.campaign.nominal_check import NominalCheck
from levelone.campaign.store import ENGINE, history_dataset, write_groups
from levelone.config.model_table import Test
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import TimeHistory
from levelone.handling.levels import Boundaries
from levelone.handling.manoeuvres import Manoeuvre

HISTORIES, FREQUENCY = "histories.nc", "frequency.nc"


def write_records(folder: Path, check: NominalCheck) -> None:
    """``histories.nc`` and ``frequency.nc`` of the nominal case, a group for each test; neither where there is nothing to write."""
    records = {name: _record(history) for name, history in check.histories.items()}
    spectra = {name: _response(found.response) for name, found in check.results.items() if isinstance(found, Spectral)}
    for name, groups in ((HISTORIES, records), (FREQUENCY, spectra)):
        if groups:
            write_groups(folder / name, groups)
        else:
            (folder / name).unlink(missing_ok=True)  # of an earlier run of another study


def _record(history: TimeHistory) -> xr.Dataset:
    trim = {f"trim_{name}": float(values[0]) for name, values in history.trim.items()}
    about = {"input_name": history.input_name, "delay": float(history.delay[0]), "status": int(history.status[0]), **trim}
    return history_dataset(history, tuple(history.channels), about)


def _response(response: FrequencyResponse) -> xr.Dataset:
    columns = {"real": ("omega", response.value.real), "imag": ("omega", response.value.imag)}
    if response.coherence is not None:
        columns["coherence"] = ("omega", response.coherence)
    return xr.Dataset(columns, coords={"omega": response.omega})


def read_records(folder: Path) -> dict[str, TimeHistory]:
    """Records by test; empty where the folder holds none."""
    return {name: _history(data) for name, data in _groups(folder / HISTORIES).items()}


def read_responses(folder: Path) -> dict[str, FrequencyResponse]:
    """Frequency responses by test; empty where the folder holds none."""
    out = {}
    for name, data in _groups(folder / FREQUENCY).items():
        coherence = data["coherence"].values if "coherence" in data else None
        out[name] = FrequencyResponse(data["omega"].values, data["real"].values + 1j * data["imag"].values, coherence)
    return out


def _groups(path: Path) -> Mapping[str, xr.Dataset]:
    if not path.is_file():
        return {}
    found: dict[str, xr.Dataset] = {}
    with xr.open_datatree(path, engine=ENGINE) as tree:
        for name, node in tree.children.items():
            found[name] = node.to_dataset().load()
    return found


def _history(data: xr.Dataset) -> TimeHistory:
    names = [str(name) for name in data.data_vars]
    return TimeHistory(
        time=data["time"].values,
        channels={name: data[name].values for name in names},
        units={name: str(data[name].attrs["unit"]) for name in names},
        trim={name: np.array([float(data.attrs[f"trim_{name}"])]) for name in names},
        input_name=str(data.attrs["input_name"]),
        input_on=float(data.attrs["input_on"]),
        input_off=float(data.attrs["input_off"]),
        delay=np.array([float(data.attrs["delay"])]),
        wind=(0.0, 0.0, 0.0),
        status=np.array([int(data.attrs["status"])], dtype=np.int64),
    )


def results_of(
    tests: tuple[Test, ...], records: Mapping[str, TimeHistory], responses: Mapping[str, FrequencyResponse], boundaries: Boundaries
) -> dict[str, Result]:
    """What each test reads, from its record or response; those that have none are left out."""
    found: dict[str, Result] = {}
    for test in tests:
        if test.name in responses:
            found[test.name] = read_response(test, responses[test.name], boundaries)
        elif test.name in records and test.criterion != "bandwidth":
            found[test.name] = read(test, records[test.name], boundaries)
    return found


def programme_test(content: Mapping[str, Any]) -> Test:
    """A test from results.json."""
    given = {field.name: _value(content[field.name]) for field in fields(Test) if field.name != "manoeuvre"}
    flown = content["manoeuvre"]
    words = {name: flown[name] for name in ("name", "flight_mode", "axis", "shape")}
    numbers = {field.name: _value(flown[field.name]) for field in fields(Manoeuvre) if field.name not in words}
    return Test(**given, manoeuvre=Manoeuvre(**words, **numbers))


def _value(value: Any) -> Any:
    """The inverse of :func:`levelone.campaign.models.keys.plain` for what a test holds."""
    if value == "none":
        return None
    if value in ("inf", "-inf", "nan"):
        return math.inf if value == "inf" else -math.inf if value == "-inf" else math.nan
    return tuple(_value(each) for each in value) if isinstance(value, list) else value
