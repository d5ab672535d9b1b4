"""Flight dynamics: trim, simulate, linearise."""

from levelone.dynamics.linear_model import LinearModel, Poles
from levelone.dynamics.linearize import linearize
from levelone.dynamics.model import Command, State, derivative
from levelone.dynamics.simulate import simulate
from levelone.dynamics.trim import Trim, trim

__all__ = ["Command", "LinearModel", "Poles", "State", "Trim", "derivative", "linearize", "simulate", "trim"]
