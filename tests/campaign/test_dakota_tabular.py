"""Results files of Dakota's in all their forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from dakota_cases import ISHIGAMI, exported, ishigami, needs_dakota

from levelone.campaign.dakota.execute import run_dakota
from levelone.campaign.dakota.hdf5 import read_hdf5
from levelone.campaign.dakota.tabular import read_tabular
from levelone.errors import InputError
from levelone.status import Status

ROWS = [(0.25, -1.0, 3.0, 0.5, 2.25), (1.0, 0.0, -3.0, float("nan"), -2.0)]
NAMES = ("x2", "x1", "x3", "zeta", "tau_p")


def table(leading: str = "en", header: bool = True) -> str:
    """A tabular file; ``leading`` holds e and n for evaluation number and interface."""
    words = [{"e": "eval_id", "n": "interface"}[letter] for letter in leading]
    lines = [f"%{' '.join([*words, *NAMES])}"] if header else []
    for i, row in enumerate(ROWS):
        first = [{"e": str(i + 1), "n": "NO_ID"}[letter] for letter in leading]
        lines.append(" ".join([*first, *(f"{value!r:<20}" for value in row)]))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("leading", ["en", "e", "n", ""])
@pytest.mark.parametrize("header", [True, False])
def test_annotated_custom_and_freeform(tmp_path: Path, leading: str, header: bool) -> None:
    path = tmp_path / "runs.dat"
    path.write_text(table(leading, header))
    found = read_tabular(path, ISHIGAMI, () if header else NAMES)
    assert found.columns == ("x2", "x1", "x3")
    np.testing.assert_array_equal(found.points, [[-1.0, 0.25, 3.0], [0.0, 1.0, -3.0]])
    assert found.responses.names == ("zeta", "tau_p")
    assert found.responses.units == ("1", "s")
    np.testing.assert_array_equal(found.responses.values, [[0.5, 2.25], [np.nan, -2.0]])
    assert found.responses.codes("zeta").tolist() == [Status.OK, Status.MODEL_FAILED]


@pytest.mark.parametrize(
    ("text", "columns", "named"),
    [
        ("", (), "is empty"),
        (table()[:-3], (), "ends inside a line.*read_restart"),
        (table(header=False), (), "no header"),
        (table(), NAMES, "has a header"),
        (table().replace("x3", "x4"), (), "'x4'; did you mean"),
        (table().replace("zeta", "zetta"), (), "did you mean 'zeta'"),
        (table().replace("zeta", "tau_p"), (), "given twice"),
        (table().replace("x3", "rise_time"), (), "lacks the factor x3"),
        (table().replace("3.0 ", "3,0 "), (), "runs.dat"),
        (table().replace("0.25 ", "nan  "), (), "run 1: x2 is not finite"),
        (table().replace("NO_ID", ""), (), "rows of 6 entries"),
        (table("en", header=False), NAMES[:3], "rows of 7 entries"),
    ],
)
def test_what_cannot_be_read_is_refused_in_words(tmp_path: Path, text: str, columns: tuple[str, ...], named: str) -> None:
    path = tmp_path / "runs.dat"
    path.write_text(text)
    with pytest.raises(InputError, match=named):
        read_tabular(path, ISHIGAMI, columns)


def test_a_header_without_runs(tmp_path: Path) -> None:
    path = tmp_path / "runs.dat"
    path.write_text(table().splitlines()[0] + "\n")
    assert len(read_tabular(path, ISHIGAMI).points) == 0


def test_hdf5_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "runs.h5"
    path.write_text("no HDF5")
    with pytest.raises(InputError, match="HDF5"):
        read_hdf5(path, ISHIGAMI)


@needs_dakota
@pytest.mark.oracle
def test_both_kinds_of_file_hold_the_same_runs_of_the_driver(tmp_path: Path) -> None:
    exported(tmp_path, limit=2.5)
    run_dakota(tmp_path / "lhs.in")
    text, binary = read_tabular(tmp_path / "lhs.dat", ISHIGAMI), read_hdf5(tmp_path / "lhs.h5", ISHIGAMI)
    assert text.columns == binary.columns == ISHIGAMI.names
    np.testing.assert_allclose(text.points, binary.points, rtol=1e-15)
    np.testing.assert_allclose(text.responses.values, binary.responses.values, rtol=1e-15)
    np.testing.assert_array_equal(text.responses.status, binary.responses.status)
    failed = binary.responses.failed("zeta")
    np.testing.assert_array_equal(failed, binary.points[:, 1] > 2.5)
    assert failed.any()
    np.testing.assert_allclose(binary.responses.column("zeta")[~failed], ishigami(binary.points)[~failed], rtol=0, atol=1e-13)
