"""The Monte Carlo sample once more without the rotors' delay: how far do bandwidth and phase delay spread for other reasons?"""

from __future__ import annotations

from typing import Any

import numpy as np

from levelone.campaign import analysis
from levelone.campaign.models.builtin import CHUNK, RESPONSES, BuiltinModel, responses_of
from levelone.config.study_file import Study
from levelone.dynamics.simulate import chunks
from levelone.uncertainty import Design, Responses
from levelone.vehicle.tables import FloatArray

READ = ("omega_bw", "tau_p")
NOTHING_HELD = "the study varies no rotor delay (tau_d): the responses of its own sample are already those without"


def delay_section(study: Study, model: BuiltinModel, sample: Design) -> dict[str, Any]:
    """Statistics of the linear reading of q / V_lon at the points of a sample, the factor tau_d held at its nominal value.

    Returns
    -------
    dict
        For results.json: ``n`` points, ``tau_d`` (s), and for each of ``READ`` its ``unit``, statistics, ``failures`` and
        ``cautions`` in words. A study without such a factor has no points and a ``note`` that says so.
    """
    if "tau_d" not in study.targets:
        return {"n": 0, "responses": {}, "note": NOTHING_HELD}
    column = study.targets.index("tau_d")
    points = sample.points.copy()
    points[:, column] = study.nominal[column]
    found = linear_responses(model, points)
    responses: dict[str, Any] = {}
    for name in READ:
        failures, cautions = analysis.in_words(found.counts(name))
        counted = {"failures": failures, "cautions": cautions}
        responses[name] = {"unit": RESPONSES[name][0]} | analysis.statistics(found.column(name)) | counted
    return {"n": len(points), "tau_d": float(study.nominal[column]), "responses": responses}


def linear_responses(model: BuiltinModel, points: FloatArray) -> Responses:
    """``READ`` at points [n, factors], as the study itself reads them, without flying any manoeuvre."""
    values, status = np.empty((len(READ), len(points))), np.empty((len(READ), len(points)), dtype=np.int64)
    for part in chunks(len(points), CHUNK):
        (reading,), run = model.linear_readings(model.batch(points[part]), ("q",))
        values[:, part] = reading.omega_bw, reading.tau_p
        status[:, part] = np.where(run, run, [reading.status_phase, reading.status_tau_p])
    return responses_of(dict(zip(READ, zip(values, status, strict=True), strict=True)))
