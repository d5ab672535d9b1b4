"""Whatever a record or a response holds, a criterion returns values with OK or a caution, or NaN with a reason."""

from __future__ import annotations

import numpy as np
from handling_signals import batch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from levelone.handling.bandwidth import bandwidth
from levelone.handling.damping import dynamic_stability
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.levels import Level
from levelone.handling.quickness import attitude_quickness
from levelone.status import Status

NUMBERS = st.one_of(st.floats(-10.0, 10.0), st.sampled_from([0.0, 1e-300, 1e300, np.nan, np.inf]))
TIME = np.arange(40) * 0.05


def agrees(value, status):
    failed = np.array([Status(code).failed for code in np.atleast_1d(status)])
    return (np.isnan(np.atleast_1d(value)) == failed).all()


@settings(max_examples=150, deadline=None)
@given(rate=arrays(float, (3, 40), elements=NUMBERS), attitude=arrays(float, (3, 40), elements=NUMBERS), quiet=st.booleans())
def test_time_histories(rate, attitude, quiet):
    if quiet:
        rate[:, :20] = attitude[:, :20] = 0.0
    history = batch(rate, attitude, time=TIME, off=1.2, delay=[0.0, 0.03, 5.0])
    with np.errstate(over="ignore", invalid="ignore"):
        quick, damping = attitude_quickness(history), dynamic_stability(history)
    assert agrees(quick.quickness, quick.status)
    assert agrees(quick.delta_theta_min, quick.status_min)
    assert agrees(damping.zeta, damping.status)
    assert agrees(damping.omega_n, damping.status_omega)
    unknown = np.isnan(quick.quickness) | np.isnan(quick.delta_theta_min)
    np.testing.assert_array_equal(quick.level == Level.UNDEFINED, unknown)


@settings(max_examples=150, deadline=None)
@given(
    gain=arrays(float, (2, 30), elements=st.one_of(st.floats(-60.0, 60.0), st.just(np.nan))),
    phase=arrays(float, (2, 30), elements=st.floats(-7.0, 4.0)),
    coherence=st.one_of(st.none(), arrays(float, (2, 30), elements=st.one_of(st.floats(0.0, 1.0), st.just(np.nan)))),
)
def test_frequency_responses(gain, phase, coherence):
    omega = np.geomspace(0.3, 40.0, 30)
    result = bandwidth(FrequencyResponse(omega, 10.0 ** (gain / 20.0) * np.exp(1j * phase), coherence))
    assert agrees(result.omega_bw, result.status)
    for value, status in (("omega_bw_phase", "phase"), ("omega_bw_gain", "gain"), ("omega_180", "180"), ("tau_p", "tau_p")):
        assert agrees(getattr(result, value), getattr(result, f"status_{status}"))
    np.testing.assert_array_equal(result.level == Level.UNDEFINED, np.isnan(result.omega_bw) | np.isnan(result.tau_p))
