"""Calibration as bounded least squares: residuals of the targets, a mild prior, and one batch of flights for each step.

Every parameter is counted in sigmas of its prior, x = ln p / ln spread on a log scale and p / spread on a linear one, so that the
residuals are (response - target) / tolerance and x - x_start. Nocedal and Wright, Numerical Optimization, 2nd ed., ch. 10, with the
Gaussian prior of Tarantola, Inverse Problem Theory, 2005, ch. 3. SciPy's ``dogbox`` is used since a parameter may start on a bound
(no lag of commands): ``trf`` keeps strictly inside and creeps away from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from levelone.campaign.models.builtin import RESPONSES, BuiltinModel
from levelone.config.calibration_file import Calibration
from levelone.config.calibration_sections import Parameter
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError
from levelone.status import Status
from levelone.uncertainty import Responses, stage_seed
from levelone.vehicle import batch_of
from levelone.vehicle.tables import FloatArray

#: residual of a target that is undefined at a point: beyond any residual of a defined one, so that the step is refused
UNDEFINED = 100.0
#: step of the differences, in sigmas of the prior; on a linear scale it must reach well beyond one control period
STEP = 0.1
#: when a fit has converged: relative change of the cost and of the parameters in sigmas; and after how many steps it is given up
CLOSENESS, MAX_STEPS = 1e-5, 30


@dataclass(frozen=True, eq=False)
class Point:
    """Targets where a fit stands.

    Parameters
    ----------
    value, status
        [targets] SI and codes of :class:`levelone.status.Status`; NaN where undefined.
    jacobian
        [targets, parameters] change for one sigma of the prior; 0 where differences are undefined.
    undefined
        Undefined target values among all flights of the differences.
    """

    value: FloatArray
    status: NDArray[np.int64]
    jacobian: FloatArray
    undefined: int


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of one least-squares fit.

    Parameters
    ----------
    start, values
        [parameters] in the units of the vehicle's file, before and after; not rounded.
    target_cost, prior_cost
        Half the sums of squares of the residuals of the targets and of the prior.
    evaluations, undefined
        Batches flown, and undefined target values met in them.
    outcome
        Why the fit ended, in words.
    """

    start: FloatArray
    values: FloatArray
    target_cost: float
    prior_cost: float
    evaluations: int
    undefined: int
    outcome: str


def sigmas(parameters: Sequence[Parameter], values: FloatArray) -> FloatArray:
    """Parameters [.., p] counted in sigmas of their priors."""
    logs, unit = _scale(parameters)
    return np.where(logs, np.log(np.where(logs, values, 1.0)), values) / unit


def from_sigmas(parameters: Sequence[Parameter], x: FloatArray) -> FloatArray:
    """The inverse of :func:`sigmas`, kept within the bounds."""
    logs, unit = _scale(parameters)
    values = np.where(logs, np.exp(np.where(logs, x * unit, 0.0)), x * unit)
    return np.clip(values, [each.low for each in parameters], [each.high for each in parameters])


def _scale(parameters: Sequence[Parameter]) -> tuple[NDArray[np.bool_], FloatArray]:
    logs = np.array([each.scale == "log" for each in parameters])
    return logs, np.array([np.log(each.spread) if each.scale == "log" else each.spread for each in parameters])


def starts_of(calibration: Calibration) -> FloatArray:
    """[1 + starts, parameters]: the priors, and points drawn about them.

    On a log scale the standard deviation is ln ``perturbation``, on a linear one the parameter's spread; what falls beyond a bound
    is put on it. Parameters that are held stay at their priors.
    """
    parameters = calibration.parameters
    prior = np.array([each.prior for each in parameters])
    logs, unit = _scale(parameters)
    sigma = np.where(logs, np.log(calibration.perturbation) / unit, 1.0) * [each.role != "hold" for each in parameters]
    draws = np.random.default_rng(stage_seed(calibration.seed, "starts")).standard_normal((calibration.starts, len(parameters)))
    return np.vstack([prior, from_sigmas(parameters, sigmas(parameters, prior) + sigma * draws)])


def fly(model: BuiltinModel, calibration: Calibration, values: FloatArray) -> Responses:
    """Nominal responses of the vehicle with each row of parameters [n, p], in one batch.

    A vehicle that cannot be designed (no hover, no trim at a speed of its controller's table) has no responses.
    """
    vehicles = [load_vehicle(calibration.study.vehicle_path, calibration.changes(row)) for row in values]
    try:
        return model.assess_batch(batch_of(vehicles)).responses
    except InputError:
        if len(values) > 1:
            return _stacked([fly(model, calibration, row[None]) for row in values])
        failed = np.full((1, len(RESPONSES)), int(Status.TRIM_FAILED))
        return Responses(failed * np.nan, failed, tuple(RESPONSES), tuple(unit for unit, _ in RESPONSES.values()))


def _stacked(parts: Sequence[Responses]) -> Responses:
    values, status = np.vstack([part.values for part in parts]), np.vstack([part.status for part in parts])
    return Responses(values, status, parts[0].names, parts[0].units)


def targets_of(calibration: Calibration, responses: Responses) -> tuple[FloatArray, NDArray[np.int64]]:
    """[n, targets] values and statuses of the calibration's targets."""
    names = [target.response for target in calibration.targets]
    return np.column_stack([responses.column(n) for n in names]), np.column_stack([responses.codes(n) for n in names])


def differentiate(model: BuiltinModel, calibration: Calibration, values: FloatArray, columns: Sequence[int]) -> Point:
    """Targets at ``values`` [p] and their derivatives for the parameters in ``columns``, from one batch of 2 columns + 1 flights.

    Differences are central; at a bound they are one-sided of second order, from two points inside. Where one of the two points is
    undefined the other is taken alone, with first order.
    """
    parameters = calibration.parameters
    x = sigmas(parameters, values)
    low, high = (sigmas(parameters, np.array([getattr(each, end) for each in parameters])) for end in ("low", "high"))
    offsets = np.array([_offsets(x[j] - low[j], high[j] - x[j]) for j in columns]).reshape(-1, 2)
    points = np.tile(x, (1 + offsets.size, 1))
    points[np.arange(1, len(points)), np.repeat(columns, 2)] += offsets.ravel()
    found, status = targets_of(calibration, fly(model, calibration, from_sigmas(parameters, points)))
    pairs = found[1:].reshape(len(columns), 2, -1)
    slopes = [_slope(found[0], pair, offset) for pair, offset in zip(pairs, offsets, strict=True)]
    return Point(found[0], status[0], np.array(slopes).reshape(len(columns), -1).T, int(np.isnan(found).sum()))


def _offsets(below: float, above: float) -> tuple[float, float]:
    """Two steps that stay within the bounds."""
    if below < STEP:
        return STEP, 2.0 * STEP
    return (-STEP, STEP) if above >= STEP else (-STEP, -2.0 * STEP)


def _slope(centre: FloatArray, pair: FloatArray, offset: FloatArray) -> FloatArray:
    """[targets] derivative of the parabola through three points, of the line through two of them, or 0 through one."""
    a, b = offset
    first, second = ((pair[k] - centre) / offset[k] for k in (0, 1))
    slope = (b * first - a * second) / (b - a)
    for other in (first, second):
        slope = np.where(np.isnan(slope), other, slope)
    return np.nan_to_num(slope, nan=0.0)


def fit(model: BuiltinModel, calibration: Calibration, start: FloatArray, centre: FloatArray, closeness: float = CLOSENESS) -> Fit:
    """Fit the parameters with the role "fit" to the targets.

    Parameters
    ----------
    model
        Gives manoeuvres; the choice of peaks is compared with that of its own vehicle.
    calibration
        Targets, parameters and bounds.
    start
        [parameters] where to begin, in the units of the vehicle's file; the others stay here.
    centre
        [parameters] centre of the prior.
    closeness
        Relative change of the cost, and of the parameters in sigmas, at which it has converged.

    Returns
    -------
    Fit
        The best point; ``outcome`` says if it has not converged or if a target is undefined there.
    """
    parameters, targets = calibration.parameters, calibration.targets
    free = [j for j, each in enumerate(parameters) if each.role == "fit"]
    x, x_prior = sigmas(parameters, start), sigmas(parameters, centre)[free]
    wanted, tolerance = (np.array([getattr(each, name) for each in targets]) for name in ("value", "tolerance"))
    seen: dict[bytes, Point] = {}

    def whole(z: FloatArray) -> FloatArray:
        full = x.copy()
        full[free] = z
        return from_sigmas(parameters, full)

    def at(z: FloatArray) -> Point:
        key = z.tobytes()
        if key not in seen:
            seen[key] = differentiate(model, calibration, whole(z), free)
        return seen[key]

    def residuals(z: FloatArray) -> FloatArray:
        return np.concatenate([np.nan_to_num((at(z).value - wanted) / tolerance, nan=UNDEFINED), z - x_prior])

    def slopes(z: FloatArray) -> FloatArray:
        return np.vstack([np.where(np.isnan(at(z).value)[:, None], 0.0, at(z).jacobian) / tolerance[:, None], np.eye(len(free))])

    low, high = (sigmas(parameters, np.array([getattr(each, end) for each in parameters]))[free] for end in ("low", "high"))
    found = least_squares(
        residuals, np.clip(x[free], low, high), slopes, bounds=(low, high), method="dogbox",
        ftol=closeness, xtol=closeness, gtol=None, max_nfev=MAX_STEPS,
    )  # fmt: skip
    of_targets = 0.5 * float(np.sum(found.fun[: len(targets)] ** 2))
    return Fit(
        start=np.asarray(start),
        values=whole(found.x),
        target_cost=of_targets,
        prior_cost=float(found.cost) - of_targets,
        evaluations=len(seen),
        undefined=sum(point.undefined for point in seen.values()),
        outcome=_outcome(found.status, at(found.x)),
    )


def _outcome(code: int, point: Point) -> str:
    if np.isnan(point.value).any():
        return "a target is undefined where the fit ended: move the priors"
    return "converged" if code > 0 else f"not converged after {MAX_STEPS} steps: narrow the bounds or move the priors"


def rounded(calibration: Calibration, values: FloatArray) -> FloatArray:
    """Parameters with the calibration's significant digits, within their bounds; on a linear scale those of the spread."""
    out = [
        float(f"{value:.{calibration.digits}g}")
        if each.scale == "log"
        else round(float(value), calibration.digits - 1 - int(np.floor(np.log10(each.spread))))
        for each, value in zip(calibration.parameters, values, strict=True)
    ]
    return np.clip(out, [each.low for each in calibration.parameters], [each.high for each in calibration.parameters])
