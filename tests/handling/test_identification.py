from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from levelone.errors import InputError
from levelone.handling.bandwidth import bandwidth
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import TimeHistory
from levelone.handling.identification import identify
from levelone.handling.manoeuvres import sweep
from levelone.status import Status

OMEGA_N = 5.61


def swept(numerator, denominator, delay=0.02, *, noise=0.0, runs=1, **options):
    """A sweep through a linear system with a delay of whole samples, as a record with trim."""
    manoeuvre = sweep("V_lon", 0.5, trim_speed=5.0, **options)
    time = manoeuvre.ticks()
    command = manoeuvre.command(time)
    shift = round(delay * 250)
    late = np.concatenate([np.zeros(shift), command[: command.size - shift]])
    answer = signal.lsim((numerator, denominator), late, time)[1]
    rng = np.random.default_rng(3)
    output = answer + noise * np.std(answer) * rng.standard_normal((runs, time.size))
    return TimeHistory(
        time=time,
        channels={"V_lon_ref": np.tile(5.0 + command, (runs, 1)), "theta": 0.04 + output},
        units={"V_lon_ref": "m/s", "theta": "rad"},
        trim={"V_lon_ref": np.full(runs, 5.0), "theta": np.full(runs, 0.04)},
        input_name="V_lon_ref",
        input_on=manoeuvre.on,
        input_off=manoeuvre.off,
        delay=np.full(runs, delay),
        wind=(0.0, 0.0, 0.0),
        status=np.zeros(runs, dtype=np.int64),
    )


def second_order(zeta):
    return [OMEGA_N**2], [1.0, 2.0 * zeta * OMEGA_N, OMEGA_N**2]


def exact(numerator, denominator, omega, delay=0.02):
    s = 1j * omega
    return np.polyval(numerator, s) / np.polyval(denominator, s) * np.exp(-delay * s)


def errors(response, numerator, denominator, low=0.5, high=11.0, run=0):
    inside = (response.omega >= low) & (response.omega <= high)
    ratio = response.value[run, inside] / exact(numerator, denominator, response.omega[inside])
    return np.abs(20.0 * np.log10(np.abs(ratio))).max(), np.abs(np.degrees(np.angle(ratio))).max()


@pytest.mark.theory
@pytest.mark.parametrize("zeta", [0.2, 0.35, 0.7])
@pytest.mark.parametrize("windows", [None, 30.0])
def test_sweep_of_a_second_order_system_with_delay(zeta, windows):
    system = second_order(zeta)
    response = identify(swept(*system), "theta", windows=windows)
    decibel, degrees = errors(response, *system)
    assert decibel < 0.5
    assert degrees < 2.0
    inside = (response.omega >= 0.5) & (response.omega <= 11.0)
    assert response.coherence[0, inside].min() > 0.95
    assert response.omega[0] >= 0.3
    assert response.omega[-1] <= 12.0


@pytest.mark.theory
@pytest.mark.parametrize("zeros", [1, 2])
def test_sweep_of_a_response_that_falls_towards_low_frequency(zeros):
    """theta / V_lon and q / V_lon of a speed loop: one and two zeros at the origin."""
    denominator = np.polymul([1.0, 0.7 * OMEGA_N, OMEGA_N**2], [1.0, 1.0])
    numerator = [-(OMEGA_N**2), *([0.0] * zeros)]
    response = identify(swept(numerator, denominator), "theta")
    decibel, degrees = errors(response, numerator, denominator)
    assert decibel < 0.5
    assert degrees < 2.0
    assert response.coherence[0, response.omega >= 0.5].min() > 0.9


def test_bandwidth_from_the_sweep_is_that_of_the_system():
    numerator, denominator = [16.0], [1.0, 5.6, 16.0]
    history = swept(numerator, denominator, 0.052, omega_max=27.0, length=150.0)
    response = identify(history, "theta", omega_max=26.5)
    omega = np.geomspace(0.3, 40.0, 300)
    wanted = bandwidth(FrequencyResponse(omega, exact(numerator, denominator, omega, 0.052)))
    read = bandwidth(response)
    for name in ("omega_bw", "omega_bw_gain", "omega_180", "tau_p"):
        assert getattr(read, name)[0] == pytest.approx(getattr(wanted, name), rel=0.01)


def test_sign_is_declared():
    history = swept(*second_order(0.35))
    np.testing.assert_array_equal(identify(history, "theta", sign=-1).value, -identify(history, "theta").value)


def test_offsets_of_trim_do_not_enter():
    history = swept(*second_order(0.35))
    channels = {name: values + 3.0 for name, values in history.channels.items()}
    trim = {name: values + 3.0 for name, values in history.trim.items()}
    shifted = TimeHistory(
        history.time,
        channels,
        history.units,
        trim,
        history.input_name,
        history.input_on,
        history.input_off,
        history.delay,
        history.wind,
        history.status,
    )
    np.testing.assert_allclose(identify(shifted, "theta").value, identify(history, "theta").value, rtol=1e-9)


def test_coherence_tells_noise_and_several_windows_lower_the_error():
    system = second_order(0.35)
    noisy = swept(*system, noise=0.6, runs=8)
    composite, shortest = identify(noisy, "theta"), identify(noisy, "theta", windows=60.0)
    clean = identify(swept(*system), "theta")
    assert composite.coherence.mean() < clean.coherence.mean() - 0.005
    inside = (composite.omega > 0.5) & (composite.omega < 11.0)
    reference = exact(*system, composite.omega)

    def spread(response):
        return np.abs(response.value / reference - 1.0)[:, inside].std()

    assert spread(composite) <= 1.05 * spread(shortest)


@pytest.mark.oracle
def test_one_window_against_scipy_on_the_same_padded_record():
    history = swept(*second_order(0.35), noise=0.3)
    response = identify(history, "theta", windows=20.0, overlap=0.75)
    count = 5000
    x, y = (np.pad(history.change(name)[0], count) for name in ("V_lon_ref", "theta"))
    options = {"fs": 250.0, "window": "hann", "nperseg": count, "noverlap": 3750, "nfft": 16384}
    frequency, coherence = signal.coherence(x, y, detrend=False, **options)
    auto = signal.welch(x, detrend=False, **options)[1]
    cross = signal.csd(x, y, detrend=False, **options)[1]
    index = np.searchsorted(2.0 * np.pi * frequency, response.omega - 1e-9)
    np.testing.assert_allclose(response.value[0], (cross / auto)[index], rtol=1e-9)
    np.testing.assert_allclose(response.coherence[0], coherence[index], rtol=1e-9)


def test_batch_equals_loop_and_failed_runs_are_undefined():
    history = swept(*second_order(0.35), noise=0.1, runs=4)
    history.status[1] = Status.DIVERGED
    history.channels["theta"][2, 5000] = np.nan
    together = identify(history, "theta", windows=30.0)
    assert np.isnan(together.value[1:3]).all()
    assert np.isnan(together.coherence[1:3]).all()
    for run in (0, 3):
        alone = identify(history.select(run), "theta", windows=30.0)
        np.testing.assert_array_equal(alone.value[0], together.value[run])
    read = bandwidth(together)
    assert read.status[1:3].tolist() == [Status.MODEL_FAILED, Status.MODEL_FAILED]


def test_frequencies_that_were_not_swept_show_a_low_coherence():
    response = identify(swept(*second_order(0.35), noise=0.1, omega_max=6.0), "theta")
    assert response.coherence[0, (response.omega > 1.0) & (response.omega < 5.5)].min() > 0.9
    assert np.median(response.coherence[0, response.omega > 9.0]) < 0.6
    read = bandwidth(response)
    assert read.status_tau_p[0] in (Status.LOW_COHERENCE, Status.RANGE_TOO_SHORT)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"output": "tetha"}, "did you mean 'theta'"),
        ({"input_name": "V_lon"}, "did you mean 'V_lon_ref'"),
        ({"windows": 200.0}, "does not fit"),
        ({"windows": (30.0, -1.0)}, "does not fit"),
        ({"overlap": 0.2}, "between 0.5 and 0.98"),
        ({"taper": "han"}, "did you mean 'hann'"),
        ({"sign": 0}, "1 or -1"),
        ({"omega_min": 0.0}, "both must be positive"),
        ({"omega_min": 5.0, "omega_max": 4.0}, "no frequency between"),
    ],
)
def test_bad_input_says_what_is_allowed(options, message):
    arguments = {"output": "theta", **options}
    with pytest.raises(InputError, match=message):
        identify(swept(*second_order(0.35), length=40.0), **arguments)
