"""Commands as models: files in Dakota's format and in JSON, directories, time limits, and everything that can go wrong."""

from __future__ import annotations

import json
import os
import pickle
import re
import shutil
import stat
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simple_models import FREE, QUICK, SecondOrder, command_table

from levelone.campaign.dakota.parameters import read_parameters
from levelone.campaign.models.command import CommandHistories, CommandResponses
from levelone.campaign.models.command_files import dakota_parameters, dakota_results, json_history, json_parameters, json_responses
from levelone.campaign.models.programme import HistoryModel
from levelone.campaign.models.protocol import ModelFailure
from levelone.config.model_table import Channel
from levelone.errors import InputError
from levelone.handling.levels import Level, load_boundaries
from levelone.status import Status

DAMPING = (("zeta", "1"), ("omega_n", "rad/s"))
PLACES = ("{parameters}", "{results}")
POINTS = np.array([[0.2, 5.0], [0.5, 4.0]])


def script(folder: Path, text: str, name: str = "fly") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def shell(study: Path, body: str, **options) -> CommandResponses:
    """A model of ``./fly PARAMETERS RESULTS``, a shell script in the study's folder."""
    script(study, f"#!/bin/sh\n{body}\n")
    return responses(study, ("./fly", *PLACES), **options)


def responses(study: Path, arguments: tuple[str, ...], keep_in: Path | None = None, **options) -> CommandResponses:
    table = command_table(arguments, study, *DAMPING, **options)
    return CommandResponses(table, ("a", "b"), keep_in, load_boundaries(), "all_other")


ANSWER = 'echo \'{"responses": {"zeta": 0.4, "omega_n": 5}}\' > "$2"'


@pytest.mark.parametrize("form", ["json", "dakota"])
def test_numbers_go_and_come_to_the_last_bit(tmp_path, form):
    """Reads its own file of parameters with nothing of this package, in the language that is at hand."""
    body = {
        "json": "import json; p = json.load(open(sys.argv[1]))['parameters']\n"
        "json.dump({'responses': {'zeta': p['a'], 'omega_n': p['b'] * p['gain'], 'more': 1}}, open(sys.argv[2], 'w'))",
        "dakota": "p = {w[1]: float(w[0]) for w in map(str.split, open(sys.argv[1])) if w[1] in ('a', 'b', 'gain')}\n"
        "print(repr(p['b'] * p['gain']), 'omega_n\\n', repr(p['a']), 'zeta', file=open(sys.argv[2], 'w'))",
    }[form]
    script(tmp_path, f"#!{sys.executable} -SE\nimport sys\n{body}\n")
    model = responses(tmp_path, ("./fly", *PLACES), format=form, fixed=(("gain", 3.0),))
    points = np.array([[1.0 / 3.0, 0.1 + 0.2], [-np.pi * 1e-300, 1e300]])
    answer = model.evaluate(points)
    assert answer.values.tolist() == (points * [1.0, 3.0]).tolist()
    assert model.judged == ("dynamic_stability",)
    assert answer.levels[0, 0] == Level.LEVEL_2
    assert answer.messages == ("", "")


NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9_/-]{0,20}", fullmatch=True)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)


@given(st.dictionaries(NAMES, NUMBERS, min_size=1, max_size=6))
@settings(max_examples=40, derandomize=True)
def test_parameters_are_what_dakota_writes(tmp_path_factory, parameters):
    """The package's reader of Dakota's files, itself tested on files that Dakota wrote, finds every number to the last bit."""
    path = tmp_path_factory.getbasetemp() / "parameters.in"
    path.write_text(dakota_parameters(parameters, ["zeta", "omega_n"]), encoding="utf-8")
    (found,) = read_parameters(path)
    assert found.variables == parameters
    assert found.active == {"zeta": 1, "omega_n": 1}


@pytest.mark.parametrize(
    "text", ["0.25 zeta\n4.5 omega_n\n", "  4.5 omega_n\n\n 2.5e-1 zeta\n", "0.25\n4.5\n", "+.25 zeta\n4.5 omega_n\n1 extra\n"]
)
def test_results_of_dakota(text):
    found = dakota_results(text, ["zeta", "omega_n"])
    assert (found["zeta"], found["omega_n"]) == (0.25, 4.5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("FAIL\n", "declares a failure: FAIL"),
        ("failed to trim\n0.2 zeta\n", "declares a failure: failed to trim"),
        ("0.2\n", "1 values without descriptors, and 2"),
        ("0.2 zeta\n4.5\n", "some values have a descriptor"),
        ("0.2 zeta\n4.5 zeta\n", "a descriptor stands twice"),
        ("zeta 0.2\n", "0.2 is 'zeta'"),
        ("0.2 zeta 4.5 omega_n\n", "stands where a value and its descriptor"),
        ("0.2 zeta\n[ 1 2 ]\n", "stands where a value and its descriptor"),
        ("0,2 zeta\n1 omega_n\n", "zeta is '0,2'"),
    ],
)
def test_results_that_are_none_of_dakotas(text, words):
    with pytest.raises(ModelFailure, match=re.escape(words)) as caught:
        dakota_results(text, ["zeta", "omega_n"])
    assert caught.value.status is Status.MODEL_FAILED


def test_an_empty_file_of_results_lacks_every_response(tmp_path):
    answer = shell(tmp_path, ': > "$2"', format="dakota").evaluate(POINTS[:1])
    assert answer.status.tolist() == [[Status.OUTPUT_MISSING] * 2]


@pytest.mark.parametrize(
    ("body", "status", "words"),
    [
        ("echo what went wrong >&2; exit 3", Status.MODEL_FAILED, "what went wrong\nthe command ended with exit status 3"),
        ("kill -SEGV $$", Status.CRASHED, "the command was ended by SIGSEGV"),
        ("exit 139", Status.MODEL_FAILED, "exit status 139 (how a shell reports SIGSEGV)"),
        ("true", Status.OUTPUT_MISSING, "the command left no file results.out"),
        ("echo '{' > $2", Status.MODEL_FAILED, "the results cannot be read: it is no JSON"),
        ("echo '[1]' > $2", Status.MODEL_FAILED, "it is a list of JSON"),
        ("echo '{\"zeta\": 1}' > $2", Status.MODEL_FAILED, 'it holds no "responses"'),
        ("printf '\\377\\376' > $2", Status.MODEL_FAILED, "results.out is no UTF-8 text"),
        ("mkdir $2", Status.MODEL_FAILED, "results.out: Is a directory"),
        ("head -c 100000 /dev/zero | tr '\\0' '[' > $2", Status.MODEL_FAILED, "it is no JSON"),
        ('echo \'{"responses": {"zeta": "high", "omega_n": 1}}\' > $2', Status.MODEL_FAILED, "zeta is 'high'"),
        ('echo \'{"responses": {"zeta": null, "omega_n": 1}}\' > $2', Status.MODEL_FAILED, "response zeta is None"),
    ],
)
def test_every_failure_is_data_with_words(tmp_path, body, status, words):
    answer = shell(tmp_path, body).evaluate(POINTS[:1])
    assert answer.status.tolist() == [[status] * 2]
    assert np.isnan(answer.values).all()
    assert answer.levels.tolist() == [[Level.UNDEFINED]]
    assert words in answer.messages[0]


def test_a_response_may_be_missing_or_not_finite_alone(tmp_path):
    model = shell(tmp_path, 'echo \'{"responses": {"zeta": "nan"}}\' > "$2"')
    assert model.evaluate(POINTS[:1]).status.tolist() == [[Status.OUTPUT_NOT_FINITE, Status.OUTPUT_MISSING]]


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and waits for its parent does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def ended(pid: int) -> bool:
    """Whether a process ends within a few seconds."""
    until = time.monotonic() + 5.0
    while alive(pid) and time.monotonic() < until:
        time.sleep(0.01)
    return not alive(pid)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="what survives a killed starter is Linux's to say")
def test_the_command_ends_with_a_killed_starter(tmp_path):
    started = tmp_path / "started"
    model = shell(tmp_path, f"sleep 60 & echo $! $$ > {started}.part; mv {started}.part {started}; wait")
    (tmp_path / "model").write_bytes(pickle.dumps(model))
    program = "import pickle, sys; pickle.load(open(sys.argv[1], 'rb')).evaluate([[1.0, 2.0]])"
    own = {**os.environ, "TMPDIR": str(tmp_path)}
    starter = subprocess.Popen([sys.executable, "-c", program, str(tmp_path / "model")], env=own)
    try:
        until = time.monotonic() + 60.0
        while not started.exists() and time.monotonic() < until:
            time.sleep(0.02)
    finally:
        starter.kill()
        starter.wait()
    assert [ended(int(pid)) for pid in started.read_text().split()] == [True, True]


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="the fate of processes is read in /proc")
@pytest.mark.parametrize(("body", "status"), [("sleep 60", Status.TIMED_OUT), (ANSWER, Status.OK)])
def test_nothing_that_the_command_started_lives_on(tmp_path, body, status):
    """A child in the background is ended with the command, whether that hangs or has answered."""
    children = tmp_path / "children"
    model = shell(tmp_path, f"sleep 60 & echo $! > {children}\n{body}", time_limit=0.4)
    answer = model.evaluate(POINTS[:1])
    assert (answer.status == status).all()
    assert ended(int(children.read_text()))
    if status is Status.TIMED_OUT:
        assert answer.messages[0] == "the command did not end within 0.4 s"


def test_arguments_reach_the_program_as_they_are(tmp_path):
    canary = tmp_path / "canary"
    hostile = (
        f"; touch {canary}",
        f"$(touch {canary})",
        f"`touch {canary}`",
        f"| touch {canary}",
        "a b",
        "*",
        "",
        "{other}",
        "x={results}",
    )
    script(tmp_path, f"#!{sys.executable} -SE\nimport sys, json\njson.dump(sys.argv[1:], open({str(tmp_path / 'got')!r}, 'w'))\n")
    answer = responses(tmp_path, ("./fly", *hostile, "{parameters}")).evaluate(POINTS[:1])
    got = json.loads((tmp_path / "got").read_text())
    assert got[:-2] == list(hostile[:-1])
    assert got[-2].startswith("x=/")
    assert got[-2].endswith("/results.out")
    assert answer.status.tolist() == [[Status.OUTPUT_MISSING] * 2]
    assert not canary.exists()


def test_each_evaluation_has_a_directory_of_its_own(tmp_path):
    template = tmp_path / "template"
    (template / "tables").mkdir(parents=True)
    (template / "tables" / "gain").write_text("0.4")
    (template / "link").symlink_to("tables/gain")
    log = tmp_path / "log"
    body = f'pwd >> {log}; g=$(cat link); echo 9 > link; echo 9 > new; echo "$g zeta" > $2; echo "1 omega_n" >> $2'
    answer = shell(tmp_path, body, format="dakota", folder=template).evaluate(POINTS)
    assert answer.values[:, 0].tolist() == [0.4, 0.4]
    assert (template / "tables" / "gain").read_text() == "0.4"
    assert not (template / "new").exists()
    first, second = log.read_text().split()
    assert first != second
    assert not Path(first).parent.exists()


@pytest.mark.parametrize("target", ["../secret", "/etc/hostname", "tables/../../secret"])
def test_links_that_lead_out_of_the_template_are_refused(tmp_path, target):
    template = tmp_path / "template"
    template.mkdir()
    (tmp_path / "secret").write_text("x")
    (template / "link").symlink_to(target)
    with pytest.raises(InputError, match=r"model\.folder: .*link is a link to"):
        shell(tmp_path, ANSWER, folder=template)


@pytest.mark.parametrize("linked", [False, True])
def test_results_that_lie_in_the_template_are_no_answer(tmp_path, linked):
    """Of a command that ends well and writes nothing; what a link of those names leads to is not overwritten either."""
    template = tmp_path / "template"
    template.mkdir()
    (template / "old").write_text('{"responses": {"zeta": 1.234, "omega_n": 5}}')
    for name in ("results.out", "parameters.in", "output.txt"):
        (template / name).symlink_to("old") if linked else shutil.copy(template / "old", template / name)
    answer = shell(tmp_path, "exit 0", folder=template).evaluate(POINTS[:1])
    assert (answer.status == Status.OUTPUT_MISSING).all()
    assert answer.messages[0].endswith("the command left no file results.out")
    answer = shell(tmp_path, 'echo said; cat old > "$2"', folder=template).evaluate(POINTS[:1])
    assert answer.values.tolist() == [[1.234, 5.0]]


def test_a_program_is_told_what_is_commanded_and_nothing_else(tmp_path):
    """No trim speed: it is no number of this model's study."""
    told = json.loads(json_parameters("key", {}, QUICK.manoeuvre, INPUTS[0]))["manoeuvre"]
    assert sorted(told) == ["amplitude", "command", "dt", "duration", "on", "shape"]


def test_directories_of_failures_are_kept_beside_each_other(tmp_path):
    out = tmp_path / "results"
    model = shell(tmp_path, "echo said; exit 1", keep_in=out)
    messages = [model.evaluate(POINTS[:1]).messages[0] for _ in range(2)]
    kept = sorted((out / "failed").iterdir())
    assert [each.name for each in kept] == [kept[0].name, f"{kept[0].name}-2"]
    assert [f"[kept in {each}]" in message for each, message in zip(kept, messages, strict=True)] == [True, True]
    assert json.loads((kept[0] / "parameters.in").read_text())["parameters"] == {"a": 0.2, "b": 5.0}
    assert (kept[0] / "output.txt").read_text() == "said\n"


@pytest.mark.parametrize(("keep", "names"), [("all", ["evaluations"]), ("failed", []), ("none", [])])
def test_directories_of_answers_are_kept_where_asked_for(tmp_path, keep, names):
    out = tmp_path / "results"
    shell(tmp_path, ANSWER, keep_in=out, keep=keep).evaluate(POINTS)
    assert [each.name for each in out.glob("*")] == names
    assert len(list(out.glob("evaluations/*"))) == 2 * len(names)


def test_messages_hold_the_end_of_long_output(tmp_path):
    answer = shell(tmp_path, "seq 1 20000; exit 1").evaluate(POINTS[:1])
    assert answer.messages[0].endswith("19999\n20000\nthe command ended with exit status 1")
    assert len(answer.messages[0]) <= 2000


def test_the_executable_must_be_there(tmp_path):
    for name, problem in (("./none", "no such file"), ("no-such-program-anywhere", "on PATH"), ("./plain", "not executable")):
        (tmp_path / "plain").write_text("")
        with pytest.raises(InputError, match=rf"model\.arguments\.1: .*{problem}"):
            responses(tmp_path, (name, *PLACES))
    assert responses(tmp_path, ("sh", *PLACES)).executable.name == "sh"


def test_names_that_a_file_cannot_hold_are_refused(tmp_path):
    script(tmp_path, "#!/bin/sh\n")
    table = command_table(("./fly", *PLACES), tmp_path, *DAMPING, format="dakota")
    for targets, fixed in ((("a b",), ()), (("a\n9.0 b",), ()), (("a",), (("mass of it", 1.0),))):
        with pytest.raises(InputError, match="holds white space"):
            CommandResponses(replace(table, fixed=fixed), targets, None, load_boundaries(), "all_other")
    flying = command_table(("./fly", *PLACES), tmp_path, inputs=(replace(INPUTS[0], name="a,b"),), outputs=OUTPUTS)
    with pytest.raises(InputError, match=r"model\.inputs\.delta_lon\.name: 'a,b'"):
        CommandHistories(flying, ("a",), None)


def test_key_follows_the_files(tmp_path):
    template = tmp_path / "template"
    template.mkdir()
    data = tmp_path / "data"

    def key(text="1", script_text=ANSWER, data_text="1"):
        (template / "gain").write_text(text)
        data.write_text(data_text)
        script(tmp_path, f"#!/bin/sh\n{script_text}\n")
        return responses(tmp_path, ("./fly", str(data), *PLACES), folder=template).key

    first = key()
    assert key() == first
    assert len({json.dumps(each) for each in (first, key("2"), key(script_text="true"), key(data_text="2"))}) == 4
    (template / "link").symlink_to("gain")
    linked = key()
    (template / "other").write_text("1")
    (template / "gain").chmod(0o755)
    executable = key()
    (template / "link").unlink()
    (template / "link").symlink_to("other")
    assert len({json.dumps(each) for each in (first, linked, executable, key())}) == 4
    assert key()["template"]["links"] == {"link": "other"}


def test_a_model_travels(tmp_path):
    model = shell(tmp_path, ANSWER)
    answer = model.evaluate(POINTS[:1])
    again = pickle.loads(pickle.dumps(model)).evaluate(POINTS[:1])  # noqa: S301
    assert again.values.tolist() == answer.values.tolist() == [[0.4, 5.0]]


FLYING = """#!{python} -SE
import csv, json, math, sys
given = json.load(open(sys.argv[1]))
rows = list(csv.reader(open(given["input"]["file"])))
assert rows[0] == ["time", "stick"] and given["input"]["means"] == "change from trim" and given["input"]["unit"] == "deg"
time, stick = zip(*(map(float, row) for row in rows[1:]))
w, z = given["parameters"]["omega_n"], given["parameters"]["zeta"]
assert max(map(abs, stick)) == abs(given["manoeuvre"]["amplitude"]) and given["manoeuvre"]["on"] == 1.0
jumps = [(t, -math.radians(b - a)) for t, a, b in zip(time[1:], stick, stick[1:]) if a != b]
s = math.sqrt(1 - z * z)
def decay(t):
    return math.exp(-z * w * t)
def theta(t):
    return 1 - decay(t) * (math.cos(w * s * t) + z / s * math.sin(w * s * t))
def q(t):
    return w / s * decay(t) * math.sin(w * s * t)
theta, q = ([sum(d * f(t - at) for at, d in jumps if t > at) for t in time] for f in (theta, q))
if z < 0.26:
    json.dump({{"time": time, "channels": {{"pitch": theta, "Q": q}}}}, open(sys.argv[2], "w"))
else:
    csv.writer(open("flight.csv", "w")).writerows([("Q", "time", "pitch"), *zip(q, time, theta)])
    json.dump({{"file": "flight.csv"}}, open(sys.argv[2], "w"))
"""
OUTPUTS = (Channel("theta", "pitch", "rad", 1.0, 1), Channel("q", "Q", "rad/s", 1.0, 1))
INPUTS = (Channel("delta_lon", "stick", "deg", np.pi / 180.0, -1),)


def histories(folder: Path, text: str, **options) -> HistoryModel:
    script(folder, text)
    table = command_table(("./fly", *PLACES), folder, inputs=INPUTS, outputs=OUTPUTS, **options)
    source = CommandHistories(table, ("omega_n", "zeta"), None)
    return HistoryModel(source, (QUICK, FREE), source.targets, (5.0, 0.25), load_boundaries())


def test_histories_in_json_and_in_a_table(tmp_path):
    """The program steps the closed form of the second order at every jump of its input."""
    model = histories(tmp_path, FLYING.format(python=sys.executable))
    points = np.array([[5.0, 0.25], [5.0, 0.3]])
    own = model.evaluate(points)
    exact = HistoryModel(SecondOrder(), model.tests, model.factors, model.nominal, model.boundaries).evaluate(points)
    assert own.messages == ("", "")
    np.testing.assert_allclose(own.values, exact.values, rtol=1e-10)
    np.testing.assert_array_equal(own.status, exact.status)


def test_dakotas_format_holds_no_histories(tmp_path):
    with pytest.raises(InputError, match=r"model\.format: is 'dakota'"):
        histories(tmp_path, "#!/bin/sh\n", format="dakota")


@pytest.mark.parametrize(
    ("text", "status", "words"),
    [
        ('{"file": "../other.csv"}', Status.OUTPUT_MISSING, "'../other.csv', which is none of the evaluation's directory"),
        ('{"file": "/etc/passwd"}', Status.OUTPUT_MISSING, "'/etc/passwd'"),
        ('{"file": "none.csv"}', Status.OUTPUT_MISSING, "'none.csv'"),
        ('{"file": 3}', Status.OUTPUT_MISSING, "'3'"),
        ('{"file": "bad.csv"}', Status.MODEL_FAILED, "bad.csv"),
        ('{"file": "short.csv"}', Status.MODEL_FAILED, "short.csv has 1 rows of numbers"),
        ('{"file": "twice.csv"}', Status.MODEL_FAILED, "must name its columns once each"),
        ('{"time": [0, 1]}', Status.MODEL_FAILED, 'neither "time" with "channels"'),
        ('{"time": [0, 1], "channels": {"q": ["a", "b"]}}', Status.MODEL_FAILED, "channel q holds something that is no number"),
        ('{"time": [0, 1], "channels": {"q": [0, true]}}', Status.MODEL_FAILED, "channel q holds something that is no number"),
        ('{"time": [0, 1], "channels": {"q": [[0], [0, 1]]}}', Status.MODEL_FAILED, "channel q holds something that is no number"),
    ],
)
def test_histories_that_cannot_be_read(tmp_path, text, status, words):
    (tmp_path / "run").mkdir()
    (tmp_path / "other.csv").write_text("time,q\n0,0\n1,0\n")
    for name, table in (("bad", "time,q\n0,0\n1\n"), ("short", "time,q\n0,0\n"), ("twice", "time,q,q\n0,0,0\n1,1,1\n")):
        (tmp_path / "run" / f"{name}.csv").write_text(table)
    with pytest.raises(ModelFailure, match=re.escape(words)) as caught:
        json_history(text, tmp_path / "run")
    assert caught.value.status is status


def test_a_table_behind_a_link_out_of_the_directory_is_not_read(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "other.csv").write_text("time,q\n0,0\n1,0\n")
    (tmp_path / "run" / "link.csv").symlink_to("../other.csv")
    with pytest.raises(ModelFailure, match="none of the evaluation's directory"):
        json_history('{"file": "link.csv"}', tmp_path / "run")


ODD = [
    '{"responses": {"zeta": 1e999}}',
    '{"responses": {"zeta": 123456789012345678901234567890}}',
    '{"file": "\\u0000"}',
    '{"time": [1e999], "channels": {"q": [{}]}}',
    "nan",
    "null",
]


@given(st.one_of(st.text(max_size=60), st.binary(max_size=60).map(lambda content: content.decode("latin-1")), st.sampled_from(ODD)))
@settings(max_examples=150, derandomize=True)
def test_any_text_is_an_answer_or_a_failure(text):
    for read in (lambda: dakota_results(text, ["a"]), lambda: json_responses(text), lambda: json_history(text, Path("/nowhere"))):
        answer = failure_of(read)
        assert isinstance(answer, dict) or answer in (Status.MODEL_FAILED, Status.OUTPUT_MISSING)


def failure_of(read):
    """What is read, or the status of a declared failure; anything else that is raised is an error of the reader."""
    try:
        return read()
    except ModelFailure as failure:
        return failure.status


def test_nothing_is_left_in_the_temporary_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    os.mkdir(tmp_path / "tmp")
    model = shell(tmp_path, "exit 1")
    model.evaluate(POINTS)
    assert list((tmp_path / "tmp").iterdir()) == []
