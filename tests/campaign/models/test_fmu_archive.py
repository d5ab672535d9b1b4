"""Archives that are no FMU, or made to harm, are refused before anything in them is run or written."""

from __future__ import annotations

import stat
import zipfile
from pathlib import Path

import pytest
from fmu_building import archive, description
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from levelone.campaign.models import fmu_archive
from levelone.campaign.models.fmu_archive import described, unpacked
from levelone.campaign.models.keys import file_digest
from levelone.errors import InputError

pytest.importorskip("fmpy", reason="FMPy reads the description: pip install levelone[fmu]")

XML = description("2.0")
LIBRARY = "binaries/linux64/pitch.so"


def _refused(file: Path, words: str, mode: str = "co-simulation") -> None:
    with pytest.raises(InputError, match=words):
        described(file, mode)


def test_a_whole_archive_is_described(tmp_path: Path) -> None:
    file = archive(tmp_path / "good.fmu", {"modelDescription.xml": XML, LIBRARY: b"not run here"})
    assert {v.name for v in described(file, "model-exchange").modelVariables} >= {"V_ref", "theta", "rate_gain"}


def test_what_is_no_zip_file(tmp_path: Path) -> None:
    file = tmp_path / "not.fmu"
    file.write_bytes(b"#!/bin/sh\ntouch canary\n")
    _refused(file, "no FMU: it cannot be read as a zip file")
    _refused(tmp_path / "missing.fmu", "no file")
    _refused(tmp_path, "cannot be read")


def test_an_archive_without_description(tmp_path: Path) -> None:
    _refused(archive(tmp_path / "empty.fmu", {"readme.txt": "hello"}), "holds no modelDescription.xml")


@pytest.mark.parametrize("name", ["../canary", "resources/../../canary", "/tmp/canary", "resources\\..\\..\\canary", "C:canary"])
def test_members_that_lead_out_of_the_folder(tmp_path: Path, name: str) -> None:
    file = archive(tmp_path / "traversal.fmu", {"modelDescription.xml": XML, LIBRARY: b"", name: b"canary"})
    _refused(file, "lead out of its folder")


def test_a_link_is_refused(tmp_path: Path) -> None:
    file = archive(tmp_path / "link.fmu", {"modelDescription.xml": XML, LIBRARY: b""})
    link = zipfile.ZipInfo("resources/link")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(file, "a") as zipped:
        zipped.writestr(link, "/etc/passwd")
    _refused(file, "lead out of its folder")


def test_a_bomb_is_refused_by_what_it_would_unpack_to(tmp_path: Path) -> None:
    file = archive(tmp_path / "bomb.fmu", {"modelDescription.xml": XML, LIBRARY: b"", "resources/zeros": bytes(80 * 1024**2)})
    assert file.stat().st_size < 100_000
    _refused(file, "would unpack to 8[0-9] MB")


def test_too_many_members(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fmu_archive, "MOST_MEMBERS", 3)
    _refused(archive(tmp_path / "many.fmu", {"modelDescription.xml": XML, "a": "", "b": "", "c": ""}), "holds 4 files")


@pytest.mark.parametrize(
    "xml",
    [
        '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><x>&b;</x>',
        '<?xml version="1.0"?><!doctype x SYSTEM "file:///etc/passwd"><x/>',
        '<?xml version="1.0" encoding="UTF-7"?>+ADwAIQ-DOCTYPE x+AD4-<x/>',
        '<?xml version="1.0" encoding="UTF-16"?><x/>'.encode("utf-16"),
        '<?xml version="1.0" encoding="UTF-16LE"?><!DOCTYPE x><x/>'.encode("utf-16-le"),
    ],
)
def test_entities_and_encodings_that_hide_them(tmp_path: Path, xml: str | bytes) -> None:
    _refused(archive(tmp_path / "entities.fmu", {"modelDescription.xml": xml, LIBRARY: b""}), "document type|asks for UTF-8")


@pytest.mark.parametrize(
    "xml", ["", "<x/>", XML[:-40], XML.replace('fmiVersion="2.0"', 'fmiVersion="9.0"'), XML.replace("causality", "cause")]
)
def test_a_description_that_is_not_valid(tmp_path: Path, xml: str) -> None:
    _refused(archive(tmp_path / "invalid.fmu", {"modelDescription.xml": xml, LIBRARY: b""}), "not valid")


def test_a_mode_and_a_platform_that_it_does_not_have(tmp_path: Path) -> None:
    only = XML.replace('<ModelExchange modelIdentifier="pitch"/>', "")
    _refused(archive(tmp_path / "cs.fmu", {"modelDescription.xml": only, LIBRARY: b""}), "has no model-exchange", "model-exchange")
    file = archive(tmp_path / "other.fmu", {"modelDescription.xml": XML, "binaries/win64/pitch.dll": b""})
    _refused(file, "no library for .*; it is built for: win64")


def test_only_what_is_needed_is_unpacked_and_only_of_the_same_file(tmp_path: Path) -> None:
    members = {
        "modelDescription.xml": XML,
        LIBRARY: b"1",
        "binaries/win64/pitch.dll": b"2",
        "sources/a.c": "",
        "resources/t.csv": "3",
    }
    file = archive(tmp_path / "whole.fmu", members)
    folder, _ = unpacked(file, "co-simulation", file_digest(file, "model.file"))
    assert {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()} == {
        "modelDescription.xml",
        LIBRARY,
        "resources/t.csv",
    }
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    with pytest.raises(InputError, match="has changed since the study was read"):
        unpacked(file, "co-simulation", "0" * 64)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return archive(tmp_path_factory.mktemp("whole") / "x.fmu", {"modelDescription.xml": XML, LIBRARY: b"library"}).read_bytes()


@settings(max_examples=60, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_archives_end_in_an_input_error_or_a_description(tmp_path: Path, whole: bytes, data: st.DataObject) -> None:
    changed = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        changed[data.draw(st.integers(0, len(changed) - 1))] = data.draw(st.integers(0, 255))
    file = tmp_path / "damaged.fmu"
    file.write_bytes(bytes(changed[: data.draw(st.integers(1, len(changed)))]))
    try:
        read = described(file, "co-simulation")
    except InputError:
        return
    assert read.guid == described(file, "co-simulation").guid
