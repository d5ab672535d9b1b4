"""Parameters files as Dakota 6.24 writes them, and files that are none."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelone.campaign.dakota.parameters import Evaluation, read_parameters
from levelone.errors import InputError

POINTS = [(-0.9173590235230853, 2.0), (1.386477429511122, 0.5)]


def standard(points: list[tuple[float, float]], ids: list[str], active: int = 1) -> str:
    """The layout that Dakota 6.24 was seen to write, with a derivative variable more than is needed."""
    rows = []
    for (a, d), identifier in zip(points, ids, strict=True):
        rows += [(2, "variables"), (repr(a), "M"), (repr(d), "I_y"), (2, "functions"), (1, "ASV_1:zeta"), (active, "ASV_2:tau_p")]
        rows += [(1, "derivative_variables"), (1, "DVV_1:M"), (0, "analysis_components"), (identifier, "eval_id"), (0, "metadata")]
    return "".join(f"{value!s:>43} {tag}\n" for value, tag in rows)


def aprepro(points: list[tuple[float, float]], ids: list[str]) -> str:
    rows = []
    for (a, d), identifier in zip(points, ids, strict=True):
        rows += [("DAKOTA_VARS", 2), ("M", repr(a)), ("I_y", repr(d)), ("DAKOTA_FNS", 2), ("ASV_1:zeta", 1), ("ASV_2:tau_p", 1)]
        rows += [
            ("DAKOTA_DER_VARS", 1),
            ("DVV_1:M", 1),
            ("DAKOTA_AN_COMPS", 0),
            ("DAKOTA_EVAL_ID", identifier),
            ("DAKOTA_METADATA", 0),
        ]
    return "".join(f"                    {{ {tag:<15} = {value!s:>22} }}\n" for tag, value in rows)


def as_json(points: list[tuple[float, float]], ids: list[str]) -> str:
    content = [
        {
            "analysis_components": [], "derivative_variables": [1], "eval_id": identifier, "metadata": [],
            "responses": [{"active_set": 1, "label": "zeta"}, {"active_set": 1, "label": "tau_p"}],
            "variables": [{"label": "M", "value": a}, {"label": "I_y", "value": d}],
        }
        for (a, d), identifier in zip(points, ids, strict=True)
    ]  # fmt: skip
    return json.dumps(content[0] if len(content) == 1 else content, indent=4)


WRITERS = {"standard": standard, "aprepro": aprepro, "json": as_json}


@pytest.mark.parametrize("form", WRITERS)
@pytest.mark.parametrize("ids", [["7"], ["1:1", "1:2"]])
def test_each_format_single_and_batch(tmp_path: Path, form: str, ids: list[str]) -> None:
    path = tmp_path / "params.in"
    path.write_text(WRITERS[form](POINTS[: len(ids)], ids))
    expected = tuple(
        Evaluation(identifier, {"M": a, "I_y": d}, {"zeta": 1, "tau_p": 1})
        for identifier, (a, d) in zip(ids, POINTS, strict=False)
    )  # fmt: skip
    assert read_parameters(path) == expected


@given(st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 2), min_size=1, max_size=4))
def test_values_come_through_to_the_last_bit(tmp_path_factory: pytest.TempPathFactory, points: list[tuple[float, float]]) -> None:
    path = tmp_path_factory.mktemp("given") / "params.in"
    ids = [f"1:{i + 1}" for i in range(len(points))]
    for writer in WRITERS.values():
        path.write_text(writer(points, ids))
        found = read_parameters(path)
        assert [tuple(each.variables.values()) for each in found] == points
        assert [math.copysign(1.0, each.variables["M"]) for each in found] == [math.copysign(1.0, a) for a, _ in points]


def test_active_set_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "params.in"
    path.write_text(standard(POINTS[:1], ["1"], active=3))
    assert read_parameters(path)[0].active == {"zeta": 1, "tau_p": 3}


def test_names_with_colons_keep_what_follows_the_number(tmp_path: Path) -> None:
    path = tmp_path / "params.in"
    path.write_text(standard(POINTS[:1], ["1"]).replace("ASV_2:tau_p", "ASV_2:tau_p:a"))
    assert list(read_parameters(path)[0].active) == ["zeta", "tau_p:a"]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "no evaluation"),
        ("hello\n", "line 1"),
        ("1.0 0.5\n", "number of 'variables'"),
        (standard(POINTS[:1], ["1"])[:343], "ends inside"),
        (standard(POINTS[:1], ["1"]).replace("-0.9173590235230853", "nan"), "M is"),
        (standard(POINTS[:1], ["1"]).replace("I_y", "M"), "a name twice"),
        ("{ DAKOTA_VARS = 1 }\n{ M = 1.0 }\n", "ends inside"),
        ("{ DAKOTA_VARS = 1 }\nM = 1.0\n", "line 2"),
        ("[1, 2", "Expecting"),
        ('[{"eval_id": "1"}]', "variables"),
        ("[]", "no evaluation"),
    ],
)
def test_what_is_no_parameters_file_is_refused_in_words(tmp_path: Path, text: str, named: str) -> None:
    path = tmp_path / "params.in"
    path.write_text(text)
    with pytest.raises(InputError, match=named):
        read_parameters(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.in"):
        read_parameters(tmp_path / "nowhere.in")
