"""Predicted handling qualities of VTOL aircraft, and how far they can be trusted.

The public names below are imported when they are first used: importing the package computes nothing and takes no time.

From a model to its handling qualities::

    vehicle = levelone.load_vehicle("reference-evtol")
    history = levelone.simulate(vehicle, levelone.step("V_lon", 1.0, trim_speed=5.0))
    levelone.attitude_quickness(history).quickness

From uncertain inputs to what moves a response, for any model::

    space = levelone.FactorSpace([levelone.Factor("x", levelone.Uniform(0.0, 1.0)), ...])
    design = levelone.morris_design(space, trajectories=20, levels=4, seed=1)
    levelone.morris(design, values).mu_star
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from levelone._version import __version__

if TYPE_CHECKING:
    from levelone.campaign import run_study as run_study
    from levelone.campaign.models.builtin import BuiltinModel as BuiltinModel
    from levelone.campaign.models.protocol import Model as Model
    from levelone.config.study_file import Study as Study
    from levelone.config.study_file import load_study as load_study
    from levelone.config.vehicle_file import load_vehicle as load_vehicle
    from levelone.dynamics import linearize as linearize
    from levelone.dynamics import simulate as simulate
    from levelone.dynamics import trim as trim
    from levelone.errors import InputError as InputError
    from levelone.errors import LeveloneError as LeveloneError
    from levelone.handling.bandwidth import bandwidth as bandwidth
    from levelone.handling.coupling import coupling as coupling
    from levelone.handling.damping import dynamic_stability as dynamic_stability
    from levelone.handling.frequency import FrequencyResponse as FrequencyResponse
    from levelone.handling.history import TimeHistory as TimeHistory
    from levelone.handling.identification import identify as identify
    from levelone.handling.levels import Level as Level
    from levelone.handling.manoeuvres import Manoeuvre as Manoeuvre
    from levelone.handling.manoeuvres import pulse as pulse
    from levelone.handling.manoeuvres import step as step
    from levelone.handling.manoeuvres import sweep as sweep
    from levelone.handling.quickness import attitude_quickness as attitude_quickness
    from levelone.handling.translation import translational_rate as translational_rate
    from levelone.status import Status as Status
    from levelone.uncertainty import Discrete as Discrete
    from levelone.uncertainty import Factor as Factor
    from levelone.uncertainty import FactorSpace as FactorSpace
    from levelone.uncertainty import Kriging as Kriging
    from levelone.uncertainty import LogNormal as LogNormal
    from levelone.uncertainty import Normal as Normal
    from levelone.uncertainty import Responses as Responses
    from levelone.uncertainty import Triangular as Triangular
    from levelone.uncertainty import TruncatedNormal as TruncatedNormal
    from levelone.uncertainty import Uniform as Uniform
    from levelone.uncertainty import latin_hypercube as latin_hypercube
    from levelone.uncertainty import morris as morris
    from levelone.uncertainty import morris_design as morris_design
    from levelone.uncertainty import sobol as sobol
    from levelone.uncertainty import sobol_design as sobol_design
    from levelone.vehicle import Vehicle as Vehicle
    from levelone.vehicle import vary as vary

_HOME = {
    "levelone.campaign": ("run_study",),
    "levelone.campaign.models.builtin": ("BuiltinModel",),
    "levelone.campaign.models.protocol": ("Model",),
    "levelone.config.study_file": ("Study", "load_study"),
    "levelone.config.vehicle_file": ("load_vehicle",),
    "levelone.dynamics": ("linearize", "simulate", "trim"),
    "levelone.errors": ("InputError", "LeveloneError"),
    "levelone.handling.bandwidth": ("bandwidth",),
    "levelone.handling.coupling": ("coupling",),
    "levelone.handling.damping": ("dynamic_stability",),
    "levelone.handling.frequency": ("FrequencyResponse",),
    "levelone.handling.history": ("TimeHistory",),
    "levelone.handling.identification": ("identify",),
    "levelone.handling.levels": ("Level",),
    "levelone.handling.manoeuvres": ("Manoeuvre", "pulse", "step", "sweep"),
    "levelone.handling.quickness": ("attitude_quickness",),
    "levelone.handling.translation": ("translational_rate",),
    "levelone.status": ("Status",),
    "levelone.uncertainty": (
        "Discrete", "Factor", "FactorSpace", "Kriging", "LogNormal", "Normal", "Responses", "Triangular", "TruncatedNormal",
        "Uniform", "latin_hypercube", "morris", "morris_design", "sobol", "sobol_design",
    ),
    "levelone.vehicle": ("Vehicle", "vary"),
}  # fmt: skip
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = ["__version__", *sorted(_MODULE_OF)]


def __getattr__(name: str) -> Any:
    module = _MODULE_OF.get(name)
    if module is None:
        raise AttributeError(f"module 'levelone' has no attribute {name!r}")
    value = getattr(import_module(module), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
