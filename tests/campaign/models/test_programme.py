"""Flights become responses: what is read, what it is called, and what becomes of flights that come to nothing."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.optimize import brentq
from simple_models import FREE, OMEGA_N, PULSE, QUICK, RISE, SPEED_LAG, STEP, SWEPT, ZETA, SecondOrder, attitude

from levelone.campaign.models.mapping import channel_history
from levelone.campaign.models.programme import HistoryModel
from levelone.campaign.models.protocol import ModelFailure
from levelone.config.model_table import Test
from levelone.errors import InputError
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.levels import Level, load_boundaries
from levelone.status import Status

NOMINAL = (OMEGA_N, ZETA)
LINEAR = Test(
    "linear",
    "bandwidth",
    "pitch",
    STEP,
    output="theta",
    method="linear",
    omega=tuple(np.geomspace(0.5, 100.0, 200)),
    response_type="attitude_command",
)


def model(*tests: Test, source=None, **options) -> HistoryModel:
    return HistoryModel(source or SecondOrder(), tests, ("omega_n", "zeta"), NOMINAL, load_boundaries(), **options)


def value(found: HistoryModel, answer, name: str) -> float:
    return answer.values[0, found.names.index(name)]


@pytest.mark.theory
@pytest.mark.parametrize(("omega_n", "zeta"), [(5.0, 0.3), (3.0, 0.15), (8.0, 0.5)])
def test_second_order_metrics(omega_n, zeta):
    """Step: theta_pk = d (1 + exp(-pi zeta / s)), q_pk = d omega_n exp(-(zeta / s) acos zeta), s = sqrt(1 - zeta^2) (Franklin,
    Powell, Emami-Naeini, Feedback Control of Dynamic Systems, 3.4: the peak of the step and of the impulse response)."""
    found = replace(model(QUICK, FREE, RISE), nominal=(omega_n, zeta))
    answer = found.evaluate(np.array([[omega_n, zeta]]))
    s = np.sqrt(1.0 - zeta**2)
    theta_pk = STEP.amplitude * (1.0 + np.exp(-np.pi * zeta / s))
    q_pk = STEP.amplitude * omega_n * np.exp(-zeta / s * np.arccos(zeta))
    assert value(found, answer, "delta_theta_pk") == pytest.approx(theta_pk, rel=1e-5)
    assert value(found, answer, "quickness") == pytest.approx(q_pk / theta_pk, rel=1e-5)
    assert value(found, answer, "zeta") == pytest.approx(zeta, rel=1e-4)
    assert value(found, answer, "omega_n") == pytest.approx(omega_n, rel=1e-4)
    assert value(found, answer, "rise_time") == pytest.approx(SPEED_LAG, rel=1e-5)
    assert value(found, answer, "overshoot") == 0.0
    assert (answer.status == Status.OK).all()
    assert answer.messages == ("",)


@pytest.mark.theory
def test_bandwidth_of_an_exact_response():
    """A second order with a delay: the phase, in closed form, crosses -135 and -180 deg where a root finder says."""
    found = model(LINEAR)
    answer = found.evaluate(np.array([NOMINAL]))

    def phase(omega: float) -> float:
        return -np.arctan2(2.0 * ZETA * omega / OMEGA_N, 1.0 - (omega / OMEGA_N) ** 2) - 0.05 * omega

    bw, omega_180 = (brentq(lambda w, at=at: phase(w) + np.deg2rad(at), 1.0, 60.0) for at in (135.0, 180.0))
    tau_p = (-np.rad2deg(phase(2.0 * omega_180)) - 180.0) / (57.3 * 2.0 * omega_180)
    assert value(found, answer, "omega_bw_phase") == pytest.approx(bw, rel=1e-5)
    assert value(found, answer, "omega_180") == pytest.approx(omega_180, rel=1e-5)
    assert value(found, answer, "tau_p") == pytest.approx(tau_p, rel=1e-4)
    assert "coherence" not in found.names


def test_sweep_gives_the_least_coherence_up_to_twice_omega_180():
    delayed = replace(SWEPT, manoeuvre=replace(SWEPT.manoeuvre, omega_max=60.0))
    found = model(delayed, source=Delayed())
    answer = found.evaluate(np.array([NOMINAL]))
    least = value(found, answer, "coherence")
    assert 0.9 < least < 1.0
    short = replace(SWEPT, manoeuvre=replace(SWEPT.manoeuvre, omega_max=12.0))
    cut = model(short, source=Delayed())
    assert cut.evaluate(np.array([NOMINAL])).status[0, cut.names.index("coherence")] == Status.RANGE_TOO_SHORT


@dataclass(frozen=True)
class Delayed(SecondOrder):
    """0.06 s late, in whole samples."""

    def fly(self, point, manoeuvre):
        time = manoeuvre.ticks()
        late = round(0.06 / (time[1] - time[0]))
        theta, q = attitude(*point, time, np.roll(manoeuvre.command(time), late))
        return channel_history(time, {"theta": theta, "q": q}, manoeuvre)


def test_names_are_plain_where_one_test_gives_the_quantity():
    roll = Test("roll", "attitude_quickness", "roll", STEP)
    found = model(QUICK, roll, FREE)
    pitch, other = ("quickness_quick", "delta_theta_min", "delta_theta_pk"), ("quickness_roll", "delta_phi_min", "delta_phi_pk")
    assert found.names == (*pitch, *other, "zeta", "omega_n")
    assert found.units == ("1/s", "rad", "rad", "1/s", "rad", "rad", "1", "rad/s")


@pytest.mark.parametrize(
    ("boundaries", "roll", "attitude_in_pitch"),
    [("ads33-levels", False, True), ("ads33-roll", True, False), ("ads33-yaw", False, False)],
)
def test_boundaries_of_one_axis_judge_that_axis(boundaries, roll, attitude_in_pitch):
    tests = (replace(FREE, axis="roll"), replace(SWEPT, axis="roll", output="phi", name="roll"), FREE, SWEPT)
    found = replace(model(*tests), boundaries=load_boundaries(boundaries))
    assert found.judged == ((("free", "roll") if roll else ()) + (("free", "swept") if attitude_in_pitch else ()))


@pytest.mark.parametrize(
    ("test", "judged"),
    [
        (QUICK, True),
        (replace(QUICK, axis="yaw"), True),
        (FREE, True),
        (replace(FREE, axis="roll"), False),
        (SWEPT, True),
        (replace(SWEPT, output="q"), False),
        (replace(SWEPT, axis="roll", output="phi"), False),
        (RISE, True),
    ],
)
def test_levels_only_where_a_boundary_speaks_of_the_axis(test, judged):
    assert model(test).judged == ((test.name,) if judged else ())


def test_quickness_of_an_axis_without_a_chart_has_a_value_and_no_level():
    boundaries = load_boundaries()
    pitch_only = replace(boundaries, attitude_quickness={"roll": boundaries.attitude_quickness["roll"]})
    found = replace(model(QUICK), boundaries=pitch_only)
    answer = found.evaluate(np.array([NOMINAL]))
    np.testing.assert_array_equal(answer.values, model(QUICK).evaluate(np.array([NOMINAL])).values)
    assert answer.levels.shape == (1, 0)


def test_level_is_that_of_the_criterion():
    answer = model(FREE).evaluate(np.array([[5.0, 0.5], [5.0, 0.2]]))
    assert answer.levels[:, 0].tolist() == [Level.LEVEL_1, Level.LEVEL_2]


def test_equal_manoeuvres_are_flown_once():
    again = Test("again", "attitude_quickness", "pitch", replace(STEP, name="another name"))
    source = SecondOrder()
    found = model(QUICK, again, source=source)
    _ = found.reference
    source.flown.clear()
    answer = found.evaluate(np.array([NOMINAL]))
    assert source.flown == ["delta_lon"]
    assert value(found, answer, "quickness_quick") == value(found, answer, "quickness_again")


def test_points_do_not_know_of_each_other():
    found, points = model(QUICK, FREE), np.array([[5.0, 0.3], [4.0, 0.6], [7.0, 0.1], [5.0, 0.9]])
    together = found.evaluate(points)
    alone = [model(QUICK, FREE).evaluate(point[None]) for point in points]
    np.testing.assert_array_equal(together.values, np.vstack([each.values for each in alone]))
    np.testing.assert_array_equal(together.status, np.vstack([each.status for each in alone]))
    np.testing.assert_array_equal(together.levels, np.vstack([each.levels for each in alone]))


@dataclass(frozen=True)
class Failing(SecondOrder):
    """Fails in the pulse at omega_n above 6 rad/s, as it is told to."""

    error: Exception | None = None

    def fly(self, point, manoeuvre):
        if self.error is not None and manoeuvre.shape == "pulse" and point[0] > 6.0:
            raise self.error
        return super().fly(point, manoeuvre)


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (ModelFailure(Status.TIMED_OUT, "no answer"), Status.TIMED_OUT, "free: no answer"),
        (ZeroDivisionError("division by zero"), Status.MODEL_FAILED, "free: ZeroDivisionError: division by zero"),
    ],
)
def test_a_failed_flight_costs_the_responses_of_its_tests_only(error, status, words):
    found = model(QUICK, FREE, source=Failing(error=error))
    answer = found.evaluate(np.array([[5.0, 0.3], [7.0, 0.3]]))
    assert answer.status[0].tolist() == [0] * 5
    assert answer.status[1].tolist() == [0, 0, 0, status, status]
    assert np.isnan(answer.values[1]).tolist() == [False] * 3 + [True] * 2
    assert answer.levels[1].tolist() == [answer.levels[1, 0], Level.UNDEFINED]
    assert answer.messages == ("", words)


def test_a_mistake_of_the_user_is_an_error():
    found = model(FREE, source=Failing(error=InputError("model.fixed", "unknown name 'a'")))
    with pytest.raises(InputError, match=r"model\.fixed"):
        found.evaluate(np.array([[7.0, 0.3]]))


@dataclass(frozen=True)
class Altered(SecondOrder):
    """Channels are changed on their way."""

    how: str = ""

    def fly(self, point, manoeuvre):
        time = manoeuvre.ticks()
        theta, q = attitude(*point, time, manoeuvre.command(time))
        channels = {"theta": theta, "q": q}
        if self.how == "nan":
            q[700:] = np.nan
        elif self.how == "missing":
            del channels["theta"]
        elif self.how == "lengths":
            channels["q"] = q[:-1]
        elif self.how == "ends early":
            time, channels = time[:600], {name: values[:600] for name, values in channels.items()}
        elif self.how == "uneven":
            time = time + 0.002 * np.sin(3.0 * time)
        return channel_history(time, channels, manoeuvre)


@pytest.mark.parametrize(
    ("how", "status", "words"),
    [
        ("nan", Status.OUTPUT_NOT_FINITE, "channel q is nan from t = 2.8 s on"),
        ("missing", Status.OUTPUT_MISSING, "no channel theta; it has q, delta_lon"),
        ("lengths", Status.MODEL_FAILED, "channel q has 1500 samples, time has 1501"),
        ("ends early", Status.RECORD_TOO_SHORT, "ends at 2.396 s, and the manoeuvre lasts until 6 s"),
        ("uneven", Status.MODEL_FAILED, "off the uniform grid"),
    ],
)
def test_records_that_cannot_be_read(how, status, words):
    answer = model(FREE, source=Altered(how=how)).evaluate(np.array([NOMINAL]))
    assert answer.status.tolist() == [[status, status]]
    assert words in answer.messages[0]


@dataclass(frozen=True)
class Turning(SecondOrder):
    """Moves the other way at zeta above 0.5: the first peak has the other sign than that of the nominal point."""

    def fly(self, point, manoeuvre):
        return super().fly(point, manoeuvre if point[1] < 0.5 else replace(manoeuvre, amplitude=-manoeuvre.amplitude))


def test_another_choice_of_peaks_than_at_the_nominal_point_is_flagged():
    answer = model(FREE, source=Turning()).evaluate(np.array([[5.0, 0.3], [5.0, 0.6]]))
    assert answer.status[:, 0].tolist() == [Status.OK, Status.PEAK_CHOICE_CHANGED]
    assert answer.values[1, 0] == pytest.approx(0.6, rel=1e-3)


def test_nothing_is_flagged_where_the_nominal_point_fails():
    source = Failing(error=ModelFailure(Status.DIVERGED, "no"))
    found = replace(model(FREE, source=source), nominal=(7.0, 0.3))
    assert dict(found.reference) == {}
    assert found.evaluate(np.array([NOMINAL])).status.tolist() == [[0, 0]]


def test_reference_is_flown_once_and_does_not_travel():
    source = SecondOrder()
    found = model(QUICK, source=source)
    found.evaluate(np.array([NOMINAL, NOMINAL]))
    assert len(source.flown) == 3
    after = pickle.loads(pickle.dumps(found))  # noqa: S301
    assert "reference" not in vars(after)
    np.testing.assert_array_equal(after.evaluate(np.array([NOMINAL])).values, found.evaluate(np.array([NOMINAL])).values)
    assert len(after.source.flown) == 5


@dataclass(frozen=True)
class Cautioned(SecondOrder):
    def fly(self, point, manoeuvre):
        return replace(super().fly(point, manoeuvre), status=np.array([int(Status.INCIDENCE_OUTSIDE)]))


def test_a_caution_of_the_run_stays_with_its_values():
    answer = model(FREE, source=Cautioned()).evaluate(np.array([NOMINAL]))
    assert answer.status.tolist() == [[Status.INCIDENCE_OUTSIDE] * 2]
    assert np.isfinite(answer.values).all()


def test_histories_travel_where_asked_for():
    kept = model(QUICK, FREE, source=Failing(error=ModelFailure(Status.CRASHED, "gone")), keep_histories=True)
    answer = kept.evaluate(np.array([[5.0, 0.3], [7.0, 0.3]]))
    assert [sorted(each) for each in answer.histories] == [["free", "quick"], ["quick"]]
    record = answer.histories[0]["free"]
    np.testing.assert_array_equal(record.channels["delta_lon"][0], PULSE.command(record.time))
    assert model(QUICK).evaluate(np.array([NOMINAL])).histories == ()


def test_key_changes_with_what_decides_a_value():
    first = model(QUICK, FREE)
    others = [
        model(FREE, QUICK),
        replace(first, nominal=(5.0, 0.31)),
        model(replace(QUICK, manoeuvre=replace(STEP, amplitude=0.21)), FREE),
        replace(first, boundaries=replace(first.boundaries, limits={})),
    ]
    assert all(other.key != first.key for other in others)
    assert model(QUICK, FREE).key == first.key


@dataclass(frozen=True)
class Late:
    """The second order behind a delay that its record does not state."""

    delay: float

    @property
    def key(self) -> dict[str, float]:
        return {"delay": self.delay}

    def fly(self, point: np.ndarray, manoeuvre) -> object:
        time = manoeuvre.ticks()
        theta, q = attitude(*point, time, manoeuvre.command(time - self.delay))
        return channel_history(time, {"theta": theta, "q": q}, manoeuvre)


@pytest.mark.theory
def test_a_delay_that_is_stated_keeps_driven_peaks_from_being_taken_for_free_ones():
    """The response is still driven when the input is over: its peak comes 0.07 s after the end of the pulse."""
    late = replace(FREE, delay=0.3)
    known, unknown = (model(test, source=Late(0.3)) for test in (late, FREE))
    point = np.array([NOMINAL])
    assert value(known, known.evaluate(point), "zeta") == pytest.approx(ZETA, rel=1e-4)
    assert value(known, known.evaluate(point), "omega_n") == pytest.approx(OMEGA_N, rel=1e-4)
    assert abs(value(unknown, unknown.evaluate(point), "zeta") - ZETA) > 0.02


@dataclass(frozen=True)
class Rate(SecondOrder):
    """The same vehicle read on its pitch rate: j omega times the response of the attitude."""

    def frequency_response(self, point: np.ndarray, command: str, output: str, omega: np.ndarray) -> FrequencyResponse:
        attitude_response = super().frequency_response(point, command, "theta", omega)
        return FrequencyResponse(omega, 1j * omega * attitude_response.value)


@pytest.mark.theory
def test_an_integrated_rate_reads_as_the_attitude():
    """theta = q / (j omega): gain and phase, and so every reading and the Level, are those of the attitude."""
    point = np.array([NOMINAL])
    of_attitude = model(LINEAR)
    of_rate = model(replace(LINEAR, output="q", integrate=True), source=Rate())
    assert of_rate.judged == of_attitude.judged == ("linear",)
    expected, found = of_attitude.evaluate(point), of_rate.evaluate(point)
    assert found.values == pytest.approx(expected.values, rel=1e-12, nan_ok=True)
    assert found.status.tolist() == expected.status.tolist()
    assert found.levels.tolist() == expected.levels.tolist()
    assert np.isfinite(value(of_rate, found, "tau_p"))
