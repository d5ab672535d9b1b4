"""The nonlinear sweep at several amplitudes against the linearisation: up to which amplitude may one stand for the other?"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.sweep import SweepCheck, sweep_check
from levelone.config.study_file import Study
from levelone.status import Status


def amplitudes_section(study: Study, model: BuiltinModel) -> tuple[list[dict[str, Any]], xr.Dataset]:
    """Fly the study's sweep with each of its amplitudes and compare each with the linear response of q / V_lon.

    Returns
    -------
    list
        For results.json, one entry for each amplitude (m/s), in the study's order: the differences and readings of
        :meth:`levelone.campaign.sweep.SweepCheck.summary`, and ``theta_pk_deg``, the largest change of pitch attitude.
    xarray.Dataset
        The swept responses, ``[amplitude, omega]``: for the group ``amplitudes`` of frequency.nc.
    """
    checks = [sweep_check(model, replace(study.sweep, amplitude=amplitude), study.windows) for amplitude in study.amplitudes]
    return [_entry(check) for check in checks], _responses(checks)


def _entry(check: SweepCheck) -> dict[str, Any]:
    """The comparison of one amplitude; a run that failed has no readings and says why."""
    entry = check.summary()
    code = Status(int(check.history.status[0]))
    if code.failed:
        entry |= {"status": code.text, "tau_p_status": code.text}
    return entry | {"theta_pk_deg": float(np.degrees(np.abs(check.history.change("theta")[0]).max()))}


def _responses(checks: list[SweepCheck]) -> xr.Dataset:
    """Every sweep reaches as far as the same linear response asks for, so that all share their frequencies."""
    data: dict[str, Any] = {}
    for name in ("q", "theta"):
        value = np.stack([np.ravel(check.swept[name].value) for check in checks])
        coherence = np.stack([np.ravel(check.swept[name].coherence) for check in checks])
        data |= {
            f"{name}_re": (("amplitude", "omega"), value.real),
            f"{name}_im": (("amplitude", "omega"), value.imag),
            ("coherence" if name == "q" else f"{name}_coherence"): (("amplitude", "omega"), coherence),
        }
    amplitudes = [check.manoeuvre.amplitude for check in checks]
    return xr.Dataset(data, coords={"amplitude": amplitudes, "omega": checks[0].swept["q"].omega})
