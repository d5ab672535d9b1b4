"""What calibration.json says of the file, of each fit, and of what the targets identify."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from levelone.campaign.calibration import Fit, sigmas, targets_of
from levelone.campaign.identifiability import CORRELATED, REMOVED, SPREAD, analyse, inseparable, spread_ratio
from levelone.config.calibration_file import Calibration
from levelone.config.calibration_sections import Parameter, Target
from levelone.status import Status
from levelone.uncertainty import Responses
from levelone.vehicle.tables import FloatArray


def describe_calibration(calibration: Calibration) -> dict[str, Any]:
    """The file, in SI for the targets and in the units of the vehicle's file for the parameters."""
    return {
        "name": calibration.name,
        "title": calibration.title,
        "file": calibration.path.name,
        "study": calibration.study.name,
        "seed": calibration.seed,
        "starts": calibration.starts,
        "perturbation": calibration.perturbation,
        "digits": calibration.digits,
        "targets": [_target(target) for target in calibration.targets],
        "parameters": [_parameter(each) for each in calibration.parameters],
    }


def _target(target: Target) -> dict[str, Any]:
    return {
        "response": target.response, "unit": target.unit, "value": target.value, "tolerance": target.tolerance,
        "accept": list(target.accept), "origin": target.origin,
    }  # fmt: skip


def _parameter(each: Parameter) -> dict[str, Any]:
    return {
        "path": each.path, "ties": list(each.ties), "unit": each.unit, "prior": each.prior, "low": each.low, "high": each.high,
        "spread": each.spread, "scale": each.scale, "role": each.role, "assumed": each.assumed,
    }  # fmt: skip


def fit_json(calibration: Calibration, fit: Fit, values: FloatArray) -> dict[str, Any]:
    """How a fit went, and its rounded ``values`` [parameters]."""
    paths = [each.path for each in calibration.parameters]
    return {
        "start": dict(zip(paths, fit.start.tolist(), strict=True)),
        "values": dict(zip(paths, values.tolist(), strict=True)),
        "changes": calibration.changes(values.tolist()),
        "target_cost": fit.target_cost,
        "prior_cost": fit.prior_cost,
        "evaluations": fit.evaluations,
        "undefined": fit.undefined,
        "outcome": fit.outcome,
    }


def reached_json(calibration: Calibration, responses: Responses) -> list[dict[str, Any]]:
    """For each flown vehicle: all responses, statuses of the targets in words, and whether all targets are accepted."""
    found, status = targets_of(calibration, responses)
    out = []
    for values, codes, everything in zip(found, status, responses.values, strict=True):
        missed = [text for each in zip(calibration.targets, values, codes, strict=True) if (text := _missed(*each))]
        out.append({
            "reached": dict(zip(responses.names, everything.tolist(), strict=True)),
            "status": {t.response: Status(int(code)).text for t, code in zip(calibration.targets, codes, strict=True)},
            "accepted": not missed,
            "missed": missed,
        })  # fmt: skip
    return out


def _missed(target: Target, value: float, code: int) -> str:
    """Why a target is not met, in words; empty where it is."""
    if math.isnan(value):
        return f"{target.response}: {Status(int(code)).text}"
    low, high = target.accept
    return "" if low <= value <= high else f"{target.response} is {value:.4g}, accepted from {low:.4g} to {high:.4g} {target.unit}"


def identifiability_json(
    calibration: Calibration, jacobian: FloatArray, at: FloatArray, starts: FloatArray, fitted: FloatArray
) -> dict[str, Any]:
    """What the targets tell about each parameter.

    Parameters
    ----------
    jacobian
        [targets, parameters] change of a target for one sigma of the prior, at the calibrated vehicle.
    at
        [targets] values there.
    starts, fitted
        [n, parameters] of the accepted perturbed fits, before and after.
    """
    parameters, targets = calibration.parameters, calibration.targets
    scaled = jacobian / np.array([target.tolerance for target in targets])[:, None]
    found = analyse(scaled)
    spread = spread_ratio(sigmas(parameters, starts), sigmas(parameters, fitted))
    paths, names = [each.path for each in parameters], [target.response for target in targets]
    return {
        "limits": {"removed": REMOVED, "correlation": CORRELATED, "spread": SPREAD},
        "sensitivity": _table(paths, names, _sensitivity(parameters, jacobian, at)),
        "jacobian": _table(paths, names, scaled),
        "singular_values": found.singular_values.tolist(),
        "directions": [dict(zip(paths, row.tolist(), strict=True)) for row in found.directions],
        "parameters": {
            each.path: _verdict(each, float(removed), float(ratio), ends)
            for each, removed, ratio, ends in zip(parameters, found.removed, spread, fitted.T, strict=True)
        },
        "not_apart": [{"a": paths[i], "b": paths[j], "correlation": r} for i, j, r in inseparable(found.correlation)],
    }


def _table(paths: list[str], names: list[str], values: FloatArray) -> dict[str, dict[str, float]]:
    return {path: dict(zip(names, column.tolist(), strict=True)) for path, column in zip(paths, values.T, strict=True)}


def _sensitivity(parameters: tuple[Parameter, ...], jacobian: FloatArray, at: FloatArray) -> FloatArray:
    """d ln target / d ln parameter; d ln target for one spread of a parameter on a linear scale."""
    unit = np.array([math.log(each.spread) if each.scale == "log" else 1.0 for each in parameters])
    return jacobian / at[:, None] / unit


def _verdict(parameter: Parameter, removed: float, ratio: float, ends: FloatArray) -> dict[str, Any]:
    """Both witnesses and what follows from them; ``ends`` [n] are the values of the accepted fits."""
    wide = ratio > SPREAD
    known = removed >= REMOVED and not wide
    reasons = [f"the targets remove {100 * removed:.1f} % of its prior variance"] * (removed < REMOVED)
    reasons += [f"accepted fits keep {100 * ratio:.0f} % of the spread of their starts"] * wide
    text = "identified" if known else f"not identified: {'; '.join(reasons)}"
    for name, bound in (("lower", parameter.low), ("upper", parameter.high)):
        if parameter.role == "fit" and len(ends) > 0 and np.all(ends == bound):
            text += f"; all accepted fits end on its {name} bound"
    return {
        "removed": removed,
        "spread_ratio": ratio,
        "spread_status": _spread_status(parameter, ratio, len(ends)),
        "identified": known,
        "verdict": text,
    }


def _spread_status(parameter: Parameter, ratio: float, fits: int) -> str:
    if not math.isnan(ratio):
        return "ok"
    if parameter.role == "hold":
        return "held"
    return "all starts have the same value" if fits > 1 else f"{fits} accepted fits from perturbed starts: two are needed"
