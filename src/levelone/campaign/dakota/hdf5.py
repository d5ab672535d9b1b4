"""Dakota's HDF5 results: evaluations of the study's model, and the Sobol indices that Dakota computed, to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from levelone.campaign.dakota.printed import PrintedIndices
from levelone.campaign.dakota.tabular import Imported, imported
from levelone.campaign.models.builtin import RESPONSES
from levelone.errors import InputError, unknown_name
from levelone.uncertainty import FactorSpace
from levelone.uncertainty.distributions import FloatArray

KINDS = ("continuous", "discrete_integer", "discrete_real")


def read_hdf5(path: Path, space: FactorSpace) -> Imported:
    """Read an HDF5 file of results, output version 2.

    Evaluations are those that went through an interface; what a surrogate predicted is no run of the model and is left aside, so
    that a file of a decomposition on a surrogate gives no runs, and Dakota's indices alone.

    Raises
    ------
    InputError
        No HDF5 file of Dakota's, evaluations of several interfaces, an unknown or missing name.
    """
    try:
        with h5py.File(path, "r") as file:
            groups = _evaluations(path, file)
            printed = _indices(path, file, space)
            if groups:
                names, table = _table(groups[0])
                return imported(path, space, names, table, printed)
    except OSError as error:
        raise InputError("dakota", f"cannot read {path} as HDF5: {error}; after an interrupted run, restart it") from None
    if not printed:
        raise InputError("dakota", f"{path} holds neither evaluations of an interface nor indices of a decomposition")
    return imported(path, space, list(space.names), np.empty((0, len(space))), printed)


def _evaluations(path: Path, file: h5py.File) -> list[Any]:
    """Groups of the evaluations that came from an interface, not from a surrogate."""
    groups = [model for interface in file.get("interfaces", {}).values() for model in interface.values() if "responses" in model]
    if len(groups) > 1:
        raise InputError("dakota", f"{path} holds evaluations of {', '.join(g.name for g in groups)}; one interface is needed")
    return groups


def _labels(dataset: Any, axis: int, scale: str) -> list[str]:
    return [each.decode() if isinstance(each, bytes) else str(each) for each in dataset.dims[axis][scale][()]]


def _table(group: Any) -> tuple[list[str], FloatArray]:
    """Names of the columns and [runs, columns], variables before responses."""
    names: list[str] = []
    columns = []
    for kind in KINDS:
        if kind in group["variables"]:
            data = group["variables"][kind]
            names += _labels(data, 1, "variables")
            columns.append(np.asarray(data, dtype=np.float64))
    data = group["responses"]["functions"]
    names += _labels(data, 1, "responses")
    return names, np.hstack([*columns, np.asarray(data, dtype=np.float64)])


def _indices(path: Path, file: h5py.File, space: FactorSpace) -> dict[str, PrintedIndices]:
    """Main and total effects by response, of the last execution that has them."""
    found: dict[str, PrintedIndices] = {}
    for method in file.get("methods", {}).values():
        for execution in method.get("results", {}).values():
            for response, main in execution.get("main_effects", {}).items():
                if response not in RESPONSES:
                    raise unknown_name(path.name, response, RESPONSES)
                total = execution["total_effects"][response]
                S1 = dict(zip(_labels(main, 0, "variables"), main[()].tolist(), strict=True))
                ST = dict(zip(_labels(total, 0, "variables"), total[()].tolist(), strict=True))
                first, second = (np.array([each.get(name, np.nan) for name in space.names]) for each in (S1, ST))
                found[response] = PrintedIndices(space.names, first, second)
    return found
