"""Criteria on recorded data: records of systems in closed form give the closed form's numbers; what is wrong with data is said."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal
from scipy.optimize import brentq

from levelone.campaign.assessment import Assessment, Recorded, Request, assess
from levelone.campaign.assessment_compare import compare
from levelone.campaign.assessment_input import choose_input, excited_range, recognise, until_moved
from levelone.errors import InputError
from levelone.handling.levels import Level
from levelone.handling.tolerances import Tolerance
from levelone.status import Status

ZETA, OMEGA_N, DELAY, DT = 0.5, 3.0, 0.06, 0.01
NAMES = {"pitch": ("delta_lon", "q", "theta"), "roll": ("delta_lat", "p", "phi"), "yaw": ("delta_ped", "r", "psi")}


def grid(duration: float) -> np.ndarray:
    return np.arange(round(duration / DT)) * DT


def swept(duration: float = 60.0, low: float = 0.5, high: float = 18.0) -> np.ndarray:
    """A logarithmic sweep from 2 s on, back at zero 3 s before the end."""
    time = grid(duration)
    on, off = 2.0, duration - 3.0
    part = np.clip((time - on) / (off - on), 0.0, 1.0)
    growth = math.log(high / low)
    phase = low * (off - on) / growth * np.expm1(part * growth)
    fade = np.clip(np.minimum(time - on, off - time), 0.0, 1.0)
    return 0.1 * fade * np.sin(phase)


def flown(command: np.ndarray, axis: str = "pitch", *, seed: int = 0, noise: float = 0.0, zeta: float = ZETA, name: str = "run",
          gain: float = 0.8) -> Recorded:  # fmt: skip
    """Answer of a second order with a delay of whole samples; noise as a part of the answer's own size, trim off zero."""
    time, shift = grid(command.size * DT), round(DELAY / DT)
    late = np.concatenate([np.zeros(shift), command[:-shift]])
    denominator = [1.0, 2.0 * zeta * OMEGA_N, OMEGA_N**2]
    angle = signal.lsim(([gain * OMEGA_N**2], denominator), late, time)[1]
    rate = signal.lsim(([gain * OMEGA_N**2, 0.0], denominator), late, time)[1]
    rng = np.random.default_rng(seed)
    angle, rate = (x + noise * x.std() * rng.standard_normal(x.size) for x in (angle, rate))
    stick, rate_name, angle_name = NAMES[axis]
    return Recorded(name, time, {stick: 0.05 + command, rate_name: rate, angle_name: 0.03 + angle})


def phase(omega: float) -> float:
    return -math.atan2(2.0 * ZETA * OMEGA_N * omega, OMEGA_N**2 - omega**2) - DELAY * omega


def gain_db(omega: float) -> float:
    return -20.0 * math.log10(math.hypot(OMEGA_N**2 - omega**2, 2.0 * ZETA * OMEGA_N * omega))


def exact() -> dict[str, float]:
    turn = brentq(lambda w: phase(w) + math.pi, 0.1, 30.0)
    line = gain_db(turn) + 6.0
    return {
        "omega_bw_phase": brentq(lambda w: phase(w) + 0.75 * math.pi, 0.1, 30.0),
        "omega_bw_gain": brentq(lambda w: gain_db(w) - line, OMEGA_N, turn),
        "omega_180": turn,
        "tau_p": (-math.degrees(phase(2.0 * turn)) - 180.0) / (57.3 * 2.0 * turn),
    }


BARS = Request(windows=(20.0, 12.0))


def reading(found: Assessment, criterion: str, title: str = "", record: str = ""):
    return next(
        each
        for each in found.readings
        if each.criterion == criterion and each.title.startswith(title) and each.record.startswith(record)
    )


@pytest.mark.theory
@pytest.mark.parametrize("axis", ["pitch", "roll", "yaw"])
def test_sweeps_give_the_bandwidth_of_the_system_that_flew(axis):
    records = [flown(swept(), axis, seed=k, noise=0.02, name=f"run{k}") for k in range(3)]
    found = assess(records, Request(windows=(40.0, 30.0, 20.0)))
    assert (found.kind, found.axis, found.input_name) == ("sweep", axis, NAMES[axis][0])
    assert found.checks == ()
    _, rate, angle = NAMES[axis]
    for title in (f"{angle} /", f"{rate} / (s"):
        got = reading(found, "bandwidth", title)
        for name, value in exact().items():
            here = got.value(name)
            assert here.status == Status.OK
            # noise, and what windows of finite width flatten
            assert abs(here.value - value) < 4.0 * here.error + 0.01 * value, (title, name, here, value)
            assert 0.0 < here.error < 0.05 * value
        assert got.value("omega_bw").value == min(got.value("omega_bw_phase").value, got.value("omega_bw_gain").value)
    # limits of the shipped charts for all other tasks: 1 rad/s, in yaw 2
    assert got.level == Level.LEVEL_1
    assert reading(found, "bandwidth", f"{rate} / delta").chart == "no chart"


@pytest.mark.theory
def test_bars_are_as_wide_as_the_values_scatter():
    """Leakage of a sweep lowers coherence as noise does: bars may be too wide, most of all at the resonance; never too narrow."""
    command = swept(40.0)
    names = ("omega_bw_phase", "omega_bw_gain", "omega_180", "tau_p")
    values, errors = [], []
    for seed in range(24):
        record = flown(command, seed=seed, noise=0.1)
        found = assess([Recorded("run", record.time, {name: record.channels[name] for name in ("delta_lon", "q")})], BARS)
        got = reading(found, "bandwidth", "q / (s")
        values.append([got.value(name).value for name in names])
        errors.append([got.value(name).error for name in names])
    ratio = np.sqrt(np.mean(np.square(errors), axis=0)) / np.std(values, axis=0)
    assert np.all(ratio > 0.6), dict(zip(names, ratio, strict=True))
    assert np.all(ratio[1:] < 2.2), dict(zip(names, ratio, strict=True))


def test_a_speed_command_is_read_with_its_own_signs():
    record = flown(swept(), noise=0.005)
    channels = {"V_lon_ref": record.channels["delta_lon"], "q": -record.channels["q"], "theta": -record.channels["theta"]}
    found = assess([Recorded("run", record.time, channels)])
    assert [each.title for each in found.readings] == ["-theta / V_lon_ref", "-q / (s V_lon_ref)", "q / V_lon_ref"]
    assert reading(found, "bandwidth", "-theta").value("omega_180").value == pytest.approx(exact()["omega_180"], rel=0.01)


def test_the_range_of_a_sweep_is_what_it_excites():
    record = flown(swept(90.0, 0.5, 12.0))
    found = assess([record])
    assert found.sweeping is not None
    assert 0.4 <= found.sweeping.omega_min <= 0.6
    assert 11.0 <= found.sweeping.omega_max <= 16.0
    assert excited_range(found.histories) == (found.sweeping.omega_min, found.sweeping.omega_max)
    assert assess([record], Request(omega_min=1.0, omega_max=5.0)).responses["q"].response.omega[-1] <= 5.0


PULSE = np.where((grid(12.0) >= 1.0) & (grid(12.0) < 1.5), 0.3, 0.0)
STEP = np.where(grid(12.0) >= 1.0, 0.3, 0.0)


@pytest.mark.theory
@pytest.mark.parametrize("axis", ["pitch", "roll", "yaw"])
@pytest.mark.parametrize("zeta", [0.15, 0.3])
def test_a_pulse_gives_the_damping_whatever_the_delay(axis, zeta):
    found = assess([flown(PULSE, axis, zeta=zeta), flown(-PULSE, axis, zeta=zeta, name="other")])
    assert found.kind == "pulse"
    for got in (each for each in found.readings if each.criterion == "dynamic_stability"):
        assert got.value("zeta").value == pytest.approx(zeta, abs=0.003)
        assert got.value("omega_n").value == pytest.approx(OMEGA_N, rel=0.005)
        assert got.times["free"] >= 1.5 + DELAY


def test_a_delay_that_is_left_out_spoils_the_damping():
    got = reading(assess([flown(PULSE, zeta=0.15)], Request(delay=0.0)), "dynamic_stability")
    assert abs(got.value("zeta").value - 0.15) > 0.05
    got = reading(assess([flown(PULSE, zeta=0.15)], Request(delay=DELAY)), "dynamic_stability")
    assert got.value("zeta").value == pytest.approx(0.15, abs=0.003)


@pytest.mark.theory
def test_a_step_gives_quickness_coupling_and_the_largest_rate():
    record = flown(STEP)
    record.channels["phi"] = 0.2 * (record.channels["theta"] - 0.03)  # type: ignore[index]
    found = assess([record], Request(agility="limited"))
    # peak rate of a second order after a step: at t = acos(zeta) / omega_d
    root = math.sqrt(1.0 - ZETA**2)
    peak = 0.3 * 0.8 * OMEGA_N * math.exp(-ZETA * math.acos(ZETA) / root)
    top = 0.3 * 0.8 * (1.0 + math.exp(-math.pi * ZETA / root))
    quick = reading(found, "attitude_quickness")
    assert quick.value("q_pk").value == pytest.approx(peak, rel=1e-3)
    assert quick.value("quickness").value == pytest.approx(peak / top, rel=1e-3)
    assert reading(found, "large_amplitude").value("q_largest").value == pytest.approx(peak, rel=1e-3)
    assert reading(found, "pitch_roll_coupling").value("ratio").value == pytest.approx(0.2, rel=1e-6)
    assert {each.criterion for each in found.unread} == {"bandwidth", "dynamic_stability"}


@pytest.mark.theory
def test_a_step_of_collective_gives_the_height_response():
    time = grid(9.0)
    late = np.maximum(time - 1.0 - 0.1, 0.0)
    climb = 2.0 * (1.0 - np.exp(-late / 1.5))
    found = assess([Recorded("run", time, {"delta_col": np.where(time >= 1.0, 1.0, 0.0), "V_vert": climb})])
    got = reading(found, "height_response")
    assert found.axis == "heave"
    assert got.value("T_hdot").value == pytest.approx(1.5, rel=0.01)
    assert got.value("tau_hdot").value == pytest.approx(0.1, abs=0.006)
    assert got.level == Level.LEVEL_1


@pytest.mark.parametrize(
    ("values", "kind", "on", "off"),
    [
        (swept(), "sweep", 2.0, 57.0),
        (STEP, "step", 1.0, math.nan),
        (0.2 - PULSE, "pulse", 1.0, 1.5),
        (np.clip(grid(12.0) - 1.0, 0.0, 0.5), "step", 1.05, math.nan),
        (0.02 * (grid(12.0) >= 1.5) + PULSE, "pulse", 1.0, 1.5),  # comes to rest beside where it was
    ],
)
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_inputs_are_recognised(values, kind, on, off, noise):
    time = grid(values.size * DT)
    rng = np.random.default_rng(2)
    found = recognise(time, values + noise * rng.standard_normal(values.size))
    assert found.kind == kind
    late = 1.0 if kind == "sweep" else 0.03  # a sweep fades in
    assert 0.0 <= found.on - on + 1e-9 < late
    assert math.isnan(found.off) == math.isnan(off)
    assert math.isnan(off) or abs(found.off - off) < late


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.full(500, 0.2), "does not move beyond its noise"),
        (np.cos(0.1 * grid(5.0)), "is not steady before"),
        (np.where(np.arange(500) > 0, 1.0, 0.0), "does not move beyond its noise"),
        (
            np.where(grid(12.0) >= 1.0, 0.1, 0.0) + np.where((grid(12.0) > 2.0) & (grid(12.0) < 3.0), 0.25, 0.0),
            "say which with --kind",
        ),
        (PULSE - np.roll(PULSE, 50), "changes sides 1 times: neither step, pulse nor sweep"),
        (np.repeat([0.0, 1.0, -1.0, 1.0, -1.0, 0.0], [200, 300, 200, 100, 100, 500]), "changes sides 3 times: neither"),
    ],
)
def test_inputs_that_cannot_be_recognised(values, words):
    with pytest.raises(InputError, match=words):
        recognise(grid(values.size * DT), values)


def test_a_rate_moves_no_earlier_than_the_delay():
    record = flown(STEP)
    assert DELAY <= until_moved(record.time, record.channels["q"], 1.0) < DELAY + 0.1
    assert until_moved(record.time, 0.0 * record.time, 1.0) == 0.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c.__setitem__("theta", np.degrees(c["theta"])), "theta moves 57.3 times as far"),
        (lambda c: c.__setitem__("theta", -c["theta"]), "theta moves -1 times as far"),
        (lambda c: c.__setitem__("delta_lon", -c["delta_lon"]), "q answers against delta_lon"),
    ],
)
def test_wrong_units_and_signs_are_seen(change, words):
    record = flown(swept(), noise=0.005)
    change(record.channels)
    assert any(words in check for check in assess([record]).checks)


def test_what_cannot_be_assessed_together():
    with pytest.raises(InputError, match=r"records of one kind.*run step, run pulse"):
        assess([flown(STEP), flown(PULSE)])
    with pytest.raises(InputError, match="no record"):
        assess([])
    record = flown(STEP)
    with pytest.raises(InputError, match="nothing can be read"):
        assess([Recorded("run", record.time, {"delta_lon": record.channels["delta_lon"], "altitude": record.time})])
    with pytest.raises(InputError, match="did you mean 'delta_lon'"):
        choose_input(["delta_lon", "q"], "delta_ln", None)
    with pytest.raises(InputError, match="are all inputs"):
        choose_input(["delta_lon", "delta_lat"], None, None)
    assert choose_input(["delta_lon", "delta_lat"], None, "roll") == "delta_lat"


@pytest.mark.theory
def test_a_gain_that_is_off_by_one_decibel_costs_what_the_formula_says():
    flight = assess([flown(swept())])
    assert compare(flight, flight).cost == pytest.approx(0.0, abs=1e-20)
    found = compare(assess([flown(swept(), gain=0.8 * 10.0 ** (1.0 / 20.0))]), flight)
    weight = (1.58 * (1.0 - math.exp(-1.0))) ** 2
    assert found.cost == pytest.approx(20.0 * weight, rel=0.01)  # coherence is 1 but for what windows leak
    assert found.verdict == "nearly indistinguishable"
    assert [each.key for each in found.responses] == ["theta", "q"]
    assert all(each.added.verdict == "inside" for each in found.responses)


def test_metrics_of_simulation_and_flight_row_by_row():
    flight, simulation = assess([flown(PULSE, zeta=0.3)]), assess([flown(PULSE, zeta=0.4, name="sim")])
    found = compare(simulation, flight)
    rows = {row.name: row for pair in found.pairs for row in pair.rows}
    assert rows["zeta"].difference == pytest.approx(0.1, abs=0.006)
    assert rows["zeta"].verdict == "outside"
    assert rows["quickness"].verdict == "no tolerance"
    assert math.isnan(found.cost)
    with pytest.raises(InputError, match="another kind than the data: step, not pulse"):
        compare(simulation, assess([flown(STEP)]))
    with pytest.raises(InputError, match="1 records against 2"):
        compare(simulation, assess([flown(PULSE), flown(PULSE)]))


@pytest.mark.parametrize("offset", [0.0, math.pi - 0.03, math.pi, 2.0 * math.pi])
@pytest.mark.parametrize("lowest", [0.0, -math.pi])
def test_a_heading_that_wraps_in_trim_is_the_heading(offset, lowest):
    """Noise about north or south must not turn half of the trim by a whole turn."""
    record = flown(PULSE, "yaw")
    wanted = reading(assess([record]), "attitude_quickness")
    record.channels["psi"] = record.channels["psi"] - 0.03 + 0.002 * np.sin(7.0 * record.time) * (record.time < 1.0)
    record.channels["psi"] = (record.channels["psi"] + offset - lowest) % (2.0 * math.pi) + lowest
    got = reading(assess([record]), "attitude_quickness")
    assert got.value("quickness").value == pytest.approx(wanted.value("quickness").value, rel=0.01)
    assert got.level == wanted.level


def test_a_step_of_commanded_heading_across_north():
    command = np.where(grid(12.0) >= 1.0, 0.35, 0.0)
    record = flown(command, "yaw")
    channels = {"psi_ref": command - 0.17, "psi": record.channels["psi"] - 0.2, "r": record.channels["r"]}
    wanted = assess([Recorded("run", record.time, channels)])
    wrapped = {name: x % (2.0 * math.pi) if name.startswith("psi") else x for name, x in channels.items()}
    got = assess([Recorded("run", record.time, wrapped)])
    assert got.inputs[0].size == pytest.approx(0.35)
    assert reading(got, "attitude_quickness").value("quickness").value == pytest.approx(
        reading(wanted, "attitude_quickness").value("quickness").value, rel=1e-9
    )


@pytest.mark.theory
@pytest.mark.parametrize("lag", [0.03, 0.1, 0.3, 1.0])
def test_the_damping_of_a_pulse_is_right_or_undefined_however_slowly_the_control_comes_back(lag):
    time = grid(20.0)
    command = 0.3 * np.where(time < 1.0, 0.0, np.where(time < 1.5, 1.0, np.exp(-np.maximum(time - 1.5, 0.0) / lag)))
    got = reading(assess([flown(command, zeta=0.33)]), "dynamic_stability")
    if lag <= 0.1:  # 3.8 lags from 90 to 2 % are within a quarter of 2.2 s
        assert got.value("zeta").value == pytest.approx(0.33, abs=0.003)
        return
    assert got.level == Level.UNDEFINED
    for value in got.values:
        assert math.isnan(value.value)
        assert "the control comes back over" in value.text


@pytest.mark.theory
@pytest.mark.parametrize("ramp", [0.0, 1.0, 3.0])
def test_a_ramped_step_of_collective_keeps_its_delay(ramp):
    """tau = 0.21 s is Level 2. A held input follows the ramp half a sample late."""
    time, lag, tau = grid(12.0), 2.0, 0.21

    def ramped(since):  # answer of a first order to a unit ramp
        return np.maximum(since, 0.0) - lag * -np.expm1(-np.maximum(since, 0.0) / lag)

    late = time - 2.0 - tau
    if ramp:
        stick = np.clip((time - 2.0) / ramp, 0.0, 1.0)
        climb = (ramped(late) - ramped(late - ramp)) / ramp
    else:
        stick, climb = np.where(time >= 2.0, 1.0, 0.0), -np.expm1(-np.maximum(late, 0.0) / lag)
    got = reading(assess([Recorded("run", time, {"delta_col": stick, "V_vert": 3.0 * climb})]), "height_response")
    assert got.value("tau_hdot").value == pytest.approx(tau - (0.5 * DT if ramp else 0.0), abs=3e-4)
    assert got.value("T_hdot").value == pytest.approx(lag, rel=1e-3)
    assert got.level == Level.LEVEL_2


def test_times_of_the_input_hold_for_one_record():
    records = [flown(PULSE), flown(-PULSE, name="other")]
    with pytest.raises(InputError, match=r"--on: holds for one record, 2 are given"):
        assess(records, Request(input_on=1.0))
    with pytest.raises(InputError, match=r"--off: holds for one record, 2 are given"):
        assess(records, Request(input_off=1.5))
    assert assess(records[:1], Request(input_on=1.0, input_off=1.5)).kind == "pulse"


def test_a_doublet_that_is_insisted_on_is_read_and_said():
    found = assess([flown(PULSE - np.roll(PULSE, 50))], Request(kind="pulse"))
    assert any("the input changes sides 1 times" in check for check in found.checks)
    assert not any("changes sides" in check for check in assess([flown(PULSE)]).checks)


@pytest.mark.parametrize(("command", "key"), [(swept(), "phase"), (PULSE, "first"), (STEP, "first")])
@pytest.mark.parametrize("axis", ["pitch", "roll", "yaw"])
def test_a_stick_of_the_wrong_sign_is_seen_in_every_manoeuvre(command, key, axis):
    stick, rate, angle = NAMES[axis]
    for sign in (1.0, -1.0):
        record = flown(command, axis, noise=0.002)
        channels = dict(record.channels)
        channels[stick] = sign * channels[stick]
        if key == "phase":
            del channels[rate]  # the angle alone must tell
        words = f"{angle} answers against {stick}" if key == "phase" else f"{rate} first goes against {stick}"
        assert any(words in check for check in assess([Recorded("run", record.time, channels)]).checks) is (sign < 0.0)


def test_the_windows_of_a_sweep_are_stated_and_are_those_by_default():
    record = flown(swept())
    found = assess([record])
    assert found.sweeping is not None
    assert found.sweeping.windows == pytest.approx((0.6 * 59.99, 0.4 * 59.99, 0.2 * 59.99))


@pytest.mark.theory
def test_intervals_of_bandwidth_hold_the_truth_with_few_averages():
    """Some four independent averages: two standard deviations held 81 to 92 %, Student's factor widens them."""
    truth, inside = exact()["omega_180"], []
    for seed in range(20):
        record = flown(swept(40.0), seed=seed, noise=0.02)
        found = assess([Recorded("run", record.time, {name: record.channels[name] for name in ("delta_lon", "q")})])
        value = reading(found, "bandwidth", "q / (s").value("omega_180")
        assert value.half_width > 2.0 * value.error
        inside.append(abs(value.value - truth) <= value.half_width)
    assert np.mean(inside) >= 0.9


def test_sweeps_beyond_the_envelopes_still_have_a_cost():
    """The envelopes end at 10 rad/s."""
    request = Request(omega_min=10.5, omega_max=18.0, windows=(15.0,))
    found = compare(assess([flown(swept())], request), assess([flown(swept(), gain=0.9)], request))
    assert found.cost > 0.0
    for each in found.responses:
        assert each.added is None
        assert (each.read, math.isnan(each.share)) == (0, True)
        assert each.noticed == "no frequency from 0.5 to 10 rad/s that both excite"


def test_a_tolerance_in_the_unit_of_another_metric_is_refused():
    flight = assess([flown(PULSE)])
    wrong = {"zeta": Tolerance("zeta", 0.1, math.nan, "s", "", "", "low")}
    with pytest.raises(InputError, match=r"tolerance.zeta.unit: is 's', but zeta is in '1'"):
        compare(flight, flight, wrong)


def test_the_period_in_yaw_is_judged_by_half_a_second():
    flight, simulation = (assess([flown(PULSE, axis, zeta=0.2)]) for axis in ("yaw", "yaw"))
    rows = {row.name: row for pair in compare(simulation, flight).pairs for row in pair.rows}
    assert rows["damped_period"].allowed == pytest.approx(0.5)
    assert rows["damped_period"].tolerance is not None
    assert rows["damped_period"].tolerance.paragraph == "2.d.3.a"
