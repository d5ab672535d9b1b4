"""What a study does beyond its three criteria, as far as its file asks for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import xarray as xr

from levelone.campaign.amplitudes import amplitudes_section
from levelone.campaign.cases import cases_section
from levelone.campaign.coupling import coupling_section
from levelone.campaign.deceleration import deceleration_section
from levelone.campaign.delay import delay_section
from levelone.campaign.epistemic import epistemic_section
from levelone.campaign.froude import froude_section
from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.sampling import Sampled
from levelone.config.study_file import Study

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Sections:
    """Blocks of results.json by their key, and datasets: file name, then group."""

    results: dict[str, Any] = field(default_factory=dict)
    frequency: Mapping[str, xr.Dataset] = field(default_factory=dict)
    files: Mapping[str, Mapping[str, xr.Dataset]] = field(default_factory=dict)


def run_sections(study: Study, model: BuiltinModel, sampled: Sampled, seed: int, progress: Progress) -> Sections:
    """Run every further section that a study's file has.

    Parameters
    ----------
    study, model
        The study and the vehicle under its manoeuvres.
    sampled
        The Monte Carlo sample, what was read there, and the surrogates of it.
    seed
        Of the study.
    progress
        Called with the stage's name, what is done and what there is to do.
    """
    sample, assessed = sampled.sample, sampled.assessed
    out: dict[str, Any] = {"without_delay": delay_section(study, model, sample)}
    frequency: dict[str, xr.Dataset] = {}
    files: dict[str, dict[str, xr.Dataset]] = {}
    if study.froude is not None:
        out["levels_froude"] = froude_section(study, assessed)
    if study.cases:
        out["cases"] = cases_section(study, model)
    if study.amplitudes:
        out["amplitudes"], frequency["amplitudes"] = amplitudes_section(study, model)
    if study.coupling is not None:
        out["coupling"] = coupling_section(study, model, seed, progress)
    if study.deceleration is not None:
        out["deceleration"], files = deceleration_section(study, model, sample, assessed, seed, progress)
    if study.epistemic is not None:
        surrogates = dict(zip(sampled.read.responses.names, sampled.found.surrogates, strict=True))
        out["epistemic"] = epistemic_section(study, model, assessed, surrogates, seed, progress)
    return Sections(out, frequency, files)
