"""What the sections of a calibration file become."""

from __future__ import annotations

from dataclasses import dataclass

from levelone.config.calibration_schema import Role, Scale


@dataclass(frozen=True)
class Target:
    """A nominal response to be met: SI value, one sigma of its residual, range that is accepted, and where it comes from."""

    response: str
    unit: str
    value: float
    tolerance: float
    accept: tuple[float, float]
    origin: str


@dataclass(frozen=True)
class Parameter:
    """An assumed number of the vehicle's file, in the unit of that file.

    Parameters
    ----------
    path, ties
        As ``load_vehicle`` takes changes; the entries in ``ties`` get the same value.
    unit
        Of the entry; "1" for a factor on a coordinate of the rotors.
    prior, low, high
        Where it starts, and its bounds.
    spread
        One sigma of the prior: a factor where ``scale`` is "log", a difference where it is "linear".
    role
        "fit"; "draw": not fitted, but drawn for each perturbed start; "hold": at its prior in all fits. All have a sensitivity.
    assumed
        Why this prior; goes into the calibrated vehicle's file.
    """

    path: str
    ties: tuple[str, ...]
    unit: str
    prior: float
    low: float
    high: float
    spread: float
    scale: Scale
    role: Role
    assumed: str


@dataclass(frozen=True)
class Family:
    """A second trade-off curve, and all parameters with the priors and upper bounds that hold on it."""

    name: str
    parameters: tuple[Parameter, ...]


@dataclass(frozen=True)
class Tradeoff:
    """Target (place in the list) that is forced through ``values`` with ``tolerance`` (SI) while the others are fitted."""

    index: int
    values: tuple[float, ...]
    tolerance: float
    families: tuple[Family, ...]


@dataclass(frozen=True)
class Limit:
    """What a response (SI) must not exceed in any Monte Carlo sample, and who says so."""

    response: str
    unit: str
    high: float
    origin: str


@dataclass(frozen=True)
class Checks:
    """Looked at after the fit: speeds (m/s) for stability, limits of the controller that should do nothing, each with a larger
    value to try, and bounds on responses."""

    speeds: tuple[float, ...]
    inactive: tuple[tuple[str, float], ...]
    limits: tuple[Limit, ...]
