from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from levelone.errors import InputError
from levelone.handling.axes import RATE_AND_ATTITUDE
from levelone.handling.large_amplitude import amplitude_limits, large_amplitude
from levelone.handling.levels import Level
from levelone.handling.records import record
from levelone.status import Status

DT, DEG = 0.01, math.pi / 180.0
REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "fidelity.toml").read_text(encoding="utf-8"))


def held(axis, steady, *, trim=0.0, wrap=False, duration=6.0, status=0):
    """Full control from 1 s on: the rate goes to ``steady`` (rad/s) as a first order of 0.3 s, the attitude is its integral."""
    time = np.arange(round(duration / DT) + 1) * DT
    s = np.maximum(time - 1.0, 0.0)
    rate_name, attitude_name = RATE_AND_ATTITUDE[axis]
    rate = -steady * np.expm1(-s / 0.3)
    attitude = trim + steady * (s + 0.3 * np.expm1(-s / 0.3))
    if wrap:
        attitude = (attitude + math.pi) % (2.0 * math.pi) - math.pi
    channels = {"stick": (time >= 1.0 - 1e-9) * 1.0, rate_name: rate, attitude_name: attitude}
    trims = {"stick": 0.0, rate_name: 0.0, attitude_name: trim}
    return record(time, channels, input_name="stick", input_on=1.0, trim=trims, units={"stick": "1"}, status=status)


@pytest.mark.theory
@pytest.mark.parametrize("axis", ["pitch", "roll", "yaw"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_largest_rate_is_read_with_its_sign(axis, side):
    found = large_amplitude(held(axis, side * 25.0 * DEG), axis)
    np.testing.assert_allclose(found.peak, side * 25.0 * DEG * -math.expm1(-5.0 / 0.3), rtol=1e-9)
    np.testing.assert_allclose(found.time, 6.0, atol=1e-9)
    assert found.status.tolist() == [Status.OK]


@pytest.mark.theory
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_turn_beyond_half_a_circle_is_followed(side):
    """60 deg/s for 5 s in a record of the heading that wraps: 282 deg."""
    history = held("yaw", side * 60.0 * DEG, trim=3.0, wrap=True)
    found = large_amplitude(history, "yaw", "attitude_command", limits=amplitude_limits("roll", "attitude_command", "limited"))
    wanted = side * 60.0 * DEG * (5.0 + 0.3 * math.expm1(-5.0 / 0.3))
    np.testing.assert_allclose(found.peak, wanted, rtol=1e-9)


@pytest.mark.parametrize(("rate", "level"), [(14.0, 1), (12.0, 2), (6.1, 2), (5.9, 3)])
def test_levels_of_pitch_rate_at_moderate_agility(rate, level):
    for side in (-1.0, 1.0):
        assert large_amplitude(held("pitch", side * rate * DEG)).level.tolist() == [level]


@pytest.mark.parametrize(("change", "level"), [(21.0, 1), (19.0, 2), (12.0, 3), (-21.0, 2), (-31.0, 1)])
def test_nose_up_and_nose_down_have_limits_of_their_own(change, level):
    steady = change * DEG / (5.0 + 0.3 * math.expm1(-5.0 / 0.3))
    found = large_amplitude(held("pitch", steady), "pitch", "attitude_command")
    assert found.level.tolist() == [level]
    np.testing.assert_allclose(found.required, (30.0 if change < 0.0 else 20.0) * DEG)


def test_what_cannot_be_read_says_why():
    still, failed = held("roll", 0.0), held("roll", 1.0, status=Status.CRASHED)
    assert large_amplitude(still, "roll").status.tolist() == [Status.NO_ATTITUDE_CHANGE]
    found = large_amplitude(failed, "roll")
    assert found.status.tolist() == [Status.CRASHED]
    assert np.isnan([found.peak[0], found.time[0], found.required[0]]).all()
    assert found.level.tolist() == [Level.UNDEFINED]
    moving = held("roll", 1.0)
    moving.channels["p"][:, :50] = 0.5
    assert large_amplitude(moving, "roll").status.tolist() == [Status.NOT_AT_TRIM]


def test_shipped_limits_grow_with_agility_and_are_drawn_as_unverified():
    for axis, kinds in (("pitch", 2), ("roll", 2), ("yaw", 1)):
        for kind in ("rate_command", "attitude_command")[:kinds]:
            limits = [amplitude_limits(axis, kind, agility) for agility in ("limited", "moderate", "aggressive")]
            assert not any(each.verified for each in limits)
            for side in (0, 1):
                first, second = ([getattr(each, name)[side] for each in limits] for name in ("level_1", "level_2_3"))
                assert first == sorted(first)
                assert second == sorted(second)
                assert all(low <= high for low, high in zip(second, first, strict=True))
    wanted = REFERENCE["yaw"]["rate_moderate_level_1"] * DEG
    assert amplitude_limits("yaw", "rate_command", "moderate").level_1 == pytest.approx((wanted, wanted))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("pich", "rate_command", "moderate"), "did you mean 'pitch'"),
        (("pitch", "rate", "moderate"), "did you mean 'rate_command'"),
        (("pitch", "rate_command", "agressive"), "did you mean 'aggressive'"),
        (("yaw", "attitude_command", "limited"), "no requirement for limited agility"),
    ],
)
def test_bad_input_says_what_is_allowed(arguments, message):
    with pytest.raises(InputError, match=message):
        amplitude_limits(*arguments)


def test_a_file_of_the_user(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(
        '[roll.rate_command]\nlimited = { level_1 = 9.0, level_2_3 = [-4.0, 5.0], confidence = "low" }\n', encoding="utf-8"
    )
    found = amplitude_limits("roll", "rate_command", "limited", path)
    assert found.level_2_3 == pytest.approx((4.0 * DEG, 5.0 * DEG))
    path = tmp_path / "bad.toml"
    path.write_text('[roll.rate_command]\nlimited = { level_1 = "9", level_2_3 = 5.0, confidence = "low" }\n', encoding="utf-8")
    with pytest.raises(InputError, match="must be an angle in deg"):
        amplitude_limits("roll", "rate_command", "limited", path)
