"""The free wake: what panels hand to particles, frames, mirrors, and the loads that it leads to."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapes import geometry, tail, wing

from levelone.aerodynamics import gust, motion
from levelone.aerodynamics.extraction import derivative, harmonic
from levelone.aerodynamics.frequency import oscillate, prepare
from levelone.aerodynamics.geometry import Surface
from levelone.aerodynamics.kernels import velocities
from levelone.aerodynamics.lattice import build
from levelone.aerodynamics.outcome import Outcome
from levelone.aerodynamics.unsteady import Wake, simulate
from levelone.aerodynamics.wake_blobs import of_panels, released
from levelone.aerodynamics.wake_panels import Edges, Panels, edges
from levelone.errors import InputError

SPEED, CHORD = 6.0, 0.26
STREAM = np.array([SPEED, 0.0, 0.0])
FREE = Wake("free", cut=12.0)
AMPLITUDE = math.radians(2.0)


def impulse(sources):
    """Total strength and linear impulse 1/2 sum x cross G of sources [7, k]."""
    return sources[3:6].sum(axis=1), 0.5 * np.cross(sources[:3].T, sources[3:6].T).sum(axis=0)


def panels(seed, rows=3):
    """Two wings of three and two strips with a crooked wake."""
    rng = np.random.default_rng(seed)
    y = np.array([[0.0, 1.0], [1.0, 2.5], [2.5, 3.0], [0.0, 0.5], [0.5, 1.0]])
    ends = np.zeros((5, 2, 3))
    ends[:, :, 1], ends[3:, :, 0] = y, 4.0
    line = edges(ends)
    nodes = line.joined(ends) + np.arange(rows + 1)[:, None, None] * [0.4, 0.0, 0.0]
    return Panels(line, nodes + rng.normal(scale=0.1, size=nodes.shape), rng.normal(size=(rows, 5)), rng.normal(size=5))


def rings_of(wake):
    """Corners [r m, 4, 3] and circulations of the rings, one by one."""
    left = wake.edges.left
    corners = [wake.nodes[:-1, left], wake.nodes[:-1, left + 1], wake.nodes[1:, left + 1], wake.nodes[1:, left]]
    return np.stack(corners, axis=2).reshape(-1, 4, 3), wake.circulation.ravel()


def test_neighbours_share_nodes_wherever_strips_stand():
    y = [[[1, 2], [0, 1]], [[2, 3], [0, 1], [1, 2]], [[0, 1], [2, 3]]]
    for strips, left, count in zip(y, ([1, 0], [2, 0, 1], [0, 2]), (3, 4, 4), strict=True):
        ends = np.zeros((len(strips), 2, 3))
        ends[:, :, 1] = strips
        found = edges(ends)
        assert (found.left.tolist(), found.nodes) == (left, count)
        assert np.array_equal(found.ends(found.joined(ends)), ends)


def test_the_nodes_of_a_mirrored_wing_form_one_line():
    lattice = build(geometry(wing(2, 4), tail(1, 2)))
    strips = len(lattice.first)
    assert edges(lattice.edge).nodes == strips + 2


@pytest.mark.parametrize("mirrored", [False, True])
def test_grid_of_segments_is_the_sum_of_its_rings(mirrored):
    wake = replace(panels(1), beyond=np.zeros(5))
    points = np.random.default_rng(2).normal(size=(40, 3)) * 2.0
    rings, gamma = rings_of(wake)
    wanted = velocities(points, rings, gamma)
    if mirrored:
        flip = np.array([1.0, -1.0, 1.0])
        wanted = wanted + velocities(points * flip, rings, gamma) * flip
    found = wake.velocities(points, np.zeros((4, wake.edges.nodes)), mirrored, 1)
    assert np.allclose(found, wanted, rtol=0.0, atol=1e-12 * np.abs(wanted).max())


@pytest.mark.theory
def test_core_of_a_segment_is_the_smoothed_law_of_biot_and_savart():
    """Midpoint sum of Gamma dl x r / (4 pi (r^2 + s^2)^(3/2)), and the combination of two cores."""
    core, n = 0.3, 20_000
    square = Panels(
        Edges(np.array([0]), 2, np.arange(2)),
        np.array([[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0.2]]], float),
        np.ones((1, 1)),
        np.zeros(1),
    )
    point = np.array([[0.4, 0.3, 0.1]])

    def smoothed(s):
        corners = rings_of(square)[0][0]
        total = np.zeros(3)
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            r = point - (a + (np.arange(n)[:, None] + 0.5) / n * (b - a))
            total += np.sum(np.cross((b - a) / n, r) / (4.0 * np.pi * (np.sum(r**2, axis=1) + s**2)[:, None] ** 1.5), axis=0)
        return total

    found = square.velocities(point, np.full((2, 2), core), False, 1)[0]
    assert np.allclose(found, 2.0 * smoothed(core) - smoothed(2.0 * core), rtol=1e-7)


@given(seed=st.integers(0, 10**6), spacing=st.sampled_from([0.15, 0.5, math.inf]))
def test_rows_that_become_particles_keep_circulation_and_impulse(seed, spacing):
    wake = panels(seed)
    left, sources, _ = released(wake, 0.1, spacing)
    before, after = (impulse(of_panels(each, 0.1)) for each in (wake, left))
    for i in (0, 1):
        assert np.allclose(after[i] + impulse(sources)[i], before[i], atol=1e-12)
    assert left.rows == wake.rows - 1


@given(seed=st.integers(0, 10**6))
def test_a_whole_wake_has_no_total_strength_and_the_impulse_of_its_rings(seed):
    """A closed ring of circulation Gamma has the impulse Gamma times its area vector (Saffman, Vortex Dynamics, section 3.2)."""
    wake = replace(panels(seed), beyond=np.zeros(5))
    corners, gamma = rings_of(wake)
    area = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    strength, found = impulse(of_panels(wake, 0.1))
    assert np.allclose(strength, 0.0, atol=1e-12)
    assert np.allclose(found, (gamma[:, None] * area).sum(axis=0), atol=1e-12)


def small():
    return build(geometry(wing(3, 4, incidence=0.05), tail(2, 2)))


def swing(lattice, k=0.2, kind="pitch", amplitude=AMPLITUDE, steps=None, wake=FREE, **changes):
    period = math.pi * CHORD / (k * SPEED)
    dt = period / round(period / (0.25 * CHORD / SPEED))
    moving = motion.oscillation(kind, amplitude, 2.0 * k * SPEED / CHORD, SPEED)
    return simulate(lattice, moving, SPEED, dt, steps or round(1.5 * period / dt), wake, **changes)


def test_only_the_motion_relative_to_the_air_matters():
    lattice, velocity = small(), np.array([-SPEED, 0.4, 0.0])
    tunnel = swing(lattice, steps=25, wake=Wake("free", cut=4.0))
    moving = motion.oscillation("pitch", math.radians(2.0), 0.4 * SPEED / CHORD, SPEED)
    flown = simulate(
        lattice,
        motion.flying(moving, velocity),
        SPEED,
        tunnel.time[0],
        25,
        Wake("free", cut=4.0),
        gust.uniform(velocity + STREAM),
    )
    assert tunnel.removed > 0
    assert np.allclose(flown.force, tunnel.force, rtol=0.0, atol=1e-11 * np.abs(tunnel.force).max())
    assert np.allclose(flown.moment, tunnel.moment, rtol=0.0, atol=1e-11 * np.abs(tunnel.moment).max())


def test_one_half_is_solved_for_the_same_loads_to_rounding():
    lattice = small()
    skew = replace(gust.uniform((SPEED, 0.0, 0.0)), symmetric=False)
    half, whole = (swing(lattice, steps=25, wind=wind) for wind in (None, skew))
    assert 2 * len(half.wake.particles) == len(whole.wake.particles) - 2 * 20
    for name in ("gamma", "force", "moment"):
        assert np.allclose(getattr(half, name), getattr(whole, name), rtol=0.0, atol=1e-11 * np.abs(getattr(half, name)).max()), (
            name
        )


def test_threads_do_not_change_results():
    one, two = (swing(small(), steps=25, threads=threads) for threads in (1, 2))
    assert np.array_equal(one.force, two.force)
    assert np.array_equal(one.wake.particles.position, two.wake.particles.position)


@pytest.mark.parametrize("cut", [0.5, 3.0, 100.0])
def test_total_strength_of_the_wake_stays_zero_also_where_it_is_cut(cut):
    """All rings are closed; a tiny motion leaves the strength of particles as it is."""
    lattice = build(geometry(replace(wing(3, 4), mirrored=False)))
    history = swing(lattice, amplitude=1e-9, steps=20, wake=Wake("free", cut=cut))
    wake, particles = history.wake.panels, history.wake.particles
    sources = np.concatenate(
        [of_panels(wake, 0.1), np.vstack([particles.position.T, particles.strength.T, particles.core])], axis=1
    )
    size = np.abs(sources[3:6]).sum()
    assert np.abs(sources[3:6].sum(axis=1)).max() < 1e-6 * size


@pytest.mark.theory
@pytest.mark.parametrize("shift", [0.0, 0.0325])
def test_wing_and_tail_agree_with_the_frequency_domain_wherever_rows_pass_the_tail(shift):
    """Half a row further or not: particles of 0.25 c a row that act one by one would move the moment by 6."""
    behind = Surface("tail", (1.08 + shift, 0.0, 0.0), 0.3605, 0.13, 0.13, chordwise=4, strips=3)
    lattice = build(geometry(wing(8, 6), behind))
    history = swing(lattice)
    linear = oscillate(prepare(lattice), np.array([0.2]), ("pitch",), np.zeros(3))[0, 0]
    for column, tolerance in ((0, 0.08), (4, 0.15)):
        fit = harmonic(history.time, history.coefficients[:, column], 0.4 * SPEED / CHORD)
        found = derivative(fit, math.radians(2.0), 0.2).quadrature
        assert found == pytest.approx(linear[column].imag / 0.2, abs=tolerance)


def test_particles_are_cut_off_with_age_and_counted():
    lattice = build(geometry(wing(2, 3)))
    history = swing(lattice, steps=40, wake=Wake("free", cut=5.0, panel_length=0.5))
    a_row = 3 + 3
    assert len(history.wake.particles) == (21 - 3) * a_row
    assert history.removed == (40 - 21) * a_row
    assert history.wake.particles.position[:, 0].max() < 0.195 + 5.3 * CHORD


@pytest.mark.parametrize("formulation", ["reformulated", "classic"])
@pytest.mark.parametrize("kernel", ["winckelmans", "gaussian-erf"])
def test_kernels_and_formulations_agree_for_a_small_motion(kernel, formulation):
    lattice = build(geometry(wing(3, 4)))
    usual, other = (swing(lattice, steps=30, wake=replace(FREE, kernel=kernel, formulation=formulation)) for _ in (0, 1))
    assert np.array_equal(usual.force, other.force)
    base = swing(lattice, steps=30)
    assert np.allclose(other.coefficients[:, 0], base.coefficients[:, 0], atol=0.01 * np.abs(base.coefficients[:, 0]).max())


def test_a_wake_that_outgrows_its_capacity_is_an_outcome():
    history = swing(build(geometry(wing(2, 3))), steps=12, wake=Wake("free", panel_length=0.5, capacity=30))
    assert history.outcome is Outcome.WAKE_FULL
    assert "at step 9 of 12" in history.words
    assert np.isfinite(history.force[:8]).all()
    assert np.isnan(history.force[8:]).all()


def test_a_core_thinner_than_the_distance_of_rows_is_refused():
    with pytest.raises(InputError, match=r"wake\.core: 0\.1 chords; 0\.199 or more"):
        swing(build(geometry(wing(2, 3))), steps=3, wake=Wake("free", core=0.1))


def test_the_wake_of_a_lifting_wing_sinks_and_rolls_up():
    lattice = build(geometry(wing(2, 8, incidence=0.15)))
    history = simulate(lattice, motion.steady(), 1.0, 0.25 * CHORD, 60, Wake("free", cut=20.0))
    last = history.wake.particles.position
    old = last[last[:, 0] > 2.5]
    middle, tip = old[old[:, 1] < 0.3], old[old[:, 1] > 1.3]
    assert middle[:, 2].mean() < -0.01
    assert tip[:, 2].max() > middle[:, 2].mean() + 0.02
    assert tip[:, 1].min() < 1.45
