"""What claims are decided on: results.json and the Monte Carlo sample. What is missing or undefined ends a decision, in words."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign.claims.decision import Undecided
from levelone.campaign.claims.inputs import other_inputs
from levelone.campaign.models.builtin import Assessment, IntArray
from levelone.errors import InputError
from levelone.handling.levels import Level
from levelone.uncertainty import Design, bounding_values
from levelone.vehicle.tables import FloatArray

EXTENDED = "attitude_quickness_extended"
"""Key of the Levels of attitude quickness by the boundaries extended beyond their range."""
LOST_SCREENING = 0.1
"""Part of the screening's runs that may be undefined before its ranking is no longer decided on."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """A study as claims see it.

    Parameters
    ----------
    summary
        ``results.json``, or as much of it as there is.
    factors, points
        Names, and [run, factor] Monte Carlo points in the units of the study file.
    responses, values
        Names, and [run, response] values, SI, NaN where undefined.
    levels
        Criterion (and ``EXTENDED``) to [run] codes of :class:`levelone.handling.levels.Level`.
    """

    summary: Mapping[str, Any]
    factors: tuple[str, ...]
    points: FloatArray
    responses: tuple[str, ...]
    values: FloatArray
    levels: Mapping[str, IntArray]

    def section(self, name: str) -> Any:
        """A part of ``results.json``."""
        if not self.summary.get(name):
            raise Undecided(f"the results have no section {name!r}: the study does not ask for it")
        return self.summary[name]

    def response(self, name: str) -> Mapping[str, Any]:
        """Block of one response in ``results.json``."""
        if name not in self.summary["responses"]:
            raise Undecided(f"the results have no response {name!r}")
        return self.summary["responses"][name]

    def nominal(self, name: str) -> float:
        """Value of the nominal vehicle."""
        block = self.response(name)
        return defined(block["nominal"], f"{name} of the nominal vehicle", block["status"])

    def check_inputs(self) -> None:
        """Refuse a sample or ranking over other inputs than those of the claims."""
        difference = other_inputs(self.summary["study"]["factors"])
        if difference:
            raise Undecided(f"the claim is about the 14 inputs of Table 2: {difference}")

    def sample(self, name: str) -> FloatArray:
        """[run] Monte Carlo values of a response, NaN where undefined; at least two are defined."""
        self.check_inputs()
        if name not in self.responses:
            raise Undecided(f"the Monte Carlo sample has no response {name!r}")
        values = self.values[:, self.responses.index(name)]
        if np.isfinite(values).sum() < 2:
            raise Undecided(f"{name} is undefined in all but {int(np.isfinite(values).sum())} Monte Carlo runs")
        return values

    def known(self, name: str) -> FloatArray:
        """Defined Monte Carlo values of a response."""
        values = self.sample(name)
        return values[np.isfinite(values)]

    def level(self, criterion: str) -> IntArray:
        """[run] Levels of one criterion."""
        self.check_inputs()
        if criterion not in self.levels:
            raise Undecided(f"the Monte Carlo sample has no Levels of {criterion!r}")
        return self.levels[criterion]

    def point(self, factor: str) -> FloatArray:
        """[run] values of one input."""
        self.check_inputs()
        return self.points[:, self.factors.index(factor)]

    def nominal_input(self, factor: str) -> float:
        """Nominal value of one input."""
        self.check_inputs()
        return next(float(each["nominal"]) for each in self.summary["study"]["factors"] if each["name"] == factor)

    def screening(self, response: str, index: str = "mu_star") -> dict[str, float]:
        """Morris index of every input on one response."""
        self.check_inputs()
        block = self.response(response)
        runs = self.summary["study"]["method"]["trajectories"] * (len(self.factors) + 1)
        if block["morris_failed"] > LOST_SCREENING * runs:
            raise Undecided(f"{block['morris_failed']} of {runs} screening runs of {response} are undefined")
        return _indices(block["morris"], index, f"{index} of {{}} on {response}", "the policy for failed runs gives none")

    def sobol(self, response: str, index: str = "ST") -> dict[str, float]:
        """Sobol index of every input on one response."""
        self.check_inputs()
        block = self.response(response)
        return _indices(block["sobol"], index, f"{index} of {{}} on {response}", block["surrogate"]["status"])

    def undefined(self, *names: str) -> int:
        """Monte Carlo runs in which any of these responses is undefined."""
        columns = [self.responses.index(name) for name in names if name in self.responses]
        return int(np.isnan(self.values[:, columns]).any(axis=1).sum())

    def bounded(self) -> tuple[Evidence, Evidence]:
        """The same with undefined runs at the lowest value seen and at Level 3, and at the highest value seen and at Level 1.

        Sobol indices become those that the study's policy "bound" found in the same way, where there are any.
        """
        lowest, highest = zip(*(bounding_values(column) for column in self.values.T), strict=True)
        return self._filled(lowest, "low", Level.LEVEL_3), self._filled(highest, "high", Level.LEVEL_1)

    def _filled(self, columns: Sequence[FloatArray], end: str, level: Level) -> Evidence:
        responses = dict(self.summary["responses"])
        for name, block in responses.items():
            if block.get("sobol_bounded"):
                responses[name] = {**block, "sobol": block["sobol_bounded"][end]}
        levels = {name: np.where(codes == Level.UNDEFINED, level, codes) for name, codes in self.levels.items()}
        summary = {**self.summary, "responses": responses}
        return replace(self, summary=summary, values=np.column_stack(columns), levels=levels)


def defined(value: float, what: str, why: str = "") -> float:
    """The value as a float, or the end of the decision where it is undefined."""
    if not math.isfinite(value):
        raise Undecided(f"{what} is undefined" + (f": {why}" if why and why != "ok" else ""))
    return float(value)


def _indices(block: Mapping[str, Any], index: str, what: str, why: str) -> dict[str, float]:
    return {name: defined(entry[index], what.format(name), why) for name, entry in block.items()}


def assessed_evidence(summary: Mapping[str, Any], sample: Design, assessed: Assessment) -> Evidence:
    """Evidence of a sample just assessed."""
    levels = {**assessed.levels, EXTENDED: assessed.extrapolated}
    return Evidence(summary, sample.names, sample.points, assessed.responses.names, assessed.responses.values, levels)


def stored_evidence(summary: Mapping[str, Any], sample: xr.Dataset) -> Evidence:
    """Evidence of a finished study: its results.json and monte_carlo.nc."""
    levels = {str(name): sample["level"].sel(criterion=name).to_numpy() for name in sample["criterion"].to_numpy()}
    return Evidence(
        summary,
        tuple(sample["factor"].to_numpy().tolist()),
        sample["points"].to_numpy(),
        tuple(sample["response"].to_numpy().tolist()),
        sample["values"].to_numpy(),
        levels | {EXTENDED: sample["extrapolated_level"].to_numpy()},
    )


def load_evidence(directory: Path) -> Evidence:
    """Evidence of a results folder.

    Raises
    ------
    InputError
        The folder is not that of a finished study, or cannot be read.
    """
    path = directory / "results.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        with xr.open_dataset(directory / "monte_carlo.nc", engine="h5netcdf") as data:
            return stored_evidence(summary, data.load())
    except (OSError, ValueError, KeyError) as error:
        raise InputError(str(directory), f"is not the folder of a finished study, or cannot be read: {error}") from None
