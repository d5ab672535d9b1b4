"""Linear models from a file: closed forms, exactness at the samples, delays inside and outside of loops, units and signs."""

from __future__ import annotations

import math
import pickle
import re
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from linear_fixtures import FloatArray, builtin_system, reference_system, write_builtin, write_reference
from scipy.optimize import brentq
from scipy.special import lambertw

from levelone import load_vehicle, simulate
from levelone.campaign.models.discrete_linear import time_response
from levelone.campaign.models.protocol import ModelFailure
from levelone.campaign.models.state_space import StateSpaceSource
from levelone.config.model_table import Channel, StateSpaceTable
from levelone.config.model_table import Test as FreeTest
from levelone.dynamics.feedback import DelayedSystem, FeedbackLaw, Plant, closed
from levelone.errors import InputError
from levelone.handling.bandwidth import bandwidth
from levelone.handling.manoeuvres import pulse, step, sweep
from levelone.status import Status

OMEGA, ZETA = 5.6, 0.36
NOMINAL = np.array([-136.0])


def plant(A: FloatArray, B: FloatArray, C: FloatArray, before: float = 0.0, after: float = 0.0) -> Plant:
    m, p = B.shape[1], len(C)
    none = np.full(m, np.nan)
    return Plant(A, B, C, np.zeros((p, m)), np.full(m, before), np.full(p, after), none, none)


def oscillator(before: float = 0.0, after: float = 0.0, zeta: float = ZETA) -> DelayedSystem:
    """y'' + 2 zeta omega y' + omega^2 y = omega^2 u."""
    A = np.array([[0.0, 1.0], [-(OMEGA**2), -2.0 * zeta * OMEGA]])
    return closed(plant(A, np.array([[0.0], [OMEGA**2]]), np.array([[1.0, 0.0]]), before, after))


def step_answer(t: FloatArray) -> FloatArray:
    """Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, section 3.3: unit step, zero before it."""
    since = np.maximum(t, 0.0)
    damped = OMEGA * math.sqrt(1.0 - ZETA**2)
    decay = np.exp(-ZETA * OMEGA * since)
    return 1.0 - decay * (np.cos(damped * since) + ZETA * OMEGA / damped * np.sin(damped * since))


@pytest.mark.theory
@pytest.mark.parametrize(("before", "after"), [(0.0, 0.0), (0.08, 0.0), (0.0, 0.12), (0.037, 0.0), (0.0, 0.0234), (0.037, 0.0611)])
@pytest.mark.parametrize("dt", [0.02, 0.07])
def test_a_step_is_exact_at_the_samples_with_whole_and_broken_delays(before: float, after: float, dt: float) -> None:
    t = dt * np.arange(60)
    on, off = 5, 17
    u = np.where((np.arange(60) >= on) & (np.arange(60) < off), 1.0, 0.0)
    expected = step_answer(t - dt * on - before - after) - step_answer(t - dt * off - before - after)
    np.testing.assert_allclose(time_response(oscillator(before, after), 0, u, dt)[0], expected, atol=2e-13)


@pytest.mark.theory
def test_what_goes_straight_through_is_late_by_both_delays() -> None:
    system = replace(oscillator(0.037, 0.0611), C=np.zeros((1, 2)), D=np.array([[2.0]]))
    t = 0.02 * np.arange(20)
    np.testing.assert_array_equal(time_response(system, 0, np.ones(20), 0.02)[0], np.where(t >= 0.0981, 2.0, 0.0))


def test_half_the_interval_changes_nothing_at_the_samples(tmp_path: Path) -> None:
    source = reference_source(tmp_path)
    coarse = source.fly(NOMINAL, pulse("V_lon", 0.7, trim_speed=0.0, dt=0.004))
    fine = source.fly(NOMINAL, pulse("V_lon", 0.7, trim_speed=0.0, dt=0.002))
    for name in ("theta", "q", "V_lon"):
        np.testing.assert_allclose(fine.channels[name][0, ::2], coarse.channels[name][0], atol=1e-13)


@pytest.mark.oracle
def test_random_systems_against_python_control() -> None:
    rng = np.random.default_rng(11)
    for _ in range(5):
        A = rng.normal(size=(5, 5)) - 4.0 * np.eye(5)
        B, C, D = rng.normal(size=(5, 2)), rng.normal(size=(3, 5)), rng.normal(size=(3, 2))
        theirs = control.ss(A, B, C, D)
        ours = closed(replace(plant(A, B, C), D=D))
        u = rng.normal(size=80)
        sampled = control.sample_system(theirs, 0.05, method="zoh")
        expected = control.forced_response(sampled, U=np.vstack([np.zeros(80), u])).outputs
        np.testing.assert_allclose(time_response(ours, 1, u, 0.05), expected, atol=1e-11)
        omega = np.geomspace(0.1, 50.0, 20)
        np.testing.assert_allclose(ours.frequency_response(1, 2, omega), theirs(1j * omega)[2, 1], rtol=1e-10)


def late_integrator(tau: float) -> DelayedSystem:
    """x' = r(t - tau) - x(t - tau)."""
    one, none = np.ones((1, 1)), np.zeros((1, 0))
    law = FeedbackLaw(-one, none, one, np.zeros((0, 1)), np.zeros((0, 1)), np.zeros((0, 1)), one)
    return closed(plant(np.zeros((1, 1)), one, one, before=tau), law)


def late_answer(t: FloatArray, tau: float) -> FloatArray:
    """Method of steps by hand for a unit step of r: the sum over k of (-1)^(k + 1) (t - k tau)^k / k! where t > k tau."""
    return sum(((-1.0) ** (k + 1) * np.maximum(t - k * tau, 0.0) ** k / math.factorial(k) for k in range(1, 40)), np.zeros_like(t))


@pytest.mark.order
def test_a_delay_inside_a_loop_is_of_fourth_order_where_it_is_whole_steps() -> None:
    tau = 0.8
    sizes = np.array([1, 2, 4, 8, 16])
    errors = []
    for size in sizes:
        dt = tau / size
        t = dt * np.arange(8 * size)
        errors.append(np.abs(time_response(late_integrator(tau), 1, np.ones(len(t)), dt)[0] - late_answer(t, tau)).max())
    slope = np.polyfit(np.log(tau / sizes), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.2)


@pytest.mark.theory
@pytest.mark.parametrize("tau", [0.03, 0.0473, 0.1111])
def test_a_broken_delay_inside_a_loop_is_close(tau: float) -> None:
    t = 0.004 * np.arange(500)
    found = time_response(late_integrator(tau), 1, np.ones(len(t)), 0.004)[0]
    np.testing.assert_allclose(found, late_answer(t, tau), atol=2e-8)


@pytest.mark.theory
def test_what_a_late_law_sends_straight_to_an_output() -> None:
    """y = 3 x' of the late integrator: the derivative of its answer."""
    tau, dt = 0.4, 0.02
    system = late_integrator(tau)
    system = replace(system, C=np.zeros((1, 1)), D_y=np.array([[3.0]]))
    t = dt * np.arange(150)
    since = [np.maximum(t - k * tau, 0.0) for k in range(20)]
    parts = [(-1.0) ** (k + 1) * since[k] ** (k - 1) / math.factorial(k - 1) * (t > k * tau - 1e-9) for k in range(1, 20)]
    np.testing.assert_allclose(time_response(system, 1, np.ones(150), dt)[0], 3.0 * np.sum(parts, axis=0), atol=1e-8)
    s = 1j * np.array([0.3, 1.0, 4.0])
    expected = 3.0 * s / (1.0 + s * np.exp(tau * s))
    np.testing.assert_allclose(system.frequency_response(1, 0, s.imag), expected, rtol=1e-12)


@pytest.mark.theory
@pytest.mark.parametrize("after", [0.0, 0.013, 0.02, 0.031])
@pytest.mark.parametrize("tau", [0.4, 0.411])
def test_jumps_through_a_late_law_reach_a_late_output_at_their_own_time(tau: float, after: float) -> None:
    """y = 3 x' of the late integrator, read later: the jump of r passes straight through, between two samples or on one."""
    dt = 0.02
    one, zero = np.ones((1, 1)), np.zeros((1, 1))
    system = replace(late_integrator(tau), C=zero, D_y=3.0 * one, output_delay=np.array([after]))
    t = dt * np.arange(150) - after
    since = [np.maximum(t - k * tau, 0.0) for k in range(20)]
    parts = [(-1.0) ** (k + 1) * since[k] ** (k - 1) / math.factorial(k - 1) * (t > k * tau - 1e-9) for k in range(1, 20)]
    np.testing.assert_allclose(time_response(system, 1, np.ones(150), dt)[0], 3.0 * np.sum(parts, axis=0), atol=2e-4)
    u = np.random.default_rng(5).standard_normal(150)
    fine = time_response(system, 1, np.repeat(u, 32), dt / 32)[:, ::32]
    np.testing.assert_allclose(time_response(system, 1, u, dt), fine, atol=1e-4 * np.abs(fine).max())


def test_a_delay_too_short_to_step_through_is_refused() -> None:
    with pytest.raises(InputError, match=r"delay: of 1e-06 s inside the loop"):
        time_response(late_integrator(1e-6), 1, np.ones(10), 0.004)


@pytest.mark.theory
def test_poles_of_a_late_integrator_are_those_of_lambert() -> None:
    """s = W_k(-tau) / tau (Corless et al., Advances in Computational Mathematics 5, 1996); unstable beyond tau = pi / 2."""
    for tau in (0.5, 1.4, 1.7):
        poles = late_integrator(tau).poles()
        assert np.abs(poles - lambertw(-tau, 0) / tau).min() < 1e-9
        assert (poles[0].real > 0.0) == (tau > math.pi / 2)


@pytest.mark.theory
def test_records_and_responses_of_a_late_loop_agree() -> None:
    """The transform of the answer to one held sample is the response times that of the sample, up to aliasing."""
    A, B, C, _, _ = reference_system()
    law = FeedbackLaw(
        np.array([[0.0, -0.2, 0.0, 0.0, 0.0]]), np.array([[0.3]]), np.array([[0.4]]),
        np.array([[-1.0, 0.0, 0.0, 0.0, 0.0]]), np.zeros((1, 1)), -np.ones((1, 1)), np.ones((1, 1)), 0.013,
    )  # fmt: skip
    acted = replace(plant(A, B, C, before=0.021, after=0.0057), omega=np.array([25.0]), zeta=np.array([0.7]))
    system = closed(acted, law)
    dt, omega = 0.01, np.array([0.5, 2.0, 5.0, 12.0])
    u = np.zeros(6000)
    u[3] = 1.0
    for column in (0, 1):
        y = time_response(system, column, u, dt)
        t = dt * np.arange(len(u))
        held = np.exp(-1j * omega * 3 * dt) * (1.0 - np.exp(-1j * omega * dt)) / (1j * omega)
        for row in range(3):
            measured = dt * (y[row] * np.exp(-1j * omega[:, None] * t)).sum(axis=1) / held
            np.testing.assert_allclose(measured, system.frequency_response(column, row, omega), rtol=2e-4)


@pytest.mark.theory
def test_pure_delay_is_the_shortest_way_through() -> None:
    assert late_integrator(0.3).transport(1, 0) == 0.3
    assert oscillator(0.037, 0.0611).transport(0, 0) == pytest.approx(0.0981)
    apart = closed(plant(-np.eye(2), np.array([[1.0], [0.0]]), np.array([[0.0, 1.0]])))
    assert apart.transport(0, 0) == math.inf


OUTPUTS = (Channel("theta", "theta", "rad", 1.0, 1), Channel("q", "q", "rad/s", 1.0, 1), Channel("V_lon", "V_lon", "m/s", 1.0, 1))
SPEED = Channel("V_lon", "V_ref", "m/s", 1.0, 1)


def reference_source(
    folder: Path, *, inputs: tuple[Channel, ...] = (SPEED,), outputs: tuple[Channel, ...] = OUTPUTS
) -> StateSpaceSource:
    path = write_reference(folder / "reference.toml")
    return StateSpaceSource(StateSpaceTable("state-space", (), inputs, outputs, path), ("A_mq",))


@pytest.mark.theory
@pytest.mark.parametrize("delay", [0.0, 0.043])
def test_bandwidth_of_a_second_order_attitude(delay: float, tmp_path: Path) -> None:
    """Phase of omega^2 / (s^2 + 2 zeta omega s + omega^2) exp(-tau s) by its own formula, its crossings by bisection."""
    path = tmp_path / "oscillator.toml"
    path.write_text(
        f'[system]\nname = "oscillator"\n[states]\nnames = ["theta", "q"]\nunits = ["deg", "deg/s"]\n'
        f'[inputs]\nnames = ["stick"]\nunits = ["percent"]\ndelay = [{delay}]\n'
        f"[matrices]\nA = [[0.0, 1.0], [{-(OMEGA**2)}, {-2 * ZETA * OMEGA}]]\nB = [[0.0], [{OMEGA**2}]]\n"
    )
    degree = math.pi / 180.0
    table = StateSpaceTable(
        "state-space",
        (),
        (Channel("delta_lon", "stick", "percent", 0.01, -1),),
        (Channel("theta", "theta", "deg", degree, -1),),
        path,
    )
    found = StateSpaceSource(table, ()).frequency_response(np.zeros(0), "delta_lon", "theta", np.geomspace(0.1, 400.0, 4000))
    # deg per percent, both with the other sign
    assert abs(found.value[0]) == pytest.approx(100.0 * degree, rel=1e-3)
    read = bandwidth(found)

    def phase(omega: float) -> float:
        return -math.degrees(math.atan2(2.0 * ZETA * OMEGA * omega, OMEGA**2 - omega**2) + delay * omega)

    assert read.omega_bw_phase == pytest.approx(brentq(lambda w: phase(w) + 135.0, 1.0, 50.0), rel=1e-5)
    if delay:
        omega_180 = brentq(lambda w: phase(w) + 180.0, 1.0, 50.0)
        assert read.omega_180 == pytest.approx(omega_180, rel=1e-5)
        assert read.tau_p == pytest.approx(-(phase(2.0 * omega_180) + 180.0) / (57.3 * 2.0 * omega_180), rel=1e-4)
    else:
        assert read.status_180 == Status.NO_OMEGA_180


def test_units_and_signs_reach_the_record(tmp_path: Path) -> None:
    plain = reference_source(tmp_path).fly(NOMINAL, step("V_lon", 0.5, trim_speed=0.0))
    speed = replace(SPEED, sign=-1)
    outputs = (replace(OUTPUTS[0], sign=-1), OUTPUTS[1], OUTPUTS[2])
    mapped = reference_source(tmp_path, inputs=(speed,), outputs=outputs).fly(NOMINAL, step("V_lon", 0.5, trim_speed=0.0))
    np.testing.assert_allclose(mapped.channels["theta"], plain.channels["theta"], atol=1e-15)  # both signs turned
    np.testing.assert_allclose(mapped.channels["q"], -plain.channels["q"], atol=1e-15)
    np.testing.assert_allclose(mapped.channels["V_lon"], -plain.channels["V_lon"], atol=1e-14)
    assert mapped.channels["V_lon_ref"][0, [0, -1]] == pytest.approx([0.0, 0.5])


def test_a_record_knows_its_delay(tmp_path: Path) -> None:
    path = write_reference(tmp_path / "reference.toml")
    text = path.read_text().replace('units = ["m/s"]\n', 'units = ["m/s"]\ndelay = [0.03]\n', 1)
    path.write_text(
        text.replace('units = ["rad", "rad/s", "m/s"]\n', 'units = ["rad", "rad/s", "m/s"]\ndelay = [0.0, 0.01, 0.0]\n', 1)
    )
    source = StateSpaceSource(StateSpaceTable("state-space", (), (SPEED,), OUTPUTS, path), ())
    record = source.fly(np.zeros(0), pulse("V_lon", 0.5, trim_speed=0.0))
    assert record.delay[0] == pytest.approx(0.04)
    undelayed = reference_source(tmp_path).fly(NOMINAL, pulse("V_lon", 0.5, trim_speed=0.0))
    np.testing.assert_allclose(record.channels["q"][0, 10:], undelayed.channels["q"][0, :-10], atol=1e-13)


LATE_ROLL = """
[system]
name = "late roll"
[states]
names = ["theta", "q", "p"]
units = ["rad", "rad/s", "rad/s"]
[inputs]
names = ["stick"]
units = ["1"]
delay = [0.02]
[outputs]
names = ["theta", "q", "p", "h"]
units = ["rad", "rad/s", "rad/s", "m"]
delay = [0.3, 0.01, 0.5, 1.0]
[matrices]
A = [[0.0, 1.0, 0.0], [-25.0, -2.0, 0.0], [0.0, 0.0, -2.0]]
B = [[0.0], [25.0], [5.0]]
C = [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
"""


@pytest.mark.theory
def test_the_delay_of_a_record_is_that_of_the_rate_whose_damping_is_read(tmp_path: Path) -> None:
    """A late altitude, attitude or rate of another axis would pass over peaks of the rate in question."""
    path = tmp_path / "late_roll.toml"
    path.write_text(LATE_ROLL)
    units = {"theta": "rad", "q": "rad/s", "p": "rad/s", "altitude": "m"}
    outputs = tuple(Channel(name, name.replace("altitude", "h"), unit, 1.0, 1) for name, unit in units.items())
    stick = Channel("delta_lon", "stick", "1", 1.0, 1)
    given = pulse("delta_lon", 0.1, trim_speed=0.0, flight_mode="direct")
    free = {axis: FreeTest(axis, "dynamic_stability", axis, replace(given, name=axis)) for axis in ("pitch", "roll")}

    def delay(mapped: tuple[Channel, ...], *tests: FreeTest) -> float:
        source = StateSpaceSource(StateSpaceTable("state-space", (), (stick,), mapped, path), (), tests)
        return float(source.fly(np.zeros(0), given).delay[0])

    assert delay(outputs, free["pitch"]) == pytest.approx(0.03)
    assert delay(outputs, free["roll"]) == delay(outputs, *free.values()) == pytest.approx(0.52)
    assert delay(outputs, replace(free["roll"], manoeuvre=replace(given, amplitude=0.2)), free["pitch"]) == pytest.approx(0.03)
    assert delay((*outputs[:2], outputs[3])) == pytest.approx(0.03)
    assert delay(outputs) == pytest.approx(0.52)


def test_an_unstable_system_has_diverged(tmp_path: Path) -> None:
    source = reference_source(tmp_path)
    unstable = np.array([40.0])
    with pytest.raises(ModelFailure, match=r"unstable: pole at [0-9.]+ \+- [0-9.]+j 1/s") as failure:
        source.frequency_response(unstable, "V_lon", "q", np.array([1.0, 2.0]))
    assert failure.value.status == Status.DIVERGED
    with pytest.raises(ModelFailure, match=r"exceeds 1e\+06 times the input") as failure:
        source.fly(unstable, step("V_lon", 0.5, trim_speed=0.0, duration=20.0))
    assert failure.value.status == Status.DIVERGED


def test_a_point_that_makes_no_system_is_its_own_failure(tmp_path: Path) -> None:
    path = write_reference(tmp_path / "reference.toml")
    text = path.read_text().replace('units = ["m/s"]\n', 'units = ["m/s"]\ndelay = ["late"]\n', 1)
    path.write_text(text.replace("A_mq = -136.0", "A_mq = -136.0\nlate = 0.01"))
    source = StateSpaceSource(StateSpaceTable("state-space", (), (SPEED,), OUTPUTS, path), ("late",))
    with pytest.raises(ModelFailure, match=r"delay: is -0.02 s") as failure:
        source.fly(np.array([-0.02]), step("V_lon", 0.5, trim_speed=0.0))
    assert failure.value.status == Status.MODEL_FAILED


@pytest.mark.parametrize(
    ("inputs", "outputs", "targets", "message"),
    [
        ((replace(SPEED, name="V_rfe"),), OUTPUTS, (), r"model.inputs.V_lon.name: unknown name 'V_rfe'; did you mean 'V_ref'"),
        ((SPEED,), (replace(OUTPUTS[1], name="p"),), (), r"model.outputs.q.name: unknown name 'p'"),
        (
            (SPEED,),
            (replace(OUTPUTS[1], unit="deg/s"),),
            (),
            r"model.outputs.q.unit: is 'deg/s', and the file gives 'q' in 'rad/s'",
        ),
        ((SPEED,), (replace(OUTPUTS[1], unit="m"),), (), r"model.outputs.q.unit: is 'm', and the file gives 'q' in 'rad/s'"),
        ((SPEED,), OUTPUTS, ("A_qm",), r"factor.target: unknown name 'A_qm'; did you mean 'A_mq'"),
    ],
)
def test_what_the_file_does_not_have_is_refused(
    inputs: tuple[Channel, ...], outputs: tuple[Channel, ...], targets: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    path = write_reference(tmp_path / "reference.toml")
    with pytest.raises(InputError, match=message):
        StateSpaceSource(StateSpaceTable("state-space", (), inputs, outputs, path), targets)


def test_a_source_travels_before_and_after_use_and_its_key_follows_the_file(tmp_path: Path) -> None:
    source = reference_source(tmp_path)
    fresh = pickle.loads(pickle.dumps(source))  # noqa: S301
    flown = source.fly(NOMINAL, step("V_lon", 0.5, trim_speed=0.0)).channels["q"]
    used = pickle.loads(pickle.dumps(source))  # noqa: S301
    for each in (fresh, used):
        np.testing.assert_array_equal(each.fly(NOMINAL, step("V_lon", 0.5, trim_speed=0.0)).channels["q"], flown)
        assert each.key == source.key
    before = dict(source.key)
    source.table.file.write_text(source.table.file.read_text().replace("-0.15", "-0.16"))
    assert {name for name in before if before[name] != source.key[name]} == {"files"}
    changed = source.fly(NOMINAL, step("V_lon", 0.5, trim_speed=0.0)).channels["q"]
    assert np.abs(changed - flown).max() > 1e-6


def test_a_changed_matrix_beside_the_file_is_read_anew(tmp_path: Path) -> None:
    source = reference_source(tmp_path)
    rows = "V_ref\n0\n0\n0\n-104\n1\n".replace("V_ref", "# V_ref")
    (tmp_path / "B.csv").write_text(rows)
    source.table.file.write_text(source.table.file.read_text().replace("[[0.0], [0.0], [0.0], [-104.0], [1.0]]", '"B.csv"'))
    omega = np.array([1.0])
    before, key = source.frequency_response(NOMINAL, "V_lon", "q", omega).value, source.key["files"]
    (tmp_path / "B.csv").write_text(rows.replace("-104", "-208").replace("\n1\n", "\n2.0\n"))
    np.testing.assert_allclose(source.frequency_response(NOMINAL, "V_lon", "q", omega).value, 2.0 * before, rtol=1e-14)
    assert source.key["files"] != key


@pytest.mark.oracle
def test_the_built_in_loop_is_its_linear_model_at_small_commands(tmp_path: Path) -> None:
    """A nonlinear loop departs from its linear model in proportion to the command, relative to the response."""
    vehicle = load_vehicle("reference-evtol")
    path = write_builtin(tmp_path / "built-in.toml", vehicle, 5.0)
    source = StateSpaceSource(StateSpaceTable("state-space", (), (SPEED,), OUTPUTS, path), ())
    apart = []
    for amplitude in (0.01, 0.001):
        manoeuvre = step("V_lon", amplitude, trim_speed=5.0, duration=6.0)
        linear, flown = source.fly(np.zeros(0), manoeuvre), simulate(vehicle, manoeuvre)
        apart.append(
            [np.abs(linear.change(n) - flown.change(n)).max() / np.abs(flown.change(n)).max() for n in ("theta", "q", "V_lon")]
        )
    assert np.max(apart[1]) < 3e-5
    np.testing.assert_allclose(np.array(apart[0]) / np.array(apart[1]), 10.0, rtol=0.1)


def test_the_poles_of_the_built_in_file_are_those_of_the_sampled_loop() -> None:
    from levelone.dynamics.linearize import linearize

    vehicle = load_vehicle("reference-evtol")
    A = builtin_system(vehicle, 5.0)[0]
    expected = linearize(vehicle, 5.0).poles().s
    gaps = np.abs(np.linalg.eigvals(A)[:, None] - expected).min(axis=0)
    assert gaps.max() < 1e-4  # double poles are found to the root of the rounding


def test_a_sweep_is_flown_to_its_end(tmp_path: Path) -> None:
    manoeuvre = sweep("V_lon", 0.1, trim_speed=0.0, length=20.0, settle=2.0)
    record = reference_source(tmp_path).fly(NOMINAL, manoeuvre)
    assert record.time[-1] == pytest.approx(23.0)
    np.testing.assert_array_equal(record.channels["V_lon_ref"][0], manoeuvre.command(record.time))


def test_the_example_of_the_page_flies_through_a_study(tmp_path: Path) -> None:
    from levelone.campaign.models.build import build
    from levelone.config.model_study import load_model_study

    page = (Path(__file__).parents[3] / "docs" / "how-to" / "state-space.md").read_text()
    for name, text in zip(("pitch.toml", "study.toml"), re.findall(r"```toml\n(.*?)```", page, flags=re.S), strict=True):
        (tmp_path / name).write_text(text)
    study = load_model_study(tmp_path / "study.toml")
    model = build(study)
    points = np.vstack([study.nominal, study.nominal * [1.1, 1.0, 1.0], study.nominal * [1.0, 1.0, 2.0]])
    found = model.evaluate(points)
    assert (found.status == Status.OK).all()
    values = dict(zip(model.names, found.values.T, strict=True))
    assert values["omega_bw_phase"][1] > values["omega_bw_phase"][0] > values["omega_bw_phase"][2]
    assert values["tau_p"][2] > values["tau_p"][0] + 0.005  # 20 ms more delay in the loop
