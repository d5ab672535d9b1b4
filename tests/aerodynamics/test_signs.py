"""Signs that a pilot would know, of every coefficient and motion."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import geometry, tail, wing

from levelone.aerodynamics.coefficients import NAMES, Reference, coefficients
from levelone.aerodynamics.frequency import oscillate, prepare
from levelone.aerodynamics.geometry import Surface
from levelone.aerodynamics.lattice import build


@pytest.mark.theory
@pytest.mark.parametrize(
    ("at", "force", "expected"),
    [
        ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), {"C_L": 2.0, "C_m": -4.0}),  # lift behind the reference point: nose down
        ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), {"C_L": 2.0, "C_l": -0.5}),  # lift on the right wing: left wing down
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), {"C_Y": 2.0, "C_n": -0.5}),  # force to the right behind: nose left
        ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), {"C_D": 2.0, "C_n": 0.5}),  # drag on the right wing: nose right
        ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), {"C_D": 2.0, "C_m": 4.0}),  # drag above: nose up
        ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), {"C_Y": 2.0, "C_l": 0.5}),  # force to the right above: right wing down
    ],
)
def test_coefficients_of_a_unit_force(at, force, expected):
    """Area 1, chord 1/2, span 4; a force over density at unit speed counts twice."""
    found = coefficients(Reference(1.0, 0.5, 4.0), np.array(force), np.cross(at, force))
    assert dict(zip(NAMES, found.tolist(), strict=True)) == {name: expected.get(name, 0.0) for name in NAMES}


def test_signs_of_an_aircraft():
    """Wing with incidence and dihedral, tail, and a fin behind and above the reference point."""
    fin = Surface("fin", (1.0, 0.0, 0.02), 0.3, 0.2, 0.2, dihedral=np.pi / 2, mirrored=False, chordwise=2, strips=3)
    shape = geometry(wing(2, 5, incidence=0.08, dihedral=0.08), tail(2, 3, incidence=0.02), fin)
    motions = ("alpha", "q", "beta", "p", "r")
    found = oscillate(prepare(build(shape)), np.zeros(1), motions, np.zeros(3))[:, 0].real
    at = {f"{name}{motion}": found[i, j] for i, motion in enumerate(motions) for j, name in enumerate(NAMES)}
    positive = ("C_Lalpha", "C_Lq", "C_Dalpha", "C_nbeta", "C_lr", "C_Yr")
    negative = ("C_malpha", "C_mq", "C_Ybeta", "C_lbeta", "C_lp", "C_nr", "C_np")
    assert [name for name in positive if not at[name] > 0.0] == []
    assert [name for name in negative if not at[name] < 0.0] == []
