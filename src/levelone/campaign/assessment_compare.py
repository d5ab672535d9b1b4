"""Simulation against flight: responses, metrics with tolerances, and whether a pilot would notice the difference."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from levelone.campaign.assessment import Assessment
from levelone.campaign.assessment_tests import Reading
from levelone.errors import InputError
from levelone.handling.added_dynamics import OMEGA, AddedDynamics, added_dynamics
from levelone.handling.mismatch import Mismatch, mean_cost, mismatch_cost, response_error, verdict
from levelone.handling.tolerances import MetricRow, Tolerance, compare_metrics, load_tolerances, tolerance_of


@dataclass(frozen=True, eq=False)
class ResponseMatch:
    """One pair of frequency responses: cost of the mismatch, and the errors between the envelopes (None where these say nothing:
    ``noticed`` says why)."""

    key: str
    title: str
    mismatch: Mismatch
    added: AddedDynamics | None
    noticed: str

    @property
    def share(self) -> float:
        """Fraction of the frequencies that could be read at which the error lies inside the envelopes; NaN without any."""
        return math.nan if self.added is None else self.added.share

    @property
    def read(self) -> int:
        """Frequencies, of :data:`~levelone.handling.added_dynamics.POINTS`, that the share rests on."""
        return 0 if self.added is None else self.added.error.used


@dataclass(frozen=True)
class Pair:
    """A criterion read on both, and each of its values with difference, tolerance and verdict."""

    simulation: Reading
    flight: Reading
    rows: tuple[MetricRow, ...]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Simulation against flight.

    Parameters
    ----------
    responses
        Pairs of frequency responses.
    cost, verdict
        Mean cost J of them and what it means; NaN and "undefined" without any.
    pairs
        Readings of the same criterion, record by record.
    unpaired
        Readings that only one side has, in words.
    """

    responses: tuple[ResponseMatch, ...]
    cost: float
    verdict: str
    pairs: tuple[Pair, ...]
    unpaired: tuple[str, ...]


def compare(simulation: Assessment, flight: Assessment, tolerances: Mapping[str, Tolerance] | None = None) -> Comparison:
    """Compare what was read of a simulation with what was read of flight; ``tolerances`` by metric, those that ship by default.

    Raises
    ------
    InputError
        Another manoeuvre, axis or input, another number of steps or pulses, no frequency in common, or a tolerance in a unit that
        is not its metric's.

    Notes
    -----
    Responses are compared over the range that both excite. Of a response of rate, that of attitude made from it is the same
    comparison once more, and is left out. Steps and pulses are paired in the order in which they were given.
    """
    for name, one, other in (
        ("kind", simulation.kind, flight.kind),
        ("axis", simulation.axis, flight.axis),
        ("input", simulation.input_name, flight.input_name),
    ):
        if one != other:
            raise InputError("--reference", f"has another {name} than the data: {other}, not {one}")
    if simulation.kind != "sweep" and len(simulation.histories) != len(flight.histories):
        counts = f"{len(simulation.histories)} records against {len(flight.histories)}"
        raise InputError("--reference", f"{counts}: steps and pulses are compared one by one, in their order")
    matches = tuple(
        _match(simulation, flight, key) for key in simulation.responses if key in flight.responses and "_from_" not in key
    )
    cost = mean_cost([each.mismatch for each in matches])
    pairs, unpaired = _paired(simulation.readings, flight.readings, tolerances)
    return Comparison(matches, cost, verdict(cost), pairs, unpaired)


def _match(simulation: Assessment, flight: Assessment, key: str) -> ResponseMatch:
    one, other = simulation.responses[key], flight.responses[key]
    mismatch = mismatch_cost(response_error(one.response, other.response))
    try:
        added = added_dynamics(one.response, other.response)
    except InputError:
        low, high = OMEGA
        return ResponseMatch(key, one.title, mismatch, None, f"no frequency from {low:g} to {high:g} rad/s that both excite")
    return ResponseMatch(key, one.title, mismatch, added, added.verdict)


def _paired(
    simulation: Sequence[Reading], flight: Sequence[Reading], tolerances: Mapping[str, Tolerance] | None
) -> tuple[tuple[Pair, ...], tuple[str, ...]]:
    def keyed(readings: Sequence[Reading]) -> dict[tuple[str, str, int], Reading]:
        found: dict[tuple[str, str, int], Reading] = {}
        for reading in readings:
            place = sum(key[:2] == (reading.criterion, reading.title) for key in found)
            found[reading.criterion, reading.title, place] = reading
        return found

    ones, others = keyed(simulation), keyed(flight)
    pairs = tuple(_pair(ones[key], others[key], tolerances) for key in ones if key in others)
    only = [f"{key[0]}, {key[1]}: simulation only" for key in ones if key not in others]
    only += [f"{key[0]}, {key[1]}: flight only" for key in others if key not in ones]
    return pairs, tuple(only)


def _pair(simulation: Reading, flight: Reading, tolerances: Mapping[str, Tolerance] | None) -> Pair:
    """Values of both; what a requirement asks for is no metric. InputError for a tolerance that is stated in another unit."""
    known = load_tolerances() if tolerances is None else tolerances
    for each in flight.values:
        tolerance = tolerance_of(known, each.name, flight.axis)
        if tolerance is not None and tolerance.unit != each.unit:
            raise InputError(f"tolerance.{tolerance.name}.unit", f"is {tolerance.unit!r}, but {each.name} is in {each.unit!r}")
    sides = ([each for each in reading.values if not each.name.endswith("_required")] for reading in (flight, simulation))
    values = ({each.name: each.value for each in side} for side in sides)
    return Pair(simulation, flight, compare_metrics(*values, known, axis=flight.axis))
