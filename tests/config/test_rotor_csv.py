from __future__ import annotations

import numpy as np
import pytest

from levelone.config.rotor_csv import COLUMNS, read_rotor_table
from levelone.errors import InputError

THROTTLE, AIRSPEED, ANGLE = np.linspace(0, 1, 6), np.arange(0.0, 20.0, 4.0), np.linspace(-90, 90, 7)


def rows() -> list[list[float]]:
    """A made-up table whose values say where they belong."""
    return [
        [t, v, a, 1e4 * t, 10 * t**2 + v * np.sin(np.radians(a)) if v else 10 * t**2, 0.1 * t]
        for t in THROTTLE
        for v in AIRSPEED
        for a in ANGLE
    ]


@pytest.fixture
def write(tmp_path):
    def _write(body, columns=COLUMNS, header=("# made up", "#   for a test")):
        path = tmp_path / "rotor.csv"
        lines = [*header, ",".join(columns), *(",".join(map(repr, map(float, row))) for row in body)]
        path.write_text("\n".join(lines) + "\n")
        return path

    return _write


def test_values_reach_their_nodes_in_si_and_rad(write):
    table = read_rotor_table(write(rows()))
    np.testing.assert_array_equal(table.throttle, THROTTLE)
    np.testing.assert_array_equal(table.airspeed, AIRSPEED)
    np.testing.assert_allclose(table.angle, np.radians(ANGLE), rtol=1e-15)
    np.testing.assert_array_equal(table.values[4, 3, 5], rows()[(4 * len(AIRSPEED) + 3) * len(ANGLE) + 5][3:])
    assert table.source == "made up\nfor a test"


def test_rows_and_columns_come_in_any_order(write):
    shuffled = np.array(rows())[np.random.default_rng(3).permutation(len(rows()))]
    order = [5, 0, 3, 2, 4, 1]
    other = read_rotor_table(write(shuffled[:, order], [COLUMNS[j] for j in order]))
    np.testing.assert_array_equal(other.values, read_rotor_table(write(rows())).values)


def changed(row: int, column: int, value: float) -> list[list[float]]:
    body = rows()
    body[row][column] = value
    return body


FAULTS = [
    (
        rows()[:-1],
        COLUMNS,
        "is no full grid: 209 of 6 x 5 x 7 = 210 nodes; the first missing is throttle = 1, airspeed = 16, angle_deg = 90",
    ),
    ([*rows(), rows()[0]], COLUMNS, "the node throttle = 0, airspeed = 0, angle_deg = -90 is given 2 times"),
    (changed(11, 4, np.nan), COLUMNS, "line 15 holds a value that is not a finite number"),
    (changed(11, 4, np.inf), COLUMNS, "line 15 holds a value that is not a finite number"),
    (rows(), (*COLUMNS[:5], "torqe"), "column 'torque' missing; the columns are throttle"),
    (rows(), (*COLUMNS[:5], "rpm"), "column 'rpm' given twice"),
    ([[*row, 0.0] for row in rows()], (*COLUMNS, "powr"), "unknown column 'powr'"),
    (rows(), COLUMNS[:5], "column 'torque' missing"),
    ([[*row, 0.0] for row in rows()], COLUMNS, "line 4 has 7 cells, the header 6"),
    ([row for row in rows() if row[0] != THROTTLE[2]], COLUMNS, "rotor table, throttle: nodes must increase in equal steps"),
    ([[row[0] * 100, *row[1:]] for row in rows()], COLUMNS, "must run from 0 to 1, got 0 to 100"),
    ([[*row[:2], row[2] / 2, *row[3:]] for row in rows()], COLUMNS, "rotor table, angle: must run from"),
    (changed(1, 4, 3.0), COLUMNS, "at zero airspeed the flow has no angle"),
    ([], COLUMNS, "rotor table, throttle: needs at least five nodes, got 0"),
]


@pytest.mark.parametrize(("body", "columns", "problem"), FAULTS)
def test_a_bad_table_is_refused_on_one_line(write, body, columns, problem):
    with pytest.raises(InputError) as caught:
        read_rotor_table(write(body, columns))
    text = str(caught.value)
    assert text.startswith("rotors.table.file: rotor.csv: ")
    assert problem in text
    assert "\n" not in text


def test_text_in_place_of_a_number_is_refused_with_its_line(write):
    path = write(rows())
    path.write_text(path.read_text().replace("0.2,4.0,-30.0,", "0.2,4.0,edgewise,", 1))
    with pytest.raises(InputError, match=r"line \d+ holds '0.2,4.0,edgewise,.*': every cell must be a number"):
        read_rotor_table(path)


def test_missing_empty_and_binary_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_rotor_table(tmp_path / "none.csv")
    (tmp_path / "empty.csv").write_text("# only a comment\n")
    with pytest.raises(InputError, match="holds no table"):
        read_rotor_table(tmp_path / "empty.csv")
    (tmp_path / "binary.csv").write_bytes(b"throttle\xff\xfe")
    with pytest.raises(InputError, match="is not a UTF-8 text file"):
        read_rotor_table(tmp_path / "binary.csv")
