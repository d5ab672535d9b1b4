"""Slipstreams of a vehicle's rotors and its wing, on very coarse grids: wiring, signs, bookkeeping."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from levelone.aerodynamics.disc_wake import Marching
from levelone.aerodynamics.outcome import Outcome
from levelone.campaign import rotor_interference
from levelone.campaign.rotor_interference import Case, Found, cambered, cases, discs, interference, summary
from levelone.config.geometry_file import load_geometry
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError

COARSE = Marching(step=0.2, points=12, core=0.5, free=8, far=8, settle=16, window=4)
BASE = Case("coarse", how=COARSE, halves=1)


@pytest.fixture(scope="module")
def vehicle():
    return load_vehicle("reference-evtol")


@pytest.fixture(scope="module")
def found():
    chosen = [replace(BASE, rotors=which, clean=None) for which in ("all", "front", "rear")]
    return dict(zip(("all", "front", "rear"), interference(chosen=chosen), strict=True))


def test_rotors_become_discs(vehicle):
    made = discs(replace(BASE, rise=0.05, aft=0.01, spread=0.1), vehicle, (0.2, 0.0, 0.3), 5.0, 0.089)
    front = next(disc for disc in made if disc.centre[0] < 0.0 and disc.centre[1] == 0.45)
    # body axes: 0.4 m forward of the centre of gravity
    assert front.centre == pytest.approx((0.2 - 0.4 - 0.1 + 0.01, 0.45, 0.35))
    shorter = discs(replace(BASE, spread=-0.1), vehicle, (0.0, 0.0, 0.0), 5.0, 0.089)
    assert {round(disc.centre[0], 12) for disc in shorter} == {-0.3, 0.3}
    assert front.axis == (0.0, 0.0, 1.0)
    assert len(made) == 8


def test_thrust_is_the_weight_less_the_lift(found):
    lift = 0.5 * 1.225 * 5.0**2 * 0.78 * found["all"].clean[0]
    assert 8.0 * found["all"].thrust + lift == pytest.approx(7.0 * 9.80665, rel=1e-12)


@pytest.mark.theory
def test_discs_ahead_take_lift_and_discs_behind_add_it(found):
    # a lifting disc has downwash behind it and upwash ahead of it
    assert found["front"].loss < -0.02
    assert found["rear"].loss > 0.02
    together = found["front"].loss + found["rear"].loss
    assert found["all"].loss == pytest.approx(together, abs=0.35 * abs(found["rear"].loss))


def test_level_flight_stays_symmetric(found):
    np.testing.assert_allclose(found["all"].change[[2, 3, 5]], 0.0, atol=1e-12)


def test_a_mean_line_of_four_digits():
    shape = cambered(load_geometry("reference-evtol"), 0.04, 0.4)
    x, z = np.array(shape.surfaces[0].camber).T
    assert z.max() == pytest.approx(0.04, abs=1e-4)
    assert x[z.argmax()] == pytest.approx(0.4, abs=0.04)
    assert np.interp(0.7, x, z) == pytest.approx(0.04 / 0.36 * (0.2 + 0.56 - 0.49), abs=1e-4)


@pytest.mark.paper
def test_the_camber_that_the_clean_lift_asks_for():
    (case,) = interference(chosen=[replace(BASE, halves=2, how=replace(COARSE, settle=0, window=2))])
    assert case.clean[0] == pytest.approx(0.6268, abs=1e-5)
    assert 0.02 < case.camber < 0.04


def test_cases_have_names_of_their_own_and_change_something():
    every = cases()
    assert len({case.label for case in every}) == len(every)
    assert [case.group for case in every].count("base") == 1
    base = next(case for case in every if case.group == "base")
    assert all(replace(case, label=base.label, group="base") != base for case in every if case is not base)


def made(group, loss, outcome=Outcome.OK, unsteady=0.0):
    change = np.array([loss, 0.0, 0.0, 0.0, 0.0, 0.0])
    return Found(Case(group, group), change, change[None], np.full(6, unsteady), change, ("wing",), 1.0, 0.0, outcome, "")


def test_summary():
    every = [
        made("base", 0.10, unsteady=0.02),
        made("numerical", 0.13),
        made("numerical", 0.06),
        made("assumption", -0.2),
        made("diagnosis", 9.0),
    ]
    got = summary([*every, made("assumption", 0.15, Outcome.NOT_CONVERGED)])
    assert got.base == 0.10
    assert got.numerical == pytest.approx(np.sqrt(0.03**2 + 0.04**2 + 0.02**2))
    assert (got.lowest, got.highest) == (-0.2, 0.15)
    assert (got.failed, got.unsettled) == (0, 1)


def test_a_failed_case_is_seen_in_the_summary():
    got = summary([made("base", 0.10), made("assumption", np.nan, Outcome.DIVERGED)])
    assert np.isnan(got.lowest)
    assert got.failed == 1


def test_rotors_that_are_no_mirror_images_are_all_marched(vehicle):
    placed = discs(BASE, vehicle, (0.0, 0.0, 0.0), 5.0, 0.089)
    half, mirrored = rotor_interference._half(placed)
    assert mirrored
    assert len(half) == 4
    assert rotor_interference._half(placed[:-1]) == (placed[:-1], False)


@pytest.mark.parametrize(
    ("chosen", "speed", "field"),
    [
        ([BASE], 0.0, "speed"),
        ([replace(BASE, clean=None)], 40.0, "speed"),
        ([replace(BASE, rotors="middle", clean=None)], 5.0, "rotors"),
        ([replace(BASE, clean=5.0)], 5.0, "clean"),
    ],
)
def test_bad_input(chosen, speed, field):
    with pytest.raises(InputError) as caught:
        interference(speed=speed, chosen=chosen)
    assert caught.value.field == field
