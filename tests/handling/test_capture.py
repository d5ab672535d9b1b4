"""Deceleration to hover: measures of motions known in closed form, and what is said where nothing was captured."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from handling_signals import grid
from hypothesis import given
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling.capture import CHANNELS, LEFT, MEASURES, SLOW, Capture, Performance, Tolerances, capture, severity
from levelone.handling.history import TimeHistory
from levelone.status import Status

DESIRED = Tolerances(overshoot=1.0, position=0.5, height=0.5, lateral=0.5, heading=0.1, time=15.0, theta=0.2)
ADEQUATE = Tolerances(overshoot=2.0, position=1.0, height=1.0, lateral=1.0, heading=0.2, time=20.0, theta=0.4)
SPEED, START, HOLD = 5.0, 2.0, 5.0
UNITS = {name: "rad" if name in ("theta", "psi") else "m/s" if name.startswith("V_") else "m" for name in CHANNELS}


def record(time, x, speed, *, start=START, status=None, trim=None, **others):
    """A record [run, time] of track and ground speed; the command begins to fall by 1 m/s^2 at ``start``."""
    x, speed = np.atleast_2d(x), np.atleast_2d(speed)
    command = np.tile(np.maximum(SPEED - np.maximum(time - start, 0.0), 0.0), (len(x), 1))
    channels = {name: np.zeros_like(x) for name in CHANNELS} | {"x_north": x, "V_lon": speed, "V_lon_ref": command}
    channels |= {name: np.broadcast_to(values, x.shape) for name, values in others.items()}
    trims = {name: np.zeros(len(x)) for name in CHANNELS} | {"V_lon_ref": np.full(len(x), SPEED), "V_lon": np.full(len(x), SPEED)}
    trims |= {name: np.full(len(x), value) for name, value in (trim or {}).items()}
    for name in trim or {}:
        channels[name] = channels[name] + trim[name]
    return TimeHistory(
        time=time, channels=channels, units=UNITS, trim=trims, input_name="V_lon_ref", input_on=1.0, input_off=math.nan,
        delay=np.zeros(len(x)), wind=(0.0, 0.0, 0.0),
        status=np.full(len(x), Status.OK, dtype=np.int64) if status is None else np.asarray(status, dtype=np.int64),
    )  # fmt: skip


def approach(time, constant, *, short=0.0):
    """Level flight, then a speed that decays with a time constant: track and speed; it ends ``short`` of the point at 'reach'."""
    since = np.maximum(time - START, 0.0)
    speed = SPEED * np.exp(-since / constant)
    return SPEED * np.minimum(time, START) + constant * (SPEED - speed) - short, speed


def reach(constant):
    return SPEED * (START + constant)


def measured(history, distance, desired=DESIRED, adequate=ADEQUATE) -> Capture:
    return capture(history, distance, HOLD, desired, adequate)


def performances(found: Capture) -> dict[str, int]:
    return {name: int(codes[0]) for name, codes in found.performances.items()}


@pytest.mark.theory
@pytest.mark.parametrize("constant", [2.0, 3.0, 8.0])
def test_exponential_approach_is_captured_when_distance_and_speed_are_small(constant):
    """The distance is the time constant times the speed: above 5 s the distance is the later of the two."""
    time = grid(50.0)
    found = measured(record(time, *approach(time, constant)), reach(constant), adequate=replace(ADEQUATE, time=40.0))
    slowest = min(SLOW, ADEQUATE.position / constant)
    when = constant * math.log(SPEED / slowest)
    assert found.status[0] == found.status_motion[0] == Status.OK
    assert found.start[0] == pytest.approx(START + LEFT, abs=1e-9)
    assert found.captured[0] == pytest.approx(START + when, abs=1e-6)
    assert found.time[0] == pytest.approx(when - LEFT, abs=1e-6)
    assert found.position[0] == pytest.approx(constant * slowest, rel=0.004 / constant)
    assert found.overshoot[0] == 0.0


@pytest.mark.theory
@pytest.mark.parametrize(("zeta", "omega"), [(0.4, 1.2), (0.7, 0.8)])
def test_overshoot_of_a_second_order_capture(zeta, omega):
    """From rest at a distance E the first swing passes the point by E exp(-pi zeta / sqrt(1 - zeta^2))."""
    time, distance = grid(40.0), 4.0
    damped, decay = omega * math.sqrt(1.0 - zeta**2), zeta * omega
    since = np.maximum(time - START, 0.0)
    to_go = distance * np.exp(-decay * since) * (np.cos(damped * since) + decay / damped * np.sin(damped * since))
    speed = distance * np.exp(-decay * since) * omega**2 / damped * np.sin(damped * since)
    found = measured(record(time, distance - to_go, speed), distance)
    assert found.status[0] == Status.OK
    assert found.overshoot[0] == pytest.approx(distance * math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2)), rel=1e-5)
    after = (time >= found.captured[0]) & (time <= found.captured[0] + HOLD)
    assert np.abs(to_go[after]).max() <= ADEQUATE.position
    assert np.abs(speed[after]).max() <= SLOW
    just_before = np.searchsorted(time, found.captured[0]) - 1
    assert abs(to_go[just_before]) > ADEQUATE.position or abs(speed[just_before]) > SLOW


@pytest.mark.theory
def test_changes_count_from_trim_in_both_directions_until_the_hold_ends():
    time = grid(40.0)
    bump = np.exp(-((time - 6.0) ** 2))
    late = np.where(time > 35.0, 10.0, 0.0)
    history = record(
        time, *approach(time, 2.0), altitude=-0.7 * bump + late, y_east=0.3 * bump + late, psi=-0.15 * bump, theta=0.25 * bump,
        trim={"altitude": 50.0, "theta": 0.07, "x_north": -3.0, "psi": 3.1, "y_east": -1.0},
    )  # fmt: skip
    found = measured(history, reach(2.0))
    assert found.height[0] == pytest.approx(0.7, rel=1e-6)
    assert found.lateral[0] == pytest.approx(0.3, rel=1e-6)
    assert found.heading[0] == pytest.approx(0.15, rel=1e-6)
    assert found.theta[0] == pytest.approx(0.25, rel=1e-6)
    wanted = {"overshoot": 1, "position": 1, "height": 2, "lateral": 1, "heading": 2, "time": 1, "theta": 2}
    assert performances(found) == wanted
    assert found.performance[0] == Performance.ADEQUATE
    assert severity(found, ADEQUATE)[0] == pytest.approx(0.75, rel=1e-6)


@pytest.mark.parametrize(("height", "performance"), [(0.5, 1), (0.5001, 2), (1.0, 2), (1.0001, 3)])
def test_a_tolerance_itself_is_still_met(height, performance):
    time = grid(40.0)
    altitude = np.where((time > 5.0) & (time < 8.0), height, 0.0)
    found = measured(record(time, *approach(time, 2.0), altitude=altitude), reach(2.0))
    assert found.performances["height"][0] == found.performance[0] == performance


def test_an_aircraft_that_drifts_sideways_does_not_hover():
    time = grid(40.0)
    found = measured(record(time, *approach(time, 2.0), V_lat=np.where(time < 15.0, -1.5 * SLOW, 0.0)), reach(2.0))
    assert found.captured[0] == pytest.approx(15.0, abs=0.004)


def test_heading_is_read_across_half_a_turn():
    time = grid(40.0)
    psi = np.pi - 0.05 + 0.1 * np.exp(-((time - 6.0) ** 2))
    wrapped = (psi + np.pi) % (2.0 * np.pi) - np.pi
    history = record(time, *approach(time, 2.0), psi=wrapped)
    history = replace(history, trim={**history.trim, "psi": wrapped[:1]})
    assert measured(history, reach(2.0)).heading[0] == pytest.approx(0.1, rel=1e-6)


def test_a_visit_shorter_than_the_hold_is_no_capture():
    """Within tolerance for 4 s, away, and back for good: the second arrival counts, and the excursion between is overshoot."""
    time = grid(40.0)
    to_go = np.interp(time, [2.0, 7.0, 8.0, 12.0, 13.0, 14.0, 15.0], [25.0, 0.0, 0.0, 0.0, -1.5, -1.5, 0.0])
    speed = np.abs(np.gradient(to_go, time))
    found = measured(record(time, 25.0 - to_go, speed), 25.0)
    assert found.captured[0] == pytest.approx(15.0, abs=0.005)
    assert found.overshoot[0] == pytest.approx(1.5, rel=1e-9)
    assert found.position[0] < 1e-9
    assert performances(found)["overshoot"] == Performance.ADEQUATE


def test_a_late_capture_is_not_adequate_and_keeps_its_time():
    time = grid(50.0)
    found = measured(record(time, *approach(time, 8.0)), reach(8.0))
    assert found.time[0] > ADEQUATE.time
    assert found.performances["time"][0] == found.performance[0] == Performance.NOT_ADEQUATE
    assert severity(found, ADEQUATE)[0] == pytest.approx(found.time[0] / ADEQUATE.time)


def test_not_captured_is_a_result():
    """The aircraft stops 3 m short: the deceleration was flown, and it is not adequate."""
    time = grid(40.0)
    found = measured(record(time, *approach(time, 2.0), theta=np.full(time.size, 0.1)), reach(2.0) + 3.0)
    assert found.status[0] == Status.NOT_CAPTURED
    assert found.status_motion[0] == Status.OK
    assert np.isnan([found.time[0], found.position[0], found.captured[0]]).all()
    assert found.overshoot[0] == 0.0
    assert found.theta[0] == pytest.approx(0.1)
    assert found.performance[0] == Performance.NOT_ADEQUATE
    assert performances(found) == dict.fromkeys(MEASURES, 1) | {"position": 3, "time": 3}
    assert severity(found, ADEQUATE)[0] == math.inf
    assert found.status_of("time")[0] == Status.NOT_CAPTURED
    assert found.status_of("theta")[0] == Status.OK


def test_a_record_that_ends_before_the_time_is_up_decides_nothing():
    whole = grid(40.0)
    for end, status in ((START + LEFT + ADEQUATE.time + HOLD - 0.01, Status.RECORD_TOO_SHORT),
                        (START + LEFT + ADEQUATE.time + HOLD + 0.01, Status.NOT_CAPTURED)):  # fmt: skip
        time = whole[whole <= end]
        found = measured(record(time, *approach(time, 2.0)), reach(2.0) + 3.0)
        assert found.status[0] == status
        undecided = status == Status.RECORD_TOO_SHORT
        assert found.performance[0] == (Performance.UNDEFINED if undecided else Performance.NOT_ADEQUATE)
        assert np.isnan(found.theta[0]) == np.isnan(found.start[0]) == undecided


def test_a_record_that_ends_within_the_hold_decides_nothing():
    time = grid(START + 2.0 * math.log(SPEED / SLOW) + 0.9 * HOLD)
    found = measured(record(time, *approach(time, 2.0)), reach(2.0))
    assert found.status[0] == found.status_motion[0] == Status.RECORD_TOO_SHORT
    assert set(performances(found).values()) == {Performance.UNDEFINED}


def test_without_a_deceleration_nothing_is_measured():
    time = grid(30.0)
    found = measured(record(time, SPEED * time, np.full(time.size, SPEED), start=99.0), 500.0)
    assert found.status[0] == found.status_motion[0] == Status.NO_DECELERATION
    assert found.performance[0] == Performance.UNDEFINED
    assert np.isnan([getattr(found, name)[0] for name in MEASURES]).all()


@pytest.mark.parametrize("code", [Status.DIVERGED, Status.TRIM_FAILED, Status.TABLE_EXCEEDED])
def test_a_failed_run_has_no_performance_and_leaves_the_others_alone(code):
    time = grid(40.0)
    x, speed = (np.stack([a, b]) for a, b in zip(approach(time, 2.0), approach(time, 2.0), strict=True))
    whole = record(time, x, speed)
    alone = measured(whole, reach(2.0))
    broken = {name: np.array(values) for name, values in whole.channels.items()}
    for name in CHANNELS:
        broken[name][1, 500:] = np.nan
    found = measured(replace(whole, channels=broken, status=np.array([0, code])), reach(2.0))
    assert found.status[1] == found.status_motion[1] == code
    assert found.performance.tolist() == [Performance.DESIRED, Performance.UNDEFINED]
    for name in MEASURES:
        assert np.isnan(getattr(found, name)[1])
        assert getattr(found, name)[0] == getattr(alone, name)[0]
    assert np.isnan(severity(found, ADEQUATE)[1])


def test_batch_equals_loop():
    time = grid(40.0)
    pairs = [approach(time, constant, short=short) for constant, short in ((2.0, 0.0), (3.0, 0.4), (4.0, 3.0), (2.5, -1.5))]
    batch = record(time, *(np.stack(values) for values in zip(*pairs, strict=True)))
    together = measured(batch, reach(3.0))
    for run in range(4):
        alone = measured(batch.select(run), reach(3.0))
        for field in fields(Capture):
            if field.name != "performances":
                np.testing.assert_array_equal(getattr(together, field.name)[run], getattr(alone, field.name)[0])


@given(wider=st.lists(st.floats(1.0, 3.0), min_size=7, max_size=7), constant=st.floats(1.5, 4.0), short=st.floats(-2.5, 2.5))
def test_wider_tolerances_never_make_the_verdict_worse(wider, constant, short):
    time = grid(40.0, 0.02)
    history = record(time, *approach(time, constant, short=short), altitude=0.8 * np.exp(-((time - 5.0) ** 2)))
    before = measured(history, reach(constant))
    grown = [replace(t, **{n: f * getattr(t, n) for n, f in zip(MEASURES, wider, strict=True)}) for t in (DESIRED, ADEQUATE)]
    # a longer adequate time may outlast the record: it is left as it is
    grown = [replace(t, time=old.time) for t, old in zip(grown, (DESIRED, ADEQUATE), strict=True)]
    after = measured(history, reach(constant), *grown)
    for name in set(MEASURES) - {"position"}:  # a wider position tolerance captures earlier, farther from the point
        assert after.performances[name][0] <= before.performances[name][0]


@given(shift=st.floats(-50.0, 50.0), mirror=st.sampled_from([-1.0, 1.0]))
def test_place_of_the_start_and_mirror_image_change_nothing(shift, mirror):
    time = grid(40.0, 0.02)
    side = 0.4 * np.exp(-((time - 6.0) ** 2))
    plain = measured(record(time, *approach(time, 2.0), y_east=side, psi=0.2 * side), reach(2.0))
    moved = record(
        time, *approach(time, 2.0), y_east=mirror * side, psi=mirror * 0.2 * side, trim={"x_north": shift, "y_east": -shift}
    )
    other = measured(moved, reach(2.0))
    for name in MEASURES:
        assert getattr(other, name)[0] == pytest.approx(getattr(plain, name)[0], abs=1e-9)


@pytest.mark.order
def test_capture_time_converges_with_the_sampling_interval():
    """Straight lines between samples: second order in the interval."""
    steps = np.array([0.4, 0.2, 0.1, 0.05, 0.025])
    exact = 2.0 * math.log(SPEED / SLOW) + START
    errors = []
    for dt in steps:
        # the mean over places of the crossing between two samples: at one place the error need not fall evenly
        errors.append(np.mean([abs(shifted(dt, part) - exact) for part in np.arange(0.05, 1.0, 0.1)]))
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.2)


def shifted(dt: float, part: float) -> float:
    time = grid(40.0, dt) + part * dt
    return float(measured(record(time, *approach(time, 2.0)), reach(2.0)).captured[0])


@pytest.mark.parametrize("name", list(MEASURES))
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_tolerances_must_be_positive(name, value):
    with pytest.raises(InputError, match=rf"tolerances\.{name}"):
        replace(DESIRED, **{name: value})


def test_refusals():
    time = grid(40.0)
    history = record(time, *approach(time, 2.0))
    with pytest.raises(InputError, match="distance"):
        capture(history, -1.0, HOLD, DESIRED, ADEQUATE)
    with pytest.raises(InputError, match="hold"):
        capture(history, 20.0, 0.0, DESIRED, ADEQUATE)
    with pytest.raises(InputError, match=r"adequate\.height"):
        capture(history, 20.0, HOLD, DESIRED, replace(ADEQUATE, height=0.4))
    fewer = {name: values for name, values in history.channels.items() if name != "psi"}
    with pytest.raises(InputError, match="psi"):
        capture(replace(history, channels=fewer), 20.0, HOLD, DESIRED, ADEQUATE)
