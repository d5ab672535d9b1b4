"""One study through every kind of model: the same quickness, damping and bandwidth, whoever flies.

The aircraft is that of ``linear_fixtures.reference_system``, a speed loop around a pitch loop with a pair of poles at 5.61 rad/s.
Its input is held from sample to sample in every kind, so that matrix exponentials are exact at the samples: the state-space file,
the Python function and the command differ by rounding, and by what a criterion makes of it. Co-simulation and model exchange
integrate by steps of their own, whose tolerance is stated where they are compared.
"""

from __future__ import annotations

import stat
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import fmu_building
import numpy as np
import pytest
from linear_fixtures import RATE_GAIN, reference_system, write_builtin, write_reference
from simple_models import command_table, python_table

from levelone.campaign.models.built_in_source import BuiltInSource
from levelone.campaign.models.command import CommandHistories, CommandResponses
from levelone.campaign.models.fmu import FmuSource
from levelone.campaign.models.programme import HistoryModel
from levelone.campaign.models.protocol import Evaluations, HistorySource
from levelone.campaign.models.python_function import PythonHistories
from levelone.campaign.models.state_space import StateSpaceSource
from levelone.config.model_table import BuiltInTable, Channel, StateSpaceTable, Test
from levelone.config.vehicle_file import load_vehicle, vehicle_path
from levelone.handling.levels import load_boundaries
from levelone.handling.manoeuvres import pulse, step, sweep
from levelone.status import Status

SPEED = {"trim_speed": 0.0, "dt": 0.008, "controller_rate": 125.0}
RESPONSE = {"output": "q", "response_type": "attitude_command", "windows": (24.0, 12.0)}
SWEEP = sweep("V_lon", 0.5, length=50.0, omega_min=0.5, omega_max=20.0, **SPEED)
TESTS = (
    Test("quick", "attitude_quickness", "pitch", step("V_lon", 1.0, **SPEED)),
    Test("free", "dynamic_stability", "pitch", pulse("V_lon", 0.7, **SPEED)),
    Test("swept", "bandwidth", "pitch", SWEEP, method="sweep", **RESPONSE),
)
INPUTS = (Channel("V_lon", "V_ref", "m/s", 1.0, 1),)
OUTPUTS = tuple(Channel(name, name, unit, 1.0, 1) for name, unit in (("theta", "rad"), ("q", "rad/s"), ("V_lon", "m/s")))
#: what exact models may differ by: rounding over 7000 samples, and what interpolation between samples makes of it
ROUNDING = 1e-10
#: the factor: on the feedback of the pitch rate, nominal and one other
POINTS = np.array([[1.0], [1.1]])

FLYING = """
import numpy as np
A0, A1, B, C = (np.array(each) for each in ({a0!r}, {a1!r}, {b!r}, {c!r}))

def held(A, B, dt):
    '''Exact matrices of one sample with the input held: the joint exponential, by Taylor's series and squaring.'''
    n = len(A)
    joint = np.zeros((n + 1, n + 1))
    joint[:n, :n], joint[:n, n:] = A * dt, B * dt
    part = joint / 2.0**10
    term = total = np.eye(n + 1)
    for k in range(1, 16):
        term = term @ part / k
        total = total + term
    for _ in range(10):
        total = total @ total
    return total[:n, :n], total[:n, n]

def respond(gain, time, command):
    F, G = held(A0 + gain * A1, B, time[1] - time[0])
    x, found = np.zeros(len(F)), []
    for u in command:
        found.append(x)
        x = F @ x + G * u
    return dict(zip(("theta", "q", "V_lon"), C @ np.array(found).T))

def fly(parameters, manoeuvre):
    time = manoeuvre.ticks()
    return {{"time": time, **respond(parameters["rate_gain"], time, manoeuvre.command(time))}}
"""
JSON = """#!{python} -E
import json, os, sys
sys.path.insert(0, {folder!r})
import numpy as np
from flying import respond
given = json.load(open(sys.argv[1]))
time, command = np.loadtxt(given["input"]["file"], delimiter=",", skiprows=1).T
found = respond(given["parameters"]["rate_gain"], time, command)
table, names = np.column_stack([time, *found.values()]), ",".join(("time", *found))
np.savetxt("flight.csv", table, fmt="%.17g", delimiter=",", header=names, comments="")
json.dump({{"file": "flight.csv"}}, open(sys.argv[2], "w"))
"""
DAKOTA = """#!{python} -E
import sys
sys.path.insert(0, {folder!r})
from flying import fly
from levelone.handling.damping import dynamic_stability
from levelone.handling.manoeuvres import pulse, step
from levelone.handling.quickness import attitude_quickness
from levelone.handling.records import record
gain = next(float(w[0]) for w in map(str.split, open(sys.argv[1])) if w[1:] == ["rate_gain"])
def flown(manoeuvre):
    channels = fly({{"rate_gain": gain}}, manoeuvre)
    time = channels.pop("time")
    times = {{"input_on": manoeuvre.on, "input_off": manoeuvre.off if manoeuvre.off < 1e9 else float("nan")}}
    return record(time, {{**channels, "command": manoeuvre.command(time)}}, input_name="command", **times)
speed = {{"trim_speed": 0.0, "dt": 0.008, "controller_rate": 125.0}}
quick = attitude_quickness(flown(step("V_lon", 1.0, **speed)))
free = dynamic_stability(flown(pulse("V_lon", 0.7, **speed)))
with open(sys.argv[2], "w") as results:
    for name, value in (("omega_n", free.omega_n), ("quickness", quick.quickness), ("zeta", free.zeta)):
        print(repr(float(value[0])), name, file=results)
"""


@pytest.fixture(scope="module", autouse=True)
def _cleaned() -> Iterator[None]:
    with fmu_building.cleaned():
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The same aircraft as a module, two programs and a file of matrices."""
    place = tmp_path_factory.mktemp("same")
    a0 = reference_system(0.0)[0]
    a1 = reference_system(1.0)[0] - a0
    _, b, c, _, _ = reference_system()
    matrices = {"a0": a0.tolist(), "a1": a1.tolist(), "b": b.tolist(), "c": c.tolist()}
    (place / "flying.py").write_text(FLYING.format(**matrices))
    for name, text in (("json", JSON), ("dakota", DAKOTA)):
        (place / name).write_text(text.format(python=sys.executable, folder=str(place)))
        (place / name).chmod(stat.S_IRWXU)
    write_reference(place / "pitch.toml")
    return place


def studied(source: HistorySource, points: np.ndarray = POINTS, tests: tuple[Test, ...] = TESTS) -> Evaluations:
    """The study: every response is read but the gain bandwidth, as the gain of q / V_lon lies below where it would be read."""
    model = HistoryModel(source, tests, source.targets, tuple(points[0].tolist()), load_boundaries())
    answer = model.evaluate(points)
    assert {Status(code) for code in np.unique(answer.status)} <= {Status.OK, Status.PIO_CAUTION, Status.NO_GAIN_CROSSING}
    assert np.isnan(answer.values).sum() == len(points)
    return answer


@pytest.fixture(scope="module")
def exact(folder: Path) -> Evaluations:
    """The study on the file of matrices, whose parameter is the entry that the factor scales."""
    table = StateSpaceTable("state-space", (), INPUTS, OUTPUTS, folder / "pitch.toml")
    return studied(StateSpaceSource(table, ("A_mq",)), RATE_GAIN * POINTS)


def agree(answer: Evaluations, exact: Evaluations, tolerance: float) -> None:
    np.testing.assert_array_equal(answer.status, exact.status)
    np.testing.assert_array_equal(answer.levels, exact.levels)
    np.testing.assert_allclose(answer.values, exact.values, rtol=tolerance)


def test_a_python_function(folder: Path, exact: Evaluations) -> None:
    source = PythonHistories(python_table("flying:fly", folder, inputs=INPUTS, outputs=OUTPUTS), ("rate_gain",))
    agree(studied(source), exact, ROUNDING)


def test_a_command_with_json(folder: Path, exact: Evaluations) -> None:
    table = command_table(("./json", "{parameters}", "{results}"), folder, inputs=INPUTS, outputs=OUTPUTS)
    agree(studied(CommandHistories(table, ("rate_gain",), None), POINTS[:1]), exact.select([0]), ROUNDING)


def test_a_command_with_dakotas_files(folder: Path, exact: Evaluations) -> None:
    """The program reads the criteria itself and answers with numbers."""
    named = (("quickness", "1/s"), ("zeta", "1"), ("omega_n", "rad/s"))
    table = command_table(("./dakota", "{parameters}", "{results}"), folder, *named, format="dakota")
    answer = CommandResponses(table, ("rate_gain",), None, load_boundaries(), "all_other").evaluate(POINTS[1:])
    assert answer.messages == ("",)
    np.testing.assert_allclose(answer.values[0], exact.values[1, [0, 3, 4]], rtol=ROUNDING)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_co_simulation(version: str, exact: Evaluations) -> None:
    """The units step by the classical Runge-Kutta method at 1 ms: at the fastest pole, -16 1/s, the relative error of a decay over
    a step is (0.016)^5 / 120, 1e-11, and of all that decays before it is seen, some 60 steps of it."""
    source = FmuSource(fmu_building.table(fmu_building.built(version)), ("rate_gain",))
    agree(studied(source), exact, 1e-8)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_model_exchange(version: str, exact: Evaluations) -> None:
    """The solver's relative tolerance is 1e-8 a step; over a record its errors add up to ten times that at most."""
    source = FmuSource(fmu_building.table(fmu_building.built(version), "model-exchange"), ("rate_gain",))
    agree(studied(source, POINTS[:1]), exact.select([0]), 1e-7)


def test_the_built_in_vehicle_and_its_linear_model(tmp_path: Path) -> None:
    """The nonlinear loop departs from its linear model in proportion to the command: ten times less for a tenth of it."""
    path = vehicle_path("reference-evtol")
    vehicle = load_vehicle(path)
    linear = StateSpaceSource(
        StateSpaceTable("state-space", (), INPUTS, OUTPUTS, write_builtin(tmp_path / "l.toml", vehicle, 5.0)), ()
    )
    built_in = BuiltInSource(BuiltInTable("built-in", (), (), (), vehicle, path, 5.0, "velocity", "own trim"), ())
    apart = []
    for amplitude in (0.1, 0.01):
        tests = tuple(
            replace(test, manoeuvre=replace(test.manoeuvre, amplitude=amplitude, trim_speed=5.0, dt=0.004, controller_rate=250.0))
            for test in TESTS
        )
        flown, exact = (studied(source, np.zeros((1, 0)), tests).values for source in (built_in, linear))
        apart.append(np.fmax.reduce(np.abs(flown / exact - 1.0), axis=0))
    assert np.fmax.reduce(apart[1]) < 3e-4
    np.testing.assert_allclose(apart[0][:7] / apart[1][:7], 10.0, rtol=0.1)
