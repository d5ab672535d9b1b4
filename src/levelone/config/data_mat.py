"""Reader of MATLAB files: versions 5 to 7 through SciPy, 7.3 (HDF5) through h5py. Only arrays of numbers and structures of them."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from levelone.config.data_files import Column, Content
from levelone.errors import InputError

WIDEST = 64
"""Columns of a matrix that are offered by their number; a wider one is no table of channels."""
_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_mat(path: Path, content: bytes) -> Content:
    """Vectors of a MATLAB file; those in structures by their dotted path, columns of a matrix ``name.1``, ``name.2`` and on.

    Parameters
    ----------
    path, content
        The file. It states no units. Objects (timeseries, tables) cannot be read: save their ``.Time`` and ``.Data``.

    Raises
    ------
    InputError
        The file is damaged, or two arrays share a name.
    """
    hdf5 = _HDF5 in content[:8] or content[512:520] == _HDF5
    columns: dict[str, Column] = {}
    try:
        for name, values in _of_hdf5(content) if hdf5 else _of_version_5(content):
            if name in columns:
                raise InputError(str(path), f"two arrays are called {name!r}")
            columns[name] = Column(values)
    except InputError:
        raise
    except Exception as error:  # damaged files end in errors of many kinds
        raise InputError(str(path), f"is no readable MATLAB file: {str(error).strip()[:200] or type(error).__name__}") from None
    return columns, {}, ()


def _of_version_5(content: bytes) -> Iterator[tuple[str, Any]]:
    from scipy.io import loadmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of objects that are passed over
        tree = loadmat(io.BytesIO(content), simplify_cells=True)
    for name, item in tree.items():
        if not name.startswith("__"):
            yield from _vectors(name, item)


def _of_hdf5(content: bytes) -> Iterator[tuple[str, Any]]:
    import h5py

    with h5py.File(io.BytesIO(content), "r") as file:
        yield from _of_group(h5py, "", file)


def _of_group(h5py: Any, prefix: str, group: Any) -> Iterator[tuple[str, Any]]:
    """Arrays below a group. What lies in other files is passed over: nothing is read that the user has not named."""
    for key in group:
        if key.startswith("#") or not isinstance(group.get(key, getlink=True), h5py.HardLink):
            continue
        name, item = f"{prefix}{key}", group[key]
        if isinstance(item, h5py.Group):
            yield from _of_group(h5py, f"{name}.", item)
        elif isinstance(item, h5py.Dataset) and item.dtype.kind in "iufb" and not (item.is_virtual or item.external):
            yield from _vectors(name, np.asarray(item[()]).T)


def _vectors(name: str, item: Any) -> Iterator[tuple[str, Any]]:
    """Columns of one array; of a structure, those of all its fields."""
    if isinstance(item, Mapping):
        for key, part in item.items():
            yield from _vectors(f"{name}.{key}", part)
    elif isinstance(item, list) or (isinstance(item, np.ndarray) and item.dtype == object and item.ndim == 1):
        for number, part in enumerate(item, 1):
            yield from _vectors(f"{name}.{number}", part)
    elif isinstance(item, np.ndarray) and item.dtype.kind in "iufb" and item.size > 1:
        values = np.squeeze(item).astype(np.float64)
        if values.ndim == 1:
            yield name, np.ascontiguousarray(values)
        elif values.ndim == 2 and min(values.shape) <= WIDEST:
            upright = values if values.shape[0] >= values.shape[1] else values.T
            for number, column in enumerate(upright.T, 1):
                yield f"{name}.{number}", np.ascontiguousarray(column)
