"""Criteria on roll and yaw: the same closed forms as for pitch, both signs, a heading that wraps, and the charts of each axis."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from handling_signals import decaying_sine, decaying_sine_metrics, grid
from scipy import signal

from levelone.errors import InputError
from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.bandwidth import bandwidth
from levelone.handling.coupling import coupling
from levelone.handling.damping import dynamic_stability
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.identification import identify
from levelone.handling.levels import Level, load_boundaries
from levelone.handling.quickness import attitude_quickness
from levelone.handling.records import record
from levelone.status import Status

AXES = ("roll", "yaw")
ZETA, OMEGA_N = 0.4, 3.0


def oscillation(axis, side, *, begin=1.0, off=math.nan, trim=0.0, wrap=False):
    """A damped oscillation of one axis after an input at 1 s; the heading optionally within half a turn."""
    time = grid(12.0)
    rate, attitude = (side * series[0] for series in decaying_sine(time, ZETA, OMEGA_N, amplitude=0.3, begin=begin))
    attitude = attitude + trim
    if wrap:
        attitude = (attitude + math.pi) % (2.0 * math.pi) - math.pi
    rate_name, attitude_name = RATE_AND_ATTITUDE[axis]
    channels = {"stick": (time >= 1.0) * 1.0, rate_name: rate, attitude_name: attitude}
    trims = {"stick": 0.0, rate_name: 0.0, attitude_name: trim}
    return record(time, channels, input_name="stick", input_on=1.0, input_off=off, trim=trims, units={"stick": "1"})


@pytest.mark.theory
@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_quickness_of_a_damped_oscillation(axis, side):
    found = attitude_quickness(oscillation(axis, side), axis)
    q_pk, peak, least, t_rate, t_attitude, _ = decaying_sine_metrics(ZETA, OMEGA_N, 0.3)
    read = [getattr(found, name)[0] for name in ("quickness", "q_pk", "delta_theta_pk", "delta_theta_min")]
    np.testing.assert_allclose(read, [q_pk / peak, q_pk, peak, least], rtol=1e-6)
    np.testing.assert_allclose([found.t_q_pk[0], found.t_theta_pk[0]], [1.0 + t_rate, 1.0 + t_attitude], rtol=1e-5)
    assert np.sign(found.picks.value[0, 0]) == side


@pytest.mark.theory
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("trim", [3.1, -3.1])
def test_a_heading_that_wraps_gives_the_same_quickness(side, trim):
    wrapped, plain = oscillation("yaw", side, trim=trim, wrap=True), oscillation("yaw", side)
    jumps = np.abs(np.diff(wrapped.channels["psi"])).max() > 6.0
    assert jumps == (side * trim > 0.0)
    for name in ("quickness", "delta_theta_pk", "delta_theta_min"):
        read, wanted = (getattr(attitude_quickness(each, "yaw"), name) for each in (wrapped, plain))
        np.testing.assert_allclose(read, wanted, rtol=1e-9)


@pytest.mark.theory
@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_damping_of_a_free_oscillation(axis, side):
    found = dynamic_stability(oscillation(axis, side, off=1.5, begin=1.5), axis)
    np.testing.assert_allclose([found.zeta[0], found.omega_n[0]], [ZETA, OMEGA_N], rtol=1e-5)


def test_yaw_asks_for_less_damping_than_roll():
    """Damping ratio 0.25 at 2 rad/s: Level 1 in yaw (0.19), Level 2 in pitch and roll (0.35)."""
    for name, level in (("ads33-levels", Level.LEVEL_2), ("ads33-roll", Level.LEVEL_2), ("ads33-yaw", Level.LEVEL_1)):
        assert load_boundaries(name).dynamic_stability.levels([2.0], [0.25]).tolist() == [level]
    reference = tomllib.loads((Path(__file__).parents[1] / "reference" / "fidelity.toml").read_text(encoding="utf-8"))
    assert load_boundaries("ads33-yaw").dynamic_stability.zeta_1 == reference["yaw"]["zeta_level_1"]


@pytest.mark.theory
@pytest.mark.parametrize(("on", "off"), [("roll", "pitch"), ("pitch", "roll")])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_coupling_reads_either_axis(on, off, side):
    """On-axis attitude goes to 0.2 rad as a first order of 0.5 s; off-axis follows a bump of 0.05 rad at 2 s after the input."""
    time = grid(8.0)
    s = np.maximum(time - 1.0, 0.0)
    names = {axis: RATE_AND_ATTITUDE[axis][1] for axis in (on, off)}
    change = {on: -0.2 * np.expm1(-s / 0.5), off: side * 0.05 * (s / 2.0) ** 2 * np.exp(2.0 - s)}
    channels = {"stick": (time >= 1.0) * 1.0, **{names[axis]: change[axis] for axis in (on, off)}}
    history = record(time, channels, input_name="stick", input_on=1.0, trim=dict.fromkeys(channels, 0.0), units={"stick": "1"})
    found = coupling(history, on)
    at_end = 0.2 * -math.expm1(-4.0 / 0.5)
    np.testing.assert_allclose([found.off_axis_peak[0], found.ratio_literal[0]], [0.05, 0.05 / at_end], rtol=1e-6)
    assert found.level.tolist() == [Level.LEVEL_1 if 0.05 / at_end <= 0.25 else Level.LEVEL_2]


@pytest.mark.theory
@pytest.mark.parametrize(
    ("name", "task", "level"),
    [
        ("ads33-levels", "target_acquisition", Level.LEVEL_1),
        ("ads33-roll", "target_acquisition", Level.LEVEL_2),
        ("ads33-yaw", "target_acquisition", Level.LEVEL_2),
        ("ads33-yaw", "all_other", Level.LEVEL_1),
    ],
)
def test_bandwidth_of_an_integrator_with_a_delay_on_the_chart_of_each_axis(name, task, level):
    """Phase -90 deg - 57.3 omega tau: 45 deg of margin at pi / (4 tau), here 3 rad/s."""
    delay = math.pi / 12.0
    omega = np.geomspace(0.1, 60.0, 300)
    response = FrequencyResponse(omega, np.exp(-1j * delay * omega) / (1j * omega))
    found = bandwidth(response, task=task, boundaries=load_boundaries(name))
    assert found.omega_bw == pytest.approx(3.0, rel=1e-6)
    assert found.level_extrapolated == level
    assert found.level == Level.OUTSIDE  # the phase delay of pi / 24 s lies beyond the known part of the chart


@pytest.mark.parametrize(("axis", "name"), [("roll", "ads33-roll"), ("yaw", "ads33-yaw")])
def test_quickness_charts_are_those_of_the_common_file(axis, name):
    own, common = (load_boundaries(each).chart("attitude_quickness", axis) for each in (name, "ads33-levels"))
    np.testing.assert_array_equal(own.level_1_2, common.level_1_2)
    np.testing.assert_array_equal(own.level_2_3, common.level_2_3)
    assert (own.low, own.high, own.confidence) == (common.low, common.high, common.confidence)


def test_boundaries_of_roll_and_yaw_say_how_far_they_are_confirmed():
    for name in ("ads33-roll", "ads33-yaw"):
        boundaries = load_boundaries(name)
        charts = [*boundaries.attitude_quickness.values(), *boundaries.bandwidth.values()]
        assert not any(chart.verified for chart in charts)
        assert all(chart.source for chart in charts)
    with pytest.raises(InputError, match="unknown name 'pitch'"):
        load_boundaries("ads33-yaw").chart("attitude_quickness", "pitch")


@pytest.mark.theory
def test_a_sweep_of_a_heading_that_wraps():
    """psi / pedal = 2 / (s^2 + s + 1) around a heading of 180 deg, both recorded within half a turn and not."""
    time = np.arange(4001) * 0.025
    s = np.clip(time - 2.0, 0.0, 90.0)
    fade = np.clip(np.minimum(s, 90.0 - s) / 2.0, 0.0, 1.0)
    pedal = fade * np.sin(0.3 * s + 0.05 * s**2)
    psi = math.pi + signal.lsim(([2.0], [1.0, 1.0, 1.0]), pedal, time)[1]
    plain = record(
        time,
        {"pedal": pedal, "psi": psi},
        input_name="pedal",
        input_on=2.0,
        trim={"pedal": 0.0, "psi": math.pi},
        units={"pedal": "1"},
    )
    within = (psi + math.pi) % (2.0 * math.pi) - math.pi
    wrapped = dataclasses.replace(
        plain, channels={**plain.channels, "psi": within[None]}, trim={**plain.trim, "psi": np.array([-math.pi])}
    )
    assert np.abs(np.diff(within)).max() > 6.0
    one, other = identify(plain, "psi", omega_max=9.0), identify(wrapped, "psi", omega_max=9.0)
    np.testing.assert_allclose(other.value, one.value, rtol=1e-6)
    found = bandwidth(one.select(0), boundaries=load_boundaries("ads33-yaw"))
    omega = np.geomspace(0.3, 9.0, 300)
    wanted = bandwidth(FrequencyResponse(omega, 2.0 / ((1j * omega) ** 2 + 1j * omega + 1.0)))
    assert found.status == Status.PIO_CAUTION
    assert found.omega_bw == pytest.approx(wanted.omega_bw, rel=0.02)
