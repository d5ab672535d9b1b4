"""Names, units and signs of commands and channels on their way into a model and out of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simple_models import PULSE

from levelone.campaign.models.mapping import channel_history, command_values, from_si, to_si
from levelone.config.model_table import Channel
from levelone.handling.manoeuvres import step

FEET = Channel("V_lon", "u_fps", "ft/s", 0.3048, -1)


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e3), st.sampled_from([-1, 1]), st.floats(-300.0, 300.0))
@settings(max_examples=50, derandomize=True)
def test_there_and_back(value, scale, sign, offset):
    channel = Channel("q", "Q", "x", scale, sign, None, offset)
    assert float(to_si(channel, from_si(channel, value))) == pytest.approx(value, rel=1e-9, abs=1e-9 * (1.0 + abs(offset)))


def test_unit_and_sign_of_a_channel():
    assert to_si(FEET, [10.0, -1.0]).tolist() == [-3.048, 0.3048]


@pytest.mark.parametrize(("trim", "held", "before", "during"), [(None, 2.0, 2.0, 1.8), (0.5, 2.0, 0.5, 0.3)])
def test_a_command_is_added_to_the_trim(trim, held, before, during):
    """0.2 in levelone's unit are -0.2 in that of a model that counts the other way."""
    values = command_values(Channel("delta_lon", "stick", "1", 1.0, -1, trim), PULSE, [0.5, 1.2], held)
    assert values.tolist() == pytest.approx([before, during])


def test_an_amplitude_in_degrees():
    channel = Channel("theta", "pitch_cmd", "deg", np.pi / 180.0, 1)
    attitude = step("theta", np.pi / 36.0, trim_speed=0.0, flight_mode="attitude")
    assert command_values(channel, attitude, 2.0, 1.0) == pytest.approx(6.0)


def test_a_speed_command_moves_from_the_speed_that_is_flown():
    manoeuvre = step("V_lon", 1.0, trim_speed=0.0)
    time = manoeuvre.ticks()
    history = channel_history(time, {"V_lon": np.full(time.shape, 12.0)}, manoeuvre)
    assert history.channels["V_lon_ref"][0, [0, -1]].tolist() == [12.0, 13.0]
    assert history.change("V_lon_ref")[0, [0, -1]].tolist() == [0.0, 1.0]
    assert np.isnan(history.input_off)


def test_trims_are_means_before_the_input():
    time = PULSE.ticks()
    theta = np.where(time < 1.0, 0.1 + 0.01 * np.sin(2.0 * np.pi * time), 0.3)
    history = channel_history(time, {"theta": theta}, PULSE, delay=0.08)
    assert history.trim["theta"][0] == pytest.approx(0.1, abs=1e-4)
    assert (history.input_on, history.input_off, history.delay[0]) == (1.0, 1.5, 0.08)
