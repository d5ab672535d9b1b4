"""A study's samples: screening, Monte Carlo, surrogates and decomposition, each from its own seed, and what they come to."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from levelone.campaign import analysis
from levelone.campaign.models.builtin import RESPONSES, Assessment
from levelone.config.study_file import Method
from levelone.status import Status
from levelone.uncertainty import Design, FactorSpace, Responses, latin_hypercube, morris_design, sobol_design, stage_seed
from levelone.uncertainty.distributions import FloatArray
from levelone.uncertainty.failures import Policy

Progress = Callable[[str, int, int], None]
#: criterion of each response of the built-in vehicle
CRITERION_OF = {name: criterion for name, (_, criterion) in RESPONSES.items()}


class SampledStudy(Protocol):
    """What sampling and analysis need to know of a study, of the built-in vehicle or of another model."""

    @property
    def space(self) -> FactorSpace: ...

    @property
    def method(self) -> Method: ...

    @property
    def policy(self) -> Policy: ...


class Assessor(Protocol):
    """Whatever judges a sample."""

    def assess(self, points: FloatArray, progress: Callable[[int], None]) -> Assessment:
        """Responses and Levels at ``points`` [n, factors]; ``progress`` is called with the number of runs done."""


@dataclass
class Clock:
    """Wall time of each stage, s."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time one stage."""
        start = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - start, 3)


@dataclass(frozen=True)
class Sampled:
    """The nominal assessment, the two designs with theirs, and the decomposition of ``read``, the responses it was asked for.

    There is no screening of correlated factors, which cannot be moved one by one.
    """

    nominal: Assessment
    screening: Design | None
    screened: Assessment | None
    sample: Design
    assessed: Assessment
    read: Assessment
    found: analysis.Decomposition


def sample_study(
    study: SampledStudy,
    model: Assessor,
    nominal: Assessment,
    seed: int,
    threads: int | None,
    progress: Progress,
    clock: Clock,
    names: tuple[str, ...] = tuple(RESPONSES),
) -> Sampled:
    """Screen, sample and decompose; ``names`` are the responses that get surrogates and indices."""
    method = study.method
    screening, sample = designs(study, seed)
    screened = None
    if screening is not None:
        with clock.stage("morris"):
            screened = _assess(model, screening, "screening (Morris)", progress)
    with clock.stage("monte_carlo"):
        assessed = _assess(model, sample, "Monte Carlo", progress)
    read = _only(assessed, names)
    with clock.stage("decomposition"):
        base = None if study.space.correlated else sobol_design(study.space, method.base_points, stage_seed(seed, "sobol"))
        options = {"correlation": method.kernel, "trend": method.trend}
        found = analysis.decompose(
            sample, read, base, study.policy, stage_seed(seed, "surrogates"), method.bootstrap, options, threads, progress
        )
    return Sampled(nominal, screening, screened, sample, assessed, read, found)


def designs(study: SampledStudy, seed: int) -> tuple[Design | None, Design]:
    """The Morris design, None for correlated factors, and the Latin hypercube."""
    method, screening = study.method, None
    if not study.space.correlated:
        screening = morris_design(study.space, method.trajectories, method.levels, stage_seed(seed, "morris"))
    return screening, latin_hypercube(study.space, method.samples, stage_seed(seed, "monte carlo"))


def planned_points(study: SampledStudy, seed: int) -> FloatArray:
    """[n, factors] all points that a study evaluates, its designs one after the other."""
    return np.vstack([design.points for design in designs(study, seed) if design is not None])


def _assess(model: Assessor, design: Design, stage: str, progress: Progress) -> Assessment:
    progress(stage, 0, design.runs)
    return model.assess(design.points, lambda done: progress(stage, min(done, design.runs), design.runs))


def _only(assessed: Assessment, names: tuple[str, ...]) -> Assessment:
    """The assessment with some of its responses."""
    r = assessed.responses
    columns = [r.names.index(name) for name in names]
    units = tuple(r.units[j] for j in columns)
    return replace(assessed, responses=Responses(r.values[:, columns], r.status[:, columns], names, units))


def response_results(study: SampledStudy, s: Sampled, criterion_of: Mapping[str, str] = CRITERION_OF) -> dict[str, Any]:
    """The block of each response in results.json, for those that were decomposed, with the criterion that gives it."""
    effects = dict.fromkeys(s.read.responses.names)
    if s.screening is not None and s.screened is not None:
        effects |= analysis.screen(s.screening, s.screened, study.policy, study.method.bootstrap)
    out: dict[str, Any] = {}
    for j, name in enumerate(s.read.responses.names):
        unit = s.read.responses.units[j]
        failures, cautions = analysis.outcomes(s.read, name)
        block: dict[str, Any] = {
            "unit": unit,
            "criterion": criterion_of[name],
            "nominal": float(s.nominal.responses.column(name)[0]),
            "status": Status(int(s.nominal.responses.codes(name)[0])).text,
            "morris": analysis.morris_json(study.space, effects[name]),
            "morris_failed": 0 if s.screened is None else int(s.screened.responses.failed(name).sum()),
            "morris_unit": f"{unit} per full factor range",
            "monte_carlo": analysis.statistics(s.read.responses.column(name)),
            "failures": failures,
            "cautions": cautions,
            "failure_corner": analysis.corner(s.sample, s.read, name),
            "surrogate": analysis.surrogate_json(study.space, s.found.surrogates[j]),
            "sobol": analysis.sobol_json(study.space, s.found.indices[j]),
            "rank_agreement": analysis.agreement(effects[name], s.found.indices[j]),
        }
        if study.space.correlated:
            block["surrogate"]["status"] = analysis.CORRELATED
        if study.policy == "refuse" and failures:
            nan = {"S1": np.nan, "ST": np.nan, "S1_ci": [np.nan, np.nan], "ST_ci": [np.nan, np.nan]}
            block["sobol"] = {factor: dict(nan) for factor in study.space.names}
            block["surrogate"]["status"] = f"refused: {sum(failures.values())} runs failed and the study's policy is 'refuse'"
        if name in s.found.bounded:
            low, high = (analysis.sobol_json(study.space, s, intervals=False) for s in s.found.bounded[name])
            block["sobol_bounded"] = {"low": low, "high": high}
        out[name] = block
    return out
