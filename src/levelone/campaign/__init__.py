"""Campaigns: models, the run of a whole study, and what it leaves behind."""

from levelone.campaign.models import Assessment, BuiltinModel, Model
from levelone.campaign.study import build_model, run_study

__all__ = ["Assessment", "BuiltinModel", "Model", "build_model", "run_study"]
