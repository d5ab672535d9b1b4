"""Results of Dakota's analysed like our own, with the indices that Dakota gives beside them."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign import analysis
from levelone.campaign.dakota.hdf5 import read_hdf5
from levelone.campaign.dakota.printed import PrintedIndices, read_moat, read_sobol
from levelone.campaign.dakota.recognise import Recognised, recognise
from levelone.campaign.dakota.tabular import Imported, read_tabular
from levelone.campaign.dakota.trajectories import doubt_of_trajectories
from levelone.campaign.store import COMPRESSED, ENGINE, write_json
from levelone.errors import InputError
from levelone.status import Status
from levelone.uncertainty import Design, FactorSpace, Policy, sobol, stage_seed
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.given_data import given_data

HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
#: what of our own stands beside the two indices that Dakota prints, by layout
PRINTED = {"morris": ("mu_star", "sigma"), "sobol": ("S1", "ST"), "sample": ("S1", "ST"), "other": ("S1", "ST")}
NO_INDICES = "coordinates repeat, and the runs are no whole Morris or pick-freeze design: no indices, and no statistics of a sample"


@dataclass(frozen=True, eq=False)
class Analysed:
    """An imported file: how its points were laid out, and by response what ``results`` found, as JSON holds it."""

    imported: Imported
    recognised: Recognised
    results: dict[str, Any]


def import_results(
    path: Path, space: FactorSpace, policy: Policy, seed: int, bootstrap: int, columns: tuple[str, ...] = ()
) -> Analysed:
    """Read a file of Dakota's, recognise how its points were laid out, and analyse it.

    Trajectories give Morris indices, a decomposition gives Sobol indices, any other sample statistics and first-order indices
    from given data. Beside a tabular file, Dakota's own indices are read from its log or output file of the same name, if any.

    Parameters
    ----------
    path
        Tabular or HDF5, told apart by the first bytes.
    space
        The study's factors.
    policy
        What failed runs do to indices; under "refuse" they are NaN.
    seed, bootstrap
        Of the intervals.
    columns
        Of a tabular file without header.

    Raises
    ------
    InputError
        As the two readers; a value outside its factor's support.
    """
    if _is_hdf5(path):
        if columns:
            raise InputError("--columns", f"{path.name} is HDF5, which names its own columns: leave it out")
        found = read_hdf5(path, space)
    else:
        found = read_tabular(path, space, columns)
    if not len(found.points) and not found.printed:
        raise InputError(
            "dakota", f"{path} holds no run: an interrupted Dakota writes its table at the end; restart it with -read_restart"
        )
    design = recognise(space, found.points, found.columns, stage_seed(seed, "dakota import"))
    if not found.printed:
        found = replace(found, printed=_printed_beside(found, design, space))
    names = found.responses.names or tuple(found.printed)
    results = {name: _response(found, design, name, policy, bootstrap) for name in names}
    return Analysed(found, design, {
        "source": path.name, "layout": design.layout, "runs": len(found.points),
        "status": NO_INDICES if design.layout == "other" else "ok", "responses": results,
    })  # fmt: skip


def _is_hdf5(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(len(HDF5_SIGNATURE)) == HDF5_SIGNATURE
    except OSError as error:
        raise InputError("dakota", f"cannot read {path}: {error.strerror}") from None


def _printed_beside(found: Imported, design: Recognised, space: FactorSpace) -> dict[str, PrintedIndices]:
    """What Dakota printed, from ``NAME.log`` or else ``NAME.out``."""
    for suffix in (".log", ".out"):
        path = found.source.with_suffix(suffix)
        if path.is_file():
            text = path.read_text(encoding="utf-8", errors="replace")
            if design.layout == "morris":
                printed = read_moat(text, found.columns, found.responses.names, space.names)
            else:
                printed = read_sobol(text, space.names)
            if printed:
                return printed
    return {}


def _response(found: Imported, design: Recognised, name: str, policy: Policy, bootstrap: int) -> dict[str, Any]:
    space = design.design.space
    out: dict[str, Any] = {}
    if name in found.responses.names:
        values = found.responses.column(name)[design.order]
        failures, _ = analysis.in_words(found.responses.counts(name))
        out = {
            "unit": found.responses.units[found.responses.index(name)],
            "failed": int(np.isnan(values).sum()),
            "failures": failures,
        }
        out |= _indices(design, values, policy, bootstrap)
    if name in found.printed:
        first, second = PRINTED[design.layout]
        printed = found.printed[name]
        pairs = zip(space.names, printed.first.tolist(), printed.second.tolist(), strict=True)
        out["dakota"] = {factor: {first: a, second: b} for factor, a, b in pairs}
    return out


def _indices(found: Recognised, values: FloatArray, policy: Policy, bootstrap: int) -> dict[str, Any]:
    """Indices of one response, in the order of the recognised design."""
    design = found.design
    refused = policy == "refuse" and bool(np.isnan(values).any())
    why = f"refused: {int(np.isnan(values).sum())} runs failed and the study's policy is 'refuse'"
    if found.layout == "morris":
        effects = analysis.screen_one(design, values, policy, bootstrap)
        status = why if effects is None else doubt_of_trajectories(design) or effects.status.text
        return {"morris": analysis.morris_json(design.space, effects), "status": status}
    if found.layout == "sobol":
        return _sobol(design, values, policy, bootstrap, why if refused else "")
    if found.layout == "other":
        return {"status": NO_INDICES}
    out = {"monte_carlo": analysis.statistics(values)}
    if refused:
        return out | {"status": why}
    return out | _given_data(design, values, policy)


def _given_data(design: Design, values: FloatArray, policy: Policy) -> dict[str, Any]:
    try:
        found = given_data(design.points, values, design.names, policy=policy)
    except InputError as problem:  # an input that never varies: the statistics stand all the same
        return {"status": f"no indices: {problem}"}
    rows = zip(design.names, found.S1.tolist(), found.S1_ci.tolist(), strict=True)
    out = {"given_data": {factor: {"S1": s, "S1_ci": ci} for factor, s, ci in rows}, "status": found.status.text}
    if found.bounding is not None:
        ends = zip(("low", "high"), found.bounding, strict=True)
        out["given_data_bounded"] = {end: dict(zip(design.names, each.S1.tolist(), strict=True)) for end, each in ends}
    return out


def _sobol(design: Design, values: FloatArray, policy: Policy, bootstrap: int, refused: str) -> dict[str, Any]:
    if refused:
        nan = {"S1": np.nan, "ST": np.nan, "S1_ci": [np.nan, np.nan], "ST_ci": [np.nan, np.nan]}
        return {"sobol": {factor: dict(nan) for factor in design.names}, "status": refused, "used": 0}
    found = sobol(design, values, bootstrap=bootstrap, policy=policy)
    out = {"sobol": analysis.sobol_json(design.space, found), "status": found.doubt or found.status.text, "used": found.used}
    if found.bounding is not None:
        low, high = (analysis.sobol_json(design.space, each, intervals=False) for each in found.bounding)
        out["sobol_bounded"] = {"low": low, "high": high}
    return out


def write_import(done: Analysed, folder: Path) -> list[Path]:
    """``NAME.csv``, ``NAME.nc`` and ``NAME.json`` of an imported file, in a folder that exists; runs in the order of the file."""
    name = done.imported.source.stem
    paths = [folder / f"{name}.{suffix}" for suffix in ("json", "csv", "nc")]
    try:
        write_json(paths[0], done.results)
        if not len(done.imported.points):
            return paths[:1]
        _write_csv(paths[1], done)
        part = paths[2].with_suffix(".part")
        data = _dataset(done)
        data.to_netcdf(part, engine=ENGINE, encoding=dict.fromkeys(data.data_vars, COMPRESSED))
        os.replace(part, paths[2])
    except OSError as error:
        raise InputError("--out", f"cannot write to {folder}: {error.strerror}") from None
    return paths


def _write_csv(path: Path, done: Analysed) -> None:
    found = done.imported
    r, part = found.responses, path.with_suffix(".part")
    with part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*done.recognised.design.names, *r.names, *(f"{name}_status" for name in r.names)])
        for point, values, codes in zip(found.points.tolist(), r.values.tolist(), r.status.tolist(), strict=True):
            writer.writerow([*map(repr, point), *map(repr, values), *(Status(code).name.lower() for code in codes)])
    os.replace(part, path)


def _dataset(done: Analysed) -> xr.Dataset:
    found, space = done.imported, done.recognised.design.space
    units: Mapping[str, Any] = {"factor_unit": ("factor", [factor.unit for factor in space.factors])}
    return xr.Dataset(
        {
            "points": (("run", "factor"), found.points),
            "values": (("run", "response"), found.responses.values),
            "status": (("run", "response"), found.responses.status.astype(np.int16)),
        },
        coords={"factor": list(space.names), **units, "response": list(found.responses.names),
                "response_unit": ("response", list(found.responses.units))},
        attrs={"design": done.recognised.layout, "status_codes": "; ".join(f"{int(s)}: {s.text}" for s in Status)},
    )  # fmt: skip
