"""Derivatives of the DUST sample (wing and tailplane, pitch of 2 deg at k = 0.2 and 6 m/s) and of loads by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from levelone.aerodynamics.coefficients import NAMES, Reference
from levelone.aerodynamics.outcome import Outcome
from levelone.campaign.dust_derivatives import FromDust, from_dust
from levelone.errors import InputError

LOADS = Path(__file__).parents[1] / "reference" / "dust" / "integral_loads_total.dat"
REFERENCE = Reference(0.78, 0.26, 3.0)
OMEGA, AMPLITUDE, SPEED, DENSITY = 9.230769, math.radians(2.0), 6.0, 1.225
HEAD = """# Integral loads: N.components:   1
# Ref.sys     : 0
# Components : wing
# t , Fx, Fy, Fz, Mx, My, Mz, ref_mat(9), ref_off(3)
"""


def read(path: Path = LOADS, **more) -> FromDust:
    return from_dust(
        path, **({"omega": OMEGA, "amplitude": AMPLITUDE, "airspeed": SPEED, "density": DENSITY, "reference": REFERENCE} | more)
    )


def quadrature(found: FromDust, name: str) -> float:
    return float(found.derivatives.at(found.derivatives.motions[0], name)[0][0])


def made(path: Path, force: np.ndarray, moment: np.ndarray, time: np.ndarray, offset: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Path:
    rest = np.hstack([np.tile(np.eye(3).ravel(), (len(time), 1)), np.tile(offset, (len(time), 1))])
    rows = np.hstack([time[:, None], force, moment, rest])
    path.write_text(HEAD + "\n".join(" ".join(f"{each:.15e}" for each in row) for row in rows) + "\n")
    return path


@pytest.mark.oracle
def test_sample_gives_its_derivatives() -> None:
    found = read()
    assert found.derivatives.k == pytest.approx([0.2], rel=1e-6)
    assert quadrature(found, "C_L") == pytest.approx(11.03, rel=0.005)
    assert quadrature(found, "C_m") == pytest.approx(-25.93, rel=0.005)
    assert set(found.outcomes) == {Outcome.UNCHECKED}  # 1.49 periods: the value stands, with a caution
    assert np.isnan(found.derivatives.at("pitch", "C_L")[1]).all()


@pytest.fixture
def by_hand(tmp_path: Path) -> Path:
    """Two and a half periods of loads that are known: C_j = a_j sin + k b_j cos per rad."""
    time = np.linspace(0.0, 5.0 * math.pi / OMEGA, 201)
    sin, cos = np.sin(OMEGA * time), np.cos(OMEGA * time)
    pressure = 0.5 * DENSITY * SPEED**2 * REFERENCE.area
    lift, pitching, drag, side, rolling, yawing = (
        AMPLITUDE * (a * sin + 0.2 * b * cos) * pressure
        for a, b in ((5.0, 7.0), (-1.5, -20.0), (0.1, 0.3), (0.2, 0.4), (0.3, 0.6), (0.4, 0.8))
    )
    force = np.stack([drag, side, lift], axis=1)
    moment = np.stack([-3.0 * rolling, 0.26 * pitching, -3.0 * yawing], axis=1)
    return made(tmp_path / "loads.dat", force, moment, time)


@pytest.mark.theory
def test_axes_and_signs(by_hand: Path) -> None:
    found = read(by_hand, motion="rate")
    assert found.derivatives.motions == ("rate",)
    expected = {"C_L": (5.0, 7.0), "C_m": (-1.5, -20.0), "C_D": (0.1, 0.3), "C_Y": (0.2, 0.4), "C_l": (0.3, 0.6), "C_n": (0.4, 0.8)}
    for name, (in_phase, out) in expected.items():
        assert quadrature(found, name) == pytest.approx(out, rel=1e-6)
        assert found.derivatives.in_phase[0, 0, NAMES.index(name)] == pytest.approx(in_phase, rel=1e-6)
    assert set(found.outcomes) == {Outcome.OK}


@pytest.mark.theory
def test_moments_are_moved_to_the_point(by_hand: Path) -> None:
    """A point further aft by one chord: the lift ahead of it turns the nose up by C_L."""
    aft = read(by_hand, point=(0.26, 0.0, 0.0))
    assert quadrature(aft, "C_m") == pytest.approx(-20.0 + 7.0, rel=1e-6)
    assert quadrature(aft, "C_L") == pytest.approx(7.0, rel=1e-6)


def test_start_of_the_motion_is_its_phase(by_hand: Path) -> None:
    half = read(by_hand, start=math.pi / OMEGA)
    assert quadrature(half, "C_L") == pytest.approx(-7.0, rel=1e-6)


def test_record_that_is_too_short_is_nan_with_the_reason(by_hand: Path) -> None:
    found = read(by_hand, omega=OMEGA / 3.0)
    assert np.isnan(found.derivatives.quadrature).all()
    assert set(found.outcomes) == {Outcome.RECORD_TOO_SHORT}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"omega": 0.0}, "omega: 0 is not a positive number"),
        ({"airspeed": -6.0}, "airspeed: -6 is not a positive number"),
        ({"motion": "roll"}, "motion: unknown name 'roll'"),
    ],
)
def test_bad_input_is_named(given: dict, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read(**given)
    assert words in str(caught.value)


def test_system_that_moves_is_refused(tmp_path: Path) -> None:
    text = LOADS.read_text().replace("0.100000000000000E+001", "0.990000000000000E+000", 1)
    path = tmp_path / "turned.dat"
    path.write_text(text)
    with pytest.raises(InputError, match=r"^turned\.dat: the reference system '0' moves"):
        read(path)
