"""The shipped vehicle flies: trim and closed-loop stability from hover to 10 m/s, and over the factor box."""

from __future__ import annotations

import numpy as np
import pytest

from levelone.campaign import build_model
from levelone.config.study_file import Study
from levelone.dynamics import linearize, trim
from levelone.status import Status
from levelone.uncertainty import latin_hypercube


def largest_pole(model_poles: np.ndarray) -> float:
    """Size of the largest pole but those at 1, which integrate position and heading."""
    return float(np.abs(model_poles[np.abs(model_poles - 1.0) > 1e-7]).max())


@pytest.mark.parametrize("speed", [0.0, 2.0, 5.0, 8.0, 10.0])
def test_stable_from_hover_to_ten_metres_a_second(study: Study, speed: float) -> None:
    assert largest_pole(linearize(study.vehicle, speed).poles().z) < 1.0


def test_at_least_95_percent_of_the_factor_box_is_stable(study: Study) -> None:
    sample = latin_hypercube(study.space, 100, seed=3)
    batch = build_model(study).batch(sample.points)
    model = linearize(batch, study.trim_speed)
    stable = [model.status[run] == Status.OK and largest_pole(model.poles(run).z) < 1.0 for run in range(len(batch))]
    assert np.mean(stable) >= 0.95


@pytest.mark.parametrize("speed", [0.0, 5.0, 10.0, 15.0])
@pytest.mark.parametrize("climb", [0.0, 1.0, 2.0, 3.0])
def test_trim_residuals(study: Study, speed: float, climb: float) -> None:
    found = trim(study.vehicle, speed, climb)
    assert found.status[0] == Status.OK
    assert np.abs(found.residual).max() < 1e-9


def test_descent_that_the_wing_forbids_is_a_status(study: Study) -> None:
    """At 10 m/s down at 1 m/s the wing alone lifts more than the weight at any attitude that balances drag."""
    found = trim(study.vehicle, 10.0, -1.0)
    assert found.status[0] == Status.TRIM_FAILED
    assert np.abs(found.residual).max() > 1e-3
    assert np.isnan(found.throttle).all()
