"""Readers of files under arbitrary and mutated content: a value, or an error meant for the user, and nothing else."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from levelone.campaign.dakota.parameters import read_parameters
from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.models.command_files import dakota_parameters, dakota_results, json_history, json_responses
from levelone.campaign.models.protocol import Evaluations
from levelone.config.data_files import read_data
from levelone.config.geometry_file import load_geometry
from levelone.config.model_study import load_model_study
from levelone.config.state_space_file import load_state_space
from levelone.config.study_file import load_study
from levelone.config.vehicle_file import library, load_vehicle
from levelone.errors import LeveloneError
from levelone.handling.records import read_csv

STUDIES = Path(__file__).parents[2] / "studies"
few = settings(max_examples=40, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
fewer = settings(few, max_examples=12)
STATE_SPACE = """
[system]
name = "pitch with attitude hold"

[parameters]
M_d = 2.0
late = 0.0

[states]
names = ["theta", "q"]
units = ["rad", "rad/s"]

[inputs]
names = ["delta", "gust"]
units = ["rad", "m/s"]
delay = ["late", 0.0]

[matrices]
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0, 0.0], ["M_d", 0.1]]

[feedback]
controls = ["delta"]
states = ["theta", "q"]
Kx = [[3.0, 1.5]]
sign_x = -1
Ki = [[0.8]]
sign_i = -1

[feedback.commands]
names = ["theta_ref"]
units = ["rad"]

[[feedback.integral]]
of = { theta = 1.0 }
command = "theta_ref"
"""
RECORD = "# input_name = V_lon_ref\n# input_on = 1.0\n# trim.q = 0.0\ntime[s],V_lon_ref[m/s],q[deg/s]\n" + "".join(
    f"{0.5 * k},{5.0 + (k > 2)},{0.1 * k}\n" for k in range(8)
)
#: what a value of a TOML file is replaced with
VALUES = (
    *("nan", "-inf", "1e400", "-1", "0", "true", '""', '"x"', '"../../x"', "[]", "[[]]", "{}", "[1, 2]", "[true]", '"\\u00e9"'),
    *("1979-05-27T07:32:00Z", "9223372036854775807", "1e-320", '{value = 1.0, unit = "m"}', '{value = "x", unit = 3}'),
)
VALUE = re.compile(r"(?<== )[^\n#]+")
LINE = re.compile(r"^.*\n", re.MULTILINE)


def texts(valid):
    """Valid text with some of its values, lines and characters changed."""

    @st.composite
    def mutated(draw):
        text = valid
        for _ in range(draw(st.integers(1, 3))):
            kind = draw(st.sampled_from(["value", "value", "line", "twice", "characters"]))
            spots = list((VALUE if kind == "value" else LINE).finditer(text)) or [re.match("", text)]
            spot = spots[draw(st.integers(0, len(spots) - 1))]
            if kind == "characters":
                at = draw(st.integers(0, len(text)))
                new, begin, end = draw(st.text(max_size=8)), at, min(len(text), at + draw(st.integers(0, 8)))
            else:
                begin, end = spot.span()
                new = {"value": draw(st.sampled_from(VALUES)), "line": "", "twice": spot[0] * 2}[kind]
            text = text[:begin] + new + text[end:]
        return text

    return mutated()


def damaged(content):
    """Bytes with a part overwritten, left out or cut off."""

    @st.composite
    def mutated(draw):
        at, length = draw(st.integers(0, len(content))), draw(st.integers(0, 400))
        new = draw(st.binary(max_size=32))
        return draw(
            st.sampled_from([content[:at], content[:at] + new + content[at + len(new) :], content[:at] + content[at + length :]])
        )

    return mutated()


def ends_well(reader, *arguments):
    """Whether the reader gave a value; an error of the package is an end as good, anything else is not."""
    try:
        reader(*arguments)
    except LeveloneError:
        return False
    return True


def file_of(tmp_path, name, content):
    path = tmp_path / name
    if isinstance(content, str):
        path.write_text(content, encoding="utf-8", errors="surrogatepass", newline="")
    else:
        path.write_bytes(content)
    return path


MODEL_STUDY = (STUDIES / "own-model" / "study.toml").read_text(encoding="utf-8").replace('folder = "."\n', "")
STUDY = re.sub("(?m)^findings = .*\n", "", (STUDIES / "reference" / "study.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("reader", "text"),
    [
        (load_model_study, MODEL_STUDY),
        (load_study, STUDY),
        (load_state_space, STATE_SPACE),
        (read_csv, RECORD),
        (read_data, RECORD),
    ],
)
def test_what_is_mutated_is_valid(reader, text, tmp_path):
    assert ends_well(reader, file_of(tmp_path, "x.csv" if text is RECORD else "x.toml", text))


@given(text=texts(MODEL_STUDY))
@settings(few, max_examples=150)
def test_study_of_a_model(tmp_path, text):
    ends_well(load_model_study, file_of(tmp_path, "study.toml", text))


@given(text=texts(STUDY))
@few
def test_study_of_a_vehicle(tmp_path, text):
    ends_well(load_study, file_of(tmp_path, "study.toml", text))


@given(text=texts(library()["reference-evtol"].read_text(encoding="utf-8")))
@few
def test_vehicle(tmp_path, text):
    csv = library()["reference-evtol"].parent / "reference-evtol-rotor.csv"
    (tmp_path / csv.name).write_bytes(csv.read_bytes())
    ends_well(load_vehicle, file_of(tmp_path, "craft.toml", text))


@given(text=texts(STATE_SPACE))
@few
def test_state_space(tmp_path, text):
    ends_well(load_state_space, file_of(tmp_path, "model.toml", text))


@given(text=texts(RECORD))
@few
def test_csv_record(tmp_path, text):
    ends_well(read_csv, file_of(tmp_path, "record.csv", text))


@given(text=texts(RECORD))
@few
def test_recorded_data_as_csv(tmp_path, text):
    ends_well(read_data, file_of(tmp_path, "flight.csv", text))


@given(text=texts(dakota_parameters({"mass": 4.0, "gain": 0.5}, ("zeta", "omega_n"))))
@few
def test_dakota_parameters(tmp_path, text):
    ends_well(read_parameters, file_of(tmp_path, "params.in", text))


@given(text=texts("0.35 zeta\n5.6 omega_n\n"))
@few
def test_dakota_results(text):
    ends_well(dakota_results, text, ("zeta", "omega_n"))


@given(text=texts('{"responses": {"zeta": 0.35}, "time": [0.0, 0.1], "channels": {"q": [0.0, 1.0], "csv": "x.csv"}}'))
@few
def test_answers_in_json(tmp_path, text):
    ends_well(json_responses, text)
    ends_well(json_history, text, tmp_path)


@pytest.mark.parametrize(
    "reader", [load_study, load_model_study, load_vehicle, load_geometry, load_state_space, read_csv, read_parameters]
)
@given(content=st.one_of(st.binary(max_size=200), st.text(max_size=200)))
@few
def test_arbitrary_content(reader, tmp_path, content):
    assert not ends_well(reader, file_of(tmp_path, "x.toml", content)) or reader is read_parameters


@pytest.mark.parametrize(("ending", "library"), [("csv", "csv"), ("parquet", "pyarrow"), ("mat", "scipy"), ("ulg", "pyulog")])
@given(content=st.binary(max_size=200))
@few
def test_arbitrary_recorded_data(ending, library, tmp_path, content):
    pytest.importorskip(library, reason=f"reading .{ending} needs {library}")
    ends_well(read_data, file_of(tmp_path, f"flight.{ending}", content))


def written_parquet(path):
    arrow = pytest.importorskip("pyarrow", reason="reading .parquet needs pyarrow")
    from pyarrow import parquet

    parquet.write_table(arrow.table({"time": [0.0, 0.1, 0.2], "q": [0.0, 1.0, math.nan]}), path)


def written_mat(path):
    from scipy.io import savemat

    savemat(path, {"time": np.arange(3.0), "q": np.ones(3)})


@pytest.mark.parametrize("write", [written_parquet, written_mat])
def test_damaged_recorded_data(write, tmp_path):
    path = tmp_path / f"flight.{write.__name__.removeprefix('written_')}"
    write(path)
    assert ends_well(read_data, path)

    @given(content=damaged(path.read_bytes()))
    @few
    def damage(content):
        path.write_bytes(content)
        ends_well(read_data, path)

    damage()


def test_damaged_store(tmp_path):
    path = tmp_path / "campaign.sqlite"
    points = np.arange(6.0).reshape(3, 2)
    evaluations = Evaluations(np.ones((3, 1)), np.zeros((3, 1), np.int64), np.zeros((3, 0), np.int64), np.ones(3), ("",) * 3)

    def use():
        with EvaluationStore.open(path, {"k": 1}, ("zeta",), ("1",), (), ("a", "b"), "0" * 64) as store:
            store.lookup(points)
            store.add(points, evaluations)

    use()

    @given(content=damaged(path.read_bytes()))
    @fewer
    def damage(content):
        for beside in tmp_path.iterdir():
            beside.unlink()
        path.write_bytes(content)
        ends_well(use)

    damage()
