"""Forces and moments of the airframe against formulas written out by hand, and those of the rotors against SciPy's spline."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vehicles import AERO, K_T, MASS, POSITION, SPIN, attitude, hover_state, rotor, rotor_table, spline_at, vehicle

from levelone.dynamics import Command, State, derivative
from levelone.vehicle import Vehicle

pytestmark = pytest.mark.theory
G, RHO, AREA, CHORD, SPAN = 9.80665, 1.225, 0.78, 0.26, 3.0
OFF = (0.0,) * 8
SURFACES = {
    "C_Ldelta_e": 0.4, "C_mdelta_e": -1.2, "C_ldelta_a": 0.15, "C_ndelta_a": -0.01,
    "C_Ydelta_r": 0.2, "C_ldelta_r": 0.02, "C_ndelta_r": -0.09,
}  # fmt: skip
#: a vehicle without thrust at zero throttle, so that only the airframe is left
GLIDER = vehicle(aero=SURFACES, rotors={"effectiveness": np.zeros(8)})
DEGREES = st.floats(-40.0, 40.0)


def wrench(craft: Vehicle, state: State, command: Command, wind=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Force (N) and moment (N m) besides gravity, from the public derivative by Newton's and Euler's laws."""
    rate = np.array(derivative(craft, state, command, wind))
    m = craft.airframe.mass
    velocity, omega = np.array(state[3:6]), np.array(state[10:13])
    inertia = np.array([[m.I_xx, 0.0, -m.I_xz], [0.0, m.I_yy, 0.0], [-m.I_xz, 0.0, m.I_zz]])
    q = np.array(state[6:10])
    gravity = G * np.array([2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] ** 2 + q[2] ** 2)])
    force = m.mass * (rate[3:6] + np.cross(omega, velocity) - gravity)
    return np.concatenate([force, inertia @ rate[10:13] + np.cross(omega, inertia @ omega)])


def flying(airspeed: float, alpha: float, beta: float, rates=(0.0, 0.0, 0.0)) -> State:
    """Air-relative flight with sin(alpha) = w / V and sin(beta) = v / V, angles in degrees."""
    w, v = airspeed * np.sin(np.radians(alpha)), airspeed * np.sin(np.radians(beta))
    return hover_state(u=float(np.sqrt(airspeed**2 - v**2 - w**2)), v=float(v), w=float(w), p=rates[0], q=rates[1], r=rates[2])


@given(st.floats(2.0, 18.0), st.floats(-25.0, 25.0), st.floats(-3.0, 3.0))
@settings(max_examples=25, deadline=None)
def test_longitudinal_coefficients_in_wind_axes(airspeed: float, alpha: float, q: float) -> None:
    """In the plane of symmetry: lift and drag from the coefficients, turned from wind axes to body axes by alpha."""
    a, q_hat = np.radians(alpha), q * CHORD / (2.0 * airspeed)
    C_L = AERO["C_L0"] + AERO["C_Lalpha"] * a + AERO["C_Lq"] * q_hat
    C_D = AERO["C_D0"] + AERO["C_Dalpha"] * a + AERO["C_Dq"] * q_hat
    C_m = AERO["C_m0"] + AERO["C_malpha"] * a + AERO["C_mq"] * q_hat
    pressure = 0.5 * RHO * airspeed**2
    expected = (
        pressure
        * AREA
        * np.array([C_L * np.sin(a) - C_D * np.cos(a), 0.0, -C_L * np.cos(a) - C_D * np.sin(a), 0.0, C_m * CHORD, 0.0])
    )
    np.testing.assert_allclose(wrench(GLIDER, flying(airspeed, alpha, 0.0, (0.0, q, 0.0)), Command(OFF)), expected, atol=1e-9)


@given(st.floats(2.0, 18.0), st.floats(-30.0, 30.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
@settings(max_examples=25, deadline=None)
def test_lateral_derivatives_and_surfaces(airspeed: float, beta: float, p: float, r: float) -> None:
    """At alpha = 0 with all surfaces out; Y is along the body's axis, so that drag adds -D sin(beta)."""
    b, p_hat, r_hat = np.radians(beta), p * SPAN / (2.0 * airspeed), r * SPAN / (2.0 * airspeed)
    de, da, dr = 0.10, -0.07, 0.05
    C_Y = AERO["C_Ybeta"] * b + AERO["C_Yp"] * p_hat + AERO["C_Yr"] * r_hat + SURFACES["C_Ydelta_r"] * dr
    C_l = AERO["C_lbeta"] * b + AERO["C_lp"] * p_hat + AERO["C_lr"] * r_hat
    C_l += SURFACES["C_ldelta_a"] * da + SURFACES["C_ldelta_r"] * dr
    C_n = AERO["C_nbeta"] * b + AERO["C_np"] * p_hat + AERO["C_nr"] * r_hat
    C_n += SURFACES["C_ndelta_a"] * da + SURFACES["C_ndelta_r"] * dr
    C_L, C_D = AERO["C_L0"] + SURFACES["C_Ldelta_e"] * de, AERO["C_D0"]
    C_m = AERO["C_m0"] + SURFACES["C_mdelta_e"] * de
    expected = (
        0.5
        * RHO
        * airspeed**2
        * AREA
        * np.array([-C_D * np.cos(b), C_Y - C_D * np.sin(b), -C_L * np.cos(b), C_l * SPAN, C_m * CHORD, C_n * SPAN])
    )
    got = wrench(GLIDER, flying(airspeed, 0.0, beta, (p, 0.0, r)), Command(OFF, 0.0, de, da, dr))
    np.testing.assert_allclose(got, expected, atol=1e-9)


@given(DEGREES, DEGREES)
@settings(max_examples=25, deadline=None)
def test_drag_alone_takes_power_from_the_motion(alpha: float, beta: float) -> None:
    """Lift is perpendicular to the velocity at every incidence and sideslip: the power is minus drag times airspeed."""
    craft = vehicle(aero={"C_Ybeta": 0.0, "C_Yp": 0.0, "C_Yr": 0.0}, rotors={"effectiveness": np.zeros(8)})
    state = flying(9.0, alpha, beta)
    drag = 0.5 * RHO * 81.0 * AREA * (AERO["C_D0"] + AERO["C_Dalpha"] * np.radians(alpha))
    np.testing.assert_allclose(wrench(craft, state, Command(OFF))[:3] @ state[3:6], -drag * 9.0, atol=1e-9)


@given(st.floats(1.0, 15.0), st.floats(-20.0, 20.0), st.floats(-4.0, 4.0), st.floats(-20.0, 20.0))
@settings(max_examples=20, deadline=None)
def test_lift_and_moment_due_to_alphadot_solve_their_own_equation(airspeed: float, alpha: float, q: float, C_Ladot: float) -> None:
    """The accelerations equal those of a fixed-point iteration on alphadot = (u wdot - w udot) / V^2 in NumPy."""
    state = flying(airspeed, alpha, 0.0, (0.0, q, 0.0))
    command = Command((0.6,) * 8)
    plain = np.array(derivative(vehicle(), state, command))
    u, w = state.u, state.w
    alphadot = 0.0
    for _ in range(200):
        half = 0.25 * RHO * AREA * CHORD * airspeed * alphadot
        lift, moment = half * C_Ladot, half * CHORD * -6.0
        du, dw = plain[3] + lift * w / airspeed / 7.0, plain[5] - lift * u / airspeed / 7.0
        alphadot = (u * dw - w * du) / airspeed**2
    expected = plain.copy()
    expected[3], expected[5], expected[11] = du, dw, plain[11] + moment / MASS["I_yy"]
    got = derivative(vehicle(aero={"C_Lalphadot": C_Ladot, "C_malphadot": -6.0}), state, command)
    np.testing.assert_allclose(got, expected, rtol=1e-10, atol=1e-10)


def test_everything_is_finite_and_continuous_down_to_rest() -> None:
    craft = vehicle(aero={"C_Lalphadot": 3.0, "C_malphadot": -6.0, **SURFACES})
    command = Command((0.6,) * 8, 0.0, 0.1, 0.1, 0.1)
    at_rest = np.array(derivative(craft, hover_state(q=1.0), command))
    assert np.isfinite(at_rest).all()
    for direction in np.vstack([np.eye(3), -np.eye(3)]):
        slow = np.array(derivative(craft, hover_state(q=1.0)._replace(**dict(zip("uvw", 1e-7 * direction, strict=True))), command))
        # forces change with the airspeed, never by a jump: alphadot = q near rest still turns lift of order V
        np.testing.assert_allclose(slow, at_rest, atol=1e-5)


@given(st.floats(0.02, 1.0), st.floats(0.0, 19.9), DEGREES, DEGREES)
@settings(max_examples=30, deadline=None)
def test_rotor_wrench_is_the_spline_of_the_table(throttle: float, airspeed: float, alpha: float, beta: float) -> None:
    """One healthy rotor: K_T scales thrust only, T_u the airspeed only; torque turns the airframe against the spin."""
    hub = 3
    alone = {"effectiveness": np.eye(8)[hub], "K_T": 1.1 * K_T, "T_u": 0.9}
    zero = dict.fromkeys(AERO, 0.0)
    state = flying(airspeed, alpha, beta)
    got = wrench(vehicle(aero=zero, rotors=alone), state, Command(tuple(throttle * np.ones(8))))
    _, thrust, torque = spline_at(rotor_table(), throttle, 0.9 * airspeed, -np.radians(alpha))
    x, y, _ = POSITION[hub]
    expected = [0.0, 0.0, -1.1 * thrust, -1.1 * thrust * y, 1.1 * thrust * x, -SPIN[hub] * torque]
    np.testing.assert_allclose(got, expected, atol=1e-9)


def test_front_rotors_lift_the_nose_right_rotors_lower_the_left_wing() -> None:
    """Signs by hand: more thrust ahead pitches up, more on the right rolls to the left, more torque on +1 yaws left."""
    craft = vehicle()

    def change(more: np.ndarray) -> np.ndarray:
        before, after = (wrench(craft, hover_state(), Command(tuple(0.6 + d * more))) for d in (0.0, 0.05))
        return after - before

    assert change(POSITION[:, 0] > 0)[4] > 0.1
    assert change(POSITION[:, 1] > 0)[3] < -0.1
    assert change(SPIN > 0)[5] < -0.01
    assert change(np.ones(8))[2] < -0.1
    np.testing.assert_allclose(change(np.ones(8))[[0, 1, 3, 4, 5]], 0.0, atol=1e-12)


def test_pushers_push_forward_and_their_arm_pitches_the_nose() -> None:
    """Two of 10 N at z = 0.05 m below the centre of gravity: 20 N forward and 1 N m nose up at full throttle."""
    craft = vehicle()
    without, full = (wrench(craft, hover_state(), Command((0.6,) * 8, pusher)) for pusher in (0.0, 1.0))
    np.testing.assert_allclose(full - without, [20.0, 0.0, 0.0, 0.0, 1.0, 0.0], atol=1e-10)


def test_local_velocity_makes_a_roll_rate_damp_itself() -> None:
    """The descending side sees less inflow and thrusts more; without the option the rotors do not feel the rate."""
    no_wing = dict.fromkeys(AERO, 0.0)
    state, command = hover_state(u=5.0, p=1.0), Command((0.68,) * 8)
    shared, local = (vehicle(aero=no_wing, rotors={"local_velocity": on}) for on in (False, True))
    np.testing.assert_allclose(wrench(shared, state, command)[3], 0.0, atol=1e-10)
    expected = 0.0
    for x, y, z in POSITION:
        seen = np.array([5.0, 0.0, 0.0]) + np.cross([1.0, 0.0, 0.0], [x, y, z])
        speed = float(np.linalg.norm(seen))
        expected += -y * rotor(0.68, speed, np.arcsin(-seen[2] / speed))[1]
    got = wrench(local, state, command)[3]
    assert got < 0.0
    np.testing.assert_allclose(got, expected, rtol=1e-4)


def test_tilted_rotors_push_along_their_axis() -> None:
    """One rotor tilted forward by 30 deg: half its thrust goes forward; its flow angle counts from its own disc."""
    tilted = np.tile([0.5, 0.0, -np.sqrt(0.75)], (8, 1))
    upright = np.tile([0.0, 0.0, -1.0], (8, 1))
    axis = np.where(np.arange(8)[:, None] == 0, tilted, upright)
    craft = vehicle(aero=dict.fromkeys(AERO, 0.0), rotors={"axis": axis, "effectiveness": np.eye(8)[0]}, design=vehicle().airframe)
    state = State(0.0, 0.0, 0.0, 6.0, 0.0, 0.0, *attitude(0.0, 0.0, 0.0))
    thrust, torque = spline_at(rotor_table(), 0.7, 6.0, np.radians(30.0))[1:]
    got = wrench(craft, state, Command((0.7,) * 8))
    moment = np.cross(POSITION[0], thrust * tilted[0]) + SPIN[0] * torque * tilted[0]
    np.testing.assert_allclose(got, [*(thrust * tilted[0]), *moment], atol=1e-9)
