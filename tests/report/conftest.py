"""One synthetic results folder, and its report, for all tests of the package."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import synthetic

from levelone.report import render_report, style
from levelone.report.results import Results, load_results


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthetic.write(tmp_path_factory.mktemp("study"))


@pytest.fixture(scope="session")
def results(folder: Path) -> Results:
    return load_results(folder)


@pytest.fixture(scope="session")
def page(folder: Path) -> str:
    return render_report(folder).read_text(encoding="utf-8")


@pytest.fixture
def paper() -> Iterator[None]:
    with style.paper():
        yield
