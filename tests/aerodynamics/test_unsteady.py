"""The time domain in three dimensions with a prescribed wake: against the frequency domain, steady limits, symmetry, bad input."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shapes import geometry, tail, wing

from levelone.aerodynamics import gust, motion, theory
from levelone.aerodynamics.extraction import derivative, harmonic
from levelone.aerodynamics.frequency import oscillate, prepare
from levelone.aerodynamics.geometry import Surface
from levelone.aerodynamics.lattice import build
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.unsteady import Wake, simulate
from levelone.errors import InputError

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "aerodynamics.toml").read_text(encoding="utf-8"))
SPEED, CHORD = 6.0, 0.26
PRESSURE = 0.5 * 1.225 * SPEED**2
FIN = Surface("fin", (0.9, 0.0, 0.05), 0.4, 0.2, 0.12, sweep=0.3, dihedral=math.pi / 2, mirrored=False, chordwise=4, strips=4)


def step_of(lattice, k, panels=1.0):
    """Time step of about so many of the shortest last panels, a whole number a period; steps a period."""
    period = math.pi * CHORD / (k * SPEED)
    steps = round(period / (panels * lattice.last.min() / SPEED))
    return period / steps, steps


def swing(lattice, kind, k, amplitude=0.02, panels=1.0, periods=2, **changes):
    dt, steps = step_of(lattice, k, panels)
    moving = motion.oscillation(kind, amplitude, 2.0 * k * SPEED / CHORD, SPEED)
    return simulate(lattice, moving, SPEED, dt, periods * steps + 1, **changes)


def parts(time, values, k, amplitude=0.02):
    """In-phase part and quadrature / k of each column."""
    fits = [derivative(harmonic(time, column, 2.0 * k * SPEED / CHORD, tolerance=0.3), amplitude, k) for column in values.T]
    return np.array([[each.in_phase, each.quadrature] for each in fits])


def linear(lattice, kind, k):
    found = oscillate(prepare(lattice), np.array([k]), (kind,), np.zeros(3))[0, 0]
    return np.stack([found.real, found.imag / k], axis=1)


@pytest.mark.theory
@pytest.mark.parametrize("kind", ["pitch", "heave", "rate"])
@pytest.mark.parametrize("surfaces", [(wing(4, 6),), (wing(4, 6), tail(2, 3))], ids=["wing", "wing and tail"])
def test_prescribed_wake_agrees_with_the_frequency_domain(surfaces, kind):
    lattice = build(geometry(*surfaces))
    history = swing(lattice, kind, 0.2)
    found, wanted = parts(history.time, history.coefficients, 0.2), linear(lattice, kind, 0.2)
    assert np.abs(found - wanted)[0].max() < 0.005 * 2.0 * math.pi
    assert np.abs(found - wanted)[4].max() < 0.02 * np.abs(wanted[4]).max()


@pytest.mark.theory
@pytest.mark.parametrize("kind", ["sideslip", "roll", "yaw", "yaw_rate"])
def test_lateral_motions_agree_with_the_frequency_domain(kind):
    lattice = build(geometry(wing(4, 5, dihedral=0.1), FIN))
    history = swing(lattice, kind, 0.2, 1e-3)
    found, wanted = parts(history.time, history.coefficients, 0.2, 1e-3), linear(lattice, kind, 0.2)
    assert np.abs(found - wanted)[[2, 3, 5]].max() < 0.015 * np.abs(wanted[[2, 3, 5]]).max()


@pytest.mark.theory
@pytest.mark.parametrize("kind", ["pitch", "heave"])
def test_a_loaded_wing_agrees_with_the_frequency_domain_in_wind_axes(kind):
    lattice = build(geometry(wing(4, 6, incidence=0.05)))
    history = swing(lattice, kind, 0.2, 0.05, wake=Wake(cut=40.0))
    found = parts(history.time, history.in_wind_axes(lattice, PRESSURE), 0.2, 0.05)
    assert np.abs(found - linear(lattice, kind, 0.2))[[0, 1, 4]].max() < 0.03


def test_the_lift_of_a_rolled_wing_points_sideways_in_the_tunnel_but_not_in_body_axes():
    lattice = build(geometry(wing(3, 4, incidence=0.05)))
    history = swing(lattice, "roll", 0.2, 0.05, panels=2.0)
    tunnel, body = (
        parts(history.time, values, 0.2, 0.05)[2, 0] for values in (history.coefficients, history.in_body_axes(lattice, PRESSURE))
    )
    assert tunnel == pytest.approx(history.coefficients[:, 0].mean(), rel=0.03)
    assert abs(body) < 1e-3


@pytest.fixture(scope="module")
def lifted():
    """The reference wing at constant incidence after 100 chords."""
    lattice = build(geometry(wing(4, 20)))
    return lattice, simulate(lattice, motion.steady(0.03), 1.0, 0.5 * CHORD, 200, Wake(cut=100.0))


@pytest.mark.oracle
def test_steady_lift_slope(lifted):
    assert lifted[1].coefficients[-1, 0] / 0.03 == pytest.approx(REFERENCE["wing"]["C_Lalpha_converged"], rel=0.005)


@pytest.mark.theory
def test_drag_of_the_bound_vortices_is_the_induced_drag_of_the_far_wake(lifted):
    """Sine series of the circulation: C_L = pi AR A_1, C_D = pi AR sum n A_n^2 (Katz and Plotkin, section 8.1)."""
    lattice, history = lifted
    half = len(lattice.first) // 2
    ratio, at = 3.0 / CHORD, lattice.trailing[:half]
    order = 2 * np.arange(half) + 1
    waves = np.sin(np.outer(np.arccos(lattice.midpoint[at, 1] / 1.5), order))
    series = np.linalg.solve(waves, history.gamma[-1, at] / (2.0 * 3.0))
    assert history.coefficients[-1, 0] == pytest.approx(math.pi * ratio * series[0], rel=2e-3)
    assert history.coefficients[-1, 1] == pytest.approx(math.pi * ratio * np.sum(order * series**2), rel=5e-3)


@pytest.mark.theory
def test_incidence_and_twist_add_up():
    """Bound vortices of a twisted wing are chords of a curved line: the point that is loaded has to lie on the segment."""
    lifts = [
        simulate(build(geometry(wing(3, 5, incidence=a, twist=t))), motion.steady(), 1.0, 0.3 * CHORD, 40).coefficients[-1, 0]
        for a, t in ((0.05, 0.0), (0.0, -0.03), (0.05, -0.03))
    ]
    assert lifts[0] + lifts[1] == pytest.approx(lifts[2], rel=2e-3)


@pytest.mark.theory
def test_elliptic_wing():
    """Six trapezia along an ellipse: lift slope and span efficiency of lifting-line theory."""
    span, eta = 20.0 * math.pi / 4.0, np.array([0.0, 0.35, 0.6, 0.8, 0.92, 0.975])
    chord = np.sqrt(1.0 - eta**2)
    surfaces = [
        Surface(
            f"part {i}", (0.0, eta[i] * span / 2, 0.0), (eta[i + 1] - eta[i]) * span / 2, chord[i], chord[i + 1],
            strips=4, chordwise=2, span_spacing="uniform",
        ) for i in range(5)
    ]  # fmt: skip
    area, b = float(np.sum(np.diff(eta) * (chord[1:] + chord[:-1]))) * span / 2, eta[-1] * span
    lattice = build(geometry(*surfaces, area=area, chord=1.0, span=b))
    lift, drag = simulate(lattice, motion.steady(0.03), 1.0, 0.2, 300, Wake(cut=60.0)).coefficients[-1, :2]
    assert lift / math.sin(0.03) == pytest.approx(theory.elliptic_lift_slope(b**2 / area), rel=0.03)
    assert lift**2 / (math.pi * b**2 / area * drag) == pytest.approx(1.0, abs=0.02)


def test_one_half_is_solved_for_the_same_loads_to_rounding():
    lattice = build(geometry(wing(3, 4, incidence=0.05), tail(2, 2)))
    skew = replace(gust.uniform((SPEED, 0.0, 0.0)), symmetric=False)
    half, whole = (swing(lattice, "pitch", 0.2, 0.05, panels=1.8, wind=wind) for wind in (None, skew))
    assert half.wake.mirrored
    assert not whole.wake.mirrored
    for name in ("gamma", "force", "moment", "strip_lift"):
        assert np.allclose(getattr(half, name), getattr(whole, name), rtol=0.0, atol=1e-12 * np.abs(getattr(half, name)).max()), (
            name
        )


def test_left_and_right_are_alike_to_rounding():
    lattice = build(geometry(wing(3, 4), tail(2, 2)))
    left, right = (swing(lattice, "roll", 0.2, amplitude, panels=1.8) for amplitude in (0.05, -0.05))
    mirrored = np.array([1.0, -1.0, 1.0])
    assert np.allclose(left.force, right.force * mirrored, rtol=0.0, atol=1e-13)
    assert np.allclose(left.moment, right.moment * -mirrored, rtol=0.0, atol=1e-13)


def test_only_the_motion_relative_to_the_air_matters():
    lattice = build(geometry(wing(3, 4, incidence=0.05), tail(2, 2)))
    dt, steps = step_of(lattice, 0.2, 1.8)
    moving = motion.oscillation("pitch", 0.05, 0.4 * SPEED / CHORD, SPEED)
    tunnel = simulate(lattice, moving, SPEED, dt, steps)
    frames = ((-SPEED, 0.0, 0.0), (-SPEED - 3.0, 2.0, 1.0))
    for velocity in frames:
        wind = gust.uniform(np.array([SPEED, 0.0, 0.0]) + velocity)
        flight = simulate(lattice, motion.flying(moving, velocity), SPEED, dt, steps, wind=wind)
        assert np.allclose(flight.force, tunnel.force, rtol=0.0, atol=1e-11 * np.abs(tunnel.force).max())
        assert np.allclose(flight.moment, tunnel.moment, rtol=0.0, atol=1e-11 * np.abs(tunnel.moment).max())


def test_threads_do_not_change_results():
    lattice = build(geometry(wing(4, 6), tail(2, 3)))
    one, two = (swing(lattice, "pitch", 0.2, periods=1, threads=threads) for threads in (1, 2))
    assert np.array_equal(one.force, two.force)


def test_a_cut_wake_states_what_it_lacks():
    """The estimate bounds the change of incidence; times the lift slope it bounds the change of lift within a factor of two."""
    lattice = build(geometry(wing(3, 5)))
    whole, short = (simulate(lattice, motion.steady(0.05), 1.0, 0.5 * CHORD, 160, Wake(cut=cut)) for cut in (100.0, 5.0))
    assert np.array_equal(whole.cut_incidence, np.zeros(160))
    assert np.array_equal(short.cut_incidence[:10], np.zeros(10))
    change = abs(short.coefficients[-1, 0] - whole.coefficients[-1, 0]) / 5.0
    assert 0.5 * change < short.cut_incidence[-1] < 4.0 * change


def test_strips_and_surfaces_add_up():
    lattice = build(geometry(wing(3, 4), tail(2, 2)))
    history = swing(lattice, "pitch", 0.2, panels=1.8, periods=1)
    assert np.allclose(history.strip_lift @ lattice.width, history.force[:, :, 2].sum(axis=1), rtol=1e-12, atol=1e-15)
    scale = PRESSURE * 0.78
    assert np.allclose(history.coefficients[:, 0] * scale, history.force[:, :, 2].sum(axis=1), rtol=1e-12, atol=1e-15)
    assert np.allclose(history.coefficients[:, 4] * scale * CHORD, history.moment[:, :, 1].sum(axis=1), rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("kind", ["prescribed", "free"])
def test_a_step_longer_than_a_chord_is_an_outcome(kind):
    history = simulate(build(geometry(wing(2, 2))), motion.steady(0.1), SPEED, 1.1 * CHORD / SPEED, 3, Wake(kind))
    assert history.outcome is Outcome.STEP_TOO_LONG
    assert "0.286 m" in history.words
    assert np.isnan(history.force).all()
    assert history.wake is None


def test_what_is_not_finite_is_an_outcome_from_there_on():
    wind = gust.Wind(lambda points, t: np.broadcast_to([SPEED, 0.0, np.nan if t > 0.025 else 0.0], points.shape), True)
    history = simulate(build(geometry(wing(2, 2))), motion.steady(0.1), SPEED, 0.01, 5, wind=wind)
    assert history.outcome is Outcome.DIVERGED
    assert "step 3 of 5" in history.words
    assert np.isfinite(history.force[:2]).all()
    assert np.isnan(history.coefficients[2:]).all()


@pytest.mark.parametrize("name", ["speed", "dt", "density", "steps", "threads"])
@pytest.mark.parametrize("value", [0, -1, math.nan])
def test_bad_arguments_are_named(name, value):
    given = {"speed": 1.0, "dt": 0.01, "steps": 2, name: value}
    with pytest.raises(InputError, match=rf"^{name}: "):
        simulate(build(geometry(wing(2, 2))), motion.steady(), **given)


@pytest.mark.parametrize(
    ("name", "value"),
    [("kind", "fre"), ("cut", 0.0), ("core", -1.0), ("spacing", 0.0), ("panel_length", 0.0), ("capacity", 0), ("kernel", "gauss")],
)
def test_bad_wakes_are_named(name, value):
    with pytest.raises(InputError, match=name):
        Wake(**{name: value})
