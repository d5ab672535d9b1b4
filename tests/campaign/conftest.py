"""A reference study of small size, and its results folder, run once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from levelone.campaign import run_study
from levelone.config.study_file import Study, load_study
from levelone.uncertainty import surrogate_intervals

STUDY = Path(__file__).parents[2] / "studies" / "reference" / "study.toml"


@pytest.fixture(scope="session", autouse=True)
def few_draws() -> Iterator[None]:
    """Few functions are drawn for the intervals of each response: what a study does with them is tested here, not their width."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surrogate_intervals, "DRAWS", 3)
        yield


@pytest.fixture(scope="session")
def study() -> Study:
    shipped = load_study(STUDY)
    method = replace(shipped.method, trajectories=4, samples=60, base_points=256, bootstrap=50)
    return replace(shipped, method=method)


@pytest.fixture(scope="session")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("results")
    run_study(study, out, threads=2)
    return out
