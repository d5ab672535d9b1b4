from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import synthetic

from levelone.errors import InputError
from levelone.report.results import Results, attribute, load_results


@pytest.fixture
def copy(folder: Path, tmp_path: Path) -> Path:
    for item in folder.iterdir():
        if item.is_file():
            shutil.copy(item, tmp_path)
    return tmp_path


def test_values_come_back_as_written(results: Results) -> None:
    assert list(results.responses) == list(synthetic.RESPONSES)
    sample = results.sample("omega_n")
    assert sample.shape == (500,)
    assert np.isnan(sample).sum() == results.responses["omega_n"]["monte_carlo"]["failed"]
    assert list(results.of("dynamic_stability")) == ["zeta", "omega_n"]


def test_unknown_response_names_the_closest(results: Results) -> None:
    with pytest.raises(InputError, match="did you mean 'omega_bw'"):
        results.sample("omega_bv")


@pytest.mark.parametrize("schema", [0, 2, "1", None])
def test_other_schema_is_refused(copy: Path, schema: object) -> None:
    synthetic.rewrite(copy, lambda document: document.update(schema=schema))
    with pytest.raises(InputError, match=r"schema: is .*; this version reads 1"):
        load_results(copy)


def test_folder_without_results_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds no results\.json"):
        load_results(tmp_path)


def test_file_or_absent_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for name in ("file", "absent"):
        with pytest.raises(InputError, match="is not a folder"):
            load_results(tmp_path / name)


@pytest.mark.parametrize("text", ["{", "[1]", "\x00", "3"])
def test_broken_summary_is_refused(copy: Path, text: str) -> None:
    (copy / "results.json").write_text(text)
    with pytest.raises(InputError, match=r"results\.json"):
        load_results(copy)


def test_missing_section_is_named(copy: Path) -> None:
    synthetic.rewrite(copy, lambda document: document.pop("validity"))
    with pytest.raises(InputError, match=r"results\.json: validity: missing"):
        load_results(copy)


@pytest.mark.parametrize("name", ["monte_carlo.nc", "histories.nc", "frequency.nc"])
def test_missing_or_broken_data_file_is_named(copy: Path, name: str) -> None:
    (copy / name).write_bytes(b"not a NetCDF file")
    with pytest.raises(InputError, match=rf"{name}.*cannot be read"):
        load_results(copy)
    (copy / name).unlink()
    with pytest.raises(InputError, match=rf"{name}: missing"):
        load_results(copy)


def test_missing_group_is_named(copy: Path) -> None:
    shutil.copy(copy / "monte_carlo.nc", copy / "frequency.nc")
    with pytest.raises(InputError, match="group linear"):
        load_results(copy)


def test_missing_attribute_is_named(results: Results) -> None:
    with pytest.raises(InputError, match="attribute omega_999: missing"):
        attribute(results.linear, "omega_999")
