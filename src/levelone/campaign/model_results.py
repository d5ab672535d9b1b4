"""What results.json says of a study of a model of one's own, beside its responses: the study, the model, how it was run."""

from __future__ import annotations

import datetime
import math
import platform
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from levelone._version import __version__
from levelone.campaign.describe import describe_factor
from levelone.campaign.evaluation_store import EvaluationStore
from levelone.campaign.models.keys import plain
from levelone.campaign.models.protocol import Model
from levelone.campaign.nominal_check import NominalCheck
from levelone.config.campaign_table import CampaignOptions
from levelone.config.model_study import ModelStudy
from levelone.config.model_table import Channel

Json = dict[str, Any]
#: said of a model in rows of their own
_APART = ("kind", "inputs", "outputs", "responses", "fixed", "initial", "set", "vehicle")


def describe_model_study(study: ModelStudy, seed: int) -> Json:
    """Factors, methods and tests of a study, as written into its results."""
    m = study.method
    return {
        "name": study.name,
        "title": study.title,
        "intended_use": study.intended_use,
        "policy": study.policy,
        "boundaries": study.boundaries_source,
        "task": study.task,
        "notes": list(study.notes),
        "seed": seed,
        "factors": [describe_factor(study, j) for j in range(len(study.space.factors))],
        "correlations": [
            {"factors": [first, second], "rank": rank, "source": why} for first, second, rank, why in study.correlations
        ],
        "method": {
            "trajectories": m.trajectories, "levels": m.levels, "samples": m.samples, "base_points": m.base_points,
            "kernel": m.kernel, "trend": m.trend, "bootstrap": m.bootstrap,
        },
        "tests": {test.name: plain(test) for test in study.tests},
    }  # fmt: skip


def describe_model(study: ModelStudy, model: Model) -> Json:
    """The model's options, mappings and what was set in it; files by their names."""
    table = study.model
    options = {f.name: _plain(getattr(table, f.name)) for f in fields(table) if f.name not in _APART}
    given = {name: dict(getattr(table, name)) for name in ("fixed", "initial", "set") if getattr(table, name, ())}
    return {
        "kind": table.kind,
        "options": options,
        "given": given,
        "inputs": [_channel(each) for each in table.inputs],
        "outputs": [_channel(each) for each in table.outputs],
        "key": dict(model.key),
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return value.name
    if value is None:
        return "not given"
    if isinstance(value, float) and math.isinf(value):
        return "none"
    return list(value) if isinstance(value, tuple) else value


def _channel(channel: Channel) -> Json:
    trim = "held" if channel.trim is None else channel.trim
    return {
        "levelone": channel.levelone, "name": channel.name, "unit": channel.unit, "scale": channel.scale, "sign": channel.sign,
        "offset": channel.offset, "trim": trim,
    }  # fmt: skip


def campaign_json(store: EvaluationStore, options: CampaignOptions, evaluated: int, reused: int) -> Json:
    """How the evaluations came about: ``evaluated`` in this run, ``reused`` from the store, which holds ``outcomes`` in all."""
    return {
        "executor": options.executor,
        "workers": "one for each core" if options.workers is None else options.workers,
        "time_limit": "none" if math.isinf(options.time_limit) else options.time_limit,
        "retries": options.retries,
        "evaluated": evaluated,
        "reused": reused,
        "outcomes": store.counts(),
    }


def model_provenance(study: ModelStudy, seed: int, seconds: Mapping[str, float]) -> Json:
    """Versions, seed, hashes and wall times."""
    return {
        "levelone": __version__, "python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__,
        "platform": platform.platform(), "seed": seed, "study_sha256": study.hash,
        "wall_s": dict(seconds), "finished": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }  # fmt: skip


def nominal_json(check: NominalCheck) -> Json:
    """What the nominal case had to say, and what looks wrong with it."""
    return {"message": check.message, "findings": [{"wrong": each.wrong, "text": each.text} for each in check.findings]}
