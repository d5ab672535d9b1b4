"""Which targets cannot be had together: one of them forced through a range, the others fitted as closely as the priors allow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from levelone.campaign.calibration import Fit, fit, rounded
from levelone.campaign.models.builtin import BuiltinModel
from levelone.config.calibration_file import Calibration
from levelone.config.calibration_sections import Tradeoff
from levelone.vehicle.tables import FloatArray

#: relative change of the cost at which a point of a curve counts as found: well below the width of a line
CLOSENESS = 1e-3
#: name of the curve on which all priors are those of the file
ORDINARY = "priors of the file"


@dataclass(frozen=True, eq=False)
class Case:
    """One point of a trade-off: curve, value asked for, what is fitted, where the fit begins, and the centre of its prior."""

    curve: str
    asked: float
    calibration: Calibration
    start: FloatArray
    centre: FloatArray

    def solved(self, model: BuiltinModel) -> Fit:
        """Its fit."""
        return fit(model, self.calibration, self.start, self.centre, CLOSENESS)

    def rounded(self, found: Fit) -> FloatArray:
        """Its fitted parameters with the digits of the calibration."""
        return rounded(self.calibration, found.values)


def cases_of(calibration: Calibration, solution: FloatArray) -> list[Case]:
    """Every point of every curve, each fitted from ``solution`` [parameters]; none where the file asks for no trade-off."""
    return [] if calibration.tradeoff is None else list(_cases(calibration, calibration.tradeoff, solution))


def _cases(calibration: Calibration, tradeoff: Tradeoff, solution: FloatArray) -> Iterator[Case]:
    for family in (None, *tradeoff.families):
        moved = calibration if family is None else replace(calibration, parameters=family.parameters)
        centre = np.array([each.prior for each in moved.parameters])
        own = np.array([each.prior for each in calibration.parameters])
        start = np.where(centre == own, solution, centre)
        for asked in tradeoff.values:
            targets = list(moved.targets)
            targets[tradeoff.index] = replace(targets[tradeoff.index], value=asked, tolerance=tradeoff.tolerance)
            name = ORDINARY if family is None else family.name
            yield Case(name, asked, replace(moved, targets=tuple(targets)), start, centre)


def tradeoff_json(calibration: Calibration, cases: list[Case], points: list[dict[str, Any]]) -> dict[str, Any]:
    """The curves for calibration.json: ``points`` are the described fits of ``cases``, in their order."""
    tradeoff = calibration.tradeoff
    if tradeoff is None:
        return {}
    curves: dict[str, list[dict[str, Any]]] = {}
    for case, point in zip(cases, points, strict=True):
        curves.setdefault(case.curve, []).append({"asked": case.asked} | point)
    moved = {
        family.name: {
            after.path: {"prior": after.prior, "high": after.high}
            for before, after in zip(calibration.parameters, family.parameters, strict=True)
            if after != before
        }
        for family in tradeoff.families
    }
    return {
        "response": calibration.targets[tradeoff.index].response,
        "tolerance": tradeoff.tolerance,
        "families": moved,
        "curves": curves,
    }
