"""FMUs that are flown: against the exact solution of the linear system inside, with events, and where they misbehave."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_building import (
    DISCARDS,
    ENDS,
    FAILS,
    NOT_A_NUMBER,
    PRINTS,
    archive,
    built,
    cleaned,
    description,
    matrices,
    table,
)
from scipy.linalg import expm
from scipy.signal import cont2discrete

from levelone.campaign.models.fmu import FmuSource
from levelone.campaign.models.fmu_archive import described
from levelone.campaign.models.fmu_variables import check_start_units, check_variables
from levelone.campaign.models.protocol import ModelFailure
from levelone.config.model_table import Channel
from levelone.errors import InputError
from levelone.handling.manoeuvres import Manoeuvre, pulse, step
from levelone.status import Status

pytest.importorskip("fmpy", reason="FMPy runs the FMUs: pip install levelone[fmu]")

KINDS = [(version, mode) for version in ("2.0", "3.0") for mode in ("co-simulation", "model-exchange")]
STEP = step("V_lon", 1.0, trim_speed=0.0, duration=5.0, dt=0.01, controller_rate=100.0)
PULSE = pulse("V_lon", 0.5, trim_speed=0.0, length=0.3, duration=4.0, dt=0.01, controller_rate=100.0)
NONE = np.array([])


@pytest.fixture(scope="module", autouse=True)
def _removed_at_the_end() -> Iterator[None]:
    with cleaned():
        yield


def exact(manoeuvre: Manoeuvre, rate_gain: float = 1.0) -> np.ndarray:
    """[output, time] of the linear system, the input held between samples: the exact solution by the matrix exponential."""
    a, b, c = matrices(rate_gain)
    ad, bd, *_ = cont2discrete((a, b, c, np.zeros((3, 1))), manoeuvre.dt)
    time = np.arange(round(manoeuvre.duration / manoeuvre.dt) + 1) * manoeuvre.dt
    x, rows = np.zeros(5), []
    for value in manoeuvre.command(time):
        rows.append(c @ x)
        x = ad @ x + bd[:, 0] * value
    return np.array(rows).T


@pytest.mark.theory
@pytest.mark.parametrize(("version", "mode"), KINDS)
@pytest.mark.parametrize("manoeuvre", [STEP, PULSE], ids=["step", "pulse"])
def test_a_run_is_the_exact_solution(version: str, mode: str, manoeuvre: Manoeuvre) -> None:
    source = FmuSource(table(built(version), mode), ("rate_gain",))
    for gain in (1.0, 1.3):
        record = source.fly(np.array([gain]), manoeuvre)
        truth = exact(manoeuvre, gain)
        for name, expected in zip(("theta", "q", "V_lon"), truth, strict=True):
            np.testing.assert_allclose(record.channels[name][0], expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())
    assert record.time[0] == 0.0
    assert record.time[-1] == pytest.approx(manoeuvre.duration)


@pytest.mark.parametrize(("version", "mode"), KINDS)
def test_runs_do_not_remember_each_other(version: str, mode: str) -> None:
    source = FmuSource(table(built(version), mode), ("rate_gain",))
    first = source.fly(np.array([1.0]), PULSE)
    source.fly(np.array([2.0]), STEP)
    again = pickle.loads(pickle.dumps(source)).fly(np.array([1.0]), PULSE)  # noqa: S301  # our own
    np.testing.assert_array_equal(first.channels["q"], again.channels["q"])


@pytest.mark.parametrize(("version", "mode"), KINDS)
def test_trim_settling_and_smaller_steps(version: str, mode: str) -> None:
    """From a held speed of 2 m/s, settled, the change is that from rest; the input is held over the record's interval."""
    inputs = (Channel("V_lon", "V_ref", "m/s", 1.0, 1, 2.0),)
    source = FmuSource(table(built(version), mode, inputs=inputs, settle=20.0, step=0.005), ())
    record = source.fly(NONE, step("V_lon", 1.0, trim_speed=0.0, duration=3.0, dt=0.01, controller_rate=100.0))
    assert record.trim["V_lon"][0] == pytest.approx(2.0, abs=1e-3)
    assert record.channels["V_lon_ref"][0, 0] == record.trim["V_lon"][0]
    np.testing.assert_allclose(record.change("q")[0], exact(STEP)[1][:301], rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_signs_units_and_held_inputs(version: str) -> None:
    """An input that begins at its start value, counted the other way in the model and in ft/s; an angle in degrees."""
    quiet = described(built(version), "co-simulation")
    for variable in quiet.modelVariables:
        variable.unit = None
    inputs = (Channel("V_lon", "V_ref", "ft/s", 0.3048, -1, None),)
    outputs = (Channel("theta", "theta", "deg", np.pi / 180.0, -1), Channel("V_lon", "V_lon", "m/s", 1.0, 1))
    fly = table(built(version), inputs=inputs, outputs=outputs, fixed=(("V_ref", 10.0),), settle=30.0)
    check_variables(fly, (), quiet)
    with pytest.raises(InputError, match=r"model\.inputs\.V_lon\.unit: is 'ft/s', but the FMU declares 'm/s'"):
        FmuSource(fly, ())
    source = object.__new__(FmuSource)
    object.__setattr__(source, "table", fly)
    object.__setattr__(source, "targets", ())
    record = source.fly(NONE, STEP)
    assert record.trim["V_lon"][0] == pytest.approx(10.0, abs=1e-4)
    assert record.change("V_lon")[0, -1] == pytest.approx(-exact(STEP)[2, -1] / 0.3048, rel=1e-4)
    np.testing.assert_allclose(record.change("theta")[0], np.radians(exact(STEP)[0]) / 0.3048, atol=1e-6)


@pytest.mark.theory
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_state_event_is_found_between_samples(version: str) -> None:
    """The unit notes when theta crosses a limit: against the exact solution."""
    outputs = (Channel("theta", "theta", "rad", 1.0, 1), Channel("altitude", "crossed_at", "m", 1.0, 1))
    source = FmuSource(table(built(version), "model-exchange", outputs=outputs), ("limit",))
    slower = replace(STEP, amplitude=-1.0)
    coarse = exact(slower)[0]
    limit = 0.6 * coarse.max()
    record = source.fly(np.array([limit]), slower)
    k = int(np.argmax(coarse > limit)) - 1
    a, b, c = matrices()
    whole = np.block([[a, b], [np.zeros((1, 6))]])
    x = np.append(_state(slower, k), -1.0)
    low, high = 0.0, slower.dt
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if c[0] @ (expm(whole * middle) @ x)[:5] < limit else (low, middle)
    assert record.channels["altitude"][0, -1] == pytest.approx(k * slower.dt + high, abs=1e-7)
    assert record.channels["altitude"][0, k] == -1.0
    np.testing.assert_allclose(record.channels["theta"][0], coarse, rtol=0.0, atol=1e-8 * coarse.max())


def _state(manoeuvre: Manoeuvre, sample: int) -> np.ndarray:
    a, b, c = matrices()
    ad, bd, *_ = cont2discrete((a, b, c, np.zeros((3, 1))), manoeuvre.dt)
    x = np.zeros(5)
    for value in manoeuvre.command(np.arange(sample) * manoeuvre.dt):
        x = ad @ x + bd[:, 0] * value
    return x


@pytest.mark.theory
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_time_event_changes_a_state_on_time(version: str) -> None:
    source = FmuSource(table(built(version), "model-exchange", fixed=(("kick_at", 2.0037), ("kick", 0.1))), ())
    record = source.fly(NONE, STEP)
    a, _, c = matrices()
    free = np.array([c @ expm(a * max(t - 2.0037, 0.0)) @ np.array([0.1, 0, 0, 0, 0]) for t in record.time[:350]]).T
    free[:, record.time[:350] < 2.0037] = 0.0
    np.testing.assert_allclose(record.channels["V_lon"][0, :350], (exact(STEP)[:, :350] + free)[2], rtol=0.0, atol=1e-7)


@pytest.mark.parametrize(("version", "mode"), KINDS)
def test_an_error_becomes_a_failure_with_the_units_own_words(version: str, mode: str) -> None:
    source = FmuSource(table(built(version), mode, fixed=(("mischief", FAILS), ("mischief_at", 2.0))), ())
    with pytest.raises(ModelFailure, match="the rotor came off at 2") as caught:
        source.fly(NONE, STEP)
    assert caught.value.status is Status.MODEL_FAILED


@pytest.mark.parametrize(
    ("version", "mode", "mischief", "status", "words"),
    [
        ("2.0", "co-simulation", NOT_A_NUMBER, Status.OUTPUT_NOT_FINITE, "channel theta is nan from t = 2 s on"),
        ("3.0", "co-simulation", NOT_A_NUMBER, Status.OUTPUT_NOT_FINITE, "channel theta is nan from t = 2 s on"),
        ("2.0", "co-simulation", DISCARDS, Status.MODEL_FAILED, "discarded a step"),
        ("3.0", "co-simulation", ENDS, Status.DIVERGED, "asked to end the run at its time 2"),
        ("2.0", "model-exchange", ENDS, Status.DIVERGED, "asked to end the run at its time 2"),
        ("3.0", "model-exchange", ENDS, Status.DIVERGED, "asked to end the run at its time 2"),
    ],
)
def test_other_ends_of_a_run(version: str, mode: str, mischief: int, status: Status, words: str) -> None:
    source = FmuSource(table(built(version), mode, fixed=(("mischief", mischief), ("mischief_at", 1.999))), ())
    with pytest.raises(ModelFailure, match=words) as caught:
        source.fly(NONE, STEP)
    assert caught.value.status is status


def test_an_unstable_unit_is_a_failure_and_no_number() -> None:
    source = FmuSource(table(built("2.0"), "model-exchange"), ("rate_gain",))
    with pytest.raises(ModelFailure) as caught:
        source.fly(np.array([-500.0]), STEP)
    assert caught.value.status in (Status.DIVERGED, Status.OUTPUT_NOT_FINITE)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_what_a_unit_prints_stays_out_of_the_output(version: str, capfd: pytest.CaptureFixture[str]) -> None:
    chatty = table(built(version), fixed=(("mischief", PRINTS), ("mischief_at", 0.0)))
    record = FmuSource(chatty, ()).fly(NONE, STEP)
    assert record.time.size == 501
    print("after")
    assert capfd.readouterr().out == "after\n"


def test_the_key_follows_the_content_of_the_file(tmp_path: Path) -> None:
    members = {"modelDescription.xml": description("2.0"), "binaries/linux64/pitch.so": b"one"}
    one = FmuSource(table(archive(tmp_path / "a.fmu", members)), ())
    (tmp_path / "b").mkdir()
    moved = tmp_path / "b" / "c.fmu"
    moved.write_bytes(one.table.file.read_bytes())
    same = FmuSource(table(moved), ())
    other = FmuSource(table(archive(tmp_path / "d.fmu", {**members, "binaries/linux64/pitch.so": b"two"})), ())
    assert one.key == same.key
    assert one.key != other.key
    assert one.key != FmuSource(table(one.table.file, settle=1.0), ()).key


def test_a_library_that_cannot_be_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    members = {"modelDescription.xml": description("2.0"), "binaries/linux64/pitch.so": b"no library"}
    source = FmuSource(table(archive(tmp_path / "a.fmu", members)), ())
    with pytest.raises(ModelFailure, match="Failed to load shared library"):
        source.fly(NONE, STEP)
    assert Path.cwd() == tmp_path


def _with(**options: Any) -> dict[str, Any]:
    return options


@pytest.mark.parametrize(
    ("options", "targets", "words"),
    [
        (_with(), ("rate_gian",), "factor.target: unknown name 'rate_gian'; did you mean 'rate_gain'"),
        (_with(), ("theta",), "factor.target: 'theta' .output. has no start value"),
        (_with(), ("mischief",), "only a real number can be a factor"),
        (_with(fixed=(("rate_gain", 1.0),)), ("rate_gain",), "model.fixed.rate_gain: is a factor too"),
        (_with(fixed=(("limits", 1.0),)), (), "model.fixed.limits: unknown name 'limits'; did you mean 'limit'"),
        (_with(fixed=(("mischief", 0.5),)), (), "model.fixed.mischief: is 0.5, but 'mischief' is of type Int"),
        (
            _with(inputs=(Channel("V_lon", "V_rev", "m/s", 1.0, 1),)),
            (),
            "model.inputs.V_lon.name: unknown name 'V_rev'; did you mean",
        ),
        (_with(inputs=(Channel("V_lon", "V_lon", "m/s", 1.0, 1),)), (), "model.inputs.V_lon.name: 'V_lon' is no input"),
        (_with(outputs=(Channel("q", "Q", "rad/s", 1.0, 1),)), (), "model.outputs.q.name: unknown name 'Q'"),
        (_with(outputs=(Channel("q", "mischief", "rad/s", 1.0, 1),)), (), "no single real number"),
        (_with(outputs=(Channel("q", "q", "deg/s", np.pi / 180.0, 1),)), (), "is 'deg/s', but the FMU declares 'rad/s'"),
        (_with(outputs=(Channel("theta", "q", "rad", 1.0, 1),)), (), "is 'rad', but the FMU declares 'rad/s'"),
    ],
)
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_mappings_that_do_not_fit_the_unit(
    tmp_path: Path, version: str, options: dict[str, Any], targets: tuple[str, ...], words: str
) -> None:
    place = "binaries/linux64" if version == "2.0" else "binaries/x86_64-linux"
    file = archive(tmp_path / "a.fmu", {"modelDescription.xml": description(version), f"{place}/pitch.so": b"never loaded"})
    with pytest.raises(InputError, match=words):
        FmuSource(table(file, **options), targets)


@pytest.mark.parametrize(
    ("unit", "fits"), [("rad/s", True), ("rad/second", True), ("deg/s", False), ("m/s", False), ("furlong", True)]
)
def test_units_that_are_declared_by_name_only(tmp_path: Path, unit: str, fits: bool) -> None:
    """Without base units the name is read as a unit; a name that means nothing here cannot contradict the study."""
    xml = description("2.0").replace('unit="rad/s"', f'unit="{unit}"').replace('<Unit name="rad/s">', f'<Unit name="{unit}">')
    xml = xml.replace('<BaseUnit rad="1" s="-1"/>', "").replace(
        '<Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>', "", int(unit == "m/s")
    )
    file = archive(tmp_path / "a.fmu", {"modelDescription.xml": xml, "binaries/linux64/pitch.so": b"never loaded"})
    if fits:
        assert FmuSource(table(file), ()).targets == ()
    else:
        with pytest.raises(InputError, match=f"is 'rad/s', but the FMU declares '{unit}'"):
            FmuSource(table(file, outputs=(Channel("q", "q", "rad/s", 1.0, 1),)), ())


@pytest.mark.parametrize(
    ("declared", "base", "unit", "fits"),
    [
        ("1/s", '<BaseUnit s="-1"/>', "1/s", True),
        ("1/s", '<BaseUnit s="-1"/>', "Hz", True),
        ("1/s", '<BaseUnit s="-1"/>', "rad/s", True),  # radians may be left out
        ("1/s", '<BaseUnit s="-1"/>', "deg/s", False),
        ("1/s", '<BaseUnit s="-1"/>', "m", False),
        ("deg", '<BaseUnit rad="1" factor="0.017453292519943295"/>', "rad", False),
        ("deg", '<BaseUnit rad="1" factor="0.017453292519943295"/>', "deg", True),
        ("grade", '<BaseUnit rad="1" factor="0.017453292519943295"/>', "deg", True),
        ("kN", '<BaseUnit kg="1" m="1" s="-2" factor="1000"/>', "kN", True),
        ("kN", '<BaseUnit kg="1" m="1" s="-2" factor="1000"/>', "N", False),
        ("kN", "", "N", False),
        ("V", '<BaseUnit kg="1" m="2" s="-3" A="-1"/>', "notches", True),  # unknown here: the study's word stands
        ("clicks", "", "m", True),
    ],
)
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_unit_of_a_factor_is_that_of_its_start_value(
    tmp_path: Path, version: str, declared: str, base: str, unit: str, fits: bool
) -> None:
    place = "binaries/linux64" if version == "2.0" else "binaries/x86_64-linux"
    xml = description(version).replace("<UnitDefinitions>", f'<UnitDefinitions><Unit name="{declared}">{base}</Unit>')
    head, name, tail = xml.partition('name="rate_gain"')
    xml = head + name + tail.replace("start=", f'unit="{declared}" start=', 1)
    file = archive(tmp_path / "a.fmu", {"modelDescription.xml": xml, f"{place}/pitch.so": b"never loaded"})
    found = described(file, "co-simulation")
    assert FmuSource(table(file), ("rate_gain",)).targets == ("rate_gain",)
    if fits:
        check_start_units(("rate_gain", "limit"), (unit, "m"), found)
    else:
        with pytest.raises(InputError, match=f"factor.unit: is '{unit}', but the FMU declares '{declared}' for 'rate_gain'"):
            check_start_units(("rate_gain",), (unit,), found)


def test_a_step_that_does_not_divide_the_interval() -> None:
    source = FmuSource(table(built("2.0"), step=0.003), ())
    with pytest.raises(InputError, match=r"model\.step: a sampling interval of 0\.01 s is no whole number of steps"):
        source.fly(NONE, STEP)


SLAVE = '''
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Lag(Fmi2Slave):
    """V' = (V_ref - V) / tau, exact over each step; q is the rate V'."""

    def __init__(self, **options):
        super().__init__(**options)
        self.tau, self.V_ref, self.V, self.q = 0.5, 0.0, 0.0, 0.0
        self.register_variable(Real("tau", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=0.5))
        self.register_variable(Real("V_ref", causality=Fmi2Causality.input))
        self.register_variable(Real("V", causality=Fmi2Causality.output))
        self.register_variable(Real("q", causality=Fmi2Causality.output))

    def do_step(self, time, step):
        import math

        self.V = self.V_ref + (self.V - self.V_ref) * math.exp(-step / self.tau)
        self.q = (self.V_ref - self.V) / self.tau
        return True
'''


@pytest.mark.oracle
def test_a_unit_that_another_tool_wrote(tmp_path: Path) -> None:
    builder = pytest.importorskip("pythonfmu.builder", reason="pythonfmu writes the unit: pip install pythonfmu")
    script = tmp_path / "lag.py"
    script.write_text(SLAVE)
    file = Path(builder.FmuBuilder.build_FMU(str(script), dest=str(tmp_path)))
    outputs = (Channel("V_lon", "V", "m/s", 1.0, 1), Channel("q", "q", "rad/s", 1.0, 1))
    source = FmuSource(table(file, outputs=outputs), ("tau",))
    for tau in (0.5, 0.2):
        record = source.fly(np.array([tau]), STEP)
        since = np.maximum(record.time - 1.0, 0.0)
        np.testing.assert_allclose(record.channels["V_lon"][0], 1.0 - np.exp(-since / tau), rtol=0.0, atol=1e-12)
