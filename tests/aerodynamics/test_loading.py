"""Loads of panels and strips: they add up to the coefficients, and a flat plate carries what closed forms say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import gamma

from levelone.aerodynamics.frequency import Plant, oscillate, prepare, steady
from levelone.aerodynamics.geometry import Geometry, Surface, points, refined
from levelone.aerodynamics.lattice import build
from levelone.aerodynamics.loading import MOTIONS, areas, at_rest, loading, panels
from levelone.config.geometry_file import load_geometry
from levelone.errors import InputError


def coarse(name: str) -> Plant:
    return prepare(build(refined(load_geometry(name), 0.5, 0.5)))


@pytest.fixture(scope="module", params=["reference-wing-tail", "reference-evtol"])
def plant(request: pytest.FixtureRequest) -> Plant:
    return coarse(request.param)


@pytest.mark.parametrize("motion", MOTIONS)
def test_forces_of_the_panels_add_up_to_the_derivatives(plant, motion):
    lattice = plant.lattice
    rate = {"q": 2.0 / lattice.chord, "p": 2.0 / lattice.span, "r": 2.0 / lattice.span}.get(motion, 1.0)
    lift, drag, side = rate * oscillate(plant, np.zeros(1), (motion,), lattice.reference_point)[0, 0, :3].real
    if motion == "alpha":  # derivatives are along the wind, which has turned
        lift, drag = lift + steady(plant)[1], drag - steady(plant)[0]
    x, y, z = 2.0 * loading(plant, motion).force.sum(axis=0) / lattice.area
    np.testing.assert_allclose([z, x, y], [lift, drag, side], rtol=1e-9, atol=1e-12)


def test_the_load_at_rest_adds_up_to_the_steady_coefficients(plant):
    x, y, z = 2.0 * at_rest(plant).force.sum(axis=0) / plant.lattice.area
    np.testing.assert_allclose([z, x, y], steady(plant)[:3].real, rtol=1e-9, atol=1e-12)


def test_strip_loads_of_a_flat_geometry_are_shares_of_its_lift():
    plant = coarse("reference-wing-tail")
    lattice, load = plant.lattice, loading(plant, "alpha")
    lift = oscillate(plant, np.zeros(1), ("alpha",), lattice.reference_point)[0, 0, 0].real
    assert float(load.reaching @ lattice.width) * lattice.chord / lattice.area == pytest.approx(lift, rel=1e-9)
    np.testing.assert_allclose(load.normal * lattice.chord_at, load.reaching * lattice.chord, rtol=1e-12)
    by_panel = np.bincount(lattice.strip, load.pressure * areas(panels(lattice)))
    np.testing.assert_allclose(by_panel, load.normal * lattice.chord_at * lattice.width, rtol=1e-9)


def test_halves_mirror_each_other(plant):
    half = plant.half
    for motion, sign in (("alpha", 1.0), ("q", 1.0), ("p", -1.0), ("beta", -1.0)):
        load = loading(plant, motion)
        np.testing.assert_array_equal(load.circulation[half:], sign * load.circulation[:half])
        np.testing.assert_allclose(load.pressure[half:], sign * load.pressure[:half], rtol=1e-9, atol=1e-12)


@pytest.mark.theory
def test_a_flat_plate_carries_the_load_of_the_lumped_vortex_solution():
    """The lattice of a flat plate in closed form (James, Comput. Methods Appl. Mech. Eng. 1, 1972); lift 2 pi (1 - 2/A)."""
    n, aspect = 8, 1e4
    wing = Surface("wing", (0.0, 0.0, 0.0), 0.5 * aspect, 1.0, 1.0, chordwise=n, strips=1)
    geometry = Geometry("plate", "", (wing,), aspect, 1.0, aspect, (0.0, 0.0, 0.0))
    load = loading(prepare(build(geometry)), "alpha")
    j = np.arange(1, n + 1)
    share = gamma(j - 0.5) / gamma(j) * gamma(n - j + 1.5) / gamma(n - j + 1)
    np.testing.assert_allclose(load.pressure[:n], n * 2.0 * math.pi * (1.0 - 2.0 / aspect) * share / share.sum(), rtol=1e-6)


def test_panels_fill_the_surface_and_carry_their_vortices():
    swept = Surface("wing", (0.0, 0.0, 0.1), 2.0, 1.0, 0.5, sweep=0.4, dihedral=0.1, incidence=0.05, twist=-0.05, chordwise=5,
                    strips=3, chord_spacing="cosine")  # fmt: skip
    lattice = build(Geometry("swept", "", (swept,), 3.0, 0.75, 4.0, (0.0, 0.0, 0.0)))
    quads = panels(lattice)
    assert areas(quads).sum() == pytest.approx(3.0, rel=2e-3)  # twist and sliding of the sections change it a little
    quarter = quads[:, :2] + 0.25 * (quads[:, [3, 2]] - quads[:, :2])
    np.testing.assert_allclose(quarter, lattice.bound, atol=1e-12)
    root = quads[lattice.first[0], 0]
    np.testing.assert_allclose(root, points(swept, 0.0, 0.0), atol=1e-12)
    within = np.setdiff1d(np.arange(len(quads)), lattice.first)
    np.testing.assert_allclose(quads[within, :2], quads[within - 1][:, [3, 2]], atol=1e-12)


def test_corners_of_a_cambered_panel_stay_near_the_mean_line():
    camber = tuple((float(x), float(0.16 * x * (1.0 - x))) for x in np.linspace(0.0, 1.0, 21))
    flat = Surface("wing", (0.0, 0.0, 0.0), 2.0, 1.0, 1.0, chordwise=8, strips=1)
    lattice = build(Geometry("cambered", "", (replace(flat, camber=camber),), 4.0, 1.0, 4.0, (0.0, 0.0, 0.0)))
    front = panels(lattice)[:8, 0]
    mean = 0.16 * (front[:, 0] + 0.25) * (0.75 - front[:, 0])
    rise = 0.16 / 8  # of the first panel
    assert np.abs(front[:, 2] - mean).max() < 0.1 * rise


def test_an_unknown_motion_is_refused():
    with pytest.raises(InputError, match="alpha"):
        loading(coarse("reference-wing"), "alfa")
