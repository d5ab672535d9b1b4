"""The lattice as a body: where its panels lie, what its strips share, how its loads add up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapes import geometry, tail, wing

from levelone.aerodynamics.frequency import prepare, steady
from levelone.aerodynamics.geometry import Surface
from levelone.aerodynamics.kernels import influence, velocities
from levelone.aerodynamics.lattice import build, rings
from levelone.aerodynamics.loads import carriers, net, rate_forces
from levelone.errors import InputError

angles = st.floats(-0.5, 0.5)


@given(angles, st.floats(-0.4, 0.6), st.floats(-0.1, 0.1), st.sampled_from(["uniform", "cosine"]))
def test_mirrored_strips_are_images(sweep, dihedral, incidence, spacing):
    shape = wing(3, 4, sweep=sweep, dihedral=max(dihedral, 0.0), incidence=incidence, chord_spacing=spacing)
    lattice = build(geometry(shape))
    half, flip = len(lattice.bound) // 2, np.array([1.0, -1.0, 1.0])
    np.testing.assert_array_equal(lattice.collocation[half:], lattice.collocation[:half] * flip)
    np.testing.assert_array_equal(lattice.normal[half:], lattice.normal[:half] * flip)
    np.testing.assert_array_equal(lattice.bound[half:, ::-1], lattice.bound[:half] * flip)
    np.testing.assert_allclose(np.linalg.norm(lattice.normal, axis=1), 1.0)
    assert np.all(lattice.normal[:half, 2] > 0.0)


def test_panels_lie_where_the_quarter_rule_puts_them():
    lattice = build(geometry(wing(4, 3)))
    first = lattice.first[0]
    aft = lattice.collocation[first : first + 4, 0]
    np.testing.assert_allclose(aft, 0.26 * (np.array([0.75, 1.75, 2.75, 3.75]) / 4.0 - 0.25))
    np.testing.assert_allclose(lattice.bound[first : first + 4, 0, 0], 0.26 * (np.array([0.25, 1.25, 2.25, 3.25]) / 4.0 - 0.25))
    assert lattice.edge[0, 0, 0] == pytest.approx(0.75 * 0.26)


def test_the_bound_rings_tile_the_surface_and_reach_to_the_shed_line():
    lattice = build(geometry(wing(4, 3)))
    corner = rings(lattice, np.ones(len(lattice.first)))
    np.testing.assert_array_equal(corner[0, 3], corner[1, 0])
    np.testing.assert_array_equal(corner[0, 2], corner[1, 1])
    assert corner[lattice.trailing[0], 2, 0] == pytest.approx(lattice.edge[0, 1, 0] + 0.25 * lattice.last[0])


@given(st.integers(1, 12), st.integers(1, 8))
def test_a_tail_in_the_wings_wake_shares_its_strips(strips, of_tail):
    lattice = build(geometry(wing(2, strips), tail(1, of_tail)))
    wings, tails = (lattice.edge[lattice.surface == i][:, :, 1] for i in (0, 1))
    inside = wings[np.all(np.abs(wings) <= 0.3605 + 1e-9, axis=1)]
    np.testing.assert_allclose(np.sort(inside.ravel()), np.sort(tails.ravel()), atol=1e-12)
    assert len(tails) >= 2 * of_tail
    assert lattice.width[lattice.surface == 0].sum() == pytest.approx(3.0)


def test_a_tail_far_above_the_wake_keeps_its_own_strips():
    high = replace(tail(2, 3), position=(1.08, 0.0, 0.5))
    lattice = build(geometry(wing(2, 5), high))
    assert [np.sum(lattice.surface == i) for i in (0, 1)] == [10, 6]


def test_an_end_plate_is_cut_where_the_tail_stands():
    plate = Surface("plate", (1.08, 0.3605, -0.06), 0.2, 0.13, 0.13, dihedral=np.pi / 2, chordwise=2, strips=5)
    lattice = build(geometry(wing(2, 4), tail(2, 3), plate))
    heights = lattice.edge[lattice.surface == 2][:, :, 2]
    assert np.min(np.abs(heights)) < 1e-9


def test_similar_grids():
    """Grids of 1, 2 and 3 halves: counts in the ratio 1 : 2 : 3 in every interval; the second is the ordinary one, if even."""
    shape = geometry(wing(4, 6), tail(2, 4))
    counts = [[np.sum(build(shape, halves).surface == i) for i in (0, 1)] for halves in (1, 2, 3)]
    np.testing.assert_array_equal(counts[1], np.multiply(counts[0], 2))
    np.testing.assert_array_equal(counts[2], np.multiply(counts[0], 3))
    alone = geometry(wing(4, 6))
    np.testing.assert_array_equal(build(alone, 2).collocation, build(alone).collocation)


def test_surfaces_that_cross_are_refused():
    crossing = replace(tail(2, 3), position=(0.0, 0.0, -0.05), dihedral=0.5)
    with pytest.raises(InputError, match="wing"):
        build(geometry(wing(2, 4), crossing))


@pytest.mark.theory
def test_ring_velocity_at_its_middle():
    """Square of side a: 2 sqrt(2) Gamma / (pi a) across its plane (Biot and Savart)."""
    a = 0.3
    square = 0.5 * a * np.array([[[-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]]])
    found = velocities(np.zeros((1, 3)), square, np.array([2.0]))
    np.testing.assert_allclose(found[0], [0.0, 0.0, -2.0 * 2.0 * np.sqrt(2.0) / (np.pi * a)], atol=1e-14)
    normal = influence(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), square)
    assert normal[0, 0] == pytest.approx(0.5 * found[0, 2])


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.2, 3.0))
def test_velocities_of_rings_have_no_divergence(x, y, z):
    ring = np.array([[[0.0, 0.0, 0.0], [0.1, 1.0, 0.0], [1.0, 1.2, 0.1], [0.9, -0.1, 0.0]]])
    step = 1e-4 * np.eye(3)
    points = np.array([x, y, z]) + np.concatenate([step, -step])
    u = velocities(points, ring, np.ones(1))
    gradient = (u[:3] - u[3:]) / 2e-4
    assert abs(np.trace(gradient)) < 1e-5 * (1.0 + np.abs(gradient).max())


def test_a_point_on_a_segment_is_not_moved_by_it():
    ring = np.array([[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]]])
    assert np.all(np.isfinite(velocities(np.array([[0.0, 0.5, 0.0], [0.0, 0.0, 0.0]]), ring, np.ones(1))))


@pytest.mark.theory
@pytest.mark.parametrize("panels", [2, 5, 9])
def test_acceleration_of_a_flat_plate_is_loaded_exactly(panels):
    """Circulation of a flat plate in steady flow, growing with time: force and moment of dPhi/dt in closed form, per unit span.

    Cumulative circulation 2 (sqrt(x(1-x)) + asin sqrt x) of a chord of 1 at unit incidence and speed; its integral is 3 pi/4.
    """
    width = 1e5
    surface = Surface("wing", (0.0, -0.5 * width, 0.0), width, 1.0, 1.0, mirrored=False, chordwise=panels, strips=1)
    lattice = build(geometry(surface, area=width, chord=1.0, span=width))
    x_vortex, x_point = (np.arange(panels) + 0.25) / panels, (np.arange(panels) + 0.75) / panels
    gamma = np.cumsum(np.linalg.solve(1.0 / (2.0 * np.pi * (x_point[:, None] - x_vortex)), np.ones(panels)))
    # the loaded part of the last ring, less the quarter that a wake of the plate's own spacing leaves free of load
    carrier = carriers(lattice, np.ones(1))
    force = rate_forces(carrier, gamma)[:, 2].sum() / width + 0.25 / panels * gamma[-1]
    assert force == pytest.approx(0.75 * np.pi, rel=1e-9)


def test_net_circulation_is_that_of_the_bound_vortices():
    lattice = build(geometry(wing(3, 2)))
    gamma = np.arange(len(lattice.bound), dtype=float)
    found = net(lattice, gamma)
    assert found[lattice.first].tolist() == gamma[lattice.first].tolist()
    np.testing.assert_array_equal(np.delete(found, lattice.first), 1.0)


@given(st.floats(-0.2, 0.2), st.floats(0.1, 0.4), st.floats(0.0, 0.4))
def test_bound_vortices_are_loaded_on_themselves(twist, tip_chord, sweep):
    """Beside its own straight segment a point would see a huge velocity: on a twisted surface the mean surface is not straight."""
    surface = Surface("wing", (0.0, 0.0, 0.0), 1.5, 0.3, tip_chord, sweep=sweep, twist=twist, chordwise=3, strips=4)
    lattice = build(geometry(surface))
    along, to = lattice.bound[:, 1] - lattice.bound[:, 0], lattice.midpoint - lattice.bound[:, 0]
    off = np.linalg.norm(np.cross(along, to), axis=1) / np.linalg.norm(along, axis=1)
    assert np.max(off) < 1e-15
    assert np.all(np.einsum("na,na->n", along, to) > 0.0)


@given(st.floats(0.01, 0.1))
def test_twist_is_lift_between_root_and_tip(angle):
    """Washout from incidence to zero: between half and all of the lift of the untwisted wing; drag positive."""
    whole, washed = (
        np.asarray(steady(prepare(build(geometry(wing(3, 6, incidence=angle, twist=twist)))))) for twist in (0.0, -angle)
    )
    assert 0.5 * whole[0] < washed[0] < 0.7 * whole[0]
    assert 0.0 < washed[1] < whole[1]
