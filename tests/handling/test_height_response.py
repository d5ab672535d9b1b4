from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.errors import InputError
from levelone.handling.height_response import first_order, height_response
from levelone.handling.levels import Boundaries, Level, load_boundaries
from levelone.handling.records import record
from levelone.status import Status

DT = 0.01
REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "fidelity.toml").read_text(encoding="utf-8"))


def climb(time, gain, time_constant, delay, step=0.2, on=1.0):
    """Climb rate of a first order with delay after a step (closed form)."""
    s = np.maximum(time - on - delay, 0.0)
    return gain * step * -np.expm1(-s / time_constant)


def flown(rates, *, step=0.2, on=1.0, duration=8.0, status=0, stick=None):
    time = np.arange(round(duration / DT) + 1) * DT
    rates = rates(time) if callable(rates) else rates
    stick = step * (time >= on - 1e-9) if stick is None else stick(time)
    channels = {"delta_col": 0.5 + stick, "V_vert": rates}
    return record(
        time,
        channels,
        input_name="delta_col",
        input_on=on,
        trim={"delta_col": 0.5, "V_vert": 0.0},
        units={"delta_col": "1"},
        status=status,
    )


@pytest.mark.theory
@settings(max_examples=15, deadline=None)
@given(gain=st.floats(-20.0, 20.0).filter(lambda x: abs(x) > 0.1), time_constant=st.floats(0.2, 15.0), delay=st.floats(0.01, 0.6))
def test_a_first_order_with_delay_is_found_again(gain, time_constant, delay):
    found = height_response(flown(lambda time: climb(time, gain, time_constant, delay)))
    assert found.status.tolist() == [Status.OK]
    np.testing.assert_allclose(found.gain, gain, rtol=1e-5)
    np.testing.assert_allclose(found.time_constant, time_constant, rtol=1e-5)
    np.testing.assert_allclose(found.delay, delay, atol=1e-6)
    np.testing.assert_allclose(found.determination, 1.0, atol=1e-6)


@pytest.mark.theory
@pytest.mark.parametrize("delay", [0.0, 0.003, 0.01, 0.1234])
def test_first_order_is_exact_between_and_at_samples(delay):
    time = np.arange(400) * DT
    np.testing.assert_allclose(
        first_order(np.ones(400), 0.7, delay, DT), climb(time, 1.0, 0.7, delay, 1.0, 0.0), rtol=1e-10, atol=1e-12
    )


@pytest.mark.theory
@pytest.mark.parametrize(("parts", "late"), [(40, 0), (40, 3), (300, 29)])
def test_a_step_that_takes_its_time_adds_nothing_to_the_delay(parts, late):
    """The control goes to its new value over 0.4 or 3 s (superposition of small steps), and counts as begun on its way."""

    def rates(time):
        return np.mean([climb(time, 10.0, 2.0, 0.1, on=1.0 + k * DT) for k in range(parts)], axis=0)

    def stick(time):
        return 0.2 * np.mean([time >= 1.0 + k * DT - 1e-9 for k in range(parts)], axis=0)

    found = height_response(replace(flown(rates, stick=stick), input_on=1.0 + late * DT))
    np.testing.assert_allclose([found.time_constant[0], found.delay[0]], [2.0, 0.1], rtol=1e-4)


@pytest.mark.parametrize(
    ("time_constant", "delay", "level"),
    [
        (4.9, 0.19, Level.LEVEL_1),
        (5.1, 0.19, Level.LEVEL_2),
        (4.9, 0.21, Level.LEVEL_2),
        (20.0, 0.29, Level.LEVEL_2),
        (1.0, 0.31, Level.LEVEL_3),
    ],
)
def test_levels_lie_where_the_requirement_says(time_constant, delay, level):
    assert height_response(flown(lambda time: climb(time, 10.0, time_constant, delay))).level.tolist() == [level]


def test_shipped_limits_are_those_of_the_reference():
    limits, wanted = load_boundaries().limits["height_response"], REFERENCE["height_response"]
    assert [limits["level_1_T"], limits["level_1_tau"], limits["level_2_tau"]] == [*wanted["level_1"], wanted["level_2_tau"]]


def test_an_integrator_has_no_time_constant_but_a_level():
    found = height_response(flown(lambda time: 2.0 * np.maximum(time - 1.1, 0.0)))
    assert math.isnan(found.time_constant[0])
    assert math.isnan(found.gain[0])
    assert found.status_time_constant.tolist() == [Status.RECORD_TOO_SHORT]
    assert found.status.tolist() == [Status.OK]
    np.testing.assert_allclose(found.delay, 0.1, atol=2e-3)
    assert found.level.tolist() == [Level.LEVEL_2]


def test_a_response_of_no_first_order_keeps_its_numbers_and_gets_no_level():
    """An oscillation about the final climb rate."""

    def rates(time):
        s = np.maximum(time - 1.0, 0.0)
        return 2.0 * (1.0 - np.cos(4.0 * s) * np.exp(-0.1 * s))

    found = height_response(flown(rates))
    assert found.status.tolist() == [Status.OUTSIDE_REQUIREMENT]
    assert found.level.tolist() == [Level.OUTSIDE]
    assert np.isfinite([found.time_constant[0], found.delay[0]]).all()
    assert not 0.97 <= found.determination[0] <= 1.03


@pytest.mark.theory
def test_noise_moves_the_estimate_by_little_and_determination_stays():
    rng = np.random.default_rng(5)
    found = [
        height_response(flown(lambda time: climb(time, 10.0, 2.0, 0.15) + 0.05 * rng.standard_normal(time.size))) for _ in range(10)
    ]
    constants = np.array([each.time_constant[0] for each in found])
    delays = np.array([each.delay[0] for each in found])
    assert abs(constants.mean() - 2.0) < 3.0 * constants.std() / math.sqrt(10.0)
    assert abs(delays.mean() - 0.15) < 3.0 * delays.std() / math.sqrt(10.0)
    assert constants.std() < 0.1
    assert all(0.97 <= each.determination[0] <= 1.03 for each in found)


@pytest.mark.parametrize(
    ("history", "status"),
    [
        (flown(lambda time: climb(time, 10.0, 2.0, 0.1), duration=5.0), Status.RECORD_TOO_SHORT),
        (flown(lambda time: climb(time, 10.0, 2.0, 0.1), stick=lambda time: 0.0 * time), Status.NO_STEADY_COMMAND),
        (flown(lambda time: climb(time, 10.0, 2.0, 0.1), stick=lambda t: 0.2 * (np.abs(t - 2.0) < 1.0)), Status.NO_STEADY_COMMAND),
        (flown(lambda time: 0.5 + climb(time, 10.0, 2.0, 0.1)), Status.NOT_AT_TRIM),
        (flown(lambda time: np.where(time > 3.0, np.nan, climb(time, 10.0, 2.0, 0.1))), Status.RECORD_TOO_SHORT),
        (flown(lambda time: 0.0 * time), Status.MODEL_FAILED),
        (flown(lambda time: climb(time, 10.0, 2.0, 0.1), status=Status.DIVERGED), Status.DIVERGED),
    ],
)
def test_what_cannot_be_read_says_why(history, status):
    found = height_response(history)
    assert found.status.tolist() == [status]
    assert np.isnan([found.gain[0], found.time_constant[0], found.delay[0], found.determination[0]]).all()
    assert found.level.tolist() == [Level.UNDEFINED]


def test_bad_input_says_what_is_allowed():
    history = flown(lambda time: climb(time, 10.0, 2.0, 0.1))
    with pytest.raises(InputError, match="did you mean 'V_vert'"):
        height_response(history, "V_vertical")
    with pytest.raises(InputError, match="must be positive"):
        height_response(history, window=0.0)
    shipped = load_boundaries()
    for limits, message in (
        ({}, "unknown name 'height_response'"),
        ({"level_1_T": [1.0, 2.0], "level_1_tau": 0.2, "level_2_tau": 0.3}, "a list"),
    ):
        given = {"height_response": limits} if limits else {}
        other = Boundaries(shipped.name, "", shipped.attitude_quickness, shipped.bandwidth, shipped.dynamic_stability, given)
        with pytest.raises(InputError, match=message):
            height_response(history, boundaries=other)
