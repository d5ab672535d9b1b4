"""Pitch-roll coupling over the factor box: does a pitch manoeuvre roll the aircraft, and do the roll factors matter to pitch?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from levelone.campaign import analysis
from levelone.campaign.models.builtin import CHUNK, BuiltinModel, IntArray
from levelone.config.study_file import Study
from levelone.dynamics.simulate import chunks
from levelone.errors import InputError
from levelone.handling.coupling import Coupling, coupling
from levelone.status import Status
from levelone.uncertainty import Design, MorrisIndices, morris_design, stage_seed
from levelone.vehicle.tables import FloatArray

#: responses of the pitch axis that the roll factors may or may not move
PITCH = ("quickness", "delta_theta_min", "zeta", "omega_n", "omega_bw", "tau_p")
#: part of the largest mu_star below which a factor counts as without influence
DROPPED = 0.01
NO_PATH = (
    "no coupling path in this model: vehicle and inputs are symmetric, a pitch command moves nothing in roll in any run, and "
    "the roll factors have nothing to act on"
)


def coupling_section(
    study: Study, model: BuiltinModel, seed: int, progress: Callable[[str, int, int], None] = lambda stage, done, total: None
) -> dict[str, Any]:
    """Screen the study's factors together with the added roll factors, under the step and the other pitch manoeuvres.

    Parameters
    ----------
    study
        With its section ``coupling``.
    model
        Of the study, at its own factors.
    seed
        Of the study; the Morris design takes its own from it.
    progress
        Called with the stage's name, what is done and what there is to do.

    Returns
    -------
    dict
        For results.json: ``added`` factors, ``n`` runs, how many ``failed`` for each response, ``mu_star`` and ``mu_star_ci`` of
        each response of ``PITCH`` and of the coupling ``ratio``, statistics of ``ratio`` and of the standard's literal one, their
        statuses counted in words, ``level_shares`` of the ratio, the factors ``dropped`` (below ``DROPPED`` of the largest mu_star
        in every response of ``PITCH``) and those ``undecided`` since a mu_star is undefined. ``note`` where no run rolls at all.
    """
    if study.coupling is None:
        raise InputError("coupling", "the study has no such section")
    given = study.coupling
    design = morris_design(given.space, given.trajectories, study.method.levels, stage_seed(seed, "coupling"))
    longer, stage = replace(model, targets=given.targets), "coupling (Morris)"
    progress(stage, 0, design.runs)
    assessed = longer.assess(design.points, lambda done: progress(stage, min(done, design.runs), design.runs))
    ratio = read_ratios(longer, design.points)
    columns = {name: assessed.responses.column(name) for name in PITCH} | {"ratio": ratio.ratio}
    effects = {name: analysis.screen_one(design, y, study.policy, study.method.bootstrap) for name, y in columns.items()}
    failed = {name: int(np.isnan(y).sum()) for name, y in columns.items()}
    out = {"added": list(given.added), "n": design.runs, "trajectories": given.trajectories, "failed": failed}
    return out | _screening(design, effects) | _ratios(ratio)


def read_ratios(model: BuiltinModel, points: FloatArray) -> Coupling:
    """Roll against pitch under the model's step at points [n, factors]."""
    parts = []
    for part in chunks(len(points), CHUNK):
        history = model.fly(model.batch(points[part]), model.step, ("theta", "phi"))
        parts.append(coupling(history, boundaries=model.boundaries))
    return Coupling(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in Coupling.__dataclass_fields__})


def _screening(design: Design, effects: dict[str, MorrisIndices | None]) -> dict[str, Any]:
    blocks = {name: analysis.morris_json(design.space, found) for name, found in effects.items()}
    mu_star = {name: {factor: entry["mu_star"] for factor, entry in block.items()} for name, block in blocks.items()}
    ends = {name: {factor: entry["mu_star_ci"] for factor, entry in block.items()} for name, block in blocks.items()}
    part = np.array([relative(list(mu_star[name].values())) for name in PITCH])
    undecided = np.isnan(part).any(axis=0)
    dropped = ~undecided & (np.nan_to_num(part) < DROPPED).all(axis=0)
    names = np.array(design.names)
    return {
        "mu_star": mu_star, "mu_star_ci": ends, "dropped": names[dropped].tolist(), "undecided": names[undecided].tolist(),
    }  # fmt: skip


def relative(mu_star: list[float]) -> FloatArray:
    """Each as a part of the largest; 0 where nothing moves the response at all, NaN where any is undefined."""
    values = np.array(mu_star, dtype=np.float64)
    largest = values.max()
    return values / largest if largest != 0.0 else values


def _ratios(found: Coupling) -> dict[str, Any]:
    out: dict[str, Any] = {
        "ratio": analysis.statistics(found.ratio),
        "ratio_status": _counts(found.status),
        "ratio_literal": analysis.statistics(found.ratio_literal),
        "ratio_literal_status": _counts(found.status_literal),
        "level_shares": analysis.shares_json(found.level),
    }
    known = found.ratio[np.isfinite(found.ratio)]
    return out | ({"note": NO_PATH} if known.size and not known.any() else {})


def _counts(codes: IntArray) -> dict[str, int]:
    """How often each status occurred, in words."""
    found, counts = np.unique(codes, return_counts=True)
    return {Status(int(code)).text: int(count) for code, count in zip(found, counts, strict=True)}
