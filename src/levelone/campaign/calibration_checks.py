"""What is looked at after a calibration and is no target: stability over speed, limits that do nothing, bounds on every sample."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from levelone.campaign.analysis import in_words
from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.study import Progress
from levelone.config.calibration_file import Calibration
from levelone.config.vehicle_file import load_vehicle
from levelone.dynamics import linearize
from levelone.status import Status
from levelone.uncertainty import latin_hypercube, stage_seed
from levelone.vehicle import batch_of

#: distance from z = 1 within which a pole is one of the integrators of position and heading
INTEGRATOR = 1e-7


def checks_json(calibration: Calibration, model: BuiltinModel, changes: Mapping[str, float], progress: Progress) -> dict[str, Any]:
    """The checks of the calibrated vehicle ``model.vehicle``, which ``changes`` make of the study's, for calibration.json.

    ``stability``: for each speed (m/s) the size of the largest pole of the sampled closed loop but those of the integrators of
    position and heading, stable below 1.
    ``inactive``: largest relative change of any response with a limit of the controller raised.
    ``limits``: extremes over the study's Monte Carlo sample, with what failed in it.
    """
    speeds, study = calibration.checks.speeds, calibration.study
    sample = latin_hypercube(study.space, study.method.samples, stage_seed(study.seed, "monte carlo"))
    stage, total = "checks", len(speeds) + sample.runs
    poles = []
    for done, speed in enumerate(speeds):
        progress(stage, done, total)
        poles.append(_largest_pole(model, speed))
    inactive = _raised(calibration, model, changes)
    responses = model.assess(sample.points, lambda done: progress(stage, min(len(speeds) + done, total), total)).responses
    limits = []
    for limit in calibration.checks.limits:
        column, codes = responses.column(limit.response), responses.counts(limit.response)
        failures, cautions = in_words(codes)
        largest = float(np.nanmax(column)) if np.isfinite(column).any() else float("nan")
        limits.append({
            "response": limit.response, "unit": limit.unit, "high": limit.high, "origin": limit.origin,
            "largest": largest, "n": len(column),
            "above": int(np.sum(column > limit.high)), "failures": failures, "cautions": cautions,
        })  # fmt: skip
    return {"stability": poles, "inactive": inactive, "limits": limits}


def _largest_pole(model: BuiltinModel, speed: float) -> dict[str, Any]:
    found = linearize(model.vehicle, speed, flight_mode=model.step.flight_mode, dt=model.step.dt)
    code = Status(int(found.status[0]))
    if code.failed:
        return {"speed": speed, "largest_pole": float("nan"), "stable": False, "status": code.text}
    z = found.poles().z
    largest = float(np.abs(z[np.abs(z - 1.0) > INTEGRATOR]).max())
    return {"speed": speed, "largest_pole": largest, "stable": largest < 1.0, "status": code.text}


def _raised(calibration: Calibration, model: BuiltinModel, changes: Mapping[str, float]) -> list[dict[str, Any]]:
    """Every limit in ``checks.inactive`` raised by itself: a limit that is never reached changes no response, to the last bit."""
    raised = calibration.checks.inactive
    if not raised:
        return []
    more: list[dict[str, float]] = [{}, *({name: value} for name, value in raised)]
    vehicles = [load_vehicle(calibration.study.vehicle_path, {**changes, **each}) for each in more]
    values = model.assess_batch(batch_of(vehicles)).responses.values
    moved = np.abs(values[1:] / values[0] - 1.0).max(axis=1)
    return [{"path": name, "raised_to": value, "largest_change": float(m)} for (name, value), m in zip(raised, moved, strict=True)]
