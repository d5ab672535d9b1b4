"""The built-in vehicle under the manoeuvres of a study: points of the factor box in, handling qualities out, in whole batches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelone.dynamics import linearize, simulate
from levelone.dynamics.simulate import chunks
from levelone.errors import unknown_name
from levelone.handling.bandwidth import Bandwidth, bandwidth
from levelone.handling.damping import DynamicStability, dynamic_stability
from levelone.handling.history import TimeHistory
from levelone.handling.levels import Boundaries, load_boundaries, worst
from levelone.handling.manoeuvres import Manoeuvre, Start, pulse, step
from levelone.handling.picks import flag_changed_choice
from levelone.handling.quickness import Quickness, attitude_quickness
from levelone.handling.translation import translational_rate
from levelone.status import CAUTIONS, Status
from levelone.uncertainty import Responses
from levelone.vehicle import TARGETS, Validity, Vehicle, VehicleBatch, batch_of, vary
from levelone.vehicle.tables import FloatArray

IntArray = NDArray[np.int64]
#: response -> (unit, criterion)
RESPONSES = {
    "quickness": ("1/s", "attitude_quickness"),
    "delta_theta_min": ("rad", "attitude_quickness"),
    "delta_theta_pk": ("rad", "attitude_quickness"),
    "zeta": ("1", "dynamic_stability"),
    "omega_n": ("rad/s", "dynamic_stability"),
    "omega_bw": ("rad/s", "bandwidth"),
    "tau_p": ("s", "bandwidth"),
    "omega_bw_attitude": ("rad/s", "bandwidth"),
    "tau_p_attitude": ("s", "bandwidth"),
    "rise_time": ("s", "translational_rate"),
    "overshoot": ("1", "translational_rate"),
}
#: "worst" is that of the three criteria before it, which the study is about
CRITERIA = ("attitude_quickness", "dynamic_stability", "bandwidth", "worst", "translational_rate")
CHANNELS = ("q", "theta", "V_lon")
CHUNK = 64


@dataclass(frozen=True)
class Assessment:
    """Everything a study keeps of a set of runs.

    Parameters
    ----------
    responses
        Values and statuses.
    levels
        [n] for each of ``CRITERIA``, codes of :class:`levelone.handling.levels.Level`.
    extrapolated
        [n] Level of attitude quickness by the extended boundaries; None for a model that does not give it.
    extremes
        For each manoeuvre, [n] of each extreme that the simulation kept.
    """

    responses: Responses
    levels: Mapping[str, IntArray]
    extrapolated: IntArray | None
    extremes: Mapping[str, Mapping[str, FloatArray]]


@dataclass(frozen=True)
class BuiltinModel:
    """The built-in flight simulation model under the three manoeuvres.

    Parameters
    ----------
    vehicle
        The nominal vehicle.
    targets
        What each column of a point sets (see :data:`levelone.vehicle.TARGETS`).
    step, pulse
        The manoeuvres of attitude quickness and dynamic stability.
    omega
        [nf] frequencies of the linear response, rad/s.
    boundaries
        Level boundaries.
    task
        Which bandwidth chart sets the Level.
    start
        From which trim a varied vehicle begins, see :func:`levelone.dynamics.simulate`.
    threads
        Worker threads; no influence on the results.

    Raises
    ------
    InputError
        For a target that the vehicle does not have.
    """

    vehicle: Vehicle
    targets: tuple[str, ...]
    step: Manoeuvre = field(default_factory=lambda: step("V_lon", 1.0, trim_speed=5.0))
    pulse: Manoeuvre = field(default_factory=lambda: pulse("V_lon", 0.7, trim_speed=5.0))
    omega: FloatArray = field(default_factory=lambda: np.geomspace(0.1, 300.0, 400))
    boundaries: Boundaries = field(default_factory=load_boundaries)
    task: str = "all_other"
    start: Start = "own trim"
    threads: int | None = None

    def __post_init__(self) -> None:
        for target in self.targets:
            if target not in TARGETS:
                raise unknown_name("target", target, TARGETS)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the responses."""
        return tuple(RESPONSES)

    @cached_property
    def reference(self) -> tuple[Quickness, DynamicStability]:
        """The criteria on the nominal vehicle, whose choice of peaks is the one that others are compared with."""
        nominal = batch_of(self.vehicle)
        return self._quickness(self.fly(nominal, self.step)), self._stability(self.fly(nominal, self.pulse))

    def fly(self, batch: VehicleBatch, manoeuvre: Manoeuvre, channels: tuple[str, ...] = CHANNELS) -> TimeHistory:
        """Time history of a batch under one of the manoeuvres."""
        return simulate(batch, manoeuvre, channels=channels, start=self.start, threads=self.threads)

    def batch(self, points: ArrayLike) -> VehicleBatch:
        """One airframe for each point."""
        return vary(self.vehicle, self.targets, np.atleast_2d(np.asarray(points, dtype=float)), self.step.trim_speed)

    def evaluate(self, points: FloatArray) -> Responses:
        """Responses at ``points`` [n, targets]."""
        return self.assess(points).responses

    def assess(self, points: FloatArray, progress: Callable[[int], None] = lambda done: None, chunk: int = CHUNK) -> Assessment:
        """Responses, Levels and extremes at ``points`` [n, targets], worked off in chunks of bounded memory.

        ``progress`` is called with the number of runs done so far; neither ``chunk`` nor the threads change a result.
        """
        parts = []
        for part in chunks(len(points), chunk):
            parts.append(self.assess_batch(self.batch(points[part])))
            progress(part.stop)
        return _joined(parts)

    def nominal(self) -> Assessment:
        """The assessment of the nominal vehicle itself."""
        return self.assess_batch(batch_of(self.vehicle))

    def _quickness(self, history: TimeHistory) -> Quickness:
        return attitude_quickness(history, "pitch", boundaries=self.boundaries)

    def _stability(self, history: TimeHistory) -> DynamicStability:
        return dynamic_stability(history, "pitch", boundaries=self.boundaries)

    def assess_batch(self, batch: VehicleBatch) -> Assessment:
        stepped, pulsed = self.fly(batch, self.step), self.fly(batch, self.pulse)
        quick = flag_changed_choice(self._quickness(stepped), self.reference[0])
        damped = flag_changed_choice(self._stability(pulsed), self.reference[1])
        moved = translational_rate(stepped, "V_lon", boundaries=self.boundaries)
        (study, attitude), run = self.linear_readings(batch, ("q", "theta"))
        validity = self.vehicle.validity
        columns = {
            "quickness": (quick.quickness, doubted(quick.status, stepped, validity)),
            "delta_theta_min": (quick.delta_theta_min, doubted(quick.status_min, stepped, validity)),
            "delta_theta_pk": (quick.delta_theta_pk, doubted(quick.status, stepped, validity)),
            "zeta": (damped.zeta, doubted(damped.status, pulsed, validity)),
            "omega_n": (damped.omega_n, doubted(damped.status_omega, pulsed, validity)),
            "omega_bw": (study.omega_bw, np.where(run, run, study.status_phase)),
            "tau_p": (study.tau_p, np.where(run, run, study.status_tau_p)),
            "omega_bw_attitude": (attitude.omega_bw, np.where(run, run, attitude.status)),
            "tau_p_attitude": (attitude.tau_p, np.where(run, run, attitude.status_tau_p)),
            "rise_time": (moved.rise_time, doubted(moved.status, stepped, validity)),
            "overshoot": (moved.overshoot, doubted(moved.status, stepped, validity)),
        }
        levels = {"attitude_quickness": quick.level, "dynamic_stability": damped.level, "bandwidth": attitude.level}
        return Assessment(
            responses_of(columns),
            levels | {"worst": worst(*levels.values()), "translational_rate": moved.level},
            quick.level_extrapolated,
            {"attitude_quickness": stepped.extremes, "dynamic_stability": pulsed.extremes},
        )

    def linear_readings(self, batch: VehicleBatch, outputs: tuple[str, ...]) -> tuple[list[Bandwidth], IntArray]:
        """Bandwidth read on the linear response of each output, ``"q"`` (q / V_lon) or ``"theta"`` (-theta / V_lon), and
        [run] why a linearisation failed, 0 where it stands."""
        model = linearize(batch, self.step.trim_speed, flight_mode=self.step.flight_mode, dt=self.step.dt, threads=self.threads)
        readings = []
        for output in outputs:
            response = model.frequency_response("V_lon", output, self.omega, threads=self.threads)
            response = response if output == "q" else -response
            readings.append(bandwidth(response, "attitude_command", task=self.task, boundaries=self.boundaries))
        return readings, np.where(model.status == Status.OK, 0, model.status)

    def at_half_step(self) -> BuiltinModel:
        """The same model integrated with half the step."""
        return replace(self, step=replace(self.step, dt=self.step.dt / 2), pulse=replace(self.pulse, dt=self.pulse.dt / 2))


def outside_validity(history: TimeHistory, validity: Validity) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """[run] whether incidence or sideslip left the stated validity, and whether the linear drag went negative."""
    x = history.extremes
    with np.errstate(invalid="ignore"):
        alpha = (x["alpha_min"] < validity.alpha[0]) | (x["alpha_max"] > validity.alpha[1])
        beta = (x["beta_min"] < validity.beta[0]) | (x["beta_max"] > validity.beta[1])
        return alpha | beta, x["C_D_min"] < 0.0


def doubted(status: IntArray, history: TimeHistory, validity: Validity) -> IntArray:
    """Statuses with a caution where a value stands but its run left the validity of the aerodynamics."""
    incidence, drag = outside_validity(history, validity)
    flagged = np.where(drag, Status.NEGATIVE_DRAG, status)
    flagged = np.where(incidence, Status.INCIDENCE_OUTSIDE, flagged)
    return np.where(status == Status.OK, flagged, status)


def responses_of(columns: Mapping[str, tuple[FloatArray, IntArray]]) -> Responses:
    """Values with their statuses, [n] each, under the units of ``RESPONSES``; what failed becomes NaN."""
    status = np.column_stack([np.asarray(codes, dtype=np.int64) for _, codes in columns.values()])
    values = np.column_stack([value for value, _ in columns.values()])
    stands = np.isin(status, [int(Status.OK), *(int(code) for code in CAUTIONS)])
    return Responses(np.where(stands, values, np.nan), status, tuple(columns), tuple(RESPONSES[name][0] for name in columns))


def _joined(parts: list[Assessment]) -> Assessment:
    first = parts[0]
    return Assessment(
        Responses(
            np.vstack([p.responses.values for p in parts]),
            np.vstack([p.responses.status for p in parts]),
            first.responses.names,
            first.responses.units,
        ),
        {name: np.concatenate([p.levels[name] for p in parts]) for name in first.levels},
        np.concatenate([p.extrapolated for p in parts if p.extrapolated is not None]),
        {m: {name: np.concatenate([p.extremes[m][name] for p in parts]) for name in kept} for m, kept in first.extremes.items()},
    )
