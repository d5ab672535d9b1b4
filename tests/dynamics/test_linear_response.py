"""The linearisation against small-amplitude flights of the nonlinear model: gain to 1e-4, phase to 0.05 deg."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from vehicles import vehicle

from levelone.dynamics import linearize, simulate
from levelone.errors import InputError
from levelone.handling.manoeuvres import Manoeuvre
from levelone.status import Status
from levelone.vehicle import PID, SENSOR_CHANNELS, Sensors, Vehicle

OMEGA = np.array([0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 30.0])
PERIOD, SETTLED, CYCLES = 0.004, 45.0, 6


def sensor_unit(lag: dict[str, float], delay: dict[str, int]) -> Sensors:
    """Lags (s) and delays (periods) of named channels."""
    return Sensors(
        np.array([lag.get(name, 0.0) for name in SENSOR_CHANNELS]), np.array([delay.get(name, 0) for name in SENSOR_CHANNELS])
    )


def flown_response(
    monkeypatch: pytest.MonkeyPatch, craft: Vehicle, omega: float, channels: Sequence[str], amplitude: float = 1e-3, **options
) -> np.ndarray:
    """Complex amplitude of each channel over that of a sinusoidal command, by least squares over whole cycles after settling."""
    fields = {"flight_mode": "velocity", "axis": "V_lon", "trim_speed": 5.0, **options}
    cycles = CYCLES * max(1, round(omega / 3.0))
    duration = SETTLED + cycles * 2.0 * np.pi / omega
    manoeuvre = Manoeuvre("sine", shape="step", amplitude=amplitude, duration=duration, **fields)
    with monkeypatch.context() as patch:
        patch.setattr(Manoeuvre, "command", lambda self, time: amplitude * np.sin(omega * np.asarray(time)))
        history = simulate(craft, manoeuvre, channels=channels)
    assert history.status[0] == Status.OK
    late = history.time >= SETTLED
    t = history.time[late]
    basis = np.stack([np.sin(omega * t), np.cos(omega * t), np.ones_like(t)], axis=1)
    recorded = np.array([history.channels[name][0, late] for name in channels]).T
    sine, cosine, _ = np.linalg.lstsq(basis, recorded, rcond=None)[0]
    return (sine + 1j * cosine) / amplitude


def assert_same_response(linear: np.ndarray, flown: np.ndarray) -> None:
    """Acceptance: 1e-4 in gain, 0.05 deg in phase."""
    ratio = flown / linear
    np.testing.assert_allclose(np.abs(ratio), 1.0, atol=1e-4)
    np.testing.assert_allclose(np.degrees(np.angle(ratio)), 0.0, atol=0.05)


CASES = {
    "no delay": {},
    "fractional delay": {"rotors": {"tau_d": 0.0137}},
    "delay of whole periods": {"rotors": {"tau_d": 0.012}},
    "motor lag": {"rotors": {"tau_d": 0.0137, "motor_lag": 0.03}},
    "command lag": {"law": {"command_lag": 0.2}},
    "sensors": {
        "sensors": sensor_unit({"q": 0.02, "theta": 0.01, "V_lon": 0.1}, {"q": 1, "theta": 2, "V_lon": 5, "V_vert": 3}),
        "rotors": {"tau_d": 0.0137},
    },
    "schedule at a knot": {
        "knots": (0.0, 3.0, 5.0, 9.0, 15.0),
        "aero": {
            "C_malpha": (-0.2, -0.4, -0.54, -1.2, -1.3), "C_Lalpha": (4.0, 4.5, 5.1, 6.5, 6.6), "C_L0": (0.5, 0.6, 0.77, 0.7, 0.6),
        },
    },
    "alphadot": {"aero": {"C_Lalphadot": 2.0, "C_malphadot": -6.0}},
    "local velocity": {"rotors": {"local_velocity": True}},
}  # fmt: skip


@pytest.mark.theory
@pytest.mark.parametrize("case", CASES)
def test_linear_response_is_that_of_a_small_flight(monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    craft = vehicle(**CASES[case])
    model = linearize(craft, 5.0)
    assert model.status[0] == Status.OK
    omega = OMEGA if case in {"no delay", "fractional delay", "sensors"} else OMEGA[1::3]
    channels = ("q", "theta", "V_lon")
    linear = np.array([model.frequency_response("V_lon", name, omega).value[0] for name in channels]).T
    flown = np.array([flown_response(monkeypatch, craft, w, channels) for w in omega])
    assert_same_response(linear, flown)


@pytest.mark.theory
@pytest.mark.parametrize(
    ("mode", "axis", "output", "amplitude"),
    [
        ("velocity", "V_lat", "phi", 1e-3), ("velocity", "V_vert", "V_vert", 1e-3), ("velocity", "yaw_rate", "r", 1e-4),
        ("attitude", "theta", "q", 1e-4), ("attitude", "phi", "p", 1e-4), ("rate", "q", "q", 1e-4), ("rate", "p", "p", 1e-4),
    ],
)  # fmt: skip
def test_every_axis_of_every_mode(monkeypatch: pytest.MonkeyPatch, mode: str, axis: str, output: str, amplitude: float) -> None:
    craft = vehicle(rotors={"tau_d": 0.006})
    # without loops around them, slow modes of the vehicle take it away from its trim: only faster answers can be compared
    omega = np.array([6.0, 15.0] if mode == "rate" else [2.0, 7.0])
    options = {"flight_mode": mode, "axis": axis, "trim_speed": 3.0, "trim_climb": 0.5}
    linear = linearize(craft, 3.0, climb=0.5, flight_mode=mode).frequency_response(axis, output, omega).value[0]
    flown = np.array([flown_response(monkeypatch, craft, w, (output,), amplitude, **options)[0] for w in omega])
    assert_same_response(linear, flown)


def test_steady_gain_of_a_speed_command_is_one() -> None:
    """The integrator of the velocity loop: at low frequency the speed follows its command, pitch rate vanishes."""
    model = linearize(vehicle(), 5.0)
    omega = np.array([1e-3])
    np.testing.assert_allclose(model.frequency_response("V_lon", "V_lon", omega).value[0], 1.0, atol=1e-2)
    np.testing.assert_allclose(model.frequency_response("V_lon", "q", omega).value[0], 0.0, atol=1e-4)


def test_longitudinal_and_lateral_motion_are_apart() -> None:
    """Symmetric trim: no lateral answer to a speed command, no longitudinal one to a side command."""
    model, omega = linearize(vehicle(), 5.0), np.array([1.0, 5.0])
    for command, output in (("V_lon", "phi"), ("V_lon", "r"), ("V_lat", "theta"), ("yaw_rate", "V_lon")):
        np.testing.assert_allclose(model.frequency_response(command, output, omega).value, 0.0, atol=1e-9)


def test_derivatives_settle_with_the_step() -> None:
    assert linearize(vehicle(), 5.0).difference_error[0] < 1e-6


def test_frequencies_beyond_nyquist_and_wrong_names_are_refused() -> None:
    model = linearize(vehicle(), 5.0)
    with pytest.raises(InputError, match=r"omega: 800 rad/s reaches the Nyquist frequency of 785\.4 rad/s"):
        model.frequency_response("V_lon", "q", np.array([1.0, 800.0]))
    with pytest.raises(InputError, match="command: unknown name 'V_long'; did you mean 'V_lon'"):
        model.frequency_response("V_long", "q", np.array([1.0]))
    with pytest.raises(InputError, match="output: unknown name 'Theta'; did you mean 'theta'"):
        model.frequency_response("V_lon", "Theta", np.array([1.0]))
    with pytest.raises(InputError, match="flight_mode: unknown name 'velocty'; did you mean 'velocity'"):
        linearize(vehicle(), 5.0, flight_mode="velocty")


def test_a_vehicle_without_trim_has_no_response() -> None:
    model = linearize(vehicle(law={"vertical": PID(2.0, 1.0, 0.0, 0.05, 6.0)}), 8.0, climb=-1.0)
    assert model.status[0] == Status.TRIM_FAILED
    assert np.isnan(model.frequency_response("V_lon", "q", np.array([1.0, 2.0])).value).all()
