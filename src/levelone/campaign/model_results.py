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
from levelone.campaign.describe import describe_statements
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
    return describe_statements(study, seed) | {"tests": {test.name: plain(test) for test in study.tests}}


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
        "trim": trim,
    }  # fmt: skip


def campaign_json(store: EvaluationStore, options: CampaignOptions, evaluated: int, reused: int) -> Json:
    """How the evaluations came about: ``evaluated`` in this run, ``reused`` from the store, which holds ``outcomes`` in all."""
    return {
        "executor": options.executor,
        "workers": options.workers or ("one for each core" if options.executor == "processes" else "those of the executor"),
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
