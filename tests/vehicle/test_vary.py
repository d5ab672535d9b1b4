"""What a study may vary: each target sets what it says, nothing else, and never the controller."""

from __future__ import annotations

import numpy as np
import pytest
from vehicles import AERO, K_T, attitude, rotor_table, vehicle

from levelone.dynamics import Command, State, derivative
from levelone.errors import InputError
from levelone.vehicle import COEFFICIENTS, TARGET_UNITS, TARGETS, Vehicle, batch_of, nominal_value, vary

CRAFT = vehicle(knots=(0.0, 5.0, 10.0), aero={"C_malpha": (-0.3, -0.6, -0.9), "C_np": (0.0, 0.0, 0.0)})
STATE = State(0.0, 0.0, 0.0, 6.0, 0.4, 0.5, *attitude(0.1, 0.05, 0.3), 0.2, -0.3, 0.1)
COMMAND = Command((0.7, 0.6, 0.65, 0.7, 0.72, 0.68, 0.7, 0.6))
AS_BUILT = {
    "M": {"mass": {"mass": 8.4}},
    "I_x": {"mass": {"I_xx": 1.4}},
    "I_y": {"mass": {"I_yy": 0.9}},
    "I_z": {"mass": {"I_zz": 2.2}},
    "I_xz": {"mass": {"I_xz": 0.1}},
    "rho": {"air_density": 1.0},
    "K_T": {"rotors": {"K_T": 1.2 * K_T}},
    "T_u": {"rotors": {"T_u": 0.8}},
    **{name: {"aero": {name: 1.5 * AERO[name]}} for name in ("C_L0", "C_Dalpha", "C_mq", "C_Ybeta", "C_nr")},
    "C_malphadot": {"aero": {"C_malphadot": -4.0}},
}


def rates(craft: Vehicle) -> np.ndarray:
    return np.array(derivative(craft, STATE, COMMAND))


def varied(craft: Vehicle, target: str, value: float, state: State = STATE, command: Command = COMMAND) -> np.ndarray:
    """Rates of the vehicle with one number varied; the derivative takes whatever ``batch_of`` takes."""
    return np.array(derivative(vary(craft, [target], np.array([[value]]), 5.0), state, command))


@pytest.mark.parametrize("target", AS_BUILT)
def test_a_varied_vehicle_is_the_one_built_with_that_number(target: str) -> None:
    changes = AS_BUILT[target]
    ((_, numbers),) = changes.items()
    value = numbers if isinstance(numbers, float) else next(iter(numbers.values()))
    expected = rates(vehicle(design=vehicle().airframe, **changes))
    assert np.abs(expected - rates(vehicle())).max() > 1e-4
    np.testing.assert_allclose(varied(vehicle(), target, value), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("target", "field"), [("tau_d", "tau_d"), ("motor_lag", "motor_lag")])
def test_lateness_is_set(target: str, field: str) -> None:
    batch = vary(CRAFT, [target], np.array([[0.01], [0.03]]), 5.0)
    np.testing.assert_array_equal(batch.scalars[field], [0.01, 0.03])


def test_thrust_coefficient_scales_thrust_and_leaves_torque() -> None:
    """Yaw comes from torque only: level, at rest, with one spin direction throttled up."""
    uneven = Command(tuple(np.where(np.arange(8) % 2, 0.6, 0.7)))
    craft = vehicle(mass={"I_xz": 0.0})
    before, after = (varied(craft, "K_T", value, State(), uneven) for value in (K_T, 1.5 * K_T))
    assert 9.80665 - after[5] == pytest.approx(1.5 * (9.80665 - before[5]), rel=1e-12)
    assert after[12] == before[12]


def test_a_scheduled_coefficient_is_scaled_about_the_speed_asked_for() -> None:
    batch = vary(CRAFT, ["C_malpha"], np.array([[-0.6], [-1.2]]), 5.0)
    column = COEFFICIENTS.index("C_malpha")
    # knots lie at the left ends of the segments
    np.testing.assert_allclose(batch.cubics[0, :, 0, column], [-0.3, -0.6])
    np.testing.assert_allclose(batch.cubics[1], np.where(np.arange(len(COEFFICIENTS)) == column, 2.0, 1.0) * batch.cubics[0])


def test_a_coefficient_that_is_zero_there_is_shifted() -> None:
    batch = vary(CRAFT, ["C_np"], np.array([[-0.07]]), 5.0)
    np.testing.assert_allclose(batch.cubics[0, :, 0, COEFFICIENTS.index("C_np")], -0.07)
    np.testing.assert_allclose(batch.cubics[0, :, 1:, COEFFICIENTS.index("C_np")], 0.0)


def test_the_nominal_value_changes_nothing() -> None:
    targets = list(TARGETS)
    point = np.array([[nominal_value(CRAFT, target, 5.0) for target in targets]])
    same, base = vary(CRAFT, targets, point, 5.0), batch_of(CRAFT)
    for name in base.scalars.dtype.names:
        np.testing.assert_allclose(same.scalars[name], base.scalars[name], rtol=1e-14)
    np.testing.assert_allclose(same.cubics, base.cubics, rtol=1e-13, atol=1e-16)
    assert set(TARGET_UNITS) == set(TARGETS)


def test_the_controller_stays_that_of_the_nominal_vehicle() -> None:
    batch = vary(CRAFT, ["M", "I_y"], np.array([[9.0, 1.0]]), 5.0)
    assert batch.nominal.controller is CRAFT.controller
    assert batch.nominal.controller.design.mass.mass == 7.0


@pytest.mark.parametrize(
    ("target", "value", "text"),
    [
        ("mass", 7.0, "target: unknown name 'mass'"),
        ("C_malfa", 7.0, "target: unknown name 'C_malfa'; did you mean 'C_malpha'"),
        ("M", -1.0, r"M: must be positive, got -1\.0"),
        ("K_T", 0.0, r"K_T: must be positive, got 0\.0"),
        ("tau_d", -0.01, r"tau_d: must not be negative, got -0\.01"),
        ("C_L0", np.nan, "C_L0: values must be finite numbers"),
        ("I_xz", 5.0, "I_xz: some points make the inertia matrix indefinite"),
    ],
)
def test_what_no_vehicle_can_have_is_refused(target: str, value: float, text: str) -> None:
    with pytest.raises(InputError, match=text):
        vary(CRAFT, [target], np.array([[value]]), 5.0)


def test_points_must_fit_their_targets() -> None:
    with pytest.raises(InputError, match=r"points: shape \(1, 2\) does not fit 1 targets"):
        vary(CRAFT, ["M"], np.array([[7.0, 1.0]]), 5.0)


def test_a_batch_of_unlike_vehicles_is_refused() -> None:
    """What kernels read once for all must be the same for all."""
    base = vehicle()

    def like(**changes) -> Vehicle:
        other = vehicle(**changes)
        return Vehicle("other", other.airframe, base.controller)

    unlike = {
        "controller rate": vehicle(law={"rate": 125.0}),
        "rotor table": like(rotors={"table": rotor_table(16.0)}),
        "rotors.axis": like(rotors={"axis": -base.airframe.rotors.axis}),
        "rotors.local_velocity": like(rotors={"local_velocity": True}),
        "set of schedule knots": like(knots=(0.0, 10.0)),
    }
    for what, other in unlike.items():
        with pytest.raises(InputError, match=f"has another {what} than 'test'"):
            batch_of([base, other])
    assert len(batch_of([base, like(mass={"mass": 9.0}, rotors={"effectiveness": np.full(8, 0.9), "tau_d": 0.02})])) == 2
