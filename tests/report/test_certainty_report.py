"""Validation of the surrogates and other measures, in tables and a picture."""

from __future__ import annotations

import copy
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import synthetic
import xarray as xr
from synthetic_sections import section

from levelone.report import certainty, style
from levelone.report.results import Results, load_results

VERDICT = "450 of 500 runs lie within 1.96 standard deviations"


def measured(factors: list[str], chaos: float) -> dict[str, Any]:
    """Other measures of one response: shares that fall from factor to factor."""
    share = np.linspace(0.5, 0.0, len(factors)).tolist()
    return {
        "failed": 2,
        "given_data": {
            "status": "ok",
            "rows": {f: {"S1": s, "S1_ci": [s - 0.1, s + 0.1]} for f, s in zip(factors, share, strict=True)},
        },
        "dependence": {"status": "ok", "rows": {f: {"R2": s, "p_value": 0.002} for f, s in zip(factors, share, strict=True)}},
        "shapley": {
            "status": "ok",
            "rows": {f: {"Sh": s, "Sh_ci": [s - 0.02, s + 0.02]} for f, s in zip(factors, share, strict=True)},
        },
        "chaos": {
            "status": "ok",
            "q2": chaos,
            "terms": 69,
            "rows": {f: {"S1": s, "ST": s} for f, s in zip(factors, share, strict=True)},
        },
    }


@pytest.fixture(scope="module")
def validated(results: Results, tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("validated")
    for item in results.directory.iterdir():
        if item.is_file():
            shutil.copy(item, folder)

    def add(summary: dict[str, Any]) -> None:
        summary["measures"] = {}
        for name, entry in summary["responses"].items():
            checked = {"q2_folds": 0.9, "q2_holdout": 0.9, "coverage_95": 0.9, "spread": 1.2, "verdict": VERDICT, "status": "ok"}
            entry["surrogate"] |= {"q2": 0.75, "validation": checked}
            summary["measures"][name] = measured(list(entry["sobol"]), 0.9995)

    synthetic.rewrite(folder, add)
    names = list(results.responses)
    rng = np.random.default_rng(4)
    value, residual = rng.normal(size=(2, len(names), 50))
    residual[0] = math.nan
    dims = ("response", "run")
    data = {"value": (dims, value), "loo_residual": (dims, 0.1 * residual), "loo_std": (dims, np.full(value.shape, 0.1))}
    xr.Dataset(data, {"response": names}).to_netcdf(folder / "surrogates.nc", engine="h5netcdf")
    return load_results(folder)


def test_results_without_measures_show_nothing(results: Results) -> None:
    assert certainty.context(results) is None
    assert certainty.pictures(results) == []


def test_tables_say_what_is_not_predicted(validated: Results) -> None:
    shown = certainty.context(validated)
    assert {row["q2"] for row in shown["rows"]} == {"0.25"}
    assert {row["chaos"] for row in shown["rows"]} == {"0.0005"}
    assert {row["verdict"] for row in shown["rows"]} == {VERDICT}
    first = shown["tables"][0]["rows"][0]
    assert (first["given"], first["Sh"], first["p"]) == ("0.5", "0.5", "0.002")


def test_correlated_factors_are_explained(validated: Results) -> None:
    summary = copy.deepcopy(dict(validated.summary))
    summary["study"]["correlations"] = [{"factors": ["K_T", "M"], "rank": 0.5, "source": "assumed: test"}]
    shown = certainty.context(replace(validated, summary=summary))
    assert "Shapley effects" in shown["refused"]
    assert shown["correlations"] == ["K_T and M 0.5 (assumed: test)"]


@pytest.mark.usefixtures("paper")
def test_the_picture_can_be_drawn_where_a_surrogate_is_missing(validated: Results) -> None:
    (plan,) = certainty.pictures(validated)
    figure = plan.draw()
    figure.draw(style.renderer(figure))
    texts = [text.get_text() for panel in figure.axes for text in panel.texts]
    assert texts == ["no surrogate"]


def test_the_page_holds_it(validated: Results) -> None:
    page = section(validated, "certainty").text
    assert page.count(VERDICT) == len(validated.responses)


def test_results_of_another_version_are_named(validated: Results, tmp_path: Path) -> None:
    from levelone.errors import InputError

    with pytest.raises(InputError, match=r"surrogates\.nc: missing"):
        certainty.pictures(replace(validated, directory=tmp_path))
