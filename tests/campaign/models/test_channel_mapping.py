"""Names, units and signs of commands and channels on their way into a model and out of it."""

from __future__ import annotations

import numpy as np
import pytest
from simple_models import PULSE

from levelone.campaign.models.mapping import channel_history, command_values, ratio_of_units, real_numbers, sample_times, to_si
from levelone.config.model_table import Channel
from levelone.handling.manoeuvres import pulse, step
from levelone.handling.quickness import attitude_quickness

FEET = Channel("V_lon", "u_fps", "ft/s", 0.3048, -1)


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


def heading_record(heading: float):
    """A turn of 0.2 rad to the right within two seconds, wavering by a microradian before, recorded from 0 to 2 pi."""
    manoeuvre = pulse("delta_ped", 0.2, trim_speed=0.0, flight_mode="direct", duration=8.0, dt=0.01, controller_rate=100.0)
    time = sample_times(manoeuvre)
    since = np.maximum(time - 1.0, 0.0)
    psi = heading + 1e-6 * np.cos(300.0 * time) + 0.2 * (1.0 - (1.0 + 3.0 * since) * np.exp(-3.0 * since))
    rate = 0.2 * 9.0 * since * np.exp(-3.0 * since)
    return channel_history(time, {"psi": np.mod(psi, 2.0 * np.pi), "r": rate}, manoeuvre)


def test_a_heading_about_north_is_trimmed_and_read_as_any_other():
    """Half of the samples before the input are 0, the others 2 pi: their mean would be south."""
    north, east = (heading_record(heading) for heading in (0.0, 0.5 * np.pi))
    assert np.cos(north.trim["psi"][0]) == pytest.approx(1.0, abs=1e-9)
    assert np.ptp(north.change("psi")[0]) == pytest.approx(np.ptp(east.change("psi")[0]), abs=1e-9)
    first, second = (attitude_quickness(record, "yaw") for record in (north, east))
    assert first.quickness[0] == pytest.approx(second.quickness[0], rel=1e-9)
    assert first.delta_theta_pk[0] == pytest.approx(0.2, abs=0.001)


@pytest.mark.parametrize(
    "values",
    [
        [1j, 2.0],
        np.complex128(1.0 + 2.0j),
        np.array([1.0 + 0.0j]),
        np.True_,
        [True, False],
        [1.0, True],
        np.array([1.0, True], dtype=object),
        np.array(["2020-01-01"], dtype="M8[s]"),
        [10**400],
        ["high"],
    ],
)
def test_what_is_no_real_number(values):
    with pytest.raises((TypeError, ValueError)):
        real_numbers(values)
    with pytest.raises((TypeError, ValueError)):
        to_si(FEET, values)


def test_masked_and_missing_numbers_are_not_numbers():
    whole = np.ma.array([1, 9], mask=[False, True])
    for values in (whole, whole.astype(float), [1.0, None]):
        np.testing.assert_array_equal(real_numbers(values), [1.0, np.nan])
    assert np.isnan(real_numbers(np.ma.masked))
    np.testing.assert_array_equal(to_si(FEET, whole), [-0.3048, np.nan])


@pytest.mark.parametrize(("dt", "count"), [(0.004, 2501), (0.1, 101), (0.03, 334)])
def test_samples_up_to_the_end_of_the_manoeuvre(dt, count):
    """0.1 and 0.004 divide 10 s though not in binary; 0.03 does not."""
    time = sample_times(step("delta_lon", 0.2, trim_speed=0.0, flight_mode="direct", dt=dt, controller_rate=1.0 / dt))
    np.testing.assert_allclose(time, dt * np.arange(count), rtol=1e-14)


@pytest.mark.parametrize(
    ("unit", "own", "ratio"),
    [("ft", "ft", 1.0), ("m", "ft", 1.0 / 0.3048), ("deg", "ft", np.nan), ("furlong", "ft", None), ("ft", "furlong", None)],
)
def test_units_against_each_other(unit, own, ratio):
    assert ratio_of_units(unit, own) == (ratio if ratio is None else pytest.approx(ratio, nan_ok=True))
