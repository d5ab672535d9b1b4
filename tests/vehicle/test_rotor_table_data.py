"""The shipped lift-rotor tables, and the theory of the script that makes them."""

from __future__ import annotations

import functools
import importlib
import sys
import tomllib
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = ROOT / "src" / "levelone" / "vehicle" / "library"
REFERENCE = tomllib.loads((ROOT / "tests" / "reference" / "rotor.toml").read_text(encoding="utf-8"))
ANCHOR, HOVER = REFERENCE["anchor"], REFERENCE["hover"]
AREA = np.pi * ANCHOR["diameter"] ** 2 / 4.0
HOVER_THRUST = HOVER["mass"] * HOVER["gravity"] / HOVER["rotors"]


class Table(NamedTuple):
    """Axes and values [throttle, airspeed, angle] of one file."""

    throttle: np.ndarray
    airspeed: np.ndarray
    angle: np.ndarray
    rpm: np.ndarray
    thrust: np.ndarray
    torque: np.ndarray

    @property
    def power(self) -> np.ndarray:
        return self.torque * self.rpm * 2.0 * np.pi / 60.0


def read(name: str) -> Table:
    lines = [line for line in (LIBRARY / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    assert lines[0] == "throttle,airspeed,angle_deg,rpm,thrust,torque"
    rows = np.loadtxt(lines[1:], delimiter=",")
    axes = [np.unique(rows[:, i]) for i in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    np.testing.assert_array_equal(rows[:, :3], nodes)
    return Table(*axes, *(rows[:, i].reshape([a.size for a in axes]) for i in (3, 4, 5)))


@pytest.fixture(scope="module")
def coarse() -> Table:
    return read("reference-evtol-rotor.csv")


@pytest.fixture(scope="module")
def fine() -> Table:
    return read("reference-evtol-rotor-fine.csv")


@functools.cache
def import_tools() -> dict[str, ModuleType]:
    """The script and its modules, which import one another by name as scripts do."""
    sys.path.insert(0, str(ROOT / "tools"))
    try:
        return {name: importlib.import_module(name) for name in ("bemt", "drive", "make_rotor_table")}
    finally:
        sys.path.remove(str(ROOT / "tools"))


@pytest.fixture(scope="module")
def tools() -> dict[str, ModuleType]:
    return import_tools()


class StraightLine:
    """Section with c_l = slope alpha and no drag."""

    slope = 5.7

    def coefficients(self, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.slope * alpha, np.zeros_like(alpha)


# ---------------------------------------------------------------- the data


def test_grids_are_uniform_and_nested(coarse: Table, fine: Table) -> None:
    np.testing.assert_allclose(coarse.throttle, 0.05 * np.arange(21), atol=1e-12)
    np.testing.assert_array_equal(coarse.airspeed, 2.0 * np.arange(11))
    np.testing.assert_array_equal(coarse.angle, 15.0 * np.arange(-6, 7))
    for one, two in zip(coarse[:3], fine[:3], strict=True):
        assert two.size == 2 * one.size - 1
        np.testing.assert_array_equal(one, two[::2])
    for one, two in zip(coarse[3:], fine[3:], strict=True):
        assert np.all(np.isfinite(two))
        np.testing.assert_array_equal(one, two[::2, ::2, ::2])


@pytest.mark.paper
def test_static_thrust_is_the_studys(fine: Table) -> None:
    np.testing.assert_allclose(fine.thrust[:, 0], ANCHOR["K_T"] * fine.rpm[:, 0] ** 2, rtol=ANCHOR["tolerance"], atol=0.0)
    hover_rpm = np.interp(HOVER_THRUST, fine.thrust[:, 0, 0], fine.rpm[:, 0, 0] ** 2) ** 0.5
    assert hover_rpm == pytest.approx(HOVER["rpm"], abs=HOVER["rpm_tolerance"])


def test_still_air_has_no_direction(fine: Table) -> None:
    for values in (fine.rpm, fine.thrust, fine.torque):
        np.testing.assert_array_equal(values[:, 0], np.broadcast_to(values[:, 0, :1], values[:, 0].shape))
    assert (fine.rpm[0, 0, 0], fine.thrust[0, 0, 0], fine.torque[0, 0, 0]) == (0.0, 0.0, 0.0)


def test_hover_throttle_and_thrust_to_weight(fine: Table) -> None:
    static = fine.thrust[:, 0, 0]
    low, high = HOVER["throttle"]
    assert low < np.interp(HOVER_THRUST, static, fine.throttle) < high
    low, high = HOVER["thrust_to_weight"]
    assert low < static[-1] / HOVER_THRUST < high


@pytest.mark.theory
def test_axial_power_exceeds_the_ideal_of_momentum_theory(fine: Table) -> None:
    """P >= T (V + v) with the actuator disc's uniform inflow (Leishman, ch. 2): in hover the figure of merit is < 1."""
    thrust, power = fine.thrust[:, :, -1], fine.power[:, :, -1]
    half = fine.airspeed / 2.0
    ideal = thrust * (half + np.sqrt(half**2 + np.maximum(thrust, 0.0) / (2.0 * ANCHOR["air_density"] * AREA)))
    lifting = thrust > 0.0
    assert np.count_nonzero(lifting) > 300
    assert np.all(power[lifting] > ideal[lifting])
    figure_of_merit = ideal[1:, 0] / power[1:, 0]
    assert np.all((figure_of_merit > 0.55) & (figure_of_merit < 0.75))


def test_climb_loses_thrust_and_edgewise_flow_gains_it(fine: Table) -> None:
    per_rpm = fine.thrust[8:] / fine.rpm[8:] ** 2  # throttle from 0.2
    assert np.all(np.diff(per_rpm[:, :, -1], axis=1) < 0.0)
    fast = fine.throttle[8:] >= 0.4  # advance ratio below 0.3
    assert np.all(np.diff(per_rpm[fast, :, 12], axis=1) > 0.0)


def test_thrust_and_torque_rise_with_throttle_near_hover(fine: Table) -> None:
    near = slice(16, 33)  # throttle 0.4 to 0.8
    assert np.all(np.diff(fine.thrust[near], axis=0) > 0.0)
    assert np.all(np.diff(fine.rpm, axis=0) > 0.0)
    assert np.all(fine.torque[near, :13] > 0.0)


def test_slope_in_angle_vanishes_at_the_axis(fine: Table) -> None:
    """One-sided differences of fourth order; the average over a revolution makes thrust even about +-90 deg."""
    stencil = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0
    flown = slice(20, 37), slice(1, 13)  # throttle 0.5 to 0.9, 1 to 12 m/s
    largest = np.abs(np.diff(fine.thrust[flown], axis=-1)).max(axis=-1)
    for end in (fine.thrust[flown][..., :5], fine.thrust[flown][..., :-6:-1]):
        assert np.all(np.abs(end @ stencil) <= 0.01 * largest)


def test_a_spline_of_the_coarse_table_meets_the_fine_one(coarse: Table, fine: Table, tools: dict) -> None:
    thrust = tools["make_rotor_table"].interpolate(coarse[:3], coarse.thrust, fine[:3])
    d, v, a = np.meshgrid(*fine[:3], indexing="ij")
    flown = (d > 0.199) & (d < 0.901) & (v <= 12.0) & (np.abs(a) <= 60.0)
    error = np.abs(thrust - fine.thrust)[flown] / HOVER_THRUST
    assert np.count_nonzero(error) > 1000
    assert error.max() < REFERENCE["interpolation"]["max_error"]


# ---------------------------------------------------------------- the script


@pytest.fixture(scope="module")
def load_map(tools: dict) -> object:
    bemt = tools["bemt"]
    return tools["make_rotor_table"].make_map(bemt.Blade(), bemt.Section(), np.array([-90.0, -30.0, 0.0, 30.0, 90.0]))


def test_the_script_makes_the_shipped_numbers(fine: Table, tools: dict, load_map: object) -> None:
    throttle, airspeed = fine.throttle[::3], fine.airspeed[::3]
    table = tools["make_rotor_table"].make_table(load_map, tools["drive"].Drive(), throttle, airspeed)
    columns = np.searchsorted(fine.angle, load_map.angle_deg)
    for i, shipped in enumerate((fine.rpm, fine.thrust, fine.torque)):
        scale = np.abs(shipped).max()
        np.testing.assert_allclose(table[..., i], shipped[::3, ::3][:, :, columns], rtol=1e-6, atol=1e-6 * scale)


def test_thrust_has_one_slope_at_rest(tools: dict, load_map: object) -> None:
    """Climbing and descending at one angle are one smooth curve: no kink where the vortex-ring fit begins."""
    script, drive, throttle = tools["make_rotor_table"], tools["drive"].Drive(), np.full(5, 0.58)
    still, slow = (script.solve(load_map, drive, throttle, np.full(5, v), np.arange(5))[:, 1] for v in (0.0, 0.02))
    change = slow - still
    np.testing.assert_allclose(change, -change[::-1], rtol=0.0, atol=2e-3 * np.abs(change).max())
    np.testing.assert_allclose(change[3] / change[4], np.sin(np.radians(30.0)), rtol=2e-3)


@pytest.mark.pin
def test_pin_slopes_quoted_in_the_documentation(tools: dict, load_map: object) -> None:
    slopes = tools["make_rotor_table"].hover_slopes(load_map, tools["drive"].Drive())
    assert slopes["figure of merit"] == pytest.approx(0.686, abs=0.001)
    assert slopes["d ln T / d ln throttle"] == pytest.approx(1.676, abs=0.001)
    assert slopes["dT/dw axial, N s/m"] == pytest.approx(-0.168, abs=0.001)
    assert slopes["dT/dV edgewise at 5 m/s, N s/m"] == pytest.approx(0.0680, abs=0.0002)


def test_raw_thrust_coefficient_is_that_of_a_comparable_propeller(tools: dict) -> None:
    bemt, script = tools["bemt"], tools["make_rotor_table"]
    thrust, _ = script.static_loads(bemt.make_elements(bemt.Blade()), bemt.Section())
    low, high = REFERENCE["static_thrust_coefficient"]["low"], REFERENCE["static_thrust_coefficient"]["high"]
    assert low < thrust * np.pi**3 / 4.0 < high
    anchored = ANCHOR["K_T"] * 60.0**2 / (ANCHOR["air_density"] * ANCHOR["diameter"] ** 4)
    assert low < anchored < high
    assert script.anchor(bemt.Blade(), thrust) * thrust * np.pi**3 / 4.0 == pytest.approx(anchored, rel=1e-12)


@pytest.mark.theory
def test_hover_inflow_of_small_pitch_is_leishmans(tools: dict) -> None:
    """lambda = sigma a / 16 (sqrt(1 + 32 theta x / (sigma a)) - 1): combined theory in hover, Leishman, ch. 3."""
    bemt = tools["bemt"]
    x = np.linspace(0.3, 1.0, 8)
    elements = bemt.Elements(2, x, np.full(8, 0.1), np.full(8, 0.06), 0.01 + 0.005 / x, np.ones(8))
    one, zero = np.ones(1), np.zeros(1)
    v = bemt.induced_velocity(elements, StraightLine(), one, zero, zero)[0]
    lift_solidity = StraightLine.slope * 2 * 0.06 / np.pi
    expected = lift_solidity / 16.0 * (np.sqrt(1.0 + 32.0 * elements.angle * x / lift_solidity) - 1.0)
    np.testing.assert_allclose(v, expected, rtol=1e-3)


@pytest.mark.theory
@pytest.mark.parametrize("climb", [-0.3, -0.1, 0.0, 0.05, 0.2])
def test_shaft_power_without_drag_is_thrust_times_flow_through_the_disc(tools: dict, climb: float) -> None:
    """Lift is normal to the local flow: Q Omega = sum of dT (V_z + v), element by element, in axial flow."""
    bemt = tools["bemt"]
    elements = bemt.make_elements(bemt.Blade())
    index = np.arange(elements.x.size)
    one, zero = np.ones(elements.x.size), np.zeros(elements.x.size)
    v = bemt.induced_velocity(elements, StraightLine(), np.ones(1), np.zeros(1), np.full(1, climb))[0]
    thrust, torque = bemt.blade_loads(elements, StraightLine(), index, one, zero, climb + v)
    np.testing.assert_allclose(torque, thrust * (climb + v), rtol=1e-9, atol=1e-14)
    momentum = 4.0 * elements.x * elements.loss * v * bemt.mass_flow(v, zero, np.full(v.size, climb))
    np.testing.assert_allclose(thrust, momentum, rtol=1e-9, atol=1e-12)


@pytest.mark.theory
def test_climb_and_fast_descent_are_momentum_theory(tools: dict) -> None:
    """v = -x/2 + sqrt(x^2/4 + 1) for x >= 0, -x/2 - sqrt(x^2/4 - 1) for x < -2, in hover's v_h (Leishman, ch. 2)."""
    mass_flow = tools["bemt"].mass_flow
    x = np.linspace(0.0, 4.0, 17)
    v = -x / 2.0 + np.sqrt(x**2 / 4.0 + 1.0)
    np.testing.assert_allclose(v * mass_flow(v, np.zeros_like(x), x), 1.0, rtol=1e-12)
    x = np.linspace(-8.0, -3.5, 10)
    v = -x / 2.0 - np.sqrt(x**2 / 4.0 - 1.0)
    np.testing.assert_allclose(v * mass_flow(v, np.zeros_like(x), x), 1.0, rtol=0.02)


def test_vertical_descent_follows_the_measured_induced_velocity(tools: dict) -> None:
    mass_flow = tools["bemt"].mass_flow
    descent = REFERENCE["axial_descent"]
    x = np.linspace(*descent["range"], 33)
    measured = np.polynomial.polynomial.polyval(x, descent["coefficients"])
    v = np.linspace(0.01, 3.0, 6000)
    flow = np.array([v * mass_flow(v, np.zeros_like(v), np.full_like(v, one)) for one in x])
    predicted = np.array([np.interp(1.0, row, v) for row in flow])
    np.testing.assert_allclose(predicted, measured, rtol=0.0, atol=descent["tolerance"])


@settings(deadline=None, max_examples=60)
@given(v_x=st.floats(0.0, 5.0), v_z=st.floats(-5.0, 5.0))
def test_momentum_flux_rises_with_induced_velocity_and_mirrors(v_x: float, v_z: float) -> None:
    mass_flow = import_tools()["bemt"].mass_flow
    v = np.linspace(-6.0, 6.0, 2001)
    flux = v * mass_flow(v, np.full_like(v, v_x), np.full_like(v, v_z))
    assert np.all(np.diff(flux) >= 0.0)
    mirrored = v * mass_flow(v, np.full_like(v, v_x), np.full_like(v, -v_z))
    np.testing.assert_allclose(flux, -mirrored[::-1], rtol=1e-9, atol=1e-12)


@pytest.mark.theory
def test_drive_equilibrium_against_its_quadratic(tools: dict) -> None:
    """With Q = b Omega^2 the balance of voltages is a quadratic in Omega; energy then closes."""
    drive = tools["drive"].Drive()
    throttle, b = np.linspace(0.0, 1.0, 11), 9.4e-8
    speed = tools["drive"].steady_speed(drive, throttle, lambda w: b * w**2, np.zeros(11))
    k, c = drive.torque_constant, drive.no_load_current / (drive.no_load_speed * 2.0 * np.pi / 60.0)
    resistance = drive.resistance + throttle**2 * drive.battery_resistance
    linear, square = k + resistance * c, resistance * b / k
    expected = 2.0 * throttle * drive.voltage / (linear + np.sqrt(linear**2 + 4.0 * square * throttle * drive.voltage))
    np.testing.assert_allclose(speed, expected, rtol=1e-10, atol=1e-9)
    current = b * speed**2 / k + c * speed
    np.testing.assert_allclose(
        throttle * drive.voltage * current,
        resistance * current**2 + b * speed**3 + k * c * speed**2,
        rtol=1e-9,
        atol=1e-9,
    )
