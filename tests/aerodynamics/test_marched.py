"""Two ways to the same derivatives: a march in time and one linear solve in frequency."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import geometry, tail, wing

from levelone.aerodynamics.coefficients import NAMES
from levelone.aerodynamics.derivatives import dynamic
from levelone.aerodynamics.frequency import oscillate, prepare
from levelone.aerodynamics.geometry import Surface
from levelone.aerodynamics.lattice import build
from levelone.aerodynamics.marched import _one, marched
from levelone.aerodynamics.outcome import Outcome
from levelone.errors import InputError

K = np.array([0.3])


@pytest.mark.parametrize("shape", [geometry(wing(4, 4)), geometry(wing(4, 4), tail(2, 2))], ids=["wing", "wing and tail"])
def test_time_and_frequency_agree_after_extrapolation(shape):
    """Within 0.2 % of 2 pi in lift and 0.7 % of pitch in moment (2 % are asked for); 6 m/s, which must not matter."""
    in_time = marched(shape, K, ("pitch", "heave"), speed=6.0)
    in_frequency = dynamic(shape, K, ("pitch", "heave"))
    assert not in_time.failures
    scale = np.abs(in_frequency.at("pitch", "C_m")[0])
    for motion in ("pitch", "heave"):
        lift, moment = (in_time.at(motion, name)[0] - in_frequency.at(motion, name)[0] for name in ("C_L", "C_m"))
        assert np.all(np.abs(lift) < 0.002 * 2.0 * np.pi)
        assert np.all(np.abs(moment) < 0.007 * scale)
    c = in_time.coefficients.index("C_L")
    np.testing.assert_allclose(in_time.in_phase[:, :, c], in_frequency.in_phase[:, :, c], atol=0.005)


def test_speed_does_not_matter_at_equal_reduced_frequency():
    shape = geometry(wing(4, 2))
    slow, fast = (marched(shape, K, ("pitch",), speed=speed) for speed in (6.0, 8.0))
    np.testing.assert_allclose(fast.quadrature, slow.quadrature, atol=1e-9 * np.max(np.abs(slow.quadrature)))


@pytest.mark.parametrize("motion", ["sideslip", "roll", "yaw_rate"])
def test_lateral_motions_of_a_loaded_wing_with_a_fin_agree_too(motion):
    """Side force, roll and yaw along the body's axes, on one grid; a body that rolls must not show its lift as side force.

    The wake of a lifting wing in sideslip leaves along the stream here and along the body there.
    """
    fin = Surface("fin", (1.08, 0.3605, -0.1), 0.2, 0.13, 0.13, dihedral=np.pi / 2, chordwise=2, strips=4)
    lattice = build(geometry(wing(4, 5, incidence=0.08, dihedral=0.05), fin))
    parts, _ = _one(lattice, motion, 0.3, 1.0, 20.0, 2)
    found = oscillate(prepare(lattice), K, (motion,), np.zeros(3))[0, 0]
    lateral = [NAMES.index(name) for name in ("C_Y", "C_l", "C_n")]
    expected = np.array([found.real, found.imag / K[0]])[:, lateral]
    np.testing.assert_allclose(parts[:, lateral], expected, rtol=0.03, atol=0.012)


def test_a_run_that_fails_is_undefined_and_says_why(monkeypatch):
    """Here each run takes steps longer than a chord."""
    import levelone.aerodynamics.marched as module

    run = module.simulate

    def failing(lattice, motion, speed, dt, *others, **named):
        return run(lattice, motion, speed, 50.0 * dt, *others, **named)

    monkeypatch.setattr(module, "simulate", failing)
    found = marched(geometry(wing(2, 2)), K, ("pitch",))
    assert np.all(np.isnan(found.quadrature))
    assert len(found.failures) == 4
    assert Outcome.STEP_TOO_LONG.text in found.failures[0]


def test_the_same_frequencies_are_refused():
    with pytest.raises(InputError, match="no reduced frequency"):
        marched(geometry(wing(2, 2)), np.array([0.0]))
