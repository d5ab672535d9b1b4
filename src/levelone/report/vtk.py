"""Surfaces, wakes and particles as files for ParaView.

XML PolyData (``.vtp``), ASCII: one file holds quadrilaterals or points, with values or vectors for each. Format: VTK User's
Guide, chapter "VTK File Formats", section "XML File Formats". ASCII files can be read by eye, are the same on every machine, and
nothing in them is run when they are opened.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from xml.etree.ElementTree import Element, ElementTree, SubElement, indent

import numpy as np
from numpy.typing import NDArray

from levelone.errors import InputError

FloatArray = NDArray[np.float64]
Values = Mapping[str, FloatArray]
#: digits of the numbers in a file: more than an aerodynamic result carries
DIGITS = 10
_VERTICES, _POLYGONS = "Verts", "Polys"
_COUNTS = {_VERTICES: "NumberOfVerts", _POLYGONS: "NumberOfPolys"}


def write_quads(path: str | PathLike[str], quads: FloatArray, values: Values) -> Path:
    """Write quadrilaterals and return the file's path.

    Parameters
    ----------
    path
        File, ending in ``.vtp``.
    quads
        Corners [n, 4, 3] in order around each, m. Corners that coincide are written once for each quadrilateral.
    values
        By name, one value [n] or vector [n, 3] for each quadrilateral.

    Raises
    ------
    InputError
        Another ending, shapes that do not fit together, values that are not finite (the file could not say why they are undefined),
        or a place that cannot be written to.
    """
    corners = _finite("quads", quads)
    if corners.shape[1:] != (4, 3):
        raise InputError("quads", f"have the shape {corners.shape}; needed: [n, 4, 3]")
    offsets = 4 * np.arange(1, len(corners) + 1)
    return _write(path, _document(corners.reshape(-1, 3), _POLYGONS, offsets, "CellData", values))


def write_points(path: str | PathLike[str], points: FloatArray, values: Values) -> Path:
    """Write points [n, 3] (m), such as particles, with one value [n] or vector [n, 3] for each; as :func:`write_quads`."""
    position = _finite("points", points)
    if position.shape[1:] != (3,):
        raise InputError("points", f"have the shape {position.shape}; needed: [n, 3]")
    return _write(path, _document(position, _VERTICES, np.arange(1, len(position) + 1), "PointData", values))


def _document(points: FloatArray, kind: str, offsets: NDArray[np.int64], place: str, values: Values) -> Element:
    """A file of one piece: its cells take the points in turn."""
    root = Element("VTKFile", type="PolyData", version="1.0", byte_order="LittleEndian")
    cells = str(len(offsets))
    piece = SubElement(SubElement(root, "PolyData"), "Piece", {"NumberOfPoints": str(len(points)), _COUNTS[kind]: cells})
    data = SubElement(piece, place)
    for name, array in values.items():
        _array(data, name, _fitting(name, array, len(offsets)))
    _array(SubElement(piece, "Points"), "Points", points)
    topology = SubElement(piece, kind)
    _array(topology, "connectivity", np.arange(len(points)))
    _array(topology, "offsets", offsets)
    return root


def _array(parent: Element, name: str, array: NDArray[np.float64] | NDArray[np.int64]) -> None:
    """One row of the array in each line."""
    whole = np.issubdtype(array.dtype, np.integer)
    of_each = array.shape[1] if array.ndim == 2 else 1
    element = SubElement(
        parent, "DataArray", type="Int64" if whole else "Float64", Name=name, NumberOfComponents=str(of_each), format="ascii"
    )
    form = "d" if whole else f".{DIGITS}g"
    rows = (" ".join(format(value, form) for value in row) for row in array.reshape(-1, of_each).tolist())
    element.text = "\n" + "\n".join(rows) + "\n"


def _fitting(name: str, array: FloatArray, count: int) -> FloatArray:
    values = _finite(name, array)
    if values.shape not in ((count,), (count, 3)):
        raise InputError(name, f"has the shape {values.shape}; needed: [{count}] or [{count}, 3]")
    return values


def _finite(name: str, array: FloatArray) -> FloatArray:
    values = np.asarray(array, dtype=np.float64)
    bad = int(np.count_nonzero(~np.isfinite(values)))
    if bad:
        raise InputError(name, f"{bad} of {values.size} values are not finite; a file for ParaView holds finite values only")
    return values


def _write(path: str | PathLike[str], root: Element) -> Path:
    target = Path(path)
    if target.suffix != ".vtp":
        raise InputError(str(target), "must end in .vtp, by which ParaView knows the format")
    indent(root, space=" ")
    try:
        ElementTree(root).write(target, encoding="utf-8", xml_declaration=True)
    except OSError as error:
        raise InputError(str(target), f"cannot be written: {error.strerror}") from error
    return target
