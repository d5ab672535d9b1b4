"""From flights to responses: the programme of tests that a source flies at each point, read by the handling-qualities criteria."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from levelone._version import __version__
from levelone.campaign.models.keys import plain, versions
from levelone.campaign.models.protocol import (
    TAIL,
    Evaluations,
    FloatArray,
    HistorySource,
    IntArray,
    LinearSource,
    ModelFailure,
    joined,
    settled,
)
from levelone.campaign.models.readings import (
    Result,
    has_level,
    numbers,
    read,
    read_linear,
    undefined,
)
from levelone.campaign.models.sources import sources_digest
from levelone.campaign.models.travel import FieldsTravel
from levelone.config.model_table import response_names
from levelone.errors import InputError
from levelone.handling.damping import DynamicStability
from levelone.handling.levels import Boundaries
from levelone.handling.picks import flag_changed_choice
from levelone.handling.quickness import Quickness
from levelone.status import Status

if TYPE_CHECKING:
    from levelone.config.model_table import Test
    from levelone.handling.history import TimeHistory
    from levelone.handling.manoeuvres import Manoeuvre

T = TypeVar("T")
#: criteria that read extrema, whose choice is compared with that of the nominal point
PICKING = ("attitude_quickness", "dynamic_stability")


@dataclass(frozen=True, eq=False)
class HistoryModel(FieldsTravel):
    """A flight simulation under the tests of a study.

    Parameters
    ----------
    source
        What is flown.
    tests
        Manoeuvres and what is read on them; equal manoeuvres are flown once.
    factors
        What each column of a point sets in the source.
    nominal
        The nominal point, whose choice of peaks is the one that others are compared with.
    boundaries
        Level boundaries.
    keep_histories
        Whether records travel back with the responses.
    picks
        What the tests that pick extrema read at the nominal point, by test, where it is known already: a campaign flies it
        once, and no process again.

    Notes
    -----
    Where ``picks`` are not given, the nominal point is flown when an evaluation first needs its peaks. Where it fails no value is
    flagged as read from another peak.
    """

    source: HistorySource
    tests: tuple[Test, ...]
    factors: tuple[str, ...]
    nominal: tuple[float, ...]
    boundaries: Boundaries
    keep_histories: bool = False
    picks: Mapping[str, Result] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the responses: the quantity, with the test's name behind it where several tests give it."""
        return tuple(name for name, _, _ in response_names(self.tests))

    @property
    def units(self) -> tuple[str, ...]:
        """Their units."""
        return tuple(unit for _, unit, _ in response_names(self.tests))

    @property
    def judged(self) -> tuple[str, ...]:
        """Names of the tests that have a Level."""
        return tuple(test.name for test in self.tests if has_level(test, self.boundaries))

    @property
    def key(self) -> Mapping[str, Any]:
        """Source, tests, factors, nominal point and boundaries, and the code of this package that flies and reads."""
        return {
            "levelone": __version__,
            "sources": sources_digest(),
            "versions": versions("numba", "numpy", "scipy"),
            "source": self.source.key,
            "tests": plain(self.tests),
            "factors": plain(self.factors),
            "nominal": plain(self.nominal),
            "boundaries": plain(self.boundaries),
        }

    @cached_property
    def reference(self) -> Mapping[str, Result]:
        """What the tests that pick extrema read at the nominal point, by test; those that fail there are left out."""
        picking = tuple(test for test in self.tests if test.criterion in PICKING)
        if self.picks is not None:
            return {test.name: self.picks[test.name] for test in picking if test.name in self.picks}
        results = self._results(np.array(self.nominal, dtype=np.float64), picking)[0]
        return {name: result for name, result in results.items() if not isinstance(result, ModelFailure)}

    def evaluate(self, points: FloatArray) -> Evaluations:
        """Fly and read the tests at each of ``points`` [n, factors].

        Raises
        ------
        InputError
            A mistake that would fail every evaluation alike: a window longer than the record, a name that the source lacks.
        """
        rows = np.atleast_2d(np.asarray(points, dtype=np.float64))
        return joined([self._evaluated(point) for point in rows])

    def histories(self, point: FloatArray) -> Mapping[str, TimeHistory]:
        """Records of the tests at one point, by test; those whose flight failed are left out."""
        return self._results(np.asarray(point, dtype=np.float64), self.tests)[1]

    def _evaluated(self, point: FloatArray) -> Evaluations:
        began = perf_counter()
        results, records = self._results(point, self.tests)
        values, codes, levels = [], [], []
        for test in self.tests:
            value, code, level = self._numbers(test, results[test.name], records.get(test.name))
            values.append(value)
            codes.append(code)
            if has_level(test, self.boundaries):
                levels.append(level)
        agreed, status = settled(np.concatenate(values)[None], np.concatenate(codes)[None])
        return Evaluations(
            agreed,
            status,
            np.array([levels], dtype=np.int64).reshape(1, len(levels)),
            np.array([perf_counter() - began]),
            (_message(results),),
            (records,) if self.keep_histories else (),
        )

    def _numbers(self, test: Test, result: Result | ModelFailure, record: TimeHistory | None) -> tuple[FloatArray, IntArray, int]:
        if isinstance(result, ModelFailure):
            return undefined(test, result.status)
        if isinstance(result, Quickness | DynamicStability):
            nominal = self.reference.get(test.name)
            if nominal is not None:
                result = flag_changed_choice(result, nominal)  # type: ignore[type-var]  # the same criterion
        values, codes, level = numbers(test, result)
        if record is not None:  # a caution of the whole run, where nothing else is said
            codes = np.where(codes == Status.OK, record.status[0], codes)
        return values, codes, level

    def _results(self, point: FloatArray, tests: Sequence[Test]) -> tuple[dict[str, Result | ModelFailure], dict[str, TimeHistory]]:
        """What each test read or why it could not, and the records, by test."""
        flown: dict[Manoeuvre, TimeHistory | ModelFailure] = {}
        results: dict[str, Result | ModelFailure] = {}
        records: dict[str, TimeHistory] = {}
        for test in tests:
            if test.method == "linear":
                results[test.name] = _attempt(lambda each=test: self._linear(point, each))  # type: ignore[misc]
                continue
            manoeuvre = replace(test.manoeuvre, name="")
            if manoeuvre not in flown:
                flown[manoeuvre] = _attempt(lambda each=test.manoeuvre: self.source.fly(point, each))  # type: ignore[misc]
            record = flown[manoeuvre]
            if isinstance(record, ModelFailure):
                results[test.name] = record
                continue
            records[test.name] = record
            results[test.name] = _attempt(lambda each=test, of=record: read(each, of, self.boundaries))  # type: ignore[misc]
        return results, records

    def _linear(self, point: FloatArray, test: Test) -> Result:
        return read_linear(test, cast(LinearSource, self.source), point, self.boundaries)


def _attempt(call: Callable[[], T]) -> T | ModelFailure:
    """A result, or why there is none; only a user's mistake is an error."""
    try:
        return call()
    except ModelFailure as failure:
        return failure
    except InputError:
        raise
    except Exception as error:  # whatever somebody else's simulation runs into is a failure of this evaluation
        return ModelFailure(Status.MODEL_FAILED, f"{type(error).__name__}: {error}")


def _message(results: Mapping[str, Result | ModelFailure]) -> str:
    """What the failed tests had to say; the same words of several tests once."""
    said: dict[str, list[str]] = {}
    for name, result in results.items():
        if isinstance(result, ModelFailure):
            said.setdefault(result.message, []).append(name)
    return "\n".join(f"{', '.join(names)}: {words}" for words, names in said.items())[-TAIL:]
