"""Shares of Levels at Froude-scaled limits: the same sample, judged as if the limits had been written for its size."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from levelone.campaign import analysis
from levelone.campaign.models.builtin import Assessment, IntArray
from levelone.config.study_file import Study
from levelone.errors import InputError
from levelone.handling.froude import froude_scaled, rate_scale
from levelone.handling.levels import Boundaries, worst
from levelone.handling.translation import rise_time_levels
from levelone.uncertainty import Responses


def froude_section(study: Study, assessed: Assessment) -> dict[str, Any]:
    """The shares of Levels of an assessed sample at the boundaries scaled to the vehicle's length.

    Parameters
    ----------
    study
        With its section ``levels.froude``.
    assessed
        The Monte Carlo sample; nothing is flown again.

    Returns
    -------
    dict
        For results.json: shares as under ``levels``, the ``confidence`` of each scaled boundary, ``length`` and
        ``reference_length`` (m), their ``basis`` in words, and ``scale``, the factor on rates and frequencies (times are divided by
        it).
    """
    given = study.froude
    if given is None:
        raise InputError("levels.froude", "the study has no such section")
    scaled = froude_scaled(study.boundaries, given.length, given.reference_length)
    levels, extrapolated = judged(assessed.responses, scaled, study.task)
    found = analysis.level_shares(replace(assessed, levels=levels, extrapolated=extrapolated))
    return found | {
        "confidence": _confidence(scaled, study.task),
        "length": given.length,
        "reference_length": given.reference_length,
        "basis": given.basis,
        "scale": rate_scale(given.length, given.reference_length),
    }


def judged(responses: Responses, boundaries: Boundaries, task: str) -> tuple[dict[str, IntArray], IntArray]:
    """Levels of each criterion, of the worst of the three and of the translational rate, [n], read from the responses; and the
    Levels of attitude quickness by the extended boundaries."""
    value = responses.column
    quickness, extrapolated = boundaries.chart("attitude_quickness", "pitch").levels(value("delta_theta_min"), value("quickness"))
    bandwidth, _ = boundaries.chart("bandwidth", task).levels(value("tau_p_attitude"), value("omega_bw_attitude"))
    levels = {
        "attitude_quickness": quickness,
        "dynamic_stability": boundaries.dynamic_stability.levels(value("omega_n"), value("zeta")),
        "bandwidth": bandwidth,
    }
    moved = rise_time_levels(value("rise_time"), boundaries)
    return levels | {"worst": worst(*levels.values()), "translational_rate": moved}, extrapolated


def _confidence(boundaries: Boundaries, task: str) -> dict[str, str]:
    limits = boundaries.dynamic_stability
    return {
        "attitude_quickness": boundaries.chart("attitude_quickness", "pitch").confidence,
        "dynamic_stability": f"zeta line {limits.confidence_zeta_1}, other limits {limits.confidence}",
        "bandwidth": boundaries.chart("bandwidth", task).confidence,
        "translational_rate": str(boundaries.limits["translational_rate"].get("confidence", "not stated")),
    }
