"""Files for ParaView: read back by an XML parser they hold what was written; what they cannot hold is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import parse

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from levelone.errors import InputError
from levelone.report.vtk import write_points, write_quads

QUADS = np.arange(24.0).reshape(2, 4, 3) / 7.0
POINTS = np.arange(9.0).reshape(3, 3) / 3.0


def read(path: Path) -> dict[str, Any]:
    """Counts of the piece, and by section and name its arrays."""
    root = parse(path).getroot()
    assert (root.tag, root.attrib["type"]) == ("VTKFile", "PolyData")
    (piece,) = root.findall("PolyData/Piece")
    found: dict[str, Any] = {name: int(count) for name, count in piece.attrib.items()}
    for section in piece:
        for array in section:
            assert array.attrib["format"] == "ascii"
            kind = {"Float64": float, "Int64": int}[array.attrib["type"]]
            values = np.array((array.text or "").split(), dtype=kind)
            width = int(array.attrib["NumberOfComponents"])
            found[f"{section.tag}/{array.attrib['Name']}"] = values.reshape(-1, width) if width > 1 else values
    return found


def test_quadrilaterals_come_back(tmp_path):
    circulation, force = np.array([1.5, -2.0e-7]), np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    found = read(write_quads(tmp_path / "wing.vtp", QUADS, {"circulation": circulation, "force": force}))
    assert (found["NumberOfPoints"], found["NumberOfPolys"]) == (8, 2)
    corners = found["Points/Points"][found["Polys/connectivity"]]
    shapes = np.split(corners, found["Polys/offsets"])[:-1]
    np.testing.assert_allclose(shapes, QUADS, rtol=1e-9)
    np.testing.assert_allclose(found["CellData/circulation"], circulation, rtol=1e-9)
    np.testing.assert_allclose(found["CellData/force"], force, rtol=1e-9)


def test_points_come_back(tmp_path):
    found = read(write_points(tmp_path / "particles.vtp", POINTS, {"core": np.array([0.1, 0.2, 0.3])}))
    assert (found["NumberOfPoints"], found["NumberOfVerts"]) == (3, 3)
    np.testing.assert_allclose(found["Points/Points"], POINTS, rtol=1e-9)
    np.testing.assert_array_equal(found["Verts/offsets"], [1, 2, 3])
    np.testing.assert_array_equal(found["Verts/connectivity"], [0, 1, 2])
    np.testing.assert_array_equal(found["PointData/core"], [0.1, 0.2, 0.3])


@given(values=arrays(np.float64, 2, elements=st.floats(-1e300, 1e300)))
def test_every_finite_value_is_kept_to_ten_digits(tmp_path_factory, values):
    path = tmp_path_factory.getbasetemp() / "any.vtp"
    np.testing.assert_allclose(read(write_quads(path, QUADS, {"v": values}))["CellData/v"], values, rtol=1e-9, atol=1e-320)


def test_an_empty_wake_is_a_file_without_cells(tmp_path):
    found = read(write_points(tmp_path / "none.vtp", np.empty((0, 3)), {"strength": np.empty((0, 3))}))
    assert (found["NumberOfPoints"], found["NumberOfVerts"]) == (0, 0)


def test_names_are_data_and_never_markup(tmp_path):
    name = '"/><evil a="&'
    found = read(write_quads(tmp_path / "name.vtp", QUADS, {name: np.zeros(2)}))
    np.testing.assert_array_equal(found[f"CellData/{name}"], [0.0, 0.0])


def test_the_same_arrays_give_the_same_bytes(tmp_path):
    files = [write_quads(tmp_path / f"{name}.vtp", QUADS, {"v": np.array([1.0, 1.0 / 3.0])}).read_bytes() for name in "ab"]
    assert files[0] == files[1]


@pytest.mark.parametrize(
    ("quads", "values", "problem"),
    [
        (QUADS[:, :3], {}, r"quads: have the shape \(2, 3, 3\)"),
        (QUADS, {"v": np.zeros(3)}, r"v: has the shape \(3,\); needed: \[2\]"),
        (QUADS, {"v": np.array([1.0, np.nan])}, "v: 1 of 2 values are not finite"),
        (np.full((2, 4, 3), np.inf), {}, "quads: 24 of 24 values are not finite"),
    ],
)
def test_what_a_file_cannot_hold_is_refused(tmp_path, quads, values, problem):
    with pytest.raises(InputError, match=problem):
        write_quads(tmp_path / "wing.vtp", quads, values)
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_points(tmp_path / "missing" / "particles.vtp", POINTS, {})
    with pytest.raises(InputError, match=r"must end in \.vtp"):
        write_points(tmp_path / "particles.txt", POINTS, {})
