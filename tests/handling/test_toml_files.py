"""Files of limits: what is no such file is said in one line, whatever it holds."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from levelone.errors import InputError
from levelone.handling.large_amplitude import amplitude_limits
from levelone.handling.levels import load_boundaries
from levelone.handling.tolerances import load_tolerances
from levelone.handling.toml_files import MOST_BYTES, read_toml_file

DAMPING = '[dynamic_stability]\nzeta_1 = 0.35\ncorner = 0.5\nzeta_below_corner = 0.0\ngrowth = 0.0\nconfidence = "low"'
READERS = {
    "boundaries": load_boundaries,
    "tolerances": load_tolerances,
    "amplitudes": lambda path: amplitude_limits("pitch", "rate_command", "moderate", path),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("name = " + "[" * 5000 + "]" * 5000, "nested too deep"),
        ("schema = " + "1" * 5000, "is not a TOML file"),
        ("schema = 0x" + "f" * 5000, "beyond 64 bits"),
        ("a = [1, { b = 9223372036854775808 }]", "beyond 64 bits"),
        ("schema = ", "is not a TOML file"),
        ("# \udcff", "is not a TOML file"),
        ("#" * (MOST_BYTES + 1), "longer than 4 MiB"),
    ],
)
def test_a_file_that_no_reader_takes(tmp_path, reader, content, words):
    path = tmp_path / "own.toml"
    path.write_bytes(content.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=words):
        READERS[reader](path)


@pytest.mark.parametrize("reader", READERS)
def test_no_regular_file(tmp_path, reader):
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputError, match="is not a regular file"):
        READERS[reader](tmp_path / "pipe.toml")
    with pytest.raises(InputError, match="cannot be read: No such file"):
        READERS[reader](tmp_path / "none.toml")
    with pytest.raises(InputError, match="no name of a file"):
        read_toml_file(Path("a\0.toml"), "file")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("attitude_quickness = 3\n[dynamic_stability]", "attitude_quickness: is '3', must be a table"),
        ("dynamic_stability = [1]", "dynamic_stability: is .*, must be a table"),
        ("bandwidth.all = 1\n[dynamic_stability]", "bandwidth.all: is '1', must be a table"),
        (f"limits.height_response = 1\n{DAMPING}", "limits.height_response: is '1', must be a table"),
    ],
)
def test_boundaries_where_a_table_is_missing(tmp_path, text, words):
    path = tmp_path / "own.toml"
    path.write_text(f"schema = 1\n{text}\n", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        load_boundaries(path)


@pytest.mark.parametrize("text", ["pitch = 3", "pitch.rate_command = 3", "pitch.rate_command.moderate = 3"])
def test_amplitudes_where_a_table_is_missing(tmp_path, text):
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="is '3', must be a table"):
        amplitude_limits("pitch", "rate_command", "moderate", path)
