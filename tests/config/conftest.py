"""Copies of the shipped files, with one thing changed."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from levelone.config.vehicle_file import library

Changed = Callable[..., Path]
STUDY = Path(__file__).parents[2] / "studies" / "reference" / "study.toml"


def replaced(text: str, changes: tuple[tuple[str | re.Pattern[str], str], ...]) -> str:
    """The text with the first occurrence of each change's old part (text or pattern) replaced."""
    for old, new in changes:
        pattern = old if isinstance(old, re.Pattern) else re.compile(re.escape(old))
        text, count = pattern.subn(lambda match, new=new: new, text, count=1)
        assert count == 1, f"the shipped file no longer holds {old!r}"
    return text


@pytest.fixture
def vehicle_file(tmp_path: Path) -> Changed:
    """Write a copy of the reference vehicle, its text changed by pairs of old and new."""
    source = library()["reference-evtol"]
    shutil.copy(source.parent / "reference-evtol-rotor.csv", tmp_path)

    def write(*changes: tuple[str, str]) -> Path:
        path = tmp_path / "craft.toml"
        path.write_text(replaced(source.read_text(encoding="utf-8"), changes), encoding="utf-8")
        return path

    return write


@pytest.fixture
def study_file(tmp_path: Path) -> Changed:
    """Write a copy of the reference study, its text changed by pairs of old and new."""

    def write(*changes: tuple[str, str]) -> Path:
        path = tmp_path / "study.toml"
        shutil.copy(STUDY.parent / "findings.toml", tmp_path)
        path.write_text(replaced(STUDY.read_text(encoding="utf-8"), changes), encoding="utf-8")
        return path

    return write
