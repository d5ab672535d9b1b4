"""The rotor table's spline: nodes, symmetries, order, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vehicles import airframe, rotor, rotor_table, spline_at

from levelone.errors import InputError
from levelone.vehicle import RotorTable, design_slopes

TABLE = rotor_table()


def table_on(n_throttle: int, n_airspeed: int, n_angle: int) -> RotorTable:
    axes = np.linspace(0.0, 1.0, n_throttle), np.linspace(0.0, 20.0, n_airspeed), np.linspace(-np.pi / 2, np.pi / 2, n_angle)
    return RotorTable(*axes, np.stack(rotor(*np.meshgrid(*axes, indexing="ij")), axis=-1))


def test_the_spline_goes_through_every_node() -> None:
    at = np.meshgrid(TABLE.throttle, TABLE.airspeed, TABLE.angle, indexing="ij")
    np.testing.assert_allclose(spline_at(TABLE, *at), TABLE.values, atol=1e-9)


@pytest.mark.theory
def test_the_symmetries_of_a_rotor_are_in_the_spline() -> None:
    """Mirror at +-90 deg; at rest every angle gives the same, and the slope in airspeed is odd in the angle."""
    h = 1e-4
    beyond, before = (spline_at(TABLE, 0.6, 7.0, np.pi / 2 + side * h) for side in (1, -1))
    np.testing.assert_allclose(beyond, before, rtol=1e-10)
    angles = np.linspace(-1.5, 1.5, 7)
    at_rest = spline_at(TABLE, 0.6, 0.0, angles)
    np.testing.assert_allclose(at_rest, np.broadcast_to(at_rest[0], at_rest.shape), rtol=1e-12)
    slope = (spline_at(TABLE, 0.6, h, angles) - at_rest) / h
    np.testing.assert_allclose(slope, -slope[::-1], atol=1e-4 * np.abs(slope).max())
    # edgewise flow has no slope at rest: the thrust of a hovering rotor is even in it
    np.testing.assert_allclose(slope[3], 0.0, atol=1e-3)


@pytest.mark.theory
def test_thrust_at_rest_has_one_gradient_in_every_direction() -> None:
    """dT/dV along an axis tilted by the angle is the axial slope times the sine."""
    h = 1e-5
    angles = np.linspace(-np.pi / 2, np.pi / 2, 13)
    thrust = spline_at(TABLE, 0.7, h, angles)[:, 1] - spline_at(TABLE, 0.7, 0.0, angles)[:, 1]
    axial = -2.2e-5 * rotor(0.7, 0.0, 0.0)[0]
    np.testing.assert_allclose(thrust / h, axial * np.sin(angles), atol=2e-3 * abs(axial))


@pytest.mark.order
def test_interpolation_is_of_fourth_order() -> None:
    """A smooth function sampled ever more finely in all three directions."""
    random = np.random.default_rng(2)
    at = random.uniform(0.1, 0.9, 400), random.uniform(0.5, 18.0, 400), random.uniform(-1.4, 1.4, 400)

    def smooth(t, v, a):
        edge, axial = v * np.cos(a), v * np.sin(a)
        return np.exp(t) * np.cos(2.0 * t) * (1.0 + 0.3 * np.cos(0.3 * edge)) - 0.2 * np.sin(0.15 * axial) * (1 + t)

    errors, sizes = [], np.array([21, 29, 41, 57, 81])
    for n in sizes:
        axes = np.linspace(0.0, 1.0, n), np.linspace(0.0, 20.0, n), np.linspace(-np.pi / 2, np.pi / 2, n)
        values = np.repeat(smooth(*np.meshgrid(*axes, indexing="ij"))[..., None], 3, axis=-1)
        errors.append(np.sqrt(np.mean((spline_at(RotorTable(*axes, values), *at)[:, 1] - smooth(*at)) ** 2)))
    slope = -np.polyfit(np.log(sizes - 1.0), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.2), errors
    assert errors[-1] < 1e-5


@given(st.integers(0, 2), st.integers(1, 9), st.floats(0.05, 0.95), st.floats(0.5, 19.0), st.floats(-1.4, 1.4))
@settings(max_examples=30, deadline=None)
def test_second_derivatives_have_no_jump_at_nodes(axis: int, node: int, throttle: float, airspeed: float, angle: float) -> None:
    """Twice differentiable: at a node of any axis, second differences from the left and from the right agree."""
    nodes = (TABLE.throttle, TABLE.airspeed, TABLE.angle)[axis]
    h = 1e-3 * (nodes[1] - nodes[0])
    at = np.tile([[throttle], [airspeed], [angle]], 5)
    at[axis] = nodes[node] + h * np.arange(-2, 3)
    y = spline_at(TABLE, *at)[:, 1]
    left, right = ((y[i] - 2.0 * y[i + 1] + y[i + 2]) / h**2 for i in (0, 2))
    # the third derivative times the distance of the two is all that may differ
    third = abs(y[4] - 2.0 * y[3] + 2.0 * y[1] - y[0]) / (2.0 * h**3)
    assert abs(left - right) <= 2.5 * h * third + 1e-5 * np.abs(y).max() / (nodes[1] - nodes[0]) ** 2


def broken(**changes) -> RotorTable:
    given = {"throttle": TABLE.throttle, "airspeed": TABLE.airspeed, "angle": TABLE.angle, "values": TABLE.values}
    return RotorTable(**{**given, **changes})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"throttle": np.linspace(0.0, 0.9, 21)}, r"rotor table, throttle: must run from 0 to 1, got 0 to 0\.9"),
        ({"throttle": np.linspace(0.0, 1.0, 4)}, "rotor table, throttle: needs at least five nodes, got 4"),
        ({"throttle": np.linspace(0.0, 1.0, 21) ** 2}, "rotor table, throttle: nodes must increase in equal steps"),
        ({"airspeed": TABLE.airspeed[::-1]}, "rotor table, airspeed: nodes must increase in equal steps"),
        ({"airspeed": TABLE.airspeed + 1.0}, "rotor table, airspeed: must run from 0 to any speed, got 1 to 21"),
        ({"angle": np.degrees(TABLE.angle)}, r"rotor table, angle: must run from -1\.5708 to 1\.5708, got -90 to 90"),
        ({"values": TABLE.values[:, :, :, :2]}, r"rotor table: values of shape \(21, 11, 13, 2\), expected \(21, 11, 13, 3\)"),
        ({"values": TABLE.values.swapaxes(0, 1)}, r"rotor table: values of shape \(11, 21, 13, 3\)"),
    ],
)
def test_wrong_axes_and_shapes_are_refused(changes: dict, text: str) -> None:
    with pytest.raises(InputError, match=text):
        broken(**changes)


def test_nan_and_a_direction_at_rest_are_refused() -> None:
    values = TABLE.values.copy()
    values[3, 4, 5, 1] = np.nan
    values[3, 4, 6, 1] = np.inf
    with pytest.raises(InputError, match="rotor table: 2 values are not finite numbers"):
        broken(values=values)
    values = TABLE.values.copy()
    values[10, 0, 3] *= 1.01
    with pytest.raises(InputError, match="at zero airspeed the flow has no angle"):
        broken(values=values)


@pytest.mark.theory
def test_design_slopes_are_those_of_the_hover() -> None:
    """Closed form: T = K_T rpm^2 carries an eighth of the weight; dT/dthrottle = 2 K_T rpm drpm/dthrottle."""
    throttle = np.linspace(0.0, 1.0, 2001)
    _, thrust, torque = rotor(throttle, 0.0, 0.0)
    hover, thrust_slope, torque_slope = design_slopes(airframe(), np.stack([throttle, thrust, torque], axis=1))
    rpm = np.sqrt(7.0 * 9.80665 / 8.0 / 6.96e-8)
    expected = (1.0 - np.sqrt(1.0 - 0.2 * rpm / 15500.0)) / 0.1
    assert hover == pytest.approx(expected, rel=1e-6)
    assert thrust_slope == pytest.approx(2.0 * 6.96e-8 * rpm * 15500.0 * (1.0 - 0.1 * expected), rel=1e-5)
    assert torque_slope == pytest.approx(0.018 * thrust_slope, rel=1e-9)
