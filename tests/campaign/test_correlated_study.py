"""A study of correlated factors: what keeps its meaning is given, the rest refused with the reason."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import spearmanr

from levelone.campaign import run_study
from levelone.campaign.analysis import CORRELATED
from levelone.config.study_file import Study
from levelone.report import certainty
from levelone.report.results import load_results
from levelone.uncertainty import FactorSpace


@pytest.fixture(scope="module")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    rank = np.eye(len(study.space))
    i, j = study.space.index("K_T"), study.space.index("M")
    rank[i, j] = rank[j, i] = 0.8
    correlated = replace(
        study, space=FactorSpace(study.space.factors, rank), correlations=(("K_T", "M", 0.8, "assumed: test"),), coupling=None,
        deceleration=None, cases=(), amplitudes=(), findings=None,
    )  # fmt: skip
    out = tmp_path_factory.mktemp("correlated")
    run_study(correlated, out, threads=2)
    return out


def content(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "results.json").read_text(encoding="utf-8"))


def test_the_sample_is_correlated(folder: Path) -> None:
    points = load_results(folder).monte_carlo["points"]
    assert spearmanr(points.sel(factor="K_T"), points.sel(factor="M")).statistic == pytest.approx(0.8, abs=0.12)
    assert content(folder)["study"]["correlations"] == [{"factors": ["K_T", "M"], "rank": 0.8, "source": "assumed: test"}]


def test_indices_without_a_meaning_are_refused(folder: Path) -> None:
    for block in content(folder)["responses"].values():
        assert all(math.isnan(row["ST"]) and math.isnan(row["S1"]) for row in block["sobol"].values())
        assert all(math.isnan(row["mu_star"]) for row in block["morris"].values())
        assert block["surrogate"]["status"] == CORRELATED
        assert block["surrogate"]["q2"] > 0.5
    assert not (folder / "morris.nc").exists()


def test_shapley_effects_stand_in_their_place(folder: Path) -> None:
    for block in content(folder)["measures"].values():
        assert sum(row["Sh"] for row in block["shapley"]["rows"].values()) == pytest.approx(1.0, abs=1e-9)
        assert block["shapley"]["status"] == "ok"
        assert "refused" in block["chaos"]["status"]


def test_the_page_says_why(folder: Path) -> None:
    refused = certainty.context(load_results(folder))["refused"]
    assert "Shapley effects and first-order indices of the runs stand in their place" in refused
