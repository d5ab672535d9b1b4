from __future__ import annotations

import os
import re
import stat
from pathlib import Path

import pytest

from levelone.campaign.models.build import build
from levelone.config.files import DEEPEST, MOST_TOML, read_toml
from levelone.config.geometry_file import load_geometry
from levelone.config.model_study import is_model_study, load_model_study
from levelone.config.study_file import load_study
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError

OWN = Path(__file__).parents[2] / "studies" / "own-model" / "study.toml"
TEXT = OWN.read_text(encoding="utf-8")
CANARY = "from pathlib import Path\nPath(__file__).with_name('canary').touch()\n"
READERS = {
    "toml": read_toml, "study": load_study, "model study": load_model_study, "kind": is_model_study, "vehicle": load_vehicle,
    "geometry": load_geometry,
}  # fmt: skip


def contents(folder):
    """Every path below a folder with its content, so that nothing can be written or changed unseen."""
    return {
        path.relative_to(folder): path.read_bytes() if stat.S_ISREG(path.lstat().st_mode) else None for path in folder.rglob("*")
    }


def refused(reader, path):
    before = contents(path.parent)
    with pytest.raises(InputError) as caught:
        reader(path)
    assert contents(path.parent) == before
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 2000
    return str(caught.value)


def with_model(section, tail=""):
    return re.sub(r"\[model\].*?(?=\[\[test\]\])", lambda match: f"[model]\n{section}\n{tail}\n", TEXT, count=1, flags=re.DOTALL)


@pytest.fixture(params=READERS)
def reader(request):
    return READERS[request.param]


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 100_000,
        "a = " + "[" * 2000 + "]" * 2000,
        "a = " + "[" * (DEEPEST + 1) + "]" * (DEEPEST + 1),
        "a = " + "{b = " * 50_000,
        ".".join("a" * 500_000) + " = 1",
        "[" + ".".join("a" * 500_000) + "]",
        "a = {" + " . ".join(["'a'", '"b"', "c"] * 100_000) + " = 1}",
    ],
    ids=["open lists", "lists", "one list too deep", "inline tables", "dotted key", "table header", "dotted key in a table"],
)
def test_deep_nesting_is_an_error_of_one_line(reader, tmp_path, text):
    path = tmp_path / "x.toml"
    path.write_text(text)
    assert re.search("nested deeper than|is not a TOML file", refused(reader, path))


def test_lists_as_deep_as_is_allowed_are_read(tmp_path):
    path = tmp_path / "x.toml"
    path.write_text("a = " + "[" * (DEEPEST - 1) + "]" * (DEEPEST - 1))
    assert list(read_toml(path)) == ["a"]


@pytest.mark.parametrize("value", ["9" * 5000, "1" + "0" * 400, "-" + "9" * 30, "0x" + "f" * 1000])
def test_an_integer_beyond_64_bits_is_refused(reader, tmp_path, value):
    path = tmp_path / "x.toml"
    path.write_text(f"a = {value}")
    assert re.search("integer beyond 64 bits|is not a TOML file", refused(reader, path))


def test_numbers_that_are_not_finite_are_refused(tmp_path):
    for value in ("nan", "inf", "-inf", "1e400"):
        path = tmp_path / "x.toml"
        path.write_text(TEXT.replace("amplitude = 0.2", f"amplitude = {value}", 1))
        assert "test.step.amplitude" in refused(load_model_study, path)
        path.write_text(TEXT.replace("value = 5.0", f"value = {value}", 1))
        assert "factor.omega.value" in refused(load_model_study, path)


def test_a_file_of_100_megabytes_is_not_read_to_its_end(reader, tmp_path):
    path = tmp_path / "x.toml"
    path.touch()
    os.truncate(path, 100 << 20)
    with pytest.raises(InputError, match=f"longer than {MOST_TOML >> 20} MiB"):
        reader(path)


def test_what_is_no_file_is_not_waited_for(reader, tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "device.toml").symlink_to("/dev/zero")
    (tmp_path / "loop.toml").symlink_to("loop.toml")
    for name in ("pipe.toml", "folder.toml", "device.toml", "loop.toml", "none.toml", "x" * 300 + ".toml"):
        refused(reader, tmp_path / name)
    with pytest.raises(InputError):
        reader(Path("zero\0byte.toml"))


def test_control_characters_in_names_and_texts_are_refused(tmp_path):
    for text in ("\\u001b[2J", "\\u0000", "\\u202e", "\\u0007"):
        path = tmp_path / "x.toml"
        path.write_text(TEXT.replace('title = "Pitch', f'title = "{text}Pitch', 1))
        message = refused(load_model_study, path)
        assert "control character" in message
        assert message.isprintable()


@pytest.mark.parametrize(
    "name",
    ["../escape", "/etc/x", "..", ".hidden", "a/b", "a\\\\b", "$(touch canary)", "a;b", "a b", "", "-rf", "x" * 300, "C:x", "a\\n"],
)
def test_a_name_that_becomes_a_folder_holds_no_path_and_no_command(tmp_path, name):
    path = tmp_path / "x.toml"
    path.write_text(TEXT.replace('name = "own-model"', f'name = "{name}"', 1))
    refused(load_model_study, path)


def test_names_of_tests_and_responses_become_files_and_hold_no_path(tmp_path):
    for name in ("../x", "a/b", "a.b", "", "a b", "x" * 100):
        path = tmp_path / "x.toml"
        path.write_text(TEXT.replace('name = "free"', f'name = "{name}"', 1))
        assert "test." in refused(load_model_study, path)


def test_reading_a_study_runs_and_imports_nothing(tmp_path):
    """Reading is safe whatever the file names: a function is imported, a command run, when the study is."""
    (tmp_path / "pitch_axis.py").write_text(CANARY)
    (tmp_path / "template").mkdir()
    script = tmp_path / "fly.sh"
    script.write_text(f"#!/bin/sh\ntouch {tmp_path}/canary\n")
    script.chmod(0o755)
    path = tmp_path / "study.toml"
    channels = TEXT[TEXT.index("[model.inputs") : TEXT.index("[[test]]")]
    arguments = 'arguments = ["./fly.sh", "{parameters}", "{results}", "; touch canary", "$(touch canary)"]'
    command = f'kind = "command"\n{arguments}\nformat = "json"'
    for text in (TEXT, with_model(command, channels)):
        path.write_text(text)
        before = contents(tmp_path)
        load_model_study(path)
        assert is_model_study(path)
        assert contents(tmp_path) == before


def test_a_module_that_is_missing_is_an_error_and_nothing_else_is_imported(tmp_path):
    (tmp_path / "pitch_axes.py").write_text(CANARY)
    path = tmp_path / "study.toml"
    path.write_text(TEXT)
    study = load_model_study(path)
    before = contents(tmp_path)
    with pytest.raises(InputError, match="pitch_axis"):
        build(study)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no zip", b"\0" * 4096, b"[model]\n"])
def test_an_fmu_that_is_no_zip_is_an_error(tmp_path, content):
    pytest.importorskip("fmpy", reason="FMUs need fmpy")
    (tmp_path / "craft.fmu").write_bytes(content)
    channels = TEXT[TEXT.index("[model.inputs") : TEXT.index("[[test]]")]
    path = tmp_path / "study.toml"
    path.write_text(with_model('kind = "fmu"\nfile = "craft.fmu"', channels))
    study = load_model_study(path)
    before = contents(tmp_path)
    with pytest.raises(InputError):
        build(study)
    assert contents(tmp_path) == before


def test_a_command_that_is_not_there_is_an_error_and_no_shell_looks_for_it(tmp_path):
    channels = TEXT[TEXT.index("[model.inputs") : TEXT.index("[[test]]")]
    path = tmp_path / "study.toml"
    for program in ("touch canary", "true; touch canary", "$(touch canary)", "`touch canary`", "./none", "|sh", "canary && true"):
        path.write_text(
            with_model(f'kind = "command"\narguments = ["{program}", "{{parameters}}", "{{results}}"]\nformat = "json"', channels)
        )
        study = load_model_study(path)
        before = contents(tmp_path)
        with pytest.raises(InputError):
            build(study)
        assert contents(tmp_path) == before


def test_very_many_entries_are_refused(tmp_path):
    path = tmp_path / "x.toml"
    factor = '[[factor]]\nname = "f{}"\nvalue = 1.0\nunit = "1"\nrange = [-0.1, 0.1]\nkind = "relative"\nassumed = "e"\n'
    path.write_text(TEXT.replace("[method]", "".join(factor.format(i) for i in range(600)) + "[method]", 1))
    assert "at most 500" in refused(load_model_study, path)
