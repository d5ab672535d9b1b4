"""Sets of coefficients flown one by one: the nominal vehicle with each row of a table, on the nonlinear model."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.sweep import SweepCheck, sweep_check
from levelone.config.study_file import Study
from levelone.config.study_sections import Cases
from levelone.status import Status

#: m/s: amplitude of the nonlinear sweeps from which bandwidth is read beside the linear response, larger than where the two are
#: compared; the reference study flew the cases of its Table 5 so.
AMPLITUDE = 0.5
#: responses that the cases of a criterion are asked for
READ = {
    "attitude_quickness": ("quickness", "delta_theta_min"),
    "dynamic_stability": ("zeta", "omega_n"),
    "bandwidth": ("omega_bw", "tau_p", "omega_bw_attitude", "tau_p_attitude"),
}


def cases_section(study: Study, model: BuiltinModel) -> dict[str, Any]:
    """The cases of every criterion, for results.json: what was set, the values read (NaN where none) and their statuses in words.

    Everything that a case does not set is the nominal vehicle's, and so is the controller. Values and Levels are those of the
    study's step, pulse and linear response; for ``bandwidth`` also ``omega_bw_swept`` and ``tau_p_swept``, read on q / V_lon from
    a sweep of the nonlinear model with ``AMPLITUDE``. ``level`` holds codes of :class:`levelone.handling.levels.Level`. Where the
    file has other numbers for the same cases, ``beside`` is a block of the same form.
    """
    return {cases.criterion: _block(study, model, cases) for cases in study.cases}


def _block(study: Study, model: BuiltinModel, cases: Cases) -> dict[str, Any]:
    varied = replace(model, targets=cases.columns)
    assessed = varied.assess(cases.rows)
    values = {name: assessed.responses.column(name).tolist() for name in READ[cases.criterion]}
    status = {name: _words(assessed.responses.codes(name).tolist()) for name in READ[cases.criterion]}
    block: dict[str, Any] = {
        "name": cases.name,
        "source": cases.source,
        "columns": list(cases.columns),
        "rows": cases.rows.tolist(),
    }
    if cases.criterion == "bandwidth":
        checks = _sweeps(study, varied, cases)
        for name, key, code in (("omega_bw_swept", "omega_bw", "status_phase"), ("tau_p_swept", "tau_p", "status_tau_p")):
            values[name] = [float(np.ravel(getattr(check.swept_reading, key))[0]) for check in checks]
            status[name] = _words([_outcome(check, code) for check in checks])
        block |= {"amplitude": AMPLITUDE, "omega_max": [check.manoeuvre.omega_max for check in checks]}
    block |= {"values": values, "status": status, "level": assessed.levels[cases.criterion].tolist()}
    return block if cases.beside is None else block | {"beside": _block(study, model, cases.beside)}


def _sweeps(study: Study, varied: BuiltinModel, cases: Cases) -> list[SweepCheck]:
    """The nonlinear sweep of each case, long enough in frequency for the phase delay that its linear response has."""
    batch, sweep = varied.batch(cases.rows), replace(study.sweep, amplitude=AMPLITUDE)
    return [sweep_check(varied, sweep, study.windows, batch.select(slice(i, i + 1))) for i in range(len(batch))]


def _outcome(check: SweepCheck, code: str) -> int:
    """Status of a swept reading: that of the run where it failed."""
    run = Status(int(check.history.status[0]))
    return int(run if run.failed else np.ravel(getattr(check.swept_reading, code))[0])


def _words(codes: list[int]) -> list[str]:
    return [Status(code).text for code in codes]
