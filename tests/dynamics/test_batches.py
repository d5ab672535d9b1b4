"""A batch is its loop, whatever the threads, the chunks and the order; failures stay in their rows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vehicles import K_T, POSITION, rotor_table, vehicle

from levelone.dynamics import linearize, simulate
from levelone.errors import InputError
from levelone.handling.manoeuvres import Manoeuvre, step
from levelone.status import Status
from levelone.vehicle import PID, Vehicle, VehicleBatch, vary

CRAFT = vehicle(rotors={"tau_d": 0.0137})
TARGETS = ["M", "I_y", "K_T", "tau_d", "C_malpha"]
POINTS = np.array([7.0, 0.7237, K_T, 0.02, -0.54]) * (1.0 + 0.3 * np.random.default_rng(1).uniform(-1, 1, (9, 5)))
STEP = step("V_lon", 0.5, trim_speed=5.0, duration=2.0)


def family(points: np.ndarray = POINTS) -> VehicleBatch:
    return vary(CRAFT, TARGETS, points, 5.0)


TOGETHER = simulate(family(), STEP, threads=1, chunk=100)


@given(st.integers(1, 10), st.integers(1, 4))
@settings(max_examples=8, deadline=None)
def test_threads_and_chunks_change_nothing(chunk: int, threads: int) -> None:
    other = simulate(family(), STEP, threads=threads, chunk=chunk)
    for name, values in TOGETHER.channels.items():
        assert np.array_equal(other.channels[name], values), name
    for name, values in TOGETHER.extremes.items():
        assert np.array_equal(other.extremes[name], values), name


def test_a_batch_is_its_loop_bit_by_bit() -> None:
    for run, point in enumerate(POINTS):
        alone = simulate(family(point[None]), STEP)
        for name, values in alone.channels.items():
            assert np.array_equal(values[0], TOGETHER.channels[name][run]), (run, name)


def test_a_list_of_vehicles_is_a_batch() -> None:
    """The same mass once as a vehicle of its own, once as a varied one."""
    heavy = vehicle(mass={"mass": 8.0}, rotors={"tau_d": 0.0137})
    heavy = type(heavy)("heavy", heavy.airframe, CRAFT.controller)
    listed = simulate([CRAFT, heavy], STEP)
    varied = simulate(vary(CRAFT, ["M"], np.array([[7.0], [8.0]]), 5.0), STEP)
    assert np.array_equal(listed.channels["q"], varied.channels["q"])


def several_controllers() -> list[Vehicle]:
    """Vehicles whose gains, rotor arms, motors and throttle curves differ, each with a controller designed for it."""
    stretched = POSITION * np.array([1.3, 1.0, 1.0])
    return [
        CRAFT,
        vehicle(law={"pitch": 6.0, "pitch_rate": PID(4.0, 3.0, 0.2, 0.03, 40.0), "command_lag": 0.1}),
        vehicle(rotors={"position": stretched, "motor_lag": 0.03}),
        vehicle(rotors={"throttle_exponent": 0.6, "tau_d": 0.021}),
    ]


def test_vehicles_with_controllers_of_their_own_fly_as_they_do_alone() -> None:
    several = several_controllers()
    together = simulate(several, STEP, chunk=3)
    for run, alone in enumerate(several):
        for name, values in simulate(alone, STEP).channels.items():
            assert np.array_equal(values[0], together.channels[name][run]), (run, name)
    last = together.channels["q"][:, 100:]
    assert all(np.abs(last[0] - last[run]).max() > 1e-3 for run in (1, 2, 3))


def test_each_linear_model_is_closed_by_its_own_controller() -> None:
    several, omega = several_controllers(), np.array([0.5, 3.0, 12.0])
    together = linearize(several, 5.0)
    response = together.frequency_response("V_lon", "q", omega).value
    for run, craft in enumerate(several):
        alone = linearize(craft, 5.0)
        np.testing.assert_allclose(alone.frequency_response("V_lon", "q", omega).value[0], response[run], rtol=1e-7)
        assert alone.dominant("V_lon", "q") == pytest.approx(together.dominant("V_lon", "q", run), rel=1e-6)


def test_rotors_at_other_places_are_refused_where_each_sees_its_own_flow() -> None:
    crafts = [vehicle(rotors={"local_velocity": True, "position": POSITION * s}) for s in (1.0, 1.1)]
    with pytest.raises(InputError, match=r"vehicles: 'test' has another rotors\.position"):
        simulate(crafts, STEP)


@given(st.permutations(range(9)))
@settings(max_examples=5, deadline=None)
def test_a_permuted_batch_gives_permuted_runs(order: list[int]) -> None:
    shuffled = simulate(family(POINTS[order]), STEP, channels=("q", "theta"))
    for name in ("q", "theta"):
        assert np.array_equal(shuffled.channels[name], TOGETHER.channels[name][order])


def test_the_linear_model_of_a_batch_is_that_of_its_loop() -> None:
    omega = np.array([0.5, 3.0, 12.0])
    together = linearize(family(), 5.0).frequency_response("V_lon", "q", omega).value
    for run, point in enumerate(POINTS):
        alone = linearize(family(point[None]), 5.0).frequency_response("V_lon", "q", omega).value
        np.testing.assert_allclose(alone[0], together[run], rtol=1e-9)


def test_failed_runs_are_rows_of_nan_with_their_status() -> None:
    points = POINTS.copy()
    points[[0, 4], 0] = 40.0
    history = simulate(family(points), STEP)
    failed = np.isin(np.arange(9), [0, 4])
    assert (history.status == np.where(failed, Status.TRIM_FAILED, Status.OK)).all()
    for name, values in history.channels.items():
        if name != "V_lon_ref":
            assert np.isnan(values[failed]).all(), name
            assert np.array_equal(values[~failed], TOGETHER.channels[name][~failed]), name
    for values in (*history.extremes.values(), history.trim["theta"]):
        assert (np.isnan(values) == failed).all()


def test_a_failed_first_run_spoils_no_linear_model() -> None:
    omega = np.array([0.5, 3.0, 12.0])
    points = POINTS.copy()
    points[0, 0] = 40.0
    model = linearize(family(points), 5.0)
    assert model.status[0] == Status.TRIM_FAILED
    response = model.frequency_response("V_lon", "q", omega).value
    assert np.isnan(response[0]).all()
    expected = linearize(family(), 5.0).frequency_response("V_lon", "q", omega).value
    np.testing.assert_allclose(response[1:], expected[1:], rtol=1e-6)


def test_runs_that_share_nothing_are_refused() -> None:
    others = {
        "rotor table": vehicle(rotors={"table": rotor_table(16.0)}),
        "controller rate": vehicle(law={"rate": 125.0}),
        "controller's trim_speeds": vehicle(law={"trim_speeds": (-5.0, 15.0, 2.0)}),
    }
    for what, other in others.items():
        with pytest.raises(InputError, match=f"vehicles: 'test' has another {what} than 'test'"):
            simulate([CRAFT, other], STEP)
    with pytest.raises(InputError, match="vehicles: an empty list"):
        simulate([], STEP)


def test_only_the_channels_asked_for_are_kept() -> None:
    history = simulate(family(), STEP, channels=("theta", "throttle_8"))
    assert set(history.channels) == {"theta", "throttle_8", "V_lon_ref"}
    for name in ("theta", "throttle_8"):
        assert np.array_equal(history.channels[name], TOGETHER.channels[name])
    with pytest.raises(InputError, match="unknown name 'theta_'; did you mean 'theta'"):
        simulate(CRAFT, STEP, channels=("theta_",))


def test_the_record_says_what_was_commanded_and_how_late_it_arrives() -> None:
    np.testing.assert_array_equal(TOGETHER.channels["V_lon_ref"][3], np.where(TOGETHER.time >= 1.0 - 1e-9, 5.5, 5.0))
    np.testing.assert_array_equal(TOGETHER.delay, POINTS[:, 3])
    assert TOGETHER.units["V_lon_ref"] == "m/s"
    assert TOGETHER.input_on == 1.0
    assert np.isnan(TOGETHER.input_off)


@pytest.mark.parametrize(
    ("manoeuvre", "text"),
    [
        ({"controller_rate": 100.0, "dt": 0.01}, r"controller_rate: 100\.0 Hz, but the vehicle's controller runs at 250\.0 Hz"),
        ({"trim_speed": 25.0}, r"trim_speed: airspeed 25 m/s exceeds the rotor table's 20 m/s"),
        ({"trim_speed": 15.0, "wind": (-6.0, 0.0, 0.0)}, r"trim_speed: airspeed 21 m/s exceeds the rotor table's 20 m/s"),
    ],
)
def test_what_no_run_could_survive_is_refused_beforehand(manoeuvre: dict, text: str) -> None:
    hold = {"name": "x", "flight_mode": "velocity", "axis": "V_lon", "trim_speed": 5.0, "shape": "none"}
    with pytest.raises(InputError, match=text):
        simulate(CRAFT, Manoeuvre(**{**hold, **manoeuvre}))


def test_beyond_the_aerodynamic_knots_is_refused_too() -> None:
    craft = vehicle(knots=(0.0, 12.0))
    with pytest.raises(InputError, match=r"airspeed 13 m/s exceeds the aerodynamic tables' 12 m/s"):
        simulate(craft, step("V_lon", 0.1, trim_speed=13.0))


def test_a_gust_of_the_wrong_shape_is_refused() -> None:
    with pytest.raises(InputError, match=r"gust: must be finite numbers of shape \(501, 3\)"):
        simulate(CRAFT, STEP, gust=np.zeros((500, 3)))
    bad = np.zeros((501, 3))
    bad[7, 1] = np.nan
    with pytest.raises(InputError, match="gust"):
        simulate(CRAFT, STEP, gust=bad)


def test_from_the_design_trim_only_the_design_itself_stands_still() -> None:
    """Light, nominal and heavy: all begin in the nominal attitude; what differs from the design rises or sinks at once."""
    hold = Manoeuvre("hold", "velocity", "V_lon", 5.0, shape="none", duration=3.0)
    batch = vary(CRAFT, ["M"], np.array([[6.5], [7.0], [7.5]]), 5.0)
    own, design = simulate(batch, hold), simulate(batch, hold, start="design trim")
    assert np.array_equal(design.channels["altitude"][1], own.channels["altitude"][1])
    assert np.ptp(design.channels["theta"][:, 0]) == 0.0
    assert np.ptp(own.channels["theta"][:, 0]) > 1e-4
    light, heavy = design.channels["V_vert"][0, 25], design.channels["V_vert"][2, 25]  # 0.1 s of the weight's excess
    assert light == pytest.approx(0.1 * 9.80665 * 0.5 / 6.5, rel=0.2)
    assert heavy == pytest.approx(-0.1 * 9.80665 * 0.5 / 7.5, rel=0.2)
    assert np.abs(own.channels["V_vert"]).max() < 1e-6
