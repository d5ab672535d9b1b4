"""Indices of the model itself beside those on surrogates."""

from __future__ import annotations

import json
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from synthetic_sections import section

from levelone.errors import InputError
from levelone.report import direct, style
from levelone.report.results import Results

COST = {"wall_s": 90.0, "cpu_s": 170.0, "peak_memory_gib": 0.4}


def decomposition(results: Results, shift: float = 0.0) -> dict[str, Any]:
    """A direct.json of three factors whose ST lie beside those of the results by ``shift``."""
    responses = {}
    for name in ("zeta", "omega_n"):
        rows = {}
        for factor in list(results.responses[name]["sobol"])[:3]:
            total = results.responses[name]["sobol"][factor]["ST"] + shift
            rows[factor] = {"S1": 0.25, "ST": total, "S1_ci": [0.24, 0.26], "ST_ci": [total - 0.001, total + 0.001]}
        responses[name] = {"unit": "1", "failed": 3, "failures": {"diverged": 3}, "status": "ok", "doubt": "", "sobol": rows}
    hashes = {key: results.summary["provenance"].get(key) for key in ("study_sha256", "vehicle_sha256")}
    checked = {"runs": 64, "largest_difference": 0.0, "statuses_differ": 0}
    return {
        "schema": 1, **hashes, "base_points": 4096, "scramblings": 8, "runs": 65536, "groups": {}, "until_width": math.nan,
        "widest": 0.02, "names": list(rows), "responses": responses, "against_whole_records": checked, "cost": COST,
    }  # fmt: skip


def with_direct(results: Results, folder: Path, content: dict[str, Any]) -> Results:
    for item in results.directory.iterdir():
        if item.is_file():
            shutil.copy(item, folder)
    (folder / "direct.json").write_text(json.dumps(content), encoding="utf-8")
    return replace(results, directory=folder)


def test_a_folder_without_one_shows_nothing(results: Results) -> None:
    assert direct.context(results) is None
    assert direct.pictures(results) == []


def test_the_gap_to_the_surrogate_is_a_result(results: Results, tmp_path: Path) -> None:
    there = with_direct(results, tmp_path, decomposition(results, 0.5))
    shown = direct.context(there)
    assert [row["ST"] for row in shown["rows"]] == ["0.5", "0.5"]
    assert [row["inside"] for row in shown["rows"]] == ["0 of 3", "0 of 3"]
    assert [row["failed"] for row in shown["rows"]] == ["3 of 65536"] * 2
    close = direct.context(with_direct(results, tmp_path, decomposition(results)))
    assert [row["inside"] for row in close["rows"]] == ["3 of 3", "3 of 3"]


@pytest.mark.usefixtures("paper")
def test_the_picture_can_be_drawn_with_undefined_values(results: Results, tmp_path: Path) -> None:
    content = decomposition(results)
    row = next(iter(content["responses"]["zeta"]["sobol"].values()))
    row |= {"ST": math.nan, "ST_ci": [math.nan, math.nan]}
    (plan,) = direct.pictures(with_direct(results, tmp_path, content))
    figure = plan.draw()
    figure.draw(style.renderer(figure))
    assert figure.get_figwidth() == style.PAGE


def test_the_page_shows_it(results: Results, tmp_path: Path) -> None:
    content = decomposition(results)
    content["responses"]["zeta"]["doubt"] = "failed runs gather"
    content["responses"]["zeta"]["S2"] = [{"pair": ["K_T", "I_y"], "S2": 0.125, "S2_ci": [0.1, 0.15]}]
    text = section(with_direct(results, tmp_path, content), "direct").text
    assert "65536 runs of the flight simulation model" in text
    assert "failed runs gather" in text
    assert "0.125" in text


def test_that_of_another_version_is_not_compared(results: Results, tmp_path: Path) -> None:
    there = with_direct(results, tmp_path, decomposition(results) | {"study_sha256": "other"})
    assert direct.context(there)["outdated"] == direct.OTHER_STUDY
    assert direct.pictures(there) == []
    assert "decompose again" in section(there, "direct").text


@pytest.mark.parametrize(("text", "words"), [("{", "cannot be read"), ('{"schema": 0}', "another schema")])
def test_a_file_that_cannot_be_read_is_named(results: Results, tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "direct.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        direct.context(replace(results, directory=tmp_path))
