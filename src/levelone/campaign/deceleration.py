"""Deceleration to hover over the factor box: predicted handling qualities and the manoeuvre's performance, side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
import xarray as xr

from levelone.campaign import analysis
from levelone.campaign.analysis import LEVEL_KEYS, Json
from levelone.campaign.checks import reach
from levelone.campaign.deceleration_flights import PERFORMANCE_KEYS, Flights, assess, history_group, measured_dataset
from levelone.campaign.models.builtin import Assessment, BuiltinModel, IntArray
from levelone.config.study_file import Study
from levelone.config.study_sections import Deceleration
from levelone.errors import InputError
from levelone.handling.capture import MEASURES, SLOW, Performance, Tolerances
from levelone.status import Status
from levelone.uncertainty import Design, Responses, rank_agreement, shares, sobol_design, stage_seed

#: measures whose variance is shared out among the factors
DECOMPOSED = ("time", "overshoot", "theta", "height")
#: base points, starts and kernel of their decomposition: cheaper than the study's, since the measures come beside its responses;
#: six starts and a second kernel changed no index by more than 0.02
BASE_POINTS, STARTS, KERNEL = 2048, 2, "matern52"
#: spread of a measure, as a part of its adequate tolerance, that is rounding: a symmetric aircraft has no lateral track to rank
ROUNDING = 1e-9
Progress = Callable[[str, int, int], None]


def deceleration_section(
    study: Study,
    model: BuiltinModel,
    sample: Design,
    assessed: Assessment,
    seed: int,
    progress: Progress = lambda stage, done, total: None,
) -> tuple[Json, dict[str, dict[str, xr.Dataset]]]:
    """Fly the nominal vehicle and the points of a sample from every speed of the study, with the pilot in the loop.

    Parameters
    ----------
    study
        With its section ``deceleration``.
    model
        Of the study.
    sample, assessed
        The Monte Carlo sample, and the handling qualities predicted there.
    seed
        Of the study; the decomposition takes its own seeds from it.
    progress
        Called with the stage's name, what is done and what there is to do.

    Returns
    -------
    tuple
        The block for results.json, and for each file the datasets that are its groups: ``deceleration.nc`` (measures, statuses and
        performance of every run) and ``deceleration_histories.nc`` (the nominal flight and those of ``KEPT``).

    Raises
    ------
    InputError
        The study has no such section.
    """
    given = study.deceleration
    if given is None:
        raise InputError("deceleration", "the study has no such section")
    each, total = range(len(given.speeds)), sample.runs * len(given.speeds)
    nominal = [assess(model, given, i, study.nominal[None]) for i in each]

    def flown_from(i: int) -> Flights:
        def reached(done: int) -> None:
            progress("deceleration", i * sample.runs + min(done, sample.runs), total)

        return assess(model, given, i, sample.points, reached)

    flown = [flown_from(i) for i in each]
    names = [response_key(given, i, name) for i in each for name in DECOMPOSED]
    found = _decompose(study, sample, names, flown, seed, model.threads, progress)
    runs = []
    for i in each:
        block = {"speed": given.speeds[i], "distance": given.distances[i], "group": group_name(given.speeds[i])}
        block["responses"] = _responses(study, nominal[i].measures, flown[i].measures, found, names, i)
        runs.append(
            block | _performance(nominal[i], flown[i]) | _beside(flown[i], assessed, given.adequate) | {"reach": _reach(flown[i])}
        )
    groups = [group_name(speed) for speed in given.speeds]
    measured = {name: measured_dataset(flown[i]) for i, name in enumerate(groups)}
    kept = {name: history_group(model, given, i, study.nominal, sample.points, flown[i]) for i, name in enumerate(groups)}
    return _setting(study, given) | {"runs": runs}, {"deceleration.nc": measured, "deceleration_histories.nc": kept}


def group_name(speed: float) -> str:
    """Group of a speed (m/s) in the two files."""
    return f"speed_{speed:g}"


def response_key(given: Deceleration, i: int, measure: str) -> str:
    """Name of a measure from the i-th speed among those of all speeds."""
    return f"{measure} from {given.speeds[i]:g} m/s"


def _decompose(
    study: Study, sample: Design, names: list[str], flown: list[Flights], seed: int, threads: int | None, progress: Progress
) -> analysis.Decomposition:
    """Surrogates and indices of ``DECOMPOSED``, those of the first speed before those of the next."""
    joined = Responses(
        np.column_stack([each.measures.column(name) for each in flown for name in DECOMPOSED]),
        np.column_stack([each.measures.codes(name) for each in flown for name in DECOMPOSED]),
        tuple(names),
        tuple(MEASURES[name] for _ in flown for name in DECOMPOSED),
    )
    points = min(BASE_POINTS, study.method.base_points)
    base = None if study.space.correlated else sobol_design(study.space, points, stage_seed(seed, "deceleration sobol"))
    options = {"correlation": KERNEL, "trend": study.method.trend, "starts": STARTS}
    assessed = Assessment(joined, {}, np.zeros(len(joined), dtype=np.int64), {})
    fit_seed, bootstrap = stage_seed(seed, "deceleration surrogates"), study.method.bootstrap

    def told(stage: str, done: int, of: int) -> None:
        progress(f"deceleration, {stage}", done, of)

    return analysis.decompose(sample, assessed, base, study.policy, fit_seed, bootstrap, options, threads, told)


def _responses(
    study: Study, nominal: Responses, measures: Responses, found: analysis.Decomposition, names: list[str], i: int
) -> dict[str, Any]:
    """The block of each measure from the i-th speed."""
    out: dict[str, Any] = {}
    for name, unit in MEASURES.items():
        failures, cautions = analysis.in_words(measures.counts(name))
        out[name] = {
            "unit": unit,
            "nominal": float(nominal.column(name)[0]),
            "status": Status(int(nominal.codes(name)[0])).text,
            "monte_carlo": analysis.statistics(measures.column(name)),
            "failures": failures,
            "cautions": cautions,
        }
        if name in DECOMPOSED:
            j = i * len(DECOMPOSED) + DECOMPOSED.index(name)
            out[name] |= _indices(study, found, j, names[j], sum(failures.values()))
    return out


def _indices(study: Study, found: analysis.Decomposition, j: int, key: str, failed: int) -> dict[str, Any]:
    """Surrogate and Sobol indices of one measure; NaN where runs failed and the study refuses that."""
    block = {
        "surrogate": analysis.surrogate_json(study.space, found.surrogates[j]),
        "sobol": analysis.sobol_json(study.space, found.indices[j]),
    }
    if study.policy == "refuse" and failed:
        nan = {"S1": np.nan, "ST": np.nan, "S1_ci": [np.nan, np.nan], "ST_ci": [np.nan, np.nan]}
        block["sobol"] = {factor: dict(nan) for factor in study.space.names}
        block["surrogate"]["status"] = f"refused: {failed} runs failed and the study's policy is 'refuse'"
    if key in found.bounded:
        low, high = (analysis.sobol_json(study.space, s, intervals=False) for s in found.bounded[key])
        block["sobol_bounded"] = {"low": low, "high": high}
    return block


def _performance(nominal: Flights, flown: Flights) -> dict[str, Any]:
    """Performance of the nominal run, and shares of the sample: of the runs as a whole, and by each measure alone."""
    words = PERFORMANCE_KEYS
    return {
        "performance": words[Performance(int(nominal.performance[0]))],
        "measure_performance": {n: words[Performance(int(c))] for n, c in zip(MEASURES, nominal.verdicts[0], strict=True)},
        "shares": _shares(flown.performance),
        "measure_shares": {name: _shares(codes) for name, codes in zip(MEASURES, flown.verdicts.T, strict=True)},
    }


def _shares(codes: IntArray) -> dict[str, Any]:
    names = list(PERFORMANCE_KEYS.values())
    found = shares([PERFORMANCE_KEYS[Performance(int(code))] for code in codes], names)
    rows = zip(names, found.share.tolist(), found.counts.tolist(), found.ci.tolist(), strict=True)
    return {"n": found.n} | {name: {"share": share, "runs": runs, "ci": ci} for name, share, runs, ci in rows}


def _beside(flown: Flights, assessed: Assessment, adequate: Tolerances) -> dict[str, Any]:
    """Predicted qualities and performance of the same runs: rank correlations with each measure, counts of Level by performance."""
    rho: dict[str, dict[str, float]] = {}
    pairs: dict[str, dict[str, int]] = {}
    for measure in MEASURES:
        y = flown.measures.column(measure)
        rho[measure], pairs[measure] = {}, {}
        for response in assessed.responses.names:
            x = assessed.responses.column(response)
            both = np.isfinite(x) & np.isfinite(y)
            still = not both.any() or np.ptp(y[both]) <= ROUNDING * getattr(adequate, measure)
            rho[measure][response] = float("nan") if still else rank_agreement(x[both], y[both])
            pairs[measure][response] = int(both.sum())
    crossed = {criterion: _crossed(np.asarray(levels), flown.performance) for criterion, levels in assessed.levels.items()}
    return {"rank_correlation": rho, "rank_pairs": pairs, "levels": crossed}


def _crossed(levels: IntArray, performance: IntArray) -> dict[str, dict[str, int]]:
    """Number of runs for each Level and performance."""
    return {
        level_key: {key: int(((levels == level) & (performance == code)).sum()) for code, key in PERFORMANCE_KEYS.items()}
        for level, level_key in LEVEL_KEYS.items()
    }


def _reach(flown: Flights) -> dict[str, float]:
    return reach(flown.extremes) | {"saturated_runs": int((flown.extremes["saturated"] > 0).sum())}


def _setting(study: Study, given: Deceleration) -> dict[str, Any]:
    """Pilot, tolerances and what of them is assumed."""
    pilot = {name: value for name, value in asdict(given.pilot).items() if name != "distance"}
    return {
        "pilot": pilot,
        "tolerances": {"desired": asdict(given.desired), "adequate": asdict(given.adequate)},
        "hover_speed": SLOW,
        "hold": given.hold,
        "duration": given.duration,
        "assumed": [{"field": name, "why": why} for name, why in study.assumed if name.startswith("deceleration")],
    }
