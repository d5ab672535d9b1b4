"""The six responses of the published study from records no longer than they need, for samples of 10^5 runs.

What a criterion reads is settled once its extrema have passed: the second stationary point of the rate comes 0.8 s after a
step whose record lasts 10 s. Each manoeuvre is flown until a little after the nominal vehicle's last extremum, and the linear
response is computed up to a little beyond twice its omega_180. A run whose reading is not complete by then, or whose oscillation
does not decay, is done again at full length: values are those of whole records. What a short record cannot show is a run that
decays at first and fails late; :func:`check_against_whole` looks for such runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from levelone.campaign.models.builtin import BuiltinModel, responses_of
from levelone.dynamics.simulate import chunks, threads_of
from levelone.handling.damping import dynamic_stability
from levelone.handling.manoeuvres import Manoeuvre
from levelone.handling.quickness import attitude_quickness
from levelone.status import Status
from levelone.uncertainty import Responses
from levelone.vehicle import batch_of
from levelone.vehicle.tables import FloatArray

READ = ("quickness", "delta_theta_min", "zeta", "omega_n", "omega_bw", "tau_p")
CHUNK = 64
#: a record ends later than the nominal vehicle's last extremum by this part of the time since the input, and by this many seconds
LATER, MARGIN = 0.2, 0.1
#: frequencies end beyond twice the nominal omega_180 by this factor; so many of the last are there for interpolation only
BEYOND, SPARE = 1.3, 4

Column = tuple[FloatArray, NDArray[np.int64]]
Reading = tuple[dict[str, Column], NDArray[np.bool_]]
"""Values and statuses of some responses, and which runs need no longer record."""


@dataclass(frozen=True)
class BriefModel:
    """A model that gives :data:`READ` only.

    Parameters
    ----------
    whole
        The model with whole records, on one thread: chunks of runs are worked off side by side.
    step, pulse
        Its manoeuvres with shorter records.
    omega
        [nf] rad/s, the low end of its frequencies.
    """

    whole: BuiltinModel
    step: Manoeuvre
    pulse: Manoeuvre
    omega: FloatArray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the responses."""
        return READ

    def evaluate(
        self, points: FloatArray, threads: int | None = None, progress: Callable[[int], None] = lambda runs: None
    ) -> Responses:
        """Responses at ``points`` [n, targets]; memory does not grow with n beyond the result.

        ``progress`` is called with the runs of each chunk that is done; threads change no digit.
        """
        parts = list(chunks(len(points), CHUNK))

        def work(part: slice) -> Responses:
            done = self._chunk(points[part])
            progress(len(done))
            return done

        with ThreadPoolExecutor(threads_of(threads)) as pool:
            found = list(pool.map(work, parts))
        values, status = np.vstack([r.values for r in found]), np.vstack([r.status for r in found])
        return Responses(values, status, READ, found[0].units)

    def _chunk(self, points: FloatArray) -> Responses:
        whole = self.whole
        columns = _completed(points, lambda x: _quickness(whole, x, self.step), lambda x: _quickness(whole, x, whole.step))
        columns |= _completed(points, lambda x: _damping(whole, x, self.pulse), lambda x: _damping(whole, x, whole.pulse))
        columns |= _completed(points, lambda x: _bandwidth(whole, x, self.omega), lambda x: _bandwidth(whole, x, whole.omega))
        return responses_of(columns)


def brief_model(model: BuiltinModel) -> BriefModel:
    """The model with records as long as the nominal vehicle's readings need, and a margin."""
    quick, damped = model.reference
    (linear,), _ = model.linear_readings(batch_of(model.vehicle), ("q",))
    end = 2.0 * BEYOND * float(linear.omega_180[0])
    last = int(np.searchsorted(model.omega, end)) + SPARE if math.isfinite(end) else len(model.omega)
    return BriefModel(
        whole=replace(model, threads=1),
        step=_shortened(model.step, float(quick.picks.time[0].max()), model.step.on),
        pulse=_shortened(model.pulse, float(damped.picks.time[0].max()), model.pulse.off),
        omega=model.omega[:last],
    )


def check_against_whole(brief: BriefModel, points: FloatArray) -> dict[str, float]:
    """Largest difference of a value from that of the whole record, over its spread, and how many runs fail in one only."""
    short = brief.evaluate(points)
    other = replace(brief, step=brief.whole.step, pulse=brief.whole.pulse, omega=brief.whole.omega).evaluate(points)
    both = np.isfinite(short.values) & np.isfinite(other.values)
    gap = np.zeros(both.shape)
    for j, known in enumerate(both.T):
        if known.any():
            apart, spread = np.abs(short.values[known, j] - other.values[known, j]), other.values[known, j].std()
            gap[known, j] = np.divide(apart, spread, out=np.where(apart > 0.0, np.inf, 0.0), where=spread > 0.0)
    differ = (np.isfinite(short.values) != np.isfinite(other.values)).any(axis=1)
    return {"runs": len(points), "largest_difference": float(gap.max(initial=0.0)), "statuses_differ": int(differ.sum())}


def _shortened(manoeuvre: Manoeuvre, last: float, since: float) -> Manoeuvre:
    """The manoeuvre with a record that ends after the extremum at ``last``; whole where that is not known (NaN)."""
    end = last + LATER * (last - since) + MARGIN
    return replace(manoeuvre, duration=end) if end < manoeuvre.duration else manoeuvre


def _completed(
    points: FloatArray, short: Callable[[FloatArray], Reading], whole: Callable[[FloatArray], Reading]
) -> dict[str, Column]:
    """Readings of the short records, and of whole ones where these are not complete."""
    columns, complete = short(points)
    if complete.all():
        return columns
    rest, _ = whole(points[~complete])
    for name, (value, status) in columns.items():
        value[~complete], status[~complete] = rest[name]
    return columns


def _quickness(model: BuiltinModel, points: FloatArray, flown: Manoeuvre) -> Reading:
    found = attitude_quickness(model.fly(model.batch(points), flown), "pitch", boundaries=model.boundaries)
    complete = (found.status == Status.OK) & (found.status_min == Status.OK)
    return {"quickness": (found.quickness, found.status), "delta_theta_min": (found.delta_theta_min, found.status_min)}, complete


def _damping(model: BuiltinModel, points: FloatArray, flown: Manoeuvre) -> Reading:
    found = dynamic_stability(model.fly(model.batch(points), flown), "pitch", boundaries=model.boundaries)
    complete = (found.status == Status.OK) & (found.status_omega == Status.OK) & (found.zeta > 0.0)
    return {"zeta": (found.zeta, found.status), "omega_n": (found.omega_n, found.status_omega)}, complete


def _bandwidth(model: BuiltinModel, points: FloatArray, omega: FloatArray) -> Reading:
    (found,), run = replace(model, omega=omega).linear_readings(model.batch(points), ("q",))
    status, status_tau = (np.where(run, run, codes) for codes in (found.status_phase, found.status_tau_p))
    with np.errstate(invalid="ignore"):
        complete = (status == Status.OK) & (status_tau == Status.OK) & (2.0 * found.omega_180 < omega[-SPARE])
    return {"omega_bw": (found.omega_bw, status), "tau_p": (found.tau_p, status_tau)}, complete
