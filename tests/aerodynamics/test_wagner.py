"""The time domain in two dimensions: Theodorsen, Wagner, Kussner, and the order of convergence."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shapes import geometry

from levelone.aerodynamics import gust, motion, theory
from levelone.aerodynamics.extraction import derivative, harmonic
from levelone.aerodynamics.geometry import Surface
from levelone.aerodynamics.lattice import Lattice, build
from levelone.aerodynamics.unsteady import Wake, simulate

REFERENCE = tomllib.loads((Path(__file__).parents[1] / "reference" / "aerodynamics.toml").read_text(encoding="utf-8"))
THEORY = {"pitch": theory.pitch, "heave": theory.heave, "rate": theory.pitch_rate}
SMALL = 1e-4
NEVER = Wake(cut=1e6)
WIDTH = 1e4


def section(chordwise: int) -> Lattice:
    """One strip of unit chord, so wide that its middle sees two-dimensional flow."""
    surface = Surface("wing", (0.0, -0.5 * WIDTH, 0.0), WIDTH, 1.0, 1.0, mirrored=False, chordwise=chordwise, strips=1)
    return build(geometry(surface, area=WIDTH, chord=1.0, span=WIDTH))


def derivatives(kind, k, panels, axis=0.0):
    """In-phase part and quadrature of lift and moment about the axis; a time step of one panel (a whole number in a period)."""
    lattice = replace(section(panels), reference_point=np.array([axis, 0.0, 0.0]))
    steps = round(np.pi / k * panels)
    dt = np.pi / k / steps
    history = simulate(lattice, motion.oscillation(kind, SMALL, 2.0 * k, 1.0, (axis, 0.0, 0.0)), 1.0, dt, 2 * steps + 1, NEVER)
    found = [derivative(harmonic(history.time, history.coefficients[:, i], 2.0 * k, tolerance=0.1), SMALL, k) for i in (0, 4)]
    return np.array([part for each in found for part in (each.in_phase, each.quadrature)])


def exact(kind, k, axis):
    answer = THEORY[kind](np.array([k]), theory.MID_CHORD if axis else theory.QUARTER_CHORD)
    return np.array([part[0] for z in (answer.lift, answer.moment) for part in (z.real, z.imag / k)])


@pytest.mark.theory
@pytest.mark.parametrize(
    ("kind", "k", "axis"),
    [("heave", 0.05, 0.0), ("pitch", 0.1, 0.0)]
    + [(kind, k, axis) for k in (0.2, 0.3, 0.5) for kind, axis in (("pitch", 0.0), ("pitch", 0.25), ("heave", 0.0), ("rate", 0.0))],
)
def test_theodorsen_after_extrapolation(kind, k, axis):
    coarse, fine = derivatives(kind, k, 4, axis), derivatives(kind, k, 8, axis)
    assert np.abs(fine + (fine - coarse) / 3.0 - exact(kind, k, axis)).max() < 0.004 * 2.0 * np.pi


@pytest.mark.order
@pytest.mark.parametrize("kind", ["pitch", "rate"])
def test_lift_and_moment_converge_with_second_order(kind):
    """Period of six chords: the step is exactly a panel. Towards the value extrapolated from the finest two: the start lingers."""
    panels, k = np.array([4, 6, 8, 12, 16, 24, 32]), np.pi / 6.0
    found = np.array([derivatives(kind, k, n) for n in panels])
    values = found[:, ::2] + 1j * k * found[:, 1::2]
    limit = values[-1] + (values[-1] - values[-2]) / ((32 / 24) ** 2 - 1.0)
    slopes = np.polyfit(np.log(1.0 / panels[:5]), np.log(np.abs(values[:5] - limit)), 1)[0]
    assert slopes == pytest.approx(2.0, abs=0.2)


def after_start(history, theory_curve, shift, s=(0.5, 1.0, 2.0, 4.0, 6.0, 10.0, 20.0)):
    """Lift over its final value at distances s, over theory, less one; ``shift`` is when the event is."""
    lift = history.coefficients[:, 0] / (2.0 * np.pi * 1e-3)
    return np.interp(s, 2.0 * (history.time - shift), lift) / theory_curve(np.array(s)) - 1.0


@pytest.mark.theory
def test_wagner():
    """What happens between two steps happens, for the scheme, midway: a start at t = 0 counts from half a step before."""
    n = 16
    history = simulate(section(n), motion.step(1e-3, 1.0), 1.0, 1.0 / n, round(10.5 * n), NEVER)
    assert np.abs(after_start(history, theory.wagner, -0.5 / n)).max() < 0.005
    assert np.abs(after_start(history, theory.wagner, 0.0)).max() < 0.01
    s, phi = (np.array(REFERENCE["wagner"][name]) for name in ("s", "phi"))
    early = (s > 0.0) & (s < 20.5)
    assert np.abs(after_start(history, lambda _: phi[early], -0.5 / n, s[early])).max() < 0.005


@pytest.mark.theory
def test_kussner():
    """The front passes each collocation point midway between two steps; it is at the leading edge a quarter of a panel earlier."""
    n = 16
    wind = gust.sharp_edged_gust((1.0, 0.0, 0.0), (0.0, 0.0, 1e-3), -0.25 + 0.25 / n)
    history = simulate(section(n), motion.steady(), 1.0, 1.0 / n, round(10.5 * n), NEVER, wind)
    assert np.abs(after_start(history, theory.kussner, -0.25 / n)).max() < 0.015


@pytest.mark.theory
def test_the_force_that_starts_the_motion_is_in_no_step():
    """The added mass of the plate would give a first step pi / (2 V dt / c) times the incidence; circulation gives half of 2 pi."""
    history = simulate(section(16), motion.step(1e-3, 1.0), 1.0, 1.0 / 16, 2, NEVER)
    assert history.coefficients[0, 0] < 0.65 * 2.0 * np.pi * 1e-3
