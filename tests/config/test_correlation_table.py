"""Correlated factors in a study file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from levelone.config.study_file import load_study
from levelone.errors import InputError

REFERENCE = Path(__file__).parents[2] / "studies" / "reference" / "study.toml"
PAIR = '[[correlation]]\nfactors = ["C_L0", "C_Lalpha"]\nrank = 0.6\nassumed = "both follow the lift slope"\n'


def written(folder: Path, sections: str, without: str = '["coupling"]') -> Path:
    path = folder / "study.toml"
    path.write_text(f'[study]\nextends = "{REFERENCE}"\nname = "mine"\nwithout = {without}\n\n{sections}', encoding="utf-8")
    return path


def test_a_pair_becomes_a_correlated_space(tmp_path: Path) -> None:
    study = load_study(written(tmp_path, PAIR))
    assert study.space.correlated
    rank = np.array(study.space.correlation)
    first, second = study.space.index("C_L0"), study.space.index("C_Lalpha")
    assert rank[first, second] == rank[second, first] == 0.6
    assert np.abs(rank - np.eye(14)).sum() == pytest.approx(1.2)
    assert study.correlations == (("C_L0", "C_Lalpha", 0.6, "assumed: both follow the lift slope"),)


def test_without_the_section_factors_are_independent(tmp_path: Path) -> None:
    study = load_study(written(tmp_path, ""))
    assert not study.space.correlated
    assert study.correlations == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"C_Lalpha"]', '"C_Lalfa"]', r"correlation\.1\.factors: unknown name 'C_Lalfa'; did you mean 'C_Lalpha'"),
        ('"C_Lalpha"]', '"C_L0"]', "names 'C_L0' twice"),
        ("0.6", "1.0", "rank"),
        ('assumed = "both follow the lift slope"\n', "", "neither source nor assumed"),
        (PAIR, PAIR + PAIR, "are correlated above already"),
    ],
)
def test_a_wrong_entry_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_study(written(tmp_path, PAIR.replace(old, new)))


def test_correlations_that_cannot_be_name_the_pair_to_change(tmp_path: Path) -> None:
    third = PAIR.replace('"C_L0", "C_Lalpha"', '"C_L0", "C_D0"').replace("0.6", "0.95")
    fourth = PAIR.replace('"C_L0", "C_Lalpha"', '"C_Lalpha", "C_D0"').replace("0.6", "-0.95")
    with pytest.raises(InputError, match="C_"):
        load_study(written(tmp_path, PAIR.replace("0.6", "0.95") + third + fourth))


def test_a_screening_of_coupling_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="coupling: is a Morris screening"):
        load_study(written(tmp_path, PAIR, without="[]"))
