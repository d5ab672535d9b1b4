"""Campaigns: models, the run of a whole study, and what it leaves behind.

The names below are imported when they are first used: a worker that runs another's model shall not load the built-in vehicle.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from levelone.campaign.models.builtin import Assessment as Assessment
    from levelone.campaign.models.builtin import BuiltinModel as BuiltinModel
    from levelone.campaign.models.protocol import Evaluations as Evaluations
    from levelone.campaign.models.protocol import Model as Model
    from levelone.campaign.study import build_model as build_model
    from levelone.campaign.study import run_study as run_study

_MODULE_OF = {
    "Assessment": "models.builtin", "BuiltinModel": "models.builtin", "Evaluations": "models.protocol", "Model": "models.protocol",
    "build_model": "study", "run_study": "study",
}  # fmt: skip

__all__ = ["Assessment", "BuiltinModel", "Evaluations", "Model", "build_model", "run_study"]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'levelone.campaign' has no attribute {name!r}")
    value = getattr(import_module(f"levelone.campaign.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value
