"""Two sets of numbers for the same cases in a study file."""

from __future__ import annotations

import numpy as np
import pytest

from levelone.config.study_file import load_study
from levelone.errors import InputError

TABLE = """
[[cases]]
name = "two"
criterion = "bandwidth"
columns = ["C_L0", "C_mq"]
rows = [[0.45, -7.0], [0.63, -7.0]]
source = "Table 9"
"""
BESIDE = """
[cases.beside]
name = "mine"
rows = [[0.45, -23.0], [0.63, -23.5]]
assumed = "a guess"
"""


@pytest.fixture
def path(study_file):
    def write(beside):
        file = study_file()
        text = file.read_text()
        start, end = text.index("[[cases]]"), text.index("# Deceleration to hover over a point")
        file.write_text(text[:start] + TABLE + beside + text[end:])
        return file

    return write


def test_both_sets_are_read_with_their_origins(path):
    study = load_study(path(BESIDE))
    (cases,) = study.cases
    np.testing.assert_array_equal(cases.rows, [[0.45, -7.0], [0.63, -7.0]])
    np.testing.assert_array_equal(cases.beside.rows, [[0.45, -23.0], [0.63, -23.5]])
    assert (cases.beside.name, cases.beside.source) == ("mine", "assumed: a guess")
    assert (cases.beside.criterion, cases.beside.columns) == (cases.criterion, cases.columns)
    assert dict(study.assumed)["cases.two.beside"] == "a guess"


def test_table_without_another_has_none(path):
    assert load_study(path("")).cases[0].beside is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[0.63, -23.5]", "[0.63]", "cases.two.beside.rows.2: holds 1 numbers for 2 columns"),
        (", [0.63, -23.5]", "", "cases.two.beside.rows: holds 1 cases; must be the 2 of the table"),
        ('assumed = "a guess"', "", "cases.two.beside: neither source nor assumed"),
        ("-23.5", "inf", "cases"),
        ('name = "mine"', "", "name"),
    ],
)
def test_faults_are_named(path, old, new, words):
    assert old in BESIDE
    with pytest.raises(InputError) as caught:
        load_study(path(BESIDE.replace(old, new)))
    assert words in str(caught.value)
