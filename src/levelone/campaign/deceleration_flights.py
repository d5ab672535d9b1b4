"""Decelerations to hover in batches: the pilot in the loop, what is measured on each run, and the histories that are kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from levelone.campaign.models.builtin import CHUNK, BuiltinModel, IntArray, doubted
from levelone.campaign.store import history_dataset
from levelone.config.manoeuvres import held_trim
from levelone.config.study_sections import Deceleration
from levelone.dynamics import simulate
from levelone.dynamics.simulate import chunks
from levelone.handling.capture import CHANNELS, MEASURES, Performance, capture, severity
from levelone.handling.history import TimeHistory
from levelone.uncertainty import Responses
from levelone.vehicle import VehicleBatch
from levelone.vehicle.tables import FloatArray

PERFORMANCE_KEYS = {
    Performance.DESIRED: "desired",
    Performance.ADEQUATE: "adequate",
    Performance.NOT_ADEQUATE: "not_adequate",
    Performance.UNDEFINED: "failed",
}
#: runs whose histories are kept beside the nominal one, by their place in the order of severity
KEPT = {"5 %": 0.05, "median": 0.5, "95 %": 0.95, "worst": 1.0}
#: every so many ticks of a history are kept
THINNED = 5


@dataclass(frozen=True, eq=False)
class Flights:
    """What is kept of n decelerations from one speed.

    Parameters
    ----------
    measures
        Values and statuses of ``levelone.handling.capture.MEASURES``.
    performance, verdicts
        [n] and [n, measures], codes of :class:`levelone.handling.capture.Performance`.
    severity
        [n] of :func:`levelone.handling.capture.severity`.
    times
        [n, 2], s: first command to decelerate, and capture.
    extremes
        [n] for each extreme that the simulation kept.
    """

    measures: Responses
    performance: IntArray
    verdicts: IntArray
    severity: FloatArray
    times: FloatArray
    extremes: Mapping[str, FloatArray]


def assess(
    model: BuiltinModel, given: Deceleration, i: int, points: FloatArray, progress: Callable[[int], None] = lambda done: None
) -> Flights:
    """Measures of the i-th deceleration at points [n, targets], worked off in chunks of bounded memory."""
    parts = []
    for part in chunks(len(points), CHUNK):
        parts.append(measure(model, given, i, fly(model, given, i, model.batch(points[part]))))
        progress(part.stop)
    first = parts[0]
    measures = Responses(
        np.vstack([p.measures.values for p in parts]),
        np.vstack([p.measures.status for p in parts]),
        first.measures.names,
        first.measures.units,
    )
    joined = {name: np.concatenate([getattr(p, name) for p in parts]) for name in ("performance", "verdicts", "severity", "times")}
    return Flights(measures, extremes={k: np.concatenate([p.extremes[k] for p in parts]) for k in first.extremes}, **joined)


def fly(model: BuiltinModel, given: Deceleration, i: int, batch: VehicleBatch) -> TimeHistory:
    """Time history of a batch that decelerates from the i-th speed."""
    speed, distance = given.speeds[i], given.distances[i]
    held = replace(held_trim(model.vehicle.controller, speed), name=f"deceleration from {speed:g} m/s", duration=given.duration)
    flown = tuple(name for name in CHANNELS if name != "V_lon_ref")
    return simulate(batch, held, channels=flown, pilot=replace(given.pilot, distance=distance), threads=model.threads)


def measure(model: BuiltinModel, given: Deceleration, i: int, history: TimeHistory) -> Flights:
    found = capture(history, given.distances[i], given.hold, given.desired, given.adequate)
    names = tuple(MEASURES)
    status = np.column_stack([doubted(found.status_of(name), history, model.vehicle.validity) for name in names])
    values = np.column_stack([getattr(found, name) for name in names])
    return Flights(
        Responses(values, status, names, tuple(MEASURES.values())),
        found.performance,
        np.column_stack([found.performances[name] for name in names]),
        severity(found, given.adequate),
        np.column_stack([found.start, found.captured]),
        history.extremes,
    )


def measured_dataset(flown: Flights) -> xr.Dataset:
    """Measures, statuses and performance of every run of the sample, in its order."""
    return xr.Dataset(
        {
            "values": (("run", "measure"), flown.measures.values),
            "status": (("run", "measure"), flown.measures.status.astype(np.int16)),
            "performance": ("run", flown.performance.astype(np.int16)),
            "measure_performance": (("run", "measure"), flown.verdicts.astype(np.int16)),
            "severity": ("run", flown.severity),
        },
        coords={"measure": list(MEASURES), "measure_unit": ("measure", list(MEASURES.values()))},
        attrs={"performance_codes": "; ".join(f"{int(p)}: {key.replace('_', ' ')}" for p, key in PERFORMANCE_KEYS.items())},
    )


def history_group(
    model: BuiltinModel, given: Deceleration, i: int, nominal: FloatArray, points: FloatArray, flown: Flights
) -> xr.Dataset:
    """Histories of the nominal flight, and of those of a sample that stand at the places ``KEPT`` in the order of severity.

    Parameters
    ----------
    model, given, i
        As for :func:`assess`.
    nominal, points
        [targets] of the nominal vehicle, and [n, targets] of the sample.
    flown
        What was measured on the sample.
    """
    defined = np.flatnonzero(~np.isnan(flown.severity))
    order = defined[np.argsort(flown.severity[defined], kind="stable")]
    picked = {label: int(order[round(place * (order.size - 1))]) for label, place in KEPT.items()} if order.size else {}
    history = fly(model, given, i, model.batch(np.vstack([nominal[None], points[list(picked.values())]])))
    again = measure(model, given, i, history)
    data = history_dataset(history, CHANNELS, {"speed": given.speeds[i], "distance": given.distances[i]})
    data["sample"] = ("run", np.array([-1, *picked.values()]))
    data["performance"] = ("run", again.performance.astype(np.int16))
    data["start"], data["captured"] = ("run", again.times[:, 0]), ("run", again.times[:, 1])
    return data.isel(time=slice(None, None, THINNED)).assign_coords(label=("run", ["nominal", *picked]))
