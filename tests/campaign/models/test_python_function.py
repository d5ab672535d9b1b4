"""Python functions as models: found by their path, called one by one or together, and failing one by one."""

from __future__ import annotations

import importlib
import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest
from simple_models import FREE, QUICK, SecondOrder, python_table

from levelone.campaign.models.importing import function_of
from levelone.campaign.models.programme import HistoryModel
from levelone.campaign.models.protocol import Evaluations
from levelone.campaign.models.python_function import PythonHistories, PythonResponses
from levelone.config.model_table import Channel
from levelone.errors import InputError
from levelone.handling.levels import Level, load_boundaries
from levelone.status import Status

DAMPING = (("zeta", "1"), ("omega_n", "rad/s"))
POINTS = np.array([[0.2, 5.0], [0.5, 4.0], [-0.5, 3.0]])


@pytest.fixture
def module(tmp_path):
    """Writes modules into a folder that is nobody's, and forgets what was imported from it."""

    def write(text: str, name: str = "own_model", folder: str = "."):
        place = tmp_path / folder
        place.mkdir(exist_ok=True)
        (place / f"{name}.py").write_text(text, encoding="utf-8")
        return place

    yield write
    for name, loaded in list(sys.modules.items()):
        if str(getattr(loaded, "__file__", None)).startswith(str(tmp_path)):
            del sys.modules[name]


def responses(folder, function="own_model:answer", named=DAMPING, **options) -> PythonResponses:
    return PythonResponses(python_table(function, folder, *named, **options), ("a", "b"), load_boundaries(), "all_other")


SINGLE = "def answer(p):\n    return {'zeta': p['a'] * p['gain'], 'omega_n': p['b']}\n"
MANY = """
import numpy as np
def answer(p):
    assert p['a'].shape == p['gain'].shape
    return {'zeta': p['a'] * p['gain'], 'omega_n': p['b']}
"""


def travelled(model: PythonResponses) -> PythonResponses:
    return pickle.loads(pickle.dumps(model))  # noqa: S301


def same(first: Evaluations, second: Evaluations) -> None:
    for name in ("values", "status", "levels"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


@pytest.mark.parametrize(("text", "vectorised"), [(SINGLE, False), (MANY, True)])
def test_responses_and_levels(module, text, vectorised):
    model = responses(module(text), fixed=(("gain", 2.0),), vectorised=vectorised)
    answer = model.evaluate(POINTS)
    assert answer.values.tolist() == [[0.4, 5.0], [1.0, 4.0], [-1.0, 3.0]]
    assert model.judged == ("dynamic_stability",)
    assert answer.levels[:, 0].tolist() == [Level.LEVEL_1, Level.LEVEL_1, Level.LEVEL_3]
    assert (answer.seconds > 0.0).all()
    same(model.evaluate(POINTS[1:2]), answer.select([1]))


def test_level_needs_all_numbers_of_a_criterion_in_its_units(module):
    folder = module(SINGLE)
    assert responses(folder, named=(("zeta", "1"),)).judged == ()
    assert responses(folder, named=(("zeta", "1"), ("omega_n", "Hz"))).judged == ()
    assert responses(folder, named=(("omega_bw", "rad/s"), ("tau_p", "s"))).judged == ()
    assert replace(responses(folder), boundaries=load_boundaries("ads33-roll")).judged == ()
    every = (
        ("quickness", "1/s"),
        ("delta_theta_min", "rad"),
        ("omega_bw_attitude", "rad/s"),
        ("tau_p_attitude", "s"),
        ("rise_time", "s"),
    )
    model = responses(module("def answer(p):\n    return dict(quickness=2.0, delta_theta_min=0.2, omega_bw_attitude=0.7, "
                             "tau_p_attitude=0.1, rise_time=9.0)\n", "judged"), "judged:answer", every)  # fmt: skip
    assert model.judged == ("attitude_quickness", "bandwidth", "translational_rate")
    assert model.evaluate(POINTS[:1]).levels.tolist() == [[Level.LEVEL_1, Level.LEVEL_2, Level.LEVEL_2]]


FAILING = """
import sys
def answer(p):
    a = p["a"]
    if a < 0.0:
        raise ValueError("a is negative here")
    if a > 0.9:
        sys.exit(3)
    return {"zeta": a, "omega_n": float("nan")} if a > 0.4 else {"zeta": a}
"""


def test_every_failure_is_data_with_words(module):
    answer = responses(module(FAILING)).evaluate(np.array([[0.2, 0], [0.5, 0], [-0.5, 0], [1.0, 0]]))
    assert answer.status.tolist() == [
        [Status.OK, Status.OUTPUT_MISSING],
        [Status.OK, Status.OUTPUT_NOT_FINITE],
        [Status.MODEL_FAILED] * 2,
        [Status.MODEL_FAILED] * 2,
    ]
    assert answer.values[:2, 0].tolist() == [0.2, 0.5]
    assert np.isnan(answer.values).tolist() == [[False, True], [False, True], [True, True], [True, True]]
    assert answer.levels[:, 0].tolist() == [Level.UNDEFINED, Level.LEVEL_1, Level.UNDEFINED, Level.UNDEFINED]
    assert answer.messages[0] == "the answer lacks omega_n; it holds zeta"
    assert answer.messages[1] == ""
    assert answer.messages[2].endswith("ValueError: a is negative here")
    assert answer.messages[3].endswith("SystemExit: 3")


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        ("3.0", "a float, and a mapping"),
        ("{'zeta': 'high', 'omega_n': 1.0}", "response zeta is 'high'"),
        ("{'zeta': [1.0, 2.0], 'omega_n': 1.0}", "response zeta is [1.0, 2.0]"),
        ("{'zeta': True, 'omega_n': 1.0}", "response zeta is True"),
        ("{'zeta': 1j, 'omega_n': 1.0}", "response zeta is 1j"),
        ("{'zeta': None, 'omega_n': 1.0}", "response zeta is None"),
        ("{'zeta': __import__('numpy').complex128(0.5 + 2j), 'omega_n': 1.0}", "response zeta is np.complex128(0.5+2j)"),
        ("{'zeta': __import__('numpy').True_, 'omega_n': 1.0}", "response zeta is np.True_"),
        ("{'zeta': 10**400, 'omega_n': 1.0}", "response zeta is 1000"),
    ],
)
def test_answers_that_are_no_numbers(module, returned, words):
    answer = responses(module(f"def answer(p):\n    return {returned}\n")).evaluate(POINTS[:1])
    assert answer.status.tolist() == [[Status.MODEL_FAILED] * 2]
    assert words in answer.messages[0]


PICKY = """
import numpy as np
def answer(p):
    if (p["a"] < 0.0).any():
        raise ValueError("negative")
    return {"zeta": p["a"], "omega_n": np.where(p["b"] > 4.5, np.inf, p["b"])}
"""


def test_a_point_that_fails_does_not_take_the_others_along(module):
    model = responses(module(PICKY), vectorised=True)
    together = model.evaluate(POINTS)
    assert together.status.tolist() == [[0, Status.OUTPUT_NOT_FINITE], [0, 0], [Status.MODEL_FAILED] * 2]
    for i, point in enumerate(POINTS):
        same(model.evaluate(point), together.select([i]))


def test_a_vectorised_function_is_called_once_for_many_points(module):
    model = responses(
        module("SIZES = []\ndef answer(p):\n    SIZES.append(p['a'].size)\n    return {'zeta': p['a'], 'omega_n': p['b']}\n"),
        vectorised=True,
    )
    model.evaluate(POINTS)
    assert sys.modules["own_model"].SIZES == [3]


MASKED = """
import numpy as np
def answer(p):
    return {"zeta": np.ma.array(p["a"], mask=p["a"] < 0.0), "omega_n": p["b"]}
def turning(p):
    return {"zeta": p["a"] + 1j, "omega_n": p["b"]}
"""


def test_masked_numbers_are_not_finite_and_complex_ones_no_numbers(module):
    folder = module(MASKED)
    model = responses(folder, vectorised=True)
    answer = model.evaluate(POINTS)
    assert answer.status[:, 0].tolist() == [0, 0, Status.OUTPUT_NOT_FINITE]
    for i, point in enumerate(POINTS):
        same(model.evaluate(point), answer.select([i]))
    complex_ones = responses(folder, "own_model:turning", vectorised=True).evaluate(POINTS)
    assert (complex_ones.status == Status.MODEL_FAILED).all()
    assert "zeta is np.complex128(0.2+1j), and a number is needed" in complex_ones.messages[0]


def test_wrong_lengths_of_a_vectorised_answer(module):
    model = responses(module("def answer(p):\n    return {'zeta': 0.5, 'omega_n': p['b']}\n"), vectorised=True)
    answer = model.evaluate(POINTS)
    assert (answer.status == Status.MODEL_FAILED).all()
    assert answer.messages[0] == "response zeta has shape () for one point, and (1,) is needed"


@pytest.mark.parametrize(
    ("function", "problem"),
    [
        ("own_modle:answer", "no module 'own_modle' in .*; did you mean 'own_model'?"),
        ("own_model:anwser", "unknown name 'anwser'; did you mean 'answer'?"),
        ("own_model:NUMBER", "is a int, and a function is needed"),
        ("needy:answer", "module 'needy' needs 'no_such_package', which is not installed"),
        ("broken:answer", "module 'broken' fails on import: ZeroDivisionError"),
        ("own_model", "must be 'package.module:name'"),
        ("os.system('x'):answer", "must be 'package.module:name'"),
    ],
)
def test_functions_that_are_not_there(module, function, problem):
    folder = module("NUMBER = 3\ndef answer(p):\n    return {}\n")
    module("import no_such_package\n", "needy")
    module("1 / 0\n", "broken")
    with pytest.raises(InputError, match=problem):
        responses(folder, function).evaluate(POINTS)


def test_nothing_is_imported_before_it_is_asked_for(module, tmp_path):
    canary = tmp_path / "imported"
    folder = module(f"open({str(canary)!r}, 'w').close()\ndef answer(p):\n    return {{'zeta': 1.0, 'omega_n': 1.0}}\n")
    model = responses(folder)
    assert travelled(model).key == model.key
    assert not canary.exists()
    model.evaluate(POINTS[:1])
    assert canary.exists()


def test_the_folder_is_searched_while_importing_only(module):
    path = list(sys.path)
    folder = module("import sys\nPATH = list(sys.path)\ndef answer(p):\n    return {'zeta': 1.0, 'omega_n': 1.0}\n")
    responses(folder).evaluate(POINTS[:1])
    assert sys.path == path
    searched = sys.modules["own_model"].PATH
    assert searched == [str(folder), *path]


def test_two_folders_with_a_module_of_one_name(module):
    one = responses(module("def answer(p):\n    return {'zeta': 1.0, 'omega_n': 1.0}\n", folder="one"))
    two = responses(module("def answer(p):\n    return {'zeta': 2.0, 'omega_n': 1.0}\n", folder="two"))
    assert [each.evaluate(POINTS[:1]).values[0, 0] for each in (one, two, one)] == [1.0, 2.0, 1.0]


def test_two_folders_with_helpers_of_one_name(module):
    for folder, gain in (("one", 1.0), ("two", 2.0)):
        module(f"GAIN = {gain}\n", "helper", folder)
        module("import helper\ndef answer(p):\n    return {'zeta': helper.GAIN, 'omega_n': 1.0}\n", folder=folder)
    models = [responses(module("", "unused", folder)) for folder in ("one", "two", "one")]
    assert [each.evaluate(POINTS[:1]).values[0, 0] for each in models] == [1.0, 2.0, 1.0]


def test_a_helper_left_by_another_study_is_not_taken(module):
    module("GAIN = 1.0\n", "left_helper", "one")
    one = module("import left_helper\ndef answer(p):\n    return {'zeta': left_helper.GAIN, 'omega_n': 1.0}\n", folder="one")
    two = module("import left_helper\ndef answer(p):\n    return {'zeta': left_helper.GAIN, 'omega_n': 1.0}\n", folder="two")
    assert responses(one).evaluate(POINTS[:1]).values[0, 0] == 1.0
    with pytest.raises(InputError, match="needs 'left_helper', which is not installed"):
        responses(two).evaluate(POINTS[:1])


@pytest.mark.parametrize("edited", ["own_model", "helper", "own_package.part"])
def test_edited_code_answers_under_its_new_key(module, edited):
    """The sources keep their length and, most likely, their second: bytecode of before the edit must not be found either."""
    texts = {
        "own_model": "def answer(p):\n    import helper, own_package.part\n    return "
        "{{'zeta': {} * helper.GAIN * own_package.part.GAIN, 'omega_n': 1.0}}\n",
        "helper": "GAIN = {}\n",
        "own_package.part": "GAIN = {}\n",
    }

    def written(name: str, gain: float):
        package, _, part = name.rpartition(".")
        return module(texts[name].format(gain), part, package or ".")

    folder = [written(name, 1.0) for name in ("own_package.part", "helper", "own_model")][-1]
    module("import helper, own_package.part\n" + (folder / "own_model.py").read_text(), "own_model")
    before = responses(folder)
    assert before.evaluate(POINTS[:1]).values[0, 0] == 1.0
    loaded = sys.modules["own_model"]
    assert responses(folder).function.__globals__ is vars(loaded)  # unchanged code is not imported again
    key = before.key
    text = (folder / f"{edited.replace('.', '/')}.py").read_text().replace("1.0 *", "3.0 *").replace("GAIN = 1.0", "GAIN = 3.0")
    (folder / f"{edited.replace('.', '/')}.py").write_text(text)
    after = responses(folder)
    assert after.key != key
    assert after.evaluate(POINTS[:1]).values[0, 0] == 3.0


def test_an_edited_module_on_the_path_is_imported_anew(module, monkeypatch):
    monkeypatch.syspath_prepend(str(module("def answer(p):\n    return {'zeta': 1.0, 'omega_n': 1.0}\n", "on_path")))
    assert responses(None, "on_path:answer").evaluate(POINTS[:1]).values[0, 0] == 1.0
    module("def answer(p):\n    return {'zeta': 22.0, 'omega_n': 1.0}\n", "on_path")
    assert responses(None, "on_path:answer").evaluate(POINTS[:1]).values[0, 0] == 22.0


def test_a_module_that_the_user_imported_before_an_edit_is_imported_anew(module, monkeypatch):
    folder = module("def answer(p):\n    return {'zeta': 1.0, 'omega_n': 1.0}\n", "by_hand")
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    importlib.import_module("by_hand")
    module("def answer(p):\n    return {'zeta': 2.0, 'omega_n': 1.0}\n", "by_hand")
    assert responses(folder, "by_hand:answer").evaluate(POINTS[:1]).values[0, 0] == 2.0


def test_key_follows_the_code(module):
    folder = module(SINGLE)
    module("GAIN = 1.0\n", "helper")
    before = responses(folder).key
    again = responses(folder).key
    assert again == before
    module("GAIN = 2.0\n", "helper")
    assert responses(folder).key != before
    assert responses(None, "levelone.status:Status").key["code"] != before["code"]


def test_a_model_travels_before_and_after_use(module):
    model = responses(module(SINGLE), fixed=(("gain", 1.0),))
    first = model.evaluate(POINTS)
    assert "function" not in vars(travelled(model))
    same(travelled(model).evaluate(POINTS), first)


FLYING = """
import sys
sys.path.append({tests!r})
import numpy as np
from simple_models import attitude
def fly(p, manoeuvre):
    time = manoeuvre.ticks()
    theta, q = attitude(p["omega_n"], p["zeta"], time, -np.deg2rad(manoeuvre.command(time)))
    return {{"time": time, "pitch_deg": np.rad2deg(theta), "Q": -q}}
"""
OUTPUTS = (Channel("theta", "pitch_deg", "deg", np.pi / 180.0, 1), Channel("q", "Q", "rad/s", 1.0, -1))
INPUTS = (Channel("delta_lon", "stick", "deg", np.pi / 180.0, -1),)


def flying(folder, outputs=OUTPUTS, inputs=INPUTS, text=None) -> HistoryModel:
    source = PythonHistories(python_table("own_model:fly", folder, inputs=inputs, outputs=outputs), ("omega_n", "zeta"))
    return HistoryModel(source, (QUICK, FREE), source.targets, (5.0, 0.3), load_boundaries())


def test_histories_in_the_functions_own_units_and_signs(module):
    """The function counts its stick in degrees, positive forward, its pitch in degrees and its rate positive nose down."""
    folder = module(FLYING.format(tests=str(__file__).rpartition("/")[0]))
    point = np.array([[6.0, 0.25]])
    own = flying(folder).evaluate(point)
    exact = HistoryModel(SecondOrder(), (QUICK, FREE), ("omega_n", "zeta"), (5.0, 0.3), load_boundaries()).evaluate(point)
    np.testing.assert_allclose(own.values, exact.values, rtol=1e-12)
    np.testing.assert_array_equal(own.status, exact.status)


@pytest.mark.parametrize(
    ("returned", "status", "words"),
    [
        ("{'time': t, 'pitch_deg': t}", Status.OUTPUT_MISSING, "returned no 'Q'; it returned time, pitch_deg"),
        ("{'pitch_deg': t, 'Q': t}", Status.OUTPUT_MISSING, "returned no 'time'"),
        ("{'time': t, 'pitch_deg': t, 'Q': ['a'] * t.size}", Status.MODEL_FAILED, "channel Q holds something that is no number"),
        ("{'time': t, 'pitch_deg': t, 'Q': t + 0j}", Status.MODEL_FAILED, "channel Q holds something that is no number"),
        ("{'time': t, 'pitch_deg': t, 'Q': t > 1.0}", Status.MODEL_FAILED, "channel Q holds something that is no number"),
        ("{'time': t + 0j, 'pitch_deg': t, 'Q': t}", Status.MODEL_FAILED, "channel time holds something that is no number"),
        ("{'time': t, 'pitch_deg': t, 'Q': t[:-1]}", Status.MODEL_FAILED, "channel q has"),
        ("{'time': t + 2.0, 'pitch_deg': t, 'Q': t}", Status.MODEL_FAILED, "must increase from before the input at 1 s"),
        ("t", Status.MODEL_FAILED, "a ndarray, and a mapping"),
    ],
)
def test_records_that_are_none(module, returned, status, words):
    answer = flying(module(f"def fly(p, m):\n    t = m.ticks()\n    return {returned}\n")).evaluate(np.array([[6.0, 0.3]]))
    assert (answer.status == status).all()
    assert words in answer.messages[0]


def test_a_function_cannot_be_told_an_absolute_input(module):
    with pytest.raises(InputError, match=r"model\.inputs\.delta_lon\.trim: is 0\.5"):
        flying(module(SINGLE), inputs=(Channel("delta_lon", "stick", "1", 1.0, 1, 0.5),))


def test_a_module_left_by_another_study_is_not_taken(tmp_path):
    """Its folder is no longer searched: the second study has no such module, and must not answer with the first one's numbers."""
    first, second = tmp_path / "first", tmp_path / "second"
    for folder in (first, second):
        folder.mkdir()
    (first / "left_over.py").write_text("def answer(point):\n    return {'y': 1.0}\n")
    assert function_of("left_over:answer", first)({}) == {"y": 1.0}
    for folder in (second, None):
        with pytest.raises(InputError, match="no module 'left_over'"):
            function_of("left_over:answer", folder)
